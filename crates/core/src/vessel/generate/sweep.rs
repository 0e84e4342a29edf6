//! A tube around one branch: rings with rotation-minimising frames.
//!
//! Frames by double reflection: Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames", ACM TOG 27 (2008),
//! algorithm 1; error of order ds⁴, exact on circles.

use std::f64::consts::{PI, TAU};

use super::curve::{Branch, Place};
use crate::Vec3;
use crate::vessel::SurfaceMesh;

/// Smallest number of corners of a ring for a usable tube.
const FEWEST_AROUND: usize = 8;

/// A tube of nearly equilateral triangles with edges of about `edge_mm`, open at both ends. Vertices lie **on** the circles of
/// the given radius, so the polygonal lumen is inscribed: narrower by the factor cos(π/n) at the middle of its facets.
pub(super) fn tube(branch: &Branch, edge_mm: f64) -> SurfaceMesh {
    let mean_radius = branch.samples.iter().map(|s| s.radius).sum::<f64>() / branch.samples.len() as f64;
    let around = ((TAU * mean_radius / edge_mm).round() as usize).max(FEWEST_AROUND);
    // Rows of equilateral triangles are √3/2 edges apart.
    let row = TAU * mean_radius / around as f64 * 0.75_f64.sqrt();
    let rows = ((branch.length() / row).round() as usize).max(1);
    let places: Vec<Place> =
        (0..=rows).map(|k| branch.at(branch.length() * k as f64 / rows as f64)).collect();
    let frames = frames(&places);
    let mut mesh = SurfaceMesh::default();
    for (k, (place, &(u, v))) in places.iter().zip(&frames).enumerate() {
        // Every other ring is rotated by half a step, so that triangles are equilateral.
        let turn = if k % 2 == 0 { 0.0 } else { PI / around as f64 };
        for j in 0..around {
            let angle = TAU * j as f64 / around as f64 + turn;
            mesh.vertices_mm
                .push(place.position + place.radius * (libm::cos(angle) * u + libm::sin(angle) * v));
        }
    }
    let id = |k: usize, j: usize| (k * around + j % around) as u32;
    for k in 0..rows {
        for j in 0..around {
            let (a, b, c, d) = (id(k, j), id(k, j + 1), id(k + 1, j), id(k + 1, j + 1));
            if k % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [b, d, c]]);
            } else {
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    mesh
}

/// Two unit vectors across the tangent at each position, rotating about it as little as possible.
fn frames(places: &[Place]) -> Vec<(Vec3, Vec3)> {
    let tangent = |k: usize| places[k].first.normalize();
    let mut across = any_perpendicular(&tangent(0));
    let mut frames = vec![(across, tangent(0).cross(&across))];
    for k in 1..places.len() {
        let chord = places[k].position - places[k - 1].position;
        let reflect = |v: Vec3, mirror: Vec3| v - mirror * (2.0 * mirror.dot(&v) / mirror.norm_squared());
        let (across_mirrored, tangent_mirrored) = (reflect(across, chord), reflect(tangent(k - 1), chord));
        let second = tangent(k) - tangent_mirrored;
        let carried =
            if second.norm_squared() > 0.0 { reflect(across_mirrored, second) } else { across_mirrored };
        // Corrects rounding, to keep the frame orthonormal over long vessels.
        across = (carried - tangent(k) * tangent(k).dot(&carried)).normalize();
        frames.push((across, tangent(k).cross(&across)));
    }
    frames
}

/// A unit vector perpendicular to `axis`, from the coordinate axis least aligned with it.
pub(crate) fn any_perpendicular(axis: &Vec3) -> Vec3 {
    let least = Vec3::ith_axis(axis.iamin()).into_inner();
    (least - axis * axis.dot(&least)).normalize()
}
