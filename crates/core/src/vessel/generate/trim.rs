//! Cutting a mesh of the extended tree at its true ends, by planes across the centre line.
//!
//! Vertices near the plane are first moved onto the intersection curve of plane and wall, so that cutting the
//! remaining triangles leaves no thin ones. Boundary vertices are then on both the plane and the implicit surface.

use std::collections::BTreeMap;

use super::curve::Branch;
use super::field::{Field, Local};
use crate::Vec3;
use crate::vessel::SurfaceMesh;

/// Vertices closer to the plane than this fraction of an edge are moved onto it.
const SNAP: f64 = 0.4;

/// An open end of the tree.
#[derive(Debug, Clone, Copy)]
pub(in crate::vessel) struct End {
    /// Row of the centre-line table.
    pub(in crate::vessel) row: usize,
    /// Branch that ends here.
    pub(in crate::vessel) branch: usize,
    pub(in crate::vessel) centre: Vec3,
    /// Unit vector out of the vessel.
    pub(in crate::vessel) outward: Vec3,
    pub(in crate::vessel) radius: f64,
}

/// All open ends, the root first.
pub(in crate::vessel) fn ends(branches: &[Branch]) -> Vec<End> {
    let mut ends = Vec::new();
    for (branch, curve) in branches.iter().enumerate() {
        let (first, last) = (&curve.samples[0], &curve.samples[curve.samples.len() - 1]);
        if let Some(row) = curve.root_row {
            ends.push(End {
                row,
                branch,
                centre: first.position,
                outward: -first.tangent,
                radius: first.radius,
            });
        }
        if let Some(row) = curve.leaf_row {
            ends.push(End { row, branch, centre: last.position, outward: last.tangent, radius: last.radius });
        }
    }
    ends.sort_by_key(|end| end.row);
    ends
}

/// Cuts off everything beyond `end`.
pub(super) fn cut(mesh: &mut SurfaceMesh, field: &Field, end: &End, edge: f64) {
    let reach = field.extension + 2.0 * edge;
    let local = field.local(&end.centre, 1.2 * end.radius + reach);
    let height = |v: &Vec3| (v - end.centre).dot(&end.outward);
    let near = |v: &Vec3| {
        let h = height(v);
        let lateral = (v - end.centre - h * end.outward).norm();
        // Another branch may pass nearby: vertices of the end are on its own branch.
        h.abs() <= reach
            && lateral <= 1.2 * end.radius + edge
            && field.branch_alone(end.branch, v).f.abs() < 0.25 * edge
            || h > 0.0 && h <= reach && lateral <= 1.1 * end.radius
    };
    // Height of vertices near the end; others count as far inside.
    let mut heights: Vec<f64> =
        mesh.vertices_mm.iter().map(|v| if near(v) { height(v) } else { f64::NEG_INFINITY }).collect();
    for (v, h) in mesh.vertices_mm.iter_mut().zip(&mut heights) {
        if h.abs() < SNAP * edge {
            *v = onto_rim(field, &local, end, *v, edge);
            *h = 0.0;
        }
    }
    let mut crossings: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut kept = Vec::with_capacity(mesh.triangles.len());
    for triangle in std::mem::take(&mut mesh.triangles) {
        let h = triangle.map(|v| heights[v as usize]);
        if h.iter().all(|h| *h <= 0.0) {
            if h.iter().any(|h| *h < 0.0) {
                kept.push(triangle);
            }
            continue;
        }
        if h.iter().all(|h| *h >= 0.0) {
            continue;
        }
        // Traverse the triangle; keep what is below the plane and add a vertex where an edge crosses it.
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            let (ha, hb) = (h[k], h[(k + 1) % 3]);
            if ha <= 0.0 {
                polygon.push(from);
            }
            if ha * hb < 0.0 {
                polygon.push(*crossings.entry((from.min(to), from.max(to))).or_insert_with(|| {
                    let (a, b) = (mesh.vertices_mm[from as usize], mesh.vertices_mm[to as usize]);
                    let at = a + (b - a) * (height(&a) / (height(&a) - height(&b)));
                    mesh.vertices_mm.push(onto_rim(field, &local, end, at, edge));
                    mesh.vertices_mm.len() as u32 - 1
                }));
            }
        }
        super::push_polygon(&mesh.vertices_mm, &polygon, &mut kept);
    }
    mesh.triangles = kept;
}

/// Moves a point onto the intersection curve of the end's plane and the wall.
pub(super) fn onto_rim(field: &Field, local: &Local, end: &End, start: Vec3, edge: f64) -> Vec3 {
    let flat = |v: Vec3| v - end.outward * v.dot(&end.outward);
    let mut point = end.centre + flat(start - end.centre);
    for _ in 0..super::PROJECTION_STEPS {
        let value = field.value(local, &point);
        if value.f.abs() <= super::ON_SURFACE_MM {
            break;
        }
        let gradient = flat(value.gradient);
        let step = gradient * (-value.f / gradient.norm_squared().max(1e-6));
        point = end.centre + flat(point + step.cap_magnitude(edge) - end.centre);
    }
    point
}
