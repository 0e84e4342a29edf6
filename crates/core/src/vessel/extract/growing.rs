//! Joins lines into a tree: where a line enters the spheres of earlier ones, it is joined to them.

use super::line;
use super::lumen::{Lumen, Sphere, Spheres};
use crate::Vec3;
use crate::vessel::CentrelineNode;

/// Points closer than this to the one before, in radii, coincide.
const SAME_RADII: f64 = 1e-6;

/// Largest distance of a joint from the end of a line, in radii.
const REACH_RADII: f64 = 3.0;
/// Least cosine of the angle between a line and the branch that it joins for it to come aslant.
const ASLANT: f64 = 0.5;
/// Weight of that distance beside the distance from the line's continuation.
const NEARNESS: f64 = 0.35;

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

    /// The row whose sphere holds a position, the nearest.
    pub(super) fn holding(&self, x: &Vec3) -> Option<usize> {
        self.spheres.holding(x)
    }

    /// The row that a line is joined to that ends at a point and comes there from another one: the nearest, or, where
    /// it comes aslant, one near its straight continuation. Ways cut the corners of forks, so where they leave the
    /// tree says less.
    pub(super) fn joint(&self, lumen: &Lumen<'_>, from: &Sphere, end: &Sphere) -> Option<usize> {
        let nearest = self.best_seen(lumen, end, |offset| offset.norm())?;
        let onwards = (end.centre_mm - from.centre_mm).try_normalize(0.0)?;
        let before = self.nodes[nearest].parent.unwrap_or(nearest);
        let along = self.nodes[nearest].position_mm - self.nodes[before].position_mm;
        if along.try_normalize(0.0).is_none_or(|along| along.dot(&onwards).abs() < ASLANT) {
            return Some(nearest);
        }
        self.best_seen(lumen, end, |offset| {
            (offset - onwards * offset.dot(&onwards).max(0.0)).norm() + NEARNESS * offset.norm()
        })
    }

    /// The row near a point and seen from there for whose offset this is the least.
    fn best_seen(&self, lumen: &Lumen<'_>, end: &Sphere, off_mm: impl Fn(Vec3) -> f64) -> Option<usize> {
        let offset = |row: usize| self.nodes[row].position_mm - end.centre_mm;
        let reach_mm = |row: usize| REACH_RADII * self.nodes[row].radius_mm.max(end.radius_mm);
        let near = (0..self.nodes.len()).filter(|row| offset(*row).norm() <= reach_mm(*row));
        let mut rows: Vec<(f64, usize)> = near.map(|row| (off_mm(offset(row)), row)).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let seen = |row: &usize| lumen.sees(&end.centre_mm, &self.nodes[*row].position_mm);
        rows.into_iter().map(|(_, row)| row).find(seen)
    }

    /// Takes away the rows from this one on.
    pub(super) fn forget_after(&mut self, first: usize) {
        self.nodes.truncate(first);
        let kept = std::mem::take(&mut self.spheres);
        kept.all.into_iter().take(first).for_each(|sphere| self.spheres.push(sphere));
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
