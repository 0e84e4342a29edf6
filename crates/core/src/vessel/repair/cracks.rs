//! Cracks: coincident borders that do not share their vertices.
//!
//! Coordinates written with few digits, or pieces meshed separately, leave gaps that are wider than the welding
//! tolerance and far narrower than the adjacent triangles. Vertices of open edges, and only those, are merged across
//! such gaps.

use std::collections::HashMap;

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::repairs::{Repair, RepairKind, of_triangles};
use crate::vessel::topology::{DisjointSets, EdgeTable};

/// Largest width of a crack, relative to the shortest adjacent open edge.
const WIDTH: f64 = 0.05;

/// Merges vertices across cracks of a mesh whose edges are in `table`, notes where, and returns how many were merged.
/// Triangles may become duplicates, none loses its area.
pub(super) fn close_cracks(mesh: &mut SurfaceMesh, table: &EdgeTable, noted: &mut Vec<Repair>) -> usize {
    // The shortest open edge at each of its vertices.
    let mut reach = vec![f64::INFINITY; mesh.vertices_mm.len()];
    for uses in table.edges().filter(|uses| uses.len() == 1) {
        let (a, b) = (uses[0].low as usize, uses[0].high as usize);
        let length = (mesh.vertices_mm[a] - mesh.vertices_mm[b]).norm();
        (reach[a], reach[b]) = (reach[a].min(length), reach[b].min(length));
    }
    let open: Vec<u32> = (0..reach.len() as u32).filter(|v| reach[*v as usize].is_finite()).collect();
    if open.is_empty() {
        return 0;
    }
    // Cells of the grid suit the median: where edges are far longer, a crack is closed only up to twice the median's
    // width.
    let mut lengths: Vec<f64> = open.iter().map(|v| reach[*v as usize]).collect();
    let middle = lengths.len() / 2;
    let (_, median, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
    let cell = 2.0 * WIDTH * *median;
    if cell <= 0.0 || !cell.is_finite() {
        return 0;
    }
    let cell_of = |p: &Vec3| [p.x, p.y, p.z].map(|c| (c / cell).floor() as i64);
    let mut sets = DisjointSets::new(mesh.vertices_mm.len());
    // Only used for lookups, never iterated: its order cannot affect the result.
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(open.len());
    for &v in &open {
        let p = mesh.vertices_mm[v as usize];
        let [x, y, z] = cell_of(&p);
        for k in 0..27_i64 {
            let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            let place = [x.saturating_add(step[0]), y.saturating_add(step[1]), z.saturating_add(step[2])];
            for &other in grid.get(&place).into_iter().flatten() {
                let width = (WIDTH * reach[v as usize].min(reach[other as usize])).min(cell);
                if (mesh.vertices_mm[other as usize] - p).norm() <= width {
                    sets.join(v, other);
                }
            }
        }
        let crowd = grid.entry([x, y, z]).or_default();
        // A cluster of more vertices than this is not a crack, and is not changed.
        if crowd.len() < 64 {
            crowd.push(v);
        }
    }
    let merged = open.iter().filter(|v| sets.find(**v) != **v).count();
    if merged > 0 {
        let mut at_cracks = Vec::new();
        for (index, triangle) in mesh.triangles.iter_mut().enumerate() {
            let moved = triangle.map(|v| sets.find(v));
            // A chain of close vertices may bring two corners of a triangle together; such a triangle keeps its own.
            let is_whole = moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0];
            if is_whole && moved != *triangle {
                *triangle = moved;
                at_cracks.push(index as u32);
            }
        }
        noted.extend(of_triangles(RepairKind::CrackJoined, mesh, at_cracks));
    }
    merged
}
