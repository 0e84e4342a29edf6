//! Step 3 of Algorithm 1: collisions of a chain's node, as planes with a normal.
//!
//! Two interpretations. **Triangle**, as printed: a node that reaches a triangle of the vessel's mesh is held off its
//! plane. **Smooth**: the node is held off the wall given by the core's smooth distance d of the mesh, with its
//! position, normal and curvature at the node. To second order its energy ½ κ (r − d)² has, across the device, the
//! curvature of the lumen:
//!
//! ```text
//! ∇∇ ½κ(r − d)² = κ ∇d ∇dᵀ − κ (r − d) ∇∇d,        − bᵀ ∇∇d b = 1/ρ
//! ```
//!
//! with b across the device in the wall, and ρ the radius on which its axis lies. Instead of κ (r − d) at the
//! position before the solve, which varies strongly during a step, the force f of the wall at the last input is used:
//! a spring f/ρ along b. Planes alone have no restoring force along b, so the wire drifts to the side of the tube
//! from input to input.

use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::contact::{ContactSurface, Nearness, WallReader};
use endowire_core::methods::TouchedPlane;
use endowire_core::vessel::WallQuery;
use serde::{Deserialize, Serialize};

/// The obstacles of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactReading {
    /// The smooth wall, with its curvature across the device.
    #[default]
    Smooth,
    /// The planes of the vessel's triangles, as printed.
    Triangle,
}

/// A node is never lost: wherever a solve has thrown it, the next finds its nearest triangle, like the hierarchy of
/// the paper's reference 22.
const REACH_MM: f64 = f64::MAX;
/// Collisions are detected at positions rounded to this, mm. A wire in a plane of symmetry of the mesh lies on the
/// boundary between two triangles, where the twelfth digit of the last solve would choose one, and with it a branch
/// millimetres away.
const DETECTION_GRID_MM: f64 = 1e-6;

/// A collision of a node: a plane, and the curvature of the lumen across it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met {
    pub(super) plane: TouchedPlane,
    /// Direction across the device in the wall, and 1/ρ along it, 1/mm; `None` for triangles, and where the wall is
    /// convex.
    pub(super) across: Option<(Vec3, f64)>,
}

/// The wall for a chain.
#[derive(Debug, Clone)]
pub(super) enum FeltWall {
    /// The core's smooth wall, and its cache.
    Smooth(Arc<ContactSurface>, Option<WallReader>),
    /// The triangles of the vessel.
    Triangle(Arc<WallQuery>),
}

impl FeltWall {
    /// Clears the cache.
    pub(super) fn forget(&mut self) {
        if let Self::Smooth(_, reader) = self {
            *reader = None;
        }
    }

    /// The collision of a node at `x` with the tangent `t`, if its surface of radius `radius_mm` is less than
    /// `gap_mm` from the wall; otherwise a lower bound of its clearance, mm.
    pub(super) fn met(&mut self, x: &Vec3, t: &Vec3, (radius_mm, gap_mm): (f64, f64)) -> Result<Met, f64> {
        let (surface, reader) = match self {
            Self::Smooth(surface, reader) => (surface, reader),
            Self::Triangle(query) => return reached(query, x, radius_mm).ok_or(0.0),
        };
        let reader = reader.get_or_insert_with(|| WallReader::new(surface));
        let (d, triangle) = match reader.read(surface, x, radius_mm + gap_mm) {
            (Nearness::Within(d), Some(triangle)) => (d, triangle),
            (near, None) => return Err(near.value_mm() - radius_mm),
            (_, Some(_)) => return Err(0.0),
        };
        let size = d.gradient.norm();
        let normal = d.gradient / size;
        let depth_mm = radius_mm - d.value_mm;
        let across = t.cross(&normal).try_normalize(0.0).map(|b| (b, -b.dot(&(d.hessian * b)) / size));
        Ok(Met {
            plane: TouchedPlane {
                normal,
                offset_mm: normal.dot(x) + depth_mm / size,
                triangle,
                depth_mm,
                force_n: 0.0,
            },
            across: across.filter(|(_, curvature_per_mm)| *curvature_per_mm > 0.0),
        })
    }

    /// Penetration of the surface of a node at `x`, mm; 0 where it is clear of the wall.
    pub(super) fn depth_mm(&mut self, x: &Vec3, radius_mm: f64) -> f64 {
        match self {
            Self::Smooth(surface, reader) => {
                let reader = reader.get_or_insert_with(|| WallReader::new(surface));
                let (near, _) = reader.read(surface, x, f64::NEG_INFINITY);
                (radius_mm - near.value_mm()).max(0.0)
            }
            Self::Triangle(query) => reached(query, x, radius_mm).map_or(0.0, |met| met.plane.depth_mm),
        }
    }
}

/// The plane of the triangle nearest to `x`, if a surface of radius `radius_mm` about `x` reaches that triangle.
///
/// Past the end of the vessel there is no wall.
fn reached(query: &WallQuery, x: &Vec3, radius_mm: f64) -> Option<Met> {
    let x = &x.map(|c| (c / DETECTION_GRID_MM).round() * DETECTION_GRID_MM);
    let near = query.nearest(x, REACH_MM).filter(|near| !near.rim)?;
    let depth_mm = radius_mm - near.distance_mm;
    let normal = query.inward_normal(near.triangle);
    let offset_mm = normal.dot(&near.point_mm) + radius_mm;
    let reaches = depth_mm > DETECTION_GRID_MM && offset_mm - normal.dot(x) > DETECTION_GRID_MM;
    let plane = TouchedPlane { normal, offset_mm, triangle: near.triangle, depth_mm, force_n: 0.0 };
    reaches.then_some(Met { plane, across: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use endowire_core::vessel::{SurfaceMesh, Wall};

    /// A box with a narrow wedge from its far side up to z = 20: a carina.
    fn wedge() -> WallQuery {
        let profile = [[0., 20.], [-1., 60.], [-10., 60.], [-10., 0.], [10., 0.], [10., 60.], [1., 60.]];
        let n = profile.len() as u32;
        let mut mesh = SurfaceMesh::default();
        for y in [-10.0, 10.0] {
            mesh.vertices_mm.extend(profile.map(|[x, z]| Vec3::new(x, y, z)));
        }
        for k in 0..n {
            let next = (k + 1) % n;
            mesh.triangles.extend([[k, next, k + n], [next, next + n, k + n]]);
        }
        for k in 1..n - 1 {
            mesh.triangles.extend([[0, k + 1, k], [n, n + k, n + k + 1]]);
        }
        WallQuery::new(&Wall::from_surface(&mesh).unwrap()).unwrap()
    }

    #[test]
    fn a_node_in_front_of_a_wedge_touches_it_only_where_it_is_near() {
        let query = wedge();
        let reach = |z: f64| reached(&query, &Vec3::new(0.0, 0.5, z), 0.4).map(|met| met.plane);
        // Beyond the planes of both flanks, and five millimetres away from them.
        assert!(reach(15.0).is_none());
        assert!(reach(19.59).is_none());
        let depth_mm = reach(19.9).map(|plane| plane.depth_mm).unwrap();
        assert!((depth_mm - 0.3).abs() < 1e-6, "{depth_mm}");
        // Behind the edge, inside the wedge: the distance is negative.
        assert!(reach(21.0).unwrap().depth_mm > 0.4);
    }
}
