//! Pieces that are not vessels: specks, patches that float over the surface, the outer skin of a wall with two, and
//! what lies in the lumen.
//!
//! A speck is small against the vessel and outside of it. What lies in the lumen was drawn there, whatever its size: it
//! becomes a wall (`contents`).

use super::contents::{self, Inner};
use super::holes::Rim;
use crate::Vec3;
use crate::vessel::repairs::{Repair, RepairKind, of_groups};
use crate::vessel::topology::{EdgeTable, Edges};
use crate::vessel::wall::signed_volume;
use crate::vessel::{SurfaceMesh, inside, mesh, opening};

/// Ratio of area to the largest piece's below which any piece is a speck.
const SPECK: f64 = 1e-3;
/// The same ratio for a closed piece, which no device can enter, or one that encloses almost nothing.
const BLOB: f64 = 0.05;
/// Volume over area to the power of 3/2 (a sphere: 0.094) that is almost nothing.
const FLAT: f64 = 1e-6;
/// The same ratio for a sheet.
const SHEET: f64 = 0.3;
/// Smallest number of triangles of a main piece: relative to fewer, nothing is small.
const FEWEST: usize = 8;
/// Smallest ratio of the areas of the inner and the outer skin.
const SKIN: f64 = 0.15;
/// Part of the triangles of an inner piece that must be inside, of those that are asked.
const INSIDE: f64 = 0.8;
/// The same for an open piece that passes through another one and is no part of it.
const THROUGH: f64 = 0.1;
/// The same for sheets, of which the rest may stick out through the wall.
const HALF: f64 = 0.5;

/// Distance from the middle of an opening, in radii of it, within which a skin of its wall ends.
const AT_OPENING: f64 = 1.2;

/// Number of pieces, the largest, that are compared: they are few once specks are removed; if not, this is not a
/// vessel with two skins.
const MOST: usize = 8;

/// The result of [`drop_pieces`].
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Dropped {
    /// Specks and floating sheets.
    pub(super) specks: usize,
    /// Outer skins.
    pub(super) skins: usize,
    /// Triangles of both.
    pub(super) triangles: usize,
    /// Closed bodies in the lumen.
    pub(super) bodies: usize,
    /// Sheets in the lumen.
    pub(super) sheets: usize,
}

/// One connected piece.
#[derive(Debug, Clone)]
struct Piece {
    triangles: usize,
    area_mm2: f64,
    volume_mm3: f64,
    bounds: [Vec3; 2],
    loops: usize,
    /// Whether all its loops are borders of a sheet.
    sheet: bool,
    gone: bool,
}

impl Piece {
    /// Whether it is a few stray triangles, far smaller than anything that is drawn.
    fn is_debris(&self, largest_mm2: f64) -> bool {
        self.triangles < FEWEST && self.area_mm2 < SPECK * largest_mm2
    }

    /// Whether its bounds meet those of another one.
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.bounds[0][k] <= other.bounds[1][k] && other.bounds[0][k] <= self.bounds[1][k])
    }

    /// Whether it may lie in the lumen of another one, by its bounds. A closed piece may stand in the wall, and a sheet may
    /// stick out through it.
    fn may_be_content_of(&self, vessel: &Self) -> bool {
        if self.loops == 0 || self.sheet { self.meets(vessel) } else { self.may_be_in(vessel) }
    }

    /// Whether its bounds are within those of another one.
    fn may_be_in(&self, outer: &Self) -> bool {
        let [low, high] = outer.bounds;
        let slack = 1e-3 * (high - low).norm();
        (0..3).all(|k| low[k] - slack <= self.bounds[0][k] && self.bounds[1][k] <= high[k] + slack)
    }
}

/// The pieces of a consistently oriented mesh, among the largest few, that lie inside another one, and the closed ones that lie
/// beside all others and are as large as a sac; `table` holds its edges. What was taken as a wall in the lumen is neither.
pub(in crate::vessel) fn nested_and_apart(mesh: &SurfaceMesh, table: &EdgeTable) -> Vec<Repair> {
    let (piece_of, count) = table.components(mesh.triangles.len());
    if count < 2 {
        return Vec::new();
    }
    let pieces = measure(mesh, table, &piece_of, count);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| pieces[*b].area_mm2.total_cmp(&pieces[*a].area_mm2).then(a.cmp(b)));
    order.truncate(MOST);
    let mut found = vec![None; count];
    // Beside a vessel that has openings: closed vessels may be several.
    let has_openings = order.iter().any(|piece| pieces[*piece].loops > 0);
    for (rank, &p) in order.iter().enumerate().skip(1) {
        // An open piece passes through the openings of one that it is in.
        let (is_closed, least) = if pieces[p].loops == 0 { (true, INSIDE) } else { (false, THROUGH) };
        let is_content = pieces[p].volume_mm3 < 0.0;
        let lies_in = |outer: &usize| {
            pieces[p].meets(&pieces[*outer]) && share_inside(mesh, &piece_of, p, *outer) >= least
        };
        found[p] = match () {
            () if is_content => None,
            () if order[..rank].iter().any(lies_in) => Some(RepairKind::PieceNested),
            () if is_closed && has_openings => Some(RepairKind::PieceApart),
            () => None,
        };
    }
    let of_kind = |kind: RepairKind| {
        of_groups(kind, mesh, |t| Some(piece_of[t]).filter(|p| found[*p as usize] == Some(kind)))
    };
    [RepairKind::PieceNested, RepairKind::PieceApart].into_iter().flat_map(of_kind).collect()
}

/// Drops the pieces of a consistently oriented mesh that are neither vessels nor in the lumen of one, makes walls of
/// those in a lumen, and notes both; `table` holds its edges.
pub(super) fn sort(mesh: &mut SurfaceMesh, table: &EdgeTable, noted: &mut Vec<Repair>) -> Dropped {
    let mut dropped = Dropped::default();
    let Some((mut pieces, piece_of, small)) = by_size(mesh, table) else { return dropped };
    dropped.skins = drop_skins(mesh, table, &piece_of, &mut pieces);
    let skins: Vec<bool> = pieces.iter().map(|piece| piece.gone).collect();
    let inner = inner(mesh, &piece_of, &mut pieces, &small);
    let is_skin = |p: usize| skins[p] && !small.contains(&p);
    dropped.specks = small.iter().filter(|p| pieces[**p].gone).count();
    for (kind, is_of_kind) in [(RepairKind::SkinDropped, true), (RepairKind::PieceDropped, false)] {
        let dropped = |t: usize| {
            Some(piece_of[t]).filter(|p| pieces[*p as usize].gone && is_skin(*p as usize) == is_of_kind)
        };
        noted.extend(of_groups(kind, mesh, dropped));
    }
    (dropped.bodies, dropped.sheets) = contents::make_walls(mesh, &piece_of, &inner, noted);
    dropped.triangles = drop_triangles(mesh, &piece_of, |piece| pieces[piece].gone);
    dropped
}

/// The pieces of a mesh, the piece of each triangle, and the numbers of those that are small against the largest one, which
/// are marked; `None` if there is one piece, or none that is a vessel. `table` holds the edges.
fn by_size(mesh: &SurfaceMesh, table: &EdgeTable) -> Option<(Vec<Piece>, Vec<u32>, Vec<usize>)> {
    let (piece_of, count) = table.components(mesh.triangles.len());
    if count < 2 {
        return None;
    }
    let mut pieces = measure(mesh, table, &piece_of, count);
    let main =
        (0..count).max_by(|a, b| pieces[*a].area_mm2.total_cmp(&pieces[*b].area_mm2).then(b.cmp(a)))?;
    if pieces[main].triangles < FEWEST {
        return None;
    }
    let small = mark_small(&mut pieces, main);
    Some((pieces, piece_of, small))
}

/// Marks the pieces that are small against the largest one, and returns their numbers.
fn mark_small(pieces: &mut [Piece], main: usize) -> Vec<usize> {
    let largest = pieces[main].area_mm2;
    for piece in pieces.iter_mut() {
        let share = piece.area_mm2 / largest;
        let flat = piece.volume_mm3.abs() < FLAT * libm::pow(piece.area_mm2, 1.5);
        piece.gone = share < SPECK
            || (share < BLOB && (piece.loops == 0 || flat))
            || (share < SHEET && piece.loops > 0 && piece.sheet);
    }
    (0..pieces.len()).filter(|p| pieces[*p].gone).collect()
}

/// What lies in the lumen of a consistently oriented mesh, for each piece, with the piece of each triangle; `table` holds
/// its edges. `None` if nothing does.
fn all_inner(mesh: &SurfaceMesh, table: &EdgeTable) -> Option<(Vec<Option<Inner>>, Vec<u32>)> {
    let (mut pieces, piece_of, small) = by_size(mesh, table)?;
    let inner = inner(mesh, &piece_of, &mut pieces, &small);
    inner.iter().any(Option::is_some).then_some((inner, piece_of))
}

/// Turns over the closed bodies in the lumen of a mesh of outward triangles, so that they face it.
pub(in crate::vessel) fn turn_bodies(mesh: &mut SurfaceMesh, edges: &mut Edges) {
    let Some((inner, piece_of)) = all_inner(mesh, edges.of(&mesh.triangles)) else { return };
    for (triangle, piece) in mesh.triangles.iter_mut().zip(&piece_of) {
        if inner[*piece as usize] == Some(Inner::Body) {
            triangle.swap(1, 2);
            edges.changed();
        }
    }
}

/// The sheets in the lumen of a consistently oriented mesh.
pub(super) fn sheets_in_lumen(mesh: &SurfaceMesh, table: &EdgeTable) -> Vec<Repair> {
    let Some((inner, piece_of)) = all_inner(mesh, table) else { return Vec::new() };
    let is_sheet = |t: usize| Some(piece_of[t]).filter(|p| inner[*p as usize] == Some(Inner::Sheet));
    of_groups(RepairKind::SheetInLumen, mesh, is_sheet)
}

/// What lies in the lumen of a piece that stays, for each piece; such pieces are no longer dropped.
fn inner(mesh: &SurfaceMesh, piece_of: &[u32], pieces: &mut [Piece], small: &[usize]) -> Vec<Option<Inner>> {
    let mut inner = vec![None; pieces.len()];
    let kind_of = |piece: &Piece| if piece.loops == 0 { Inner::Body } else { Inner::Sheet };
    // Large pieces, each against the larger ones.
    let mut order: Vec<usize> = (0..pieces.len()).filter(|p| !pieces[*p].gone).collect();
    order.sort_by(|a, b| pieces[*b].area_mm2.total_cmp(&pieces[*a].area_mm2).then(a.cmp(b)));
    order.truncate(MOST);
    for rank in 1..order.len() {
        let p = order[rank];
        let lies_in = |outer: &usize| {
            let (a, b) = (&pieces[p], &pieces[*outer]);
            a.may_be_content_of(b) && is_inside(mesh, piece_of, p, *outer)
        };
        let vessels = order[..rank].iter().filter(|outer| inner[**outer].is_none());
        if vessels.into_iter().any(lies_in) {
            inner[p] = Some(kind_of(&pieces[p]));
        }
    }
    // Small ones, against all that stay.
    let stays = |p: usize| !pieces[p].gone && inner[p].is_none();
    let largest_mm2 = pieces.iter().map(|piece| piece.area_mm2).fold(0.0, f64::max);
    let vessels: Vec<usize> = (0..pieces.len()).filter(|p| stays(*p)).collect();
    let near: Vec<usize> = small
        .iter()
        .copied()
        .filter(|p| pieces[*p].gone && !pieces[*p].is_debris(largest_mm2))
        .filter(|p| vessels.iter().any(|q| pieces[*p].may_be_content_of(&pieces[*q])))
        .collect();
    if near.is_empty() {
        return inner;
    }
    let Some(lumen) = contents::LumenOf::new(mesh, |t| stays(piece_of[t] as usize)) else { return inner };
    let share = lumen.shares_inside(mesh, piece_of, &near);
    for (p, share) in near.into_iter().zip(share) {
        // Half of a sheet may stick out through the wall. One that is nearer to it than it gets thick is a patch on it.
        let is_inner = match pieces[p].loops {
            0 => share >= INSIDE,
            _ => share >= HALF && lumen.deepest_mm(mesh, piece_of, p) > contents::THICK_MM / 2.0,
        };
        if is_inner {
            inner[p] = Some(kind_of(&pieces[p]));
        }
        // A body that stands in the wall, or a small sac, is united with the vessel later.
        let stands_in_wall = pieces[p].loops == 0 && share > 0.0;
        pieces[p].gone &= inner[p].is_none() && !stands_in_wall;
    }
    inner
}

/// Drops the triangles of some pieces, and returns their number; `piece_of` gives the piece of each.
pub(super) fn drop_triangles(
    mesh: &mut SurfaceMesh,
    piece_of: &[u32],
    gone: impl Fn(usize) -> bool,
) -> usize {
    let before = mesh.triangles.len();
    let mut pieces = piece_of.iter();
    mesh.triangles.retain(|_| pieces.next().is_none_or(|piece| !gone(*piece as usize)));
    before - mesh.triangles.len()
}

fn measure(mesh: &SurfaceMesh, table: &EdgeTable, piece_of: &[u32], count: usize) -> Vec<Piece> {
    let empty = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    let blank = Piece {
        triangles: 0,
        area_mm2: 0.0,
        volume_mm3: 0.0,
        bounds: empty,
        loops: 0,
        sheet: true,
        gone: false,
    };
    let mut pieces = vec![blank; count];
    let origin = mesh.vertices_mm.first().copied().unwrap_or_default();
    for (index, p) in piece_of.iter().enumerate() {
        let (piece, corners) = (&mut pieces[*p as usize], mesh.corners(index));
        piece.triangles += 1;
        piece.area_mm2 += mesh::area(&corners);
        piece.volume_mm3 += signed_volume(&corners, origin);
        for corner in &corners {
            piece.bounds = [piece.bounds[0].inf(corner), piece.bounds[1].sup(corner)];
        }
    }
    let boundary = opening::boundary(mesh, table);
    for (opening, triangle) in boundary.openings.iter().zip(&boundary.first_triangle) {
        let piece = &mut pieces[piece_of[*triangle as usize] as usize];
        piece.loops += 1;
        piece.volume_mm3 += opening.cap(mesh).map(|cap| signed_volume(&cap, origin)).sum::<f64>();
        piece.sheet &= Rim::of(mesh, table, opening).is_none_or(|rim| rim.across < -0.5);
    }
    pieces
}

/// Marks pieces that contain another one of their kind, which leads to all of their openings: that one is the lumen,
/// they are the outside of the wall.
fn drop_skins(mesh: &SurfaceMesh, table: &EdgeTable, piece_of: &[u32], pieces: &mut [Piece]) -> usize {
    let mut order: Vec<usize> = (0..pieces.len()).filter(|p| !pieces[*p].gone).collect();
    order.sort_by(|a, b| pieces[*b].area_mm2.total_cmp(&pieces[*a].area_mm2).then(a.cmp(b)));
    let mut skins = 0;
    order.truncate(MOST);
    for (rank, &outer) in order.iter().enumerate() {
        let holds = order[rank + 1..].iter().any(|&inner| {
            let (a, b) = (&pieces[outer], &pieces[inner]);
            let alike = b.area_mm2 >= SKIN * a.area_mm2
                && (b.bounds[1] - b.bounds[0]).norm() >= 0.7 * (a.bounds[1] - a.bounds[0]).norm();
            alike
                && b.may_be_in(a)
                && reaches_openings(mesh, table, piece_of, inner, outer)
                && is_inside(mesh, piece_of, inner, outer)
        });
        if holds {
            pieces[outer].gone = true;
            skins += 1;
        }
    }
    skins
}

/// Whether piece `inner` reaches every opening of piece `outer`: a lumen does, a body in it does not.
fn reaches_openings(
    mesh: &SurfaceMesh,
    table: &EdgeTable,
    piece_of: &[u32],
    inner: usize,
    outer: usize,
) -> bool {
    let boundary = opening::boundary(mesh, table);
    let of_outer = boundary
        .openings
        .iter()
        .zip(&boundary.first_triangle)
        .filter(|(_, triangle)| piece_of[**triangle as usize] as usize == outer);
    let of_inner = || (0..piece_of.len()).filter(|t| piece_of[*t] as usize == inner);
    of_outer.map(|(opening, _)| opening).all(|opening| {
        let reach_mm = AT_OPENING * opening.radius_mm;
        of_inner().flat_map(|t| mesh.corners(t)).any(|v| (v - opening.centre_mm).norm() <= reach_mm)
    })
}

/// Whether most of piece `inner` is inside piece `outer`, closed by its caps.
fn is_inside(mesh: &SurfaceMesh, piece_of: &[u32], inner: usize, outer: usize) -> bool {
    share_inside(mesh, piece_of, inner, outer) >= INSIDE
}

/// How much of piece `inner` is inside piece `outer`, closed by its caps.
fn share_inside(mesh: &SurfaceMesh, piece_of: &[u32], inner: usize, outer: usize) -> f64 {
    let of = |p: usize| (0..piece_of.len()).filter(move |t| piece_of[*t] as usize == p);
    let mut shell = SurfaceMesh { vertices_mm: mesh.vertices_mm.clone(), triangles: Vec::new() };
    shell.triangles.extend(of(outer).map(|t| mesh.triangles[t]));
    let openings = opening::boundary(&shell, &EdgeTable::new(&shell.triangles)).openings;
    let caps: Vec<[Vec3; 3]> = openings.iter().flat_map(|o| o.cap(&shell).collect::<Vec<_>>()).collect();
    let own: Vec<usize> = of(inner).collect();
    let is_within = |x: &Vec3| inside::winding(&shell, &caps, x).abs() > 0.5;
    contents::share_of(mesh, &own, is_within)
}
