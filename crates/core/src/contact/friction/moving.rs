//! Friction on a wall that moves.
//!
//! A point slips from where the material point of the vessel under it has moved: a becomes χ(a), with χ from the
//! vessel before the step to the one after. With G = ∂χ/∂x its direction becomes that of G t and the normal of the
//! wall that of G⁻ᵀn; a wall that turns about the device by α shifts the reference angle of the device's spin,
//!
//! ```text
//! α = atan2(½ (G − Gᵀ)^∨·t, ½ (tr G − t·G t))
//! ```
//!
//! which is the rotation angle of G if G is a rotation about t; (A)^∨ is the vector with (A)^∨ × v = A v.

use super::slider::Slider;
use crate::Vec3;
use crate::vessel::Displacement;

impl Slider {
    /// Moves the reference with the wall; returns how far, mm.
    pub(super) fn carry(&mut self, before: &Displacement, after: &Displacement) -> f64 {
        let material = self.material.unwrap_or_else(|| before.material(&self.from_mm));
        self.material = Some(material);
        let (there, turned) = after.since(before, &material);
        let way_mm = (there - self.from_mm).norm();
        self.from_mm = there;
        let axial =
            Vec3::new(turned.m32 - turned.m23, turned.m13 - turned.m31, turned.m21 - turned.m12) * 0.5;
        let t = self.along;
        self.from_rad += libm::atan2(axial.dot(&t), 0.5 * (turned.trace() - t.dot(&(turned * t))));
        self.along = (turned * t).normalize();
        // G⁻ᵀ = (F F₀⁻¹)⁻ᵀ.
        let across = turned.try_inverse().map_or(turned, |inverse| inverse.transpose());
        for normal in [&mut self.normal, &mut self.begun.0, &mut self.seen.0] {
            *normal = (across * *normal).try_normalize(0.0).unwrap_or_default();
        }
        way_mm
    }
}
