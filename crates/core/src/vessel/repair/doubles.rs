//! Patches that duplicate part of the surface.
//!
//! Manually joined segmentations, or scans from two views, contain pieces of the same wall twice, slightly apart. The
//! rim of a strongly curved patch, as around a bifurcation, resembles the opening of a vessel, and would let devices
//! out. Such patches are removed before cracks are closed, which would join them to the surface under their rim.

use parry3d_f64::glamx::DVec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

use super::pieces::drop_triangles;
use crate::Vec3;
use crate::vessel::repairs::{Repair, RepairKind, of_groups};
use crate::vessel::topology::{EdgeTable, NONE};
use crate::vessel::{SurfaceMesh, mesh};

/// Largest ratio of area of a patch to the largest piece.
const PATCH: f64 = 0.3;
/// Largest distance of a patch from the surface below it, relative to the square root of its area. A separate stub of
/// a vessel, as long as wide, is off by a tenth or more.
const BESIDE: f64 = 0.05;

/// Drops open pieces that lie on larger ones everywhere, notes them, and returns the numbers of pieces and triangles
/// dropped.
pub(super) fn drop_doubles(
    mesh: &mut SurfaceMesh,
    table: &EdgeTable,
    noted: &mut Vec<Repair>,
) -> (usize, usize) {
    let (piece_of, count) = table.components(mesh.triangles.len());
    if count < 2 {
        return (0, 0);
    }
    let mut area_mm2 = vec![0.0; count];
    let mut open = vec![false; count];
    for (index, across) in table.neighbours(mesh.triangles.len()).iter().enumerate() {
        area_mm2[piece_of[index] as usize] += mesh::area(&mesh.corners(index));
        open[piece_of[index] as usize] |= across.contains(&NONE);
    }
    let largest = area_mm2.iter().copied().fold(0.0, f64::max);
    let mut patch: Vec<bool> = (0..count).map(|p| open[p] && area_mm2[p] < PATCH * largest).collect();
    // Candidates are rare, so the hierarchy of all others is built only if there is one.
    if !patch.contains(&true) {
        return (0, 0);
    }
    let Some(ground) = ground(mesh, &piece_of, &patch) else { return (0, 0) };
    for (index, piece) in piece_of.iter().enumerate().map(|(index, p)| (index, *p as usize)) {
        if patch[piece] {
            let corners = mesh.corners(index);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let reach_mm = BESIDE * area_mm2[piece].sqrt();
            patch[piece] = [middle]
                .iter()
                .chain(&corners)
                .all(|at| ground.distance_to_local_point(DVec3::new(at.x, at.y, at.z), false) <= reach_mm);
        }
    }
    let dropped = |t: usize| Some(piece_of[t]).filter(|piece| patch[*piece as usize]);
    noted.extend(of_groups(RepairKind::PieceDropped, mesh, dropped));
    let triangles = drop_triangles(mesh, &piece_of, |piece| patch[piece]);
    (patch.iter().filter(|patch| **patch).count(), triangles)
}

/// The surfaces on which patches may lie: all other pieces.
fn ground(mesh: &SurfaceMesh, piece_of: &[u32], patch: &[bool]) -> Option<TriMesh> {
    let triangles = mesh.triangles.iter().zip(piece_of).filter(|(_, piece)| !patch[**piece as usize]);
    let vertices = mesh.vertices_mm.iter().map(|v| DVec3::new(v.x, v.y, v.z)).collect();
    TriMesh::new(vertices, triangles.map(|(triangle, _)| *triangle).collect()).ok()
}
