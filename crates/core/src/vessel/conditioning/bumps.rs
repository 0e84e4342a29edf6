//! How far every vertex stands off the quadric through the vertices around it.
//!
//! The neighbours of vertex v, and theirs, lie at yⱼ = pⱼ − pᵥ: at (uⱼ, vⱼ) in its tangent plane, zⱼ above it. The surface
//!
//! ```text
//! z = c₀ + c₁u + c₂v + c₃u² + c₄uv + c₅v² + c₆z²
//! ```
//!
//! is fitted to them by weighted least squares. Spheres and cylinders are such surfaces, however few vertices are around them; without the last term
//! a circle of eight would bump at each of them by 0.02 of its edges, as much as noise of a sixteenth. The fit is linear in the zⱼ on the left, with weights
//! aⱼ that hang on places alone, c₀ = Σ aⱼzⱼ, and
//!
//! ```text
//! rᵥ = −c₀ = −Σ aⱼ nᵥ·yⱼ
//! ```
//!
//! is how far v stands out. It vanishes on a quadric however the triangles lie, which powers of an umbrella operator do only on regular
//! meshes: on the even but irregular ones that remeshing makes, a smooth aorta faired by the fourth power of that had normals 0.006 off,
//! in place of 0.0006 without fairing.

use nalgebra::{SMatrix, SVector};

use super::corners::{Corners, Kind};
use crate::{Vec3, parallel};

/// Coefficients of that surface.
const COEFFICIENTS: usize = 7;
/// Fewest neighbours that tell of a bump: two more than there are coefficients.
const LEAST_NEIGHBOURS: usize = 9;
/// A neighbour counts e times less so many mean edges away.
const WIDTH: f64 = 1.5;
/// What holds the coefficient of z² where a surface is flat: heights of a sixth of an edge tell it.
const LEAST_HEIGHT: f64 = 1e-3;
/// Largest sum of sizes of the weights: at a rim a quadric would be drawn out beyond what it was fitted to.
const LARGEST_SUM: f64 = 4.0;

/// The bumps of a surface as a linear function of heights hⱼ of its vertices along their normals: rᵥ + hᵥ − Σ aⱼ (nᵥ·nⱼ) hⱼ.
pub(super) struct Bumps {
    starts: Vec<u32>,
    /// Vertices around each, and −aⱼ nᵥ·nⱼ.
    columns: Vec<(u32, f64)>,
    /// rᵥ, mm; 0 where nothing can be said.
    at_rest_mm: Vec<f64>,
}

/// Row of one vertex.
#[derive(Default)]
struct Row {
    columns: Vec<(u32, f64)>,
    at_rest_mm: f64,
}

impl Bumps {
    pub(super) fn new(corners: &Corners) -> Self {
        let count = corners.vertices.len();
        let rows = parallel::parts(count, |part| {
            let mut around = Around::default();
            part.map(|v| row(corners, v as u32, &mut around).unwrap_or_default()).collect::<Vec<_>>()
        });
        let mut bumps = Self { starts: vec![0], columns: Vec::new(), at_rest_mm: Vec::with_capacity(count) };
        for row in rows.into_iter().flatten() {
            bumps.columns.extend(row.columns);
            bumps.starts.push(bumps.columns.len() as u32);
            bumps.at_rest_mm.push(row.at_rest_mm);
        }
        bumps
    }

    fn row(&self, v: usize) -> &[(u32, f64)] {
        &self.columns[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Bumps at rest, mm, of the vertices that have any.
    pub(super) fn at_rest_mm(&self) -> impl Iterator<Item = (usize, f64)> {
        let told = |(v, _): &(usize, f64)| !self.row(*v).is_empty();
        self.at_rest_mm.iter().copied().enumerate().filter(told)
    }

    /// Largest eigenvalue of the square of the operator, or more.
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

    /// The slope of half the sum of their squares.
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

/// What lies around a vertex.
#[derive(Default)]
struct Around {
    spokes: Vec<u32>,
    ring: Vec<u32>,
    next: Vec<u32>,
    all: Vec<u32>,
}

impl Around {
    /// Sets `all` to the neighbours of `v`, those first, and theirs.
    fn gather(&mut self, corners: &Corners, v: u32) {
        let Self { spokes, ring, next, all } = self;
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
}

/// The row of vertex `v`, if its surroundings tell of a bump.
fn row(corners: &Corners, v: u32, around: &mut Around) -> Option<Row> {
    let vertex = &corners.vertices[v as usize];
    let normal = vertex.normal;
    if vertex.kind != Kind::Free || normal == Vec3::zeros() {
        return None;
    }
    around.gather(corners, v);
    let neighbours = &around.all;
    if neighbours.len() < LEAST_NEIGHBOURS {
        return None;
    }
    let offset = |w: u32| corners.at(w) - vertex.at;
    let ring = around.ring.len().max(1);
    let edge_mm = around.ring.iter().map(|w| offset(*w).norm()).sum::<f64>() / ring as f64;
    let first = if normal.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let first = (first - normal * normal.dot(&first)).normalize();
    let second = normal.cross(&first);
    // In edges, so that the equations have one scale.
    let basis = |w: u32| {
        let y = offset(w) / edge_mm;
        let (u, v, z) = (first.dot(&y), second.dot(&y), normal.dot(&y));
        let facing = corners.vertices[w as usize].normal.dot(&normal).max(0.0);
        let weight = facing * (-y.norm_squared() / (WIDTH * WIDTH)).exp();
        (SVector::<f64, COEFFICIENTS>::from([1.0, u, v, u * u, u * v, v * v, z * z]), weight)
    };
    let mut equations = SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::zeros();
    equations[(6, 6)] = LEAST_HEIGHT;
    for &w in neighbours {
        let (basis, weight) = basis(w);
        equations.ger(weight, &basis, &basis, 1.0);
    }
    // The first row of the inverse times what neighbours add is what the height at v itself comes to.
    let mut height = SVector::<f64, COEFFICIENTS>::zeros();
    height[0] = 1.0;
    equations.cholesky()?.solve_mut(&mut height);
    let mut row = Row::default();
    let mut sum = 0.0;
    for &w in neighbours {
        let (basis, weight) = basis(w);
        let share = weight * height.dot(&basis);
        sum += share.abs();
        row.at_rest_mm -= share * normal.dot(&offset(w));
        row.columns.push((w, -share * normal.dot(&corners.vertices[w as usize].normal)));
    }
    (sum <= LARGEST_SUM).then_some(row)
}
