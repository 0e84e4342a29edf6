//! Spatial index of a tree.
//!
//! Axes are divided into blocks of a few radii, each in a ball with its lumen. The distance of a position from a
//! branch is at least that from its balls; near a block the relevant parts of branches are known.

use std::sync::OnceLock;

use super::axis::Axis;
use crate::Vec3;
use crate::vessel::generate::BLEND;

/// Number of steps of the axis per block: there are four per smallest radius of the branch.
const STEPS: usize = 16;
/// Largest number of blocks for which all parts are found in advance, so that steps do not allocate.
const AT_ONCE: usize = 3000;

/// A stretch of a branch from one of its knots to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Part {
    pub(super) branch: u32,
    pub(super) from: u32,
    pub(super) to: u32,
}

#[derive(Debug)]
struct Block {
    part: Part,
    centre: Vec3,
    /// Radius of the ball that contains its lumen, mm.
    reach: f64,
    /// Largest radius of the vessel in it, mm.
    radius: f64,
    near: OnceLock<Box<[Part]>>,
}

/// The blocks of all axes.
#[derive(Debug)]
pub(crate) struct Blocks {
    blocks: Vec<Block>,
    /// The first block of each branch, and the global index of its first knot.
    first: Vec<(usize, u32)>,
    /// Steepness of each branch.
    steepness: Vec<f64>,
    /// Distance from the vessel up to which parts are complete, mm.
    reach: f64,
}

impl Blocks {
    /// For positions at most `reach_mm` outside the lumen.
    pub(super) fn new(axes: &[Axis], reach_mm: f64) -> Self {
        let (mut blocks, mut first, mut knots) = (Vec::new(), Vec::new(), 0);
        for (branch, axis) in axes.iter().enumerate() {
            first.push((blocks.len(), knots));
            let last = axis.len() - 1;
            knots += axis.len() as u32;
            for from in (0..last).step_by(STEPS) {
                let to = (from + STEPS).min(last);
                blocks
                    .push(Block::new(axis, Part { branch: branch as u32, from: from as u32, to: to as u32 }));
            }
        }
        let steepness = axes.iter().map(Axis::steepness).collect();
        let all = Self { blocks, first, steepness, reach: reach_mm };
        if all.blocks.len() <= AT_ONCE {
            (0..all.blocks.len()).for_each(|block| {
                all.near(block);
            });
        }
        all
    }

    /// Upper bound of the slope of a branch's field in its lumen, relative to a distance.
    pub(super) fn steepness(&self, branch: usize) -> f64 {
        self.steepness[branch]
    }

    /// Global index of a knot.
    pub(super) fn piece(&self, branch: u32, knot: u32) -> u32 {
        self.first[branch as usize].1 + knot
    }

    /// Branch and knot of a global index.
    pub(super) fn knot(&self, piece: u32) -> (usize, usize) {
        let branch = self.first.partition_point(|(_, first)| *first <= piece) - 1;
        (branch, (piece - self.first[branch].1) as usize)
    }

    /// The parts of branches near a knot.
    pub(super) fn about(&self, branch: usize, knot: usize) -> &[Part] {
        let first = self.first[branch].0;
        let end = self.first.get(branch + 1).map_or(self.blocks.len(), |(next, _)| *next);
        self.near((first + knot / STEPS).min(end - 1))
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.blocks.len()
    }

    /// The part of a branch in a block.
    pub(super) fn part(&self, block: usize) -> Part {
        self.blocks[block].part
    }

    /// The block whose ball is nearest to a position. `None` for none, or if the position is not finite.
    pub(super) fn nearest_ball(&self, x: &Vec3) -> Option<usize> {
        let gap = |block: &Block| (x - block.centre).norm() - block.reach;
        let gaps = self.blocks.iter().map(gap).enumerate().filter(|(_, gap)| gap.is_finite());
        gaps.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(block, _)| block)
    }

    /// Whether the lumen in a block may be nearer to a position than this, mm, negative within it.
    pub(super) fn may_be_nearer(&self, block: usize, x: &Vec3, mm: f64) -> bool {
        let Block { centre, reach, .. } = &self.blocks[block];
        let within = reach + mm;
        within > 0.0 && (x - centre).norm_squared() < within * within
    }

    fn near(&self, block: usize) -> &[Part] {
        let own = &self.blocks[block];
        own.near.get_or_init(|| {
            let mut parts: Vec<Part> = Vec::new();
            for other in &self.blocks {
                let away = (other.centre - own.centre).norm() - own.reach - other.reach - self.reach;
                if away > BLEND * own.radius.min(other.radius) {
                    continue;
                }
                match parts.last_mut() {
                    Some(last) if last.branch == other.part.branch && last.to == other.part.from => {
                        last.to = other.part.to;
                    }
                    _ => parts.push(other.part),
                }
            }
            parts.into_boxed_slice()
        })
    }
}

impl Block {
    fn new(axis: &Axis, part: Part) -> Self {
        let (from, to) = (part.from as usize, part.to as usize);
        let step = axis.step();
        let [low, high] = axis.range();
        // The extension beyond an end belongs to the block there.
        let begin = if from == 0 { low } else { step * from as f64 };
        let end = if to + 1 == axis.len() { high } else { step * to as f64 };
        let centre = axis.at(0.5 * (begin + end)).position;
        let knots = (from..=to)
            .map(|k| (axis.position(k), axis.widest(k.saturating_sub(1).max(from), (k + 1).min(to))));
        let tips = [begin, end].map(|s| axis.at(s)).map(|place| (place.position, place.radius[0]));
        let (mut reach, mut radius) = (0.0_f64, 0.0_f64);
        for (position, width) in knots.chain(tips) {
            radius = radius.max(width);
            reach = reach.max((position - centre).norm() + width);
        }
        // Beyond an open end it widens by at most 4/27 of its taper.
        Self { part, centre, reach: reach + step + 0.1 * radius, radius, near: OnceLock::new() }
    }
}
