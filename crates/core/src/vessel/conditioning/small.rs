//! Small bodies in the lumen.
//!
//! An even mesh has edges of a fraction of the lumen's radius, and cannot hold a body that is not much larger: it would be
//! cut off as a spike. It stays as it is.

use crate::vessel;
use crate::vessel::topology::{EdgeTable, NONE};
use crate::vessel::wall::signed_volume;
use crate::vessel::{SurfaceMesh, mesh};

/// Twice the volume over the area, mm, below which a body is small: two thirds of the radius of a ball.
const SMALL_MM: f64 = 0.3;

/// The surface without its small bodies, and these alone; `None` without any, which is nearly always.
pub(super) fn apart(surface: &SurfaceMesh) -> Option<(SurfaceMesh, SurfaceMesh)> {
    let table = EdgeTable::new(&surface.triangles);
    let (piece_of, count) = table.components(surface.triangles.len());
    if count < 2 {
        return None;
    }
    let origin = surface.vertices_mm.first().copied().unwrap_or_default();
    let (mut volume, mut area, mut closed) = (vec![0.0; count], vec![0.0; count], vec![true; count]);
    for (t, across) in table.neighbours(surface.triangles.len()).iter().enumerate() {
        let (piece, corners) = (piece_of[t] as usize, surface.corners(t));
        volume[piece] += signed_volume(&corners, origin);
        area[piece] += mesh::area(&corners);
        closed[piece] &= !across.contains(&NONE);
    }
    // Bodies face the lumen around them: their volume is negative.
    let small: Vec<bool> =
        (0..count).map(|p| closed[p] && volume[p] < 0.0 && -2.0 * volume[p] < SMALL_MM * area[p]).collect();
    if !small.contains(&true) || !small.contains(&false) {
        return None;
    }
    let part = |wanted: bool| {
        let mut part = surface.clone();
        mesh::retain_numbered(&mut part.triangles, |t, _| small[piece_of[t] as usize] == wanted);
        vessel::wall::drop_unreferenced(&mut part);
        part
    };
    Some((part(false), part(true)))
}
