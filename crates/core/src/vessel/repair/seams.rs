//! Seams whose two sides have other vertices: T-junctions.
//!
//! Parts that were meshed apart meet along a line, and each has vertices of its own there. An open edge is split at the open
//! vertices that lie on it, so that both sides share all of them; gaps and overlaps are closed by that, since an edge goes where its new
//! vertices are. An edge is split where most of its parts then meet an open edge of the other side, and else stays as it is.

use std::collections::{HashMap, HashSet};

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::{EdgeTable, EdgeUse};

/// A vertex lies on an edge that is no farther away than this part of the edge's length, and no farther than the median open edge is long.
/// A circle of twelve edges is 0.07 of an edge from its chords.
const WIDTH: f64 = 0.15;
/// Open edges longer than so many median ones are not looked along.
const MOST_CELLS: f64 = 1000.0;
/// Vertices in a cell beyond which it is a crowd and no seam.
const CROWD: usize = 64;

/// An open edge and the vertices that lie on it, in order from its first corner.
struct Split {
    edge: EdgeUse,
    ends: [u32; 2],
    vertices: Vec<u32>,
}

impl Split {
    /// The edges that it is split into.
    fn parts(&self) -> impl Iterator<Item = (u32, u32)> {
        let [first, last] = self.ends;
        let begins = std::iter::once(first).chain(self.vertices.iter().copied());
        begins.zip(self.vertices.iter().copied().chain([last]))
    }
}

fn undirected((a, b): (u32, u32)) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Splits open edges of a mesh, whose edges `table` holds, at the vertices of the other side of a seam; returns how many.
pub(super) fn sew(mesh: &mut SurfaceMesh, table: &EdgeTable) -> usize {
    let open: Vec<EdgeUse> = table.edges().filter(|uses| uses.len() == 1).map(|uses| uses[0]).collect();
    let mut splits = splits(mesh, &open);
    if splits.is_empty() {
        return 0;
    }
    // Only looked up, never iterated: their order cannot reach the result.
    let split: HashSet<(u32, u32)> = splits.iter().map(|s| (s.edge.low, s.edge.high)).collect();
    let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
    let whole = open.iter().map(|edge| (edge.low, edge.high)).filter(|edge| !split.contains(edge));
    for edge in whole.chain(splits.iter().flat_map(Split::parts).map(undirected)) {
        *sides.entry(edge).or_default() += 1;
    }
    splits.retain(|split| {
        let met = split.parts().filter(|part| sides.get(&undirected(*part)) == Some(&2)).count();
        2 * met > split.parts().count()
    });
    for split in &splits {
        apply(mesh, split);
    }
    splits.len()
}

/// The open edges on which open vertices lie: each vertex on the one that it is nearest to.
fn splits(mesh: &SurfaceMesh, open: &[EdgeUse]) -> Vec<Split> {
    let at = |v: u32| mesh.vertices_mm[v as usize];
    let mut lengths: Vec<f64> = open.iter().map(|edge| (at(edge.low) - at(edge.high)).norm()).collect();
    if lengths.is_empty() {
        return Vec::new();
    }
    let middle = lengths.len() / 2;
    let cell = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
    if cell <= 0.0 || !cell.is_finite() {
        return Vec::new();
    }
    let place = |p: &Vec3| [p.x, p.y, p.z].map(|c| (c / cell).floor() as i64);
    let mut vertices: Vec<u32> = open.iter().flat_map(|edge| [edge.low, edge.high]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(vertices.len());
    for &v in &vertices {
        grid.entry(place(&at(v))).or_default().push(v);
    }
    // For each vertex the nearest edge that it lies on: distance, edge, and how far along it.
    let mut nearest: HashMap<u32, (f64, usize, f64)> = HashMap::new();
    let mut near = Vec::new();
    for (index, edge) in open.iter().enumerate() {
        let (a, b) = (at(edge.low), at(edge.high));
        let length = (b - a).norm();
        let steps = (length / cell).ceil().max(1.0);
        if steps > MOST_CELLS {
            continue;
        }
        near.clear();
        for step in 0..=steps as u32 {
            let [x, y, z] = place(&(a + (b - a) * (f64::from(step) / steps)));
            for k in 0..27_i64 {
                let beside = [
                    x.saturating_add(k % 3 - 1),
                    y.saturating_add(k / 3 % 3 - 1),
                    z.saturating_add(k / 9 - 1),
                ];
                near.extend(grid.get(&beside).filter(|crowd| crowd.len() <= CROWD).into_iter().flatten());
            }
        }
        near.sort_unstable();
        near.dedup();
        let width = (WIDTH * length).min(cell);
        // A flat triangle is no seam.
        let own = mesh.triangles[edge.triangle as usize];
        for &v in near.iter().filter(|v| !own.contains(*v)) {
            let along = (at(v) - a).dot(&(b - a)) / (length * length);
            let off = (at(v) - a - (b - a) * along).norm();
            if along > 0.0 && along < 1.0 && off <= width && nearest.get(&v).is_none_or(|best| off < best.0) {
                nearest.insert(v, (off, index, along));
            }
        }
    }
    let mut on: Vec<(usize, f64, u32)> =
        vertices.iter().filter_map(|v| nearest.get(v).map(|(_, edge, along)| (*edge, *along, *v))).collect();
    on.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    on.chunk_by(|a, b| a.0 == b.0)
        .map(|of_edge| {
            let edge = open[of_edge[0].0];
            Split { edge, ends: [edge.low, edge.high], vertices: of_edge.iter().map(|(.., v)| *v).collect() }
        })
        .collect()
}

/// Cuts the triangle at a split edge into a fan around the corner across.
fn apply(mesh: &mut SurfaceMesh, split: &Split) {
    let has_edge = |t: &[u32; 3]| {
        (0..3).position(|k| undirected((t[k], t[(k + 1) % 3])) == (split.edge.low, split.edge.high))
    };
    // Another edge of the triangle may have been split before: what holds this edge then is among the last triangles.
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

    /// A tube of rings along z, each with its number of vertices; two rings one after the other at a place make a seam.
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

    /// A tube with a seam at 20 mm, `gap` wide, whose upper side has `count` vertices, turned by a part of an edge.
    fn seamed(count: u32, turn: f64, gap: f64) -> SurfaceMesh {
        let rings = |from: f64, count: u32, turn: f64| [0.0, 1.0, 2.0, 3.0].map(|z| (from + z, count, turn));
        tube(&[&rings(17.0, 24, 0.0), &rings(20.0 + gap, count, turn)])
    }

    #[test]
    fn sides_with_other_vertices_are_sewn_and_the_seam_is_told() {
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
    fn a_gap_that_is_no_seam_stays_and_is_told() {
        for gap in [1.0, 2.5] {
            let surface = seamed(48, 0.0, gap);
            let wall = Wall::from_surface(&surface).unwrap();
            assert_eq!((wall.report().edges_sewn, wall.report().openings), (0, 4), "{:?}", wall.report());
            let report = check(&surface).unwrap();
            assert!(!report.is_sound() && report.facing_openings.len() == 1, "{:?}", report.facing_openings);
            assert!(report.hints.iter().any(|hint| hint.contains("face each other")), "{:?}", report.hints);
        }
        // The twin: two tubes apart are two vessels.
        let apart = check(&seamed(48, 0.0, 30.0)).unwrap();
        assert!(apart.is_sound() && apart.facing_openings.is_empty(), "{:?}", apart.hints);
        let whole = tube(&[&[0.0, 1.0, 2.0, 3.0].map(|z| (z, 24, 0.0))]);
        let wall = Wall::from_surface(&whole).unwrap();
        assert_eq!((wall.report().edges_sewn, wall.mesh().triangles.len()), (0, whole.triangles.len()));
    }
}
