//! The surface as given: what everything is projected onto, and what rays are cast at.
//!
//! A vertex knows the triangle it lies on. A moved vertex is projected by walking from there over the surface, across edges and
//! around vertices, as long as it comes nearer (the closest point of a triangle after Ericson, *Real-Time Collision Detection*,
//! 5.1.5): it never comes to another sheet, however close that is.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::glamx::DVec3;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d_f64::query::Ray;

use super::corners::vertex_normals;
use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::intersect::ray_meets;
use crate::vessel::topology::{EdgeTable, NONE};

/// Longest walk, in triangles. On the densest meshes a step of one target edge crosses about a hundred.
const WALK: usize = 4000;
/// Smallest cosine between a chord and the normal at its end; below it the chord is meaningless.
const ACROSS: f64 = 0.6;
/// Largest deviation of a corner normal from its triangle's (41°): beyond it there is a crease or noise.
const LEANING: f64 = 0.75;

/// Cosine between normals below which a triangle belongs to another sheet.
const OTHER_SHEET: f64 = -0.2;

/// Part of a triangle that is closest to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Feature {
    Face,
    /// From this corner to the next.
    Edge(usize),
    Corner(usize),
}

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    pub(super) at: Vec3,
    pub(super) triangle: u32,
    /// Barycentric coordinates.
    pub(super) weights: [f64; 3],
    /// Square of the distance from the query point, mm².
    pub(super) square: f64,
    feature: Feature,
}

/// The given surface.
pub(super) struct Reference<'a> {
    pub(super) mesh: &'a SurfaceMesh,
    across: Vec<[u32; 3]>,
    fan_starts: Vec<u32>,
    fans: Vec<u32>,
    /// Outward normals of the vertices.
    normals: Vec<Vec3>,
    tree: Bvh,
}

impl<'a> Reference<'a> {
    pub(super) fn new(mesh: &'a SurfaceMesh) -> Self {
        let count = mesh.vertices_mm.len();
        let mut fan_starts = vec![0u32; count + 1];
        for v in mesh.triangles.iter().flatten() {
            fan_starts[*v as usize + 1] += 1;
        }
        for v in 0..count {
            fan_starts[v + 1] += fan_starts[v];
        }
        let mut fill = fan_starts.clone();
        let mut fans = vec![0; 3 * mesh.triangles.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for v in triangle {
                fans[fill[*v as usize] as usize] = t as u32;
                fill[*v as usize] += 1;
            }
        }
        Self {
            mesh,
            across: EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len()),
            fan_starts,
            fans,
            normals: vertex_normals(&mesh.triangles, &mesh.vertices_mm),
            tree: hierarchy(mesh),
        }
    }

    fn on(&self, x: &Vec3, triangle: u32) -> Foot {
        let corners = self.mesh.corners(triangle as usize);
        let (weights, feature) = closest(x, &corners);
        let at = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        Foot { at, triangle, weights, square: (x - at).norm_squared(), feature }
    }

    /// The point of the surface nearest to `x` that a walk from a triangle reaches.
    pub(super) fn walk(&self, x: &Vec3, triangle: u32) -> Foot {
        let mut best = self.on(x, triangle);
        for _ in 0..WALK {
            let found = match best.feature {
                Feature::Face => return best,
                Feature::Edge(k) => match self.across[best.triangle as usize][k] {
                    NONE => return best,
                    other => self.on(x, other),
                },
                Feature::Corner(k) => {
                    let v = self.mesh.triangles[best.triangle as usize][k] as usize;
                    let fan = &self.fans[self.fan_starts[v] as usize..self.fan_starts[v + 1] as usize];
                    fan.iter()
                        .map(|&t| self.on(x, t))
                        .fold(best, |a, b| if b.square < a.square { b } else { a })
                }
            };
            if found.square >= best.square * (1.0 - 1e-12) {
                return best;
            }
            best = found;
        }
        best
    }

    /// Whether a triangle faces against the surrounding surface.
    pub(super) fn is_folded(&self, triangle: usize) -> bool {
        let [a, b, c] = self.mesh.corners(triangle);
        let normal = (b - a).cross(&(c - a));
        self.mesh.triangles[triangle].iter().any(|&v| self.normals[v as usize].dot(&normal) < 0.0)
    }

    /// Square of the distance from the nearest triangle that faces like `normal`, mm².
    pub(super) fn nearest(&self, x: &Vec3, normal: &Vec3) -> Option<f64> {
        nearest(self.mesh, &self.tree, x, normal).map(|found| found.1)
    }

    /// Where a ray from inside (`outward` = 1) leaves the lumen, or one from outside (−1) enters one, mm along the
    /// unit vector `way`. Hits within `skip_mm` belong to the surface it starts from.
    pub(super) fn cast(
        &self,
        from: &Vec3,
        way: &Vec3,
        outward: f64,
        skip_mm: f64,
        reach_mm: f64,
    ) -> Option<f64> {
        let ray = Ray::new(glam(from), glam(way));
        let hit = |leaf: u32, _: f64| {
            let [a, b, c] = self.mesh.corners(leaf as usize);
            let faces = (b - a).cross(&(c - a)).dot(way) * outward > 0.0;
            ray_meets(from, way, [a, b, c]).filter(|distance| faces && *distance > skip_mm)
        };
        let (triangle, distance) = self.tree.cast_ray(&ray, reach_mm, hit)?;
        let [a, b, c] = self.mesh.corners(triangle as usize);
        let normal = (b - a).cross(&(c - a));
        // Next to a ridge a ray hits its other flank, however wide the lumen is.
        let across = normal.dot(way) * outward > ACROSS * normal.norm();
        (across && distance.is_finite() && distance < reach_mm).then_some(distance)
    }

    /// Height of a smooth surface above a foot, mm: half the mean of the heights of the corners' tangent planes, which on a sphere
    /// is right to second order,
    ///
    /// ```text
    /// η = ½ Σ λᵢ nᵢ·(vᵢ − c)
    /// ```
    ///
    /// A corner whose normal is inclined to the triangle's contributes nothing.
    pub(super) fn bulge_mm(&self, foot: &Foot) -> f64 {
        let corners = self.mesh.corners(foot.triangle as usize);
        let [a, b, c] = corners;
        let Some(flat) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return 0.0 };
        let ends = self.mesh.triangles[foot.triangle as usize];
        let height = |k: usize| {
            let normal = self.normals[ends[k] as usize];
            if normal.dot(&flat) < LEANING {
                0.0
            } else {
                foot.weights[k] * normal.dot(&(corners[k] - foot.at))
            }
        };
        let sum = 0.5 * (height(0) + height(1) + height(2));
        if sum.is_finite() { sum } else { 0.0 }
    }
}

pub(super) fn glam(v: &Vec3) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

/// A bounding volume hierarchy of the triangles.
pub(super) fn hierarchy(mesh: &SurfaceMesh) -> Bvh {
    let bounds = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        Aabb::new(glam(&a.inf(&b).inf(&c)), glam(&a.sup(&b).sup(&c)))
    };
    let leaves: Vec<Aabb> = (0..mesh.triangles.len()).map(bounds).collect();
    Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves)
}

/// Barycentric coordinates of the point of a triangle closest to `x`.
fn closest(x: &Vec3, [a, b, c]: &[Vec3; 3]) -> ([f64; 3], Feature) {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(x - a)), ac.dot(&(x - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], Feature::Corner(0));
    }
    let (d3, d4) = (ab.dot(&(x - b)), ac.dot(&(x - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], Feature::Corner(1));
    }
    let (d5, d6) = (ab.dot(&(x - c)), ac.dot(&(x - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], Feature::Corner(2));
    }
    let part = |p: f64, q: f64| if p + q > 0.0 { (p / (p + q)).clamp(0.0, 1.0) } else { 0.0 };
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = part(d1, -d3);
        return ([1.0 - v, v, 0.0], Feature::Edge(0));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = part(d2, -d6);
        return ([1.0 - w, 0.0, w], Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = part(d4 - d3, d5 - d6);
        return ([0.0, 1.0 - w, w], Feature::Edge(1));
    }
    let sum = va + vb + vc;
    if sum > 0.0 && sum.is_finite() {
        ([va / sum, vb / sum, vc / sum], Feature::Face)
    } else {
        ([1.0, 0.0, 0.0], Feature::Corner(0))
    }
}

/// Square of the distance of `x` from a triangle.
pub(super) fn square_to(x: &Vec3, corners: &[Vec3; 3]) -> f64 {
    let (w, _) = closest(x, corners);
    (x - corners[0] * w[0] - corners[1] * w[1] - corners[2] * w[2]).norm_squared()
}

/// The nearest triangle that faces the same way, and the square of its distance; a needle's normal is meaningless.
pub(super) fn nearest(mesh: &SurfaceMesh, tree: &Bvh, x: &Vec3, normal: &Vec3) -> Option<(u32, f64)> {
    let size = normal.norm();
    let square_to_box = |node: &BvhNode, _: f64| {
        let (low, high) = (node.mins(), node.maxs());
        let gap = |x: f64, low: f64, high: f64| (low - x).max(x - high).max(0.0);
        gap(x.x, low.x, high.x).powi(2) + gap(x.y, low.y, high.y).powi(2) + gap(x.z, low.z, high.z).powi(2)
    };
    let leaf = |index: u32, _: f64| {
        let corners = mesh.corners(index as usize);
        let [a, b, c] = corners;
        let other = (b - a).cross(&(c - a));
        (other.dot(normal) >= OTHER_SHEET * size * other.norm()).then(|| square_to(x, &corners))
    };
    tree.find_best(f64::MAX, square_to_box, leaf)
}
