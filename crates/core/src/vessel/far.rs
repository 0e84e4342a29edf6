//! Vertices at wrong places, far from the whole surface.
//!
//! A digit too many in one coordinate draws two or more triangles out to where nothing is. They would be meshed as finely
//! as the vessel, which takes minutes, and the vessel would be open or blocked there.

use super::SurfaceMesh;
use crate::{Error, Result, Vec3, error};

/// Shortest edge at a vertex, in diagonals of the surface, from which it is looked at closely.
const ODD: f64 = 0.25;
/// The same in median edges, from which its place is wrong.
const FAR: f64 = 50.0;
/// Largest number of vertices that may be wrong, as a fraction of all: more are a surface of another kind.
const FEW: f64 = 0.01;

/// Refuses a surface of welded vertices of which some lie far from all of the others.
///
/// # Errors
/// [`Error::Mesh`] that names the first of these vertices.
pub(super) fn refuse(mesh: &SurfaceMesh) -> Result<()> {
    let Some((low, high)) = mesh.used_bounds_mm() else { return Ok(()) };
    let diagonal_mm = (high - low).norm();
    let at = |v: u32| mesh.vertices_mm[v as usize];
    let is_extreme = |v: u32| (0..3).any(|k| at(v)[k] == low[k] || at(v)[k] == high[k]);
    // Only what is at the edge of the bounds can be far from all.
    let is_odd = |v: u32, shortest: f64| shortest > ODD * diagonal_mm && is_extreme(v);
    let corner = |t: &[u32; 3], k: usize| {
        (t[k], (at(t[(k + 1) % 3]) - at(t[k])).norm().min((at(t[(k + 2) % 3]) - at(t[k])).norm()))
    };
    let may_be =
        mesh.triangles.iter().any(|t| (0..3).map(|k| corner(t, k)).any(|(v, shortest)| is_odd(v, shortest)));
    if !may_be {
        return Ok(());
    }
    let mut shortest = vec![f64::INFINITY; mesh.vertices_mm.len()];
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let (v, mm) = corner(triangle, k);
            shortest[v as usize] = shortest[v as usize].min(mm);
            edges.push((at(triangle[(k + 1) % 3]) - at(v)).norm());
        }
    }
    let middle = edges.len() / 2;
    let median_mm = *edges.select_nth_unstable_by(middle, f64::total_cmp).1;
    let is_far = |v: &u32| {
        let mm = shortest[*v as usize];
        mm.is_finite() && mm > ODD * diagonal_mm && mm > FAR * median_mm
    };
    let far: Vec<u32> = (0..shortest.len() as u32).filter(is_far).collect();
    let used = shortest.iter().filter(|mm| mm.is_finite()).count();
    match far.first() {
        Some(first) if (far.len() as f64) <= (FEW * used as f64).max(2.0) => {
            Err(refused(far.len(), *first, at(*first), (shortest[*first as usize], median_mm)))
        }
        _ => Ok(()),
    }
}

fn refused(count: usize, vertex: u32, place: Vec3, (shortest_mm, median_mm): (f64, f64)) -> Error {
    let others = if count > 1 { format!(", and {} more like it", count - 1) } else { String::new() };
    Error::Mesh(format!(
        "vertex {vertex}, at {}, is {} mm from the nearest vertex of its triangles{others}, and edges are {} mm long in the \
         median: correct its coordinates, or remove it in a program for meshes",
        error::vector(&place),
        error::number((shortest_mm * 10.0).round() / 10.0),
        error::number((median_mm * 100.0).round() / 100.0),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{GeneratedWall, Resolution, Wall, anatomy};

    #[test]
    fn a_vertex_a_thousand_times_too_far_is_named_and_long_triangles_are_not() {
        let tree = anatomy::tree("straight_tube").unwrap();
        let clean = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap().wall.mesh().clone();
        for (vertex, factor) in [(40, 1000.0), (41, -1000.0), (100, 300.0), (7, 1e4), (200, 500.0)] {
            let mut spoiled = clean.clone();
            let place = &mut spoiled.vertices_mm[vertex];
            place.y = (place.y + 1.0) * factor;
            let reported = Wall::from_surface(&spoiled).unwrap_err().to_string();
            assert!(reported.contains("mm from the nearest vertex"), "{reported}");
        }
        // Two rings far apart, as a modelling program writes a tube; and a pyramid.
        let around = |k: u32, z: f64| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 24.0);
            Vec3::new(cos, sin, z)
        };
        let mut tube = SurfaceMesh::default();
        tube.vertices_mm.extend((0..24).map(|k| around(k, 0.0)).chain((0..24).map(|k| around(k, 500.0))));
        tube.triangles.extend((0..24).flat_map(|k| {
            let next = (k + 1) % 24;
            [[k, next, next + 24], [k, next + 24, k + 24]]
        }));
        assert!(Wall::from_surface(&tube).is_ok());
    }
}
