//! The reaction of a clamp at the start of a rod, and the force that pushes the rod through it.

use super::frame::Frame;
use super::layout::{Layout, MAX_ANGLES};
use super::share::{bent_by, times};
use super::state::RodState;
use crate::Vec3;

/// What the clamp at the first node exerts on the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clamp {
    /// Force.
    pub force: Vec3,
    /// Moment across the tangent.
    pub moment: Vec3,
    /// Moment along the tangent, on all instruments together; 0 without angles.
    pub torque: f64,
    /// Moment along the tangent on the instrument of each set of angles.
    pub torques: [f64; MAX_ANGLES],
}

impl Clamp {
    /// From the residual rows of the first node before they were held
    /// (`Newton::start_residual` of the solver).
    pub(crate) fn new<const C: usize>(rows: &[f64; C], state: &RodState) -> Self {
        let l = Layout::<C>;
        let (x, t) = (l.position(0), l.tangent(0));
        let frame = &state.frames[0];
        let mut torques = [0.0; MAX_ANGLES];
        for (set, torque) in torques.iter_mut().enumerate().take(Layout::<C>::ANGLES) {
            *torque = rows[l.angle(0, set)];
        }
        Self {
            force: Vec3::new(rows[x], rows[x + 1], rows[x + 2]),
            moment: frame.v * rows[t] - frame.u * rows[t + 1],
            torque: torques.iter().sum(),
            torques,
        }
    }

    /// Force needed to hold the rod in the clamp, a rigid, straight, frictionless sleeve; positive pushes it in,
    /// negative pulls it back.
    ///
    /// F = −n·t − ½EI|t′|² − ½GJτ² with n the internal force. The terms after the first are configurational: the
    /// energy that the next piece stores as it leaves the sleeve. F is the derivative of the total potential energy,
    /// sleeve included, by the length outside. `bending`, `torsion` and `rest_curvature` (as a vector across the
    /// tangent) are those of the rod in the clamp.
    pub fn push_force(&self, tangent: &Vec3, bending: f64, torsion: f64, rest_curvature: &Vec3) -> f64 {
        // The clamp balances −EI(t′ − κ⁰): t′ from its moment is more accurate than t′ of the cubic.
        let bend = rest_curvature - self.moment.cross(tangent) / bending;
        self.force.dot(tangent)
            - 0.5 * bending * bend.norm_squared()
            - 0.5 * self.torque * self.torque / torsion
    }

    /// The same for a rod that is stiffer in some planes than in others: F = −n·t − ½t′ᵀBt′ − ½GJτ². Its stiffness B
    /// ([`Material`](super::Material)) and its rest curvature are along the directions of its material triad.
    pub(crate) fn skew_push_force(
        &self,
        material: &Frame,
        stiffness: (f64, [f64; 3]),
        torsion: f64,
        rest_curvature: [f64; 2],
    ) -> f64 {
        let moment = self.moment.cross(&material.t);
        let by = bent_by(stiffness, [material.u, material.v].map(|axis| axis.dot(&moment)));
        let bend = [0, 1].map(|axis| rest_curvature[axis] - by[axis]);
        let held = times(stiffness, bend);
        self.force.dot(&material.t)
            - 0.5 * (held[0] * bend[0] + held[1] * bend[1])
            - 0.5 * self.torque * self.torque / torsion
    }
}
