//! How far a point is from the wall, and on which side.
//!
//! A bounding volume hierarchy (parry) finds the closest triangle; angle-weighted pseudo-normals decide the side, which is
//! right also where the closest feature is an edge or a vertex (Bærentzen and Aanæs, "Signed distance computation using
//! the angle weighted pseudonormal", IEEE TVCG 11, 2005). Types of parry and glam stay inside this file.

use parry3d_f64::glamx::DVec3;
use parry3d_f64::query::{PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::{CompositeShapeRef, TriMesh, TriMeshFlags, TrianglePointLocation};

use super::topology::{EdgeTable, NONE};
use super::{SurfaceMesh, Wall};
use crate::{Error, Result, Vec3};

/// Closer to the wall than this, in mm, the direction to the closest point is rounding: the triangle's normal is used.
const ON_WALL_MM: f64 = 1e-7;

/// The closest point of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The closest point in mm.
    pub point_mm: Vec3,
    /// Distance in mm: positive in the lumen, negative beyond the wall.
    pub distance_mm: f64,
    /// Unit vector from the wall into the lumen, along the line to the queried point; on the wall itself the triangle's normal.
    pub normal: Vec3,
    /// The triangle, as numbered in the wall's mesh.
    pub triangle: u32,
    /// Whether the closest point is on the rim of an opening: the queried point is then past the end of the vessel (or level
    /// with it), and the sign of the distance means nothing.
    pub rim: bool,
}

/// Closest-point queries on a wall.
#[derive(Clone)]
pub struct WallQuery {
    shape: TriMesh,
    /// Inward unit normal of each triangle.
    inward: Vec<Vec3>,
    /// Whether each side of each triangle is open.
    open_side: Vec<[bool; 3]>,
    /// Whether each vertex is on an open side.
    open_vertex: Vec<bool>,
}

impl std::fmt::Debug for WallQuery {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WallQuery").field("triangles", &self.inward.len()).finish_non_exhaustive()
    }
}

fn to_parry(v: &Vec3) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

fn from_parry(v: DVec3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

impl WallQuery {
    /// Prepares queries on `wall`: O(n log n) time.
    ///
    /// # Errors
    /// [`Error::Mesh`] if the hierarchy cannot be built.
    pub fn new(wall: &Wall) -> Result<Self> {
        let mesh: &SurfaceMesh = wall.mesh();
        let vertices = mesh.vertices_mm.iter().map(to_parry).collect();
        let shape = TriMesh::with_flags(vertices, mesh.triangles.clone(), TriMeshFlags::ORIENTED)
            .map_err(|e| Error::Mesh(format!("no wall to query: {e}")))?;
        let inward = (0..mesh.triangles.len())
            .map(|i| {
                let [a, b, c] = mesh.corners(i);
                (c - a).cross(&(b - a)).try_normalize(0.0).unwrap_or_else(Vec3::x)
            })
            .collect();
        let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
        let open_side: Vec<[bool; 3]> = across.iter().map(|sides| sides.map(|other| other == NONE)).collect();
        let mut open_vertex = vec![false; mesh.vertices_mm.len()];
        for (triangle, open) in mesh.triangles.iter().zip(&open_side) {
            for side in (0..3).filter(|&side| open[side]) {
                open_vertex[triangle[side] as usize] = true;
                open_vertex[triangle[(side + 1) % 3] as usize] = true;
            }
        }
        Ok(Self { shape, inward, open_side, open_vertex })
    }

    /// Unit normal of a triangle, into the lumen. `triangle` is one that [`WallQuery::nearest`] returned.
    pub fn inward_normal(&self, triangle: u32) -> Vec3 {
        self.inward[triangle as usize]
    }

    /// Where the straight way from one point to another first meets the wall, as a part of the way, up to `farthest` times its
    /// length. `None` also for points that are not finite.
    pub fn crossing(&self, from_mm: &Vec3, to_mm: &Vec3, farthest: f64) -> Option<f64> {
        // A ray of no numbers would be tested against every triangle.
        if !from_mm.iter().chain(to_mm.iter()).all(|c| c.is_finite()) {
            return None;
        }
        let ray = Ray::new(to_parry(from_mm), to_parry(&(to_mm - from_mm)));
        self.shape.cast_local_ray(&ray, farthest, true)
    }

    /// What a ray first meets within `reach_mm`: how far it is, and the triangle. `direction` is of unit length.
    pub(crate) fn first_met(&self, from_mm: &Vec3, direction: &Vec3, reach_mm: f64) -> Option<(f64, u32)> {
        let ray = Ray::new(to_parry(from_mm), to_parry(direction));
        // The feature of a hit is that of a triangle by itself; which triangle it was the composite shape tells.
        let (triangle, way_mm) = CompositeShapeRef(&self.shape).cast_local_ray(&ray, reach_mm, true)?;
        Some((way_mm, triangle))
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.inward.len()
    }

    /// The closest point of the wall if it is less than `reach_mm` away. `None` also for a point that is not finite.
    pub fn nearest(&self, point_mm: &Vec3, reach_mm: f64) -> Option<Nearest> {
        let reach = reach_mm.min(f64::MAX);
        let (projection, (triangle, location)) = self
            .shape
            .project_local_point_and_get_location_with_max_dist(to_parry(point_mm), false, reach)?;
        let closest = from_parry(projection.point);
        let offset = point_mm - closest;
        let length = offset.norm();
        let side = if projection.is_inside { 1.0 } else { -1.0 };
        let normal =
            if length > ON_WALL_MM { offset * (side / length) } else { self.inward[triangle as usize] };
        let rim = match location {
            TrianglePointLocation::OnVertex(corner) => {
                let vertex = self.shape.indices()[triangle as usize][corner as usize];
                self.open_vertex[vertex as usize]
            }
            TrianglePointLocation::OnEdge(edge, _) => self.open_side[triangle as usize][edge as usize],
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => false,
        };
        Some(Nearest { point_mm: closest, distance_mm: side * length, normal, triangle, rim })
    }
}
