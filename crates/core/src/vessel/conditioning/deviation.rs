//! Where two surfaces are far apart, at sample points, both ways.

use std::ops::Range;

use super::corners::Corners;
use super::reference::{Reference, hierarchy, nearest};
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::NONE;
use crate::{Vec3, parallel};

/// Approximate number of sample points of the given surface.
const SAMPLES: usize = 40_000;

/// Square of the distance, in limits, from which shorter edges are worth their number.
const FAR: f64 = 1.44;

/// Records the corners of a triangle that is too far off.
fn note(far: &mut Vec<u32>, square: f64, limit_mm: f64, ends: &[u32; 3]) {
    if square > FAR * limit_mm * limit_mm {
        far.extend(ends);
    }
}

/// Vertices of the conditioned mesh, `at`, near which it and the given one are farther apart than the limit,
/// ascending.
pub(super) fn far(corners: &Corners, at: &[Vec3], reference: &Reference) -> Vec<u32> {
    let live: Vec<[u32; 3]> = corners.triangles.iter().copied().filter(|t| t[0] != NONE).collect();
    let limit_of =
        |t: &[u32; 3]| t.iter().map(|&v| corners.vertices[v as usize].limit_mm).fold(f64::MAX, f64::min);
    // From the new surface: corners, middles of sides, centres.
    let from_new = |part: Range<usize>| {
        let mut found = Vec::new();
        for t in &live[part] {
            let [a, b, c] = t.map(|v| at[v as usize]);
            let limit = limit_of(t);
            for x in [a, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0] {
                let square = t
                    .iter()
                    .map(|&v| reference.walk(&x, corners.vertices[v as usize].place).square)
                    .fold(f64::MAX, f64::min);
                // A walk may end in a fold of the surface; the hierarchy is exact, and used rarely.
                let square = if square > 0.25 * limit * limit {
                    let nearest = reference.nearest(&x, &(b - a).cross(&(c - a)));
                    nearest.map_or(square, |nearest| nearest.min(square))
                } else {
                    square
                };
                note(&mut found, square, limit, t);
            }
        }
        found
    };
    // From the given one: vertices and centres of triangles.
    let mesh = SurfaceMesh { vertices_mm: at.to_vec(), triangles: live.clone() };
    let tree = hierarchy(&mesh);
    let given = reference.mesh;
    let stride = (2 * given.triangles.len()).div_ceil(SAMPLES).max(1);
    let from_given = |part: Range<usize>| {
        let mut found = Vec::new();
        for t in part.map(|k| k * stride) {
            let [a, b, c] = given.corners(t);
            // For a triangle that is folded over only the position counts.
            let normal = (b - a).cross(&(c - a)) * f64::from(u8::from(!reference.is_folded(t)));
            for x in [a, b, c, (a + b + c) / 3.0] {
                if let Some((triangle, square)) = nearest(&mesh, &tree, &x, &normal) {
                    let ends = mesh.triangles[triangle as usize];
                    note(&mut found, square, limit_of(&ends), &ends);
                }
            }
        }
        found
    };
    let mut all = parallel::parts(live.len(), from_new);
    all.extend(parallel::parts(given.triangles.len().div_ceil(stride), from_given));
    let mut all = all.concat();
    all.sort_unstable();
    all.dedup();
    all
}
