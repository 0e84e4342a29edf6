//! How far two surfaces are from each other, at sample points, both ways.

use super::corners::Corners;
use super::reference::{Reference, hierarchy, nearest};
use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::NONE;

/// Sample points of the given surface, about.
const SAMPLES: usize = 40_000;

/// Square of the distance, in limits, from which on shorter edges are worth their number.
const FAR: f64 = 1.44;

/// Distances at sample points.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Deviation {
    pub(super) largest_mm: f64,
    pub(super) mean_mm: f64,
}

/// Measures; `exceeded` is told vertices of the conditioned mesh near which the given surface is much farther than the limit.
pub(super) fn measure(
    corners: &Corners,
    at: &[Vec3],
    reference: &Reference,
    mut exceeded: impl FnMut(u32),
) -> Deviation {
    let (mut largest, mut sum, mut count) = (0.0f64, 0.0, 0usize);
    let mut note = |distance: f64| {
        largest = largest.max(distance);
        sum += distance;
        count += 1;
    };
    // From the new surface: corners, middles of sides, centres.
    for t in corners.triangles.iter().filter(|t| t[0] != NONE) {
        let [a, b, c] = t.map(|v| at[v as usize]);
        let limit = t.iter().map(|&v| corners.vertices[v as usize].limit_mm).fold(f64::MAX, f64::min);
        for x in [a, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0] {
            let square = t
                .iter()
                .map(|&v| reference.walk(&x, corners.vertices[v as usize].place).square)
                .fold(f64::MAX, f64::min);
            // A walk may end in a fold of the surface; the hierarchy knows better, and is asked rarely.
            let square = if square > 0.25 * limit * limit {
                reference.nearest(&x, &(b - a).cross(&(c - a))).map_or(square, |nearest| nearest.min(square))
            } else {
                square
            };
            note(square.sqrt());
            if square > FAR * limit * limit {
                t.iter().for_each(|&v| exceeded(v));
            }
        }
    }
    // From the given one: vertices and centres of triangles.
    let live: Vec<[u32; 3]> = corners.triangles.iter().copied().filter(|t| t[0] != NONE).collect();
    let mesh = SurfaceMesh { vertices_mm: at.to_vec(), triangles: live };
    let tree = hierarchy(&mesh);
    let given = reference.mesh;
    let stride = (2 * given.triangles.len()).div_ceil(SAMPLES).max(1);
    for t in (0..given.triangles.len()).step_by(stride) {
        let [a, b, c] = given.corners(t);
        // Of a triangle that is folded over only the place counts.
        let normal = (b - a).cross(&(c - a)) * f64::from(u8::from(!reference.is_folded(t)));
        for x in [a, b, c, (a + b + c) / 3.0] {
            if let Some((triangle, square)) = nearest(&mesh, &tree, &x, &normal) {
                note(square.sqrt());
                let ends = mesh.triangles[triangle as usize];
                let limit =
                    ends.iter().map(|&v| corners.vertices[v as usize].limit_mm).fold(f64::MAX, f64::min);
                if square > FAR * limit * limit {
                    ends.iter().for_each(|&v| exceeded(v));
                }
            }
        }
    }
    Deviation { largest_mm: largest, mean_mm: sum / count.max(1) as f64 }
}
