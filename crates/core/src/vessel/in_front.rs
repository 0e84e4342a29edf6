//! Sample points of a surface in front of an opening.

use std::collections::BTreeSet;

use super::opening::OWN_RIM;
use super::topology::NONE;
use super::{Opening, SurfaceMesh};
use crate::Vec3;

/// Distance between sample points of a triangle, in radii of the opening.
const SPACING: f64 = 0.2;
/// Largest number of pieces per side into which a triangle is divided.
const MOST_PIECES: f64 = 64.0;
/// Reach to the sides, in radii of the opening.
const ASIDE: f64 = 1.2;

/// The stretches of a surface that end at its openings.
pub(super) struct Ends<'a> {
    mesh: &'a SurfaceMesh,
    /// For each opening the triangles at its rim, and those connected with them near it.
    own: Vec<BTreeSet<u32>>,
}

impl<'a> Ends<'a> {
    /// Of a mesh with these openings; `across` has the triangle across each side of each.
    pub(super) fn new(mesh: &'a SurfaceMesh, across: &[[u32; 3]], openings: &[Opening]) -> Self {
        let mut opening_of = vec![NONE; mesh.vertices_mm.len()];
        for (number, opening) in openings.iter().enumerate() {
            opening.boundary.iter().for_each(|v| opening_of[*v as usize] = number as u32);
        }
        let mut at_rims = vec![Vec::new(); openings.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for number in corners.iter().map(|v| opening_of[*v as usize]).filter(|k| *k != NONE) {
                at_rims[number as usize].push(t as u32);
            }
        }
        let own = openings.iter().zip(at_rims).map(|(o, at_rim)| beside(mesh, across, o, at_rim)).collect();
        Self { mesh, own }
    }

    /// Calls `see` with sample points of the surface where a straight extension of an opening may be, and whether they
    /// are of the stretch that ends there. What is too far away to shorten the extension is left out.
    pub(super) fn sample(&self, number: usize, opening: &Opening, see: &mut dyn FnMut(Vec3, bool)) {
        let reach_mm = ASIDE * opening.radius_mm;
        for t in 0..self.mesh.triangles.len() {
            let corners = self.mesh.corners(t);
            let middle = self.mesh.middle(t);
            let size_mm = corners.iter().map(|x| (x - middle).norm()).fold(0.0, f64::max);
            let (along, lateral) = opening.beyond_and_off_axis_mm(&middle);
            let within = -reach_mm - size_mm..=opening.beyond_mm + 2.0 * reach_mm + size_mm;
            if lateral > reach_mm + size_mm || !within.contains(&along) {
                continue;
            }
            let is_own = self.own[number].contains(&(t as u32));
            let pieces = (2.0 * size_mm / (SPACING * opening.radius_mm)).ceil().clamp(1.0, MOST_PIECES);
            let [a, b, c] = corners;
            for i in 0..=pieces as usize {
                for j in 0..=pieces as usize - i {
                    let (u, v) = (i as f64 / pieces, j as f64 / pieces);
                    see(a + (b - a) * u + (c - a) * v, is_own);
                }
            }
            see(middle, is_own);
        }
    }
}

/// The triangles at the rim of an opening, and those connected with them near it.
fn beside(mesh: &SurfaceMesh, across: &[[u32; 3]], opening: &Opening, mut open: Vec<u32>) -> BTreeSet<u32> {
    let near_mm = 2.0 * OWN_RIM * opening.radius_mm;
    let is_near = |v: &u32| {
        let x = mesh.vertices_mm[*v as usize];
        opening.boundary.iter().any(|rim| (mesh.vertices_mm[*rim as usize] - x).norm() <= near_mm)
    };
    let mut own: BTreeSet<u32> = open.iter().copied().collect();
    while let Some(t) = open.pop() {
        for next in across[t as usize].into_iter().filter(|next| *next != NONE) {
            if !own.contains(&next) && mesh.triangles[next as usize].iter().any(is_near) {
                own.insert(next);
                open.push(next);
            }
        }
    }
    own
}

#[cfg(test)]
mod tests {
    use super::super::Wall;
    use super::*;
    use crate::contact::extension::extended;

    /// A tube of radius 2 along x with this many rings, and coarse triangles of another tube across its end.
    fn crossed(gap_mm: f64) -> SurfaceMesh {
        let mut mesh = SurfaceMesh::default();
        let mut strip = |rings: &[Vec<Vec3>]| {
            let count = rings[0].len() as u32;
            for (n, ring) in rings.iter().enumerate() {
                let first = mesh.vertices_mm.len() as u32;
                mesh.vertices_mm.extend(ring);
                for k in 0..if n == 0 { 0 } else { count } {
                    let [a, b] = [first + k, first + (k + 1) % count];
                    mesh.triangles.extend([[a - count, b - count, a], [b - count, b, a]]);
                }
            }
        };
        let ring = |r: f64, count: usize, place: &dyn Fn(f64, f64) -> Vec3| -> Vec<Vec3> {
            let at = |k: usize| std::f64::consts::TAU * (k as f64 + 0.5) / count as f64;
            (0..count).map(|k| place(r * libm::cos(at(k)), r * libm::sin(at(k)))).collect()
        };
        let along: Vec<_> =
            (0..20).map(|n| ring(2.0, 24, &|y, z| Vec3::new(-f64::from(n), y, z))).rev().collect();
        strip(&along);
        // Eight flat sides, one of which faces the opening, and no corner in front of it.
        let flat_mm = 20.0 * libm::cos(std::f64::consts::PI / 8.0);
        let across = [-60.0, 60.0].map(|z| ring(20.0, 8, &|x, y| Vec3::new(x + flat_mm + gap_mm, y, z)));
        strip(&across);
        mesh
    }

    #[test]
    fn triangles_with_corners_far_away_are_seen_in_front() {
        for (gap_mm, expected_mm) in [(8.0, 5.8), (1.0, 0.5), (0.02, 0.0), (1e-3, 0.0)] {
            let wall = Wall::from_surface(&crossed(gap_mm)).unwrap();
            let facing = wall.openings().iter().find(|o| o.direction.x > 0.9).unwrap();
            assert!(
                (facing.beyond_mm - expected_mm).abs() < 1e-6,
                "{} mm for a gap of {gap_mm} mm",
                facing.beyond_mm
            );
            // What closes the opening stays on its own side, even where the two touch.
            let closed = extended(&wall, 0.1);
            let added = &closed.vertices_mm[wall.mesh().vertices_mm.len()..];
            let near = added.iter().filter(|x| x.y.abs() < 3.0 && x.z.abs() < 3.0);
            assert!(near.clone().all(|x| x.x <= expected_mm + 1e-9) && near.count() > 0, "{gap_mm}");
        }
    }
}
