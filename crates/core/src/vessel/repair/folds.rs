//! Local self-intersections and folds.
//!
//! Attene, "A lightweight approach to repairing digitized polygon meshes", Visual Computer 26 (2010): intersecting
//! triangles are cut out with a ring around them, fragments are removed, and the hole is filled; if the filling
//! intersects again, the next round cuts a wider ring. Nothing else is changed. A surface that intersects itself over
//! a large part of its area, such as two vessels that cross, is not repaired: that would cut the vessel open.

use super::fill::fill;
use crate::vessel::crossings::{Crossings, crossings};
use crate::vessel::repairs::{Repair, RepairKind, of_triangles};
use crate::vessel::topology::{DisjointSets, EdgeTable};
use crate::vessel::{SurfaceMesh, mesh, opening};

/// Number of rounds, each with one more ring around the intersections.
const ROUNDS: usize = 5;
/// Number of intersecting pairs beyond which nothing is repaired: it is not a local fault.
const MOST_PAIRS: usize = 20_000;
/// Area to be cut out, as a fraction of its piece's, above which a fault is not local.
const LOCAL: f64 = 0.1;
/// Largest area of a fragment, as a fraction of its piece's, and relative to that of the cut.
const FRAGMENT: f64 = 0.02;
const FRAGMENT_OVER_CUT: f64 = 2.0;

/// The result of [`cure`].
#[derive(Debug, Default, Clone, PartialEq)]
pub(super) struct Cured {
    /// Intersecting pairs found.
    pub(super) found: usize,
    /// Remaining pairs.
    pub(super) left: usize,
    /// Whether a limit stopped the search: then nothing was changed.
    pub(super) capped: bool,
    /// Triangles cut out.
    pub(super) removed: usize,
    /// Triangles added.
    pub(super) added: usize,
}

/// A state between rounds: the mesh, its intersections, and the number of open loops.
#[derive(Clone)]
struct State {
    mesh: SurfaceMesh,
    pairs: Vec<[u32; 2]>,
    removed: usize,
    added: usize,
    noted: Vec<Repair>,
}

/// The intersections of a mesh, as many as are repaired.
pub(super) fn find(mesh: &SurfaceMesh, tolerance_mm: f64) -> Crossings {
    crossings(mesh, tolerance_mm, None, MOST_PAIRS)
}

/// Repairs these intersections of a consistently oriented mesh, and notes where.
pub(super) fn cure(
    mesh: &mut SurfaceMesh,
    tolerance_mm: f64,
    found: Crossings,
    noted: &mut Vec<Repair>,
) -> Cured {
    let mut cured =
        Cured { found: found.pairs.len(), left: found.pairs.len(), capped: found.capped, ..Cured::default() };
    if found.pairs.is_empty() || found.capped {
        noted.extend(left(mesh, &found.pairs));
        return cured;
    }
    let openings = |mesh: &SurfaceMesh, table: &EdgeTable| opening::boundary(mesh, table).openings.len();
    let loops = openings(mesh, &EdgeTable::new(&mesh.triangles));
    let mut state = State { mesh: mesh.clone(), pairs: found.pairs, removed: 0, added: 0, noted: Vec::new() };
    let (mut done, mut still) = (Vec::new(), left(mesh, &state.pairs));
    for rings in 0..ROUNDS {
        let Some(next) = round(&state, rings, tolerance_mm) else { break };
        state = next;
        let table = EdgeTable::new(&state.mesh.triangles);
        let sound = openings(&state.mesh, &table) <= loops && table.non_manifold() == 0;
        if sound && state.pairs.len() < cured.left {
            (cured.left, cured.removed, cured.added) = (state.pairs.len(), state.removed, state.added);
            (done, still) = (state.noted.clone(), left(&state.mesh, &state.pairs));
            mesh.clone_from(&state.mesh);
        }
        if state.pairs.is_empty() {
            break;
        }
    }
    noted.extend(done.into_iter().chain(still));
    cured
}

/// Where these pairs of triangles intersect.
fn left(mesh: &SurfaceMesh, pairs: &[[u32; 2]]) -> Vec<Repair> {
    of_triangles(RepairKind::StillCrossing, mesh, pairs.iter().flatten().copied())
}

/// One round; `None` if there is nothing that it may cut out.
fn round(state: &State, rings: usize, tolerance_mm: f64) -> Option<State> {
    let mesh = &state.mesh;
    let table = EdgeTable::new(&mesh.triangles);
    let (piece, pieces) = table.components(mesh.triangles.len());
    let mut area = vec![0.0; pieces];
    for (index, p) in piece.iter().enumerate() {
        area[*p as usize] += mesh::area(&mesh.corners(index));
    }
    let mut bad = vec![false; mesh.triangles.len()];
    state.pairs.iter().flatten().for_each(|t| bad[*t as usize] = true);
    for _ in 0..rings {
        grow(mesh, &mut bad);
    }
    let clusters = Clusters::new(mesh, &bad);
    keep_local(mesh, &clusters, &piece, &area, &mut bad);
    let fragments = restore_bridges(mesh, &clusters, &piece, &area, &mut bad);
    if !bad.contains(&true) {
        return None;
    }
    // The remaining triangles, with the new index of each.
    let mut number = vec![u32::MAX; mesh.triangles.len()];
    let mut next = State {
        mesh: SurfaceMesh { vertices_mm: mesh.vertices_mm.clone(), triangles: Vec::new() },
        pairs: Vec::new(),
        removed: state.removed,
        added: state.added,
        noted: state.noted.clone(),
    };
    let cut_out = (0..bad.len()).filter(|t| bad[*t] || fragments[*t]).map(|t| t as u32);
    next.noted.extend(of_triangles(RepairKind::FoldReplaced, mesh, cut_out));
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        if !bad[index] && !fragments[index] {
            number[index] = next.mesh.triangles.len() as u32;
            next.mesh.triangles.push(*triangle);
        }
    }
    let kept = next.mesh.triangles.len();
    next.removed += mesh.triangles.len() - kept;
    let filled = close_new(&next.mesh, &table)?;
    next.added += filled.len();
    next.mesh.triangles.extend(filled);
    let is_new: Vec<bool> = (0..next.mesh.triangles.len()).map(|t| t >= kept).collect();
    let fresh = crossings(&next.mesh, tolerance_mm, Some(&is_new), MOST_PAIRS);
    let old = state.pairs.iter().map(|pair| pair.map(|t| number[t as usize]));
    next.pairs.extend(old.filter(|pair| pair.iter().all(|t| *t != u32::MAX)));
    next.pairs.extend(fresh.pairs);
    next.pairs.sort_unstable();
    Some(next)
}

/// Adds to `bad` all triangles that touch one in it.
fn grow(mesh: &SurfaceMesh, bad: &mut [bool]) {
    let mut touched = vec![false; mesh.vertices_mm.len()];
    for (triangle, _) in mesh.triangles.iter().zip(bad.iter()).filter(|(_, bad)| **bad) {
        triangle.iter().for_each(|v| touched[*v as usize] = true);
    }
    for (triangle, bad) in mesh.triangles.iter().zip(bad) {
        *bad |= triangle.iter().any(|v| touched[*v as usize]);
    }
}

/// Bad triangles that share vertices.
struct Clusters {
    /// By vertex; `u32::MAX` without bad triangles.
    of_vertex: Vec<u32>,
    count: usize,
}

impl Clusters {
    fn new(mesh: &SurfaceMesh, bad: &[bool]) -> Self {
        let mut sets = DisjointSets::new(mesh.vertices_mm.len());
        let mut of_vertex = vec![u32::MAX; mesh.vertices_mm.len()];
        for (triangle, _) in mesh.triangles.iter().zip(bad).filter(|(_, bad)| **bad) {
            for v in triangle {
                sets.join(triangle[0], *v);
                of_vertex[*v as usize] = 0;
            }
        }
        let mut count = 0;
        for v in 0..of_vertex.len() {
            if of_vertex[v] == u32::MAX {
                continue;
            }
            let root = sets.find(v as u32) as usize;
            // The root is the smallest of its set, so its index is already set.
            of_vertex[v] = if root == v { count } else { of_vertex[root] };
            count += u32::from(root == v);
        }
        Self { of_vertex, count: count as usize }
    }

    /// The cluster of a bad triangle.
    fn of(&self, triangle: &[u32; 3]) -> usize {
        self.of_vertex[triangle[0] as usize] as usize
    }
}

/// Removes from `bad` the clusters that are too large for a local fault.
fn keep_local(mesh: &SurfaceMesh, clusters: &Clusters, piece: &[u32], area: &[f64], bad: &mut [bool]) {
    let mut share = vec![0.0; clusters.count];
    for (index, triangle) in mesh.triangles.iter().enumerate().filter(|(index, _)| bad[*index]) {
        share[clusters.of(triangle)] +=
            mesh::area(&mesh.corners(index)) / area[piece[index] as usize].max(f64::MIN_POSITIVE);
    }
    for (bad, triangle) in bad.iter_mut().zip(&mesh.triangles) {
        *bad = *bad && share[clusters.of(triangle)] <= LOCAL;
    }
}

/// Removes from `bad` the clusters to which a branch of the vessel is attached, and marks the fragments that the
/// others cut off.
fn restore_bridges(
    mesh: &SurfaceMesh,
    clusters: &Clusters,
    piece: &[u32],
    area: &[f64],
    bad: &mut [bool],
) -> Vec<bool> {
    let mut fragments = vec![false; mesh.triangles.len()];
    for _ in 0..3 {
        let kept: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|t| !bad[*t as usize]).collect();
        let triangles: Vec<[u32; 3]> = kept.iter().map(|t| mesh.triangles[*t as usize]).collect();
        let (part, parts) = EdgeTable::new(&triangles).components(triangles.len());
        let mut size = vec![0.0; parts];
        let mut parent = vec![0; parts];
        for (t, p) in kept.iter().zip(&part) {
            size[*p as usize] += mesh::area(&mesh.corners(*t as usize));
            parent[*p as usize] = piece[*t as usize] as usize;
        }
        // The largest part of each piece represents it.
        let mut trunk = vec![usize::MAX; area.len()];
        for p in 0..parts {
            let best = &mut trunk[parent[p]];
            if *best == usize::MAX || size[p] > size[*best] {
                *best = p;
            }
        }
        let mut cut = vec![0.0; area.len()];
        for t in (0..mesh.triangles.len()).filter(|t| bad[*t]) {
            cut[piece[t] as usize] += mesh::area(&mesh.corners(t));
        }
        let is_fragment: Vec<bool> = (0..parts)
            .map(|p| size[p] <= (FRAGMENT * area[parent[p]]).min(FRAGMENT_OVER_CUT * cut[parent[p]]))
            .collect();
        let mut restored = vec![false; clusters.count];
        for (t, p) in kept.iter().zip(&part) {
            let p = *p as usize;
            fragments[*t as usize] = p != trunk[parent[p]] && is_fragment[p];
            if p != trunk[parent[p]] && !is_fragment[p] {
                for v in mesh.triangles[*t as usize] {
                    if let Some(restored) = restored.get_mut(clusters.of_vertex[v as usize] as usize) {
                        *restored = true;
                    }
                }
            }
        }
        let mut changed = false;
        for (bad, triangle) in bad.iter_mut().zip(&mesh.triangles) {
            if *bad && restored[clusters.of(triangle)] {
                (*bad, changed) = (false, true);
            }
        }
        if !changed {
            return fragments;
        }
        fragments.fill(false);
    }
    // If cuts keep cutting off branches, none is made.
    bad.fill(false);
    fragments
}

/// Triangles over the loops of `mesh` whose edges were not open in the mesh of `before`. `None` if one cannot be
/// closed.
fn close_new(mesh: &SurfaceMesh, before: &EdgeTable) -> Option<Vec<[u32; 3]>> {
    let table = EdgeTable::new(&mesh.triangles);
    let mut filled = Vec::new();
    for opening in opening::boundary(mesh, &table).openings {
        let rim = &opening.boundary;
        let was_open = |k: usize| before.uses(rim[k], rim[(k + 1) % rim.len()]).len() == 1;
        // A loop with old open edges is the rim of an opening, now ragged.
        if !(0..rim.len()).any(was_open) {
            filled.extend(fill(mesh, &table, rim)?);
        }
    }
    Some(filled)
}
