//! Coulomb's law, lagged: friction of any contact with the normal force of a base. Walls and pairs share it.
//!
//! See [`super`] for the potential μ N φ(|u|). Here are its derivatives, and what a step dissipates.

use nalgebra::Matrix3;

use super::LEAST_STICK_MM;
use super::follow::Renewal;
use super::slider::Slider;
use crate::Vec3;
use crate::tuning::FrictionTuning;

/// Derivatives of the friction energy of a contact in its position and its angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrictionDerivatives {
    /// In the position, N: minus the friction force on the device.
    pub gradient: Vec3,
    /// Second derivative in the position, N/mm.
    pub hessian: Matrix3<f64>,
    /// In the angle, N·mm.
    pub turn: f64,
    /// Second derivative in the angle, N·mm.
    pub turn2: f64,
    /// Mixed derivative, N.
    pub mixed: Vec3,
    /// Slip, mm.
    pub slip_mm: Vec3,
}

/// The law of friction in one step.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::contact) struct Coulomb {
    /// μ; 0 disables friction.
    pub(in crate::contact) coefficient: f64,
    /// ε, mm.
    pub(in crate::contact) stick_mm: f64,
    /// Lower bound of ε as it shrinks while the hand holds still, mm.
    pub(super) least_stick_mm: f64,
    pub(super) renewal: Renewal,
    /// Energy dissipated before slip was reset, mJ.
    pub(super) taken_mj: f64,
    /// Numbers that are choices.
    pub(in crate::contact) tuning: FrictionTuning,
}

impl Coulomb {
    /// Friction of coefficient μ ≥ 0.
    pub(in crate::contact) fn new(coefficient: f64, tuning: &FrictionTuning) -> Self {
        Self { coefficient, tuning: *tuning, ..Self::default() }
    }

    /// Whether there is friction.
    #[inline]
    pub(in crate::contact) fn acts(&self) -> bool {
        self.coefficient > 0.0
    }

    /// Begins a step: nothing is dissipated yet.
    pub(in crate::contact) fn begin(&mut self) {
        self.release();
        self.taken_mj = 0.0;
    }

    /// Sets ε and its lower bound, mm.
    pub(in crate::contact) fn stick_within(&mut self, [stick_mm, least_mm]: [f64; 2]) {
        (self.stick_mm, self.least_stick_mm) = (stick_mm, least_mm);
    }

    /// The largest force of friction, N.
    #[inline]
    pub(in crate::contact) fn largest_n(&self, slider: &Slider) -> f64 {
        self.coefficient * slider.force_n
    }

    /// Friction force divided by its `slip`, N/mm.
    #[inline]
    pub(in crate::contact) fn resistance(&self, slider: &Slider, slip: &Vec3) -> f64 {
        self.largest_n(slider) * rates(slip.norm(), self.stick_mm).0
    }

    /// Friction energy of a contact at a place and an angle, mJ.
    #[inline]
    pub(in crate::contact) fn value(&self, slider: &Slider, x: &Vec3, angle: f64) -> f64 {
        let force = self.largest_n(slider);
        if force == 0.0 {
            return 0.0;
        }
        force * phi(slider.slip(x, angle).0.norm(), self.stick_mm)
    }

    /// Derivatives of the friction energy; `None` without a normal force.
    #[inline]
    pub(in crate::contact) fn derivatives(
        &self,
        slider: &Slider,
        x: &Vec3,
        angle: f64,
    ) -> Option<FrictionDerivatives> {
        if !slider.holds() {
            return None;
        }
        let (slip, spin) = slider.slip(x, angle);
        let plane = Matrix3::identity() - slider.normal * slider.normal.transpose();
        let (gradient, hessian) = force_of_slip(self.largest_n(slider), &plane, &slip, self.stick_mm);
        let mixed = hessian * spin;
        Some(FrictionDerivatives {
            gradient,
            hessian,
            turn: gradient.dot(&spin),
            turn2: mixed.dot(&spin),
            mixed,
            slip_mm: slip,
        })
    }

    /// Derivatives of the friction force and moment of a slider, at this place and angle, in its normal.
    pub(in crate::contact) fn by_normal(
        &self,
        slider: &Slider,
        (x, angle): (&Vec3, f64),
    ) -> (Matrix3<f64>, Vec3) {
        let (slip, spin) = slider.slip(x, angle);
        let (way, normal) = (x - slider.from_mm, slider.normal);
        let (force, along) =
            force_of_slip(self.largest_n(slider), &Matrix3::identity(), &slip, self.stick_mm);
        let turn = slider.along.cross_matrix() * -slider.radius_mm;
        let by_normal = turn * (angle - slider.from_rad)
            - Matrix3::identity() * normal.dot(&way)
            - normal * way.transpose();
        let by_force = along * by_normal;
        (by_force, by_force.tr_mul(&spin) + turn.tr_mul(&force))
    }

    /// Derivatives of the friction force and moment of a slider, at this place and angle, in ε.
    pub(in crate::contact) fn by_stick(&self, slider: &Slider, (x, angle): (&Vec3, f64)) -> (Vec3, f64) {
        let (slip, spin) = slider.slip(x, angle);
        let part = slip.norm() / self.stick_mm;
        let force = slip * (2.0 * self.largest_n(slider) * (part - 1.0).min(0.0) / self.stick_mm.powi(2));
        (force, force.dot(&spin))
    }

    /// Lower and upper estimate of the energy dissipated in the step, mJ: with the normal forces of its start and of
    /// its end, at contacts with these places and angles.
    pub(in crate::contact) fn dissipated_mj<'a>(
        &self,
        at: impl Iterator<Item = (&'a Slider, Vec3, f64)>,
    ) -> (f64, f64) {
        let (mut at_start_mj, mut at_end_mj) = (0.0, 0.0);
        for (slider, x, angle) in at {
            let way_mm = self.dissipating_mm(slider, &x, angle);
            at_start_mj += self.coefficient * slider.begun.1 * way_mm;
            at_end_mj += self.coefficient * slider.force_n * way_mm;
        }
        // After slip was reset, the forces of the start no longer apply.
        if self.taken_mj != 0.0 {
            let taken_mj = self.taken_mj + at_end_mj;
            return (taken_mj, taken_mj);
        }
        (f64::min(at_start_mj, at_end_mj), f64::max(at_start_mj, at_end_mj))
    }

    /// The slip length over which friction dissipates energy, mm: 0 while sticking.
    fn dissipating_mm(&self, slider: &Slider, x: &Vec3, angle: f64) -> f64 {
        phi(slider.slip(x, angle).0.norm(), self.stick_mm) - phi(0.0, self.stick_mm)
    }

    /// Resets slip at these places and angles, and holds the normal forces there: the hand holds still, and the device
    /// slides on until it rests. Slip of a stuck contact is scaled to the new, smaller ε, so that friction holds it as
    /// before.
    pub(in crate::contact) fn anchor<'a>(&mut self, at: impl Iterator<Item = (&'a mut Slider, Vec3, f64)>) {
        self.hold();
        let smaller =
            Self { stick_mm: (self.stick_mm * self.tuning.stick_at_rest).max(self.least_stick_mm), ..*self };
        let (mut before_mj, mut after_mj) = (0.0, 0.0);
        for (slider, x, angle) in at {
            before_mj += self.largest_n(slider) * self.dissipating_mm(slider, &x, angle);
            let slip = slider.slip(&x, angle).0;
            let kept = slip * (smaller.stick_mm / slip.norm().max(self.stick_mm));
            slider.anchor(x - kept, angle);
            after_mj += self.largest_n(slider) * smaller.dissipating_mm(slider, &x, angle);
        }
        self.taken_mj += before_mj;
        self.taken_mj -= after_mj;
        self.stick_mm = smaller.stick_mm;
    }
}

/// ε for a step in which it is this fraction of what moves, and its lower bound while the hands hold still, mm.
pub(super) fn sticking_mm(stick_mm: f64, tuning: &FrictionTuning) -> [f64; 2] {
    [stick_mm, tuning.least_at_rest * stick_mm].map(|mm| mm.max(LEAST_STICK_MM))
}

/// Gradient of μ N φ in a slip in the wall's plane, N, and its derivative, N/mm.
#[inline]
fn force_of_slip(
    largest_n: f64,
    plane: &Matrix3<f64>,
    slip_mm: &Vec3,
    stick_mm: f64,
) -> (Vec3, Matrix3<f64>) {
    let y = slip_mm.norm();
    let (over, second) = rates(y, stick_mm);
    let unit = if y > 0.0 { slip_mm / y } else { Vec3::zeros() };
    let hessian = (plane * over + unit * unit.transpose() * (second - over)) * largest_n;
    (slip_mm * (largest_n * over), hessian)
}

/// φ(y) with ε = `e`.
#[inline]
pub(super) fn phi(y: f64, e: f64) -> f64 {
    if y >= e { y } else { y * y / e - y * y * y / (3.0 * e * e) + e / 3.0 }
}

/// φ′/y and φ″.
#[inline]
pub(super) fn rates(y: f64, e: f64) -> (f64, f64) {
    if y >= e { (1.0 / y, 0.0) } else { (2.0 / e - y / (e * e), 2.0 / e - 2.0 * y / (e * e)) }
}
