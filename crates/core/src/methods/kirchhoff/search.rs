//! From a prediction to the nearest equilibrium, or to where the device comes to rest.
//!
//! Newton's method goes from the prediction to a minimum, with friction following the contact forces. If no
//! equilibrium is found, it is not near, and the part of the command is shortened.
//!
//! If none is near however short the part, friction is held at the normal forces of its start: then the energy is
//! bounded below, every Newton step lowers it, and the iteration ends at a minimum. If friction that follows from
//! there finds no equilibrium nearby, the hand holds still and the device relaxes: slip is repeatedly reset, with the
//! current normal forces, until they no longer change. Each relaxation starts almost without motion, so it ends lower than
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

use super::Environment;
use super::guess::Guess;
use super::joined::Resistance;
use super::mesh::Mesh;
use super::part::{Effort, Lost};
use super::workspace::Tools;
use super::yielding::{Follows, Yielding};
use crate::Vec3;
use crate::contact::{SelfContact, Touch, WallContact};
use crate::device::Stack;
use crate::flow::BloodFlow;
use crate::rod::{ElementData, RodState, Supports};
use crate::solve::{External, Newton, NewtonOptions, NewtonReport, StopReason, Together};
use crate::tuning::Tuning;

/// What the lagged forces follow from, besides the state.
pub(super) struct Lagged<'a> {
    /// The blood, if it flows.
    pub(super) flow: Option<&'a BloodFlow>,
    pub(super) stack: &'a Stack,
    pub(super) mesh: &'a Mesh,
}

/// What a search may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub(super) effort: Effort,
    /// Largest number of Newton iterations.
    pub(super) most: usize,
    /// Largest number of linear solves.
    pub(super) most_solves: usize,
    /// Newton iterations and last shift of earlier commands in the first solution.
    pub(super) resumed: Option<(usize, f64)>,
    /// Where the last search was for the same points: how far material points of the vessel have moved since, at most, mm.
    pub(super) moved_mm: Option<f64>,
}

/// Where a search begins: what it changes before all that acts on the rod is known.
pub(super) struct Beginning<'a, 'b, const C: usize> {
    pub(super) newton: &'a mut Newton<C>,
    pub(super) guess: &'a mut Guess,
    pub(super) contact: &'a mut WallContact<'b>,
    pub(super) loops: Option<&'a mut SelfContact>,
    pub(super) state: &'a mut RodState,
}

impl<const C: usize> Tools<C> {
    /// Calls `what` with a search from the state to which `begin` changes `rod`, and with all that acts on it there, the
    /// instruments being those of `stack`. Counts the wall's queries.
    pub(super) fn with_search<T, E>(
        &mut self,
        environment: &Environment<'_>,
        (mesh, stack, rod): (&Mesh, &Stack, &mut RodState),
        bounds: Bounds,
        begin: impl FnOnce(Beginning<'_, '_, C>) -> Result<(), E>,
        what: impl FnOnce(&mut Search<'_, '_, C>, &Lagged<'_>) -> T,
    ) -> Result<T, E> {
        let (surroundings, options) = (&environment.surroundings, environment.options);
        let (elements, tuning) = (&mesh.elements[..], &options.tuning);
        let (cache, friction) = (&mut self.cache, &mut self.friction);
        let softest_nmm2 = stack.softest_nmm2();
        let (wall, points) = (environment.wall(), &mesh.points);
        let mut contact = match bounds.moved_mm {
            None => WallContact::new(wall, points, cache, friction, softest_nmm2),
            Some(by_mm) => WallContact::again(wall, points, (cache, friction), softest_nmm2, by_mm),
        };
        let slid_mj = contact.begin_drag(surroundings.flow, &mut self.drag, elements, rod);
        let mut loops = options.self_contact.then_some(&mut self.loops);
        let begun = begin(Beginning {
            newton: &mut self.newton,
            guess: &mut self.guess,
            contact: &mut contact,
            loops: loops.as_deref_mut(),
            state: rod,
        });
        if begun.is_err() {
            self.counters.add(&contact.count());
        }
        begun?;
        let start_angles = self.tails.held();
        let mut supports = Supports { start_tangent: true, start_angles, ..Supports::default() };
        let per_mm4 = tuning.steps.coil_resistance_per_mm4;
        let mut free =
            (!self.joined.is_empty()).then(|| Resistance::of(elements, rod, mesh.line() + 1, per_mm4));
        let mut fields = environment.field_load(mesh);
        let free = free.as_mut().map(|free| free as &mut dyn External);
        let fields = fields.as_mut().map(|fields| fields as &mut dyn External);
        let tails = self.tails.act().then_some(&mut self.tails as &mut dyn External);
        let mut search = Search {
            newton: &mut self.newton,
            guess: &mut self.guess,
            contact: &mut contact,
            loops,
            beside: [free, fields, tails],
            supports: &mut supports,
            elements,
            state: rod,
            has_friction: environment.has_friction(),
            tolerance: options.tolerance,
            tuning,
            bounds,
            slid_mj,
            iterations: 0,
            solves: 0,
            slides: 0,
        };
        let found = what(&mut search, &Lagged { flow: surroundings.flow, stack, mesh });
        self.counters.add(&contact.count());
        Ok(found)
    }
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
    /// Numbers that are choices.
    pub(super) tuning: &'a Tuning,
    pub(super) bounds: Bounds,
    /// Potential of the drag where it began, mJ.
    pub(super) slid_mj: f64,
    /// Newton iterations taken.
    pub(super) iterations: usize,
    /// Linear solves taken.
    pub(super) solves: usize,
    /// Number of slides with the hand held still.
    pub(super) slides: u32,
}

/// What a result is judged by, beside what the search knows.
#[derive(Clone, Copy)]
pub(super) struct Judged<'a> {
    /// The vessel's course, if it yields, and how far it may follow at once, mm.
    pub(super) course: Option<(&'a Yielding<'a>, f64)>,
    /// Newton iterations of earlier commands.
    pub(super) before: usize,
    /// Whether it may be anywhere.
    pub(super) may_snap: bool,
}

/// The result of a search.
pub(super) struct Searched {
    pub(super) found: NewtonReport,
    /// Newton iterations and linear solves.
    pub(super) taken: (usize, usize),
    /// Why it is no end of a part.
    pub(super) wrong: Option<Lost>,
    /// Number of slides with the hand held still.
    pub(super) slides: u32,
    /// Relative difference of lagged forces from those that follow from it.
    pub(super) unsettled: f64,
    /// Whether it is an equilibrium.
    pub(super) balanced: bool,
    /// Whether the solves were used up on the way to where the device comes to rest.
    pub(super) is_interrupted: bool,
    /// Distance from the prediction, as a fraction of the allowed one.
    pub(super) off: f64,
    /// The node that is farthest from its prediction, mm.
    pub(super) farthest_mm: Vec3,
    /// Work of the drag, mJ.
    pub(super) by_drag_mj: f64,
    /// How the vessel's course follows, if it is not in equilibrium yet: then nothing else was tested.
    pub(super) follows: Option<Follows>,
}

impl Searched {
    /// With what was found and taken after it, in a vessel that has yielded further.
    pub(super) fn then(self, next: Self) -> Self {
        let farther = if next.off > self.off { &next } else { &self };
        let (off, farthest_mm) = (farther.off, farther.farthest_mm);
        Self {
            taken: (self.taken.0 + next.taken.0, self.taken.1 + next.taken.1),
            slides: self.slides + next.slides,
            off,
            farthest_mm,
            by_drag_mj: self.by_drag_mj + next.by_drag_mj,
            ..next
        }
    }
}

impl<const C: usize> Search<'_, '_, C> {
    /// Searches and judges the result; stores its contacts unless it is wrong.
    pub(super) fn searched(
        &mut self,
        lagged: &Lagged<'_>,
        judged: &Judged<'_>,
        touches: &mut Vec<(usize, Touch)>,
    ) -> Searched {
        let (found, lagging) = self.run(lagged);
        let (elements, tuning, effort) = (self.elements, self.tuning, self.bounds.effort);
        let unsettled = self.unsettled().max(lagging);
        let neighbourhood = &self.newton.neighbourhood;
        let (off, farthest_mm) =
            (neighbourhood.off(self.state, &tuning.newton), neighbourhood.farthest(self.state));
        let too_far = off > neighbourhood.most_off(&tuning.newton) && !judged.may_snap;
        let used_up = found.reason == StopReason::MaxIterations && self.solves >= self.bounds.most_solves;
        // A device that slides or relaxes when the solves are used up is seen on its way.
        let is_interrupted = used_up && (effort == Effort::Flight || self.slides > 0);
        let near = effort != Effort::Flight && !is_interrupted;
        // A device that has come to a stop is accepted as an equilibrium if its accuracy is that of friction elsewhere.
        let settled = tuning.friction.settled;
        let balanced = (found.converged || (!near && found.residual < settled)) && unsettled < settled;
        let goes_on = used_up && judged.before + self.iterations < tuning.steps.most_near;
        let wrong = Lost::of(&found, (near, goes_on), balanced, too_far);
        let rests = wrong.is_none() && found.converged && !is_interrupted;
        let course = judged.course.filter(|_| rests);
        let follows = course.map_or(Ok(None), |(course, most_mm)| course.follow(self, lagged, most_mm));
        let (follows, wrong) = match follows {
            Ok(follows) => (follows, wrong),
            Err(reason) => (None, Some(Lost::Unsolved(reason, found.residual))),
        };
        let is_end = follows.is_none();
        let wrong = wrong.or_else(|| {
            if !is_end {
                return None;
            }
            self.contact.know_whole_base(elements);
            let passes = tuning.steps.tests_passing && self.contact.passes_through(elements, self.state);
            passes.then_some(Lost::Passed)
        });
        if wrong.is_none() && is_end {
            self.contact.touches(elements, self.state, touches);
            if is_interrupted {
                // The next command continues from here, with these normal forces.
                self.contact.anchor_friction(elements, self.state);
            }
        }
        Searched {
            found,
            taken: (self.iterations, self.solves),
            wrong,
            slides: self.slides,
            unsettled,
            balanced,
            is_interrupted,
            off,
            farthest_mm,
            by_drag_mj: (self.contact.drag_mj(elements, self.state) - self.slid_mj).abs(),
            follows,
        }
    }

    /// Searches. The report is not converged if nothing was found; with friction it may be unsettled. The number is the
    /// relative change of the lagged forces from those used in its solution.
    ///
    /// The drag of the blood and the normal forces between instruments follow from an equilibrium and move the next
    /// one. Those at the state are used in the next solution, until they no longer change.
    pub(super) fn run(&mut self, lagged: &Lagged<'_>) -> (NewtonReport, f64) {
        if self.bounds.effort != Effort::Near {
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
        let was_resumed = self.bounds.resumed.is_some();
        let found = self.newton();
        if self.bounds.effort == Effort::Near || !found.converged || self.is_settled() {
            return found;
        }
        // Following friction in vain might take all solves of every tick.
        if was_resumed {
            return self.slide(found);
        }
        self.guess.other.copy_from(self.state);
        let most = self.bounds.most;
        self.bounds.most = most.min(self.iterations + self.tuning.steps.following);
        self.contact.release_friction();
        self.with_loops(SelfContact::release_friction);
        let found = self.newton();
        self.bounds.most = most;
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
        let (before, last_shift) = self.bounds.resumed.take().unwrap_or_default();
        let most = if self.bounds.effort == Effort::Flight {
            steps.most_moving
        } else {
            steps.most_near - before.min(steps.most_near - 1)
        };
        let options = NewtonOptions {
            max_iterations: most.min(self.bounds.most.saturating_sub(self.iterations)),
            max_solves: self.bounds.most_solves.saturating_sub(self.solves),
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

    /// As [`Search::assemble`], with lagged forces as they were.
    pub(super) fn assemble_once(&mut self, hessian: bool) {
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
