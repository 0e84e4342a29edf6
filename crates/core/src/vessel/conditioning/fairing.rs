//! Rounds kinks and takes out noise as far as the limit allows.
//!
//! Vertices aᵢ on the given surface are moved along their normals to pᵢ = aᵢ + hᵢnᵢ. With L the umbrella operator with cotangent
//! weights, whose eigenvalues are about (q h)²/4 for waves of wave number q on edges h, the heights minimise
//!
//! ```text
//! ½ Σ (hᵢ − ηᵢ)² + ½ α Σ |L²p|ᵢ²,      |hᵢ| ≤ 0.8 tᵢ
//! ```
//!
//! from the smooth reconstruction ηᵢ of coarse facets ([`super::reference`]). Without bounds that is a filter 1/(1 + αk⁴) (of the
//! family of Desbrun et al., "Implicit fairing", SIGGRAPH 1999): with α = 1000 waves of 7 edges are halved, a tube with 22 edges
//! around keeps its radius within 10⁻⁴, so nothing shrinks. The bounds are kept by projection in an accelerated gradient method
//! (Beck and Teboulle, *SIAM J. Imaging Sci.* 2, 2009).

use super::corners::{Corners, Kind, vertex_normals};
use super::reference::Reference;
use crate::Vec3;
use crate::vessel::topology::NONE;

/// Part of the limit that heights may take: chords of the new triangles take some of it too.
const REACH: f64 = 0.8;
/// α.
const STIFFNESS: f64 = 1000.0;
/// Largest eigenvalue of L, about.
const LARGEST: f64 = 2.0;
/// Least cotangent weight: obtuse corners must not push.
const LEAST_WEIGHT: f64 = 0.05;
/// Cosine by which a triangle may turn against where it was.
const LEAST_COSINE: f64 = 0.5;

/// The umbrella operator by rows.
struct Umbrella {
    starts: Vec<u32>,
    columns: Vec<(u32, f64)>,
}

impl Umbrella {
    fn new(corners: &Corners) -> Self {
        let mut starts = vec![0];
        let mut columns: Vec<(u32, f64)> = Vec::new();
        let mut spokes = Vec::new();
        let weight = |e: u32| {
            let (a, b, c) =
                (corners.at(corners.from(e)), corners.at(corners.to(e)), corners.at(corners.apex(e)));
            let area = (a - c).cross(&(b - c)).norm();
            ((a - c).dot(&(b - c)) / area.max(f64::MIN_POSITIVE)).clamp(LEAST_WEIGHT, 5.0)
        };
        for v in 0..corners.vertices.len() as u32 {
            if corners.kind(v) == Kind::Free {
                corners.spokes(v, &mut spokes);
                let first = columns.len();
                for &e in &spokes {
                    let back = corners.twin(e);
                    let w = weight(e) + if back == NONE { 0.0 } else { weight(back) };
                    columns.push((corners.to(e), w));
                }
                let sum: f64 = columns[first..].iter().map(|c| c.1).sum();
                columns[first..].iter_mut().for_each(|c| c.1 /= sum);
            }
            starts.push(columns.len() as u32);
        }
        Self { starts, columns }
    }

    fn row(&self, v: usize) -> &[(u32, f64)] {
        &self.columns[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Lx, zero where there is no row.
    fn apply(&self, x: &[Vec3], result: &mut [Vec3]) {
        for v in 0..x.len() {
            let row = self.row(v);
            result[v] = if row.is_empty() {
                Vec3::zeros()
            } else {
                row.iter().fold(x[v], |sum, (w, weight)| sum - x[*w as usize] * *weight)
            };
        }
    }

    /// Lᵀx.
    fn apply_transposed(&self, x: &[Vec3], result: &mut [Vec3]) {
        result.fill(Vec3::zeros());
        for v in 0..x.len() {
            let row = self.row(v);
            if !row.is_empty() {
                result[v] += x[v];
                for (w, weight) in row {
                    result[*w as usize] -= x[v] * *weight;
                }
            }
        }
    }
}

/// Where the vertices come to lie, mm.
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
    let umbrella = Umbrella::new(corners);
    // The second umbrella needs the first all around.
    let whole: Vec<bool> = (0..count)
        .map(|v| {
            let row = umbrella.row(v);
            !row.is_empty() && row.iter().all(|(w, _)| !umbrella.row(*w as usize).is_empty())
        })
        .collect();
    let place = |h: &[f64]| -> Vec<Vec3> {
        corners.vertices.iter().zip(h).map(|(x, h)| x.at + x.normal * *h).collect()
    };
    let step = 1.0 / (1.0 + STIFFNESS * LARGEST.powi(4));
    let mut heights = wanted.clone();
    let mut ahead = heights.clone();
    let mut momentum = 1.0f64;
    let (mut first, mut second) = (vec![Vec3::zeros(); count], vec![Vec3::zeros(); count]);
    for _ in 0..iterations {
        umbrella.apply(&place(&ahead), &mut first);
        umbrella.apply(&first, &mut second);
        second.iter_mut().zip(&whole).filter(|(_, whole)| !**whole).for_each(|(x, _)| *x = Vec3::zeros());
        umbrella.apply_transposed(&second, &mut first);
        umbrella.apply_transposed(&first, &mut second);
        let larger = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let onward = (momentum - 1.0) / larger;
        momentum = larger;
        for v in 0..count {
            let slope = ahead[v] - wanted[v] + STIFFNESS * corners.vertices[v].normal.dot(&second[v]);
            let new = (ahead[v] - step * slope).clamp(-bound[v], bound[v]);
            let new = if new.is_finite() { new } else { 0.0 };
            ahead[v] = new + onward * (new - heights[v]);
            heights[v] = new;
        }
    }
    draw_back(corners, &mut heights);
    place(&heights)
}

/// Mean of |L²p| along the normals over the edges there: nothing where a surface is smooth on the scale of its edges.
pub(super) fn roughness(corners: &Corners) -> f64 {
    let umbrella = Umbrella::new(corners);
    let place: Vec<Vec3> = corners.vertices.iter().map(|v| v.at).collect();
    let (mut first, mut second) = (vec![Vec3::zeros(); place.len()], vec![Vec3::zeros(); place.len()]);
    umbrella.apply(&place, &mut first);
    umbrella.apply(&first, &mut second);
    let (mut sum, mut count) = (0.0, 0);
    for (v, x) in second.iter().enumerate() {
        let row = umbrella.row(v);
        if row.is_empty() || row.iter().any(|(w, _)| umbrella.row(*w as usize).is_empty()) {
            continue;
        }
        let edge: f64 = row.iter().map(|(w, weight)| weight * (place[*w as usize] - place[v]).norm()).sum();
        sum += x.dot(&corners.vertices[v].normal).abs() / edge.max(f64::MIN_POSITIVE);
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

/// Largest turn of the normal per length along an edge of each vertex, 1/mm.
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
