//! From a guess to the equilibrium next to it.
//!
//! A guess that has learnt from the last step is so near that the wall may be met as it is. From any other a wall that is stiffer than
//! the elements of the rod is approached by softer ones, ten times stiffer each. Friction is held meanwhile to the normal forces of the
//! last equilibrium: the energy then is bounded, every step of Newton's method lowers it, and it ends at a minimum.
//!
//! There the wall presses otherwise than friction believes. Where renewing the normal forces does not settle, friction and wall are
//! solved for together ([`super::settle`]). Where that finds nothing, the hand holds still and the device slides on: slip begins anew
//! where it is, with the normal forces that are felt there, until they no longer change. Each slide begins all but at rest, so that it ends
//! lower than it began by what friction took,
//!
//! ```text
//! E(xₖ₊₁) + Dₖ(xₖ₊₁) ≤ E(xₖ) + Dₖ(xₖ),    Dₖ(x) = Σ μ Nᵢ(xₖ) φ(|uᵢ(x; xₖ)|),    Dₖ(xₖ) ≤ Σ μ Nᵢ εₖ
//! ```
//!
//! with the slip that is kept within εₖ, which shrinks to three tenths from slide to slide, down to a hundredth of that of the step; and as E
//! is bounded below what friction takes comes to an end, and with it all slip beyond that. The limit is in equilibrium with forces within
//! the cones of Coulomb's law of its own normal forces: where a slow motion with friction comes to rest, in a few steps of it where
//! elsewhere there is one.

use super::active_set::Held;
use super::guess::Guess;
use super::settle::Settle;
use crate::contact::{SETTLED, WallContact};
use crate::flow::BloodFlow;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{Newton, NewtonOptions, NewtonReport};

/// Residual over force scale at which what presses between instruments is renewed first: renewing it leaves as much.
const RENEWED: f64 = 1e-4;
/// Residual over force scale on softer walls.
const LOOSE: f64 = 1e-3;
/// Each is so many times as stiff as the one before, …
const STIFFER: f64 = 10.0;
/// … unless it comes so near to the wall itself.
const LAST: f64 = 0.5;
/// Newton iterations in which a guess that has learnt must come to its end, or the wall is approached from softer ones.
const MOST_AT_ONCE: usize = 15;
/// Newton iterations after which a solution has gone astray: from another guess, nearer by, it is found in fewer.
const STUCK: usize = 60;
/// Newton iterations of a slide.
const SLID: usize = 120;
/// Newton iterations with patience: on a softer wall, on the wall itself, and of a slide of the last resort.
const PATIENT: [usize; 3] = [60, 300, 300];
/// Newton iterations of all of the last resort.
const LONGEST: usize = 2000;
/// Newton iterations for friction and wall together. Those that find something mostly do in three to five.
const TOGETHER: usize = 10;
/// How often friction and wall may be solved for together: each time the equilibrium may turn out to be unstable, and be left.
const ROUNDS: usize = 5;
/// Slides that have come so near to friction with its own normal forces are followed by a solution for both together, and again where
/// they have come `FARTHER`.
const NEARLY: f64 = 0.05;
/// See [`NEARLY`].
const FARTHER: f64 = 0.1;
/// Most slides with the hand held still, and in the last resort. Two or three are the rule.
const SLIDES: [usize; 2] = [40, 400];

/// Drag that changes by less than this part on the way to an equilibrium is taken as it is; …
const DRAG_CHANGED: f64 = 1e-4;
/// … it is renewed at most so often.
const DRAG_RENEWALS: usize = 5;

/// A search for an equilibrium.
pub(super) struct Search<'a, 'b, const C: usize> {
    pub(super) newton: &'a mut Newton<C>,
    pub(super) settle: &'a mut Settle<C>,
    pub(super) guess: &'a mut Guess,
    pub(super) contact: &'a mut WallContact<'b>,
    pub(super) supports: &'a mut Supports,
    pub(super) elements: &'a [ElementData],
    /// The guess, and then what was found.
    pub(super) state: &'a mut RodState,
    /// Whether the wall is stiffer than the elements of the rod.
    pub(super) stiff: bool,
    /// Part of the wall's modulus from which it is approached.
    pub(super) softest: f64,
    /// Whether there is friction.
    pub(super) inner_friction: bool,
    /// Residual over force scale of an equilibrium.
    pub(super) tolerance: f64,
    /// Most Newton iterations of one solution.
    pub(super) max_iterations: usize,
    /// Newton iterations that are left of the command's; none for the last resort, which has its own.
    pub(super) budget: Option<&'a mut usize>,
    /// Whether the device may come to rest far away: softer walls need not be settled on, and the wall itself may take long.
    pub(super) patient: bool,
    /// Newton iterations that were taken.
    pub(super) iterations: usize,
    /// How often the device slid on while the hand held still.
    pub(super) slides: u32,
}

impl<const C: usize> Search<'_, '_, C> {
    /// Finds it; `near` says whether the guess has learnt or kept its contacts. What is returned is not converged where nothing was
    /// found, and with friction it has settled or not.
    pub(super) fn run(&mut self, near: bool) -> NewtonReport {
        let stiff = self.stiff;
        self.contact.hand_over(stiff);
        if !self.patient && if stiff { near } else { self.inner_friction } {
            if let Some(found) = self.at_once() {
                return if found.is_within(self.tolerance) { self.settled(found) } else { found };
            }
            self.guess.plain(self.state);
            self.contact.rewind_friction();
        }
        let found = self.by_softer_walls();
        if found.converged { self.settled(found) } else { found }
    }

    /// From an equilibrium under the drag of where it was looked for to one under its own, where blood flows.
    pub(super) fn dragged(&mut self, mut found: NewtonReport, flow: Option<&BloodFlow>) -> NewtonReport {
        let Some(flow) = flow else { return found };
        for _ in 0..DRAG_RENEWALS {
            if !found.converged || self.contact.renew_drag(flow, self.elements, self.state) < DRAG_CHANGED {
                break;
            }
            found = self.on(false);
        }
        found
    }

    /// From an equilibrium to the next one nearby, where something has changed that is lagged; `hardly`, so that the factors at hand serve.
    pub(super) fn on(&mut self, hardly: bool) -> NewtonReport {
        let found = self.solve(STUCK, self.tolerance, hardly);
        if found.converged { self.settled(found) } else { found }
    }

    /// Newton's method from the state on.
    fn newton(&mut self, most: usize, tolerance: f64) -> NewtonReport {
        self.solve(most, tolerance, false)
    }

    /// The same; `goes_on` says that the factors at hand serve first.
    fn solve(&mut self, most: usize, tolerance: f64, goes_on: bool) -> NewtonReport {
        let left = match &self.budget {
            Some(budget) => (**budget).min(self.max_iterations),
            None => LONGEST.saturating_sub(self.iterations),
        };
        let most = most.min(left);
        let options = NewtonOptions { max_iterations: most, tolerance, goes_on, ..NewtonOptions::default() };
        let found = self.newton.solve(self.elements, self.supports, self.contact, self.state, &options);
        self.take(found.iterations);
        found
    }

    /// Counts iterations.
    fn take(&mut self, iterations: usize) {
        self.iterations += iterations;
        if let Some(budget) = &mut self.budget {
            **budget -= iterations.min(**budget);
        }
    }

    /// The wall itself, from a guess that is near.
    fn at_once(&mut self) -> Option<NewtonReport> {
        self.contact.softness = 1.0;
        let most = if self.stiff { MOST_AT_ONCE } else { STUCK };
        // What presses between instruments is renewed before it is asked for more.
        let renewed = !self.stiff && self.contact.between().turns();
        let found = self.newton(most, if renewed { self.tolerance.max(RENEWED) } else { self.tolerance });
        found.converged.then_some(found)
    }

    /// The wall by way of softer ones.
    fn by_softer_walls(&mut self) -> NewtonReport {
        let patient = self.patient;
        self.contact.softness = self.softest;
        loop {
            self.contact.hold_friction();
            let last = self.contact.softness >= 1.0;
            let most = if patient { PATIENT[usize::from(last)] } else { STUCK };
            let tolerance = if last { self.tolerance } else { self.tolerance.max(LOOSE) };
            let found = self.newton(most, tolerance);
            if last || !(found.converged || patient) {
                self.contact.softness = 1.0;
                return found;
            }
            let stiffer = STIFFER * self.contact.softness;
            self.contact.softness = if stiffer < LAST { stiffer } else { 1.0 };
            // What pressed on the softer wall presses as hard on this one.
            let Self { newton, guess, contact, supports, elements, state, .. } = self;
            let held = guess.active_set_step(newton, contact, supports, elements, state);
            self.take(usize::from(held == Held::Moved));
        }
    }

    /// Whether friction knows the normal forces of what was found.
    fn is_settled(&self) -> bool {
        !self.inner_friction || self.contact.unsettled() < SETTLED
    }

    /// From an equilibrium with the normal forces of others to one with its own.
    fn settled(&mut self, mut found: NewtonReport) -> NewtonReport {
        // On a wall that is no stiffer than the rod they settle by themselves, if they do.
        while !self.stiff && self.budget.is_some() && !self.is_settled() && !self.contact.handed_over() {
            self.contact.unsettle_friction();
            found = self.newton(STUCK, self.tolerance);
            if !found.converged {
                return found;
            }
        }
        if self.is_settled() {
            return found;
        }
        self.guess.other.copy_from(self.state);
        if self.budget.is_some()
            && let Some(found) = self.together()
        {
            return found;
        }
        self.state.copy_from(&self.guess.other);
        self.contact.rewind_friction();
        found = self.newton(STUCK, self.tolerance);
        let mut near = NEARLY;
        for slide in 0.. {
            if !found.converged || self.is_settled() || slide == SLIDES[usize::from(self.budget.is_none())] {
                break;
            }
            if self.contact.unsettled() < near {
                near = FARTHER * self.contact.unsettled();
                self.guess.other.copy_from(self.state);
                self.contact.mark_friction();
                if let Some(found) = self.together() {
                    return found;
                }
                self.state.copy_from(&self.guess.other);
                self.contact.rewind_friction();
                // What presses there is seen again.
                let again = self.newton(STUCK, self.tolerance);
                if !again.converged {
                    return again;
                }
            }
            self.contact.anchor_friction(self.elements, self.state);
            self.contact.hold_friction();
            found = self.slid();
            self.slides += 1;
        }
        found
    }

    /// To where it slides. What has used up the budget of its command on the way goes on from there: the last resort would begin anew and
    /// come the same way.
    fn slid(&mut self) -> NewtonReport {
        if self.budget.is_some() {
            let found = self.newton(SLID, self.tolerance);
            if found.converged || self.budget.as_ref().is_some_and(|left| **left > 0) {
                return found;
            }
            self.budget = None;
        }
        self.newton(PATIENT[2], self.tolerance)
    }

    /// Friction and wall solved for together. What is found may be no minimum, and is left then.
    fn together(&mut self) -> Option<NewtonReport> {
        for _ in 0..ROUNDS {
            let left = self.budget.as_ref().map_or(usize::MAX, |budget| **budget);
            let limits = (self.tolerance, left.min(TOGETHER));
            let system = (&mut *self.newton, &mut *self.contact, &mut *self.supports);
            let (there, iterations) = self.settle.solve(system, self.elements, self.state, limits);
            self.take(iterations);
            if !there {
                return None;
            }
            let found = self.newton(STUCK, self.tolerance);
            if !found.converged {
                return None;
            }
            if self.is_settled() {
                return Some(found);
            }
        }
        None
    }
}
