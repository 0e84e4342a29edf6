//! Options and results of Newton's method.

use crate::banded::Inertia;
use crate::tuning::NewtonTuning;

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NewtonOptions {
    /// Largest number of iterations (steps).
    pub max_iterations: usize,
    /// Largest number of linear solves, including those for contacts and shifts within iterations. No iteration
    /// begins once they are used up; the last one may exceed the limit, by a hundred where contacts of coils change.
    pub max_solves: usize,
    /// Residual, relative to the force scale, below which a state is an equilibrium.
    pub tolerance: f64,
    /// Whether to find a minimum (or any equilibrium, as continuation does).
    pub minimum: bool,
    /// Shift of the last step of a solution that this one continues, 0 if there is none: shifts are tried from a
    /// fraction of it on.
    pub last_shift: f64,
    /// Numbers of the method that are choices.
    pub tuning: NewtonTuning,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            max_iterations: 500,
            max_solves: usize::MAX,
            tolerance: 1e-10,
            minimum: true,
            last_shift: 0.0,
            tuning: NewtonTuning::DEFAULT,
        }
    }
}

/// Why Newton's method stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopReason {
    /// The residual is below its tolerance.
    Converged,
    /// The residual is as small as rounding permits on this mesh.
    RoundingFloor,
    /// The iterations or linear solves allowed are used up.
    MaxIterations,
    /// No step along the search direction lowers the merit.
    NoDescent,
    /// The matrix stayed singular or of wrong inertia under every shift tried.
    Singular,
    /// An iterate was too far from the predicted state.
    Left,
    /// An equilibrium, but friction does not follow the current normal forces of the wall.
    Unsettled,
    /// An element bends more than its interpolation can represent
    /// (`RodState::is_folded`).
    Folded,
    /// The state or the matrix contains a number that is not finite.
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
pub(crate) struct StepRecord {
    /// Change of the potential energy.
    pub energy_change: f64,
    /// Change of the merit: the energy, plus the weighted errors of the end conditions.
    pub merit_change: f64,
    /// Magnitude of the energies whose difference is the change; changes below 1e-13 of it are rounding.
    pub energy_scale: f64,
    /// Relative residual before the step.
    pub residual: f64,
    /// Fraction of the Newton step taken.
    pub fraction: f64,
    /// Shift used.
    pub shift: f64,
}

/// How a solution was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NewtonReport {
    /// Steps taken.
    pub iterations: usize,
    /// Linear solves taken.
    pub solves: usize,
    /// Relative residual of the final state.
    pub residual: f64,
    /// Inertia of the final matrix.
    pub inertia: Inertia,
    /// Number of negative pivots at a minimum.
    pub multipliers: usize,
    /// Whether the final state is a minimum (neutral directions allowed).
    pub stable: bool,
    /// Whether the final state is an equilibrium.
    pub converged: bool,
    /// Why the method stopped.
    pub reason: StopReason,
}

impl NewtonReport {
    /// The initial report, without a solution; a minimum has `multipliers` negative pivots.
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

    /// Whether the final residual is at most `tolerance`, or at the rounding floor.
    pub(crate) fn is_within(&self, tolerance: f64) -> bool {
        self.residual <= tolerance || self.reason == StopReason::RoundingFloor
    }

    /// The report of an equilibrium.
    pub(super) fn converged(self, reason: StopReason) -> Self {
        Self { converged: true, reason, ..self }
    }

    /// The report of a solution that failed.
    pub(crate) fn stopped(self, reason: StopReason) -> Self {
        Self { reason, converged: false, ..self }
    }
}
