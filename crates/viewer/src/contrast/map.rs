//! What of a bolus each pixel sees: its lumen's length, shared out to the nodes of the tree.
//!
//! The stretches of a ray inside the wall are cut into short steps, and each step belongs to the node whose ball it is deepest
//! in (the least |x − c|² − r², so that the trunk keeps what is inside it beside the origin of a small branch) and, by its place along
//! the centre line, to that node's neighbour on its side: a bolus has no steps. A frame then needs one sparse product of these shares
//! with the nodes' fractions.

use std::collections::HashMap;
use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::flow::{Flow, Node};
use super::transport::Transport;
use crate::c_arm::CArm;
use crate::cpu::wall_crossings;

/// Length of a step and side of the cells that remember their nearest node, mm.
const STEP_MM: f64 = 1.25;

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

/// The share of each node in the lumen of each pixel.
#[derive(Debug)]
pub(crate) struct ContrastMap {
    flow: Arc<Flow>,
    transport: Transport,
    /// Pixels inside the wall, rising, and where their shares end.
    pixels: Vec<(u32, u32)>,
    shares: Vec<(u32, f32)>,
    /// Ends of the tree, with the pixels that see the tissue behind: how long, in mm, a mm³ of medium there is.
    tissue: Vec<(usize, Vec<(u32, f32)>)>,
}

impl ContrastMap {
    /// The shares of `flow` in the lumen that `wall` encloses.
    pub(crate) fn new(flow: &Arc<Flow>, c_arm: &CArm, wall: &SurfaceMesh) -> Self {
        let transport = Transport::new(flow);
        let tissue = tissue(flow, c_arm);
        let mut map = Self { flow: Arc::clone(flow), transport, pixels: vec![], shares: vec![], tissue };
        let mut near = Nearest::new(&flow.nodes);
        let mut crossings = wall_crossings(c_arm, wall);
        crossings.sort_unstable_by(|a, b| {
            (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let source = c_arm.source_mm();
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
                    let shares = near.shares(&(source + direction * at));
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

    /// What the pixels see that see any, rising. What is injected through a tip has come from `tip_mm` since the time asked for before.
    pub(crate) fn at(&mut self, time_s: f64, tip_mm: Option<Vec3>) -> Vec<Medium> {
        self.transport.advance(&self.flow, time_s, tip_mm);
        let mut seen = self.mixed(&self.transport.at(time_s));
        let volumes = self.transport.tissue_mm3();
        let filled = self.tissue.iter().filter(|end| volumes[end.0] > 0.0);
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
        self.mixed(&Transport::largest(&self.flow))
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

/// The pixels that see the tissue behind each end: a Gaussian about a place behind it, of which the radius is two deviations.
fn tissue(flow: &Flow, c_arm: &CArm) -> Vec<(usize, Vec<(u32, f32)>)> {
    let Some(radius_mm) = flow.tissue_mm else { return vec![] };
    let variance = (radius_mm / 2.0).powi(2);
    let [width, height] = c_arm.size_px();
    let ends = flow.nodes.iter().enumerate().filter(|(_, node)| node.is_end);
    ends.map(|(end, node)| {
        let before = node.upstream.map_or(node.position_mm, |up| flow.nodes[up].position_mm);
        let onwards = (node.position_mm - before).try_normalize(0.0).unwrap_or_default();
        let middle = node.position_mm + onwards * (TISSUE_BEHIND * radius_mm);
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

/// Nearest nodes by cells, found where they are first asked for.
struct Nearest<'a> {
    nodes: &'a [Node],
    /// The node after each, in its widest branch.
    downstream: Vec<Option<usize>>,
    cells: HashMap<[i32; 3], u32>,
}

impl<'a> Nearest<'a> {
    fn new(nodes: &'a [Node]) -> Self {
        let mut downstream: Vec<Option<usize>> = vec![None; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            if let Some(before) = node.upstream {
                let wider = |other: usize| nodes[other].radius_mm >= node.radius_mm;
                if !downstream[before].is_some_and(wider) {
                    downstream[before] = Some(i);
                }
            }
        }
        Self { nodes, downstream, cells: HashMap::new() }
    }

    /// The nearest node and the neighbour towards which a point lies along the centre line, with their shares of it.
    fn shares(&mut self, point: &Vec3) -> [(u32, f32); 2] {
        let node = self.node(point);
        let at = self.nodes[node as usize].position_mm;
        let neighbours = [self.nodes[node as usize].upstream, self.downstream[node as usize]];
        let along = |neighbour: usize| {
            let way = self.nodes[neighbour].position_mm - at;
            let share = (point - at).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
            (neighbour as u32, share.clamp(0.0, 1.0) as f32)
        };
        let most = neighbours.into_iter().flatten().map(along).max_by(|a, b| a.1.total_cmp(&b.1));
        let (neighbour, share) = most.unwrap_or((node, 0.0));
        [(node, 1.0 - share), (neighbour, share)]
    }

    fn node(&mut self, point: &Vec3) -> u32 {
        let cell = [point.x, point.y, point.z].map(|x| (x / STEP_MM).floor() as i32);
        *self.cells.entry(cell).or_insert_with(|| {
            let centre = Vec3::from(cell.map(|i| (f64::from(i) + 0.5) * STEP_MM));
            let power =
                |node: &Node| (node.position_mm - centre).norm_squared() - node.radius_mm * node.radius_mm;
            let best = (0..).zip(self.nodes).min_by(|a, b| power(a.1).total_cmp(&power(b.1)));
            best.map_or(0, |(i, _)| i)
        })
    }
}
