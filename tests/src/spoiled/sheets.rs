//! Folds, cracks, holes and double sheets.

use std::collections::BTreeSet;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::Editable;
use crate::noise::Noise;

/// Part of the vertices that are folded over a neighbour, …
const FOLDS: f64 = 0.01;
/// … and how far beyond it, as a part of the edge.
const BEYOND: f64 = 0.25;
/// Part of the vertices that a crack begins at, …
const CRACKS: f64 = 0.003;
/// … edges that it is long, …
const CRACK_EDGES: usize = 6;
/// … and its width, mm: well above what welding closes.
const CRACK_MM: f64 = 0.02;
/// Part of the triangles that are missing.
const MISSING: f64 = 0.003;
/// Patches that are there twice, …
const PATCHES: usize = 10;
/// … their radius, mm, …
const PATCH_MM: f64 = 3.0;
/// … and how far the second sheet is off the first, mm.
const SHIFT_MM: f64 = 0.05;

/// Small flaps: vertices pulled over a neighbour, so that the triangles between lie on the surface three times.
pub fn folds(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut edit = Editable::new(mesh);
    let mut touched: BTreeSet<u32> = BTreeSet::new();
    for v in 0..mesh.vertices_mm.len() as u32 {
        if !random.happens(FOLDS) || edit.is_open(v) || touched.contains(&v) {
            continue;
        }
        let near: Vec<u32> = edit.neighbours(v).into_iter().collect();
        let over = near[random.below(near.len())];
        if edit.is_open(over) {
            continue;
        }
        // Every fold lies alone, on what is not folded.
        touched.extend(near.iter().flat_map(|&w| edit.neighbours(w)));
        edit.vertices[v as usize] = edit.at(over) + (edit.at(over) - edit.at(v)) * BEYOND;
    }
    edit.finish()
}

/// Cracks along edges and missing triangles.
pub fn torn(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut edit = Editable::new(mesh);
    let mut torn: BTreeSet<u32> = BTreeSet::new();
    for v in 0..mesh.vertices_mm.len() as u32 {
        if random.happens(CRACKS)
            && let Some(path) = path(&edit, v, &torn, &mut random)
        {
            torn.extend(path.iter().flat_map(|&w| edit.neighbours(w)));
            crack(&mut edit, &path);
        }
    }
    for index in 0..mesh.triangles.len() as u32 {
        let gone = random.happens(MISSING);
        if let Some(corners) = edit.triangle(index)
            && gone
            && corners.iter().all(|&v| !torn.contains(&v) && !edit.is_open(v))
        {
            torn.extend(corners);
            edit.remove(index);
        }
    }
    edit.finish()
}

/// A walk along edges from `v`, clear of the rims and of what is torn.
fn path(edit: &Editable, v: u32, torn: &BTreeSet<u32>, random: &mut Noise) -> Option<Vec<u32>> {
    let mut path = vec![v];
    while path.len() <= CRACK_EDGES {
        let last = *path.last()?;
        if torn.contains(&last) || edit.is_open(last) {
            return None;
        }
        // On as straight as possible: cracks do not turn back.
        let back = if path.len() > 1 { Some(path[path.len() - 2]) } else { None };
        let near: Vec<u32> = edit.neighbours(last).into_iter().filter(|w| !path.contains(w)).collect();
        let next = match back {
            Some(back) => {
                let way = (edit.at(last) - edit.at(back)).normalize();
                let straight = |w: &u32| (edit.at(*w) - edit.at(last)).normalize().dot(&way);
                near.into_iter().max_by(|a, b| straight(a).total_cmp(&straight(b)))?
            }
            None => *near.get(random.below(near.len()))?,
        };
        path.push(next);
    }
    Some(path)
}

/// Opens the edges of a path: its inner vertices become two.
fn crack(edit: &mut Editable, path: &[u32]) {
    let mut before = [path[0]; 2];
    for k in 1..path.len() - 1 {
        let (v, next) = (path[k], path[k + 1]);
        let lip = |w: u32| w == next || before.contains(&w);
        // The triangles at v on one side of the path.
        let Some(&first) = edit.sharing(v, next).first() else { return };
        let mut side = vec![first];
        let mut seen = 0;
        while seen < side.len() {
            let corners = edit.triangle(side[seen]).unwrap_or_default();
            seen += 1;
            for w in corners.into_iter().filter(|&w| w != v && !lip(w)) {
                for other in edit.sharing(v, w) {
                    if !side.contains(&other) {
                        side.push(other);
                    }
                }
            }
        }
        if side.len() == edit.fan(v).len() {
            return;
        }
        let corners = edit.triangle(first).unwrap_or_default();
        let middle = corners.iter().map(|&w| edit.at(w)).sum::<Vec3>() / 3.0;
        let place = edit.at(v) + (middle - edit.at(v)).normalize() * CRACK_MM;
        let twin = edit.vertex(place);
        side.into_iter().for_each(|index| edit.replace(index, v, twin));
        before = [v, twin];
    }
}

/// Patches copied and shifted along the normal, outwards or inwards.
pub fn overlaps(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut double = mesh.clone();
    let middle = |index: usize| mesh.corners(index).iter().sum::<Vec3>() / 3.0;
    for _ in 0..PATCHES {
        let centre = random.below(mesh.triangles.len());
        let [a, b, c] = mesh.corners(centre);
        let shift =
            (b - a).cross(&(c - a)).normalize() * if random.happens(0.5) { SHIFT_MM } else { -SHIFT_MM };
        let mut copies = std::collections::BTreeMap::new();
        for index in (0..mesh.triangles.len()).filter(|&i| (middle(i) - middle(centre)).norm() < PATCH_MM) {
            let corners = mesh.triangles[index].map(|v| {
                *copies.entry(v).or_insert_with(|| {
                    double.vertices_mm.push(mesh.vertices_mm[v as usize] + shift);
                    (double.vertices_mm.len() - 1) as u32
                })
            });
            double.triangles.push(corners);
        }
    }
    double
}
