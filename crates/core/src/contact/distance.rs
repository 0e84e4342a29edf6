//! A smooth signed distance to a triangulated wall.
//!
//! The distance to the flat triangles is not smooth where a device leans: inside a tube the closest triangle jumps at
//! every bisector of two facets, the force direction with it, and Newton's method chatters; and the flat wall stands off
//! the vessel it samples by edge²/8R. Both go away when the wall is taken as a smooth surface with a continuous normal
//! field (the projection of Panozzo et al., *Weighted averages on surfaces*, SIGGRAPH 2013, on a quadratic patch in the
//! manner of Nagata, *Simple local interpolation of surfaces using normal vectors*, CAGD 2005):
//!
//! ```text
//! q(λ) = Σ λᵢ Vᵢ − Σ λᵢλⱼ cᵢⱼ      patch over a triangle, the edges' corrections cᵢⱼ bend it to the vertex normals
//! M(λ) = Σ λᵢ Nᵢ                    normal field, continuous over edges
//! x = q(λ) + s M(λ),  d(x) = s |M|   the distance of x: three equations for λ and s
//! ```
//!
//! The patches meet without gaps and so do their normals, but they are bent a little across their edges, so ∇d differs from
//! n = M/|M| by a third-order angle that jumps there. What pushes a device must not jump: with ∇d itself a point can
//! come to rest in an edge, where no equilibrium exists. The force acts along n, which is continuous, and its derivative is
//! that of n: with rows rₖ of (∂x/∂(λ₁, λ₂, s))⁻¹, ∂n/∂x = (I − nnᵀ) Σ ∂M/∂λₖ rₖ / |M|.
//!
//! A point walks from triangle to triangle until its foot lies inside one; between steps of a device that is one or two
//! triangles, so the bounding volume hierarchy is asked only where something new may have come near.

use nalgebra::Matrix3;

use crate::Vec3;
use crate::vessel::{NO_NEIGHBOUR, Wall};

/// Largest bend of an edge, as a part of its length: beyond a crease of about 50° a corner is a corner.
const LARGEST_CORRECTION: f64 = 0.25;
/// Triangles a walk may cross before the flat distance is used instead.
const LONGEST_WALK: usize = 24;
/// Newton iterations in one triangle.
const ITERATIONS: usize = 12;
/// How far outside its triangle a foot may lie, in barycentric coordinates: rounding must not bounce it over an edge.
const EDGE_SLACK: f64 = 1e-9;

/// Where a point stands on the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Triangle of the wall mesh.
    pub triangle: u32,
    /// Barycentric coordinates λ₁, λ₂ and height s of the point.
    coordinates: [f64; 3],
}

/// Signed distance with derivatives; positive in the lumen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance d, mm.
    pub value_mm: f64,
    /// Direction n of the wall's force: into the lumen, unit length, continuous.
    pub normal: Vec3,
    /// The symmetric part of ∂n/∂x, 1/mm.
    pub curvature: Matrix3<f64>,
}

/// One triangle's patch.
#[derive(Debug, Clone, Copy)]
struct Patch {
    vertex: [Vec3; 3],
    normal: [Vec3; 3],
    /// c₀₁, c₁₂, c₂₀.
    correction: [Vec3; 3],
    neighbour: [u32; 3],
}

/// The smooth wall.
#[derive(Debug, Clone)]
pub struct SmoothWall {
    patches: Vec<Patch>,
}

/// Derivatives of G at one y.
struct Local {
    point: Vec3,
    /// G_λ₁, G_λ₂, G_s.
    first: [Vec3; 3],
    normal: Vec3,
    normal_rates: [Vec3; 2],
}

impl Patch {
    fn local(&self, y: &[f64; 3]) -> Local {
        let [a, b, s] = *y;
        let l = 1.0 - a - b;
        let [v0, v1, v2] = self.vertex;
        let [c01, c12, c20] = self.correction;
        let normal_rates = [self.normal[1] - self.normal[0], self.normal[2] - self.normal[0]];
        let normal = self.normal[0] + normal_rates[0] * a + normal_rates[1] * b;
        let q = v0 * l + v1 * a + v2 * b - c01 * (l * a) - c12 * (a * b) - c20 * (b * l);
        let qa = (v1 - v0) - c01 * (l - a) - c12 * b + c20 * b;
        let qb = (v2 - v0) + c01 * a - c12 * a - c20 * (l - b);
        Local {
            point: q + normal * s,
            first: [qa + normal_rates[0] * s, qb + normal_rates[1] * s, normal],
            normal,
            normal_rates,
        }
    }
}

/// Rows of the inverse of the matrix with these columns; `None` where it is singular or nearly so.
fn inverse_rows(columns: &[Vec3; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = columns;
    let bc = b.cross(c);
    let det = a.dot(&bc);
    if !(det.abs() > 1e-12 * a.norm() * b.norm() * c.norm()) {
        return None;
    }
    let inv = 1.0 / det;
    Some([bc * inv, c.cross(a) * inv, a.cross(b) * inv])
}

impl SmoothWall {
    /// The smooth surface through the vertices of `wall`.
    pub fn new(wall: &Wall) -> Self {
        let mesh = wall.mesh();
        let mut normals = vec![Vec3::zeros(); mesh.vertices_mm.len()];
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corner = mesh.corners(index);
            let outward = (corner[1] - corner[0]).cross(&(corner[2] - corner[0]));
            let Some(unit) = outward.try_normalize(0.0) else { continue };
            for k in 0..3 {
                let (e, f) = (corner[(k + 1) % 3] - corner[k], corner[(k + 2) % 3] - corner[k]);
                let angle = e.cross(&f).norm().atan2(e.dot(&f));
                normals[triangle[k] as usize] -= unit * angle;
            }
        }
        for normal in &mut normals {
            *normal = normal.try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
        }
        let neighbours = wall.neighbours();
        let patches = (0..mesh.triangles.len())
            .map(|index| {
                let vertex = mesh.corners(index);
                let normal = mesh.triangles[index].map(|v| normals[v as usize]);
                let correction =
                    [0, 1, 2].map(|k| correction(&vertex[k], &vertex[(k + 1) % 3], &normal[k], &normal[(k + 1) % 3]));
                Patch { vertex, normal, correction, neighbour: neighbours[index] }
            })
            .collect();
        Self { patches }
    }

    /// A foot to start walking from: the point `x` over the plane of `triangle`.
    pub fn start(&self, x: &Vec3, triangle: u32) -> Foot {
        let [v0, v1, v2] = self.patches[triangle as usize].vertex;
        let (e, f, w) = (v1 - v0, v2 - v0, x - v0);
        let n = e.cross(&f);
        let square = n.norm_squared().max(f64::MIN_POSITIVE);
        let a = w.cross(&f).dot(&n) / square;
        let b = e.cross(&w).dot(&n) / square;
        // Triangles are counter-clockwise from outside, heights count into the lumen.
        Foot { triangle, coordinates: [a.clamp(0.0, 1.0), b.clamp(0.0, 1.0), -w.dot(&n) / square.sqrt()] }
    }

    /// Walks `foot` to where `x` stands now. `None` where there is no foot: past a rim, or where the wall is too rough
    /// for its normals; the flat distance is right there.
    pub fn walk(&self, x: &Vec3, foot: &Foot) -> Option<Foot> {
        let mut foot = *foot;
        for _ in 0..LONGEST_WALK {
            let patch = &self.patches[foot.triangle as usize];
            let y = solve(patch, x, foot.coordinates)?;
            let l = [1.0 - y[0] - y[1], y[0], y[1]];
            // The edge opposite to the most negative coordinate is the one to cross.
            let least = (0..3).min_by(|i, j| l[*i].total_cmp(&l[*j]))?;
            if l[least] >= -EDGE_SLACK {
                return Some(Foot { triangle: foot.triangle, coordinates: y });
            }
            let next = patch.neighbour[(least + 1) % 3];
            if next == NO_NEIGHBOUR {
                return None;
            }
            foot = Foot { coordinates: [1.0 / 3.0, 1.0 / 3.0, y[2]], triangle: next };
        }
        None
    }

    /// The distance of the point whose foot is `foot`, with derivatives.
    pub fn distance(&self, foot: &Foot) -> Option<Distance> {
        let patch = &self.patches[foot.triangle as usize];
        let local = patch.local(&foot.coordinates);
        let r = inverse_rows(&local.first)?;
        let size = local.normal.norm();
        let normal = local.normal / size;
        let mut rate = Matrix3::zeros();
        for k in 0..2 {
            let across = local.normal_rates[k] - normal * normal.dot(&local.normal_rates[k]);
            rate += across * (r[k] / size).transpose();
        }
        let curvature = (rate + rate.transpose()) * 0.5;
        Some(Distance { value_mm: foot.coordinates[2] * size, normal, curvature })
    }
}

/// Newton's method for x = q(λ) + s M(λ) in one patch, from `y`.
fn solve(patch: &Patch, x: &Vec3, mut y: [f64; 3]) -> Option<[f64; 3]> {
    let scale = (patch.vertex[1] - patch.vertex[0]).norm();
    for _ in 0..ITERATIONS {
        let local = patch.local(&y);
        let r = inverse_rows(&local.first)?;
        let miss = x - local.point;
        let step = [r[0].dot(&miss), r[1].dot(&miss), r[2].dot(&miss)];
        y = [y[0] + step[0], y[1] + step[1], y[2] + step[2]];
        // A foot far outside lies in another triangle, and the patch means nothing there.
        if !(y[0].abs() < 4.0 && y[1].abs() < 4.0) {
            return y.iter().all(|v| v.is_finite()).then(|| [y[0].clamp(-2.0, 3.0), y[1].clamp(-2.0, 3.0), y[2]]);
        }
        if miss.norm_squared() < (1e-14 * scale).powi(2) || step[0].abs() + step[1].abs() < 1e-13 {
            return Some(y);
        }
    }
    Some(y)
}

/// The bend of an edge between vertices with unit normals: zero where both normals are across the edge.
fn correction(v0: &Vec3, v1: &Vec3, n0: &Vec3, n1: &Vec3) -> Vec3 {
    let edge = v1 - v0;
    let Some(mean) = (n0 + n1).try_normalize(1e-6) else { return Vec3::zeros() };
    let along = mean.dot(n0);
    if along < 0.5 {
        return Vec3::zeros();
    }
    // The curve v(t) = v₀ + t e − t(1−t) c leaves each end across that end's normal, on the average of both.
    let size = 0.5 * (n0 - n1).dot(&edge) / along;
    mean * size.clamp(-LARGEST_CORRECTION * edge.norm(), LARGEST_CORRECTION * edge.norm())
}
