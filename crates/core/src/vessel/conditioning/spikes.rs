//! Cuts off parts that are sharper than a mesh of this resolution can represent: blades, spikes and folds.
//!
//! Around edges at which the surface bends back from the lumen by more than a right angle, and around needles,
//! vertices move to the means of their neighbours until none is left, short edges are collapsed and edges flipped. A
//! blade then ends where its width is about one edge. This narrows the lumen there, beyond the limit if need be.
//! Ridges into the lumen are not sharp in this sense, and remain.

use super::corners::{Corners, Kind};
use super::remesh::{by_angles, flip_some, pull_together};
use crate::Vec3;
use crate::vessel::topology::NONE;

/// Largest angle by which the surface may bend back from the lumen, rad: 95°.
const SHARP: f64 = 1.66;
/// Angle of a fold, in either direction, rad: 109°.
const FOLD: f64 = 1.9;
/// Smallest angle of a triangle, rad: 14°.
const NEEDLE: f64 = 0.24;
/// Largest number of passes: each shortens a blade by about half an edge.
const PASSES: usize = 30;
/// Fraction of the way to the mean that a vertex moves in one pass.
const STEP: f64 = 0.5;

/// Cuts off all sharp parts.
pub(super) fn cut(corners: &mut Corners) {
    let (mut spokes, mut around) = (Vec::new(), Vec::new());
    let mut moved = vec![true; corners.vertices.len()];
    for _ in 0..PASSES {
        // Only moved parts can have become sharp.
        let (sharp, mut bent) = sharp(corners, &moved);
        moved = sharp;
        if !moved.contains(&true) {
            break;
        }
        grow(corners, &mut moved);
        grow(corners, &mut bent);
        let means: Vec<(u32, Vec3)> = corners
            .live_vertices()
            .filter(|&v| moved[v as usize] && corners.kind(v) == Kind::Free)
            .filter_map(|v| {
                corners.spokes(v, &mut spokes);
                corners.neighbours(&spokes, &mut around);
                let mean = around.iter().map(|&w| corners.at(w)).sum::<Vec3>() / around.len() as f64;
                mean.iter().all(|c| c.is_finite()).then_some((v, mean))
            })
            .collect();
        for (v, mean) in means {
            let vertex = &mut corners.vertices[v as usize];
            let way = mean - vertex.at;
            // A needle only needs to move within the surface.
            let along = if bent[v as usize] { way } else { way - vertex.normal * vertex.normal.dot(&way) };
            vertex.at += along * STEP;
        }
        pull_together(corners, &moved);
        flip_some(corners, by_angles, Some(&moved));
    }
    corners.set_normals();
}

/// Vertices of invalid edges and triangles with at least one end `among` these; and those of the edges among them.
fn sharp(corners: &Corners, among: &[bool]) -> (Vec<bool>, Vec<bool>) {
    let mut found = vec![false; corners.vertices.len()];
    let mut folded = found.clone();
    let (needle_cos, sharp_cos, fold_cos) = (libm::cos(NEEDLE), libm::cos(SHARP), libm::cos(FOLD));
    let moved = |e: &u32| among[corners.from(*e) as usize];
    for e in (0..corners.half_edges()).filter(|&e| corners.lives(e)).filter(moved) {
        let (a, b, c) = (corners.from(e), corners.to(e), corners.apex(e));
        let (x, y) = (corners.at(b) - corners.at(a), corners.at(c) - corners.at(a));
        let normal = x.cross(&y);
        // Rims are unchanged, and have short edges.
        let inner = [a, b, c].iter().all(|&v| corners.kind(v) == Kind::Free);
        let needle = inner && x.dot(&y) > needle_cos * (x.norm_squared() * y.norm_squared()).sqrt();
        let back = corners.twin(e);
        let bent = back != NONE && {
            let d = corners.at(corners.apex(back)) - corners.at(a);
            let other = d.cross(&(corners.at(b) - corners.at(a)));
            let least = if d.dot(&normal) < 0.0 { sharp_cos } else { fold_cos };
            normal.dot(&other) < least * (normal.norm_squared() * other.norm_squared()).sqrt()
        };
        if needle {
            [a, b, c].iter().for_each(|&v| found[v as usize] = true);
        }
        if bent {
            [a, b, c, corners.apex(back)].iter().for_each(|&v| {
                found[v as usize] = true;
                folded[v as usize] = true;
            });
        }
    }
    (found, folded)
}

/// Adds the neighbours.
fn grow(corners: &Corners, marked: &mut [bool]) {
    let inner = marked.to_vec();
    for e in (0..corners.half_edges()).filter(|&e| corners.lives(e)) {
        for (a, b) in [(corners.from(e), corners.to(e)), (corners.to(e), corners.from(e))] {
            marked[b as usize] |= inner[a as usize];
        }
    }
}
