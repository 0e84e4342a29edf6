//! Simple surfaces for tests.

use std::f64::consts::{PI, TAU};

use crate::Vec3;
use crate::vessel::{SurfaceMesh, Wall, any_perpendicular};

/// Appends a surface with its own vertices.
pub(in crate::vessel) fn add(mesh: &mut SurfaceMesh, other: &SurfaceMesh) {
    let first = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend(&other.vertices_mm);
    mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
}

pub(super) fn turned_over(mut mesh: SurfaceMesh) -> SurfaceMesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mesh
}

/// Quadrilaterals between rings of the same number of vertices, as triangles facing away from the axis.
fn joined(rings: &[Vec<Vec3>], closed: bool) -> SurfaceMesh {
    let (count, around) = (rings.len() as u32, rings[0].len() as u32);
    let mut mesh = SurfaceMesh { vertices_mm: rings.concat(), triangles: Vec::new() };
    for ring in 0..count - 1 {
        for k in 0..around - u32::from(!closed) {
            let at = |ring: u32, k: u32| ring * around + k % around;
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn circle(centre: Vec3, axis: Vec3, radius_mm: f64, around: usize) -> Vec<Vec3> {
    let axis = axis.normalize();
    let u = any_perpendicular(&axis);
    let v = axis.cross(&u);
    let place = |k: usize| {
        let (sin, cos) = libm::sincos(TAU * k as f64 / around as f64);
        centre + (u * cos + v * sin) * radius_mm
    };
    (0..around).map(place).collect()
}

/// A tube with open ends, of this many edges around and along.
pub(super) fn tube(from: Vec3, to: Vec3, radius_mm: f64, (around, along): (usize, usize)) -> SurfaceMesh {
    let at = |k: usize| from + (to - from) * (k as f64 / along as f64);
    let rings: Vec<Vec<Vec3>> = (0..=along).map(|k| circle(at(k), to - from, radius_mm, around)).collect();
    joined(&rings, true)
}

/// A ball, with this many edges from pole to pole.
pub(super) fn ball(centre: Vec3, radius_mm: f64, edges: usize) -> SurfaceMesh {
    let ring = |k: usize| {
        let (sin, cos) = libm::sincos(PI * k as f64 / edges as f64);
        circle(centre - Vec3::z() * (radius_mm * cos), Vec3::z(), radius_mm * sin, 2 * edges)
    };
    let rings: Vec<Vec<Vec3>> = (0..=edges).map(ring).collect();
    // At the poles all vertices of a ring coincide.
    Wall::welded(&joined(&rings, true)).unwrap().mesh().clone()
}

/// A disc, or a ring with an inner radius.
pub(super) fn disc(
    centre: Vec3,
    axis: Vec3,
    radius_mm: f64,
    (inner_mm, around): (f64, usize),
) -> SurfaceMesh {
    let outer = circle(centre, axis, radius_mm, around);
    if inner_mm > 0.0 {
        return joined(&[circle(centre, axis, inner_mm, around), outer], true);
    }
    let middle = outer.len() as u32;
    let triangles = (0..middle).map(|k| [k, (k + 1) % middle, middle]).collect();
    SurfaceMesh { vertices_mm: outer.into_iter().chain([centre]).collect(), triangles }
}
