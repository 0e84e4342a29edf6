//! To which point of the tree a place in the lumen belongs: found once for a vessel, whatever is injected and wherever the C-arm stands.

use std::sync::{MutexGuard, PoisonError};

use endowire_core::Vec3;
use rustc_hash::FxHashMap;

use super::flow::{Flow, Node};

/// Length of a step along a ray, and side of the cells that remember their nearest node, mm.
pub(super) const STEP_MM: f64 = 1.25;

/// The nearest node of each cell that was asked for.
pub(super) type Cells = FxHashMap<[i32; 3], u32>;

/// Nearest nodes of a flow by cells, found where they are first asked for.
pub(super) struct Nearest<'a> {
    nodes: &'a [Node],
    /// The node after each, in its widest branch.
    downstream: Vec<Option<usize>>,
    cells: MutexGuard<'a, Cells>,
}

impl<'a> Nearest<'a> {
    pub(super) fn new(flow: &'a Flow) -> Self {
        let nodes = &flow.nodes;
        let mut downstream: Vec<Option<usize>> = vec![None; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            if let Some(before) = node.upstream {
                let wider = |other: usize| nodes[other].radius_mm >= node.radius_mm;
                if !downstream[before].is_some_and(wider) {
                    downstream[before] = Some(i);
                }
            }
        }
        // Each cell is right by itself: one that was left in the middle of its work leaves right ones.
        Self { nodes, downstream, cells: flow.cells.lock().unwrap_or_else(PoisonError::into_inner) }
    }

    /// The nearest node and the neighbour towards which a point lies along the centre line, with their shares of it.
    pub(super) fn shares(&mut self, point: &Vec3) -> [(u32, f32); 2] {
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
