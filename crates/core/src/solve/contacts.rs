//! Contacts within a step: which of them press at its end, and how a trial is brought back to them.
//!
//! Newton's step knows of the contacts that press where it begins. Where a trial runs into others it is refused, and is found anew with
//! them: each by the plane in which the trial has met the wall, and those that would pull let go, until it is the minimum of the model
//!
//! ```text
//! m(δ) = r·δ + ½ δᵀ K δ + Σ ½ wᵢ k (gᵢ + ∇dᵢ·δ)₋²
//! ```
//!
//! of energy and contacts, K being the matrix without their springs. That is the semi-smooth Newton method of contact (M. Hintermüller, K. Ito,
//! K. Kunisch, *The primal-dual active set strategy as a semismooth Newton method*, SIAM J. Optim. 13 (2002)) within the step, at the
//! cost of a factorisation a round and no question to the wall. Whole steps of it go round in circles where dozens of contacts change at
//! once; each goes as far as m falls along it, which is a search over the kinks of a parabola, and ends at the minimum where m
//! is convex. Where a contact that is let go leaves a matrix that is not that of a minimum, those of the base are kept, and may pull.
//!
//! Nothing but the contacts is asked for that search. Of a step δ that is a mean of solutions, with the same weights, r + Kδ = −Σ Fᵢ ∇dᵢ,
//! where Fᵢ is that mean of the forces wᵢ k (gᵢ + ∇dᵢ·δ) of the springs in each; so along p = δ′ − δ, to the solution δ′ with the forces
//! Fᵢ′,
//!
//! ```text
//! dm/ds = Σ [wᵢ k (gᵢ + ∇dᵢ·(δ + s p))₋ − Fᵢ − s (Fᵢ′ − Fᵢ)] ∇dᵢ·p
//! ```

use super::external::External;
use super::newton::{Newton, Problem};
use super::trial::LARGEST_CORRECTION;
use crate::Vec3;
use crate::banded::{FactorError, Inertia};
use crate::rod::scatter::{point_step, point_turn};
use crate::rod::{Assembly, ElementData, RodState};

/// Most corrections of the contacts at a trial.
const CORRECTIONS: usize = 3;
/// Forces of contacts may be off what was foreseen by this part.
const STRAYED: f64 = 0.1;
/// Most rounds in which the contacts that a step leads to are looked for.
const ROUNDS: usize = 15;
/// A round that goes no farther than this part of its way is the last.
const LEAST_PART: f64 = 1e-3;
/// Turn of a step, rad, at which a round ends: planes and lines are no model of what is farther away.
const LARGEST_TURN: f64 = 1.0;

/// What a step does to points of the rod.
pub(crate) fn moved<'a, const C: usize>(
    elements: &'a [ElementData],
    state: &'a RodState,
    step: &'a [f64],
) -> impl Fn((usize, f64, usize)) -> (Vec3, f64) + 'a {
    move |(e, xi, set)| {
        let way = point_step::<C>(state, &elements[e], (e, xi), step);
        (way, point_turn::<C>((e, xi, set), step))
    }
}

impl<const C: usize> Newton<C> {
    /// Has contacts foresee what the step does to them; returns whether there are any to foresee.
    pub(super) fn foresee(&mut self, problem: &mut Problem<'_>, state: &RodState) -> bool {
        let Problem { elements, external, .. } = problem;
        external.foresee(&moved::<C>(elements, state, &self.step))
    }

    /// Finds the step anew with the contacts into which the trial, `part` of it, has run, under the same `shift`. Returns whether there is
    /// such a step; otherwise the one at hand is left as it is.
    pub(super) fn meet_contacts(
        &mut self,
        problem: &mut Problem<'_>,
        state: &RodState,
        part: f64,
        shift: f64,
    ) -> bool {
        let Problem { elements, ref mut external, .. } = *problem;
        let arrived =
            external.meet(elements, (state, &self.trial), part, &moved::<C>(elements, state, &self.step));
        if !arrived {
            return false;
        }
        self.spare.copy_from_slice(&self.step);
        let regularisation = Self::regularisation(elements);
        let sigma = if shift > regularisation { regularisation + shift } else { regularisation };
        let minimum = |found: Result<Inertia, FactorError>| {
            found.is_ok_and(|inertia| inertia.negative == elements.len())
        };
        let mut whole = true;
        for round in 0..=ROUNDS {
            let changed = self.change_contacts(problem, |external, step, into| {
                external.press_or_let_go(elements, state, &moved::<C>(elements, state, step), into)
            });
            // The step at hand is the one that these contacts give.
            if changed == 0 && round == 0 {
                return false;
            }
            if (changed == 0 && whole) || round == ROUNDS {
                break;
            }
            self.before.copy_from_slice(&self.step);
            while !minimum(self.factor_step(sigma)) {
                let held = self
                    .change_contacts(problem, |external, _, into| external.hold_on(elements, state, into));
                if held == 0 {
                    self.step.copy_from_slice(&self.spare);
                    problem.external.forget();
                    return false;
                }
            }
            let (turn, _) = RodState::largest_turn::<C>(elements, state, &self.step);
            let most = if turn > LARGEST_TURN { LARGEST_TURN / turn } else { 1.0 };
            let part = problem.external.part_towards(&moved::<C>(elements, state, &self.step), most);
            whole = part >= 1.0;
            if !whole {
                for (step, before) in self.step.iter_mut().zip(&self.before) {
                    *step = before + part * (*step - before);
                }
            }
            if part < LEAST_PART {
                break;
            }
        }
        Self::restore_tensions(elements, &mut self.step);
        true
    }

    /// Changes contacts in the assembled system. The slope of the energy stays that at the base: what they change is for the right-hand
    /// side alone.
    fn change_contacts(
        &mut self,
        problem: &mut Problem<'_>,
        change: impl FnOnce(&mut dyn External, &[f64], &mut Assembly<C>) -> usize,
    ) -> usize {
        std::mem::swap(&mut self.assembly.residual, &mut self.assembly.correction);
        let changed = change(&mut *problem.external, &self.step, &mut self.assembly);
        std::mem::swap(&mut self.assembly.residual, &mut self.assembly.correction);
        problem.supports.hold(&mut self.assembly);
        changed
    }

    /// Second-order corrections of the contacts at the trial, `part` of the step from the assembled state, with the factorisation at hand.
    pub(super) fn correct_contacts(&mut self, problem: &mut Problem<'_>, state: &RodState, part: f64) {
        let Problem { elements, supports, external, .. } = problem;
        let mut last = f64::INFINITY;
        for round in 0..=CORRECTIONS {
            let trial = &self.trial;
            let stray = self
                .assembly
                .beside(&mut self.spare, |into| external.stray(elements, (state, trial), part, into));
            if round > 0 && (stray.is_nan() || stray >= last) {
                std::mem::swap(&mut self.trial, &mut self.other);
                break;
            }
            if stray.is_nan() || stray <= STRAYED || round == CORRECTIONS {
                break;
            }
            last = stray;
            self.spare.iter_mut().for_each(|r| *r = -*r);
            supports.held::<C>().into_iter().flatten().for_each(|row| self.spare[row] = 0.0);
            self.factor.solve(&mut self.spare);
            let (turn, _) = RodState::largest_turn::<C>(elements, &self.trial, &self.spare);
            if turn.is_nan() || turn > LARGEST_CORRECTION {
                break;
            }
            self.other.copy_from(&self.trial);
            self.trial.advance::<C>(elements, &self.other, &self.spare, 1.0);
            if external.safe_fraction(elements, &self.trial) < 1.0 {
                std::mem::swap(&mut self.trial, &mut self.other);
                break;
            }
        }
    }
}
