//! Parts that overlap without being joined: a branch, a sac or a stretch of vessel that was put to another one, and a body
//! that stands in the wall.
//!
//! Closed by caps, the parts of a vessel are united, and bodies are taken off. A cap of which most is left is an opening
//! again; one that another part has taken most of is not, and its rest is wall.

use std::collections::{BTreeMap, BTreeSet};

use super::contents::LumenOf;
use super::holes::Rim;
use super::solid::Solid;
use crate::vessel::crossings::Crossings;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::opening::{self, Boundary, Opening};
use crate::vessel::repairs::{Repair, RepairKind, of_groups};
use crate::vessel::topology::{DisjointSets, EdgeTable};
use crate::vessel::wall::signed_volume;
use crate::vessel::{SurfaceMesh, mesh};
use crate::{Error, Result, Vec3};

/// Depth to which one vessel must be in another, in radii of the narrower one, to be a part of it: two that graze each
/// other in a segmentation are not joined.
const DEEP: f64 = 0.25;
/// Part of a rim that must lie in another part for a vessel that begins there.
const BEGINS: f64 = 0.5;
/// How far a mouth that lies partly in another vessel may be short of ending in it, in its radii, and the steps that are tried:
/// one cut square off a branch at 30° is short by 3.5.
const SHORT: f64 = 4.0;
const STEPS: usize = 32;
/// Distance from a wall that is rounding, relative to a mouth's radius.
const ROUNDED: f64 = 1e-6;
/// Part of a cap that must be left for an opening.
const OPEN: f64 = 0.5;
/// Part of the volume of a closed piece that must be in a lumen for a body in the wall.
const MOSTLY: f64 = 0.5;
/// Number of pieces above which no rims are compared: a vessel in parts has fewer.
const MOST_PIECES: usize = 64;

/// Closed triangles, each with a number that its parts keep.
#[derive(Debug, Clone, Default)]
pub(super) struct Closed {
    pub(super) vertices_mm: Vec<Vec3>,
    pub(super) triangles: Vec<([u32; 3], u32)>,
}

impl Closed {
    /// Whether it has a handle, as a ring: by Euler's characteristic V − E + F, of 2 without, with 3 F edges for every two triangles.
    fn is_ring(&self) -> bool {
        2 * self.vertices_mm.len() < self.triangles.len() + 4
    }
}

/// The pieces of a mesh, and which of them overlap.
pub(super) struct Overlaps {
    piece_of: Vec<u32>,
    pieces: Vec<Piece>,
    boundary: Boundary,
    pairs: BTreeSet<(u32, u32)>,
    /// How far each opening is drawn out to end in another piece, mm.
    drawn_out_mm: Vec<f64>,
}

/// One connected piece.
#[derive(Debug, Clone)]
struct Piece {
    bounds: (Vec3, Vec3),
    area_mm2: f64,
    volume_mm3: f64,
    loops: usize,
    /// Whether it is closed, or ends as vessels end: a patch with a border is no part of a vessel.
    is_part: bool,
}

/// Pieces that were made one surface.
struct United {
    /// Without the caps of its openings.
    surface: Closed,
    /// Which of the pieces were taken off.
    bodies: Vec<u32>,
}

impl Piece {
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.bounds.0[k] <= other.bounds.1[k] && other.bounds.0[k] <= self.bounds.1[k])
    }

    /// The radius of a tube of its area and volume, mm.
    fn radius_mm(&self) -> f64 {
        2.0 * self.volume_mm3.abs() / self.area_mm2.max(f64::MIN_POSITIVE)
    }

    /// Whether it is a closed body that faces the lumen around it.
    fn is_body(&self) -> bool {
        self.loops == 0 && self.volume_mm3 < 0.0
    }
}

impl Overlaps {
    /// Of a consistently oriented mesh with these edges and intersections; `None` if no parts overlap.
    pub(super) fn find(mesh: &SurfaceMesh, table: &EdgeTable, found: &Crossings) -> Option<Self> {
        let (piece_of, count) = table.components(mesh.triangles.len());
        if count < 2 || found.capped {
            return None;
        }
        let boundary = opening::boundary(mesh, table);
        let pieces = measured(mesh, table, &piece_of, count, &boundary);
        let drawn_out_mm = vec![0.0; boundary.openings.len()];
        let mut overlaps = Self { piece_of, pieces, boundary, pairs: BTreeSet::new(), drawn_out_mm };
        let between = |pair: &[u32; 2]| {
            let [a, b] = pair.map(|t| overlaps.piece_of[t as usize]);
            let are_parts = [a, b].iter().all(|p| overlaps.pieces[*p as usize].is_part);
            (a != b && are_parts).then_some((a.min(b), a.max(b)))
        };
        let crossing: BTreeSet<(u32, u32)> = found.pairs.iter().filter_map(between).collect();
        let mut lumens: BTreeMap<u32, Option<LumenOf>> = BTreeMap::new();
        let (mut pairs, mut drawn_out) = (BTreeSet::new(), Vec::new());
        for (a, b) in overlaps.near().into_iter().chain(crossing.iter().copied()) {
            for piece in [a, b] {
                lumens.entry(piece).or_insert_with(|| LumenOf::new(mesh, |t| overlaps.piece_of[t] == piece));
            }
            let lumen = |piece: u32| lumens.get(&piece).and_then(Option::as_ref);
            let is_begun = |of: u32, within: u32| lumen(within).is_some_and(|l| overlaps.begins(mesh, of, l));
            let has_closed = [a, b].iter().any(|p| overlaps.pieces[*p as usize].loops == 0);
            let short = [(a, b), (b, a)].map(|(of, within)| {
                lumen(within).map_or_else(Vec::new, |l| overlaps.short_mouths(mesh, of, l))
            });
            let joined = is_begun(a, b)
                || is_begun(b, a)
                || short.iter().any(|short| !short.is_empty())
                || crossing.contains(&(a, b))
                    && (has_closed
                        || [(a, b), (b, a)].iter().any(|(p, q)| overlaps.is_deep(mesh, *p, *q, lumen(*q))));
            if joined {
                pairs.insert((a, b));
                drawn_out.extend(short.into_iter().flatten());
            }
        }
        for (opening, by_mm) in drawn_out {
            let longest_mm = &mut overlaps.drawn_out_mm[opening];
            *longest_mm = longest_mm.max(by_mm);
        }
        overlaps.pairs = pairs;
        (!overlaps.pairs.is_empty()).then_some(overlaps)
    }

    /// Pairs of pieces of which one has a rim within the bounds of the other.
    fn near(&self) -> BTreeSet<(u32, u32)> {
        let mut pairs = BTreeSet::new();
        if self.pieces.len() > MOST_PIECES {
            return pairs;
        }
        for (opening, triangle) in self.boundary.openings.iter().zip(&self.boundary.first_triangle) {
            let own = self.piece_of[*triangle as usize];
            for (other, piece) in (0..).zip(&self.pieces) {
                let at = &opening.centre_mm;
                let within = (0..3).all(|k| piece.bounds.0[k] <= at[k] && at[k] <= piece.bounds.1[k]);
                let are_parts = piece.is_part && self.pieces[own as usize].is_part;
                if other != own && within && are_parts && piece.loops > 0 {
                    pairs.insert((own.min(other), own.max(other)));
                }
            }
        }
        pairs
    }

    /// Whether a rim of piece `of` lies in a lumen.
    fn begins(&self, mesh: &SurfaceMesh, of: u32, lumen: &LumenOf) -> bool {
        let own = self.boundary.openings.iter().zip(&self.boundary.first_triangle);
        own.filter(|(_, triangle)| self.piece_of[**triangle as usize] == of).any(|(opening, _)| {
            let inside = opening.boundary.iter().filter(|v| lumen.holds(&mesh.vertices_mm[**v as usize]));
            inside.count() as f64 >= BEGINS * opening.boundary.len() as f64
        })
    }

    /// The openings of piece `of` that lie partly in a lumen and would end in it if they were a little longer, and by how much,
    /// mm.
    fn short_mouths(&self, mesh: &SurfaceMesh, of: u32, lumen: &LumenOf) -> Vec<(usize, f64)> {
        let short_by_mm = |opening: &Opening| {
            let inside = |by_mm: f64| {
                let at = |v: &u32| mesh.vertices_mm[*v as usize] + opening.direction * by_mm;
                opening.boundary.iter().filter(|v| lumen.holds(&at(v))).count()
            };
            let all = opening.boundary.len();
            let by_mm = |step: usize| SHORT * opening.radius_mm * step as f64 / STEPS as f64;
            let rounding_mm = ROUNDED * opening.radius_mm;
            let mut rim = opening.boundary.iter().map(|v| &mesh.vertices_mm[*v as usize]);
            let is_partly = inside(0.0) < all && rim.any(|x| lumen.touches(x, rounding_mm));
            is_partly.then(|| (1..=STEPS).map(by_mm).find(|mm| inside(*mm) == all)).flatten()
        };
        let openings = self.boundary.openings.iter().zip(&self.boundary.first_triangle).enumerate();
        let own = openings.filter(|(_, (_, triangle))| self.piece_of[**triangle as usize] == of);
        own.filter_map(|(number, (opening, _))| Some((number, short_by_mm(opening)?))).collect()
    }

    /// Whether piece `of` reaches far into the lumen of another one.
    fn is_deep(&self, mesh: &SurfaceMesh, of: u32, other: u32, lumen: Option<&LumenOf>) -> bool {
        let [a, b] = [of, other].map(|p| &self.pieces[p as usize]);
        let deep_mm = DEEP * a.radius_mm().min(b.radius_mm());
        let Some(lumen) = lumen.filter(|_| a.meets(b)) else { return false };
        let own = (0..self.piece_of.len()).filter(|t| self.piece_of[*t] == of);
        let mut vertices: Vec<u32> = own.flat_map(|t| mesh.triangles[t]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.iter().any(|v| lumen.depth_mm(&mesh.vertices_mm[*v as usize]) > deep_mm)
    }

    /// Intersections within one piece, which must be repaired before it is united with others.
    pub(super) fn own(&self, found: &Crossings) -> Vec<[u32; 2]> {
        let piece = |t: u32| self.piece_of[t as usize];
        found.pairs.iter().copied().filter(|[a, b]| piece(*a) == piece(*b)).collect()
    }

    /// Unites what overlaps, takes bodies in the wall off, notes both, and returns their numbers.
    ///
    /// # Errors
    /// [`Error::Mesh`] if parts cannot be united.
    pub(super) fn unite(&self, mesh: &mut SurfaceMesh, noted: &mut Vec<Repair>) -> Result<(usize, usize)> {
        let mut sets = DisjointSets::new(self.pieces.len());
        self.pairs.iter().for_each(|(a, b)| sets.join(*a, *b));
        let (group_of, groups) = sets.number();
        let mut done_with: Vec<Option<RepairKind>> = vec![None; self.pieces.len()];
        let mut is_gone = vec![false; self.pieces.len()];
        let mut added = Vec::new();
        for group in 0..groups as u32 {
            let members: Vec<u32> =
                (0..self.pieces.len() as u32).filter(|p| group_of[*p as usize] == group).collect();
            if members.len() < 2 {
                continue;
            }
            let United { surface, bodies } =
                self.united(mesh, &members).ok_or_else(|| self.refused(mesh, &members))?;
            added.push(surface);
            // All but the largest were put to it.
            let main = members.iter().copied().max_by(|a, b| {
                let area = |p: u32| self.pieces[p as usize].area_mm2;
                area(*a).total_cmp(&area(*b)).then(b.cmp(a))
            });
            for p in members {
                let is_body = bodies.contains(&p);
                let kind = if is_body { RepairKind::BodyInWall } else { RepairKind::PartUnited };
                done_with[p as usize] = Some(kind).filter(|_| is_body || Some(p) != main);
                is_gone[p as usize] = true;
            }
        }
        let number = |kind: RepairKind| {
            let those = |t: usize| Some(self.piece_of[t]).filter(|p| done_with[*p as usize] == Some(kind));
            of_groups(kind, mesh, those)
        };
        let (united, bodies) = (number(RepairKind::PartUnited), number(RepairKind::BodyInWall));
        let counts = (united.len(), bodies.len());
        noted.extend(united.into_iter().chain(bodies));
        retain_numbered(&mut mesh.triangles, |t, _| !is_gone[self.piece_of[t] as usize]);
        for Closed { vertices_mm, triangles } in added {
            let first = mesh.vertices_mm.len() as u32;
            mesh.vertices_mm.extend(vertices_mm);
            mesh.triangles.extend(triangles.iter().map(|(triangle, _)| triangle.map(|v| v + first)));
        }
        Ok(counts)
    }

    /// Some pieces as one surface; `None` if that fails.
    ///
    /// Vessels that end are united first, then closed pieces, the largest first: one of which most lies in what is there, or
    /// that is a ring, is a body that stands in the wall, and is taken off at the end; any other is a part of the lumen, such as
    /// a sac.
    fn united(&self, mesh: &SurfaceMesh, members: &[u32]) -> Option<United> {
        let mut order = members.to_vec();
        let volume_mm3 = |p: &u32| self.pieces[*p as usize].volume_mm3.abs();
        let is_closed = |p: &u32| self.pieces[*p as usize].loops == 0;
        order.sort_by(|a, b| {
            is_closed(a).cmp(&is_closed(b)).then(volume_mm3(b).total_cmp(&volume_mm3(a))).then(a.cmp(b))
        });
        let closed = |p: u32| self.closed(mesh, p, self.pieces[p as usize].is_body());
        let mut whole = Solid::new(&closed(*order.first()?))?;
        let mut bodies = Vec::new();
        for &p in &order[1..] {
            let piece = closed(p);
            let next = Solid::new(&piece)?;
            let stands_in_wall = || piece.is_ring() || whole.common_mm3(&next) >= MOSTLY * next.volume_mm3();
            if is_closed(&p) && (self.pieces[p as usize].is_body() || stands_in_wall()) {
                bodies.push((p, next));
            } else {
                whole = whole.with(&next)?;
            }
        }
        let whole = bodies.iter().try_fold(whole, |whole, (_, body)| whole.without(body))?;
        let surface = self.opened(mesh, whole.triangles());
        Some(United { surface, bodies: bodies.into_iter().map(|(p, _)| p).collect() })
    }

    /// A piece closed by caps. Its triangles have their numbers in the mesh, those of caps the numbers beyond, by
    /// opening.
    fn closed(&self, mesh: &SurfaceMesh, piece: u32, turned: bool) -> Closed {
        let mut closed = SurfaceMesh { vertices_mm: mesh.vertices_mm.clone(), triangles: Vec::new() };
        let mut numbers = Vec::new();
        for (t, triangle) in (0..).zip(&mesh.triangles).filter(|(t, _)| self.piece_of[*t as usize] == piece) {
            let [a, b, c] = *triangle;
            closed.triangles.push(if turned { [a, c, b] } else { [a, b, c] });
            numbers.push(t);
        }
        let caps = mesh.triangles.len() as u32;
        let openings = self.boundary.openings.iter().zip(&self.boundary.first_triangle);
        for (number, (opening, triangle)) in (0..).zip(openings) {
            if self.piece_of[*triangle as usize] != piece {
                continue;
            }
            let by_mm = self.drawn_out_mm[number as usize];
            if by_mm > 0.0 {
                let drawn_out = opening.drawn_out(&mut closed, by_mm);
                // Triangles of one number would be taken for a flat face.
                let new = caps + self.boundary.openings.len() as u32..;
                numbers.extend(new.take(closed.triangles.len() - numbers.len()));
                drawn_out.close(&mut closed);
            } else {
                opening.close(&mut closed);
            }
            numbers.resize(closed.triangles.len(), caps + number);
        }
        crate::vessel::wall::drop_unreferenced(&mut closed);
        Closed {
            vertices_mm: closed.vertices_mm,
            triangles: closed.triangles.into_iter().zip(numbers).collect(),
        }
    }

    /// Without the caps of which most is left.
    fn opened(&self, mesh: &SurfaceMesh, mut whole: Closed) -> Closed {
        let caps = mesh.triangles.len() as u32;
        let area = |t: &[u32; 3]| mesh::area(&t.map(|v| whole.vertices_mm[v as usize]));
        let openings = &self.boundary.openings;
        let opening_of =
            |number: u32| number.checked_sub(caps).map(|n| n as usize).filter(|n| *n < openings.len());
        let mut left_mm2 = vec![0.0; openings.len()];
        for (triangle, number) in &whole.triangles {
            if let Some(opening) = opening_of(*number) {
                left_mm2[opening] += area(triangle);
            }
        }
        let is_open = |opening: usize| {
            let full_mm2: f64 = openings[opening].cap(mesh).map(|cap| mesh::area(&cap)).sum();
            left_mm2[opening] > OPEN * full_mm2
        };
        let open: Vec<bool> = (0..openings.len()).map(is_open).collect();
        whole.triangles.retain(|(_, number)| opening_of(*number).is_none_or(|opening| !open[opening]));
        whole
    }

    /// The error for parts that cannot be united.
    fn refused(&self, mesh: &SurfaceMesh, members: &[u32]) -> Error {
        let each = of_groups(RepairKind::PartUnited, mesh, |t| {
            Some(self.piece_of[t]).filter(|p| members.contains(p))
        });
        let places: Vec<String> = each.iter().map(ToString::to_string).collect();
        if !cfg!(feature = "union") {
            let (count, places) = (members.len(), places.join(", "));
            return Error::feature("union", format!("uniting {count} parts that overlap ({places})"));
        }
        Error::Mesh(format!(
            "{} parts overlap without being joined, and could not be united: {}; unite them in a program for meshes (\"boolean \
             union\"), or move them apart",
            members.len(),
            places.join(", ")
        ))
    }
}

fn measured(
    mesh: &SurfaceMesh,
    table: &EdgeTable,
    piece_of: &[u32],
    count: usize,
    boundary: &Boundary,
) -> Vec<Piece> {
    let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let mut pieces =
        vec![Piece { bounds: empty, area_mm2: 0.0, volume_mm3: 0.0, loops: 0, is_part: true }; count];
    let origin = mesh.vertices_mm.first().copied().unwrap_or_default();
    for (t, p) in piece_of.iter().enumerate() {
        let (piece, corners) = (&mut pieces[*p as usize], mesh.corners(t));
        piece.area_mm2 += mesh::area(&corners);
        piece.volume_mm3 += signed_volume(&corners, origin);
        for corner in &corners {
            piece.bounds = (piece.bounds.0.inf(corner), piece.bounds.1.sup(corner));
        }
    }
    for (opening, triangle) in boundary.openings.iter().zip(&boundary.first_triangle) {
        let piece = &mut pieces[piece_of[*triangle as usize] as usize];
        piece.loops += 1;
        piece.is_part &= Rim::of(mesh, table, opening).is_some_and(|rim| rim.is_end());
        piece.volume_mm3 += opening.cap(mesh).map(|cap| signed_volume(&cap, origin)).sum::<f64>();
    }
    pieces
}
