//! What contacts exert on the wall at the base, and how that changes with where they are.

use nalgebra::Matrix3;

use super::{PointPlace, WallContact};
use crate::Vec3;
use crate::contact::set::Geometry;
use crate::rod::RodState;

/// A contact, elastic and with friction, at a state that was assembled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reaction {
    /// Its point of the device.
    pub(crate) place: PointPlace,
    /// The material point of the vessel there.
    pub(crate) material: Vec3,
    /// Force on the wall, N: the gradient of the energies in the position of the point.
    pub(crate) force_n: Vec3,
    /// Derivatives of that in the position relative to the wall, N/mm, and in the material angle, N.
    pub(crate) stiffness: Matrix3<f64>,
    pub(crate) by_angle: Vec3,
    /// Derivatives of friction's force, N, and of its couple about the device, N·mm, where ε gets smaller in proportion.
    pub(crate) by_stick: (Vec3, f64),
}

impl WallContact<'_> {
    /// All contacts at the state assembled last.
    pub(crate) fn reactions(&self, state: &RodState) -> Vec<Reaction> {
        let mut all = Vec::new();
        for span in self.cache.spans.iter().filter(|span| span.at_base) {
            for index in span.points.clone() {
                let (point, known) = (&self.points[index], &self.cache.points[index]);
                let material = known.base;
                let mut reaction = Reaction {
                    place: point.place(),
                    material,
                    force_n: Vec3::zeros(),
                    stiffness: Matrix3::zeros(),
                    by_angle: Vec3::zeros(),
                    by_stick: (Vec3::zeros(), 0.0),
                };
                if let (Some(pressed), Some(d)) = (self.pressed(index), self.cache.pressed(index)) {
                    reaction.force_n = pressed.gradient;
                    reaction.stiffness = pressed.hessian(d, known.force_n);
                }
                let place = self.base_place(index);
                if let Some(friction) = self.friction.derivatives(index, &place, point.angle(state)) {
                    reaction.force_n += friction.gradient;
                    reaction.stiffness += friction.hessian;
                    reaction.by_angle = friction.mixed;
                    let slip_mm = friction.slip_mm;
                    reaction.by_stick = (friction.hessian * slip_mm, friction.mixed.dot(&slip_mm));
                }
                if reaction.force_n != Vec3::zeros() || reaction.stiffness != Matrix3::zeros() {
                    all.push(reaction);
                }
            }
        }
        all
    }

    /// ε of friction on the wall, mm; infinite without friction.
    pub(crate) fn stick_mm(&self) -> f64 {
        self.friction.stick_mm()
    }

    /// A negligible force, N.
    pub(crate) fn negligible_n(&self) -> f64 {
        self.least_force_n()
    }
}
