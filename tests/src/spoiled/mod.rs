//! Clean surfaces made as dirty as those that users have, with a geometry that stays what it was or departs by a little.
//!
//! Every function is deterministic: the same mesh and seed give the same surface. How far a spoiled surface is from the clean one is
//! measured ([`deviation_mm`]), not assumed.

mod coarse;
mod edit;
mod sheets;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use endowire_lab::crossing::CrossingTest;

use crate::noise::Noise;
use edit::Editable;

pub use coarse::{decades, decimated};
pub use sheets::{folds, overlaps, torn};

/// A way to spoil a mesh.
pub type Spoil = fn(&SurfaceMesh, u64) -> SurfaceMesh;

/// All ways, by name.
pub const WAYS: [(&str, Spoil); 10] = [
    ("decades", decades),
    ("slivers", slivers),
    ("flips", flips),
    ("noise 0.05 mm", |mesh, seed| noise(mesh, seed, 0.05)),
    ("noise 0.3 mm", |mesh, seed| noise(mesh, seed, 0.3)),
    ("folds", folds),
    ("torn", torn),
    ("overlaps", overlaps),
    ("dirt", dirt),
    ("decimated", decimated),
];

/// Part of the triangles that get a needle or cap.
const SLIVERS: f64 = 0.15;
/// Width of a sliver over its length: from a hundredth to a thousandth.
const THIN: [f64; 2] = [1e-3, 1e-2];
/// Part of the triangles that are turned over.
const FLIPS: f64 = 0.3;
/// Part of the triangles that are there twice.
const DUPLICATES: f64 = 0.05;
/// Part of the triangles that a crumb lies at, …
const CRUMBS: f64 = 0.02;
/// … its size, mm, …
const CRUMB_MM: f64 = 0.2;
/// … and how far from the surface it may lie, mm.
const CRUMB_OFF_MM: f64 = 0.04;

/// Needles (edges cut next to their end) and caps (points inserted next to an edge). The geometry stays.
pub fn slivers(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut edit = Editable::new(mesh);
    for index in 0..mesh.triangles.len() as u32 {
        if !random.happens(SLIVERS) {
            continue;
        }
        let thin = THIN[0] * (THIN[1] / THIN[0]).powf(0.5 * (random.next() + 1.0));
        let side = random.below(3);
        // Its neighbour's needle may have cut it already.
        let Some(corners) = edit.triangle(index) else { continue };
        let [a, b, c] = [corners[side], corners[(side + 1) % 3], corners[(side + 2) % 3]];
        if random.happens(0.5) {
            edit.split(a, b, edit.at(a) * (1.0 - thin) + edit.at(b) * thin);
        } else {
            let place = 0.5 * (1.0 - thin) * (edit.at(a) + edit.at(b)) + edit.at(c) * thin;
            let middle = edit.vertex(place);
            edit.remove(index);
            [[a, b, middle], [b, c, middle], [c, a, middle]].into_iter().for_each(|t| edit.add(t));
        }
    }
    edit.finish()
}

/// Triangles turned over at random.
pub fn flips(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut mesh = mesh.clone();
    for triangle in &mut mesh.triangles {
        if random.happens(FLIPS) {
            triangle.swap(1, 2);
        }
    }
    mesh
}

/// Vertices moved by up to `size_mm` in any direction.
pub fn noise(mesh: &SurfaceMesh, seed: u64, size_mm: f64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut mesh = mesh.clone();
    let size = size_mm / 3.0f64.sqrt();
    for vertex in &mut mesh.vertices_mm {
        *vertex += Vec3::new(random.next(), random.next(), random.next()) * size;
    }
    mesh
}

/// Triangles that are there twice, in either winding, and crumbs: single triangles that belong to nothing.
pub fn dirt(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut dirty = mesh.clone();
    for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        if random.happens(DUPLICATES) {
            dirty.triangles.push(if random.happens(0.5) { [b, c, a] } else { [b, a, c] });
        }
        if random.happens(CRUMBS) {
            let corners = mesh.corners(index);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let first = dirty.vertices_mm.len() as u32;
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            for corner in corners {
                let along = (corner - middle).normalize() * (0.5 * CRUMB_MM);
                dirty.vertices_mm.push(middle + along + normal * (CRUMB_OFF_MM * random.next()));
            }
            dirty.triangles.push([first, first + 1, first + 2]);
        }
    }
    dirty
}

/// Farthest that two surfaces are apart, mm, at corners, middles of edges and middles of triangles of both.
pub fn deviation_mm(a: &SurfaceMesh, b: &SurfaceMesh) -> f64 {
    one_way_mm(a, b).max(one_way_mm(b, a))
}

/// Deviations are measured up to this, mm.
const FARTHEST_MM: f64 = 5.0;

fn one_way_mm(from: &SurfaceMesh, to: &SurfaceMesh) -> f64 {
    let to = CrossingTest::new(to);
    let away = |x: &Vec3| to.distance_mm(x, FARTHEST_MM).unwrap_or(FARTHEST_MM);
    let mut farthest: f64 = 0.0;
    for index in 0..from.triangles.len() {
        let [a, b, c] = from.corners(index);
        for x in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
            farthest = farthest.max(away(&x));
        }
    }
    farthest
}
