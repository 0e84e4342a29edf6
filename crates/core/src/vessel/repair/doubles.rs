//! Layers of the wall that are there twice.
//!
//! Manually joined segmentations, scans from two views and files that were appended to themselves contain pieces of the same
//! wall twice, slightly apart. They are removed before cracks are closed and seams are sewn, which would join the two layers
//! at their rims.
//!
//! Two meshes of one surface differ by the sagittae of their facets. Between that and half the thickness that a sheet gets
//! ([`contents::THICK_MM`]) a layer is left out, too: as a wall it would narrow the lumen by more than its distance.
//! Anything farther away was drawn there, as a stent in its vessel.

use parry3d_f64::glamx::DVec3;
use parry3d_f64::partitioning::BvhNode;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

use super::contents::THICK_MM;
use super::pieces::drop_triangles;
use super::seams::{LAYERS, beyond};
use crate::Vec3;
use crate::vessel::repairs::{Repair, RepairKind, of_groups};
use crate::vessel::topology::{DisjointSets, EdgeTable, EdgeUse};
use crate::vessel::{SurfaceMesh, mesh};

/// Largest distance of a layer from the wall, relative to the square root of its area: on a vessel of whatever unit a
/// separate stub, as long as wide, is off by a tenth or more.
const BESIDE: f64 = 0.05;
/// Distance that is rounding, relative to the same: coordinates in files have seven digits.
const ROUNDED: f64 = 1e-4;
/// Bend of an edge, radians, above which it is an edge of the shape, and not one of facets about a curve: a hexagon's.
const SHARPEST: f64 = 1.06;

/// The result of [`drop_doubles`].
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Doubles {
    /// Layers that covered a part of the wall.
    pub(super) patches: usize,
    /// Outer ones of two layers that covered each other.
    pub(super) skins: usize,
    /// Triangles of both.
    pub(super) triangles: usize,
}

/// Drops pieces that lie on larger ones everywhere, or the larger one if that lies on the smaller one as well, and notes them.
pub(super) fn drop_doubles(mesh: &mut SurfaceMesh, table: &EdgeTable, noted: &mut Vec<Repair>) -> Doubles {
    let Some(layers) = Layers::new(mesh, table) else { return Doubles::default() };
    let gone = layers.superfluous(mesh);
    let of_kind = |kind: RepairKind| gone.iter().filter(|gone| **gone == Some(kind)).count();
    let (patches, skins) = (of_kind(RepairKind::PieceDropped), of_kind(RepairKind::SkinDropped));
    for kind in [RepairKind::PieceDropped, RepairKind::SkinDropped] {
        let dropped = |t: usize| Some(layers.piece_of[t]).filter(|piece| gone[*piece as usize] == Some(kind));
        noted.extend(of_groups(kind, mesh, dropped));
    }
    let triangles = drop_triangles(mesh, &layers.piece_of, |piece| gone[piece].is_some());
    Doubles { patches, skins, triangles }
}

/// Pieces of a surface, which may be layers of others. Two layers that share one rim are two.
struct Layers {
    piece_of: Vec<u32>,
    pieces: Vec<Piece>,
    /// How far the surface that is meant may be from each triangle, mm.
    sagitta_mm: Vec<f64>,
    shape: TriMesh,
}

#[derive(Debug, Clone, Default)]
struct Piece {
    triangles: Vec<u32>,
    area_mm2: f64,
    has_border: bool,
}

impl Layers {
    /// `None` with a single piece.
    fn new(mesh: &SurfaceMesh, table: &EdgeTable) -> Option<Self> {
        let mut sets = DisjointSets::new(mesh.triangles.len());
        for uses in table.edges().filter(|uses| goes_on(mesh, uses)) {
            sets.join(uses[0].triangle, uses[1].triangle);
        }
        let (side_of, sides) = sets.number();
        let (part_of, parts) = table.components(mesh.triangles.len());
        // Two layers of one rim cover each other; other sides of a fold belong to one piece.
        let mut sides_of_part = vec![Vec::new(); parts];
        for (side, part) in side_of.iter().zip(&part_of) {
            let sides: &mut Vec<u32> = &mut sides_of_part[*part as usize];
            if sides.len() < 3 && !sides.contains(side) {
                sides.push(*side);
            }
        }
        if parts < 2 && sides_of_part.iter().all(|sides| sides.len() != 2) {
            return None;
        }
        let vertices = mesh.vertices_mm.iter().map(to_parry).collect();
        let shape = TriMesh::new(vertices, mesh.triangles.clone()).ok()?;
        let mut layers = Self {
            pieces: pieces_of(mesh, table, &side_of, sides),
            piece_of: side_of,
            sagitta_mm: sagittae_mm(mesh, table),
            shape,
        };
        let covers = |one: u32, other: u32| {
            layers.ground_of(mesh, one as usize, |piece| piece == other as usize).is_some()
        };
        let are_twins = |sides: &Vec<u32>| matches!(sides[..], [a, b] if covers(a, b) && covers(b, a));
        let is_parted: Vec<bool> = sides_of_part.iter().map(are_twins).collect();
        // Numbered by their first triangle.
        let mut numbers = vec![None; sides];
        let mut count = 0;
        for (side, part) in layers.piece_of.iter_mut().zip(part_of) {
            let sides = &sides_of_part[part as usize];
            let first = if is_parted[part as usize] { *side } else { sides[0] };
            *side = *numbers[first as usize].get_or_insert_with(|| {
                count += 1;
                count - 1
            });
        }
        let count = count as usize;
        if count < 2 {
            return None;
        }
        layers.pieces = pieces_of(mesh, table, &layers.piece_of, count);
        Some(layers)
    }

    /// Which pieces are superfluous, and as what.
    fn superfluous(&self, mesh: &SurfaceMesh) -> Vec<Option<RepairKind>> {
        let mut order: Vec<usize> = (0..self.pieces.len()).collect();
        order.sort_by(|a, b| self.pieces[*b].area_mm2.total_cmp(&self.pieces[*a].area_mm2).then(a.cmp(b)));
        let mut gone = vec![None; order.len()];
        let mut is_ground = vec![false; order.len()];
        for &p in &order {
            if let Some(below) = self.ground_of(mesh, p, |piece| is_ground[piece]) {
                let is_own = |piece: usize| piece == p;
                let twin = below.into_iter().find(|q| self.ground_of(mesh, *q, is_own).is_some());
                match twin {
                    // The larger one of two skins is outside.
                    Some(outer) => (gone[outer], is_ground[outer]) = (Some(RepairKind::SkinDropped), false),
                    // A closed piece that lies on the wall is a flat body.
                    None if self.pieces[p].has_border => gone[p] = Some(RepairKind::PieceDropped),
                    None => {}
                }
            }
            is_ground[p] = gone[p].is_none();
        }
        gone
    }

    /// The pieces on which piece `p` lies, of those that may be below it; `None` if it is not on them everywhere.
    fn ground_of(
        &self,
        mesh: &SurfaceMesh,
        p: usize,
        may_be_below: impl Fn(usize) -> bool,
    ) -> Option<Vec<usize>> {
        let piece = &self.pieces[p];
        let most_mm = BESIDE * piece.area_mm2.sqrt();
        let left_out_mm = if piece.has_border { THICK_MM / 2.0 } else { ROUNDED * piece.area_mm2.sqrt() };
        let mut below = Vec::new();
        for &t in &piece.triangles {
            let corners = mesh.corners(t as usize);
            for at in [mesh.middle(t as usize)].iter().chain(&corners).map(to_parry) {
                let away =
                    |node: &BvhNode, _| (node.mins() - at).max(at - node.maxs()).max(DVec3::ZERO).length();
                // The first triangle that is near enough ends the search.
                let is_near = |other: u32, _| {
                    let own = self.piece_of[other as usize] as usize;
                    let sagittae_mm = self.sagitta_mm[t as usize] + self.sagitta_mm[other as usize];
                    let reach_mm = sagittae_mm.max(left_out_mm).min(most_mm);
                    let off_mm = || self.shape.triangle(other).distance_to_local_point(at, false);
                    (own != p && may_be_below(own) && off_mm() <= reach_mm).then_some(0.0)
                };
                let (found, _) = self.shape.bvh().find_best(most_mm, away, is_near)?;
                below.push(self.piece_of[found as usize] as usize);
            }
            below.sort_unstable();
            below.dedup();
        }
        Some(below)
    }
}

/// The pieces that triangles belong to.
fn pieces_of(mesh: &SurfaceMesh, table: &EdgeTable, piece_of: &[u32], count: usize) -> Vec<Piece> {
    let mut pieces = vec![Piece::default(); count];
    for (t, piece) in (0..).zip(piece_of) {
        let piece = &mut pieces[*piece as usize];
        piece.triangles.push(t);
        piece.area_mm2 += mesh::area(&mesh.corners(t as usize));
    }
    let piece = |used: &EdgeUse| piece_of[used.triangle as usize];
    let is_border = |uses: &[EdgeUse]| uses.len() != 2 || piece(&uses[0]) != piece(&uses[1]);
    for used in table.edges().filter(|uses| is_border(uses)).flatten() {
        pieces[piece(used) as usize].has_border = true;
    }
    pieces
}

/// Whether a surface goes on across an edge: two layers that end at one rim only share it.
fn goes_on(mesh: &SurfaceMesh, uses: &[EdgeUse]) -> bool {
    let [one, other] = uses else { return false };
    beyond(mesh, one).dot(&beyond(mesh, other)) <= LAYERS
}

/// How far the curved surface that facets stand for may be from each, mm: for each side across which it goes on smoothly, an
/// eighth of the bend there times the width of the triangle above that side.
fn sagittae_mm(mesh: &SurfaceMesh, table: &EdgeTable) -> Vec<f64> {
    let normal = |t: u32| {
        let [a, b, c] = mesh.corners(t as usize);
        (b - a).cross(&(c - a))
    };
    let mut sagitta_mm = vec![0.0; mesh.triangles.len()];
    for uses in table.edges() {
        let [one, other] = uses else { continue };
        let normals = [one, other].map(|used| normal(used.triangle));
        let cosine = normals[0].dot(&normals[1]).abs() / (normals[0].norm() * normals[1].norm());
        let bend = libm::acos(cosine.min(1.0));
        let length_mm = (mesh.vertices_mm[one.low as usize] - mesh.vertices_mm[one.high as usize]).norm();
        if bend <= SHARPEST {
            for (used, normal) in uses.iter().zip(&normals) {
                sagitta_mm[used.triangle as usize] += bend * normal.norm() / length_mm / 8.0;
            }
        }
    }
    sagitta_mm
}

fn to_parry(v: &Vec3) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}
