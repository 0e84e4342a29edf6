//! Inside or outside, by the generalized winding number.
//!
//! Jacobson, Kavan, Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", ACM TOG
//! 32 (2013): the sum of the signed solid angles of all triangles over 4π is 1 inside and 0 outside a closed surface,
//! and deviates from integers where the surface is damaged. Solid angles by Van Oosterom and Strackee, IEEE Trans.
//! Biomed. Eng. 30 (1983), eq. 8.

use std::f64::consts::PI;

use super::{SurfaceMesh, Wall};
use crate::{Error, Result, Vec3};

/// Largest deviation of a winding number from an integer that is accepted.
const LARGEST_DEVIATION: f64 = 0.1;

/// Signed solid angle of a triangle seen from the origin, in steradian: positive if its winding is clockwise from
/// there, as that of an outward triangle is from inside.
pub(super) fn solid_angle(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let volume = a.dot(&b.cross(&c));
    let denominator = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    // A point in the plane of the triangle: in its interior the sign is undefined, and the angle counts as zero.
    if volume == 0.0 { 0.0 } else { 2.0 * libm::atan2(volume, denominator) }
}

/// Generalized winding number of `mesh` and `caps` around a point.
pub(super) fn winding(mesh: &SurfaceMesh, caps: &[[Vec3; 3]], point_mm: &Vec3) -> f64 {
    let triangles = (0..mesh.triangles.len()).map(|i| mesh.corners(i));
    let sum: f64 = triangles.chain(caps.iter().copied()).map(|t| solid_angle(t.map(|v| v - point_mm))).sum();
    sum / (4.0 * PI)
}

impl Wall {
    /// Generalized winding number of the wall and its caps around `point_mm`: 1 in the lumen, 0 outside, for a sound
    /// surface. Exact sum over all triangles; NaN for a point that is not finite.
    pub fn winding_number(&self, point_mm: &Vec3) -> f64 {
        winding(&self.mesh, &self.caps, point_mm)
    }

    /// Whether `point_mm` is in the lumen.
    ///
    /// # Errors
    /// [`Error::Mesh`] if the winding number is more than 0.1 from an integer: the surface is too damaged, or the
    /// point lies on it.
    pub fn contains(&self, point_mm: &Vec3) -> Result<bool> {
        let number = self.winding_number(point_mm);
        // Written so that NaN is also an error.
        if (number - number.round()).abs() <= LARGEST_DEVIATION {
            return Ok(number.round() >= 1.0);
        }
        Err(Error::Mesh(format!(
            "too broken to tell inside from outside at ({:.4}, {:.4}, {:.4}): winding number {number:.3} is not an integer \
             (or the point lies on the wall); {} stray open edges, {} non-manifold edges: close or clean the surface",
            point_mm.x, point_mm.y, point_mm.z, self.report.stray_edges, self.report.non_manifold_edges
        )))
    }
}
