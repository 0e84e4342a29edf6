//! What of a bolus each pixel sees: its lumen's length, shared out to the nodes of the tree.
//!
//! The stretches of a ray inside the wall are cut into short steps, and each step belongs to the node whose ball it is deepest
//! in (the least |x − c|² − r², so that the trunk keeps what is inside it beside the origin of a small branch) and, by its place along
//! the centre line, to that node's neighbour on its side: a bolus has no steps. A frame then needs one sparse product of these shares
//! with the nodes' fractions.

use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::vessel::{Displacement, SurfaceMesh};

use super::flow::Flow;
use super::nearest::{Nearest, STEP_MM};
use crate::c_arm::CArm;
use crate::cpu::wall_crossings;

/// Contrast medium that a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Medium {
    pub(crate) pixel: u32,
    /// Mean fraction along its lumen.
    pub(crate) fraction: f32,
    /// Length in tissue, mm.
    pub(crate) tissue_mm: f32,
}

/// Distance of the middle of a tissue behind its vessel's end over its radius.
const TISSUE_BEHIND: f64 = 0.8;
/// Squared deviations from that middle beyond which nothing is seen.
const TISSUE_REACH: f64 = 16.0;

/// The medium that is seen from one place of the C-arm.
#[derive(Debug)]
pub(crate) struct ContrastMap {
    flow: Arc<Flow>,
    shares: Arc<Shares>,
    displacement: Option<Displacement>,
}

/// The share of each node in the lumen of each pixel.
#[derive(Debug)]
pub(crate) struct Shares {
    /// Pixels inside the wall, rising, and where their shares end.
    pixels: Vec<(u32, u32)>,
    shares: Vec<(u32, f32)>,
    /// Ends of the tree, with the pixels that see the tissue behind: how long, in mm, a mm³ of medium there is.
    tissue: Vec<(usize, Vec<(u32, f32)>)>,
}

impl Shares {
    /// The shares of `flow`, which is of the vessel at rest, in the lumen that `wall` encloses, displaced where the vessel has moved.
    pub(crate) fn new(
        flow: &Flow,
        c_arm: &CArm,
        wall: &SurfaceMesh,
        displacement: Option<&Displacement>,
    ) -> Self {
        let material = |x: Vec3| displacement.map_or(x, |displacement| displacement.material(&x));
        let tissue = tissue(flow, c_arm, displacement);
        let mut map = Self { pixels: vec![], shares: vec![], tissue };
        let mut crossings = wall_crossings(c_arm, wall);
        crossings.sort_unstable_by(|a, b| {
            (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let source = c_arm.source_mm();
        // Others wait for it from here on: no work may be shared out to threads, of which one may be another that waits.
        let mut near = Nearest::new(flow);
        let mut own: Vec<(u32, f32)> = Vec::new();
        for of_pixel in crossings.chunk_by(|a, b| a.0 == b.0) {
            let pixel = of_pixel[0].0;
            let width = c_arm.size_px()[0];
            let centre = [f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5];
            let (_, direction) = c_arm.ray(centre);
            own.clear();
            let mut depth = 0;
            for pair in of_pixel.windows(2) {
                depth += if pair[0].2 { 1 } else { -1 };
                let length = f64::from(pair[1].1 - pair[0].1);
                if depth <= 0 || length <= 0.0 {
                    continue;
                }
                let steps = (length / STEP_MM).ceil();
                for k in 0..steps as usize {
                    let at = f64::from(pair[0].1) + (k as f64 + 0.5) * length / steps;
                    let shares = near.shares(&material(source + direction * at));
                    for (node, share) in shares.into_iter().filter(|share| share.1 > 0.0) {
                        let length = share * (length / steps) as f32;
                        match own.iter_mut().find(|share| share.0 == node) {
                            Some(share) => share.1 += length,
                            None => own.push((node, length)),
                        }
                    }
                }
            }
            let total: f32 = own.iter().map(|share| share.1).sum();
            if total > 0.0 {
                map.shares.extend(own.iter().map(|&(node, length)| (node, length / total)));
                map.pixels.push((pixel, map.shares.len() as u32));
            }
        }
        map.shares.shrink_to_fit();
        map.pixels.shrink_to_fit();
        map
    }

    fn mixed(&self, of_node: &[f32]) -> Vec<Medium> {
        let mut start = 0;
        let mix = |&(pixel, end): &(u32, u32)| {
            let shares = &self.shares[start..end as usize];
            start = end as usize;
            let fraction = shares.iter().map(|&(node, share)| share * of_node[node as usize]).sum();
            Medium { pixel, fraction, tissue_mm: 0.0 }
        };
        self.pixels.iter().map(mix).collect()
    }
}

impl ContrastMap {
    /// Medium of `flow`, shared out to pixels, in a vessel that may be displaced.
    pub(crate) fn new(flow: &Arc<Flow>, shares: Arc<Shares>, displacement: Option<&Displacement>) -> Self {
        let displacement = displacement.cloned();
        Self { flow: Arc::clone(flow), shares, displacement }
    }

    /// How the lumen of each pixel is shared out, which another injection does not change.
    pub(crate) fn into_shares(self) -> Arc<Shares> {
        self.shares
    }

    /// What the pixels see that see any, rising, with the tip at `tip_mm`.
    pub(crate) fn at(&self, time_s: f64, tip_mm: Option<Vec3>) -> Vec<Medium> {
        let displacement = self.displacement.as_ref();
        let tip_mm = tip_mm.map(|tip| displacement.map_or(tip, |displacement| displacement.material(&tip)));
        let mut carried = self.flow.carried();
        let transport = carried.at(&self.flow, time_s, tip_mm);
        let mut seen = self.shares.mixed(&transport.at(time_s));
        let volumes = transport.tissue_mm3();
        let filled = self.shares.tissue.iter().filter(|end| volumes[end.0] > 0.0);
        for (end, pixels) in filled {
            let volume = volumes[*end] as f32;
            seen.extend(pixels.iter().map(|&(pixel, length)| Medium {
                pixel,
                fraction: 0.0,
                tissue_mm: length * volume,
            }));
        }
        // Stable: the sums run in the order of the ends.
        seen.sort_by_key(|medium| medium.pixel);
        let join = |all: &[Medium]| {
            all[1..].iter().fold(all[0], |sum, one| Medium {
                pixel: sum.pixel,
                fraction: sum.fraction + one.fraction,
                tissue_mm: sum.tissue_mm + one.tissue_mm,
            })
        };
        seen.chunk_by(|a, b| a.pixel == b.pixel).map(join).collect()
    }

    /// The largest fraction that a pixel's lumen ever has, each node at its own best moment.
    pub(crate) fn largest(&self) -> Vec<Medium> {
        self.shares.mixed(self.flow.largest())
    }
}

/// The pixels that see the tissue behind each end: a Gaussian about a place behind it, of which the radius is two deviations.
fn tissue(flow: &Flow, c_arm: &CArm, displacement: Option<&Displacement>) -> Vec<(usize, Vec<(u32, f32)>)> {
    let Some(radius_mm) = flow.tissue_mm else { return vec![] };
    let variance = (radius_mm / 2.0).powi(2);
    let [width, height] = c_arm.size_px();
    let ends = flow.nodes.iter().enumerate().filter(|(_, node)| node.is_end);
    ends.map(|(end, node)| {
        let before = node.upstream.map_or(node.position_mm, |up| flow.nodes[up].position_mm);
        let onwards = (node.position_mm - before).try_normalize(0.0).unwrap_or_default();
        let middle = node.position_mm + onwards * (TISSUE_BEHIND * radius_mm);
        let middle = displacement.map_or(middle, |displacement| displacement.place(&middle));
        let pixels = (0..width * height).filter_map(|pixel| {
            let centre = [f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5];
            let (source, direction) = c_arm.ray(centre);
            let off = (middle - source).cross(&direction).norm_squared() / direction.norm_squared();
            let length = (-off / (2.0 * variance)).exp() / (std::f64::consts::TAU * variance);
            (off < TISSUE_REACH * variance).then_some((pixel, length as f32))
        });
        (end, pixels.collect())
    })
    .collect()
}
