//! Distinguishes open ends of the vessel from damage.
//!
//! At an end of the vessel the wall approaches the rim along the vessel; around a hole it lies across. For every edge
//! of a loop, let c be the direction in the plane of its triangle that points out over the edge: at an end all c
//! agree, around a hole or along a tear they cancel.

use super::fill::fill;
use crate::Vec3;
use crate::vessel::opening::{self, Opening};
use crate::vessel::topology::EdgeTable;
use crate::vessel::{SurfaceMesh, mesh};

/// Length of the mean of all c above which a loop is an end.
const COHERENT: f64 = 0.5;
/// Mean of outward normals along a loop's direction below which a loop is not a hole but an end, or the border of a
/// sheet.
const ACROSS: f64 = 0.6;
/// Area relative to that of a circle of the same length below which a loop is a slit.
const SLIT: f64 = 0.05;
/// A vessel may be cut off flush at the wall of another: a ring with at least this many vertices, as round and flat
/// as below, is an end.
const RING_VERTICES: usize = 12;
const RING_ROUND: f64 = 0.9;
const RING_FLAT: f64 = 0.03;
/// Area of a hole, as a fraction of the surface's, above which it is not closed, since its shape is unknown.
const LARGEST: f64 = 0.05;
/// Pieces of fewer triangles have borders, not holes.
const SMALLEST_PIECE: u32 = 8;

/// The result of [`fill_holes`].
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Filled {
    pub(super) holes: usize,
    pub(super) triangles: usize,
}

/// Closes the holes and tears of a consistently oriented mesh, whose edges are in `table`, and leaves the ends of the
/// vessel open.
pub(super) fn fill_holes(mesh: &mut SurfaceMesh, table: &EdgeTable) -> Filled {
    let mut filled = Filled::default();
    if table.edges().all(|uses| uses.len() != 1) {
        return filled;
    }
    let loops = opening::boundary(mesh, table);
    let (piece, count) = table.components(mesh.triangles.len());
    let mut sizes = vec![0_u32; count];
    piece.iter().for_each(|p| sizes[*p as usize] += 1);
    let total_mm2: f64 = (0..mesh.triangles.len()).map(|i| mesh::area(&mesh.corners(i))).sum();
    let mut added = Vec::new();
    for (opening, triangle) in loops.openings.iter().zip(&loops.first_triangle) {
        let small = sizes[piece[*triangle as usize] as usize] < SMALLEST_PIECE;
        let rim = Rim::of(mesh, table, opening);
        if small || !rim.is_some_and(|rim| rim.is_hole(opening.boundary.len(), LARGEST * total_mm2)) {
            continue;
        }
        if let Some(triangles) = fill(mesh, table, &opening.boundary) {
            filled.holes += 1;
            filled.triangles += triangles.len();
            added.extend(triangles);
        }
    }
    mesh.triangles.extend(added);
    filled
}

/// The position of the wall at a loop of open edges.
pub(super) struct Rim {
    /// Length of the mean of all c: 1 at the end of a tube, 0 around a hole or a sheet.
    coherence: f64,
    /// Mean of the outward normals along the loop's direction: 1 around a hole, 0 at the end of a tube, −1 around a sheet.
    pub(super) across: f64,
    area_mm2: f64,
    /// Area relative to that of a circle of the same length.
    round: f64,
    /// Distance of the farthest vertex from the loop's plane, relative to its radius.
    off_plane: f64,
}

impl Rim {
    /// The loop of `opening`; `None` if its length is zero.
    pub(super) fn of(mesh: &SurfaceMesh, table: &EdgeTable, opening: &Opening) -> Option<Self> {
        let count = opening.boundary.len();
        let at = |k: usize| mesh.vertices_mm[opening.boundary[k % count] as usize];
        let (mut around, mut coherence, mut across) = (0.0, Vec3::zeros(), 0.0);
        let (mut area, mut off_plane) = (Vec3::zeros(), 0.0_f64);
        for k in 0..count {
            let (a, b) = (opening.boundary[k], opening.boundary[(k + 1) % count]);
            let only = table.uses(a, b).first()?;
            let [p, q, r] = mesh.corners(only.triangle as usize);
            let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_default();
            let side = at(k + 1) - at(k);
            // The cap runs from a to b, the triangle from b to a: outwards over the edge is to the right of the
            // triangle.
            coherence += (-side).cross(&normal);
            across += side.norm() * normal.dot(&opening.direction);
            around += side.norm();
            area += (at(k) - opening.centre_mm).cross(&(at(k + 1) - opening.centre_mm)) / 2.0;
            off_plane = off_plane.max((at(k) - opening.centre_mm).dot(&opening.direction).abs());
        }
        (around > 0.0).then(|| Self {
            coherence: coherence.norm() / around,
            across: across / around,
            area_mm2: area.norm(),
            round: 4.0 * std::f64::consts::PI * area.norm() / (around * around),
            off_plane: off_plane / opening.radius_mm.max(f64::MIN_POSITIVE),
        })
    }

    /// Whether the loop is damage.
    fn is_hole(&self, vertices: usize, largest_mm2: f64) -> bool {
        if self.area_mm2 > largest_mm2 || self.coherence > COHERENT {
            return false;
        }
        let ring = vertices >= RING_VERTICES && self.round > RING_ROUND && self.off_plane < RING_FLAT;
        self.round < SLIT || (self.across > ACROSS && !ring)
    }
}
