//! Smooths kinks and noise as far as the limit allows.
//!
//! Vertices aᵢ on the given surface are moved along their normals to pᵢ = aᵢ + hᵢnᵢ. With rᵢ the height of a vertex
//! above the quadric through those around it ([`super::bumps`]), the heights minimise
//!
//! ```text
//! ½ Σ (hᵢ − ηᵢ)² + ½ α Σ rᵢ²,      |hᵢ| ≤ 0.8 tᵢ
//! ```
//!
//! about the smooth reconstruction ηᵢ of coarse facets ([`super::reference`]). Without bounds that is a filter 1/(1 +
//! αb²), where bumps b of waves 4, 6 and 10 edges long are 0.26, 0.06 and 0.009 of their amplitude on a regular mesh:
//! with α = 150 a wave of 5.5 edges is halved, and one of 10 keeps 99 of 100. It belongs to the family of Desbrun et
//! al., "Implicit fairing", SIGGRAPH 1999, with a bump instead of the square of an umbrella operator, which mistakes
//! the irregularity of a mesh for one of the surface. The bounds are enforced by projection in an accelerated
//! gradient method (Beck and Teboulle, *SIAM J. Imaging Sci.* 2, 2009).

use super::bumps::Bumps;
use super::corners::{Corners, Kind, vertex_normals};
use super::reference::Reference;
use crate::Vec3;
use crate::vessel::topology::NONE;

/// Fraction of the limit available to heights: chords of the new triangles take some of it too.
const REACH: f64 = 0.8;
/// α.
const STIFFNESS: f64 = 150.0;
/// Smallest cosine of the angle by which a triangle may rotate.
const LEAST_COSINE: f64 = 0.5;

/// The new positions of the vertices, mm.
pub(super) fn fair(corners: &Corners, reference: &Reference, iterations: usize) -> Vec<Vec3> {
    let count = corners.vertices.len();
    let free =
        |v: usize| corners.vertices[v].kind == Kind::Free && corners.vertices[v].normal != Vec3::zeros();
    let bound: Vec<f64> = corners
        .vertices
        .iter()
        .enumerate()
        .map(|(v, x)| if free(v) { REACH * x.limit_mm } else { 0.0 })
        .collect();
    let wanted: Vec<f64> = (0..count)
        .map(|v| {
            if bound[v] == 0.0 {
                return 0.0;
            }
            let foot = reference.walk(&corners.vertices[v].at, corners.vertices[v].place);
            reference.bulge_mm(&foot).clamp(-bound[v], bound[v])
        })
        .collect();
    let bumps = Bumps::new(corners);
    let step = 1.0 / (1.0 + STIFFNESS * bumps.largest());
    let mut heights = wanted.clone();
    let mut ahead = heights.clone();
    let mut momentum = 1.0f64;
    let (mut bump, mut uneven) = (vec![0.0; count], vec![0.0; count]);
    for _ in 0..iterations {
        bumps.with(&ahead, &mut bump);
        bumps.slope(&bump, &mut uneven);
        let larger = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let onward = (momentum - 1.0) / larger;
        momentum = larger;
        for v in 0..count {
            let slope = ahead[v] - wanted[v] + STIFFNESS * uneven[v];
            let new = (ahead[v] - step * slope).clamp(-bound[v], bound[v]);
            let new = if new.is_finite() { new } else { 0.0 };
            ahead[v] = new + onward * (new - heights[v]);
            heights[v] = new;
        }
    }
    draw_back(corners, &mut heights);
    corners.vertices.iter().zip(&heights).map(|(x, h)| x.at + x.normal * *h).collect()
}

/// Least number of vertices of which the roughness of a larger mesh is the mean.
const SAMPLES: usize = 50_000;

/// Mean bump relative to the local edges: zero where a surface is smooth on the scale of its edges.
pub(super) fn roughness(corners: &Corners) -> f64 {
    let stride = (corners.vertices.len() / SAMPLES).max(1);
    let (mut spokes, mut sum, mut count) = (Vec::new(), 0.0, 0);
    for (v, bump_mm) in Bumps::of_every(corners, stride).at_rest_mm() {
        corners.spokes(v as u32, &mut spokes);
        let edge_mm = spokes.iter().map(|e| corners.length_mm(*e)).sum::<f64>() / spokes.len() as f64;
        sum += bump_mm.abs() / edge_mm.max(f64::MIN_POSITIVE);
        count += 1;
    }
    sum / f64::from(count.max(1))
}

/// Halves the heights of triangles that were turned over.
fn draw_back(corners: &Corners, heights: &mut [f64]) {
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a));
    for round in 0..4 {
        let mut turned = false;
        for t in corners.triangles.iter().filter(|t| t[0] != NONE) {
            let before = normal(t.map(|v| corners.at(v)));
            let after = normal(t.map(|v| {
                let vertex = &corners.vertices[v as usize];
                vertex.at + vertex.normal * heights[v as usize]
            }));
            if before.dot(&after) < LEAST_COSINE * before.norm() * after.norm() {
                turned = true;
                for &v in t {
                    heights[v as usize] *= if round == 3 { 0.0 } else { 0.5 };
                }
            }
        }
        if !turned {
            return;
        }
    }
}

/// Largest rotation of the normal per length along an edge of each vertex, 1/mm.
pub(super) fn curvature(corners: &Corners, at: &[Vec3]) -> Vec<f64> {
    let normals = vertex_normals(&corners.triangles, at);
    let mut found = vec![0.0f64; at.len()];
    for e in (0..corners.half_edges()).filter(|&e| corners.leads(e)) {
        let (a, b) = (corners.from(e) as usize, corners.to(e) as usize);
        let bend = (normals[a] - normals[b]).norm() / (at[a] - at[b]).norm().max(f64::MIN_POSITIVE);
        for v in [a, b] {
            found[v] = found[v].max(bend);
        }
    }
    found
}
