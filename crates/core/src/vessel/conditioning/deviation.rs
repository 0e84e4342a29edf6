//! How far two surfaces are from each other, at sample points, both ways.

use std::ops::Range;

use super::corners::Corners;
use super::reference::{Reference, hierarchy, nearest};
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::NONE;
use crate::{Vec3, parallel};

/// Sample points of the given surface, about.
const SAMPLES: usize = 40_000;

/// Square of the distance, in limits, from which on shorter edges are worth their number.
const FAR: f64 = 1.44;

/// Distances at sample points.
#[derive(Debug, Clone, Default)]
pub(super) struct Deviation {
    /// From each side: the conditioned surface first.
    pub(super) distances_mm: [Vec<f64>; 2],
    /// Vertices of the conditioned mesh near which the surfaces are much farther apart than the limit, ascending.
    pub(super) far: Vec<u32>,
    /// Where they are farthest apart, and how far, mm.
    pub(super) worst: Option<(Vec3, f64)>,
}

/// What was found at some points.
#[derive(Default)]
struct Found {
    distances_mm: Vec<f64>,
    far: Vec<u32>,
    worst: Option<(Vec3, f64)>,
}

impl Found {
    fn note(&mut self, x: &Vec3, square: f64, limit_mm: f64, ends: &[u32; 3]) {
        let distance_mm = square.sqrt();
        self.distances_mm.push(distance_mm);
        if self.worst.is_none_or(|(_, worst)| distance_mm > worst) {
            self.worst = Some((*x, distance_mm));
        }
        if square > FAR * limit_mm * limit_mm {
            self.far.extend(ends);
        }
    }
}

/// Measures the distances of the conditioned surface, whose vertices are `at`, and the given one.
pub(super) fn measure(corners: &Corners, at: &[Vec3], reference: &Reference) -> Deviation {
    let live: Vec<[u32; 3]> = corners.triangles.iter().copied().filter(|t| t[0] != NONE).collect();
    let limit_of =
        |t: &[u32; 3]| t.iter().map(|&v| corners.vertices[v as usize].limit_mm).fold(f64::MAX, f64::min);
    // From the new surface: corners, middles of sides, centres.
    let from_new = |part: Range<usize>| {
        let mut found = Found::default();
        for t in &live[part] {
            let [a, b, c] = t.map(|v| at[v as usize]);
            let limit = limit_of(t);
            for x in [a, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0] {
                let square = t
                    .iter()
                    .map(|&v| reference.walk(&x, corners.vertices[v as usize].place).square)
                    .fold(f64::MAX, f64::min);
                // A walk may end in a fold of the surface; the hierarchy knows better, and is asked rarely.
                let square = if square > 0.25 * limit * limit {
                    let nearest = reference.nearest(&x, &(b - a).cross(&(c - a)));
                    nearest.map_or(square, |nearest| nearest.min(square))
                } else {
                    square
                };
                found.note(&x, square, limit, t);
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
        let mut found = Found::default();
        for t in part.map(|k| k * stride) {
            let [a, b, c] = given.corners(t);
            // Of a triangle that is folded over only the place counts.
            let normal = (b - a).cross(&(c - a)) * f64::from(u8::from(!reference.is_folded(t)));
            for x in [a, b, c, (a + b + c) / 3.0] {
                if let Some((triangle, square)) = nearest(&mesh, &tree, &x, &normal) {
                    let ends = mesh.triangles[triangle as usize];
                    found.note(&x, square, limit_of(&ends), &ends);
                }
            }
        }
        found
    };
    let mut all = Deviation::default();
    let sides = [
        parallel::parts(live.len(), from_new),
        parallel::parts(given.triangles.len().div_ceil(stride), from_given),
    ];
    for (distances, side) in all.distances_mm.iter_mut().zip(sides) {
        for found in side {
            distances.extend(found.distances_mm);
            all.far.extend(found.far);
            let worse = |new: &(Vec3, f64)| all.worst.is_none_or(|old| new.1 > old.1);
            all.worst = found.worst.filter(worse).or(all.worst);
        }
    }
    all.far.sort_unstable();
    all.far.dedup();
    all
}
