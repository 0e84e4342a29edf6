//! Stopping criterion, and when the residual is assembled without the matrix.
//!
//! A state is an equilibrium when its residual is within the tolerance, or at the level of rounding and no longer
//! decreasing ([`ResidualSize`]).

use super::newton::ENERGY_ROUNDING;
use super::report::{StepRecord, StopReason};
use super::residual::ResidualSize;
use crate::tuning::NewtonTuning;

/// A relative residual below this that no longer decreases is rounding.
const ROUNDED: f64 = 1e-6;

/// Progress of the iteration since it began, or since it left a saddle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Smallest relative residual.
    best: f64,
    /// Number of consecutive states that did not halve it.
    stalled: usize,
    /// Rotation of the last step, rad, if it was a full Newton step; otherwise infinite. Changes of axial force count
    /// as rotations.
    last_turn: f64,
    tuning: NewtonTuning,
}

impl Progress {
    pub(super) fn new(tuning: &NewtonTuning) -> Self {
        Self { best: f64::INFINITY, stalled: 0, last_turn: f64::INFINITY, tuning: *tuning }
    }

    /// Records a step.
    pub(super) fn has_turned(&mut self, turn: f64) {
        self.last_turn = turn;
    }

    /// Whether the next state is assembled with its matrix.
    pub(super) fn wants_hessian(&self, tolerance: f64) -> bool {
        !residual_alone(self.last_turn, tolerance, &self.tuning)
    }

    /// Whether another step with the factors of an earlier state will reach the tolerance. If steps no longer reduce
    /// the residual, the matrix of the state itself is needed: with factors from before a contact opened or closed,
    /// steps may alternate for ever.
    pub(super) fn shrinks_enough(&self, size: &ResidualSize, tolerance: f64) -> bool {
        size.relative < 0.5 * self.best && self.tuning.chord * self.last_turn * size.relative <= tolerance
    }

    /// Records the residual of a state; returns whether it is an equilibrium.
    ///
    /// Rounding in the stiffest rows hides errors in the others. If steps with factors of an earlier state cease to
    /// reduce the residual, the length of the last step shows the remaining distance.
    pub(super) fn has_arrived(&mut self, size: &ResidualSize, tolerance: f64, steps: &[StepRecord]) -> bool {
        self.stalled = if size.relative < 0.5 * self.best { 0 } else { self.stalled + 1 };
        self.best = self.best.min(size.relative);
        let is_rounding = |s: &StepRecord| s.energy_change.abs() <= ENERGY_ROUNDING * s.energy_scale;
        let tiny_steps = steps.len() >= 3 && steps.iter().rev().take(3).all(is_rounding);
        size.small
            || (size.rounding
                && self.stalled >= if self.last_turn <= tolerance { 1 } else { self.tuning.hidden })
            || (self.stalled >= 3 && tiny_steps && size.relative < ROUNDED)
    }

    /// Whether the smallest residual is at the level of rounding, if no step lowers the merit.
    pub(super) fn is_at_rounding(&self) -> bool {
        self.best < ROUNDED
    }
}

impl ResidualSize {
    /// The reason for stopping at an equilibrium.
    pub(super) fn reason(&self) -> StopReason {
        if self.small { StopReason::Converged } else { StopReason::RoundingFloor }
    }
}

/// Whether, after a full Newton step that turned nodes by at most `last_turn`, only the residual is assembled.
fn residual_alone(last_turn: f64, tolerance: f64, tuning: &NewtonTuning) -> bool {
    last_turn <= tuning.short_rad
        || (last_turn <= tuning.near_rad && tuning.quadratic * last_turn * last_turn <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 1e-9;

    #[test]
    fn what_rounding_hides_shows_in_the_last_turn() {
        let size = |relative: f64| ResidualSize { relative, small: false, rounding: true };
        // Number of states at rounding before the iteration stops, each after a step with this rotation.
        let looks = |turn: f64| {
            let mut progress = Progress::new(&NewtonTuning::DEFAULT);
            assert!(!progress.has_arrived(&size(2e-8), TOLERANCE, &[]));
            let arrives = |progress: &mut Progress| {
                progress.has_turned(turn);
                progress.has_arrived(&size(1.9e-8), TOLERANCE, &[])
            };
            (1..10).find(|_| arrives(&mut progress))
        };
        assert_eq!(
            (looks(0.9 * TOLERANCE), looks(2.0 * TOLERANCE)),
            (Some(1), Some(NewtonTuning::DEFAULT.hidden))
        );
    }
}
