//! Friction and wall forces solved for together, where the one does not settle while the other is held.
//!
//! Lagged normal forces are a fixed-point iteration: an equilibrium with forces p₀ presses with p(p₀), which are the next ones. A
//! thread that is wedged in a bend answers a change of friction with a larger change of what presses, and the iteration runs away
//! although there is a solution. Here the normal forces follow the state at once. The Newton matrix is that of lagged forces and a part
//! that is not symmetric ([`crate::contact::friction`]), factored as a band with row interchanges.
//!
//! A thread presses on a rigid wall by nanometres, and a step along a curved wall is off it by more. So contacts have forces f of their
//! own beside the depth p: f = w k p for those that press, 0 for the others. Newton's method for x and f, with f eliminated, is the
//! step from a spring that also pulls, with f in the Hessian of wall and friction,
//!
//! ```text
//! (K − f ∇∇d + w k ∇d ∇dᵀ + friction of f) δx = −(r + w k (d − r) ∇d + friction of w k p),    f ← w k (p − ∇d·δx)
//! ```
//!
//! and where f would pull the point is let go; one that is beyond the wall is taken up. This is the semi-smooth Newton method of
//! contact as an active set (M. Hintermüller, K. Ito, K. Kunisch, *The primal-dual active set strategy as a semismooth Newton method*,
//! SIAM J. Optim. 13 (2002)): three or four steps where the spring alone chatters. There is no energy to lower. Where the symmetric part
//! of the matrix is not that of a minimum, or its step is long, it is shifted as in the solution with lagged forces. What is found is
//! judged by [`Newton::solve`] with its forces held: a saddle is left, and the way goes on from there.

use crate::banded::{BandLu, Shift};
use crate::contact::WallContact;
use crate::rod::scatter::{add_unsymmetric, point_step};
use crate::rod::{Assembly, ElementData, Layout, RodState, Supports};
use crate::solve::{External, Newton};

/// Shifts tried until the symmetric part is that of a minimum.
const SHIFTS: usize = 40;
/// Largest rotation of a node in one step, rad.
const LARGEST_TURN: f64 = 0.2;
/// Least shift beside the one that is always on, over that.
const LEAST_SHIFT: f64 = 1e5;
/// A step whose root mean square turn is less than this, rad, is rounding: of coordinates of some ten millimetres over elements of
/// some tenths of one, …
const ROUNDED: f64 = 1e-13;
/// … and a residual over force scale at that step must be below this. On a hard wall a soft thread presses by nanometres,
/// and what rounding of positions leaves of that is far more than the tolerance.
const LEFT: f64 = 1e-5;
/// Trials of a step that must not lead beyond the wall.
const TRIALS: usize = 6;
/// Part of the pressing forces that held points may pull with at the end.
const PULL: f64 = 1e-6;

/// The coupled solution with its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Settle<const C: usize> {
    lu: BandLu<C>,
    shift: Shift,
    step: Vec<f64>,
    trial: RodState,
}

/// What is solved: Newton's method for its assembly, the wall, and what holds the rod.
type System<'a, 'b, const C: usize> = (&'a mut Newton<C>, &'a mut WallContact<'b>, &'a mut Supports);

impl<const C: usize> Settle<C> {
    /// Takes memory for rods of up to `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        let n = Layout::<C>::dimension(elements);
        self.lu.reserve(n);
        for list in [&mut self.step, &mut self.shift.diagonal, &mut self.shift.next] {
            list.reserve(n.saturating_sub(list.len()));
        }
        self.trial.reserve(elements);
    }

    /// Moves `state`, an equilibrium with lagged normal forces, to one with its own. Limits are the residual over
    /// force scale and the number of iterations. Returns whether it is there and the iterations that were taken.
    pub(super) fn solve(
        &mut self,
        (newton, contact, supports): System<'_, '_, C>,
        elements: &[ElementData],
        state: &mut RodState,
        limits: (f64, usize),
    ) -> (bool, usize) {
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.shift);
        self.trial.copy_from(state);
        contact.couple();
        // What presses at the beginning, and how hard.
        newton.assemble_residual(elements, supports, contact, state);
        let found = self.newton((newton, &mut *contact, supports), elements, state, limits);
        contact.uncouple();
        found
    }

    /// Newton's method with the part that is not symmetric, contacts held.
    fn newton(
        &mut self,
        (newton, contact, supports): System<'_, '_, C>,
        elements: &[ElementData],
        state: &mut RodState,
        (tolerance, limit): (f64, usize),
    ) -> (bool, usize) {
        let mut best = f64::INFINITY;
        let mut last = 0.0;
        let rounded = ROUNDED * elements.iter().map(|e| e.length).sum::<f64>().sqrt();
        for iteration in 0..=limit {
            contact.holding = true;
            newton.assemble(elements, supports, contact, state);
            contact.holding = false;
            let size = newton.residual(elements, contact, supports, tolerance);
            if !size.relative.is_finite() || !newton.assembly.external_energy.is_finite() {
                return (false, iteration);
            }
            let free = contact.pull() <= PULL;
            if free && (size.small || (size.rounding && size.relative > 0.5 * best)) {
                return (true, iteration);
            }
            best = best.min(size.relative);
            if iteration == limit {
                break;
            }
            let Some((length, sigma)) = self.direction((newton, contact, supports), elements, state, last)
            else {
                return (false, iteration);
            };
            last = sigma;
            if free && sigma == 0.0 && length <= rounded && size.relative <= LEFT {
                return (true, iteration);
            }
            let mut fraction = 1.0;
            self.trial.advance::<C>(elements, state, &self.step, fraction);
            fraction *= contact.safe_fraction(elements, &self.trial);
            contact.aim(|point, way| {
                let e = point.element;
                point_step::<C>(state, &elements[e], (e, point.xi), &self.step).dot(way)
            });
            for _ in 0..TRIALS {
                self.trial.advance::<C>(elements, state, &self.step, fraction);
                if !contact.is_outside(elements, &self.trial) {
                    break;
                }
                fraction *= 0.4;
            }
            contact.take_aim(fraction);
            self.step.iter_mut().for_each(|s| *s *= fraction);
            self.trial.advance::<C>(elements, state, &self.step, 1.0);
            self.trial.take_tensions::<C>(elements, state, &self.step);
            std::mem::swap(state, &mut self.trial);
        }
        (false, limit)
    }

    /// Sets the step of the assembled state, shifted until the symmetric part of the matrix is that of a minimum, as in the solution
    /// with lagged forces, and the step is short: a matrix that is nearly singular is damped, not its answer cut. Returns the length of
    /// the step and the shift, beginning with an eighth of the `last` one.
    fn direction(
        &mut self,
        (newton, contact, supports): System<'_, '_, C>,
        elements: &[ElementData],
        state: &RodState,
        last: f64,
    ) -> Option<(f64, f64)> {
        let regularisation = Newton::<C>::regularisation(elements);
        let least = LEAST_SHIFT * regularisation;
        let mut sigma = if last > 8.0 * least { last / 8.0 } else { 0.0 };
        for _ in 0..SHIFTS {
            let inertia = newton.inertia(elements, supports, regularisation + sigma);
            if inertia.is_some_and(|i| i.negative == elements.len()) {
                self.lu.copy_from(&newton.assembly.matrix, &self.shift, regularisation + sigma);
                contact.couplings(state, |point, more| {
                    let e = point.element;
                    let place = (e, point.xi, point.set);
                    add_unsymmetric(&mut self.lu, state, &elements[e], place, &more.force, &more.turn);
                });
                supports.held::<C>().into_iter().flatten().for_each(|row| self.lu.hold(row));
                if self.lu.factor().is_ok() {
                    Self::answer(&self.lu, newton, (elements, supports), &mut self.step);
                    let (turn, _) = RodState::largest_turn::<C>(elements, state, &self.step);
                    if turn <= LARGEST_TURN {
                        return Some((Self::length(elements, &self.step), sigma));
                    }
                }
            }
            sigma = (4.0 * sigma).max(least);
        }
        None
    }

    /// Sets `step` to what the factored matrix answers to the assembled residual; what is held does not move, not by rounding either.
    fn answer(
        lu: &BandLu<C>,
        newton: &Newton<C>,
        (elements, supports): (&[ElementData], &Supports),
        step: &mut Vec<f64>,
    ) {
        let rows = || supports.held::<C>().into_iter().flatten();
        let (residual, correction) = (&newton.assembly.residual, &newton.assembly.correction);
        step.clear();
        step.extend(residual.iter().zip(correction).map(|(r, c)| -(r + c)));
        rows().for_each(|row| step[row] = 0.0);
        lu.solve(step);
        rows().for_each(|row| step[row] = 0.0);
        Newton::<C>::restore_tensions(elements, step);
    }

    /// Length of a step: how far it turns nodes and chords, squared and summed.
    fn length(elements: &[ElementData], step: &[f64]) -> f64 {
        let l = Layout::<C>;
        let mut sum = 0.0;
        for (e, data) in elements.iter().enumerate() {
            let (near, far) = (l.position(e), l.position(e + 1));
            let chord = (0..3).map(|a| ((step[far + a] - step[near + a]) / data.length).powi(2));
            let tangent = (0..2).map(|a| step[l.tangent(e + 1) + a].powi(2));
            let angles = (0..Layout::<C>::ANGLES).map(|set| step[l.angle(e + 1, set)].powi(2));
            sum += data.length * (chord.sum::<f64>() + tangent.sum::<f64>() + angles.sum::<f64>());
        }
        sum.sqrt()
    }
}
