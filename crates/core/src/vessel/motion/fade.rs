//! The region of a mode of a motion.
//!
//! With ρ = |X − m| the distance from a centre m, and τ = (ρ − r)/l from 0 to 1 over a shell of thickness l,
//!
//! ```text
//! s(τ) = τ³ (10 − 15 τ + 6 τ²),    s′ = 30 τ² (1 − τ)²,    s″ = 60 τ (1 − τ)(1 − 2τ)
//! ```
//!
//! has s = s′ = s″ = 0 at its start and 1, 0, 0 at its end, and s′ ≤ 15/8. A mode is weighted with s, zero in the
//! middle, or with 1 − s, zero outside. With e = (X − m)/ρ
//!
//! ```text
//! ∇s = s′/l e,    ∇∇s = s″/l² e eᵀ + s′/(l ρ) (I − e eᵀ)
//! ```

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::Vec3;

/// Largest s′.
const STEEPEST: f64 = 15.0 / 8.0;

/// A ball and the shell around it in which a motion fades.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Around {
    /// Centre, mm.
    pub centre_mm: [f64; 3],
    /// Radius of the ball, mm.
    pub radius_mm: f64,
    /// Thickness of the shell, mm.
    pub fade_mm: f64,
}

/// The weight of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fade {
    pub(super) around: Around,
    /// Whether the ball rests and everything outside moves, or the opposite.
    pub(super) still: bool,
}

impl Fade {
    pub(super) fn centre(&self) -> Vec3 {
        Vec3::from(self.around.centre_mm)
    }

    /// Upper bound of |∇w|, 1/mm.
    pub(super) fn steepest(&self) -> f64 {
        STEEPEST / self.around.fade_mm
    }

    /// Distance from the centre beyond which the weight is constant, mm.
    pub(super) fn outer_mm(&self) -> f64 {
        self.around.radius_mm + self.around.fade_mm
    }

    /// The weight at this distance from the centre.
    pub(super) fn at_mm(&self, rho_mm: f64) -> f64 {
        let t = ((rho_mm - self.around.radius_mm) / self.around.fade_mm).clamp(0.0, 1.0);
        let share = t * t * t * (10.0 + t * (6.0 * t - 15.0));
        if self.still { share } else { 1.0 - share }
    }

    /// Weight, gradient and Hessian.
    pub(super) fn derivatives(&self, x: &Vec3) -> (f64, Vec3, Matrix3<f64>) {
        let (off, l) = (x - self.centre(), self.around.fade_mm);
        let rho = off.norm();
        let weight = self.at_mm(rho);
        let t = (rho - self.around.radius_mm) / l;
        if rho == 0.0 || !(0.0..1.0).contains(&t) {
            return (weight, Vec3::zeros(), Matrix3::zeros());
        }
        let sign = if self.still { 1.0 } else { -1.0 };
        let first = sign * 30.0 * t * t * (1.0 - t) * (1.0 - t) / l;
        let second = sign * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (l * l);
        let e = off / rho;
        let along = e * e.transpose();
        (weight, e * first, along * second + (Matrix3::identity() - along) * (first / rho))
    }
}
