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
/// Where something is lagged, factors serve while nodes have turned by no more than `SHORT` since they were taken, whatever axial forces
/// have done, and each step leaves no more than this part of the residual: what renewing it leaves there is not lessened by a newer matrix.
const SHRINKS: f64 = 0.1;
/// Where axial forces have changed by more than this part of the largest since factors were taken, their inertia says nothing of the
/// state: a column is pressed beyond what buckles it without a turn.
const PRESSED: f64 = 0.1;
/// States at rounding that did not halve their residual after which it is as small as it gets, though steps still turn nodes by more than
/// the tolerance.
const HIDDEN: usize = 3;
/// A residual that is as small as this, relative, and shrinks no more, is rounding.
const ROUNDED: f64 = 1e-6;

/// How far a whole step of Newton's method has turned nodes, rad; infinite of any other step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// With the change of axial forces as the turn that they are worth.
    pub(super) with_forces: f64,
    /// Tangents and angles alone.
    pub(super) of_nodes: f64,
    /// Largest change of an axial force, N.
    pub(super) pull_n: f64,
}

impl Turn {
    /// That of a step that says nothing.
    pub(super) const NONE: Self =
        Self { with_forces: f64::INFINITY, of_nodes: f64::INFINITY, pull_n: f64::INFINITY };
}

/// What has changed since the factors at hand were taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct Since {
    /// Turns of nodes alone, of all steps, rad.
    pub(super) turn: f64,
    /// Changes of axial forces, N.
    pub(super) pull_n: f64,
}

impl Since {
    /// They are of this state.
    pub(super) const NOW: Self = Self { turn: 0.0, pull_n: 0.0 };
    /// They are of no matrix near the state.
    pub(super) const NEVER: Self = Self { turn: f64::INFINITY, pull_n: f64::INFINITY };
}

/// How far the iteration has come since it began, or since it left a saddle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Least relative residual.
    best: f64,
    /// States in a row that did not halve it.
    stalled: usize,
    /// Turn of the last step, rad, if it was a whole one of Newton's; infinite otherwise. Axial forces count as turns.
    last_turn: f64,
    since: Since,
}

impl Default for Progress {
    fn default() -> Self {
        Self { best: f64::INFINITY, stalled: 0, last_turn: f64::INFINITY, since: Since::NEVER }
    }
}

impl Progress {
    /// At its beginning, with factors from which so much has changed.
    pub(super) fn going_on(since: Since) -> Self {
        Self { since, ..Self::default() }
    }

    /// What has changed since the factors at hand were taken.
    pub(super) fn since(&self) -> Since {
        self.since
    }

    /// Whether the inertia of the factors at hand says something of a state with these axial forces, N.
    pub(super) fn tells_inertia(&self, tensions_n: &[f64]) -> bool {
        let largest_n = tensions_n.iter().fold(0.0f64, |most, tension| most.max(tension.abs()));
        self.since.pull_n <= PRESSED * largest_n
    }

    /// Takes note of a step, with factors of the state that it began at or of one before.
    pub(super) fn has_turned(&mut self, turn: Turn, factored: bool) {
        self.last_turn = turn.with_forces;
        let before = if factored { Since::NOW } else { self.since };
        self.since = Since { turn: before.turn + turn.of_nodes, pull_n: before.pull_n + turn.pull_n };
    }

    /// Whether the next state is assembled with its matrix; `lagged` says that something is renewed there.
    pub(super) fn wants_hessian(&self, tolerance: f64, lagged: bool) -> bool {
        !(residual_alone(self.last_turn, tolerance) || (lagged && self.since.turn <= SHORT))
    }

    /// Whether another step with the factors of an earlier state leads to the tolerance. Where steps no longer shrink a residual, it
    /// takes the matrix of the state itself to say so: with factors from before a contact opened or closed, steps may lead to and fro
    /// for ever.
    pub(super) fn shrinks_enough(&self, size: &ResidualSize, tolerance: f64, lagged: bool) -> bool {
        let arrives = CHORD * self.last_turn * size.relative <= tolerance;
        let shrinks = lagged && self.since.turn <= SHORT && size.relative <= SHRINKS * self.best;
        size.relative < 0.5 * self.best && (arrives || shrinks)
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

    /// After a whole step with new factors that turned nodes by `of_nodes` and left `relative` of a residual of 1e-3.
    fn after(of_nodes: f64, relative: f64) -> (Progress, ResidualSize) {
        let mut progress = Progress { best: 1e-3, ..Progress::default() };
        progress.has_turned(Turn { with_forces: 1e-3, of_nodes, pull_n: 0.0 }, true);
        (progress, ResidualSize { relative, small: false, rounding: false })
    }

    #[test]
    fn factors_serve_what_is_renewed_while_nodes_have_hardly_turned() {
        let (progress, size) = after(0.4 * SHORT, 1e-5);
        assert!(!progress.wants_hessian(TOLERANCE, true) && progress.shrinks_enough(&size, TOLERANCE, true));
        // Where nothing is renewed, axial forces count as turns.
        assert!(
            progress.wants_hessian(TOLERANCE, false) && !progress.shrinks_enough(&size, TOLERANCE, false)
        );
        // Each step must leave a tenth.
        let (progress, size) = after(0.4 * SHORT, 2e-4);
        assert!(!progress.shrinks_enough(&size, TOLERANCE, true));
        let (progress, _) = after(2.0 * SHORT, 1e-5);
        assert!(progress.wants_hessian(TOLERANCE, true));
    }

    #[test]
    fn factors_of_the_last_solution_serve_where_its_state_is_near() {
        let near = Progress::going_on(Since { turn: 0.4 * SHORT, ..Since::NOW });
        assert!(!near.wants_hessian(TOLERANCE, true));
        let size = ResidualSize { relative: 1e-5, small: false, rounding: false };
        assert!(near.shrinks_enough(&size, TOLERANCE, true));
        // Not where nothing was renewed, from afar, or where there are none.
        assert!(near.wants_hessian(TOLERANCE, false));
        assert!(Progress::going_on(Since { turn: 2.0 * SHORT, ..Since::NOW }).wants_hessian(TOLERANCE, true));
        assert!(Progress::default().wants_hessian(TOLERANCE, true));
    }

    #[test]
    fn what_rounding_hides_shows_in_the_last_turn() {
        let size = |relative: f64| ResidualSize { relative, small: false, rounding: true };
        // States at rounding that are looked at until one has arrived, each after a step that turned nodes by so much.
        let looks = |turn: f64| {
            let mut progress = Progress::default();
            assert!(!progress.has_arrived(&size(2e-8), TOLERANCE, &[]));
            let arrives = |progress: &mut Progress| {
                progress.has_turned(Turn { with_forces: turn, of_nodes: turn, pull_n: 0.0 }, false);
                progress.has_arrived(&size(1.9e-8), TOLERANCE, &[])
            };
            (1..10).find(|_| arrives(&mut progress))
        };
        assert_eq!((looks(0.9 * TOLERANCE), looks(2.0 * TOLERANCE)), (Some(1), Some(HIDDEN)));
    }

    #[test]
    fn turns_add_up_until_there_are_new_factors() {
        let turn = Turn { with_forces: 1e-3, of_nodes: 0.4 * SHORT, pull_n: 0.04 };
        let (mut progress, _) = after(0.4 * SHORT, 1e-5);
        progress.has_turned(turn, false);
        assert!(!progress.wants_hessian(TOLERANCE, true));
        progress.has_turned(turn, false);
        assert!(progress.wants_hessian(TOLERANCE, true));
        progress.has_turned(turn, true);
        assert!(!progress.wants_hessian(TOLERANCE, true));
    }

    #[test]
    fn factors_tell_no_inertia_of_a_column_that_was_pressed_since() {
        let turn = Turn { with_forces: 1e-3, of_nodes: 0.0, pull_n: 0.06 };
        let (mut progress, _) = after(0.0, 1e-5);
        progress.has_turned(turn, true);
        assert!(progress.tells_inertia(&[0.0, -1.0]));
        progress.has_turned(turn, false);
        assert!(!progress.tells_inertia(&[0.0, -1.0]));
        progress.has_turned(turn, true);
        assert!(progress.tells_inertia(&[0.0, -1.0]));
    }
}
