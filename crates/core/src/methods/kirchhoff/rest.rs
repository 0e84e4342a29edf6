//! The last resort: where the way from the last equilibrium is lost, the device comes to rest as it can.
//!
//! With friction held to the normal forces of the last equilibrium the energy is bounded, and every step of Newton's method lowers it: a
//! descent that ends at a minimum, from softer walls to the wall itself. There the wall presses otherwise than friction believes. So the
//! hand holds still and the device slides on: slip begins anew where it is, with the normal forces that are felt there, until they no
//! longer change. Each slide begins at rest, so that it ends lower than it began by more than friction took,
//!
//! ```text
//! E(xₖ₊₁) + Dₖ(xₖ₊₁) ≤ E(xₖ) + Dₖ(xₖ),    Dₖ(x) = Σ μ Nᵢ(xₖ) φ(|uᵢ(x; xₖ)|)
//! ```
//!
//! and as E is bounded below what friction takes comes to an end, and with it the slip: the limit is in equilibrium with forces within
//! the cones of Coulomb's law of its own normal forces. It is where a slow motion with friction ends, one step of it after the other,
//! and not, as elsewhere, one step from the last equilibrium.

use crate::contact::{SETTLED, WallContact};
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{Newton, NewtonOptions, NewtonReport};

/// Newton iterations on a softer wall, on the wall itself, and of a slide.
const ITERATIONS: [usize; 3] = [25, 100, 60];
/// Most slides. Two or three are the rule.
const SLIDES: usize = 40;
/// Residual over force scale on softer walls.
const LOOSE: f64 = 1e-3;

/// Moves `state` to where the device comes to rest. `softest` is the part of the wall's modulus to begin with; `rubs` says whether
/// there is friction. Returns how the last state was found, and the iterations of all.
pub(super) fn come_to_rest<const C: usize>(
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
    for _ in 0..if rubs { SLIDES } else { 0 } {
        if !found.converged || contact.unsettled() < SETTLED {
            break;
        }
        contact.anchor_friction(elements, state);
        found = solve(contact, state, ITERATIONS[2], false);
    }
    (found, iterations)
}
