//! The wall as a device feels it: the vessel goes on beyond its ends.
//!
//! A surface ends where the scan ended, and a wall that stops holding a tip from one point to the next has no
//! equilibrium there. Every opening that a device can pass is extended straight along its direction, as flow extensions
//! are in vessel models, and closed where that ends, so that nothing is ever where no wall is; smaller ones are holes of the mesh and
//! closed. Extensions that would meet each other or the vessel are shorter. The triangles of the vessel keep their numbers.
//!
//! A rim has the corners of a surface that was cut there, and drawn out straight they would be furrows in which a tip is caught. So
//! the rim passes into the ellipse next to it, r(s) = c + a cos s + b sin s with the part s of its length, over its own width.

use std::f64::consts::TAU;

use nalgebra::Matrix3;

use crate::Vec3;
use crate::vessel::{Opening, SurfaceMesh, Wall};

/// How much is left of an extension, mm, where a tip that goes there has left.
const LEFT_MM: f64 = 2.0;
/// Length over which a rim passes into an ellipse, in radii of the opening.
const ROUNDING: f64 = 2.0;

/// The surface of `wall` with its openings wider than `radius_mm` extended and the others closed.
pub fn extended(wall: &Wall, radius_mm: f64) -> SurfaceMesh {
    let mut mesh = wall.mesh().clone();
    for opening in wall.openings() {
        if opening.radius_mm > radius_mm {
            extend(&mut mesh, opening);
        } else {
            opening.close(&mut mesh);
        }
    }
    mesh
}

/// Rings along the opening's direction, as far apart as the rim's vertices.
fn extend(mesh: &mut SurfaceMesh, opening: &Opening) {
    let count = opening.boundary.len();
    let at = |k: usize| mesh.vertices_mm[opening.boundary[k % count] as usize];
    let around: f64 = (0..count).map(|k| (at(k + 1) - at(k)).norm()).sum();
    let rings = (opening.beyond_mm / (around / count as f64)).ceil().clamp(1.0, 1000.0) as usize;
    let rim: Vec<Vec3> = (0..count).map(at).collect();
    let round = ellipse(&rim);
    let mut last = opening.boundary.clone();
    for ring in 1..=rings {
        let way_mm = opening.beyond_mm * ring as f64 / rings as f64;
        let t = (way_mm / (ROUNDING * opening.radius_mm)).min(1.0);
        let (share, way) = (t * t * (3.0 - 2.0 * t), opening.direction * way_mm);
        let first = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.extend(rim.iter().zip(&round).map(|(v, w)| v + (w - v) * share + way));
        let next: Vec<u32> = (first..first + count as u32).collect();
        for k in 0..count {
            let l = (k + 1) % count;
            // A cap would run along the boundary like this; so does the first triangle of the strip.
            mesh.triangles.push([last[k], last[l], next[k]]);
            mesh.triangles.push([last[l], next[l], next[k]]);
        }
        last = next;
    }
    let centre = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.push(opening.centre_mm + opening.direction * opening.beyond_mm);
    mesh.triangles.extend((0..count).map(|k| [last[k], last[(k + 1) % count], centre]));
}

/// The points of the ellipse next to a closed line, one for each of its corners: least squares over its length.
fn ellipse(line: &[Vec3]) -> Vec<Vec3> {
    let count = line.len();
    let side = |k: usize| (line[(k + 1) % count] - line[k]).norm();
    let around: f64 = (0..count).map(side).sum();
    let (mut s, mut matrix, mut right) = (0.0, Matrix3::zeros(), Matrix3::zeros());
    let mut rows = Vec::with_capacity(count);
    for k in 0..count {
        let row = Vec3::new(1.0, f64::cos(s), f64::sin(s));
        let length = 0.5 * (side(k) + side((k + count - 1) % count));
        matrix += row * row.transpose() * length;
        right += row * line[k].transpose() * length;
        rows.push(row);
        s += side(k) * TAU / around;
    }
    match matrix.cholesky() {
        Some(factor) => {
            let found = factor.solve(&right);
            rows.iter().map(|row| found.tr_mul(row)).collect()
        }
        // A triangle without an area.
        None => line.to_vec(),
    }
}

/// How far beyond an opening a tip may go, mm.
pub fn leave_mm(opening: &Opening) -> f64 {
    opening.beyond_mm - LEFT_MM
}

/// The opening beyond whose plane `x` lies, within its extension, and how far, mm.
pub fn left_through<'a>(wall: &'a Wall, x: &Vec3) -> Option<(&'a Opening, f64)> {
    wall.openings().iter().find_map(|o| {
        let (beyond, aside) = o.beyond_and_aside_mm(x);
        (beyond > 0.0 && beyond <= o.beyond_mm && aside < 1.5 * o.radius_mm).then_some((o, beyond))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{GeneratedWall, Resolution, anatomy, check};

    #[test]
    fn the_extended_vessel_is_sound_and_keeps_its_triangles() {
        let wall =
            GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::EdgeMm(3.0)).unwrap().wall;
        let mesh = extended(&wall, 0.5);
        assert_eq!(mesh.triangles[..wall.mesh().triangles.len()], wall.mesh().triangles[..]);
        let report = check(&mesh).unwrap();
        assert!(report.watertight && report.is_sound(), "{report:?}");
        let closed = check(&extended(&wall, 100.0)).unwrap();
        assert!(closed.watertight && closed.is_sound(), "{closed:?}");
    }

    #[test]
    fn corners_of_a_rim_vanish_and_an_ellipse_stays() {
        let polygon = |rough: f64| -> Vec<Vec3> {
            (0..24)
                .map(|k| {
                    let (sin, cos) = (TAU * f64::from(k) / 24.0).sin_cos();
                    Vec3::new(3.0 * cos, 3.0 * sin, 0.3 * cos) * (1.0 + rough * f64::from(k % 2))
                })
                .collect()
        };
        let (smooth, rough) = (polygon(0.0), polygon(0.1));
        for (v, w) in smooth.iter().zip(ellipse(&smooth)) {
            assert!((v - w).norm() < 0.01, "{v} {w}");
        }
        let sizes: Vec<f64> = ellipse(&rough).iter().map(|v| v.xy().norm()).collect();
        let (least, most) = sizes.iter().fold((f64::MAX, 0.0f64), |(a, b), r| (a.min(*r), b.max(*r)));
        assert!(most - least < 0.02 && (least - 3.15).abs() < 0.03, "{least} {most}");
    }

    #[test]
    fn a_point_past_an_opening_has_left_through_it() {
        let wall = GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(2.0))
            .unwrap()
            .wall;
        let top = wall.openings().iter().find(|o| o.direction.z > 0.5).unwrap();
        let found = left_through(&wall, &Vec3::new(1.0, 0.0, 105.0)).unwrap();
        assert!(found.0.index == top.index && (found.1 - 5.0).abs() < 1e-6);
        assert!(left_through(&wall, &Vec3::new(1.0, 0.0, 95.0)).is_none());
    }
}
