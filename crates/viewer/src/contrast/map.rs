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
use crate::c_arm::CArm;
use crate::cpu::wall_crossings;

/// Length of a step and side of the cells that remember their nearest node, mm.
const STEP_MM: f64 = 1.25;

/// The share of each node in the lumen of each pixel.
#[derive(Debug)]
pub(crate) struct ContrastMap {
    flow: Arc<Flow>,
    /// Pixels inside the wall, rising, and where their shares end.
    pixels: Vec<(u32, u32)>,
    shares: Vec<(u32, f32)>,
}

impl ContrastMap {
    /// The shares of `flow` in the lumen that `wall` encloses.
    pub(crate) fn new(flow: &Arc<Flow>, c_arm: &CArm, wall: &SurfaceMesh) -> Self {
        let mut map = Self { flow: Arc::clone(flow), pixels: vec![], shares: vec![] };
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

    /// Mean fraction of contrast medium along the lumen of each pixel that has any lumen, pixels rising.
    pub(crate) fn fractions(&self, time_s: f64) -> Vec<(u32, f32)> {
        self.mixed(&self.flow.fractions(time_s))
    }

    /// The largest fraction that a pixel's lumen ever has, each node at its own best moment.
    pub(crate) fn largest(&self) -> Vec<(u32, f32)> {
        self.mixed(&self.flow.largest())
    }

    fn mixed(&self, of_node: &[f32]) -> Vec<(u32, f32)> {
        let mut start = 0;
        let mix = |&(pixel, end): &(u32, u32)| {
            let shares = &self.shares[start..end as usize];
            start = end as usize;
            (pixel, shares.iter().map(|&(node, share)| share * of_node[node as usize]).sum())
        };
        self.pixels.iter().map(mix).collect()
    }
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
