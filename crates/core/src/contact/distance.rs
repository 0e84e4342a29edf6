//! A smooth signed distance to a triangulated wall.
//!
//! The distance to flat triangles is not smooth where a device leans: inside a tube the closest triangle jumps at every
//! bisector of two facets, the force's direction with it, and Newton's method chatters; and the flat wall stands off the
//! vessel it samples by edge²/8R. Here every vertex carries a quadric fitted to its neighbours, and the quadrics are
//! blended by a partition of unity (Ohtake et al., *Multi-level partition of unity implicits*, SIGGRAPH 2003):
//!
//! ```text
//! y = x − Vᵢ,  h = Nᵢ·y,  τ = y − Nᵢ(Nᵢ·y)      height and offset
//! σ = (I − hSᵢ)⁻¹ τ                                   foot of x, seen from Vᵢ along the surface
//! Qᵢ(x) = h − ½ τᵀSᵢσ
//! wᵢ(x) = (1 − σᵀMᵢσ)³ b(Qᵢ)   where positive
//! f(x)  = Σ wᵢQᵢ / Σ wᵢ
//! ```
//!
//! with Nᵢ the inward normal, Sᵢ the curvature and Mᵢ an ellipse that holds the neighbours of the vertex. The window b, e^{−Qᵢ/0.3w} for
//! small |Qᵢ| and 0 beyond a width w, leaves out the other side of a narrow lumen and the back of a thin septum; where a device
//! touches two sides at once, the nearer holds it. Feet, not offsets,
//! say which vertices are near: at height h in a tube of radius R offsets shrink by 1 − h/R, and a device that nearly fills the
//! tube would blend walls all around it, and find a play too large by a tenth of the radius. f is twice continuously
//! differentiable, so a device feels an energy with an exact gradient and Hessian; from the distance to the sampled surface it
//! differs at fourth order in the edge length, on a tube with 50 edges around by a hundredth of what the flat triangles do.
//!
//! With W = Σ wᵢ,
//!
//! ```text
//! ∇f  = Σ [(Qᵢ − f) ∇wᵢ + wᵢ ∇Qᵢ] / W
//! ∇∇f = Σ [(Qᵢ − f) ∇∇wᵢ + ∇wᵢ(∇Qᵢ − ∇f)ᵀ + (∇Qᵢ − ∇f)∇wᵢᵀ + wᵢ ∇∇Qᵢ] / W
//! ```

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::Matrix3;

use super::fit::{fit, vertex_neighbours, vertex_normals};
use super::quadric::Quadric;
use crate::vessel::{SurfaceMesh, Wall};
use crate::{Vec3, parallel};

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

impl Distance {
    /// Unit normal of the wall, into the lumen: along the gradient, whose length is not quite 1.
    pub fn normal(&self) -> Vec3 {
        self.gradient / self.gradient.norm()
    }
}

/// How near a point is to a wall that may be out of its reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nearness {
    /// As far as was asked or farther: the distance, mm.
    Beyond(f64),
    /// Nearer.
    Within(Distance),
}

impl Nearness {
    /// The distance, mm.
    pub fn value_mm(&self) -> f64 {
        match self {
            Self::Beyond(value_mm) => *value_mm,
            Self::Within(distance) => distance.value_mm,
        }
    }
}

/// Most vertices that are noted as reaching a point; on any sensible mesh there are about ten.
const NOTED: usize = 32;

/// A point behind the surface that is asked about. How deep it is says the sheet that it has gone through, which faces this way: no
/// window tells it from others, as one does in front.
#[derive(Debug, Clone, Copy)]
struct Behind {
    facing: Vec3,
}

/// Least cosine between the normals of vertices of one sheet.
const FACING: f64 = 0.3;

/// What the vertices that reach a point make of its distance.
struct Reached {
    weight: f64,
    value_mm: f64,
    behind: Option<Behind>,
    /// How many they are; the first of them.
    count: usize,
    vertices: [u32; NOTED],
}

/// The smooth wall.
#[derive(Debug, Clone)]
pub struct SmoothWall {
    quadrics: Vec<Quadric>,
    /// For every vertex, a triangle that it is a corner of.
    triangles: Vec<u32>,
    /// For every triangle, where its list of vertices begins.
    starts: Vec<u32>,
    /// Vertices whose support may reach a point over the triangle.
    lists: Vec<u32>,
    /// How far the smooth wall lies inside each triangle and its neighbours, mm, …
    insets_mm: Vec<f32>,
    /// … and the largest of these.
    deepest_inset_mm: f64,
}

impl SmoothWall {
    /// The smooth surface of `wall` for devices with radii up to `thickest_mm`.
    pub fn new(wall: &Wall, thickest_mm: f64) -> Self {
        let mesh = wall.mesh();
        let count = mesh.vertices_mm.len();
        let neighbours = vertex_neighbours(&mesh.triangles, count);
        let normals = vertex_normals(mesh);
        let fitted = |v: usize| {
            let mut quadric = fit(v, &mesh.vertices_mm, &normals, &neighbours);
            quadric.open_window(thickest_mm);
            quadric
        };
        let quadrics = parallel::map(count, fitted);

        let mut triangles = vec![0; count];
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| triangles[*v as usize] = index as u32);
        }
        let (mut starts, mut lists) = (Vec::with_capacity(mesh.triangles.len() + 1), Vec::new());
        for (ends, list) in parallel::parts(mesh.triangles.len(), |part| {
            listed(mesh, &quadrics, &neighbours, part, thickest_mm)
        }) {
            let first = lists.len() as u32;
            starts.extend(ends.into_iter().map(|start| first + start));
            lists.extend(list);
        }
        starts.push(lists.len() as u32);
        let mut smooth =
            Self { quadrics, triangles, starts, lists, insets_mm: Vec::new(), deepest_inset_mm: 0.0 };
        smooth.measure_insets(mesh);
        smooth
    }

    /// How far the smooth wall lies inside each triangle, at few points, or inside one that shares a corner with it: a point that is
    /// next to one triangle may feel the other.
    fn measure_insets(&mut self, mesh: &SurfaceMesh) {
        let inset = |index: usize| {
            let list = self.list(index);
            let heights = few(&mesh.corners(index)).map(|x| self.reach(&x, list).map_or(0.0, |r| r.value_mm));
            (-heights.into_iter().fold(0.0, f64::min)) as f32
        };
        let own = parallel::map(mesh.triangles.len(), inset);
        let mut around = vec![0.0f32; mesh.vertices_mm.len()];
        for (triangle, inset) in mesh.triangles.iter().zip(&own) {
            triangle.iter().for_each(|v| around[*v as usize] = around[*v as usize].max(*inset));
        }
        let most =
            |triangle: &[u32; 3]| triangle.iter().fold(0.0f32, |most, v| most.max(around[*v as usize]));
        self.insets_mm = mesh.triangles.iter().map(most).collect();
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

    /// Vertices whose support may reach a point over a triangle; the first are its corners.
    pub(super) fn list(&self, triangle: usize) -> &[u32] {
        &self.lists[self.starts[triangle] as usize..self.starts[triangle + 1] as usize]
    }

    /// The triangle to ask for the distance of `x`, from `triangle` on along the surface: while a vertex of its list is nearer than its
    /// corners, one that this vertex is a corner of.
    pub(super) fn walk(&self, mut triangle: u32, x: &Vec3) -> u32 {
        let square = |v: u32| (self.quadrics[v as usize].position - x).norm_squared();
        let mut least = f64::INFINITY;
        loop {
            let list = self.list(triangle as usize);
            let Some(nearest) = list.iter().copied().min_by(|a, b| square(*a).total_cmp(&square(*b))) else {
                return triangle;
            };
            if square(nearest) >= least {
                return triangle;
            }
            least = square(nearest);
            if list.iter().take(3).any(|v| *v == nearest) {
                return triangle;
            }
            triangle = self.triangles[nearest as usize];
        }
    }

    /// All vertices.
    pub(super) fn vertices_mm(&self) -> impl Iterator<Item = &Vec3> {
        self.quadrics.iter().map(|q| &q.position)
    }

    /// f alone, of a point that the vertices of `list` reach.
    fn reach(&self, x: &Vec3, list: &[u32]) -> Option<Reached> {
        let found = self.reach_from(x, list, None);
        if found.as_ref().is_some_and(|found| found.value_mm > 0.0) {
            return found;
        }
        // The list begins with the corners of the triangle.
        let corners = || list.iter().take(3).map(|v| &self.quadrics[*v as usize]);
        let facing = corners().map(|q| q.normal).sum::<Vec3>().normalize();
        let height_mm = corners().map(|q| q.normal.dot(&(x - q.position))).fold(f64::INFINITY, f64::min);
        if height_mm < 0.0 { self.reach_from(x, list, Some(Behind { facing })) } else { found }
    }

    /// The same in front of the surface, or behind it.
    fn reach_from(&self, x: &Vec3, list: &[u32], behind: Option<Behind>) -> Option<Reached> {
        let mut found = Reached { weight: 0.0, value_mm: 0.0, behind, count: 0, vertices: [0; NOTED] };
        for &v in list {
            let q = &self.quadrics[v as usize];
            if behind.is_some_and(|b| q.normal.dot(&b.facing) < FACING) {
                continue;
            }
            let Some(local) = q.local(x, behind.is_some()) else { continue };
            let g = 1.0 - local.u;
            let w = g * g * g * q.opened(local.value, behind.is_some())[0];
            if w == 0.0 {
                continue;
            }
            found.weight += w;
            found.value_mm += w * local.value;
            if let Some(noted) = found.vertices.get_mut(found.count) {
                *noted = v;
            }
            found.count += 1;
        }
        found.value_mm /= found.weight;
        (found.weight >= LEAST_WEIGHT).then_some(found)
    }

    /// The distance of `x`, whose nearest triangle is `triangle` or close to it. `None` where no vertex reaches.
    pub fn distance(&self, x: &Vec3, triangle: u32) -> Option<Distance> {
        match self.within(x, triangle, f64::INFINITY)? {
            (Nearness::Within(distance), _) => Some(distance),
            (Nearness::Beyond(_), _) => None,
        }
    }

    /// As [`SmoothWall::distance`], with derivatives only where the distance is less than `limit_mm`: they are what it costs. Beside it
    /// the sum of their weights: how well the vertices reach.
    pub fn within(&self, x: &Vec3, triangle: u32, limit_mm: f64) -> Option<(Nearness, f64)> {
        let list = self.list(triangle as usize);
        let reached = self.reach(x, list)?;
        let nearness = if reached.value_mm < limit_mm {
            Nearness::Within(self.derive(x, list, &reached, |_, _, _, _| {}))
        } else {
            Nearness::Beyond(reached.value_mm)
        };
        Some((nearness, reached.weight))
    }

    /// As [`SmoothWall::distance`]; `also` sees every vertex that reaches `x` with its weight and the weight's derivatives.
    pub(super) fn weigh(
        &self,
        x: &Vec3,
        triangle: u32,
        also: impl FnMut(u32, f64, &Vec3, &Matrix3<f64>),
    ) -> Option<Distance> {
        let list = self.list(triangle as usize);
        let reached = self.reach(x, list)?;
        Some(self.derive(x, list, &reached, also))
    }

    /// The derivatives of f where its value is known.
    #[inline]
    fn derive(
        &self,
        x: &Vec3,
        list: &[u32],
        reached: &Reached,
        mut also: impl FnMut(u32, f64, &Vec3, &Matrix3<f64>),
    ) -> Distance {
        let (mut slope, mut gradient, mut hessian) = (Vec3::zeros(), Vec3::zeros(), Matrix3::zeros());
        for &v in reached.vertices.get(..reached.count).unwrap_or(list) {
            let q = &self.quadrics[v as usize];
            if reached.behind.is_some_and(|b| q.normal.dot(&b.facing) < FACING) {
                continue;
            }
            let Some(local) = q.local(x, reached.behind.is_some()) else { continue };
            let (f, g) = (local.value, 1.0 - local.u);
            let [b, b1, b2] = q.opened(f, reached.behind.is_some());
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
            let frame = Matrix3::from_columns(&[q.axes[0], q.axes[1], q.normal]);
            let turned1 = frame * w1;
            also(v, w, &turned1, &(frame * w2 * frame.transpose()));
            let above = f - reached.value_mm;
            let mixed = w1 * f1.transpose();
            slope += turned1;
            gradient += frame * (w1 * above + f1 * w);
            hessian += frame * (w2 * above + mixed + mixed.transpose() + f2 * w) * frame.transpose();
        }
        let inverse = 1.0 / reached.weight;
        let gradient = gradient * inverse;
        let mixed = slope * gradient.transpose();
        Distance {
            value_mm: reached.value_mm,
            gradient,
            hessian: (hessian - mixed - mixed.transpose()) * inverse,
        }
    }
}

/// The lists of some triangles one after the other, and where each starts.
fn listed(
    mesh: &SurfaceMesh,
    quadrics: &[Quadric],
    neighbours: &[Vec<u32>],
    part: Range<usize>,
    thickest_mm: f64,
) -> (Vec<u32>, Vec<u32>) {
    let (mut starts, mut lists) = (Vec::with_capacity(part.len()), Vec::new());
    let mut seen = vec![u32::MAX; quadrics.len()];
    let mut queue = VecDeque::new();
    for index in part {
        starts.push(lists.len() as u32);
        let (triangle, corners) = (mesh.triangles[index], mesh.corners(index));
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
    (starts, lists)
}

/// The middles of a triangle and its sides.
fn few([a, b, c]: &[Vec3; 3]) -> [Vec3; 4] {
    [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
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

    /// Of the tube, at a height over the wall that may be negative.
    fn from_inside(wall: &(SmoothWall, WallQuery), i: i32, height_mm: f64) -> (Vec3, Distance) {
        let angle = 2.399 * f64::from(i);
        let on = |r: f64| Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i));
        let triangle = wall.1.nearest(&on(3.8), 10.0).unwrap().triangle;
        let x = on(4.0 - height_mm);
        (x, wall.0.distance(&x, triangle).unwrap())
    }

    #[test]
    fn behind_the_surface_the_distance_goes_on_as_in_front() {
        let wall = tube(1.0);
        for i in 0..200 {
            // Across the surface, …
            let (x, front) = from_inside(&wall, i, 0.0);
            let n = front.normal();
            let x = x - n * front.value_mm;
            let triangle = wall.1.nearest(&x, 10.0).unwrap().triangle;
            let (front, back) =
                (wall.0.distance(&(x + n * 1e-6), triangle), wall.0.distance(&(x - n * 1e-6), triangle));
            let (front, back) = (front.unwrap(), back.unwrap());
            assert!(front.value_mm > 0.0 && back.value_mm < 0.0);
            assert!((front.value_mm - back.value_mm - 2e-6).abs() < 1e-8, "{front:?} {back:?}");
            assert!((front.gradient - back.gradient).norm() < 1e-5);
            // … and deep behind it.
            for height in [-0.3, -2.0, -20.0] {
                let (x, here) = from_inside(&wall, i, height);
                assert!((here.value_mm - height).abs() < 2e-3 * (1.0 - height), "{height}: {here:?}");
                let (h, triangle) = (1e-5, wall.1.nearest(&x, 100.0).unwrap().triangle);
                let here = wall.0.distance(&x, triangle).unwrap();
                let at = |x: Vec3| wall.0.distance(&x, triangle).unwrap();
                for k in 0..3 {
                    let (plus, minus) = (at(x + Vec3::ith(k, h)), at(x - Vec3::ith(k, h)));
                    let slope = (plus.value_mm - minus.value_mm) / (2.0 * h);
                    assert!((slope - here.gradient[k]).abs() < 1e-7, "{slope} {here:?}");
                    let column = (plus.gradient - minus.gradient) / (2.0 * h);
                    assert!((column - here.hessian.column(k)).norm() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn a_point_beyond_the_limit_is_told_its_distance_alone() {
        let wall = tube(1.0);
        for x in points() {
            let triangle = wall.1.nearest(&x, 10.0).unwrap().triangle;
            let here = wall.0.distance(&x, triangle).unwrap();
            let within = |limit_mm: f64| wall.0.within(&x, triangle, limit_mm).unwrap().0;
            assert_eq!(within(here.value_mm), Nearness::Beyond(here.value_mm));
            assert_eq!(within(here.value_mm + 1e-9), Nearness::Within(here));
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
