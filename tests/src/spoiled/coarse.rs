//! Edges over three decades, and far too few triangles.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use endowire_lab::crossing::CrossingTest;

use super::Editable;
use crate::noise::Noise;

/// Longest edge that collapsing may make, mm, …
const LONGEST_MM: f64 = 10.0;
/// … and cosine by which it may turn a triangle: 26°, so that round stays round.
const SMOOTH: f64 = 0.9;
/// Farthest that a collapse may take the surface, mm.
const OFF_MM: f64 = 0.15;
/// Farthest that decimation takes it, mm.
const FARTHEST_MM: f64 = 4.0;
/// Collapses tried for each triangle.
const TRIED: usize = 4;
/// Places that are refined, …
const PLACES: usize = 6;
/// … to edges of this length, mm, …
const SHORTEST_MM: f64 = 0.004;
/// … that grow with the distance from the place by this, …
const GROWTH: f64 = 0.4;
/// … up to this distance, mm.
const REFINED_MM: f64 = 4.0;
/// Passes of refinement: an edge halves in each.
const PASSES: usize = 24;
/// Part of the triangles that decimation leaves, …
const LEFT: f64 = 0.02;
/// … and cosine by which it may turn one.
const ROUGH: f64 = 0.5;

/// Edges from micrometres to centimetres: edges collapsed at random where the surface is smooth, then six places refined. Vertices that stay
/// are where they were, and new ones lie on the triangles.
pub fn decades(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let mut edit = Editable::new(mesh);
    let clean = CrossingTest::new(mesh);
    let count = mesh.triangles.len();
    for _ in 0..TRIED * count {
        let (index, side) = (random.below(count) as u32, random.below(3));
        let Some(corners) = edit.triangle(index) else { continue };
        let edge = (corners[side], corners[(side + 1) % 3]);
        edit.collapse(edge, LONGEST_MM, SMOOTH, |corners| near(&clean, corners, OFF_MM));
    }
    for _ in 0..PLACES {
        let corners = mesh.corners(random.below(count));
        let place = (corners[0] + corners[1] + corners[2]) / 3.0;
        for _ in 0..PASSES {
            let mut edges = BTreeSet::new();
            for corners in edit.triangles.iter().flatten() {
                for side in 0..3 {
                    let (a, b) = (corners[side], corners[(side + 1) % 3]);
                    let away = ((edit.at(a) + edit.at(b)) / 2.0 - place).norm();
                    // Of a long edge the near end counts.
                    let away = (away - 0.5 * edit.length(a, b)).max(0.0);
                    if away < REFINED_MM && edit.length(a, b) > (GROWTH * away).max(SHORTEST_MM) {
                        edges.insert((Reverse(edit.length(a, b).to_bits()), a.min(b), a.max(b)));
                    }
                }
            }
            if edges.is_empty() {
                break;
            }
            for (_, a, b) in edges {
                edit.split(a, b, (edit.at(a) + edit.at(b)) / 2.0);
            }
        }
    }
    edit.finish()
}

/// All but a fiftieth of the triangles collapsed, the shortest edges first, and first those that take the surface least far. The seed
/// decides which end of an edge stays.
pub fn decimated(mesh: &SurfaceMesh, seed: u64) -> SurfaceMesh {
    let mut random = Noise::new(seed);
    let clean = CrossingTest::new(mesh);
    let mut edit = Editable::new(mesh);
    let wanted = (LEFT * mesh.triangles.len() as f64).ceil() as usize;
    let mut left = mesh.triangles.len();
    let mut off_mm = OFF_MM;
    while left > wanted && off_mm < FARTHEST_MM {
        let mut queue = BinaryHeap::new();
        let key = |edit: &Editable, a: u32, b: u32| Reverse((edit.length(a, b).to_bits(), a, b));
        for corners in edit.triangles.iter().flatten() {
            for side in 0..3 {
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                queue.push(key(&edit, a.min(b), a.max(b)));
            }
        }
        while left > wanted {
            let Some(Reverse((_, a, b))) = queue.pop() else { break };
            let shared = edit.sharing(a, b).len();
            let (a, b) = if random.happens(0.5) { (a, b) } else { (b, a) };
            let fits = |corners| near(&clean, corners, off_mm);
            let kept = if edit.collapse((a, b), f64::MAX, ROUGH, fits) {
                b
            } else if edit.collapse((b, a), f64::MAX, ROUGH, fits) {
                a
            } else {
                continue;
            };
            left -= shared;
            // Edges about it may now collapse that could not before.
            for w in edit.neighbours(kept) {
                queue.push(key(&edit, w.min(kept), w.max(kept)));
            }
        }
        off_mm *= 1.5;
    }
    debug_assert_eq!(left, edit.count());
    edit.finish()
}

/// Whether a triangle is no farther than this from a surface.
fn near(clean: &CrossingTest, [a, b, c]: [Vec3; 3], off_mm: f64) -> bool {
    [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
        .iter()
        .all(|x| clean.distance_mm(x, off_mm).is_some())
}
