//! The last resort: where the way from the last equilibrium is lost, the device comes to rest as it can.
//!
//! With friction held to the normal forces of the last equilibrium the energy is bounded, and every step of Newton's method lowers it: a
//! descent that ends at a minimum, from softer walls to the wall itself. Then the normal forces are renewed, half of the way each time,
//! while the device still comes to rest with them. What is left over is told ([`crate::insertion::StepReport::imbalance`]).

use crate::contact::WallContact;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{Newton, NewtonOptions, NewtonReport};

/// Newton iterations on a softer wall, on the wall itself, and after a renewal.
const ITERATIONS: [usize; 3] = [25, 100, 30];
/// How often normal forces are renewed.
const RENEWALS: usize = 4;
/// Residual over force scale on softer walls.
const LOOSE: f64 = 1e-3;
/// Residual over force scale below which a state counts as one at rest, and normal forces may be renewed from there.
const RESTING: f64 = 1e-4;

/// Its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Rest {
    kept: RodState,
}

impl Rest {
    /// Takes memory for rods of up to `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.kept.reserve(elements);
    }

    /// Moves `state` to where it comes to rest. `softest` is the part of the wall's modulus to begin with; `rubs` says whether
    /// there is friction. Returns how the last state was found, and the iterations of all.
    pub(super) fn come_to_rest<const C: usize>(
        &mut self,
        (newton, contact, supports): (&mut Newton<C>, &mut WallContact<'_>, &mut Supports),
        elements: &[ElementData],
        state: &mut RodState,
        (softest, tolerance, rubs): (f64, f64, bool),
    ) -> (NewtonReport, usize) {
        let mut softness = softest;
        let mut iterations = 0;
        let mut solve = |contact: &mut WallContact<'_>, state: &mut RodState, most: usize, loose: bool| {
            let tolerance = if loose { tolerance.max(LOOSE) } else { tolerance };
            let options = NewtonOptions { max_iterations: most, tolerance, ..NewtonOptions::default() };
            contact.hold_friction();
            let found = newton.solve(elements, supports, contact, state, &options);
            iterations += found.iterations;
            found
        };
        let mut found = loop {
            contact.softness = softness;
            let last = softness >= 1.0;
            let found = solve(contact, state, ITERATIONS[usize::from(last)], !last);
            if last {
                break found;
            }
            softness = (10.0 * softness).min(1.0);
        };
        for _ in 0..if rubs { RENEWALS } else { 0 } {
            if found.residual > RESTING {
                break;
            }
            self.kept.copy_from(state);
            contact.renew_friction();
            let next = solve(contact, state, ITERATIONS[2], false);
            if next.residual > found.residual.max(RESTING) {
                // Not with these forces: back, and assembled there.
                state.copy_from(&self.kept);
                contact.take_back_friction();
                found = solve(contact, state, ITERATIONS[2], false);
                break;
            }
            found = next;
        }
        (found, iterations)
    }
}
