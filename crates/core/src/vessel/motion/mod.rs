//! A vessel that moves: breathing, heartbeat, posture.
//!
//! A material point X of the vessel in its file, the *reference*, is at x = X + u(X, t). The field is a sum of modes
//!
//! ```text
//! u(X, t) = Σ w(X) v(X, t),    v(X, t) = (R(a(t) θ) − I)(X − c) + a(t) d
//! ```
//!
//! each a displacement d and a rotation θ about an axis through c, with a waveform a(t) from 0 to 1 and a weight w(X)
//! that fades over a shell about a point ([`Around`]). u and its first two derivatives in X are continuous:
//!
//! ```text
//! ∂u/∂X   = Σ w (R − I) + v ∇wᵀ
//! ∂²uₖ/∂X² = Σ vₖ ∇∇w + ∇w Aₖ + Aₖᵀ ∇wᵀ    with Aₖ the k-th row of R − I
//! ```
//!
//! Queries of the moved vessel at x become queries of the reference at X ([`Displacement::material`]), where nothing
//! has to be recomputed. Existence and uniqueness of X, and that it is on the same side of the wall, follow from
//! |∂u/∂X| < 1/2 everywhere, which is checked in advance from |R − I| = 2 sin(θ/2), |∇w| ≤ 15/8 per fade and the
//! largest |v| in its shell.

mod displacement;
mod fade;
mod mode;
#[cfg(test)]
mod tests;

pub use displacement::{Displacement, Local};
pub use fade::Around;
pub use mode::{MotionMode, Turn, Waveform};

use crate::error::number;
use crate::{Error, Result, Vec3};
use mode::Mode;

/// Upper bound of |∂u/∂X|.
const STEEPEST: f64 = 0.5;

/// A checked motion of a vessel.
#[derive(Debug, Clone, PartialEq)]
pub struct VesselMotion {
    modes: Vec<Mode>,
    /// Upper bound of |∂u/∂X|.
    steepest: f64,
}

impl VesselMotion {
    /// The motion with these modes; `None` without modes.
    ///
    /// # Errors
    /// Values out of range, contradictory keys, and a field that strains or rotates the vessel by half or more.
    pub fn new(modes: &[MotionMode]) -> Result<Option<Self>> {
        if modes.is_empty() {
            return Ok(None);
        }
        let each = modes.iter().enumerate();
        let modes = each.map(|(index, mode)| mode.check(&format!("vessel.motion[{index}]")));
        let modes = modes.collect::<Result<Vec<_>>>()?;
        // One turn of the whole vessel, however large, and displacements of the whole leave all lengths as they are.
        let is_rigid =
            !modes.iter().any(Mode::fades) && modes.iter().filter(|mode| mode.turns()).count() <= 1;
        let steepest = if is_rigid { 0.0 } else { modes.iter().map(Mode::steepest).sum::<f64>() };
        // NaN is rejected too.
        if steepest.is_nan() || steepest >= STEEPEST {
            let remedy = format!(
                "neighbouring points of the vessel would move apart by up to so much of their distance: it must stay below {STEEPEST}; \
                 move or turn less (a turn alone counts as 2 sin of half its angle), or fade over a longer way (fade_mm)"
            );
            return Err(Error::parameter("vessel.motion", number(steepest), remedy));
        }
        Ok(Some(Self { modes, steepest }))
    }

    /// The field at a time, s.
    pub fn at(&self, time_s: f64) -> Displacement {
        Displacement::new(
            self.modes.iter().map(|mode| mode.at(mode.amplitude(time_s))).collect(),
            self.steepest,
        )
    }

    /// Whether the vessel's position depends on time.
    pub fn changes(&self) -> bool {
        self.modes.iter().any(Mode::changes)
    }

    /// Upper bound of the displacement of any point within `within_mm` of `place`, mm.
    pub(crate) fn farthest_mm(&self, place: &Vec3, within_mm: f64) -> f64 {
        self.modes.iter().map(|mode| mode.farthest_mm(place, within_mm)).sum()
    }
}
