//! Edges of more than two triangles.
//!
//! Cut along such edges a surface decomposes into sheets. A sheet that others do not need – a fin, a second layer, a
//! membrane across the lumen – is the smaller one at its edges and is removed. Where the rest still touches itself
//! along an edge, the edge is divided into one per pair of triangles (Guéziec et al., "Cutting and stitching", IEEE
//! TVCG 7, 2001): vertices are duplicated, nothing moves.

use crate::Vec3;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::repairs::{Repair, RepairKind, of_groups, of_triangles};
use crate::vessel::topology::{DisjointSets, EdgeTable, EdgeUse, Edges};
use crate::vessel::{SurfaceMesh, mesh};

/// Rounds of removing sheets: each may expose the next.
const ROUNDS: usize = 16;
/// Ratio of size to the largest adjacent sheet above which a sheet is not removed.
const LARGEST: f64 = 0.5;
/// Fraction of its crowded edges at which a sheet must be the odd one out to count as an intruder.
const ODD: f64 = 0.5;

/// The result of [`resolve`].
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Resolved {
    /// Triangles removed.
    pub(super) removed: usize,
    /// Edges cut.
    pub(super) cut: usize,
}

/// Removes superfluous sheets, cuts the other edges of more than two triangles, and notes where.
pub(super) fn resolve(mesh: &mut SurfaceMesh, edges: &mut Edges, noted: &mut Vec<Repair>) -> Resolved {
    let mut resolved = Resolved::default();
    for _ in 0..ROUNDS {
        let table = edges.of(&mesh.triangles);
        if table.non_manifold() == 0 {
            return resolved;
        }
        let removed = Sheets::new(mesh, table).remove(mesh, noted);
        resolved.removed += removed;
        if removed == 0 {
            break;
        }
        edges.changed();
    }
    let table = edges.of(&mesh.triangles);
    let sheets = Sheets::new(mesh, table);
    let crowded = table.edges().filter(|uses| uses.len() > 2).flatten().map(|used| used.triangle);
    noted.extend(of_triangles(RepairKind::EdgeCut, mesh, crowded));
    resolved.cut = cut(mesh, table, &sheets.of);
    edges.changed();
    resolved.removed += prune(mesh, noted);
    resolved
}

/// The decomposition of a surface along its crowded edges, those of more than two triangles.
struct Sheets {
    /// The sheet of each triangle.
    of: Vec<u32>,
    area: Vec<f64>,
    /// The sheets at each crowded edge, one for every use.
    users: Vec<Vec<u32>>,
    /// The crowded edges of each sheet.
    edges: Vec<Vec<usize>>,
    /// The number of these at which it has no partner.
    odd: Vec<usize>,
}

impl Sheets {
    fn new(mesh: &SurfaceMesh, table: &EdgeTable) -> Self {
        let mut sets = DisjointSets::new(mesh.triangles.len());
        for uses in table.edges() {
            if let [a, b] = uses {
                sets.join(a.triangle, b.triangle);
            }
        }
        let (of, count) = sets.number();
        let mut sheets = Self {
            of,
            area: vec![0.0; count],
            users: vec![],
            edges: vec![vec![]; count],
            odd: vec![0; count],
        };
        for (index, sheet) in sheets.of.iter().enumerate() {
            sheets.area[*sheet as usize] += mesh::area(&mesh.corners(index));
        }
        for uses in table.edges().filter(|uses| uses.len() > 2) {
            let users: Vec<u32> = uses.iter().map(|u| sheets.of[u.triangle as usize]).collect();
            let mut alone = vec![true; uses.len()];
            for (a, b) in pairs(mesh, uses, &sheets.of) {
                (alone[a], alone[b]) = (false, false);
            }
            for (user, alone) in users.iter().zip(alone) {
                let edges = &mut sheets.edges[*user as usize];
                if edges.last() != Some(&sheets.users.len()) {
                    edges.push(sheets.users.len());
                }
                sheets.odd[*user as usize] += usize::from(alone);
            }
            sheets.users.push(users);
        }
        sheets
    }

    /// Removes the sheets that no edge needs: intruders, or without any, small ones. Returns the number of triangles
    /// removed.
    fn remove(&self, mesh: &mut SurfaceMesh, noted: &mut Vec<Repair>) -> usize {
        let crowded = |s: &usize| !self.edges[*s].is_empty();
        let mut order: Vec<usize> = (0..self.area.len()).filter(crowded).collect();
        // The smallest first; among equals the later in the file.
        order.sort_by(|a, b| self.area[*a].total_cmp(&self.area[*b]).then(b.cmp(a)));
        let intrudes = |s: &usize| self.odd[*s] as f64 >= ODD * self.edges[*s].len() as f64;
        let (intruders, others): (Vec<usize>, Vec<usize>) = order.iter().partition(|s| intrudes(s));
        for candidates in [intruders, others] {
            let gone = self.spare(&candidates);
            let before = mesh.triangles.len();
            if gone.contains(&true) {
                let removed = |t: usize| Some(self.of[t]).filter(|sheet| gone[*sheet as usize]);
                noted.extend(of_groups(RepairKind::SheetRemoved, mesh, removed));
            }
            retain_numbered(&mut mesh.triangles, |index, _| !gone[self.of[index] as usize]);
            if mesh.triangles.len() < before {
                return before - mesh.triangles.len();
            }
        }
        0
    }

    /// Which candidates can be removed together: each edge keeps two triangles, and a larger sheet.
    fn spare(&self, candidates: &[usize]) -> Vec<bool> {
        let mut left: Vec<usize> = self.users.iter().map(Vec::len).collect();
        let mut gone = vec![false; self.area.len()];
        for &s in candidates {
            let own = |edge: &usize| self.users[*edge].iter().filter(|user| **user as usize == s).count();
            let spare = self.edges[s].iter().all(|edge| {
                let others = self.users[*edge].iter().map(|user| *user as usize);
                let largest = others
                    .filter(|user| *user != s && !gone[*user])
                    .map(|user| self.area[user])
                    .fold(0.0, f64::max);
                // Of two layers of equal size one is removed, if something far larger holds both.
                left[*edge] >= own(edge) + 2 && self.area[s] <= LARGEST * largest
            });
            if spare {
                gone[s] = true;
                for edge in &self.edges[s] {
                    left[*edge] -= own(edge);
                }
            }
        }
        gone
    }
}

/// Removes triangles, the smallest first, until no edge has more than two; returns their number. The last resort for
/// complicated clusters.
pub(super) fn prune(mesh: &mut SurfaceMesh, noted: &mut Vec<Repair>) -> usize {
    let before = mesh.triangles.len();
    loop {
        let table = EdgeTable::new(&mesh.triangles);
        let mut gone = vec![false; mesh.triangles.len()];
        let mut any = false;
        for uses in table.edges().filter(|uses| uses.len() > 2) {
            let mut by_area: Vec<u32> =
                uses.iter().map(|u| u.triangle).filter(|t| !gone[*t as usize]).collect();
            by_area.sort_by(|a, b| {
                let area = |t: &u32| mesh::area(&mesh.corners(*t as usize));
                area(b).total_cmp(&area(a)).then(a.cmp(b))
            });
            for t in by_area.iter().skip(2) {
                (gone[*t as usize], any) = (true, true);
            }
        }
        if !any {
            return before - mesh.triangles.len();
        }
        let pruned = (0..gone.len() as u32).filter(|t| gone[*t as usize]);
        noted.extend(of_triangles(RepairKind::SheetRemoved, mesh, pruned));
        retain_numbered(&mut mesh.triangles, |index, _| !gone[index]);
    }
}

/// Duplicates vertices so that no edge has more than two triangles; returns the number of edges that had.
fn cut(mesh: &mut SurfaceMesh, table: &EdgeTable, sheet: &[u32]) -> usize {
    // Corners 3t … 3t + 2 of triangle t; those that stay one vertex are joined across the edges that stay.
    let mut corners = DisjointSets::new(3 * mesh.triangles.len());
    let mut crowded = vec![false; mesh.vertices_mm.len()];
    let mut count = 0;
    let triangles = &mesh.triangles;
    let corner = |t: u32, vertex: u32| {
        let k = triangles[t as usize].iter().position(|v| *v == vertex).unwrap_or(0);
        3 * t + k as u32
    };
    let mut stitch = |a: &EdgeUse, b: &EdgeUse| {
        for vertex in [a.low, a.high] {
            corners.join(corner(a.triangle, vertex), corner(b.triangle, vertex));
        }
    };
    for uses in table.edges() {
        match uses {
            [_] => {}
            [a, b] => stitch(a, b),
            many => {
                count += 1;
                (crowded[many[0].low as usize], crowded[many[0].high as usize]) = (true, true);
                for (a, b) in pairs(mesh, many, sheet) {
                    stitch(&many[a], &many[b]);
                }
            }
        }
    }
    if count == 0 {
        return 0;
    }
    // The first set of corners at a vertex keeps it, the others get vertices of their own.
    let mut owner = vec![u32::MAX; mesh.vertices_mm.len()];
    let mut vertex_of = vec![u32::MAX; 3 * mesh.triangles.len()];
    for t in 0..mesh.triangles.len() {
        for k in 0..3 {
            let vertex = mesh.triangles[t][k];
            if !crowded[vertex as usize] {
                continue;
            }
            let set = corners.find((3 * t + k) as u32);
            if vertex_of[set as usize] == u32::MAX {
                vertex_of[set as usize] = if owner[vertex as usize] == u32::MAX {
                    owner[vertex as usize] = set;
                    vertex
                } else {
                    mesh.vertices_mm.push(mesh.vertices_mm[vertex as usize]);
                    mesh.vertices_mm.len() as u32 - 1
                };
            }
            mesh.triangles[t][k] = vertex_of[set as usize];
        }
    }
    count
}

/// Pairs of triangles at a crowded edge that continue each other: those of one sheet first, then the flattest. One
/// may remain.
fn pairs(mesh: &SurfaceMesh, uses: &[EdgeUse], sheet: &[u32]) -> Vec<(usize, usize)> {
    // In the plane of the triangle, away from the edge.
    let away = |u: &EdgeUse| -> Vec3 {
        let t = mesh.triangles[u.triangle as usize];
        let apex = mesh.vertices_mm[t[(u.side as usize + 2) % 3] as usize];
        let (low, high) = (mesh.vertices_mm[u.low as usize], mesh.vertices_mm[u.high as usize]);
        let along = (high - low).try_normalize(0.0).unwrap_or_default();
        let offset = apex - low;
        (offset - along * along.dot(&offset)).try_normalize(0.0).unwrap_or_default()
    };
    // A cluster of thousands of triangles is not worth pairing optimally.
    const MOST: usize = 32;
    let directions: Vec<Vec3> = uses.iter().take(MOST).map(away).collect();
    let apart = |a: usize, b: usize| sheet[uses[a].triangle as usize] != sheet[uses[b].triangle as usize];
    let mut candidates: Vec<(bool, f64, usize, usize)> = (0..directions.len())
        .flat_map(|a| (a + 1..directions.len()).map(move |b| (a, b)))
        .map(|(a, b)| (apart(a, b), directions[a].dot(&directions[b]), a, b))
        .collect();
    candidates.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then((a.2, a.3).cmp(&(b.2, b.3))));
    let mut taken = vec![false; directions.len()];
    let mut pairs = Vec::new();
    for (_, _, a, b) in candidates {
        if !taken[a] && !taken[b] {
            (taken[a], taken[b]) = (true, true);
            pairs.push((a, b));
        }
    }
    pairs
}
