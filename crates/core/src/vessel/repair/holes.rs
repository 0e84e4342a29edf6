//! Distinguishes open ends of the vessel from damage.
//!
//! At an end of the vessel the wall approaches the rim along the vessel; around a hole it lies across. For every edge
//! of a loop, let c be the direction in the plane of its triangle that points out over the edge: at an end all c
//! agree, around a hole or along a tear they cancel.

use super::fill::fill;
use crate::Vec3;
use crate::vessel::opening::{self, Opening};
use crate::vessel::repairs::{Repair, RepairKind};
use crate::vessel::topology::EdgeTable;
use crate::vessel::{SurfaceMesh, mesh};
use crate::{Error, Result, error};

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
/// Distance from the middle of a hole, in radii of it, at which a place still names it.
const NAMED_WITHIN: f64 = 2.0;

/// The result of [`fill_holes`].
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Filled {
    pub(super) holes: usize,
    pub(super) triangles: usize,
}

/// Closes the holes and tears of a consistently oriented mesh, whose edges are in `table`, and leaves the ends of the
/// vessel open, and the holes nearest to the places of `keep_open_mm`. Notes both.
///
/// # Errors
/// [`Error::Parameter`] naming `keep_open_mm` for a place without a hole.
pub(super) fn fill_holes(
    mesh: &mut SurfaceMesh,
    table: &EdgeTable,
    keep_open_mm: &[Vec3],
    noted: &mut Vec<Repair>,
) -> Result<Filled> {
    let mut filled = Filled::default();
    if table.edges().all(|uses| uses.len() != 1) {
        kept(&[], keep_open_mm)?;
        return Ok(filled);
    }
    let loops = opening::boundary(mesh, table);
    let (piece, count) = table.components(mesh.triangles.len());
    let mut sizes = vec![0_u32; count];
    piece.iter().for_each(|p| sizes[*p as usize] += 1);
    let total_mm2: f64 = (0..mesh.triangles.len()).map(|i| mesh::area(&mesh.corners(i))).sum();
    let is_hole = |(opening, triangle): &(&Opening, &u32)| {
        let small = sizes[piece[**triangle as usize] as usize] < SMALLEST_PIECE;
        let rim = Rim::of(mesh, table, opening);
        !small && rim.is_some_and(|rim| rim.is_hole(opening.boundary.len(), LARGEST * total_mm2))
    };
    let holes: Vec<&Opening> = loops
        .openings
        .iter()
        .zip(&loops.first_triangle)
        .filter(is_hole)
        .map(|(opening, _)| opening)
        .collect();
    let meant = kept(&holes, keep_open_mm)?;
    let mut added = Vec::new();
    for (number, hole) in holes.iter().enumerate() {
        let is_meant = meant.contains(&number);
        if !is_meant {
            let Some(triangles) = fill(mesh, table, &hole.boundary) else { continue };
            filled.holes += 1;
            filled.triangles += triangles.len();
            added.extend(triangles);
        }
        let kind = if is_meant { RepairKind::HoleKept } else { RepairKind::HoleClosed };
        let rim = hole.boundary.iter().map(|v| mesh.vertices_mm[*v as usize]);
        noted.extend(Repair::at(kind, hole.boundary.len(), rim));
    }
    mesh.triangles.extend(added);
    Ok(filled)
}

/// The numbers of the holes that these places name, each the nearest one.
fn kept(holes: &[&Opening], keep_open_mm: &[Vec3]) -> Result<Vec<usize>> {
    let named = |place: &Vec3| {
        let off_mm = |hole: &Opening| (hole.centre_mm - place).norm();
        let nearest = (0..holes.len()).min_by(|a, b| off_mm(holes[*a]).total_cmp(&off_mm(holes[*b])));
        let Some(nearest) = nearest else {
            let remedy = "the surface has no hole that would be closed: leave it out";
            return Err(Error::parameter("keep_open_mm", error::vector(place), remedy));
        };
        let hole = holes[nearest];
        if off_mm(hole) <= NAMED_WITHIN * hole.radius_mm {
            return Ok(nearest);
        }
        let remedy = format!(
            "no hole is there: the nearest, of radius {:.2} mm, is at {}",
            hole.radius_mm,
            error::vector(&hole.centre_mm)
        );
        Err(Error::parameter("keep_open_mm", error::vector(place), remedy))
    };
    keep_open_mm.iter().map(named).collect()
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

    /// Whether the wall reaches the loop along the vessel.
    pub(super) fn is_end(&self) -> bool {
        self.coherence > COHERENT
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
