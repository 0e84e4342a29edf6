//! Joins lines into a tree: where a line enters the spheres of earlier ones, it is joined to them.

use super::line;
use super::lumen::{Sphere, Spheres};
use crate::vessel::CentrelineNode;

/// Points closer than this to the one before, in radii, coincide.
const SAME_RADII: f64 = 1e-6;

/// A tree to which branches are joined.
#[derive(Default)]
pub(in crate::vessel) struct Growing {
    pub(in crate::vessel) nodes: Vec<CentrelineNode>,
    /// Spheres at the nodes.
    spheres: Spheres,
}

impl Growing {
    /// The row of the tree where a path finally leaves its spheres, and the rest of the path; all of it without a
    /// tree.
    pub(in crate::vessel) fn own_part(&self, way: &[Sphere]) -> (Option<usize>, Vec<Sphere>) {
        let fine = line::divided(way);
        let inside = |k: &usize| self.spheres.holding(&fine[*k].centre_mm).is_some();
        // The end of a path is its own even in a wide vessel.
        match (0..fine.len().saturating_sub(1)).rev().find(inside) {
            Some(last) => (self.spheres.holding(&fine[last].centre_mm), fine[last + 1..].to_vec()),
            None => (None, fine),
        }
    }

    /// Adds a line that continues from a row, or starts the tree; returns the row of its end, unless empty.
    pub(in crate::vessel) fn join(&mut self, entry: Option<usize>, line: &[Sphere]) -> Option<usize> {
        let mut parent = entry;
        for point in line {
            let before = parent.map(|row| self.nodes[row].position_mm);
            if before.is_some_and(|x| (x - point.centre_mm).norm() <= SAME_RADII * point.radius_mm) {
                continue;
            }
            self.nodes.push(CentrelineNode {
                position_mm: point.centre_mm,
                radius_mm: point.radius_mm,
                parent,
            });
            self.spheres.push(*point);
            parent = Some(self.nodes.len() - 1);
        }
        parent.filter(|row| *row > 0)
    }
}
