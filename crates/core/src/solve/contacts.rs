//! Newton's step with the contacts that are active at its end.
//!
//! Newton's step includes only the contacts that press at the base. It is replaced by the step with the contacts
//! active at its end: the minimum of the model
//!
//! ```text
//! m(δ) = r·δ + ½ δᵀ K δ + Σ ½ κᵢ (gᵢ + ∇dᵢ·δ)₋²
//! ```
//!
//! of energy and contacts, K being the matrix without contact springs and gᵢ the gap at the base. This is the
//! semi-smooth Newton method of contact (M. Hintermüller, K. Ito, K. Kunisch, *The primal-dual active set strategy as
//! a semismooth Newton method*, SIAM J. Optim. 13 (2002)) within the step, at the cost of one factorisation per round
//! and without wall queries. Its full steps cycle where dozens of contacts change at once; so each is taken only as
//! far as m decreases along it, which is a search over the kinks of a piecewise parabola and ends at the minimum
//! where m is convex. If m is not convex, or its minimum is uphill of the merit, the matrix is shifted until it is.
//!
//! That search needs nothing but the contacts. A step δ that is a mean of solutions satisfies r + Kδ = −Σ Fᵢ ∇dᵢ,
//! where Fᵢ is the mean, with the same weights, of the spring forces κᵢ (gᵢ + ∇dᵢ·δ) of the solutions; so along p =
//! δ′ − δ, to the solution δ′ with the forces Fᵢ′,
//!
//! ```text
//! dm/ds = Σ [κᵢ (gᵢ + ∇dᵢ·(δ + s p))₋ − Fᵢ − s (Fᵢ′ − Fᵢ)] ∇dᵢ·p
//! ```

use super::external::{ContactMerit, Contacts, Moved};
use super::line_search::LineSearch;
use super::newton::{ENERGY_ROUNDING, Newton, Problem};
use super::report::StopReason;
use crate::Vec3;
use crate::rod::scatter::{element_step, point_step, point_turn};
use crate::rod::{Assembly, ElementData, RodState};
use crate::tuning::NewtonTuning;

/// Fraction of the way, at most 1, up to which a convex function with the given slope decreases (the Illinois
/// method).
pub(crate) fn falls_until(tuning: &NewtonTuning, mut slope: impl FnMut(f64) -> f64) -> f64 {
    let (mut low, mut high) = ((0.0, slope(0.0)), (1.0, slope(1.0)));
    if high.1 <= 0.0 || low.1 >= 0.0 {
        return 1.0;
    }
    let least = tuning.searched * -low.1;
    let mut last = 0.0;
    for _ in 0..tuning.searches {
        let part = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
        let here = slope(part);
        if here.abs() <= least {
            return part;
        }
        let (end, other) = if here < 0.0 { (&mut low, &mut high) } else { (&mut high, &mut low) };
        *end = (part, here);
        if last * here > 0.0 {
            other.1 *= 0.5;
        }
        last = here;
    }
    low.0
}

/// The rod's motion in a step from a state.
struct StepOf<'a, const C: usize> {
    elements: &'a [ElementData],
    state: &'a RodState,
    step: &'a [f64],
}

impl<const C: usize> Moved for StepOf<'_, C> {
    fn point(&self, (e, xi, set): (usize, f64, usize)) -> (Vec3, f64) {
        let way = point_step::<C>(self.state, &self.elements[e], (e, xi), self.step);
        (way, point_turn::<C>((e, xi, set), self.step))
    }

    fn element(&self, e: usize) -> [Vec3; 4] {
        element_step::<C>(self.state, &self.elements[e], e, self.step)
    }
}

impl<const C: usize> Newton<C> {
    /// Replaces the step from the assembled state, found under a `shift`, by the step with the contacts active at its
    /// end, if a minimum is sought and the matrix is that of the state. Returns the contacts' contribution to the
    /// merit along it.
    pub(super) fn meet_contacts(
        &mut self,
        problem: &mut Problem<'_>,
        state: &RodState,
        search: &mut LineSearch,
        shift: &mut f64,
    ) -> Result<ContactMerit, StopReason> {
        let elements = problem.elements;
        let mut has_contacts = false;
        problem.external.visit_contacts(&mut |_| has_contacts = true);
        if !has_contacts {
            return Ok(ContactMerit::default());
        }
        let models = problem.minimum && self.assembly.hessian;
        let least = self.first_shift(elements);
        for _ in 0..=self.tuning.shifts {
            self.with_contacts(problem, state, |contacts, moved| contacts.predict(elements, state, moved));
            if !models || self.contacts_at_end(problem, state, *shift) {
                let mut merit = ContactMerit::default();
                self.with_contacts(problem, state, |contacts, moved| merit += contacts.merit(moved));
                if !(models && self.is_uphill(problem, state, search, &merit)) {
                    return Ok(merit);
                }
            }
            *shift = (self.tuning.shift_growth * *shift).max(least);
            while !self.factors_minimum(problem, *shift) {
                *shift *= self.tuning.shift_growth;
                if !shift.is_finite() {
                    return Err(StopReason::Singular);
                }
            }
        }
        Err(StopReason::NoDescent)
    }

    /// Calls the contacts with the motion of the step.
    fn with_contacts(
        &self,
        problem: &mut Problem<'_>,
        state: &RodState,
        mut ask: impl FnMut(&mut dyn Contacts, &dyn Moved),
    ) {
        let moved = StepOf::<C> { elements: problem.elements, state, step: &self.step };
        problem.external.visit_contacts(&mut |contacts| ask(contacts, &moved));
    }

    /// Whether the slope of the merit along the step, with this contribution of contacts, is positive beyond
    /// rounding.
    fn is_uphill(
        &self,
        problem: &Problem<'_>,
        state: &RodState,
        search: &mut LineSearch,
        merit: &ContactMerit,
    ) -> bool {
        let slope = self.slope_along(problem, state, search) + merit.slope_mj;
        slope > ENERGY_ROUNDING * self.assembly.energy.total().abs()
    }

    /// Finds the minimum of the model under a `shift`. Returns whether the model is convex in all rounds; otherwise
    /// it has no minimum.
    fn contacts_at_end(&mut self, problem: &mut Problem<'_>, state: &RodState, shift: f64) -> bool {
        let elements = problem.elements;
        let tuning = self.tuning;
        for _ in 0..tuning.contact_rounds {
            // With the same active set the next round would take the same direction, and this one went as far as the
            // model decreases.
            if self.change_contacts(problem, state) == 0 {
                break;
            }
            self.spare.copy_from_slice(&self.step);
            if !self.factors_minimum(problem, shift) {
                return false;
            }
            let (turn, _) = RodState::largest_turn::<C>(elements, state, &self.step);
            let most = if turn > tuning.contact_turn_rad { tuning.contact_turn_rad / turn } else { 1.0 };
            self.with_contacts(problem, state, |contacts, moved| contacts.set_direction(moved));
            let external = &mut *problem.external;
            let slope = |part: f64| {
                let mut sum = 0.0;
                external.visit_contacts(&mut |contacts| sum += contacts.slope(part));
                sum
            };
            let part = falls_until(&tuning, slope).min(most);
            problem.external.visit_contacts(&mut |contacts| contacts.advance(part));
            if part < 1.0 {
                for (step, before) in self.step.iter_mut().zip(&self.spare) {
                    *step = before + part * (*step - before);
                }
            }
        }
        true
    }

    /// Factors the system under a shift and solves for the step. Returns whether the matrix has the inertia of a
    /// minimum.
    fn factors_minimum(&mut self, problem: &Problem<'_>, shift: f64) -> bool {
        let found = self.factor_step(self.regularisation(problem.elements) + shift);
        Self::restore_tensions(problem.elements, &mut self.step);
        found.is_ok_and(|inertia| inertia.negative == problem.multipliers())
    }

    /// Changes the active contacts in the system to those at the end of the step; returns how many change. The slope
    /// of the energy stays that at the base: the change enters the right-hand side alone.
    fn change_contacts(&mut self, problem: &mut Problem<'_>, state: &RodState) -> usize {
        let Problem { elements, supports, external, .. } = problem;
        let moved = StepOf::<C> { elements, state, step: &self.step };
        let into: &mut Assembly<C> = &mut self.assembly;
        let mut changed = 0;
        std::mem::swap(&mut into.residual, &mut into.correction);
        external.visit_contacts(&mut |contacts| {
            changed += contacts.update_active_set(elements, state, &moved, into);
        });
        std::mem::swap(&mut into.residual, &mut into.correction);
        supports.hold(into);
        changed
    }
}
