//! What Newton's method is told and what it tells.

use crate::banded::Inertia;

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Iterations (steps) allowed.
    pub max_iterations: usize,
    /// Linear solves allowed, those included that look for contacts and for the shift of an iteration: no iteration begins when they are used
    /// up, and the last may take a few more.
    pub max_solves: usize,
    /// Residual over force scale below which a state is an equilibrium.
    pub tolerance: f64,
    /// Largest rotation of a node in one step, in radians. Somewhat less than a right angle is best: a dead load across a rod turns it
    /// by no more.
    pub max_turn: f64,
    /// Whether to look for a minimum (or take any equilibrium, as continuation does).
    pub minimum: bool,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { max_iterations: 500, max_solves: usize::MAX, tolerance: 1e-10, max_turn: 1.4, minimum: true }
    }
}

/// Why Newton's method stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The residual is below its tolerance.
    Converged,
    /// The residual is as small as rounding lets it be on this mesh.
    RoundingFloor,
    /// The iterations or linear solves allowed are used up.
    MaxIterations,
    /// No step along the search direction lowers the merit.
    NoDescent,
    /// The matrix stayed singular or of wrong inertia under every shift.
    Singular,
    /// It has come too far from where the state was predicted.
    Left,
    /// It is one with normal forces of friction that are not those of the wall.
    Unsettled,
    /// An element bends farther than it can say ([`RodState::is_folded`](crate::rod::RodState::is_folded)).
    Folded,
    /// The state or the matrix holds a number that is not finite.
    NotFinite,
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::RoundingFloor => "converged to rounding level",
            Self::MaxIterations => "iterations used up",
            Self::NoDescent => "no step lowers the energy",
            Self::Singular => "the stiffness matrix is singular",
            Self::Left => "what was found is far from where the device was predicted",
            Self::Unsettled => "friction and wall forces do not settle",
            Self::Folded => "an element would bend by more than 120°: give shorter elements",
            Self::NotFinite => "a number is not finite",
        })
    }
}

/// One accepted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRecord {
    /// Change of the potential energy.
    pub energy_change: f64,
    /// Change of the merit: the energy, plus the weighted gaps of the end conditions.
    pub merit_change: f64,
    /// Size of the energies the change is a difference of; changes below 1e-13 of it are rounding.
    pub energy_scale: f64,
    /// Relative residual before the step.
    pub residual: f64,
    /// Part of the Newton step taken.
    pub fraction: f64,
    /// Shift used.
    pub shift: f64,
}

/// How a solution was found.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonReport {
    /// Steps taken.
    pub iterations: usize,
    /// Linear solves taken.
    pub solves: usize,
    /// Relative residual of the final state.
    pub residual: f64,
    /// Inertia of the final matrix.
    pub inertia: Inertia,
    /// Negative pivots a minimum has.
    pub multipliers: usize,
    /// Whether the final state is a minimum (neutral directions allowed).
    pub stable: bool,
    /// Whether the final state is an equilibrium.
    pub converged: bool,
    /// Why the method stopped.
    pub reason: StopReason,
}

impl NewtonReport {
    /// Nothing is found yet; a minimum has `multipliers` negative pivots.
    pub(super) fn of(multipliers: usize) -> Self {
        Self {
            iterations: 0,
            solves: 0,
            residual: f64::INFINITY,
            inertia: Inertia::default(),
            multipliers,
            stable: false,
            converged: false,
            reason: StopReason::MaxIterations,
        }
    }

    /// Whether it ended at this residual or less, or at what rounding leaves of one.
    pub(crate) fn is_within(&self, tolerance: f64) -> bool {
        self.residual <= tolerance || self.reason == StopReason::RoundingFloor
    }

    /// An equilibrium.
    pub(super) fn converged(self, reason: StopReason) -> Self {
        Self { converged: true, reason, ..self }
    }

    /// None.
    pub(crate) fn stopped(self, reason: StopReason) -> Self {
        Self { reason, converged: false, ..self }
    }
}
