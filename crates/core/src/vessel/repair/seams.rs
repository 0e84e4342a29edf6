//! Seams with different vertices on both sides: T-junctions.
//!
//! Parts meshed separately meet along a line, with vertices of their own there. An open edge is split at the open
//! vertices that lie on it, so that both sides share all of them; this closes gaps and overlaps, since an edge moves
//! to its new vertices. Vertices opposite each other across a gap are merged. An edge is split only if most of its
//! parts then meet an open edge of the other side: rims that merely pass each other are not a seam.

use std::collections::{HashMap, HashSet};

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::repairs::{Repair, RepairKind, of_triangles};
use crate::vessel::topology::{EdgeTable, EdgeUse};

/// Largest distance of a vertex from an edge on which it lies, relative to the edge's length; it must not exceed the
/// median open edge either. A circle of twelve edges is 0.07 of an edge from its chords.
const WIDTH: f64 = 0.15;
/// Cosine of the angle between the directions in which two surfaces end, above which they are two layers that end at one place,
/// as a stent at the opening of its vessel, and not the sides of a seam.
pub(super) const LAYERS: f64 = 0.9;
/// Length, in median open edges, above which open edges are not searched along.
const MOST_CELLS: f64 = 1000.0;
/// Number of vertices in a cell above which it is a cluster and not a seam.
const CROWD: usize = 64;

/// An open edge and the vertices that lie on it, in order from its first corner.
struct Split {
    edge: EdgeUse,
    ends: [u32; 2],
    vertices: Vec<u32>,
}

impl Split {
    /// The edges into which it is split.
    fn parts(&self) -> impl Iterator<Item = (u32, u32)> {
        let [first, last] = self.ends;
        let begins = std::iter::once(first).chain(self.vertices.iter().copied());
        begins.zip(self.vertices.iter().copied().chain([last]))
    }
}

fn undirected((a, b): (u32, u32)) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Splits open edges of a mesh, whose edges are in `table`, at the vertices of the other side of a seam, and merges
/// vertices opposite each other; notes where, and returns the numbers of edges split and vertices merged.
pub(super) fn sew(mesh: &mut SurfaceMesh, table: &EdgeTable, noted: &mut Vec<Repair>) -> (usize, usize) {
    let open: Vec<EdgeUse> = table.edges().filter(|uses| uses.len() == 1).map(|uses| uses[0]).collect();
    let Some(rims) = Rims::new(mesh, &open) else { return (0, 0) };
    let opposite = rims.opposite();
    let merged = |v: u32| opposite.get(&v).copied().unwrap_or(v);
    let mut splits = rims.splits(&opposite);
    // The number of uses of each edge after sewing. Maps are only looked up, and what is taken from them is sorted:
    // their order cannot affect the result.
    let split: HashSet<(u32, u32)> = splits.iter().map(|s| (s.edge.low, s.edge.high)).collect();
    let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
    let whole = open.iter().map(|edge| (edge.low, edge.high)).filter(|edge| !split.contains(edge));
    let parts: Vec<(u32, u32)> = whole.chain(splits.iter().flat_map(Split::parts)).collect();
    let sewn = |(a, b): (u32, u32)| undirected((merged(a), merged(b)));
    for part in &parts {
        *sides.entry(sewn(*part)).or_default() += 1;
    }
    let is_met = |part: &(u32, u32)| {
        let (a, b) = sewn(*part);
        a != b && sides.get(&(a, b)) == Some(&2)
    };
    splits.retain(|split| 2 * split.parts().filter(is_met).count() > split.parts().count());
    // Vertices at edges that meet nothing are not moved.
    let at_seams: HashSet<u32> =
        parts.iter().filter(|part| is_met(part)).flat_map(|(a, b)| [merged(*a), merged(*b)]).collect();
    for split in &splits {
        apply(mesh, split);
    }
    let mut target: Vec<(u32, u32)> =
        opposite.iter().map(|(from, to)| (*from, *to)).filter(|(_, to)| at_seams.contains(to)).collect();
    target.sort_unstable();
    let moved = |v: u32| target.binary_search_by_key(&v, |(from, _)| *from).map_or(v, |at| target[at].1);
    let mut at_seams: Vec<u32> = splits.iter().map(|split| split.edge.triangle).collect();
    for (index, triangle) in mesh.triangles.iter_mut().enumerate() {
        let own = triangle.map(moved);
        if own != *triangle && own[0] != own[1] && own[1] != own[2] && own[2] != own[0] {
            *triangle = own;
            at_seams.push(index as u32);
        }
    }
    noted.extend(of_triangles(RepairKind::SeamSewn, mesh, at_seams));
    (splits.len(), target.len())
}

/// The open edges of a mesh and their vertices, by position.
struct Rims<'a> {
    mesh: &'a SurfaceMesh,
    open: &'a [EdgeUse],
    /// Side of a cell of the grid, mm: the median open edge.
    cell: f64,
    /// Vertices of open edges, in order, and the shortest open edge at each, mm.
    vertices: Vec<(u32, f64)>,
    grid: HashMap<[i64; 3], Vec<u32>>,
    /// The sum of the directions in which the surface ends at each vertex.
    beyond: HashMap<u32, Vec3>,
}

impl<'a> Rims<'a> {
    /// `None` if edges have no length.
    fn new(mesh: &'a SurfaceMesh, open: &'a [EdgeUse]) -> Option<Self> {
        let at = |v: u32| mesh.vertices_mm[v as usize];
        let length = |edge: &EdgeUse| (at(edge.low) - at(edge.high)).norm();
        let mut lengths: Vec<f64> = open.iter().map(length).collect();
        let middle = lengths.len().checked_sub(1)? / 2;
        let cell = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        if cell <= 0.0 || !cell.is_finite() {
            return None;
        }
        let mut vertices: Vec<(u32, f64)> =
            open.iter().flat_map(|edge| [edge.low, edge.high].map(|v| (v, length(edge)))).collect();
        vertices.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        vertices.dedup_by_key(|(v, _)| *v);
        let grid = HashMap::with_capacity(vertices.len());
        let mut rims =
            Self { mesh, open, cell, grid, beyond: HashMap::with_capacity(vertices.len()), vertices };
        for &(v, _) in &rims.vertices {
            rims.grid.entry(rims.place(&at(v))).or_default().push(v);
        }
        for edge in open {
            for v in [edge.low, edge.high] {
                *rims.beyond.entry(v).or_default() += beyond(mesh, edge);
            }
        }
        Some(rims)
    }

    /// Whether the surface ends at a vertex in this direction, too.
    fn ends_alike(&self, v: u32, direction: &Vec3) -> bool {
        let own = self.beyond.get(&v).copied().unwrap_or_default();
        own.dot(direction) > LAYERS * own.norm() * direction.norm()
    }

    fn at(&self, v: u32) -> Vec3 {
        self.mesh.vertices_mm[v as usize]
    }

    fn place(&self, p: &Vec3) -> [i64; 3] {
        [p.x, p.y, p.z].map(|c| (c / self.cell).floor() as i64)
    }

    /// Vertices in the cell of a position and its neighbours, except in clusters.
    fn around(&self, p: &Vec3) -> impl Iterator<Item = u32> {
        let [x, y, z] = self.place(p);
        let cells = (0..27_i64).map(move |k| {
            [x.saturating_add(k % 3 - 1), y.saturating_add(k / 3 % 3 - 1), z.saturating_add(k / 9 - 1)]
        });
        cells.filter_map(|cell| self.grid.get(&cell)).filter(|crowd| crowd.len() <= CROWD).flatten().copied()
    }

    /// Pairs of vertices that are each other's nearest and as close as a vertex on an edge is: the later with the
    /// earlier one.
    fn opposite(&self) -> HashMap<u32, u32> {
        let mut beside: HashSet<(u32, u32)> = HashSet::new();
        for edge in self.open {
            let t = self.mesh.triangles[edge.triangle as usize];
            beside.extend([(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(undirected));
        }
        let nearest: HashMap<u32, u32> = self
            .vertices
            .iter()
            .filter_map(|&(v, reach)| {
                let p = self.at(v);
                let off = |w: &u32| (self.at(*w) - p).norm();
                let other = self
                    .around(&p)
                    .filter(|w| *w != v && !beside.contains(&undirected((v, *w))))
                    .filter(|w| !self.ends_alike(*w, &self.beyond[&v]))
                    .min_by(|a, b| off(a).total_cmp(&off(b)).then(a.cmp(b)))?;
                (off(&other) <= WIDTH * reach).then_some((v, other))
            })
            .collect();
        let is_mutual = |(v, w): &(&u32, &u32)| w < v && nearest.get(w) == Some(v);
        nearest.iter().filter(is_mutual).map(|(v, w)| (*v, *w)).collect()
    }

    /// The open edges on which open vertices lie: each vertex on the nearest one, unless it will become an end of it.
    fn splits(&self, opposite: &HashMap<u32, u32>) -> Vec<Split> {
        let merged = |v: u32| opposite.get(&v).copied().unwrap_or(v);
        // For each vertex the nearest edge that it lies on: distance, edge, and position along it.
        let mut nearest: HashMap<u32, (f64, usize, f64)> = HashMap::new();
        let mut near = Vec::new();
        for (index, edge) in self.open.iter().enumerate() {
            let (a, b) = (self.at(edge.low), self.at(edge.high));
            let length = (b - a).norm();
            let steps = (length / self.cell).ceil().max(1.0);
            if steps > MOST_CELLS {
                continue;
            }
            near.clear();
            for step in 0..=steps as u32 {
                near.extend(self.around(&(a + (b - a) * (f64::from(step) / steps))));
            }
            near.sort_unstable();
            near.dedup();
            let width = (WIDTH * length).min(self.cell);
            // A flat triangle is not a seam.
            let own = self.mesh.triangles[edge.triangle as usize].map(merged);
            let direction = beyond(self.mesh, edge);
            for &v in near.iter().filter(|v| !own.contains(&merged(**v)) && !self.ends_alike(**v, &direction))
            {
                let along = (self.at(v) - a).dot(&(b - a)) / (length * length);
                let off = (self.at(v) - a - (b - a) * along).norm();
                if along > 0.0
                    && along < 1.0
                    && off <= width
                    && nearest.get(&v).is_none_or(|best| off < best.0)
                {
                    nearest.insert(v, (off, index, along));
                }
            }
        }
        let mut on: Vec<(usize, f64, u32)> = self
            .vertices
            .iter()
            .filter_map(|(v, _)| nearest.get(v).map(|(_, edge, along)| (*edge, *along, *v)))
            .collect();
        on.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        on.chunk_by(|a, b| a.0 == b.0)
            .map(|of_edge| {
                let edge = self.open[of_edge[0].0];
                Split {
                    edge,
                    ends: [edge.low, edge.high],
                    vertices: of_edge.iter().map(|(.., v)| *v).collect(),
                }
            })
            .collect()
    }
}

/// The unit direction in the plane of a triangle that points out over its open edge; zero for a triangle without area.
pub(super) fn beyond(mesh: &SurfaceMesh, edge: &EdgeUse) -> Vec3 {
    let corners = mesh.corners(edge.triangle as usize);
    let side = edge.side as usize;
    let along = corners[(side + 1) % 3] - corners[side];
    let back = corners[(side + 2) % 3] - corners[side];
    (along * (along.dot(&back) / along.norm_squared()) - back).try_normalize(0.0).unwrap_or_default()
}

/// Divides the triangle at a split edge into a fan around the opposite corner.
fn apply(mesh: &mut SurfaceMesh, split: &Split) {
    let has_edge = |t: &[u32; 3]| {
        (0..3).position(|k| undirected((t[k], t[(k + 1) % 3])) == (split.edge.low, split.edge.high))
    };
    // Another edge of the triangle may have been split before: then this edge is in one of the last triangles.
    let Some(index) = std::iter::once(split.edge.triangle as usize)
        .chain((0..mesh.triangles.len()).rev())
        .find(|index| has_edge(&mesh.triangles[*index]).is_some())
    else {
        return;
    };
    let triangle = mesh.triangles[index];
    let Some(side) = has_edge(&triangle) else { return };
    let (from, apex) = (triangle[side], triangle[(side + 2) % 3]);
    let is_forward = from == split.edge.low;
    let turned = |(p, q): (u32, u32)| if is_forward { [p, q, apex] } else { [q, p, apex] };
    let mut parts = split.parts().map(turned);
    if let Some(first) = parts.next() {
        mesh.triangles[index] = first;
    }
    mesh.triangles.extend(parts);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::vessel::{Wall, check};

    /// A tube of rings along z, each with its number of vertices; two successive rings at one position form a seam.
    fn tube(pieces: &[&[(f64, u32, f64)]]) -> SurfaceMesh {
        let mut mesh = SurfaceMesh::default();
        for rings in pieces {
            let mut before: Option<(u32, u32)> = None;
            for &(z, count, turn) in *rings {
                let first = mesh.vertices_mm.len() as u32;
                for k in 0..count {
                    let (sin, cos) = (TAU * (f64::from(k) + turn) / f64::from(count)).sin_cos();
                    mesh.vertices_mm.push(Vec3::new(4.0 * cos, 4.0 * sin, z));
                }
                if let Some((below, _)) = before.filter(|(_, other)| *other == count) {
                    for k in 0..count {
                        let next = (k + 1) % count;
                        mesh.triangles.push([below + k, below + next, first + next]);
                        mesh.triangles.push([below + k, first + next, first + k]);
                    }
                }
                before = Some((first, count));
            }
        }
        mesh
    }

    /// A tube with a seam at 20 mm, `gap` wide, whose upper side has `count` vertices, rotated by a fraction of an
    /// edge.
    fn seamed(count: u32, turn: f64, gap: f64) -> SurfaceMesh {
        let rings = |from: f64, count: u32, turn: f64| [0.0, 1.0, 2.0, 3.0].map(|z| (from + z, count, turn));
        tube(&[&rings(17.0, 24, 0.0), &rings(20.0 + gap, count, turn)])
    }

    #[test]
    fn sides_with_other_vertices_are_sewn_and_the_seam_is_reported() {
        for (count, turn, gap) in [
            (48, 0.0, 0.0),
            (24, 0.5, 0.0),
            (24, 0.3, 0.02),
            (25, 0.0, 0.0),
            (72, 0.0, 0.02),
            (36, 0.25, -0.03),
        ] {
            let surface = seamed(count, turn, gap);
            let wall = Wall::from_surface(&surface).unwrap();
            let report = wall.report();
            assert_eq!((report.components, report.openings), (1, 2), "{count} {turn} {gap}: {report:?}");
            assert_eq!(report.stray_edges + report.non_manifold_edges, 0, "{count} {turn} {gap}: {report:?}");
            assert!(report.edges_sewn >= 24, "{count} {turn} {gap}: {report:?}");
            let checked = check(&surface).unwrap();
            assert!(!checked.is_sound() && checked.facing_openings.is_empty(), "{count} {turn} {gap}");
            assert!(report.notes().iter().any(|note| note.contains("edges sewn")), "{:?}", report.notes());
        }
    }

    #[test]
    fn a_gap_that_is_no_seam_stays_and_is_reported() {
        for gap in [1.0, 2.5] {
            let surface = seamed(48, 0.0, gap);
            let wall = Wall::from_surface(&surface).unwrap();
            assert_eq!((wall.report().edges_sewn, wall.report().openings), (0, 4), "{:?}", wall.report());
            let report = check(&surface).unwrap();
            assert!(!report.is_sound() && report.facing_openings.len() == 1, "{:?}", report.facing_openings);
            assert!(report.hints.iter().any(|hint| hint.contains("face each other")), "{:?}", report.hints);
        }
        // Counter-check: two separate tubes are two vessels.
        let apart = check(&seamed(48, 0.0, 30.0)).unwrap();
        assert!(apart.is_sound() && apart.facing_openings.is_empty(), "{:?}", apart.hints);
        let whole = tube(&[&[0.0, 1.0, 2.0, 3.0].map(|z| (z, 24, 0.0))]);
        let wall = Wall::from_surface(&whole).unwrap();
        assert_eq!((wall.report().edges_sewn, wall.mesh().triangles.len()), (0, whole.triangles.len()));
    }
}
