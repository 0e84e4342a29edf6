//! One sub-step: a prediction of the device's configuration, and Newton's method from there.

use std::sync::Arc;

use super::balance::Balance;
use super::carried::{Passage, work_of_wall};
use super::configuration::{Configuration, Start};
use super::hands::{Hand, line_advance_mm, longest_mm, set_motions, steered};
use super::joined::{Resistance, join};
use super::loops::{advances_mm, capsules};
use super::mesh::Mesh;
use super::part::{Effort, Found, Limits, Lost};
use super::search::{Lagged, Search};
use super::state::{KirchhoffState, UnderWay};
use super::transport::{place_on_curve, transport, transport_together};
use super::workspace::Tools;
use super::{Environment, inner_friction, meshed};
use crate::contact::{ContactPoint, FrictionLaw, WallContact, least_force_n, stick_mm};
use crate::rod::{RodState, Supports};
use crate::solve::{External, StopReason};

/// A part of a command.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<'a> {
    /// How it is solved.
    pub(super) effort: Effort,
    /// Largest motion of a hand in it, mm.
    pub(super) part_mm: f64,
    /// How much of what changes around the device is over after it, 0 to 1.
    pub(super) to: f64,
    /// Whether it only goes on from where the last part has left the device, with the hands held still.
    pub(super) holds_still: bool,
    /// Earlier commands' progress in it.
    pub(super) resumed: Option<&'a UnderWay>,
}

/// A part to be solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt<'a> {
    pub(super) part: Part<'a>,
    /// Positions of the hands after it.
    pub(super) hands: &'a [Hand],
    pub(super) limits: Limits,
    /// If the vessel moves: the start before its motion, and the motion. The part then starts with the displaced
    /// device.
    pub(super) left: Option<(Start<'a>, Passage<'a>)>,
}

impl<const C: usize> Tools<C> {
    /// Slides the device at `start` to the positions of the hands, on the mesh of the length then inserted, with its
    /// friction and knowledge of the wall; coils do not move.
    pub(super) fn transport_to(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        Attempt { hands, left, part: Part { resumed, .. }, .. }: Attempt<'_>,
        next: &mut Configuration,
    ) {
        let (mesh, after) = next.parts();
        meshed(environment, hands, mesh);
        let stack = environment.surroundings.stack;
        self.tails.begin(environment, (start.state, hands));
        let tails = &self.tails;
        let tail = |instrument: usize, from_tip_mm: f64| match stack.sets()[instrument] {
            Some(_) => tails.angle_before(stack, instrument, from_tip_mm),
            None => 0.0,
        };
        let transport_from = |start: Start<'_>, rod: &mut RodState| {
            let from = (start.mesh, &start.state.rod);
            if mesh.elements.is_empty() {
                rod.copy_from(from.1);
                rod.truncate(1);
            } else if stack.is_several() {
                transport_together(from, mesh, (stack.sets(), tail), rod);
            } else {
                transport(from, mesh, |from_tip_mm| tail(0, from_tip_mm), rod);
            }
        };
        set_motions(&start.state.hands, hands, &mut self.guess.motions);
        self.guess.before_motion.clear();
        if self.friction.acts() {
            // Slip is measured from where the device was before the vessel moved.
            let was = left.map_or(start, |(was, _)| was);
            transport_from(was, &mut after.rod);
            let before = (&start.mesh.points[..], &start.state.forces[..]);
            let slid = |point: &ContactPoint| {
                place_on_curve(was.mesh, &was.state.rod, mesh.from_tip_mm[0] - point.from_tip_mm)
            };
            self.friction.begin_on(slid, &after.rod, &mesh.points, before, &self.guess.motions);
            if let Some((_, passage)) = left {
                self.friction.carry(passage, &self.guess.motions);
                self.guess.before_motion.extend_from_slice(&after.rod.frames);
                transport_from(start, &mut after.rod);
            }
        } else {
            transport_from(start, &mut after.rod);
        }
        let (places, moves) = (&mut self.friction.between, &self.guess.motions);
        let pressed = resumed.map_or(start, |resumed| Start { mesh, state: &resumed.state });
        inner_friction::begin(stack, pressed, (mesh, &after.rod), moves, places);
        after.move_hands(hands);
        let on_line = mesh.points.len();
        self.joined.add_to(mesh);
        join(&mut after.rod, &start.state.coils);
        self.newton.resize(mesh.elements.len());
        let mut first = on_line;
        for coil in start.state.coils.iter() {
            let points = &mesh.points[first..first + coil.known.len()];
            self.friction.go_on(&mesh.elements, &after.rod, points, &coil.forces);
            first += points.len();
        }
        if let Some(UnderWay { state, .. }) = resumed {
            self.friction.resume(state.forces.iter().chain(state.coils.iter().flat_map(|coil| &coil.forces)));
            self.cache.resume(&state.known);
            state.coils.iter().for_each(|coil| self.cache.go_on(&coil.known));
        } else {
            let advance_mm = line_advance_mm(moves);
            let points = &mesh.points[..on_line];
            self.cache.begin(&start.state.known, &start.mesh.points, points, advance_mm);
            start.state.coils.iter().for_each(|coil| self.cache.go_on(&coil.known));
        }
    }

    /// Begins a part for loops and coils, with their friction and the forces by which they are pressed; returns whether
    /// the tip would be pushed through one.
    fn begin_loops(
        &mut self,
        environment: &Environment<'_>,
        (start, resumed): (Start<'_>, Option<&UnderWay>),
        (mesh, rod): (&Mesh, &RodState),
    ) -> bool {
        let (stack, motions) = (environment.surroundings.stack, &self.guess.motions);
        let radius_mm = mesh.points.first().map_or(0.0, |point| point.potential.radius_mm);
        let tuning = &environment.options.tuning;
        let friction = FrictionLaw {
            coefficient: environment.options.self_friction,
            stick_mm: stick_mm(motions, radius_mm, &tuning.friction),
            least_n: least_force_n(stack.softest_nmm2(), tuning.contact.gentlest_bend_mm),
        };
        self.loops.renew(&mesh.elements, capsules(mesh, stack).chain(self.joined.capsules()));
        let place = |from_tip_mm: &f64| {
            place_on_curve(start.mesh, &start.state.rod, mesh.from_tip_mm[0] - from_tip_mm).0
        };
        let places = mesh.from_tip_mm.iter().map(place);
        self.loops.begin_friction(rod, places, advances_mm(mesh, stack, motions), friction);
        let pressed = &resumed.map_or(start.state, |resumed| &resumed.state).pairs;
        self.loops.recall(&mesh.elements, pressed);
        self.loops.blocks_its_tip(&mesh.elements, rod, line_advance_mm(motions))
    }

    /// Stores what the next sub-step starts with, and removes the coils from the line.
    pub(super) fn keep(&self, start: Start<'_>, mesh: &mut Mesh, after: &mut KirchhoffState) {
        self.friction.keep(&mut after.forces);
        self.loops.keep(&mut after.pairs);
        self.cache.keep(&mut after.known);
        let coils = &start.state.coils;
        after.coils = match self.joined.is_empty() {
            true => Arc::clone(coils),
            false => Arc::new(self.joined.take_off(coils, mesh, after)),
        };
        inner_friction::keep(&self.friction.between, &after.rod, mesh, &mut after.inner_friction);
    }

    /// Energy dissipated by friction on the wall, of loops on each other and between instruments, at least and at most,
    /// mJ.
    fn dissipated_mj(&self, mesh: &Mesh, rod: &RodState) -> (f64, f64) {
        let on_wall = self.friction.dissipated_mj(&mesh.elements, rod, &mesh.points);
        let on_loops = self.loops.dissipated_mj();
        let between_mj = self.friction.between.taken_mj(rod);
        (on_wall.0 + on_loops.0 + between_mj, on_wall.1 + on_loops.1 + between_mj)
    }

    /// The energy balance of a part in which the wall moved, the drag did `by_drag_mj`, and friction dissipated
    /// this at least and at most.
    fn balance(
        &self,
        environment: &Environment<'_>,
        (was, is): (Start<'_>, Start<'_>),
        (left, by_drag_mj): (Option<(Start<'_>, Passage<'_>)>, f64),
        friction_mj: (f64, f64),
    ) -> Balance {
        let motions = &self.guess.motions;
        let flow_mj = by_drag_mj + self.drag.size_n() * longest_mm(motions);
        let touches = [was, is].map(|at| &at.state.touches[..]);
        let by_wall = work_of_wall(left.map(|(_, passage)| passage), touches);
        let by_others = by_wall.with_flow(flow_mj).with(work_of_fields(environment, was, is));
        let [least_mj, most_mj] = self.around_mj;
        let friction_mj = (friction_mj.0 + least_mj, friction_mj.1 + most_mj);
        let tuning = &environment.options.tuning.steps;
        let forces = (&was.state.hand_forces[..], &is.state.hand_forces[..]);
        let energies = (was.state.energy, is.state.energy);
        let stack = environment.surroundings.stack;
        Balance::new(
            [&*steered(stack, &was.state.hands), stack],
            motions,
            forces,
            energies,
            by_others,
            friction_mj,
            tuning,
        )
    }

    /// One part from `start`: slides and solves on `next`, whose content is invalid after a failure.
    #[allow(clippy::too_many_lines, reason = "what is borrowed for the search lives through all of it")]
    pub(super) fn try_step(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        attempt: Attempt<'_>,
        next: &mut Configuration,
    ) -> std::result::Result<Found, Lost> {
        let steered = steered(environment.surroundings.stack, attempt.hands);
        let environment = &environment.steered(&steered);
        let (surroundings, options) = (&environment.surroundings, environment.options);
        let tuning = &options.tuning;
        let Attempt { part: Part { effort, part_mm, resumed, .. }, limits, left, .. } = attempt;
        self.transport_to(environment, start, attempt, next);
        let (mesh, after) = next.parts();
        let rod = &mut after.rod;
        let in_its_own_way =
            options.self_contact && self.begin_loops(environment, (start, resumed), (mesh, rod));
        let softest_nmm2 = surroundings.stack.softest_nmm2();
        let (cache, friction) = (&mut self.cache, &mut self.friction);
        let mut contact = WallContact::new(environment.wall(), &mesh.points, cache, friction, softest_nmm2);
        let slid_mj = contact.begin_drag(surroundings.flow, &mut self.drag, &mesh.elements, rod);
        let mut loops = options.self_contact.then_some(&mut self.loops);
        let may_snap = part_mm <= tuning.steps.snap_radii * surroundings.device.min_radius_mm();
        if let Some(resumed) = resumed {
            let mut under_way = resumed.state.rod.clone();
            join(&mut under_way, &resumed.state.coils);
            self.guess.resume(&under_way, rod);
            self.newton.neighbourhood.clone_from(&resumed.neighbourhood);
        } else {
            let (slid, repeats) = ((start, &*mesh, &mut *rod), tuning.steps.repeats);
            let guessed = self.guess.choose(&mut contact, loops.as_deref_mut(), slid, repeats);
            let inside = guessed && !in_its_own_way;
            if in_its_own_way || (effort != Effort::Flight && !inside) {
                self.counters.add(&contact.count());
                return Err(Lost::Beyond);
            }
            contact.rooms(&mesh.elements, rod, &mut self.guess.room_mm);
            self.newton.neighbourhood.begin(rod, &self.guess.room_mm, &tuning.newton);
        }
        // What may end in a snap is solved once, wherever it leads.
        self.newton.neighbourhood.bounds = effort != Effort::Flight && !may_snap;
        let start_angles = self.tails.held();
        let mut supports = Supports { start_tangent: true, start_angles, ..Supports::default() };
        let per_mm4 = tuning.steps.coil_resistance_per_mm4;
        let mut free =
            (!self.joined.is_empty()).then(|| Resistance::of(&mesh.elements, rod, mesh.line() + 1, per_mm4));
        let mut fields = environment.field_load(&*mesh);
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
            elements: &mesh.elements,
            state: rod,
            has_friction: environment.has_friction(),
            tolerance: options.tolerance,
            effort,
            tuning,
            most: match effort {
                Effort::Near | Effort::Held => limits.iterations.min(options.max_iterations),
                Effort::Flight => limits.iterations,
            },
            most_solves: limits.solves,
            resumed: resumed.map(|resumed| (resumed.iterations, resumed.shift)),
            iterations: 0,
            solves: 0,
            slides: 0,
        };
        let lagged = Lagged { flow: surroundings.flow, stack: surroundings.stack, mesh };
        let (found, lagging) = search.run(&lagged);
        let unsettled = search.unsettled().max(lagging);
        let (taken, slides) = ((search.iterations, search.solves), search.slides);
        let off = self.newton.neighbourhood.off(rod, &tuning.newton);
        let used_up = found.reason == StopReason::MaxIterations && taken.1 >= limits.solves;
        // A device that slides or relaxes when the solves are used up is seen on its way.
        let is_interrupted = used_up && (effort == Effort::Flight || slides > 0);
        let near = effort != Effort::Flight && !is_interrupted;
        // A device at rest is accepted as an equilibrium if its accuracy is that of friction elsewhere.
        let settled = tuning.friction.settled;
        let balanced = (found.converged || (!near && found.residual < settled)) && unsettled < settled;
        let goes_on =
            used_up && resumed.map_or(0, |resumed| resumed.iterations) + taken.0 < tuning.steps.most_near;
        let too_far = off > self.newton.neighbourhood.most_off(&tuning.newton) && !may_snap;
        let wrong = Lost::of(&found, (near, goes_on), balanced, too_far).or_else(|| {
            contact.know_whole_base(&mesh.elements);
            let passes = tuning.steps.tests_passing && contact.passes_through(&mesh.elements, rod);
            passes.then_some(Lost::Passed)
        });
        if wrong.is_none() {
            contact.touches(&mesh.elements, rod, &mut after.touches);
            if is_interrupted {
                // The next command continues from here, with these normal forces.
                contact.anchor_friction(&mesh.elements, rod);
            }
        }
        let by_drag_mj = (contact.drag_mj(&mesh.elements, rod) - slid_mj).abs();
        self.counters.add(&contact.count());
        self.work.add(taken, mesh.elements.len());
        if let Some(wrong) = wrong {
            if wrong == Lost::UnderWay {
                self.keep(start, mesh, after);
            }
            return Err(wrong);
        }
        let friction_mj = self.dissipated_mj(mesh, rod);
        let farthest_mm = self.newton.neighbourhood.farthest(rod);
        self.keep(start, mesh, after);
        let outside_mj = self.write_forces(environment, next);
        // Where the device is not at rest its own are arbitrary, and would count as work.
        if found.residual > tuning.steps.at_rest {
            next.parts().1.hand_forces.clone_from(&start.state.hand_forces);
        }
        let balance = self.balance(environment, (start, next.start()), (left, by_drag_mj), friction_mj);
        let after = next.parts().1;
        let lacks = balance.lacks();
        // Only a short part shows a jump: in a long one forces may go far beyond their values at its ends.
        if near && (lacks || (balance.is_set_free() && !may_snap)) {
            return Err(Lost::Unbalanced);
        }
        let residual = found.residual;
        self.guess.teach(&after.rod, &mut after.correction);
        Ok(Found {
            slides,
            outside_mj,
            residual,
            unsettled,
            balanced,
            is_interrupted,
            lacks,
            off,
            farthest_mm,
            balance,
        })
    }
}

/// Work of changing fields, mJ: the change of the field energy at the old and at the new configuration.
fn work_of_fields(environment: &Environment<'_>, was: Start<'_>, is: Start<'_>) -> [f64; 2] {
    let at_first = environment.field_mj(was.mesh, &was.state.rod) - was.state.energy.field;
    if !environment.surroundings.fields_change() {
        return [at_first; 2];
    }
    let before = environment.with_fields_at(0.0);
    [at_first, is.state.energy.field - before.field_mj(is.mesh, &is.state.rod)]
}
