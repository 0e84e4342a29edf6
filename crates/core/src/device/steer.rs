//! Sections that are steered: their rest curvature follows a command, as that of a catheter with tendons in its wall.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Values of the steering of a device: from the largest bend one way to the largest the other way.
pub const MOST_STEER: f64 = 1.0;

/// How a section bends when its device is steered to a value v from −1 to 1: its rest curvature is
///
/// ```text
/// κ⁰ + v k (cos φ, sin φ)
/// ```
///
/// along the first and second material direction, with its own rest curvature κ⁰. All steered sections of a device follow the same value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Steer {
    /// φ: the plane in which it bends, as an angle from the first material direction towards the second, degrees.
    pub plane_deg: f64,
    /// k: curvature at the value 1, 1/mm.
    pub curvature_per_mm_at_1: f64,
}

impl Steer {
    /// Rest curvature that the value 1 adds, along the first and second material direction, 1/mm.
    pub(crate) fn curvature_per_mm(&self) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.plane_deg.to_radians());
        [self.curvature_per_mm_at_1 * cos, self.curvature_per_mm_at_1 * sin]
    }

    /// Checks the steering of a section with this radius and rest curvature; errors begin with `name`.
    pub(super) fn check(&self, name: &str, radius_mm: f64, rest_per_mm: [f64; 2]) -> Result<()> {
        if !(self.plane_deg.is_finite() && self.plane_deg.abs() <= 360.0) {
            let remedy = "must be an angle of at most 360° either way";
            return Err(Error::parameter(format!("{name}.steer.plane_deg"), self.plane_deg, remedy));
        }
        let bend = most_bent_per_mm(rest_per_mm, 0.0, self.curvature_per_mm()) * radius_mm;
        if bend.is_nan() || bend > 1.0 || self.curvature_per_mm_at_1 == 0.0 {
            let remedy = "must be finite and not 0, and with the section's rest curvature bend it no tighter than its own radius";
            return Err(Error::parameter(
                format!("{name}.steer.curvature_per_mm_at_1"),
                self.curvature_per_mm_at_1,
                remedy,
            ));
        }
        Ok(())
    }
}

/// Largest curvature over all values of the steering of a section with this rest curvature at this value, 1/mm.
pub(super) fn most_bent_per_mm(rest_per_mm: [f64; 2], value: f64, steer_per_mm: [f64; 2]) -> f64 {
    let at = |to: f64| {
        let [u, v] = [0, 1].map(|axis| rest_per_mm[axis] + (to - value) * steer_per_mm[axis]);
        libm::hypot(u, v)
    };
    at(MOST_STEER).max(at(-MOST_STEER))
}
