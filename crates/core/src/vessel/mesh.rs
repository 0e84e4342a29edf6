//! A triangle surface: vertices and index triples, without derived data.

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// A triangle surface in millimetres. Triangles are counter-clockwise seen from outside the lumen.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceMesh {
    /// Vertex positions in millimetres.
    pub vertices_mm: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl SurfaceMesh {
    /// The three corners of triangle `index`.
    #[inline]
    pub fn corners(&self, index: usize) -> [Vec3; 3] {
        // Written out: `map` of an array is a call, which on large meshes took a tenth of the time of a check.
        let [a, b, c] = self.triangles[index];
        [self.vertices_mm[a as usize], self.vertices_mm[b as usize], self.vertices_mm[c as usize]]
    }

    /// The middle of triangle `index`.
    pub(crate) fn middle(&self, index: usize) -> Vec3 {
        let [a, b, c] = self.corners(index);
        (a + b + c) / 3.0
    }

    /// The six faces of a box between two corners, in cells of about `cell_mm`, facing outwards. Faces share no
    /// vertices; weld them if needed.
    pub fn cuboid(low: Vec3, high: Vec3, cell_mm: f64) -> Self {
        let mut mesh = Self::default();
        let size = high - low;
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let count = |k: usize| (size[k] / cell_mm).round().max(1.0) as u32;
            let (m, n) = (count(a), count(b));
            for far in [false, true] {
                let first = mesh.vertices_mm.len() as u32;
                for i in 0..=m {
                    for j in 0..=n {
                        let mut x = low;
                        x[axis] = if far { high[axis] } else { low[axis] };
                        x[a] += size[a] * f64::from(i) / f64::from(m);
                        x[b] += size[b] * f64::from(j) / f64::from(n);
                        mesh.vertices_mm.push(x);
                    }
                }
                for i in 0..m {
                    for j in 0..n {
                        let at = |i: u32, j: u32| first + i * (n + 1) + j;
                        let (p, q, r, s) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                        let both = if far { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] };
                        mesh.triangles.extend(both);
                    }
                }
            }
        }
        mesh
    }

    /// Unit normals of vertices, outwards like the triangles: those of the adjacent triangles, weighted by angle;
    /// zero without triangles.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::zeros(); self.vertices_mm.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            let corner = self.corners(index);
            let Some(outward) = (corner[1] - corner[0]).cross(&(corner[2] - corner[0])).try_normalize(0.0)
            else {
                continue;
            };
            for k in 0..3 {
                let (e, f) = (corner[(k + 1) % 3] - corner[k], corner[(k + 2) % 3] - corner[k]);
                normals[triangle[k] as usize] += outward * libm::atan2(e.cross(&f).norm(), e.dot(&f));
            }
        }
        normals.into_iter().map(|normal| normal.try_normalize(1e-12).unwrap_or_default()).collect()
    }

    /// Smallest and largest coordinates, or `None` without vertices.
    pub fn bounds_mm(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.vertices_mm.first()?;
        Some(self.vertices_mm.iter().fold((first, first), |(low, high), v| (low.inf(v), high.sup(v))))
    }

    /// [`SurfaceMesh::bounds_mm`] of the vertices that triangles use; others are meaningless. Indices must be in
    /// range.
    pub(crate) fn used_bounds_mm(&self) -> Option<(Vec3, Vec3)> {
        let mut used = self.triangles.iter().flatten().map(|v| self.vertices_mm[*v as usize]);
        let first = used.next()?;
        Some(used.fold((first, first), |(low, high), v| (low.inf(&v), high.sup(&v))))
    }

    /// Signed enclosed volume in mm³: positive when triangles are counter-clockwise seen from outside.
    /// Exact for closed surfaces (divergence theorem), meaningless for open ones.
    pub fn signed_volume_mm3(&self) -> f64 {
        let origin = self.vertices_mm.first().copied().unwrap_or_default();
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                (a - origin).dot(&(b - origin).cross(&(c - origin))) / 6.0
            })
            .sum()
    }
}

/// Area of a triangle in mm².
pub(crate) fn area(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    (b - a).cross(&(c - a)).norm() / 2.0
}

/// Unit inward normal of a triangle; an arbitrary direction where undefined.
pub(super) fn inward_normal(mesh: &SurfaceMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle);
    (c - a).cross(&(b - a)).try_normalize(0.0).unwrap_or_else(Vec3::x)
}

/// Unit inward normals of vertices, weighted by angle; an arbitrary direction where undefined.
pub(crate) fn inward_vertex_normals(mesh: &SurfaceMesh) -> Vec<Vec3> {
    let inward = |outward: Vec3| if outward == Vec3::zeros() { Vec3::x() } else { -outward };
    mesh.vertex_normals().into_iter().map(inward).collect()
}

/// Keeps the elements for which `keep` holds, given index and element, in order.
pub(super) fn retain_numbered<T>(list: &mut Vec<T>, keep: impl Fn(usize, &T) -> bool) {
    let mut next = 0;
    list.retain(|one| {
        next += 1;
        keep(next - 1, one)
    });
}
