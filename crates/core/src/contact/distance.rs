//! A smooth signed distance to a triangulated wall.
//!
//! The distance to flat triangles is not smooth where a device leans: inside a tube the closest triangle jumps at every
//! bisector of two facets, the force's direction with it, and Newton's method chatters; and the flat wall stands off the
//! vessel it samples by edge²/8R. Here every vertex carries a quadric fitted to its neighbours, and the quadrics are
//! blended by a partition of unity (Ohtake et al., *Multi-level partition of unity implicits*, SIGGRAPH 2003):
//!
//! ```text
//! y = x − Vᵢ,  h = Nᵢ·y − cᵢ,  τ = y − Nᵢ(Nᵢ·y)      height and offset
//! σ = (I − hSᵢ)⁻¹ τ                                   foot of x, seen from Vᵢ along the surface
//! Qᵢ(x) = h − ½ τᵀSᵢσ
//! wᵢ(x) = (1 − σᵀMᵢσ)³ b(Qᵢ)   where positive
//! f(x)  = Σ wᵢQᵢ / Σ wᵢ
//! ```
//!
//! with Nᵢ the inward normal, Sᵢ the curvature and Mᵢ an ellipse that holds the neighbours of the vertex. The window b, 1 for
//! small |Qᵢ| and 0 far away, leaves out the other side of a narrow lumen and the back of a thin septum. Feet, not offsets,
//! say which vertices are near: at height h in a tube of radius R offsets shrink by 1 − h/R, and a device that nearly fills the
//! tube would blend walls all around it, and find a play too large by a tenth of the radius. f is twice continuously
//! differentiable, so a device feels an energy with an exact gradient and Hessian; from the distance to the sampled surface it
//! differs at fourth order in the edge length, on a tube with 50 edges around by a hundredth of what the flat triangles do.
//!
//! Vertices sample a vessel, and between them the smooth wall lies beyond the triangles. Where a mesh is so coarse that it
//! would do so by more than a device keeps from the wall, the offsets cᵢ draw it in; on all other meshes they are 0.
//!
//! With W = Σ wᵢ,
//!
//! ```text
//! ∇f  = Σ [(Qᵢ − f) ∇wᵢ + wᵢ ∇Qᵢ] / W
//! ∇∇f = Σ [(Qᵢ − f) ∇∇wᵢ + ∇wᵢ(∇Qᵢ − ∇f)ᵀ + (∇Qᵢ − ∇f)∇wᵢᵀ + wᵢ ∇∇Qᵢ] / W
//! ```

use std::collections::VecDeque;

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};

use crate::Vec3;
use crate::vessel::{SurfaceMesh, Wall};

/// Support of a vertex over its edges: every point of a triangle lies well inside that of its three corners.
const SUPPORT: f64 = 1.1;
/// Largest curvature times support: beyond it a corner is a corner, and a quadric would fold over.
const LARGEST_BEND: f64 = 0.8;
/// Height times curvature is taken as it is up to this, …
const STEEP: f64 = 0.7;
/// … and beyond levels off within this, so that feet stay finite at the centre of curvature.
const LEVEL: f64 = 0.4;
/// Square of the thinnest ellipse's ratio of axes, about.
const THINNEST: f64 = 0.01;
/// Weight that holds the fit of a vertex with few neighbours: 1e-6 of what a neighbour one edge away contributes.
const REGULAR: f64 = 1e-6;
/// Sum of weights below which no vertex reaches a point.
const LEAST_WEIGHT: f64 = 1e-9;
/// Height above the surface up to which the lists of vertices are complete, in radii of the thickest device and in supports.
const HEIGHT: (f64, f64) = (1.5, 0.5);

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
    /// S along them, 1/mm; positive where the wall bends around the lumen.
    curvature: [f64; 2],
    /// M in them, 1/mm².
    support: Matrix2<f64>,
    /// Half axes of the support, shortest and longest, mm.
    half_axes_mm: (f64, f64),
    /// cᵢ, mm.
    offset_mm: f64,
    /// The window falls from 1 at the first to 0 at the second, above and below the surface, mm.
    above_mm: (f64, f64),
    below_mm: (f64, f64),
}

/// Window over the radius of the device, and over the support of a vertex: what a fit may be off by on a coarse mesh.
const WINDOW: (f64, f64) = (1.25, 0.3);
/// In heights of the window: it falls from 1 at the first to 0 at the second, above and below the surface.
const ABOVE: (f64, f64) = (1.0, 1.8);
const BELOW: (f64, f64) = (-0.3, -0.8);
/// In heights of the window: a wall that is farther than another by this much counts e times less. In a lumen narrower than
/// the device both sides are near, and their mean would hold nothing.
const NEARER: f64 = 0.3;
/// Beyond its centre of curvature a vertex is not the nearest: there, or this far above the thickest device in radii, its window
/// begins to fall, …
const CENTRE: f64 = 1.05;
/// … and is closed at this many times that height.
const BEYOND_CENTRE: f64 = 1.15;
/// The smooth wall lies no farther than this part of the thinnest device's radius beyond a triangle: the barrier of
/// [`crate::contact::WallPotential`] stands at three tenths.
const BEYOND: f64 = 0.2;
/// Intervals along each side of a triangle at whose ends that is checked, …
const CHECKED: u32 = 4;
/// … unless few points differ by less than this part of what is allowed.
const ENOUGH: f64 = 0.25;

/// A window and its derivatives: 1 up to `from`, 0 from `to` on, in between 1 − t³(10 − 15t + 6t²).
#[inline]
fn fall(at: f64, from: f64, to: f64) -> [f64; 3] {
    let inverse = 1.0 / (to - from);
    let t = (at - from) * inverse;
    if t <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if t >= 1.0 {
        return [0.0; 3];
    }
    let (s, tt) = (1.0 - t, t * t);
    [
        1.0 - tt * t * (10.0 + t * (6.0 * t - 15.0)),
        -30.0 * tt * s * s * inverse,
        -60.0 * t * s * (s - t) * inverse * inverse,
    ]
}

/// 1/(1 − hκ), by which feet are farther than offsets, with its derivatives in h. It levels off before hκ comes to 1.
#[derive(Debug, Clone, Copy)]
struct Spread {
    value: f64,
    first: f64,
    second: f64,
}

impl Spread {
    #[inline]
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

/// A point seen from a vertex, along its principal directions.
struct Local {
    tau: Vector2<f64>,
    spread: [Spread; 2],
    /// Mσ.
    across: Vector2<f64>,
    /// u = σᵀMσ.
    u: f64,
    /// Q.
    value: f64,
}

impl Quadric {
    /// What is seen of `x`; `None` beyond the support.
    #[inline]
    fn local(&self, x: &Vec3) -> Option<Local> {
        let y = x - self.position;
        let rise = self.normal.dot(&y);
        let height = rise - self.offset_mm;
        let [k, l] = self.curvature;
        // The least that feet can be nearer than offsets: most vertices are too far, and this is soon said.
        let nearer = (1.0 - (height * k).min(height * l).min(0.0)) * self.half_axes_mm.1;
        if y.norm_squared() - rise * rise >= nearer * nearer {
            return None;
        }
        let tau = Vector2::new(self.axes[0].dot(&y), self.axes[1].dot(&y));
        let spread = [Spread::at(height, k), Spread::at(height, l)];
        let sigma = Vector2::new(spread[0].value * tau.x, spread[1].value * tau.y);
        let across = self.support * sigma;
        let u = sigma.dot(&across);
        let value = height - 0.5 * (k * sigma.x * tau.x + l * sigma.y * tau.y);
        (u < 1.0).then_some(Local { tau, spread, across, u, value })
    }

    /// Derivatives of Q and of u along the principal directions and the normal.
    #[inline]
    fn derivatives(&self, local: &Local) -> [(Vec3, Matrix3<f64>); 2] {
        let Local { tau, spread, across, .. } = local;
        let (mut f1, mut u1) = (Vec3::z(), Vec3::zeros());
        let (mut f2, mut u2) = (Matrix3::zeros(), Matrix3::zeros());
        for i in 0..2 {
            let (t, k, v, Spread { value, first, second }) =
                (tau[i], self.curvature[i], across[i], spread[i]);
            f1[i] = -k * value * t;
            f1[2] -= 0.5 * k * first * t * t;
            f2[(i, i)] = -k * value;
            f2[(i, 2)] = -k * first * t;
            f2[(2, 2)] -= 0.5 * k * second * t * t;
            u1[i] = 2.0 * value * v;
            u1[2] += 2.0 * first * t * v;
            u2[(i, 2)] = 2.0 * first * v;
            u2[(2, 2)] += 2.0 * second * t * v;
            for j in 0..2 {
                let m = 2.0 * self.support[(i, j)];
                let other = spread[j].first * tau[j];
                u2[(i, j)] = m * value * spread[j].value;
                u2[(i, 2)] += m * value * other;
                u2[(2, 2)] += m * first * t * other;
            }
        }
        for second in [&mut f2, &mut u2] {
            (second[(2, 0)], second[(2, 1)]) = (second[(0, 2)], second[(1, 2)]);
        }
        [(f1, f2), (u1, u2)]
    }

    /// b(Q) and its derivatives.
    #[inline]
    fn window(&self, value: f64) -> [f64; 3] {
        let (from, to) = if value > 0.0 { self.above_mm } else { self.below_mm };
        let [b, b1, b2] = fall(value, from, to);
        if b == 0.0 {
            return [0.0; 3];
        }
        let rate = BELOW.0 / (NEARER * self.below_mm.0);
        let e = (-rate * value).exp();
        [b * e, (b1 - rate * b) * e, (b2 - 2.0 * rate * b1 + rate * rate * b) * e]
    }
}

/// The smooth wall.
#[derive(Debug, Clone)]
pub struct SmoothWall {
    quadrics: Vec<Quadric>,
    /// For every triangle, where its list of vertices begins.
    starts: Vec<u32>,
    /// Vertices whose support may reach a point over the triangle.
    lists: Vec<u32>,
    /// How far the smooth wall lies inside each triangle, mm, …
    insets_mm: Vec<f32>,
    /// … and the largest of these.
    deepest_inset_mm: f64,
}

impl SmoothWall {
    /// The smooth surface of `wall` for devices with radii from `thinnest_mm` to `thickest_mm`.
    pub fn new(wall: &Wall, thinnest_mm: f64, thickest_mm: f64) -> Self {
        let mesh = wall.mesh();
        let count = mesh.vertices_mm.len();
        let neighbours = vertex_neighbours(&mesh.triangles, count);
        let normals = vertex_normals(mesh);
        let mut quadrics: Vec<Quadric> =
            (0..count).map(|v| fit(v, &mesh.vertices_mm, &normals, &neighbours)).collect();
        for q in &mut quadrics {
            let size = (WINDOW.0 * thickest_mm).max(WINDOW.1 * q.half_axes_mm.0);
            // The first curvature is the larger one.
            let centre = if q.curvature[0] > 0.0 {
                (CENTRE * thickest_mm).max(q.curvature[0].recip())
            } else {
                f64::MAX
            };
            q.above_mm = ((ABOVE.0 * size).min(centre), (ABOVE.1 * size).min(BEYOND_CENTRE * centre));
            q.below_mm = (BELOW.0 * size, BELOW.1 * size);
        }

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
                let (short, long) = q.half_axes_mm;
                let reach = long + size + (HEIGHT.0 * thickest_mm).max(HEIGHT.1 * short);
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
        let mut smooth = Self { quadrics, starts, lists, insets_mm: Vec::new(), deepest_inset_mm: 0.0 };
        smooth.draw_in(mesh, BEYOND * thinnest_mm);
        smooth
    }

    /// Least and largest f on a triangle of the mesh, at few points if they differ by less than `enough_mm`, or at all of a
    /// grid.
    fn range(&self, mesh: &SurfaceMesh, index: usize, enough_mm: f64) -> (f64, f64) {
        let corners = mesh.corners(index);
        let list = self.list(index);
        let look = |(least, largest): (f64, f64), x: Vec3| {
            let f = self.value(&x, list).unwrap_or(0.0);
            (least.min(f), largest.max(f))
        };
        let found = few(&corners).into_iter().fold((f64::MAX, f64::MIN), look);
        if found.1 - found.0 > enough_mm { grid(corners).fold(found, look) } else { found }
    }

    /// Sets the offsets so that f is at most `limit_mm` on the triangles, and measures how far inside them it lies.
    fn draw_in(&mut self, mesh: &SurfaceMesh, limit_mm: f64) {
        let enough_mm = ENOUGH * limit_mm;
        let mut offsets = vec![0.0f64; self.quadrics.len()];
        for index in 0..mesh.triangles.len() {
            let (least, largest) = self.range(mesh, index, enough_mm);
            self.insets_mm.push((-least).max(0.0) as f32);
            if largest <= limit_mm {
                continue;
            }
            for x in grid(mesh.corners(index)) {
                let list = self.list(index);
                let beyond = self.value(&x, list).unwrap_or(0.0) - limit_mm;
                for &v in list.iter().filter(|&&v| self.quadrics[v as usize].local(&x).is_some()) {
                    offsets[v as usize] = offsets[v as usize].max(beyond);
                }
            }
        }
        for (q, offset) in self.quadrics.iter_mut().zip(offsets) {
            q.offset_mm = offset;
        }
        for index in 0..mesh.triangles.len() {
            if self.list(index).iter().any(|&v| self.quadrics[v as usize].offset_mm > 0.0) {
                self.insets_mm[index] = (-self.range(mesh, index, enough_mm).0).max(0.0) as f32;
            }
        }
        self.deepest_inset_mm = self.insets_mm.iter().copied().fold(0.0, f32::max).into();
    }

    /// How far the smooth wall lies inside a triangle, mm: 0 where it lies beyond it.
    pub fn inset_mm(&self, triangle: u32) -> f64 {
        self.insets_mm[triangle as usize].into()
    }

    /// The largest of all [`SmoothWall::inset_mm`].
    pub fn deepest_inset_mm(&self) -> f64 {
        self.deepest_inset_mm
    }

    fn list(&self, triangle: usize) -> &[u32] {
        &self.lists[self.starts[triangle] as usize..self.starts[triangle + 1] as usize]
    }

    /// f alone.
    fn value(&self, x: &Vec3, list: &[u32]) -> Option<f64> {
        let (mut weight, mut value) = (0.0, 0.0);
        for &v in list {
            let q = &self.quadrics[v as usize];
            let Some(local) = q.local(x) else { continue };
            let w = (1.0 - local.u).powi(3) * q.window(local.value)[0];
            weight += w;
            value += w * local.value;
        }
        (weight >= LEAST_WEIGHT).then(|| value / weight)
    }

    /// The distance of `x`, whose nearest triangle is `triangle` or close to it. `None` where no vertex reaches.
    pub fn distance(&self, x: &Vec3, triangle: u32) -> Option<Distance> {
        let (mut weight, mut value) = (0.0, 0.0);
        let (mut weight1, mut value1) = (Vec3::zeros(), Vec3::zeros());
        let (mut weight2, mut value2) = (Matrix3::zeros(), Matrix3::zeros());
        for &v in self.list(triangle as usize) {
            let q = &self.quadrics[v as usize];
            let Some(local) = q.local(x) else { continue };
            let (f, g) = (local.value, 1.0 - local.u);
            let [b, b1, b2] = q.window(f);
            if b == 0.0 {
                continue;
            }
            let [(f1, f2), (u1, u2)] = q.derivatives(&local);
            // a = (1 − u)³ has a′(u) = −3g², a″(u) = 6g.
            let a = g * g * g;
            let a1 = u1 * (-3.0 * g * g);
            let a2 = u1 * u1.transpose() * (6.0 * g) - u2 * (3.0 * g * g);
            let turned = a1 * f1.transpose();
            let w = a * b;
            let w1 = a1 * b + f1 * (a * b1);
            let w2 = a2 * b + (turned + turned.transpose() + f2 * a) * b1 + f1 * f1.transpose() * (a * b2);
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
        if weight < LEAST_WEIGHT {
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

/// The middles of a triangle and its sides.
fn few([a, b, c]: &[Vec3; 3]) -> [Vec3; 4] {
    [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
}

/// Points all over a triangle.
fn grid([a, b, c]: [Vec3; 3]) -> impl Iterator<Item = Vec3> {
    let part = |k: u32| f64::from(k) / f64::from(CHECKED);
    (0..=CHECKED).flat_map(move |i| (0..=CHECKED - i).map(move |j| a + (b - a) * part(i) + (c - a) * part(j)))
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
fn vertex_normals(mesh: &SurfaceMesh) -> Vec<Vec3> {
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

/// The smallest ellipse of its shape that holds points of a plane, as a matrix: Σ y yᵀ gives the shape.
fn ellipse(points: impl Iterator<Item = (f64, f64)> + Clone) -> Matrix2<f64> {
    let mut spread = Matrix2::zeros();
    for (p, q) in points.clone() {
        let y = Vector2::new(p, q);
        spread += y * y.transpose();
    }
    // Neighbours on a line, or none: no needles.
    spread += Matrix2::identity() * (THINNEST * spread.trace()).max(f64::MIN_POSITIVE);
    let shape = spread.try_inverse().unwrap_or_else(Matrix2::identity);
    let farthest =
        points.map(|(p, q)| Vector2::new(p, q).dot(&(shape * Vector2::new(p, q)))).fold(0.0, f64::max);
    shape / farthest.max(f64::MIN_POSITIVE)
}

/// The quadric of vertex `v`: heights of its neighbours and theirs, g·τ + ½ τᵀSτ in its tangent plane, least squares.
fn fit(v: usize, vertices: &[Vec3], normals: &[Vec3], neighbours: &[Vec<u32>]) -> Quadric {
    let (origin, normal) = (vertices[v], normals[v]);
    let a = {
        let axis = Vec3::ith(normal.iamin(), 1.0);
        (axis - normal * normal.dot(&axis)).normalize()
    };
    let b = normal.cross(&a);
    let flat = |w: u32| {
        let y = vertices[w as usize] - origin;
        (y.dot(&a), y.dot(&b), y.dot(&normal))
    };
    let plane = ellipse(neighbours[v].iter().map(|&w| flat(w)).map(|(p, q, _)| (p, q))) / (SUPPORT * SUPPORT);
    let axes = plane.symmetric_eigenvalues();
    let half_axes_mm = (axes.max().sqrt().recip(), axes.min().sqrt().recip());
    let mut ring: Vec<u32> = neighbours[v].clone();
    for &w in &neighbours[v] {
        ring.extend(neighbours[w as usize].iter().copied());
    }
    ring.sort_unstable();
    ring.dedup();
    let long = half_axes_mm.1;
    let mut matrix = SMatrix::<f64, 5, 5>::identity() * REGULAR;
    let mut right = SVector::<f64, 5>::zeros();
    for &w in &ring {
        // Beyond a crease or far away there is another surface.
        if w as usize == v || normals[w as usize].dot(&normal) < 0.3 {
            continue;
        }
        let (p, q, h) = flat(w);
        let weight = 1.0 / (1.0 + Vector2::new(p, q).dot(&(plane * Vector2::new(p, q))));
        let (p, q, h) = (p / long, q / long, h / long);
        let row = SVector::<f64, 5>::new(p, q, 0.5 * p * p, p * q, 0.5 * q * q);
        matrix += row * row.transpose() * weight;
        right += row * (h * weight);
    }
    let found = matrix.cholesky().map_or_else(SVector::zeros, |c| c.solve(&right));
    // A fit that leans over is none; neither is one that is not a number.
    let usable = found[0].hypot(found[1]) <= 0.5;
    let (tilt, bend) = if usable {
        (Vector2::new(found[0], found[1]), Matrix2::new(found[2], found[3], found[3], found[4]) / long)
    } else {
        (Vector2::zeros(), Matrix2::zeros())
    };
    // Sag over the support against its half axes, direction by direction.
    let size = (0..2)
        .map(|i| {
            (0..2)
                .map(|j| (bend[(i, j)] / plane[(i, i)].sqrt().sqrt() / plane[(j, j)].sqrt().sqrt()).abs())
                .sum::<f64>()
        })
        .fold(0.0, f64::max);
    let bend = bend * (LARGEST_BEND / size.max(1e-300)).min(1.0);
    // The plane of the fit, and curvature and support seen from it.
    let normal = (normal - a * tilt.x - b * tilt.y).normalize();
    let seen = |m: &Matrix2<f64>, v: &Vec3, w: &Vec3| {
        let (v, w) = (Vector2::new(v.dot(&a), v.dot(&b)), Vector2::new(w.dot(&a), w.dot(&b)));
        v.dot(&(m * w))
    };
    let p = (a - normal * normal.dot(&a)).normalize();
    let q = normal.cross(&p);
    let (pp, pq, qq) = (seen(&bend, &p, &p), seen(&bend, &p, &q), seen(&bend, &q, &q));
    let (mean, half) = (0.5 * (pp + qq), 0.5 * (pp - qq));
    let apart = half.hypot(pq);
    let (sin, cos) = (0.5 * pq.atan2(half)).sin_cos();
    let axes = [p * cos + q * sin, q * cos - p * sin];
    Quadric {
        position: origin,
        normal,
        curvature: [mean + apart, mean - apart],
        support: Matrix2::from_fn(|i, j| seen(&plane, &axes[i], &axes[j])),
        axes,
        half_axes_mm,
        offset_mm: 0.0,
        above_mm: (0.0, 0.0),
        below_mm: (0.0, 0.0),
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
        (SmoothWall::new(&wall, 0.5, 4.0), WallQuery::new(&wall).unwrap())
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
        assert!(error(&wall, 0.9) < 2e-4 && error(&wall, 0.95) < 1e-3);
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
