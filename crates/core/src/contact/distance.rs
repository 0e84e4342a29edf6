//! A smooth signed distance to a triangulated wall.
//!
//! The distance to flat triangles is not smooth where a device leans: inside a tube the closest triangle jumps at every
//! bisector of two facets, the force's direction with it, and Newton's method chatters; and the flat wall stands off the
//! vessel it samples by edge²/8R. Here every vertex carries a quadric fitted to its neighbours, and the quadrics are
//! blended by a partition of unity (Ohtake et al., *Multi-level partition of unity implicits*, SIGGRAPH 2003):
//!
//! ```text
//! y = x − Vᵢ,  h = Nᵢ·y,  τ = y − Nᵢh                height and offset
//! σ = (I − hSᵢ)⁻¹ τ                                   foot of x, seen from Vᵢ along the surface
//! Qᵢ(x) = h − ½ τᵀSᵢσ
//! wᵢ(x) = (1 − |σ|²/ρᵢ²)³   where positive
//! f(x)  = Σ wᵢQᵢ / Σ wᵢ
//! ```
//!
//! with Nᵢ the inward normal, Sᵢ the curvature and ρᵢ a little more than the longest edge at the vertex. Feet, not offsets,
//! say which vertices are near: at height h in a tube of radius R offsets shrink by 1 − h/R, and a device that nearly fills
//! the tube would blend walls all around it (its play came out too large by a tenth of the radius). f is twice
//! continuously differentiable, so a device feels an energy with an exact gradient and Hessian; it differs from the distance
//! to the sampled surface at second order in the edge length, by a tenth of what the flat triangles do. With W = Σ wᵢ,
//!
//! ```text
//! ∇f  = Σ [(Qᵢ − f) ∇wᵢ + wᵢ ∇Qᵢ] / W
//! ∇∇f = Σ [(Qᵢ − f) ∇∇wᵢ + ∇wᵢ(∇Qᵢ − ∇f)ᵀ + (∇Qᵢ − ∇f)∇wᵢᵀ + wᵢ ∇∇Qᵢ] / W
//! ```

use std::collections::VecDeque;

use nalgebra::{Matrix3, SMatrix, SVector};

use crate::Vec3;
use crate::vessel::Wall;

/// Support of a vertex over its longest edge: every point of a triangle lies well inside that of its three corners.
const SUPPORT: f64 = 1.1;
/// Largest curvature times support: beyond it a corner is a corner, and a quadric would fold over.
const LARGEST_BEND: f64 = 0.8;
/// Height times curvature is taken as it is up to this, …
const STEEP: f64 = 0.7;
/// … and beyond levels off within this, so that feet stay finite at the centre of curvature.
const LEVEL: f64 = 0.4;
/// Weight that holds the fit of a vertex with few neighbours: 1e-6 of what a neighbour one edge away contributes.
const REGULAR: f64 = 1e-6;

/// Signed distance with derivatives; positive in the lumen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance, mm.
    pub value_mm: f64,
    /// Its gradient: into the lumen, of nearly unit length.
    pub gradient: Vec3,
    /// Its Hessian, 1/mm.
    pub hessian: Matrix3<f64>,
}

/// The quadric of one vertex.
#[derive(Debug, Clone, Copy)]
struct Quadric {
    position: Vec3,
    normal: Vec3,
    /// Principal directions, across the normal.
    axes: [Vec3; 2],
    /// Curvatures along them, 1/mm; positive where the wall bends around the lumen.
    curvature: [f64; 2],
    /// 1/ρ².
    inverse_square: f64,
}

/// The smooth wall.
#[derive(Debug, Clone)]
pub struct SmoothWall {
    quadrics: Vec<Quadric>,
    /// For every triangle, where its list of vertices begins.
    starts: Vec<u32>,
    /// Vertices whose support may reach a point over the triangle.
    lists: Vec<u32>,
}

impl SmoothWall {
    /// The smooth surface of `wall` for points up to about `height_mm` from it.
    pub fn new(wall: &Wall, height_mm: f64) -> Self {
        let mesh = wall.mesh();
        let count = mesh.vertices_mm.len();
        let neighbours = vertex_neighbours(&mesh.triangles, count);
        let normals = vertex_normals(mesh);
        let quadrics: Vec<Quadric> =
            (0..count).map(|v| fit(v, &mesh.vertices_mm, &normals, &neighbours)).collect();

        let mut starts = Vec::with_capacity(mesh.triangles.len() + 1);
        let mut lists = Vec::new();
        let mut seen = vec![u32::MAX; count];
        let mut queue = VecDeque::new();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            starts.push(lists.len() as u32);
            let corners = mesh.corners(index);
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let size = corners.iter().map(|c| (c - centre).norm()).fold(0.0, f64::max);
            queue.extend(triangle.iter().copied());
            triangle.iter().for_each(|&v| seen[v as usize] = index as u32);
            // Over the surface, not through space: the other side of a thin septum is another wall.
            while let Some(v) = queue.pop_front() {
                let q = &quadrics[v as usize];
                let reach = q.inverse_square.sqrt().recip() + size + height_mm;
                if (q.position - centre).norm() > reach {
                    continue;
                }
                lists.push(v);
                for &w in &neighbours[v as usize] {
                    if seen[w as usize] != index as u32 {
                        seen[w as usize] = index as u32;
                        queue.push_back(w);
                    }
                }
            }
        }
        starts.push(lists.len() as u32);
        Self { quadrics, starts, lists }
    }

    /// The distance of `x`, whose nearest triangle is `triangle` or close to it. `None` where no vertex reaches.
    pub fn distance(&self, x: &Vec3, triangle: u32) -> Option<Distance> {
        let t = triangle as usize;
        let list = &self.lists[self.starts[t] as usize..self.starts[t + 1] as usize];
        let (mut weight, mut value) = (0.0, 0.0);
        let (mut weight1, mut value1) = (Vec3::zeros(), Vec3::zeros());
        let (mut weight2, mut value2) = (Matrix3::zeros(), Matrix3::zeros());
        for &v in list {
            let q = &self.quadrics[v as usize];
            let y = x - q.position;
            let height = q.normal.dot(&y);
            // The least that feet can be nearer than offsets: most vertices are too far, and this is soon said.
            let nearer = 1.0 - (height * q.curvature[0]).min(height * q.curvature[1]).min(0.0);
            if (y.norm_squared() - height * height) * q.inverse_square >= nearer * nearer {
                continue;
            }
            // Along the principal directions feet are offsets times a = 1/(1 − hκ).
            let tau = [q.axes[0].dot(&y), q.axes[1].dot(&y)];
            let a = q.curvature.map(|k| Spread::at(height, k));
            let sigma = [a[0].value * tau[0], a[1].value * tau[1]];
            let u = (sigma[0] * sigma[0] + sigma[1] * sigma[1]) * q.inverse_square;
            if u >= 1.0 {
                continue;
            }
            let g = 1.0 - u;
            let w = g * g * g;
            // w′(u) = −3g², w″(u) = 6g.
            let (down, curve) =
                (-3.0 * g * g * q.inverse_square, 6.0 * g * q.inverse_square * q.inverse_square);
            let mut f = height;
            // Derivatives along the two directions and the normal: of Q, of |σ|², and second ones.
            let (mut f1, mut s1) = (Vec3::z(), Vec3::zeros());
            let (mut f2, mut s2) = (Matrix3::zeros(), Matrix3::zeros());
            for i in 0..2 {
                let (t, k, Spread { value, first, second }) = (tau[i], q.curvature[i], a[i]);
                f -= 0.5 * k * value * t * t;
                f1[i] = -k * value * t;
                f1[2] -= 0.5 * k * first * t * t;
                f2[(i, i)] = -k * value;
                f2[(i, 2)] = -k * first * t;
                f2[(2, 2)] -= 0.5 * k * second * t * t;
                s1[i] = 2.0 * value * value * t;
                s1[2] += 2.0 * value * first * t * t;
                s2[(i, i)] = 2.0 * value * value;
                s2[(i, 2)] = 4.0 * value * first * t;
                s2[(2, 2)] += 2.0 * (first * first + value * second) * t * t;
            }
            for second in [&mut f2, &mut s2] {
                (second[(2, 0)], second[(2, 1)]) = (second[(0, 2)], second[(1, 2)]);
            }
            let w1 = s1 * down;
            let w2 = s2 * down + s1 * s1.transpose() * curve;
            let mixed = w1 * f1.transpose();
            let both = w2 * f + mixed + mixed.transpose() + f2 * w;
            let frame = Matrix3::from_columns(&[q.axes[0], q.axes[1], q.normal]);
            weight += w;
            weight1 += frame * w1;
            weight2 += frame * w2 * frame.transpose();
            value += w * f;
            value1 += frame * (w1 * f + f1 * w);
            value2 += frame * both * frame.transpose();
        }
        if weight < 1e-9 {
            return None;
        }
        let inv = 1.0 / weight;
        let f = value * inv;
        let gradient = (value1 - weight1 * f) * inv;
        let mixed = weight1 * gradient.transpose();
        let hessian = (value2 - weight2 * f - mixed - mixed.transpose()) * inv;
        Some(Distance { value_mm: f, gradient, hessian })
    }
}

/// 1/(1 − hκ), by which feet are farther than offsets, with its derivatives in h. It levels off before hκ comes to 1.
#[derive(Debug, Clone, Copy)]
struct Spread {
    value: f64,
    first: f64,
    second: f64,
}

impl Spread {
    fn at(height: f64, curvature: f64) -> Self {
        let t = height * curvature;
        let x = ((t - STEEP) / LEVEL).clamp(0.0, 1.0);
        // Slope 1 − 3x² + 2x³ where it levels off.
        let s = if t <= STEEP { t } else { STEEP + LEVEL * (x - x * x * x + 0.5 * x * x * x * x) };
        let slope = (1.0 - 3.0 * x * x + 2.0 * x * x * x) * curvature;
        let bend = 6.0 * (x * x - x) / LEVEL * curvature * curvature;
        let value = 1.0 / (1.0 - s);
        let square = value * value;
        Self { value, first: square * slope, second: square * (2.0 * value * slope * slope + bend) }
    }
}

/// Vertices that share an edge with each vertex, ascending.
fn vertex_neighbours(triangles: &[[u32; 3]], count: usize) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); count];
    for t in triangles {
        for k in 0..3 {
            neighbours[t[k] as usize].extend([t[(k + 1) % 3], t[(k + 2) % 3]]);
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}

/// Angle-weighted inward normals.
fn vertex_normals(mesh: &crate::vessel::SurfaceMesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); mesh.vertices_mm.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let corner = mesh.corners(index);
        let Some(outward) = (corner[1] - corner[0]).cross(&(corner[2] - corner[0])).try_normalize(0.0) else {
            continue;
        };
        for k in 0..3 {
            let (e, f) = (corner[(k + 1) % 3] - corner[k], corner[(k + 2) % 3] - corner[k]);
            normals[triangle[k] as usize] -= outward * e.cross(&f).norm().atan2(e.dot(&f));
        }
    }
    for normal in &mut normals {
        *normal = normal.try_normalize(1e-12).unwrap_or_else(Vec3::x);
    }
    normals
}

/// The quadric of vertex `v`: heights of its neighbours and theirs, g·τ + ½ τᵀSτ in its tangent plane, least squares.
fn fit(v: usize, vertices: &[Vec3], normals: &[Vec3], neighbours: &[Vec<u32>]) -> Quadric {
    let (origin, normal) = (vertices[v], normals[v]);
    let longest = neighbours[v].iter().map(|&w| (vertices[w as usize] - origin).norm()).fold(0.0, f64::max);
    let rho = SUPPORT * longest.max(1e-12);
    let mut ring: Vec<u32> = neighbours[v].clone();
    for &w in &neighbours[v] {
        ring.extend(neighbours[w as usize].iter().copied());
    }
    ring.sort_unstable();
    ring.dedup();
    let a = {
        let axis = Vec3::ith(normal.iamin(), 1.0);
        (axis - normal * normal.dot(&axis)).normalize()
    };
    let b = normal.cross(&a);
    let mut matrix = SMatrix::<f64, 5, 5>::identity() * REGULAR;
    let mut right = SVector::<f64, 5>::zeros();
    for &w in &ring {
        // Beyond a crease or far away there is another surface.
        if w as usize == v || normals[w as usize].dot(&normal) < 0.3 {
            continue;
        }
        let y = (vertices[w as usize] - origin) / longest;
        let (p, q, h) = (y.dot(&a), y.dot(&b), y.dot(&normal));
        let row = SVector::<f64, 5>::new(p, q, 0.5 * p * p, p * q, 0.5 * q * q);
        let weight = 1.0 / (1.0 + y.norm_squared());
        matrix += row * row.transpose() * weight;
        right += row * (h * weight);
    }
    let found = matrix.cholesky().map_or_else(SVector::zeros, |c| c.solve(&right));
    // A fit that leans over is none; neither is one that is not a number.
    if found[0].hypot(found[1]).max(0.5) != 0.5 || found[0].is_nan() {
        return Quadric {
            position: origin,
            normal,
            axes: [a, b],
            curvature: [0.0; 2],
            inverse_square: rho.powi(-2),
        };
    }
    // The plane of the fit, and the curvature seen from it.
    let tilted = (normal - a * found[0] - b * found[1]).normalize();
    let p = (a - tilted * tilted.dot(&a)).normalize();
    let q = tilted.cross(&p);
    let (saa, sab, sbb) = (found[2] / longest, found[3] / longest, found[4] / longest);
    let bend = |v: &Vec3, w: &Vec3| {
        let ([va, vb], [wa, wb]) = ([v.dot(&a), v.dot(&b)], [w.dot(&a), w.dot(&b)]);
        va * wa * saa + (va * wb + vb * wa) * sab + vb * wb * sbb
    };
    let (spp, spq, sqq) = (bend(&p, &p), bend(&p, &q), bend(&q, &q));
    let (mean, half) = (0.5 * (spp + sqq), 0.5 * (spp - sqq));
    let radius = half.hypot(spq);
    let (sin, cos) = (0.5 * spq.atan2(half)).sin_cos();
    let scale = (LARGEST_BEND / rho / (mean.abs() + radius).max(1e-300)).min(1.0);
    Quadric {
        position: origin,
        normal: tilted,
        axes: [p * cos + q * sin, q * cos - p * sin],
        curvature: [(mean + radius) * scale, (mean - radius) * scale],
        inverse_square: rho.powi(-2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{GeneratedWall, Resolution, WallQuery, anatomy};

    /// A tube of radius 4 mm about the z axis.
    fn tube(edge_mm: f64) -> (SmoothWall, WallQuery) {
        let wall = GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(edge_mm))
            .unwrap()
            .wall;
        (SmoothWall::new(&wall, 4.0), WallQuery::new(&wall).unwrap())
    }

    fn at(wall: &(SmoothWall, WallQuery), x: &Vec3) -> Distance {
        wall.0.distance(x, wall.1.nearest(x, 10.0).unwrap().triangle).unwrap()
    }

    /// Points of all heights from the wall to near the axis.
    fn points() -> impl Iterator<Item = Vec3> {
        (0..200).map(|i| {
            let (angle, r) = (2.399 * f64::from(i), 2.1 + 1.8 * (f64::from(i) * 0.37).sin());
            Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i))
        })
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        let wall = tube(1.0);
        let h = 1e-5;
        for x in points() {
            let here = at(&wall, &x);
            for k in 0..3 {
                let e = Vec3::ith(k, h);
                let (plus, minus) = (at(&wall, &(x + e)), at(&wall, &(x - e)));
                assert!(((plus.value_mm - minus.value_mm) / (2.0 * h) - here.gradient[k]).abs() < 1e-8);
                let column = (plus.gradient - minus.gradient) / (2.0 * h);
                assert!((column - here.hessian.column(k)).norm() < 1e-5, "column {k}");
            }
        }
    }

    /// Largest error of the distance from the wall of the tube at a height over its radius.
    fn error(wall: &(SmoothWall, WallQuery), height: f64) -> f64 {
        let off = |i: i32| {
            let (angle, r) = (2.399 * f64::from(i), 4.0 * (1.0 - height));
            let x = Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i));
            (at(wall, &x).value_mm - 4.0 * height).abs()
        };
        (0..200).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn a_tube_is_met_far_better_than_by_its_triangles() {
        let (coarse, fine) = (error(&tube(1.0), 0.1), error(&tube(0.5), 0.1));
        assert!(coarse / fine > 8.0, "{coarse:e} {fine:e}");
        // The flat triangles stand off by edge²/8R.
        assert!(fine < 0.5 * 0.5 / (8.0 * 4.0) / 60.0, "{fine:e}");
    }

    #[test]
    fn a_device_that_nearly_fills_the_tube_is_met_as_well() {
        let wall = tube(0.5);
        let thin = error(&wall, 0.1);
        for height in [0.5, 0.7, 0.8] {
            let close = error(&wall, height);
            assert!(close < 1.1 * thin, "{height}: {close:e}, thin {thin:e}");
        }
        assert!(error(&wall, 0.9) < 2.0 * 1e-4 && error(&wall, 0.95) < 1e-3);
    }

    #[test]
    fn the_value_does_not_depend_on_the_triangle_it_is_asked_from() {
        let (smooth, query) = tube(1.0);
        for x in points() {
            let here = smooth.distance(&x, query.nearest(&x, 10.0).unwrap().triangle).unwrap();
            let aside = Vec3::new(-x.y, x.x, 1.2) * 0.06;
            let there = smooth.distance(&x, query.nearest(&(x + aside), 10.0).unwrap().triangle).unwrap();
            assert_eq!(here.value_mm.to_bits() >> 8, there.value_mm.to_bits() >> 8);
        }
    }
}
