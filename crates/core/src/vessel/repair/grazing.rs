//! Vessels that graze each other: pieces whose walls cross a little without being parts of one vessel, as a segmentation draws
//! vessels that touch.
//!
//! They stay two: cutting out what crosses would cut a vessel open, and uniting them would join what is not joined. The walls
//! are moved apart, each into its own lumen, by small steps and only where they cross.

use crate::vessel::SurfaceMesh;
use crate::vessel::crossings::{Crossings, crossings};
use crate::vessel::intersect::triangles_intersect;
use crate::vessel::repairs::{Repair, RepairKind, of_triangles};
use crate::vessel::topology::EdgeTable;

/// Number of steps in which walls are moved apart.
const STEPS: usize = 40;
/// Length of a step, relative to the shortest edge at a vertex: so short that no triangle turns over.
const STEP: f64 = 0.05;
/// Intersecting pairs above which nothing is moved.
const MOST_PAIRS: usize = 20_000;

/// The result of [`part`].
#[derive(Debug, Default)]
pub(super) struct Parted {
    /// Triangles that were moved.
    pub(super) moved: usize,
    /// Pairs of triangles of different pieces that still intersect.
    pub(super) left: usize,
}

/// Moves apart the walls of pieces that intersect by these pairs, and takes the pairs between pieces out of the list, since
/// nothing is to be cut out there; notes what was moved and what is left.
pub(super) fn part(
    mesh: &mut SurfaceMesh,
    tolerance_mm: f64,
    found: &mut Crossings,
    noted: &mut Vec<Repair>,
) -> Parted {
    if found.pairs.is_empty() || found.capped {
        return Parted::default();
    }
    let table = EdgeTable::new(&mesh.triangles);
    let (piece_of, _) = table.components(mesh.triangles.len());
    let is_between = |[a, b]: &[u32; 2]| piece_of[*a as usize] != piece_of[*b as usize];
    let (mut between, own): (Vec<_>, Vec<_>) = found.pairs.iter().copied().partition(is_between);
    found.pairs = own;
    between.retain(|pair| cross(mesh, pair));
    if between.is_empty() {
        return Parted::default();
    }
    let given = between.len();
    let step_mm = steps_mm(mesh, &table);
    let mut moved = mesh.clone();
    let mut is_marked = vec![false; mesh.triangles.len()];
    let mut left = between.clone();
    for _ in 0..STEPS {
        let mut is_moved = vec![false; mesh.vertices_mm.len()];
        for t in left.iter().flatten() {
            moved.triangles[*t as usize].iter().for_each(|v| is_moved[*v as usize] = true);
        }
        let outwards = moved.vertex_normals();
        for v in (0..is_moved.len()).filter(|v| is_moved[*v]) {
            moved.vertices_mm[v] -= outwards[v] * step_mm[v];
        }
        for (t, triangle) in moved.triangles.iter().enumerate() {
            is_marked[t] |= triangle.iter().any(|v| is_moved[*v as usize]);
        }
        let now = crossings(&moved, tolerance_mm, Some(&is_marked), MOST_PAIRS);
        let folded =
            now.pairs.iter().any(|pair| !is_between(pair) && found.pairs.binary_search(pair).is_err());
        if now.capped || folded {
            break;
        }
        left = now.pairs.into_iter().filter(|pair| is_between(pair) && cross(&moved, pair)).collect();
        if left.is_empty() {
            let touched = (0..is_marked.len() as u32).filter(|t| is_marked[*t as usize]);
            let touched: Vec<u32> = touched.collect();
            noted.extend(of_triangles(RepairKind::MovedApart, mesh, touched.iter().copied()));
            *mesh = moved;
            return Parted { moved: touched.len(), left: 0 };
        }
    }
    noted.extend(of_triangles(RepairKind::StillCrossing, mesh, between.into_iter().flatten()));
    Parted { moved: 0, left: given }
}

/// Whether two triangles that intersect do not only meet in corners at one place, as where an edge of both was cut apart.
fn cross(mesh: &SurfaceMesh, [a, b]: &[u32; 2]) -> bool {
    let vertices = &mesh.vertices_mm;
    let [first, second] = [a, b].map(|t| mesh.triangles[*t as usize]);
    let in_first = |v: u32| first.into_iter().find(|w| vertices[*w as usize] == vertices[v as usize]);
    let meeting = second.map(|v| in_first(v).unwrap_or(v));
    meeting.iter().all(|v| first.contains(v)) || triangles_intersect(vertices, first, meeting)
}

/// How far each vertex is moved at once, mm.
fn steps_mm(mesh: &SurfaceMesh, table: &EdgeTable) -> Vec<f64> {
    let mut step_mm = vec![f64::INFINITY; mesh.vertices_mm.len()];
    for uses in table.edges() {
        let ends = [uses[0].low as usize, uses[0].high as usize];
        let length_mm = (mesh.vertices_mm[ends[0]] - mesh.vertices_mm[ends[1]]).norm();
        for end in ends {
            step_mm[end] = step_mm[end].min(STEP * length_mm);
        }
    }
    step_mm
}
