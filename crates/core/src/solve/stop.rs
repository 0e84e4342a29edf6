//! When the iteration has arrived, and when the residual alone says so.
//!
//! A state is an equilibrium when its residual is within the tolerance, or is what rounding leaves of it and no longer shrinks
//! ([`ResidualSize`]).

use super::newton::ENERGY_ROUNDING;
use super::report::{StepRecord, StopReason};
use super::residual::ResidualSize;

/// A whole Newton step that turned no node by more than this, in radians, ends so near to the equilibrium that the residual alone is
/// looked at, …
pub(super) const SHORT: f64 = 1e-5;
/// … or turned them so little that a method that converges quadratically is within the tolerance: by no more than `NEAR`, and the
/// square of the turn times `QUADRATIC` is no more than the tolerance, …
const NEAR: f64 = 1e-3;
/// … as it is
const QUADRATIC: f64 = 10.0;
/// … and another step with the same factors leaves a residual smaller by the last turn times no more than this.
const CHORD: f64 = 10.0;
/// States at rounding that did not halve their residual after which it is as small as it gets, though steps still turn nodes by more than
/// the tolerance.
const HIDDEN: usize = 3;
/// A residual that is as small as this, relative, and shrinks no more, is rounding.
const ROUNDED: f64 = 1e-6;

/// How far the iteration has come since it began, or since it left a saddle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Least relative residual.
    best: f64,
    /// States in a row that did not halve it.
    stalled: usize,
    /// Turn of the last step, rad, if it was a whole one of Newton's; infinite otherwise. Axial forces count as turns.
    last_turn: f64,
}

impl Default for Progress {
    fn default() -> Self {
        Self { best: f64::INFINITY, stalled: 0, last_turn: f64::INFINITY }
    }
}

impl Progress {
    /// Takes note of a step.
    pub(super) fn has_turned(&mut self, turn: f64) {
        self.last_turn = turn;
    }

    /// Whether the next state is assembled with its matrix.
    pub(super) fn wants_hessian(&self, tolerance: f64) -> bool {
        !residual_alone(self.last_turn, tolerance)
    }

    /// Whether another step with the factors of an earlier state leads to the tolerance. Where steps no longer shrink a residual, it
    /// takes the matrix of the state itself to say so: with factors from before a contact opened or closed, steps may lead to and fro
    /// for ever.
    pub(super) fn shrinks_enough(&self, size: &ResidualSize, tolerance: f64) -> bool {
        size.relative < 0.5 * self.best && CHORD * self.last_turn * size.relative <= tolerance
    }

    /// Takes note of the residual of a state; returns whether it is an equilibrium.
    ///
    /// Rounding hides in the stiffest rows what is left in others. Where steps with factors of an earlier state cease to shrink it, the
    /// last of them says how far the state still is.
    pub(super) fn has_arrived(&mut self, size: &ResidualSize, tolerance: f64, steps: &[StepRecord]) -> bool {
        self.stalled = if size.relative < 0.5 * self.best { 0 } else { self.stalled + 1 };
        self.best = self.best.min(size.relative);
        let is_rounding = |s: &StepRecord| s.energy_change.abs() <= ENERGY_ROUNDING * s.energy_scale;
        let tiny_steps = steps.len() >= 3 && steps.iter().rev().take(3).all(is_rounding);
        size.small
            || (size.rounding && self.stalled >= if self.last_turn <= tolerance { 1 } else { HIDDEN })
            || (self.stalled >= 3 && tiny_steps && size.relative < ROUNDED)
    }

    /// Whether the least residual is rounding, if no step leads on.
    pub(super) fn is_at_rounding(&self) -> bool {
        self.best < ROUNDED
    }
}

impl ResidualSize {
    /// Why the iteration stops at a state that it has arrived at.
    pub(super) fn reason(&self) -> StopReason {
        if self.small { StopReason::Converged } else { StopReason::RoundingFloor }
    }
}

/// Whether a whole step of Newton's method that turned nodes by no more than `last_turn` ends so near to the equilibrium that the
/// residual alone is looked at.
fn residual_alone(last_turn: f64, tolerance: f64) -> bool {
    last_turn <= SHORT || (last_turn <= NEAR && QUADRATIC * last_turn * last_turn <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 1e-9;

    #[test]
    fn what_rounding_hides_shows_in_the_last_turn() {
        let size = |relative: f64| ResidualSize { relative, small: false, rounding: true };
        // States at rounding that are looked at until one has arrived, each after a step that turned nodes by so much.
        let looks = |turn: f64| {
            let mut progress = Progress::default();
            assert!(!progress.has_arrived(&size(2e-8), TOLERANCE, &[]));
            let arrives = |progress: &mut Progress| {
                progress.has_turned(turn);
                progress.has_arrived(&size(1.9e-8), TOLERANCE, &[])
            };
            (1..10).find(|_| arrives(&mut progress))
        };
        assert_eq!((looks(0.9 * TOLERANCE), looks(2.0 * TOLERANCE)), (Some(1), Some(HIDDEN)));
    }
}
