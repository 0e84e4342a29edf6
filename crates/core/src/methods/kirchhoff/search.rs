//! From a prediction to the equilibrium next to it, or to where the device comes to rest.
//!
//! Newton's method goes from the prediction to a minimum, friction following the forces of contacts on the way. What that does not find
//! is not near, and the part of the command is cut.
//!
//! Where nothing is near however short the part, friction is held to the normal forces that it began with: the energy then is bounded, every
//! step of Newton's method lowers it, and it ends at a minimum. If friction that follows from there finds nothing near by, the hand holds still
//! and the device slides on: slip begins anew where it is, with the normal forces that are felt there, until they no longer change. Each slide begins all but at rest,
//! so that it ends lower than it began by what friction took,
//!
//! ```text
//! E(xₖ₊₁) + Dₖ(xₖ₊₁) ≤ E(xₖ) + Dₖ(xₖ),    Dₖ(x) = Σ μ Nᵢ(xₖ) φ(|uᵢ(x; xₖ)|),    Dₖ(xₖ) ≤ Σ μ Nᵢ εₖ
//! ```
//!
//! with the slip that is kept within εₖ, which shrinks to three tenths from slide to slide, down to a hundredth of that of the step; and as E
//! is bounded below what friction takes comes to an end, and with it all slip beyond that. The limit is in equilibrium with forces within
//! the cones of Coulomb's law of its own normal forces: where a slow motion with friction comes to rest.

use super::guess::Guess;
use super::substep::Effort;
use crate::contact::{SETTLED, SelfContact, WallContact};
use crate::flow::BloodFlow;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{External, Newton, NewtonOptions, NewtonReport, Together};

/// Newton iterations of a solution near its prediction: from another one, nearer by, it is found in fewer.
pub(super) const MOST_NEAR: usize = 60;
/// Newton iterations of a solution while the device moves, …
const MOST_MOVING: usize = 300;
/// … and of all of them.
pub(super) const LONGEST: usize = 2000;
/// Newton iterations from an equilibrium with friction held to one where it follows.
const FOLLOWING: usize = 20;
/// Most slides with the hand held still. Two or three are the rule.
const SLIDES: u32 = 400;
/// Drag that changes by less than this part on the way to an equilibrium is taken as it is; …
const DRAG_CHANGED: f64 = 1e-4;
/// … it is renewed at most so often.
const DRAG_RENEWALS: usize = 5;

/// A search for an equilibrium.
pub(super) struct Search<'a, 'b, const C: usize> {
    pub(super) newton: &'a mut Newton<C>,
    pub(super) guess: &'a mut Guess,
    pub(super) contact: &'a mut WallContact<'b>,
    /// What its loops and coils do to each other, if they touch.
    pub(super) loops: Option<&'a mut SelfContact>,
    /// What acts beside them.
    pub(super) beside: Vec<&'a mut dyn External>,
    pub(super) supports: &'a mut Supports,
    pub(super) elements: &'a [ElementData],
    /// The prediction, and then what was found.
    pub(super) state: &'a mut RodState,
    /// Whether there is friction.
    pub(super) has_friction: bool,
    /// Residual over force scale of an equilibrium.
    pub(super) tolerance: f64,
    pub(super) effort: Effort,
    /// Most Newton iterations, …
    pub(super) most: usize,
    /// … and linear solves.
    pub(super) most_solves: usize,
    /// Newton iterations that were taken, …
    pub(super) iterations: usize,
    /// … and linear solves.
    pub(super) solves: usize,
    /// How often the device slid on while the hand held still.
    pub(super) slides: u32,
}

impl<const C: usize> Search<'_, '_, C> {
    /// Finds it. What is returned is not converged where nothing was found, and with friction it has settled or not.
    pub(super) fn run(&mut self) -> NewtonReport {
        if self.effort == Effort::Flight {
            self.most = LONGEST;
        }
        if self.effort != Effort::Near {
            self.contact.hold_friction();
            self.with_loops(SelfContact::hold_friction);
        }
        self.on()
    }

    /// From an equilibrium under the drag of where it was looked for to one under its own, where blood flows.
    pub(super) fn dragged(&mut self, mut found: NewtonReport, flow: Option<&BloodFlow>) -> NewtonReport {
        let Some(flow) = flow else { return found };
        for _ in 0..DRAG_RENEWALS {
            if !found.converged || self.contact.renew_drag(flow, self.elements, self.state) < DRAG_CHANGED {
                break;
            }
            found = self.on();
        }
        found
    }

    /// From a state to the equilibrium that follows.
    pub(super) fn on(&mut self) -> NewtonReport {
        let found = self.newton();
        if self.effort == Effort::Near || !found.converged || self.is_settled() {
            return found;
        }
        // To follow in vain may take all solves of a tick.
        if self.effort == Effort::Moving {
            return self.slide(found);
        }
        self.guess.other.copy_from(self.state);
        let most = self.most;
        self.most = most.min(self.iterations + FOLLOWING);
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

    /// Newton's method from the state on.
    fn newton(&mut self) -> NewtonReport {
        let most = if self.effort == Effort::Flight { MOST_MOVING } else { MOST_NEAR };
        let options = NewtonOptions {
            max_iterations: most.min(self.most.saturating_sub(self.iterations)),
            max_solves: self.most_solves.saturating_sub(self.solves),
            tolerance: self.tolerance,
            ..NewtonOptions::default()
        };
        let (elements, supports) = (self.elements, &mut *self.supports);
        let found = if self.loops.is_none() && self.beside.is_empty() {
            self.newton.solve(elements, supports, self.contact, self.state, &options)
        } else {
            let mut outside: Vec<&mut dyn External> = vec![&mut *self.contact];
            outside.extend(self.loops.as_deref_mut().map(|loops| loops as &mut dyn External));
            outside.extend(self.beside.iter_mut().map(|beside| &mut **beside as &mut dyn External));
            self.newton.solve(elements, supports, &mut Together(outside), self.state, &options)
        };
        self.iterations += found.iterations;
        self.solves += found.solves;
        found
    }

    /// Has loops do something, if they touch.
    fn with_loops(&mut self, what: impl FnMut(&mut SelfContact)) {
        self.loops.as_deref_mut().into_iter().for_each(what);
    }

    /// Part by which the normal forces of friction differ from what presses in what was found.
    pub(super) fn unsettled(&self) -> f64 {
        if !self.has_friction {
            return 0.0;
        }
        self.contact.unsettled().max(self.loops.as_deref().map_or(0.0, SelfContact::unsettled))
    }

    /// Whether friction knows the normal forces of what was found.
    fn is_settled(&self) -> bool {
        self.unsettled() < SETTLED
    }

    /// With the hand held still, from an equilibrium with the normal forces of another to where the device comes to rest.
    fn slide(&mut self, mut found: NewtonReport) -> NewtonReport {
        while found.converged && !self.is_settled() && self.slides < SLIDES {
            self.contact.anchor_friction(self.elements, self.state);
            self.with_loops(SelfContact::anchor_friction);
            found = self.newton();
            self.slides += 1;
        }
        found
    }
}
