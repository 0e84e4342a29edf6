//! A guess is brought back to the wall that it touched.
//!
//! In a hard wall a device sinks in by micrometres, and a guess is off by more: it presses too much in one place and has come off in
//! another. Where it has lost its contacts, Newton's method steps towards the device that is free of them, is stopped by the wall after
//! a thousandth of the way, and finds them again one by one. So a guess whose forces on the wall are not those of the last equilibrium
//! gets one step in which the points that pressed there are held to the wall, each by a spring that also pulls:
//!
//! ```text
//! U = ½ w k (r − d)²,    ∇U = w k (d − r) ∇d,    ∇∇U ≈ w k ∇d ∇dᵀ − F ∇∇d
//! ```
//!
//! with the force F of the last equilibrium in place of w k (r − d), as sequential quadratic programming has the multipliers of the
//! last iterate in its Hessian (Nocedal and Wright, *Numerical Optimization*, 2nd ed., section 18.1): the forces of the guess itself
//! are too large by powers of ten, and of either sign. What is left is of second order in the step.

use super::guess::Guess;
use crate::contact::WallContact;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::Newton;

/// Part of the forces on the wall by which those of a guess may differ before it is held. One that has learnt from small steps
/// differs by less, and Newton's method goes on from it as well.
const MISFIT: f64 = 0.4;
/// A step that turns a node by more than this, rad, leads to another shape, not to a better guess.
const LARGEST_TURN: f64 = 0.3;

impl Guess {
    /// Moves `state` by a step that holds the contacts of the last equilibrium, if it needs one and there is one. Returns whether there was.
    pub(super) fn active_set_step<const C: usize>(
        &mut self,
        newton: &mut Newton<C>,
        contact: &mut WallContact<'_>,
        supports: &Supports,
        elements: &[ElementData],
        state: &mut RodState,
    ) -> bool {
        if contact.misfit(elements, state) <= MISFIT {
            return false;
        }
        contact.holding = true;
        newton.assemble(elements, supports, contact, state);
        contact.holding = false;
        let Some((inertia, step)) = newton.full_step(elements, supports) else { return false };
        let (turn, _) = RodState::largest_turn::<C>(elements, state, step);
        // Only towards a minimum: one negative pivot for each axial force.
        if inertia.negative != elements.len() || turn.is_nan() || turn > LARGEST_TURN {
            return false;
        }
        self.other.copy_from(state);
        self.other.advance::<C>(elements, state, step, 1.0);
        self.other.take_tensions::<C>(elements, state, step);
        if contact.is_outside(elements, &self.other) {
            return false;
        }
        std::mem::swap(state, &mut self.other);
        true
    }
}
