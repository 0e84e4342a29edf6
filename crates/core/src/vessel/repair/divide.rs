//! Long edges of a mesh, halved until none is left.

use std::collections::BTreeMap;

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::EdgeTable;

/// Rounds in which edges are halved: enough for a thousand parts of an edge.
const ROUNDS: usize = 10;

/// Halves edges longer than `edge_mm`, together with the triangles on both sides, until none is left.
pub(super) fn divide(mesh: &mut SurfaceMesh, edge_mm: f64) {
    for _ in 0..ROUNDS {
        let mut middle: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for uses in EdgeTable::new(&mesh.triangles).edges() {
            let (a, b) = (uses[0].low, uses[0].high);
            let [p, q]: [Vec3; 2] = [a, b].map(|v| mesh.vertices_mm[v as usize]);
            if (q - p).norm() > edge_mm {
                middle.insert((a, b), mesh.vertices_mm.len() as u32);
                mesh.vertices_mm.push((p + q) / 2.0);
            }
        }
        if middle.is_empty() {
            return;
        }
        let mut divided = Vec::with_capacity(2 * mesh.triangles.len());
        for triangle in &mesh.triangles {
            let half = |k: usize| {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                middle.get(&(a.min(b), a.max(b))).copied()
            };
            let halves = [half(0), half(1), half(2)];
            split(*triangle, halves, &mesh.vertices_mm, &mut divided);
        }
        mesh.triangles = divided;
    }
}

/// The parts of a triangle of which these sides are halved.
fn split(triangle: [u32; 3], halves: [Option<u32>; 3], at: &[Vec3], parts: &mut Vec<[u32; 3]>) {
    // Begins at a corner after which the sides are halved in the order of the cases below.
    let turned = |k: usize| {
        let corner = |n: usize| triangle[(k + n) % 3];
        let half = |n: usize| halves[(k + n) % 3];
        ([corner(0), corner(1), corner(2)], [half(0), half(1), half(2)])
    };
    match halves.iter().flatten().count() {
        0 => parts.push(triangle),
        1 => {
            let k = halves.iter().position(Option::is_some).unwrap_or(0);
            if let ([a, b, c], [Some(m), ..]) = turned(k) {
                parts.extend([[a, m, c], [m, b, c]]);
            }
        }
        2 => {
            let k = (halves.iter().position(Option::is_none).unwrap_or(0) + 1) % 3;
            if let ([a, b, c], [Some(m), Some(n), _]) = turned(k) {
                parts.push([m, b, n]);
                // The quadrilateral a, m, n, c is cut along its shorter diagonal.
                let length = |p: u32, q: u32| (at[p as usize] - at[q as usize]).norm();
                if length(a, n) <= length(m, c) {
                    parts.extend([[a, m, n], [a, n, c]]);
                } else {
                    parts.extend([[a, m, c], [m, n, c]]);
                }
            }
        }
        _ => {
            if let ([a, b, c], [Some(m), Some(n), Some(o)]) = turned(0) {
                parts.extend([[a, m, o], [m, b, n], [o, n, c], [m, n, o]]);
            }
        }
    }
}
