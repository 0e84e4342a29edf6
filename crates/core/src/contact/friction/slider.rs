//! A contact with friction: where it slips from, and the normal force that bounds its friction.

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// A contact in a step with friction. The slip of a pair is that of its first point relative to its second; it has no
/// angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::contact) struct Slider {
    /// a: where it slips from.
    pub(in crate::contact) from_mm: Vec3,
    /// The material point of the vessel there, if it has been carried along.
    pub(super) material: Option<Vec3>,
    /// θₐ: its material angle before the step.
    pub(in crate::contact) from_rad: f64,
    /// Direction of the device; zero where spin causes no slip.
    pub(in crate::contact) along: Vec3,
    /// r, mm.
    pub(in crate::contact) radius_mm: f64,
    /// Normal of the surface. Zero if a recalled force has not met a base yet.
    pub(in crate::contact) normal: Vec3,
    /// N: normal force, scaled down where the coefficient is below its largest value.
    pub(in crate::contact) force_n: f64,
    /// Normal and force at the start of the step.
    pub(in crate::contact) begun: (Vec3, f64),
    /// Normal and force at the last base.
    pub(super) seen: (Vec3, f64),
}

/// Normal force on a contact point at an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct NormalForce {
    /// Normal of the wall, into the lumen.
    pub(super) normal: Vec3,
    /// Force, scaled down where the coefficient is below its largest value, N.
    pub(super) force_n: f64,
}

impl Slider {
    /// A point of a device of that radius at x̄ with direction t̄, to where it has moved by `advance_mm` along its own
    /// curve, without normal force yet.
    #[inline]
    pub(super) fn at(
        (place_mm, along): (Vec3, Vec3),
        (from_rad, radius_mm): (f64, f64),
        advance_mm: f64,
    ) -> Self {
        let none = (Vec3::zeros(), 0.0);
        Self {
            from_mm: place_mm - along * advance_mm,
            material: None,
            from_rad,
            along,
            radius_mm,
            normal: none.0,
            force_n: none.1,
            begun: none,
            seen: none,
        }
    }

    /// With the normal force of the start of the step.
    #[inline]
    pub(in crate::contact) fn with(mut self, normal: Vec3, force_n: f64) -> Self {
        (self.normal, self.force_n) = (normal, force_n);
        self.begun = (normal, force_n);
        self
    }

    /// Slip at a place and an angle, and the direction in which its surface moves when it spins.
    #[inline]
    pub(in crate::contact) fn slip(&self, x: &Vec3, angle: f64) -> (Vec3, Vec3) {
        let spin = self.normal.cross(&self.along) * self.radius_mm;
        let way = x - self.from_mm;
        (way - self.normal * self.normal.dot(&way) + spin * (angle - self.from_rad), spin)
    }

    /// Whether it may be held by friction.
    #[inline]
    pub(in crate::contact) fn holds(&self) -> bool {
        self.force_n > 0.0
    }

    /// Whether it has no friction, now and at the start of the step.
    #[inline]
    pub(super) fn is_free(&self) -> bool {
        self.force_n == 0.0 && self.begun.1 == 0.0
    }

    /// Slips from there, with the normal force of the last base.
    pub(super) fn anchor(&mut self, from_mm: Vec3, from_rad: f64) {
        (self.from_mm, self.material, self.from_rad) = (from_mm, None, from_rad);
        self.force_n = self.seen.1;
        if self.seen.1 > 0.0 {
            self.normal = self.seen.0;
        }
    }

    /// Resets the normal force to that of the start of the step.
    pub(in crate::contact) fn rewind(&mut self) {
        (self.normal, self.force_n) = self.begun;
    }
}
