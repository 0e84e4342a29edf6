//! From a prediction to the nearest equilibrium, or to where the device comes to rest.
//!
//! Newton's method goes from the prediction to a minimum, with friction following the contact forces. If no
//! equilibrium is found, it is not near, and the part of the command is shortened.
//!
//! If none is near however short the part, friction is held at the normal forces of its start: then the energy is
//! bounded below, every Newton step lowers it, and the iteration ends at a minimum. If friction that follows from
//! there finds no equilibrium nearby, the hand holds still and the device relaxes: slip is repeatedly reset, with the
//! current normal forces, until they no longer change. Each relaxation starts almost at rest, so it ends lower than
//! it began by the dissipation,
//!
//! ```text
//! E(xₖ₊₁) + Dₖ(xₖ₊₁) ≤ E(xₖ) + Dₖ(xₖ),    Dₖ(x) = Σ μ Nᵢ(xₖ) φ(|uᵢ(x; xₖ)|),    Dₖ(xₖ) ≤ Σ μ Nᵢ εₖ
//! ```
//!
//! with slip up to εₖ kept; εₖ shrinks by a factor of three tenths per relaxation, down to a hundredth of that of the
//! step. As E is bounded below, the total dissipation is finite, and so is all slip beyond εₖ. The limit is an
//! equilibrium with friction within the Coulomb cones of its own normal forces: the state in which a slow motion with
//! friction comes to rest.

use super::guess::Guess;
use super::mesh::Mesh;
use super::part::Effort;
use crate::contact::{SelfContact, WallContact};
use crate::device::Stack;
use crate::flow::BloodFlow;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{External, Newton, NewtonOptions, NewtonReport, Together};
use crate::tuning::Tuning;

/// What the lagged forces follow from, besides the state.
pub(super) struct Lagged<'a> {
    /// The blood, if it flows.
    pub(super) flow: Option<&'a BloodFlow>,
    pub(super) stack: &'a Stack,
    pub(super) mesh: &'a Mesh,
}

/// A search for an equilibrium.
pub(super) struct Search<'a, 'b, const C: usize> {
    pub(super) newton: &'a mut Newton<C>,
    pub(super) guess: &'a mut Guess,
    pub(super) contact: &'a mut WallContact<'b>,
    /// Contacts of loops and coils, if modelled.
    pub(super) loops: Option<&'a mut SelfContact>,
    /// What acts beside them.
    pub(super) beside: [Option<&'a mut dyn External>; 3],
    pub(super) supports: &'a mut Supports,
    pub(super) elements: &'a [ElementData],
    /// The prediction, then the result.
    pub(super) state: &'a mut RodState,
    /// Whether there is friction.
    pub(super) has_friction: bool,
    /// Residual of an equilibrium, relative to the force scale.
    pub(super) tolerance: f64,
    pub(super) effort: Effort,
    /// Numbers that are choices.
    pub(super) tuning: &'a Tuning,
    /// Largest number of Newton iterations.
    pub(super) most: usize,
    /// Largest number of linear solves.
    pub(super) most_solves: usize,
    /// Newton iterations and last shift of earlier commands in the first solution.
    pub(super) resumed: Option<(usize, f64)>,
    /// Newton iterations taken.
    pub(super) iterations: usize,
    /// Linear solves taken.
    pub(super) solves: usize,
    /// Number of slides with the hand held still.
    pub(super) slides: u32,
}

impl<const C: usize> Search<'_, '_, C> {
    /// Searches. The report is not converged if nothing was found; with friction it may be unsettled. The number is the
    /// relative change of the lagged forces from those used in its solution.
    ///
    /// The drag of the blood and the normal forces between instruments follow from an equilibrium and move the next
    /// one. Those at the state are used in the next solution, until they no longer change.
    pub(super) fn run(&mut self, lagged: &Lagged<'_>) -> (NewtonReport, f64) {
        if self.effort != Effort::Near {
            self.contact.hold_friction();
            self.with_loops(SelfContact::hold_friction);
        }
        let mut found = self.on();
        if lagged.flow.is_none() && self.contact.between().places().is_empty() {
            return (found, 0.0);
        }
        let mut renewals = 0;
        loop {
            let change = self.renew(lagged);
            let is_settled = change < self.tuning.friction.settled && found.is_within(self.tolerance);
            if !found.converged || is_settled || renewals == self.tuning.steps.lagged_renewals {
                return (found, change);
            }
            found = self.on();
            renewals += 1;
        }
    }

    /// Renews the lagged forces at the state; returns their largest relative change.
    fn renew(&mut self, Lagged { flow, stack, mesh }: &Lagged<'_>) -> f64 {
        let dragged = flow.map_or(0.0, |flow| self.contact.renew_drag(flow, self.elements, self.state));
        dragged.max(self.press(stack, mesh))
    }

    /// From the state to the nearest equilibrium.
    fn on(&mut self) -> NewtonReport {
        let was_resumed = self.resumed.is_some();
        let found = self.newton();
        if self.effort == Effort::Near || !found.converged || self.is_settled() {
            return found;
        }
        // Following friction in vain might take all solves of every tick.
        if was_resumed {
            return self.slide(found);
        }
        self.guess.other.copy_from(self.state);
        let most = self.most;
        self.most = most.min(self.iterations + self.tuning.steps.following);
        self.contact.release_friction();
        self.with_loops(SelfContact::release_friction);
        let found = self.newton();
        self.most = most;
        if found.converged {
            return found;
        }
        self.state.copy_from(&self.guess.other);
        self.contact.rewind_friction();
        self.with_loops(SelfContact::rewind_friction);
        let found = self.newton();
        self.slide(found)
    }

    /// Newton's method from the state.
    fn newton(&mut self) -> NewtonReport {
        let steps = &self.tuning.steps;
        let (before, last_shift) = self.resumed.take().unwrap_or_default();
        let most = if self.effort == Effort::Flight {
            steps.most_moving
        } else {
            steps.most_near - before.min(steps.most_near - 1)
        };
        let options = NewtonOptions {
            max_iterations: most.min(self.most.saturating_sub(self.iterations)),
            max_solves: self.most_solves.saturating_sub(self.solves),
            tolerance: self.tolerance,
            last_shift,
            tuning: self.tuning.newton,
            ..NewtonOptions::default()
        };
        let elements = self.elements;
        let found = self.with_outside(|newton, supports, outside, state| {
            newton.solve(elements, supports, outside, state, &options)
        });
        self.iterations += found.iterations;
        self.solves += found.solves;
        found
    }

    /// Calls `what` with all that acts on the rod.
    fn with_outside<T>(
        &mut self,
        what: impl FnOnce(&mut Newton<C>, &mut Supports, &mut dyn External, &mut RodState) -> T,
    ) -> T {
        if self.loops.is_none() && self.beside.iter().all(Option::is_none) {
            return what(self.newton, self.supports, self.contact, self.state);
        }
        let loops = self.loops.as_deref_mut().map(|loops| loops as &mut dyn External);
        let [one, two, three] = &mut self.beside;
        let [one, two, three] =
            [one, two, three].map(|beside| beside.as_mut().map(|it| &mut **it as &mut dyn External));
        let mut outside = Together([Some(&mut *self.contact), loops, one, two, three]);
        what(self.newton, self.supports, &mut outside, self.state)
    }

    /// Assembles the forces at the state with lagged ones as they are there, and the matrix if `hessian`.
    pub(super) fn assemble(&mut self, lagged: &Lagged<'_>, hessian: bool) {
        self.assemble_once(hessian);
        if lagged.flow.is_some() || !self.contact.between().places().is_empty() {
            self.renew(lagged);
            self.assemble_once(hessian);
        }
    }

    /// Whether forces are lagged, and so missing in the matrix.
    pub(super) fn lags(&mut self, lagged: &Lagged<'_>) -> bool {
        self.has_friction || lagged.flow.is_some() || !self.contact.between().places().is_empty()
    }

    fn assemble_once(&mut self, hessian: bool) {
        let elements = self.elements;
        self.with_outside(|newton, supports, outside, state| match hessian {
            true => newton.assemble(elements, supports, outside, state),
            false => newton.assemble_forces(elements, supports, outside, state),
        });
    }

    /// Calls `what` on the self-contact, if modelled.
    fn with_loops(&mut self, what: impl FnMut(&mut SelfContact)) {
        self.loops.as_deref_mut().into_iter().for_each(what);
    }

    /// Relative difference of the normal forces of friction from the contact forces at the result.
    pub(super) fn unsettled(&self) -> f64 {
        if !self.has_friction {
            return 0.0;
        }
        self.contact.unsettled().max(self.loops.as_deref().map_or(0.0, SelfContact::unsettled))
    }

    /// Whether friction has the normal forces of the result.
    fn is_settled(&self) -> bool {
        self.unsettled() < self.tuning.friction.settled
    }

    /// With the hand held still, relaxes an equilibrium with the normal forces of another state to where the device
    /// rests.
    fn slide(&mut self, mut found: NewtonReport) -> NewtonReport {
        while found.converged && !self.is_settled() && self.slides < self.tuning.steps.slides {
            self.contact.anchor_friction(self.elements, self.state);
            self.with_loops(SelfContact::anchor_friction);
            found = self.newton();
            self.slides += 1;
        }
        found
    }
}
