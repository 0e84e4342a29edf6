//! How a part of a command is solved, what it may cost, and its result.

use serde::{Deserialize, Serialize};

use super::balance::Balance;
use crate::Vec3;
use crate::solve::{NewtonReport, StopReason};

/// How a part of a command is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Effort {
    /// For the equilibrium near the prediction, with friction following the contact forces.
    Near,
    /// As `Near`, with friction held at the normal forces of the start of the part; then the device slides to rest.
    Held,
    /// By relaxation to where the device comes to rest, however far away.
    Flight,
}

/// Limits of the cost of a part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Largest number of Newton iterations.
    pub(super) iterations: usize,
    /// Largest number of linear solves.
    pub(super) solves: usize,
}

/// Result of a part of a command.
pub(super) struct Found {
    /// Number of slides with the hand held still.
    pub(super) slides: u32,
    /// Energy dissipated by friction outside the body, mJ.
    pub(super) outside_mj: f64,
    /// Residual, relative to the force scale.
    pub(super) residual: f64,
    /// Relative difference of the normal forces of friction from the contact forces.
    pub(super) unsettled: f64,
    /// Whether it is an equilibrium.
    pub(super) balanced: bool,
    /// Whether the solves were used up on the way to where the device comes to rest.
    pub(super) is_interrupted: bool,
    /// Whether more energy is stored and dissipated than was put in: then the motion of this part cannot lead there.
    pub(super) lacks: bool,
    /// Distance from the prediction, as a fraction of the allowed one.
    pub(super) off: f64,
    /// The node that is farthest from its prediction, mm.
    pub(super) farthest_mm: Vec3,
    /// Energy balance of the part.
    pub(super) balance: Balance,
}

/// Why a part failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Lost {
    /// The prediction is beyond the wall, or has passed through the device itself.
    Beyond,
    /// The solution is.
    Passed,
    /// Energy appeared from nowhere, or disappeared in a part that is too long to show a jump.
    Unbalanced,
    /// No equilibrium was found; with the residual relative to the force scale.
    Unsolved(StopReason, f64),
    /// The linear solves of the command were used up.
    UnderWay,
}

impl Lost {
    /// The failure of a solution, if it is one. `near` is whether it must be an equilibrium, `used_up` whether its
    /// linear solves are, and `left` whether it is farther from its prediction than allowed.
    pub(super) fn of(
        found: &NewtonReport,
        (near, used_up): (bool, bool),
        balanced: bool,
        left: bool,
    ) -> Option<Self> {
        let folded = !found.residual.is_finite() || found.reason == StopReason::Folded;
        let reason = match (near, found.converged) {
            (true, false) if used_up => return Some(Self::UnderWay),
            (true, false) => found.reason,
            (true, true) if !balanced => StopReason::Unsettled,
            (true, true) if left => StopReason::Left,
            (false, _) if folded => found.reason,
            _ => return None,
        };
        Some(Self::Unsolved(reason, found.residual))
    }
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Beyond => f.write_str("the device would be predicted beyond the wall or through itself"),
            Self::Passed => f.write_str("the device would pass through the wall"),
            Self::Unbalanced => {
                f.write_str("what was put in, what is stored and what friction took do not agree")
            }
            Self::Unsolved(reason, residual) => write!(f, "{reason} (residual {residual:.1e})"),
            Self::UnderWay => f.write_str("the linear solves of the command are used up"),
        }
    }
}
