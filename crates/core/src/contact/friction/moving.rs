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

use nalgebra::Matrix3;

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

/// Derivatives of where slip begins once the wall has moved, in where it began before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarriedSlopes {
    /// Of the place, and in the place.
    pub(crate) place: Matrix3<f64>,
    /// Of the direction in the place and in the direction.
    pub(crate) direction: [Matrix3<f64>; 2],
    /// Of the angle in the place and in the direction.
    pub(crate) spin: [Vec3; 2],
}

/// Step of differences of places, mm, and of directions.
const STEP: [f64; 2] = [1e-4, 1e-6];

impl CarriedSlopes {
    /// Of a device at this place with this direction.
    pub(crate) fn at(
        (place, direction): (Vec3, Vec3),
        (before, after): (&Displacement, &Displacement),
    ) -> Self {
        let carried = |place: Vec3, direction: Vec3| {
            let mut slider = Slider::at((place, direction), (0.0, 0.0), 0.0);
            slider.carry(before, after);
            (slider.from_mm, slider.along, slider.from_rad)
        };
        let side = |kind: usize, axis: usize, sign: f64| {
            let way = Vec3::ith(axis, sign * STEP[kind]);
            if kind == 0 { carried(place + way, direction) } else { carried(place, direction + way) }
        };
        let column = |kind: usize, axis: usize| {
            let (less, more, by) = (side(kind, axis, -1.0), side(kind, axis, 1.0), 0.5 / STEP[kind]);
            ((more.0 - less.0) * by, (more.1 - less.1) * by, (more.2 - less.2) * by)
        };
        let [by_place, by_direction] = [0, 1].map(|kind| [0, 1, 2].map(|axis| column(kind, axis)));
        Self {
            place: Matrix3::from_columns(&by_place.map(|column| column.0)),
            direction: [by_place, by_direction].map(|by| Matrix3::from_columns(&by.map(|column| column.1))),
            spin: [by_place, by_direction].map(|by| Vec3::from(by.map(|column| column.2))),
        }
    }
}
