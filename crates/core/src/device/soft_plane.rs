//! Sections that bend more easily in one plane than in the one across it: ribbons, ground flats, slotted tubes.

use serde::{Deserialize, Serialize};

use super::{LEAST_STIFFNESS_NMM2, Section};
use crate::{Error, Result};

/// Least ratio of the two stiffnesses: a ribbon 30 times as wide as it is thick.
const LEAST_RATIO: f64 = 1e-3;

/// The plane in which a section bends most easily. In the plane across it the stiffness is the section's
/// `bending_stiffness_nmm2`, and in between it is that of both parts of the curvature: B = EI₁ p pᵀ + EI₂ q qᵀ with p in this plane
/// and q across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoftPlane {
    /// The plane, as an angle from the first material direction towards the second, degrees.
    pub plane_deg: f64,
    /// EI₁: bending stiffness in it, N·mm².
    pub bending_stiffness_nmm2: f64,
}

impl SoftPlane {
    /// Checks it in a section of this stiffness across it; errors begin with `name`.
    pub(super) fn check(&self, name: &str, across_nmm2: f64) -> Result<()> {
        if !(self.plane_deg.is_finite() && self.plane_deg.abs() <= 360.0) {
            let remedy = "must be an angle of at most 360° either way";
            return Err(Error::parameter(format!("{name}.soft_plane.plane_deg"), self.plane_deg, remedy));
        }
        let least = (LEAST_RATIO * across_nmm2).max(LEAST_STIFFNESS_NMM2);
        if !(least..=across_nmm2).contains(&self.bending_stiffness_nmm2) {
            let remedy = format!(
                "must be from {least} N·mm² to that across it, {across_nmm2}: name the plane in which it bends more easily"
            );
            let name = format!("{name}.soft_plane.bending_stiffness_nmm2");
            return Err(Error::parameter(name, self.bending_stiffness_nmm2, remedy));
        }
        Ok(())
    }
}

impl Section {
    /// Bending stiffness in the plane in which it bends most easily, N·mm², and what it is stiffer by in others (p, q, c):
    /// B = EI + (p c; c q) along the two material directions.
    pub(crate) fn stiffness_nmm2(&self) -> (f64, [f64; 3]) {
        let across = self.bending_stiffness_nmm2;
        self.soft_plane.map_or((across, [0.0; 3]), |plane| {
            let soft = plane.bending_stiffness_nmm2;
            // Across p = (cos, sin).
            let (sin, cos) = libm::sincos(plane.plane_deg.to_radians());
            (soft, [sin * sin, cos * cos, -sin * cos].map(|part| (across - soft) * part))
        })
    }

    /// Bending stiffness in the plane in which it bends most easily, N·mm².
    pub fn softest_nmm2(&self) -> f64 {
        self.soft_plane.map_or(self.bending_stiffness_nmm2, |plane| plane.bending_stiffness_nmm2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Device;
    use crate::rod::times;

    fn flat(plane_deg: f64, bending_stiffness_nmm2: f64) -> Section {
        let soft_plane = Some(SoftPlane { plane_deg, bending_stiffness_nmm2 });
        Section { soft_plane, ..Section::straight(50.0, 0.4, 12.0) }
    }

    #[test]
    fn each_plane_has_its_stiffness() {
        for plane_deg in [0.0, 30.0, 90.0, -130.0] {
            let stiffness = flat(plane_deg, 2.0).stiffness_nmm2();
            let (sin, cos) = plane_deg.to_radians().sin_cos();
            for (curvature, expected) in [([cos, sin], 2.0), ([-sin, cos], 12.0)] {
                let moment = times(stiffness, curvature);
                assert!((0..2).all(|a| (moment[a] - expected * curvature[a]).abs() < 1e-12), "{plane_deg}");
            }
        }
        assert_eq!(Section::straight(50.0, 0.4, 12.0).stiffness_nmm2(), (12.0, [0.0; 3]));
        // Half of the energy of each plane at 45°, and the twist of the solid ellipse of both stiffnesses.
        let bent = Section { rest_curvature_per_mm: [0.1, 0.1], ..flat(0.0, 2.0) };
        assert!((bent.straightening_n() - 0.5 * 0.01 * (2.0 + 12.0)).abs() < 1e-15);
        assert!((bent.torsion_nmm2() - 2.0 * 2.0 * 12.0 / (2.0 + 12.0) / 1.3).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_soft_plane_is_refused_by_key() {
        assert!(Device::new(vec![flat(0.0, 12.0), flat(-360.0, 0.012)]).is_ok());
        for (bad, begins) in [
            (
                flat(0.0, 12.1),
                "device.section[0].soft_plane.bending_stiffness_nmm2 = 12.1: must be from 0.012",
            ),
            (flat(0.0, 0.011), "device.section[0].soft_plane.bending_stiffness_nmm2 = 0.011"),
            (flat(0.0, f64::NAN), "device.section[0].soft_plane.bending_stiffness_nmm2 = NaN"),
            (flat(361.0, 3.0), "device.section[0].soft_plane.plane_deg = 361"),
            (flat(f64::INFINITY, 3.0), "device.section[0].soft_plane.plane_deg = inf"),
        ] {
            let error = Device::new(vec![bad]).unwrap_err().to_string();
            assert!(error.starts_with(begins), "{error}");
        }
        let coil = Device::new(vec![flat(0.0, 3.0); 2]).unwrap().with_coil(50.0).unwrap_err().to_string();
        assert!(coil.contains("soft plane"), "{coil}");
    }
}
