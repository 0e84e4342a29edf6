//! Height of every vertex above the quadric through the vertices around it.
//!
//! The neighbours of vertex v, and their neighbours, are at yⱼ = pⱼ − pᵥ: at (uⱼ, vⱼ) in its tangent plane, zⱼ above
//! it. The surface
//!
//! ```text
//! z = c₀ + c₁u + c₂v + c₃u² + c₄uv + c₅v² + c₆z²
//! ```
//!
//! is fitted to them by weighted least squares. Spheres and cylinders are such surfaces, however few vertices they
//! have; without the last term each vertex of a circle of eight would have a bump of 0.02 of its edges, as much as
//! noise of a sixteenth. The fit is linear in the zⱼ on the left, with weights aⱼ that depend only on positions, c₀ =
//! Σ aⱼzⱼ, and
//!
//! ```text
//! rᵥ = −c₀ = −Σ aⱼ nᵥ·yⱼ
//! ```
//!
//! is the height by which v stands out. It vanishes on a quadric for any triangulation, unlike powers of an umbrella
//! operator, which vanish only on regular meshes: on the uniform but irregular meshes that remeshing produces,
//! fairing a smooth aorta by the fourth power of that operator changed normals by 0.006, instead of 0.0006 without
//! fairing.

use nalgebra::{SMatrix, SVector};

use super::corners::{Corners, Kind, Vertex};
use crate::{Vec3, parallel};

/// Number of coefficients of that surface.
const COEFFICIENTS: usize = 7;
/// Smallest number of neighbours that determine a bump: two more than there are coefficients.
const LEAST_NEIGHBOURS: usize = 9;
/// Distance, in mean edges, at which the weight of a neighbour has decreased e times.
const WIDTH: f64 = 1.5;
/// Regularisation of the coefficient of z² for flat surfaces: heights of a sixth of an edge determine it.
const LEAST_HEIGHT: f64 = 1e-3;
/// Largest sum of absolute weights: near a rim a quadric would be extrapolated.
const LARGEST_SUM: f64 = 4.0;

/// The bumps of a surface as a linear function of heights hⱼ of its vertices along their normals: rᵥ + hᵥ − Σ aⱼ
/// (nᵥ·nⱼ) hⱼ.
#[derive(Default)]
pub(super) struct Bumps {
    /// Start of the row of each vertex, and the end of the last one.
    starts: Vec<u32>,
    /// Vertices around each, and −aⱼ nᵥ·nⱼ.
    columns: Vec<(u32, f64)>,
    /// rᵥ, mm; 0 where undetermined.
    at_rest_mm: Vec<f64>,
}

impl Bumps {
    pub(super) fn new(corners: &Corners) -> Self {
        Self::of_every(corners, 1)
    }

    /// Those of every so many vertices.
    pub(super) fn of_every(corners: &Corners, stride: usize) -> Self {
        let parts = parallel::parts(corners.vertices.len(), |part| {
            let (mut bumps, mut around) = (Self::default(), Around::default());
            for v in part {
                bumps.starts.push(bumps.columns.len() as u32);
                let is_wanted = v.is_multiple_of(stride);
                let found = is_wanted.then(|| bumps.add(corners, v as u32, &mut around)).flatten();
                bumps.at_rest_mm.push(found.unwrap_or(0.0));
            }
            bumps
        });
        let mut all = Self::default();
        for part in parts {
            let before = all.columns.len() as u32;
            all.starts.extend(part.starts.into_iter().map(|start| start + before));
            all.columns.extend(part.columns);
            all.at_rest_mm.extend(part.at_rest_mm);
        }
        all.starts.push(all.columns.len() as u32);
        all
    }

    /// Adds the columns of vertex `v` and returns its bump at zero heights, mm, if its surroundings determine it.
    fn add(&mut self, corners: &Corners, v: u32, around: &mut Around) -> Option<f64> {
        let vertex = &corners.vertices[v as usize];
        let normal = vertex.normal;
        if vertex.kind != Kind::Free || normal == Vec3::zeros() {
            return None;
        }
        around.gather(corners, v);
        if around.all.len() < LEAST_NEIGHBOURS {
            return None;
        }
        let equations = around.fit(corners, vertex).cholesky()?;
        // The first row of the inverse times the neighbours' contributions is the height at v itself.
        let mut height = Terms::zeros();
        height[0] = 1.0;
        equations.solve_mut(&mut height);
        let begin = self.columns.len();
        let (mut sum, mut at_rest_mm) = (0.0, 0.0);
        for (&w, (terms, weight)) in around.all.iter().zip(&around.terms) {
            let share = weight * height.dot(terms);
            sum += share.abs();
            at_rest_mm -= share * normal.dot(&(corners.at(w) - vertex.at));
            self.columns.push((w, -share * normal.dot(&corners.vertices[w as usize].normal)));
        }
        if sum > LARGEST_SUM {
            self.columns.truncate(begin);
            return None;
        }
        Some(at_rest_mm)
    }

    fn row(&self, v: usize) -> &[(u32, f64)] {
        &self.columns[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Bumps at zero heights, mm, of the vertices that have any.
    pub(super) fn at_rest_mm(&self) -> impl Iterator<Item = (usize, f64)> {
        let reported = |(v, _): &(usize, f64)| !self.row(*v).is_empty();
        self.at_rest_mm.iter().copied().enumerate().filter(reported)
    }

    /// An upper bound of the largest eigenvalue of the square of the operator.
    pub(super) fn largest(&self) -> f64 {
        // ‖B‖₂² ≤ ‖B‖₁ ‖B‖_∞.
        let mut down = vec![0.0f64; self.at_rest_mm.len()];
        let mut across: f64 = 0.0;
        for v in (0..self.at_rest_mm.len()).filter(|v| !self.row(*v).is_empty()) {
            let mut sum = 1.0;
            down[v] += 1.0;
            for (w, weight) in self.row(v) {
                down[*w as usize] += weight.abs();
                sum += weight.abs();
            }
            across = across.max(sum);
        }
        across * down.into_iter().fold(0.0, f64::max)
    }

    /// Bumps with these heights, mm.
    pub(super) fn with(&self, heights: &[f64], bumps: &mut [f64]) {
        for (v, bump) in bumps.iter_mut().enumerate() {
            let row = self.row(v);
            *bump = if row.is_empty() {
                0.0
            } else {
                row.iter().fold(self.at_rest_mm[v] + heights[v], |sum, (w, weight)| {
                    sum + weight * heights[*w as usize]
                })
            };
        }
    }

    /// The gradient of half the sum of their squares.
    pub(super) fn slope(&self, bumps: &[f64], slope: &mut [f64]) {
        slope.fill(0.0);
        for (v, bump) in bumps.iter().enumerate() {
            let row = self.row(v);
            if !row.is_empty() {
                slope[v] += bump;
                row.iter().for_each(|(w, weight)| slope[*w as usize] += weight * bump);
            }
        }
    }
}

/// 1, u, v, u², uv, v², z² of a vertex.
type Terms = SVector<f64, COEFFICIENTS>;

/// The surroundings of a vertex.
#[derive(Default)]
struct Around {
    spokes: Vec<u32>,
    ring: Vec<u32>,
    next: Vec<u32>,
    /// Neighbours, and their neighbours.
    all: Vec<u32>,
    /// Terms and weights of `all`.
    terms: Vec<(Terms, f64)>,
}

impl Around {
    /// Sets `all` to the neighbours of `v`, then their neighbours.
    fn gather(&mut self, corners: &Corners, v: u32) {
        let Self { spokes, ring, next, all, .. } = self;
        corners.spokes(v, spokes);
        corners.neighbours(spokes, ring);
        all.clear();
        all.extend(ring.iter().filter(|w| corners.kind(**w) != Kind::Locked));
        for &w in ring.iter() {
            corners.spokes(w, spokes);
            corners.neighbours(spokes, next);
            for &x in next.iter() {
                if x != v && corners.kind(x) != Kind::Locked && !all.contains(&x) {
                    all.push(x);
                }
            }
        }
    }

    /// Computes and returns the normal matrix, with terms in units of edges for equal scales.
    fn fit(&mut self, corners: &Corners, vertex: &Vertex) -> SMatrix<f64, COEFFICIENTS, COEFFICIENTS> {
        let normal = vertex.normal;
        let offset = |w: u32| corners.at(w) - vertex.at;
        let ring = self.ring.len().max(1);
        let edge_mm = self.ring.iter().map(|w| offset(*w).norm()).sum::<f64>() / ring as f64;
        let first = if normal.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let first = (first - normal * normal.dot(&first)).normalize();
        let second = normal.cross(&first);
        let mut equations = SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::zeros();
        equations[(6, 6)] = LEAST_HEIGHT;
        self.terms.clear();
        for &w in &self.all {
            let y = offset(w) / edge_mm;
            let (u, v, z) = (first.dot(&y), second.dot(&y), normal.dot(&y));
            let facing = corners.vertices[w as usize].normal.dot(&normal).max(0.0);
            let weight = facing * libm::exp(-y.norm_squared() / (WIDTH * WIDTH));
            let terms = Terms::from([1.0, u, v, u * u, u * v, v * v, z * z]);
            equations.ger(weight, &terms, &terms, 1.0);
            self.terms.push((terms, weight));
        }
        equations
    }
}
