//! Distance of a point from the wall, and its side.
//!
//! A bounding volume hierarchy (parry) finds the closest triangle; angle-weighted pseudo-normals determine the side,
//! correctly also where the closest feature is an edge or a vertex (Bærentzen and Aanæs, "Signed distance computation
//! using the angle weighted pseudonormal", IEEE TVCG 11, 2005). Types of parry and glam are not exposed by this file.

use std::sync::OnceLock;

use parry3d_f64::glamx::DVec3;
use parry3d_f64::partitioning::BvhNode;
use parry3d_f64::query::{PointQuery, PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::{CompositeShapeRef, TriMesh, Triangle, TrianglePointLocation};

use super::mesh::inward_normal;
use super::topology::{EdgeTable, NONE};
use super::{SurfaceMesh, Wall, inward_vertex_normals};
use crate::{Error, Result, Vec3};

/// Distance from the wall, mm, below which the direction to the closest point is rounding: then the triangle's normal
/// is used.
const ON_WALL_MM: f64 = 1e-7;

/// Margin added to boxes of triangles, mm, in queries along a line: more than rounding.
const BOX_MARGIN_MM: f64 = 1e-9;

/// The closest point of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The closest point in mm.
    pub point_mm: Vec3,
    /// Distance in mm: positive in the lumen, negative beyond the wall.
    pub distance_mm: f64,
    /// Unit vector from the wall into the lumen, along the line to the queried point; on the wall itself the triangle's normal.
    pub normal: Vec3,
    /// The index of the triangle in the wall's mesh.
    pub triangle: u32,
    /// Whether the closest point is on the rim of an opening: then the queried point is past the end of the vessel
    /// (or level with it), and the sign of the distance is meaningless.
    pub rim: bool,
}

/// Closest-point queries on a wall. Their structures are built by the first query, or in advance if that must be
/// fast.
#[derive(Clone)]
pub struct WallQuery {
    mesh: SurfaceMesh,
    ready: OnceLock<Option<Ready>>,
}

/// The query structures.
#[derive(Clone)]
struct Ready {
    shape: TriMesh,
    /// Inward pseudo-normal of each vertex.
    inward_at: Vec<Vec3>,
    /// The triangle across each side of each triangle.
    across: Vec<[u32; 3]>,
    /// Whether each vertex is on an open side.
    open_vertex: Vec<bool>,
}

impl Ready {
    fn new(mesh: &SurfaceMesh) -> Option<Self> {
        let vertices = mesh.vertices_mm.iter().map(to_parry).collect();
        let shape = TriMesh::new(vertices, mesh.triangles.clone()).ok()?;
        let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
        let mut open_vertex = vec![false; mesh.vertices_mm.len()];
        for (triangle, across) in mesh.triangles.iter().zip(&across) {
            for side in (0..3).filter(|&side| across[side] == NONE) {
                open_vertex[triangle[side] as usize] = true;
                open_vertex[triangle[(side + 1) % 3] as usize] = true;
            }
        }
        Some(Self { shape, inward_at: inward_vertex_normals(mesh), across, open_vertex })
    }
}

impl std::fmt::Debug for WallQuery {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WallQuery").field("triangles", &self.triangles()).finish_non_exhaustive()
    }
}

fn to_parry(v: &Vec3) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

fn from_parry(v: DVec3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// Distance of a point from a triangle, mm.
pub(super) fn distance_to_triangle([a, b, c]: &[Vec3; 3], point_mm: &Vec3) -> f64 {
    let triangle = Triangle::new(to_parry(a), to_parry(b), to_parry(c));
    triangle.distance_to_local_point(to_parry(point_mm), false)
}

impl WallQuery {
    /// Queries on `wall`. The first takes O(n log n) time, others O(log n).
    ///
    /// # Errors
    /// [`Error::Mesh`] if there are no triangles.
    pub fn new(wall: &Wall) -> Result<Self> {
        Self::of_mesh(wall.mesh().clone())
    }

    /// Queries on a consistently oriented mesh.
    ///
    /// # Errors
    /// As [`WallQuery::new`].
    pub(super) fn of_mesh(mesh: SurfaceMesh) -> Result<Self> {
        if mesh.triangles.is_empty() {
            return Err(Error::Mesh("no wall to query: it has no triangles".into()));
        }
        Ok(Self { mesh, ready: OnceLock::new() })
    }

    #[inline]
    fn ready(&self) -> Option<&Ready> {
        self.ready.get_or_init(|| Ready::new(&self.mesh)).as_ref()
    }

    /// Builds the query structures in advance.
    pub(crate) fn prepare(&self) {
        self.ready();
    }

    /// Unit normal of a triangle, into the lumen. `triangle` is an index returned by [`WallQuery::nearest`].
    pub fn inward_normal(&self, triangle: u32) -> Vec3 {
        inward_normal(&self.mesh, triangle as usize)
    }

    /// Corners of a triangle.
    pub(crate) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.corners(triangle as usize)
    }

    /// Distance of a point from the wall, mm, on either side. For a single query: it visits all triangles, which is
    /// faster than building the structures.
    pub(crate) fn distance_mm(&self, point_mm: &Vec3) -> f64 {
        (0..self.triangles() as u32).map(|t| self.distance_to(t, point_mm)).fold(f64::INFINITY, f64::min)
    }

    /// Distance of a point from a triangle, mm, on either side.
    pub(crate) fn distance_to(&self, triangle: u32, point_mm: &Vec3) -> f64 {
        distance_to_triangle(&self.corners(triangle), point_mm)
    }

    /// Where the straight path from one point to another first meets the wall, as a fraction of the path, up to
    /// `farthest` times its length. `None` also for points that are not finite.
    pub fn crossing(&self, from_mm: &Vec3, to_mm: &Vec3, farthest: f64) -> Option<f64> {
        // A ray with NaN would be tested against every triangle.
        if !from_mm.iter().chain(to_mm.iter()).all(|c| c.is_finite()) {
            return None;
        }
        let ray = Ray::new(to_parry(from_mm), to_parry(&(to_mm - from_mm)));
        let shape = &self.ready()?.shape;
        // As the shape's own query, but without divisions at every box.
        let per_way = ray.dir.recip();
        let enters = |node: &BvhNode, nearest: f64| {
            let low = (node.mins() - BOX_MARGIN_MM - ray.origin) * per_way;
            let high = (node.maxs() + BOX_MARGIN_MM - ray.origin) * per_way;
            let begin = low.min(high).max_element().max(0.0);
            if begin <= low.max(high).min_element().min(nearest) { begin } else { f64::MAX }
        };
        let meets = |triangle, nearest| shape.triangle(triangle).cast_local_ray(&ray, nearest, true);
        shape.bvh().find_best(farthest, enters, meets).map(|(_, part)| part)
    }

    /// The first hit of a ray within `reach_mm`: its distance and the triangle. `direction` has unit length.
    pub(crate) fn first_met(&self, from_mm: &Vec3, direction: &Vec3, reach_mm: f64) -> Option<(f64, u32)> {
        let ray = Ray::new(to_parry(from_mm), to_parry(direction));
        // The feature of a hit refers to a single triangle; the composite shape gives its index.
        let (triangle, way_mm) =
            CompositeShapeRef(&self.ready()?.shape).cast_local_ray(&ray, reach_mm, true)?;
        Some((way_mm, triangle))
    }

    /// The mesh that is queried.
    pub(crate) fn mesh(&self) -> &SurfaceMesh {
        &self.mesh
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// The closest point of the wall if it is less than `reach_mm` away. `None` also for a point that is not finite.
    pub fn nearest(&self, point_mm: &Vec3, reach_mm: f64) -> Option<Nearest> {
        let reach = reach_mm.min(f64::MAX);
        let ready = self.ready()?;
        let (projection, (triangle, location)) = ready
            .shape
            .project_local_point_and_get_location_with_max_dist(to_parry(point_mm), false, reach)?;
        let closest = from_parry(projection.point);
        let offset = point_mm - closest;
        let length = offset.norm();
        let own = self.inward_normal(triangle);
        // The pseudo-normal of the feature, and whether it is on a rim.
        let (inward, rim) = match location {
            TrianglePointLocation::OnVertex(corner) => {
                let vertex = self.mesh.triangles[triangle as usize][corner as usize] as usize;
                (ready.inward_at[vertex], ready.open_vertex[vertex])
            }
            TrianglePointLocation::OnEdge(edge, _) => match ready.across[triangle as usize][edge as usize] {
                NONE => (own, true),
                other => (own + self.inward_normal(other), false),
            },
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => (own, false),
        };
        let side = if offset.dot(&inward) >= 0.0 { 1.0 } else { -1.0 };
        let normal = if length > ON_WALL_MM { offset * (side / length) } else { own };
        Some(Nearest { point_mm: closest, distance_mm: side * length, normal, triangle, rim })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{splitmix64, unit};
    use crate::vessel::{GeneratedWall, Resolution, anatomy};

    #[test]
    fn ways_meet_the_wall_where_the_shape_itself_says() {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(4.0)).unwrap().wall;
        let query = WallQuery::new(&wall).unwrap();
        let shape = &query.ready().unwrap().shape;
        let (mut met, mut missed) = (0, 0);
        for k in 0..3000_u64 {
            let number = |n| unit(splitmix64(7, 12 * k + n)) - 0.5;
            // From positions around vertices, paths of 0.01 to 100 mm; some along an axis, and some that begin on a
            // box's side.
            let vertex = wall.mesh().vertices_mm[k as usize % wall.mesh().vertices_mm.len()];
            let away = Vec3::new(number(0), number(1), number(2)) * 20.0;
            let from = if k % 7 == 0 { vertex } else { vertex + away };
            let mut way = Vec3::new(number(3), number(4), number(5)) * 10f64.powf(4.0 * number(6) + 1.0);
            if k % 5 == 0 {
                way[k as usize % 3] = 0.0;
            }
            if k % 15 == 0 {
                way[(k as usize + 1) % 3] = 0.0;
            }
            let farthest = 1.0 + 4.0 * (number(7) + 0.5);
            let ray = Ray::new(to_parry(&from), to_parry(&((from + way) - from)));
            let expected = shape.cast_local_ray(&ray, farthest, true);
            assert_eq!(query.crossing(&from, &(from + way), farthest), expected, "{from} {way}");
            *(if expected.is_some() { &mut met } else { &mut missed }) += 1;
        }
        assert!(met > 500 && missed > 500, "{met} met it, {missed} did not");
        assert_eq!(query.crossing(&Vec3::zeros(), &Vec3::zeros(), 2.0), None);
        assert_eq!(query.crossing(&Vec3::zeros(), &Vec3::repeat(f64::NAN), 2.0), None);
    }
}
