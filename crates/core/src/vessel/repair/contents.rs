//! What lies in the lumen: closed bodies, such as thrombus, plugs and plaque, and sheets, such as membranes, flaps,
//! leaflets and rings.
//!
//! A body is turned over, so that its surface faces the lumen around it. A sheet has the lumen on both sides: it becomes
//! a thin body.

use std::collections::BTreeMap;

use super::divide::divide;
use crate::Vec3;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::repairs::{Repair, RepairKind, of_groups};
use crate::vessel::topology::EdgeTable;
use crate::vessel::wall::drop_unreferenced;
use crate::vessel::{SurfaceMesh, WallQuery};

/// Least thickness of a wall with two sides, mm, and longest edge of its mesh: a mesh that is made even for contact holds
/// no thinner one, and devices would pass through.
pub(super) const THICK_MM: f64 = 0.5;
const EDGE_MM: f64 = 0.6;
/// Volume over area to the power of 3/2 (a ball: 0.094) below which a body is flat.
const PLATE: f64 = 0.03;
/// Most triangles of a piece that are asked for being in the lumen.
const ASKED: usize = 64;
/// Part of the number of triangles from one that is asked to the next: the golden ratio, of which no multiple is near a whole number.
/// Triangles are often in rows, and one of every few rows would be asked at the same place of it.
const STRIDE: f64 = 0.618_033_988_749_894_9;

/// The share of these triangles whose middles are where `is_there` holds, by some of them that are spread evenly.
pub(super) fn share_of(mesh: &SurfaceMesh, triangles: &[usize], is_there: impl Fn(&Vec3) -> bool) -> f64 {
    let count = triangles.len();
    let asked = count.min(ASKED);
    let spread =
        |k: usize| if asked == count { k } else { ((k as f64 * STRIDE).fract() * count as f64) as usize };
    let there = (0..asked).filter(|k| is_there(&mesh.middle(triangles[spread(*k)]))).count();
    there as f64 / asked.max(1) as f64
}

/// What a piece in the lumen is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Inner {
    Body,
    Sheet,
}

/// The lumen of some pieces.
pub(super) struct LumenOf {
    query: WallQuery,
}

impl LumenOf {
    /// Of the triangles of a consistently oriented mesh for which `is_wall` holds; `None` without any.
    pub(super) fn new(mesh: &SurfaceMesh, is_wall: impl Fn(usize) -> bool) -> Option<Self> {
        let mut wall = mesh.clone();
        retain_numbered(&mut wall.triangles, |t, _| is_wall(t));
        WallQuery::of_mesh(wall).ok().map(|query| Self { query })
    }

    /// Whether a position is in it.
    pub(super) fn holds(&self, x: &Vec3) -> bool {
        self.query.nearest(x, f64::MAX).is_some_and(|near| near.distance_mm > 0.0 && !near.rim)
    }

    /// Whether a position is in it or on its wall, but for rounding.
    pub(super) fn touches(&self, x: &Vec3, rounding_mm: f64) -> bool {
        self.query.nearest(x, f64::MAX).is_some_and(|near| near.distance_mm > -rounding_mm && !near.rim)
    }

    /// Distance of a position in it from its wall, mm; 0 outside.
    pub(super) fn depth_mm(&self, x: &Vec3) -> f64 {
        self.query.nearest(x, f64::MAX).filter(|near| !near.rim).map_or(0.0, |near| near.distance_mm.max(0.0))
    }

    /// The greatest distance of a triangle of a piece, by its middle, from the wall around this lumen, mm.
    pub(super) fn deepest_mm(&self, mesh: &SurfaceMesh, piece_of: &[u32], piece: usize) -> f64 {
        let own = (0..piece_of.len()).filter(|t| piece_of[*t] as usize == piece);
        own.map(|t| self.depth_mm(&mesh.middle(t))).fold(0.0, f64::max)
    }

    /// How much of each of these pieces is in it, by some of their triangles.
    pub(super) fn shares_inside(&self, mesh: &SurfaceMesh, piece_of: &[u32], pieces: &[usize]) -> Vec<f64> {
        let mut triangles: BTreeMap<usize, Vec<usize>> = pieces.iter().map(|p| (*p, Vec::new())).collect();
        for (t, piece) in piece_of.iter().enumerate() {
            if let Some(of_piece) = triangles.get_mut(&(*piece as usize)) {
                of_piece.push(t);
            }
        }
        pieces.iter().map(|piece| share_of(mesh, &triangles[piece], |x| self.holds(x))).collect()
    }
}

/// Makes walls of the pieces that lie in the lumen, and notes them; returns the numbers of bodies and sheets. Triangles of
/// sheets and thin bodies are replaced: those of one piece that are left keep their places in the list.
pub(super) fn make_walls(
    mesh: &mut SurfaceMesh,
    piece_of: &[u32],
    inner: &[Option<Inner>],
    noted: &mut Vec<Repair>,
) -> (usize, usize) {
    let of_kind = |kind: Inner| inner.iter().filter(|one| **one == Some(kind)).count();
    let counts = (of_kind(Inner::Body), of_kind(Inner::Sheet));
    if counts == (0, 0) {
        return counts;
    }
    for (kind, repair) in [(Inner::Body, RepairKind::BodyInLumen), (Inner::Sheet, RepairKind::SheetInLumen)] {
        let those = |t: usize| Some(piece_of[t]).filter(|p| inner[*p as usize] == Some(kind));
        noted.extend(of_groups(repair, mesh, those));
    }
    for piece in 0..inner.len() {
        let Some(kind) = inner[piece] else { continue };
        let own: Vec<usize> = (0..piece_of.len()).filter(|t| piece_of[*t] as usize == piece).collect();
        let mut part = SurfaceMesh {
            vertices_mm: mesh.vertices_mm.clone(),
            triangles: own.iter().map(|t| mesh.triangles[*t]).collect(),
        };
        let thinner_mm = if kind == Inner::Body { missing_mm(&part) } else { THICK_MM };
        let is_new = thinner_mm > 0.0;
        let first = mesh.vertices_mm.len() as u32;
        if is_new {
            drop_unreferenced(&mut part);
            divide(&mut part, EDGE_MM);
        }
        let whole = match kind {
            Inner::Sheet => thick(&part),
            Inner::Body if is_new => swollen(part, thinner_mm / 2.0),
            Inner::Body => part,
        };
        // The surface of a body faces the lumen around it.
        let mut turned = whole.triangles.iter().map(|[a, b, c]| {
            let triangle = [*a, *c, *b];
            if is_new { triangle.map(|v| v + first) } else { triangle }
        });
        // There are never fewer triangles than before.
        for (t, triangle) in own.iter().zip(turned.by_ref()) {
            mesh.triangles[*t] = triangle;
        }
        mesh.triangles.extend(turned);
        if is_new {
            mesh.vertices_mm.extend(whole.vertices_mm);
        }
    }
    counts
}

/// By how much a closed, flat body is thinner than a wall with two sides must be, mm; 0 for a thick or a round one.
fn missing_mm(body: &SurfaceMesh) -> f64 {
    let area_mm2: f64 = (0..body.triangles.len()).map(|t| crate::vessel::mesh::area(&body.corners(t))).sum();
    let volume_mm3 = body.signed_volume_mm3().abs();
    let is_flat = volume_mm3 < PLATE * libm::pow(area_mm2, 1.5);
    let thick_mm = 2.0 * volume_mm3 / area_mm2.max(f64::MIN_POSITIVE);
    if is_flat { (THICK_MM - thick_mm).max(0.0) } else { 0.0 }
}

/// A closed body whose surface is moved outwards.
fn swollen(mut body: SurfaceMesh, by_mm: f64) -> SurfaceMesh {
    let outwards = body.vertex_normals();
    body.vertices_mm.iter_mut().zip(outwards).for_each(|(v, outwards)| *v += outwards * by_mm);
    body
}

/// A thin closed body around a sheet.
fn thick(sheet: &SurfaceMesh) -> SurfaceMesh {
    let normals = sheet.vertex_normals();
    let count = sheet.vertices_mm.len() as u32;
    let side = |sign: f64| {
        let off_mm = sign * THICK_MM / 2.0;
        sheet.vertices_mm.iter().zip(&normals).map(move |(v, normal)| v + normal * off_mm)
    };
    let vertices_mm = side(1.0).chain(side(-1.0)).collect();
    let below = |v: u32| v + count;
    let mut triangles = sheet.triangles.clone();
    triangles.extend(sheet.triangles.iter().map(|[a, b, c]| [below(*a), below(*c), below(*b)]));
    let table = EdgeTable::new(&sheet.triangles);
    for open in table.edges().filter(|uses| uses.len() == 1).map(|uses| uses[0]) {
        let (a, b) = if open.forward { (open.low, open.high) } else { (open.high, open.low) };
        triangles.extend([[b, a, below(a)], [b, below(a), below(b)]]);
    }
    SurfaceMesh { vertices_mm, triangles }
}
