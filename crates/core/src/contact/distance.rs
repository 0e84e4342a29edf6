//! A smooth signed distance to a triangulated wall.
//!
//! The distance to flat triangles is not smooth where a device leans: inside a tube the closest triangle jumps at
//! every bisector of two facets, and with it the direction of the force, so Newton's method chatters; and the flat
//! wall deviates from the vessel it samples by edge²/8R. Here every vertex has a quadric fitted to its neighbours,
//! and the quadrics are blended by a partition of unity (Ohtake et al., *Multi-level partition of unity implicits*,
//! SIGGRAPH 2003):
//!
//! ```text
//! y = x − Vᵢ,  h = Nᵢ·y,  τ = y − Nᵢ(Nᵢ·y)      height and offset
//! σ = (I − hSᵢ)⁻¹ τ                                   foot of x, seen from Vᵢ along the surface
//! Qᵢ(x) = h − ½ τᵀSᵢσ
//! aᵢ(x) = cᵢ (1 − σᵀMᵢσ)³   where positive
//! wᵢ(x) = aᵢ b(Qᵢ, σᵀMᵢσ)
//! f(x)  = Σ wᵢQᵢ / Σ wᵢ
//! ```
//!
//! with Nᵢ the inward normal, Sᵢ the curvature, Mᵢ an ellipse that contains the neighbours of the vertex, and cᵢ = 1,
//! or 0.02 where no quadric fits these. The window b, e^{−Qᵢ/0.3w} for small |Qᵢ| and 0 beyond a width w, excludes
//! the other side of a narrow lumen and the back of a thin septum; where a device touches two sides at once, the
//! nearer one counts. Behind a quadric, towards the rim of its support, the window is narrower, by 1 − σᵀMᵢσ:
//! otherwise each flank of a ridge that stands into the lumen would extend beyond the crest and, as the nearer of the
//! two, act where there is no wall. The coverage Σ aᵢwᵢ / Σ wᵢ measures how well vertices reach a point; it is 0.35
//! or more on any uniform mesh. Whether a vertex is near is decided by feet, not offsets: at height h in a tube of
//! radius R offsets shrink by 1 − h/R, and for a device that nearly fills the tube walls all around would be blended,
//! which would overestimate the clearance by a tenth of the radius. f is twice continuously differentiable, so the
//! contact energy has an exact gradient and Hessian; its difference from the distance to the sampled surface is of
//! fourth order in the edge length, on a tube with 50 edges around a hundredth of that of the flat triangles.
//!
//! With W = Σ wᵢ,
//!
//! ```text
//! ∇f  = Σ [(Qᵢ − f) ∇wᵢ + wᵢ ∇Qᵢ] / W
//! ∇∇f = Σ [(Qᵢ − f) ∇∇wᵢ + ∇wᵢ(∇Qᵢ − ∇f)ᵀ + (∇Qᵢ − ∇f)∇wᵢᵀ + wᵢ ∇∇Qᵢ] / W
//! ```

mod over;
mod passing;

use std::ops::Range;

use nalgebra::Matrix3;

use super::narrow::Corner;
use super::quadric::Quadric;
use super::quadric_fit::{Neighbours, fit};
use crate::products::{outer, product, times};
use crate::vessel::{SurfaceMesh, Wall, inward_vertex_normals};
use crate::{Vec3, parallel};
use over::Lists;
use passing::PASSING;
pub(in crate::contact) use passing::rise;

/// Sum of weights below which no vertex reaches a point.
const LEAST_WEIGHT: f64 = 1e-9;

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

/// How near a point is to the wall, exact only within a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nearness {
    /// At least as far as the limit: the distance, mm.
    Beyond(f64),
    /// As `Beyond`, and no wall is closer than this distance.
    Clear(f64),
    /// Closer than the limit.
    Within(Distance),
}

impl Nearness {
    /// The distance, mm.
    pub fn value_mm(&self) -> f64 {
        match self {
            Self::Beyond(value_mm) | Self::Clear(value_mm) => *value_mm,
            Self::Within(distance) => distance.value_mm,
        }
    }
}

/// Number of reaching vertices that are stored; on any sensible mesh there are about ten.
const NOTED: usize = 32;

/// For a query behind the surface. Depth does not tell which wall is meant, as the window does in front; the meant
/// sheet is the one that faces the same way as the given triangle.
#[derive(Debug, Clone, Copy)]
struct Behind {
    facing: Vec3,
}

/// Smallest cosine between the normals of vertices of one sheet.
const FACING: f64 = 0.3;

/// A vertex that reaches a point.
pub(super) struct Reaching {
    pub(super) vertex: u32,
    /// wᵢ.
    pub(super) weight: f64,
    /// ∇wᵢ.
    pub(super) gradient: Vec3,
    /// ∇∇wᵢ.
    pub(super) hessian: Matrix3<f64>,
    /// aᵢ.
    support: f64,
    /// ∇aᵢ.
    support_gradient: Vec3,
}

/// The blended distance of a point from the vertices that reach it.
struct Reached {
    weight: f64,
    value_mm: f64,
    /// Σ aᵢwᵢ / Σ wᵢ.
    coverage: f64,
    behind: Option<Behind>,
    /// Number of these vertices; the first of them.
    count: usize,
    vertices: [u32; NOTED],
}

/// The smooth wall.
#[derive(Debug, Clone)]
pub(crate) struct SmoothWall {
    quadrics: Vec<Quadric>,
    /// For every vertex, a triangle of which it is a corner.
    triangles: Vec<u32>,
    lists: Lists,
    /// How far the smooth wall lies inside each triangle and its neighbours, mm.
    insets_mm: Vec<f32>,
    /// The largest of these insets, mm.
    deepest_inset_mm: f64,
    /// How far it lies outside each triangle and its neighbours, mm.
    outsets_mm: Vec<f32>,
    /// Depth behind the surface over which the front distance blends into the back distance, mm.
    passing_mm: f64,
}

impl SmoothWall {
    /// The smooth surface of `wall` for devices with radii up to `thickest_mm`.
    pub(crate) fn new(wall: &Wall, thickest_mm: f64) -> Self {
        let mesh = wall.mesh();
        let count = mesh.vertices_mm.len();
        let neighbours = Neighbours::new(&mesh.triangles, count);
        let normals = inward_vertex_normals(mesh);
        let fitted = |v: usize| {
            let mut quadric = fit(v, &mesh.vertices_mm, &normals, &neighbours);
            let around = neighbours.of(v as u32).iter().any(|w| normals[v].dot(&normals[*w as usize]) < 0.0);
            quadric.open_window(thickest_mm, around);
            quadric
        };
        let quadrics = parallel::map(count, fitted);

        let mut triangles = vec![0; count];
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| triangles[*v as usize] = index as u32);
        }
        let mut smooth = Self {
            quadrics,
            triangles,
            lists: Lists::new(mesh.triangles.clone(), neighbours, thickest_mm),
            insets_mm: Vec::new(),
            deepest_inset_mm: 0.0,
            outsets_mm: Vec::new(),
            passing_mm: PASSING * thickest_mm,
        };
        smooth.measure_insets(mesh);
        smooth.lists.prepare(&smooth.quadrics);
        smooth
    }

    /// Samples how far the smooth wall lies inside and outside each triangle or one that shares a corner with it, at
    /// a few points: a point next to one triangle may touch the other.
    fn measure_insets(&mut self, mesh: &SurfaceMesh) {
        let measured = |part: Range<usize>| {
            let (mut seen, mut list) = (vec![u32::MAX; mesh.vertices_mm.len()], Vec::new());
            let measure = |index: usize| {
                self.lists.touching(&self.quadrics, index, &mut seen, &mut list);
                let height = |x: Vec3| self.reach_from(&x, &list, None).map_or(0.0, |r| r.value_mm);
                few(mesh, index).map(height).fold([0.0f32; 2], |[inset, outset], height| {
                    [inset.max(-height as f32), outset.max(height as f32)]
                })
            };
            part.map(measure).collect::<Vec<_>>()
        };
        let own = parallel::parts(mesh.triangles.len(), measured).concat();
        let [insets, outsets] = [0, 1].map(|k| own.iter().map(|both| both[k]).collect::<Vec<_>>());
        self.take_insets(&insets);
        self.outsets_mm = self.spread(&outsets);
    }

    /// Stores the inset of each triangle, the largest of its neighbourhood.
    fn take_insets(&mut self, own_mm: &[f32]) {
        self.insets_mm = self.spread(own_mm);
        self.deepest_inset_mm = self.insets_mm.iter().copied().fold(0.0, f32::max).into();
    }

    /// For each triangle the largest value of those that share a corner with it.
    fn spread(&self, own: &[f32]) -> Vec<f32> {
        let triangles = &self.lists.triangles;
        let mut around = vec![0.0f32; self.quadrics.len()];
        for (triangle, value) in triangles.iter().zip(own) {
            triangle.iter().for_each(|v| around[*v as usize] = around[*v as usize].max(*value));
        }
        let most =
            |triangle: &[u32; 3]| triangle.iter().fold(0.0f32, |most, v| most.max(around[*v as usize]));
        triangles.iter().map(most).collect()
    }

    /// Triangles inside which the smooth wall lies by more than this, mm.
    pub(super) fn inside_of(&self, least_mm: f64) -> Vec<u32> {
        let inside = |triangle: &u32| self.inset_mm(*triangle) > least_mm;
        (0..self.insets_mm.len() as u32).filter(inside).collect()
    }

    /// Increases the insets of triangles to larger ones found elsewhere than on them.
    pub(super) fn deepen(&mut self, seen: impl Iterator<Item = (u32, f64)>) {
        let mut own = self.insets_mm.clone();
        for (triangle, inset_mm) in seen {
            let most = &mut own[triangle as usize];
            *most = most.max(inset_mm as f32);
        }
        self.take_insets(&own);
    }

    /// How far the smooth wall lies inside a triangle, mm: 0 where it lies beyond it.
    pub(crate) fn inset_mm(&self, triangle: u32) -> f64 {
        self.insets_mm[triangle as usize].into()
    }

    /// How far the smooth wall lies outside a triangle, mm: 0 where it lies inside it.
    pub(super) fn outset_mm(&self, triangle: u32) -> f64 {
        self.outsets_mm[triangle as usize].into()
    }

    /// The largest of all [`SmoothWall::inset_mm`].
    pub(crate) fn deepest_inset_mm(&self) -> f64 {
        self.deepest_inset_mm
    }

    /// Vertices whose support may reach a point over a triangle; the first are its corners.
    #[inline]
    pub(super) fn list(&self, triangle: usize) -> &[u32] {
        self.lists.of(&self.quadrics, triangle)
    }

    /// The triangle from which to compute the distance of `x`: walks along the surface from `triangle`, to a triangle
    /// at a vertex of the list that is nearer than its corners, until there is none.
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

    /// All vertices, with the curvature of the wall there.
    pub(super) fn corners(&self) -> impl Iterator<Item = Corner> + '_ {
        self.quadrics.iter().map(|q| Corner {
            position: q.position,
            normal: q.normal,
            along: q.axes[1],
            curvature: if q.trust == 1.0 { q.curvature } else { [0.0; 2] },
        })
    }

    /// The corners of all triangles.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.lists.triangles
    }

    /// f alone at a point that the vertices of `list` reach, in front of the surface or behind it.
    fn reach(&self, x: &Vec3, list: &[u32]) -> Option<Reached> {
        let found = self.reach_from(x, list, None);
        if found.as_ref().is_some_and(|found| found.value_mm > 0.0) {
            return found;
        }
        self.reach_from(x, list, Some(self.behind(list))).or(found)
    }

    /// As [`Self::reach`], in front of the surface, or behind it.
    fn reach_from(&self, x: &Vec3, list: &[u32], behind: Option<Behind>) -> Option<Reached> {
        let mut found =
            Reached { weight: 0.0, value_mm: 0.0, coverage: 0.0, behind, count: 0, vertices: [0; NOTED] };
        for &v in list {
            let q = &self.quadrics[v as usize];
            if behind.is_some_and(|b| q.normal.dot(&b.facing) < FACING) {
                continue;
            }
            let Some(local) = q.local(x) else { continue };
            let a = q.trust * (1.0 - local.u) * (1.0 - local.u) * (1.0 - local.u);
            let w = a * q.opened(&local, behind.is_some()).value;
            if w == 0.0 {
                continue;
            }
            found.weight += w;
            found.value_mm += w * local.value;
            found.coverage += w * a;
            if let Some(noted) = found.vertices.get_mut(found.count) {
                *noted = v;
            }
            found.count += 1;
        }
        found.value_mm /= found.weight;
        // Deep behind the surface feet are far apart, and triangles are no substitute there.
        found.coverage = if behind.is_some() { 1.0 } else { found.coverage / found.weight };
        (found.weight >= LEAST_WEIGHT).then_some(found)
    }

    /// The distance of `x`, given a triangle at or near the nearest. `None` where no vertex reaches.
    pub(crate) fn distance(&self, x: &Vec3, triangle: u32) -> Option<Distance> {
        match self.within(x, triangle, f64::INFINITY)? {
            (Nearness::Within(distance), _) => Some(distance),
            (Nearness::Beyond(_) | Nearness::Clear(_), _) => None,
        }
    }

    /// As [`SmoothWall::distance`]; `also` is called with every vertex that reaches `x`, its weight and the weight's
    /// derivatives.
    pub(super) fn weigh(&self, x: &Vec3, triangle: u32, also: impl FnMut(&Reaching)) -> Option<Distance> {
        let list = self.list(triangle as usize);
        let reached = self.reach(x, list)?;
        Some(self.derive(x, list, &reached, also))
    }

    /// The derivatives of f, given its value.
    #[inline]
    fn derive(&self, x: &Vec3, list: &[u32], reached: &Reached, mut also: impl FnMut(&Reaching)) -> Distance {
        let (mut slope, mut gradient, mut hessian) = (Vec3::zeros(), Vec3::zeros(), Matrix3::zeros());
        for &v in reached.vertices.get(..reached.count).unwrap_or(list) {
            let q = &self.quadrics[v as usize];
            if reached.behind.is_some_and(|b| q.normal.dot(&b.facing) < FACING) {
                continue;
            }
            let Some(local) = q.local(x) else { continue };
            let opened = q.opened(&local, reached.behind.is_some());
            if opened.value == 0.0 {
                continue;
            }
            let [(f1, f2), (u1, u2)] = q.derivatives(&local);
            // a = cg³ with g = 1 − u has a′(u) = −3cg², a″(u) = 6cg.
            let (f, g, c) = (local.value, 1.0 - local.u, q.trust);
            let (a, a1, a2) = (c * g * g * g, -3.0 * c * g * g, 6.0 * c * g);
            let w = a * opened.value;
            let (in_u, in_q) = (a1 * opened.value + a * opened.in_u, a * opened.in_q);
            let in_uu = a2 * opened.value + 2.0 * a1 * opened.in_u + a * opened.in_uu;
            let turned = outer(&u1, &f1) * (a1 * opened.in_q + a * opened.in_qu);
            let w1 = u1 * in_u + f1 * in_q;
            let w2 = (outer(&u1, &u1) * in_uu + u2 * in_u)
                + (turned + turned.transpose() + f2 * in_q + outer(&f1, &f1) * (a * opened.in_qq));
            let frame = Matrix3::from_columns(&[q.axes[0], q.axes[1], q.normal]);
            let back = frame.transpose();
            let turned1 = times(&frame, &w1);
            also(&Reaching {
                vertex: v,
                weight: w,
                gradient: turned1,
                hessian: product(&product(&frame, &w2), &back),
                support: a,
                support_gradient: times(&frame, &u1) * a1,
            });
            let above = f - reached.value_mm;
            let mixed = outer(&w1, &f1);
            slope += turned1;
            gradient += times(&frame, &(w1 * above + f1 * w));
            let bend = w2 * above + mixed + mixed.transpose() + f2 * w;
            hessian += product(&product(&frame, &bend), &back);
        }
        let inverse = 1.0 / reached.weight;
        let gradient = gradient * inverse;
        let mixed = outer(&slope, &gradient);
        Distance {
            value_mm: reached.value_mm,
            gradient,
            hessian: (hessian - mixed - mixed.transpose()) * inverse,
        }
    }
}

/// The middle of a triangle, and those of its sides along which its indices increase, so that of two adjacent
/// triangles only one includes a side.
fn few(mesh: &SurfaceMesh, triangle: usize) -> impl Iterator<Item = Vec3> {
    let (ends, [a, b, c]) = (mesh.triangles[triangle], mesh.corners(triangle));
    let sides = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].into_iter().enumerate();
    let upwards = sides.filter(move |(k, _)| ends[*k] < ends[(k + 1) % 3]).map(|(_, middle)| middle);
    std::iter::once((a + b + c) / 3.0).chain(upwards)
}

#[cfg(test)]
mod tests;
