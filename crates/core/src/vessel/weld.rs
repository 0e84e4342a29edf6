//! Merges vertices that are meant to coincide.
//!
//! STL stores every corner of every triangle separately, and exporters round them differently. Vertices closer than a
//! tolerance are merged, transitively: chains of close vertices become one, so the result does not depend on order.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use super::SurfaceMesh;
use super::topology::DisjointSets;
use super::wall::validate;
use crate::{Result, Vec3};

/// Distance below which vertices are merged, as a fraction of the diagonal of the triangles' bounding box: ten times
/// the resolution of the 32-bit floats of an STL file, and far below any anatomical detail.
const WELD_TOLERANCE: f64 = 1e-6;

/// Vertices are sorted along this vector of slightly less than unit length, oblique to all planes that surfaces tend
/// to have.
const ALONG: Vec3 = Vec3::new(0.537_7, 0.371_9, 0.747_9);
/// Largest difference along it of close vertices, in tolerances: with room for rounding.
const SLACK: f64 = 1.001;

/// A surface with its vertices merged.
#[derive(Debug, Clone)]
pub(super) struct Welding {
    /// All vertices as given, and triangles between the remaining ones.
    pub(super) mesh: SurfaceMesh,
    /// Smallest and largest coordinates of the vertices that triangles use.
    pub(super) bounds_mm: (Vec3, Vec3),
    /// Distance up to which vertices were merged.
    pub(super) tolerance_mm: f64,
    /// Number of vertices merged into another one.
    pub(super) merged: usize,
}

impl Welding {
    /// Merges the vertices of a surface that is usable as a wall.
    ///
    /// # Errors
    /// As [`validate`].
    pub(super) fn of(surface: &SurfaceMesh) -> Result<Self> {
        validate(surface)?;
        let bounds_mm = surface.used_bounds_mm().unwrap_or_default();
        let tolerance_mm = WELD_TOLERANCE * (bounds_mm.1 - bounds_mm.0).norm();
        let target = merge_targets(&surface.vertices_mm, tolerance_mm);
        let merged = target.iter().enumerate().filter(|(v, t)| *v != **t as usize).count();
        let mesh = SurfaceMesh {
            vertices_mm: surface.vertices_mm.clone(),
            triangles: surface.triangles.iter().map(|t| t.map(|v| target[v as usize])).collect(),
        };
        Ok(Self { mesh, bounds_mm, tolerance_mm, merged })
    }
}

/// For each vertex the index of the vertex it is merged into (its own index if it stays): the smallest index of all
/// vertices linked to it by steps of at most `tolerance_mm`. Vertices that are not finite are not merged.
fn merge_targets(vertices_mm: &[Vec3], tolerance_mm: f64) -> Vec<u32> {
    let first = first_equals(vertices_mm);
    let is_wanted = |index: u32, v: &Vec3| first[index as usize] == index && v.iter().all(|c| c.is_finite());
    let mut order: Vec<(f64, u32)> = (0..)
        .zip(vertices_mm)
        .filter(|(index, v)| is_wanted(*index, v))
        .map(|(index, v)| (ALONG.dot(v), index))
        .collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut sets = DisjointSets::new(vertices_mm.len());
    // Vertices that may be close to the next one.
    let mut last: VecDeque<(f64, u32, Vec3)> = VecDeque::new();
    for (at, index) in order {
        let v = vertices_mm[index as usize];
        let is_near = |before: &(f64, u32, Vec3)| at - before.0 <= SLACK * tolerance_mm;
        while last.front().is_some_and(|before| !is_near(before)) {
            last.pop_front();
        }
        for (_, other, w) in &last {
            if (v - w).norm() <= tolerance_mm {
                sets.join(index, *other);
            }
        }
        last.push_back((at, index, v));
    }
    first.into_iter().map(|v| sets.find(v)).collect()
}

/// For each vertex the index of the first one that equals it; its own for one that is not finite.
fn first_equals(vertices_mm: &[Vec3]) -> Vec<u32> {
    // Only used for lookups, never iterated: its order cannot affect the result.
    let mut known: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    let first = |(index, v): (u32, &Vec3)| {
        // −0 is 0.
        let key = [v.x + 0.0, v.y + 0.0, v.z + 0.0].map(f64::to_bits);
        if v.iter().all(|c| c.is_finite()) { *known.entry(key).or_insert(index) } else { index }
    };
    (0..).zip(vertices_mm).map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_within_tolerance_merge_across_cell_borders_and_others_do_not() {
        let near_border = 16.0 * 0.01;
        let points = [
            Vec3::new(near_border - 0.004, 0.0, 0.0),
            Vec3::new(near_border + 0.004, 0.0, 0.0),
            Vec3::new(near_border + 0.02, 0.0, 0.0),
        ];
        assert_eq!(merge_targets(&points, 0.01), [0, 0, 2]);
        assert_eq!(merge_targets(&points, 0.001), [0, 1, 2]);
    }

    #[test]
    fn a_chain_of_close_vertices_becomes_one_whatever_the_order() {
        let chain = [0.0, 0.016, 0.008, 0.024].map(|x| Vec3::new(x, 1.0, -1.0));
        assert_eq!(merge_targets(&chain, 0.01), [0; 4]);
    }

    #[test]
    fn negative_zero_is_zero() {
        assert_eq!(merge_targets(&[Vec3::new(0.0, 0.0, 0.0), Vec3::new(-0.0, 0.0, -0.0)], 0.0), [0, 0]);
    }

    #[test]
    fn welding_leaves_vertices_that_are_not_finite_and_merges_equal_ones() {
        let far = Vec3::new(1e300, -1e300, 3.0);
        let nowhere = Vec3::new(0.0, f64::NAN, 0.0);
        let points = [Vec3::x(), nowhere, far, Vec3::x(), nowhere, far, Vec3::repeat(f64::INFINITY)];
        assert_eq!(merge_targets(&points, 0.0), [0, 1, 2, 0, 4, 2, 6]);
    }

    #[test]
    fn the_same_vertices_are_found_as_by_comparing_all() {
        let points: Vec<Vec3> = (0..400)
            .map(|k| f64::from(k % 150))
            .zip([0.0, 0.004, 0.0101].into_iter().cycle())
            .map(|(k, off)| Vec3::new((7.0 * k).sin(), k / 150.0, (3.0 * k).cos()) + Vec3::repeat(off))
            .collect();
        let mut sets = DisjointSets::new(points.len());
        for a in 0..points.len() {
            for b in (0..a).filter(|b| (points[a] - points[*b]).norm() <= 0.02) {
                sets.join(a as u32, b as u32);
            }
        }
        let all: Vec<u32> = (0..points.len() as u32).map(|v| sets.find(v)).collect();
        assert_eq!(merge_targets(&points, 0.02), all);
    }
}
