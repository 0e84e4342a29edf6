//! Lines that become a tree: where one comes within the spheres of those before, it joins them.

use super::line;
use super::lumen::{Sphere, Spheres};
use crate::vessel::CentrelineNode;

/// Points nearer than this to the one before, in radii, are the same.
const SAME_RADII: f64 = 1e-6;

/// A tree that branches are joined to.
#[derive(Default)]
pub(in crate::vessel) struct Growing {
    pub(in crate::vessel) nodes: Vec<CentrelineNode>,
    /// Those of the nodes.
    spheres: Spheres,
}

impl Growing {
    /// The row of the tree where a way comes out of its spheres for good, and what is left of the way; all of it where there is no tree.
    pub(in crate::vessel) fn own_part(&self, way: &[Sphere]) -> (Option<usize>, Vec<Sphere>) {
        let fine = line::divided(way);
        let inside = |k: &usize| self.spheres.holding(&fine[*k].centre_mm).is_some();
        // The end of a way is its own even in a wide vessel.
        match (0..fine.len().saturating_sub(1)).rev().find(inside) {
            Some(last) => (self.spheres.holding(&fine[last].centre_mm), fine[last + 1..].to_vec()),
            None => (None, fine),
        }
    }

    /// Adds a line that goes on from a row, or begins the tree; the row of its end, unless that is nothing.
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
