//! One sub-step: a guess of where the device will be, and Newton's method from there.

use std::sync::Arc;

use super::balance::Balance;
use super::carried::{Passage, WallWork};
use super::command::AT_REST;
use super::configuration::{Configuration, Start};
use super::hands::{Hand, motions};
use super::joined::{Resistance, join};
use super::loops::{advances_mm, skins};
use super::mesh::Mesh;
use super::search::Search;
use super::state::{KirchhoffState, UnderWay};
use super::transport::{transport, transport_together};
use super::workspace::Tools;
use super::{Environment, inner_friction, meshed};
use crate::contact::{Rubs, SETTLED, WallContact, least_force_n, stick_mm};
use crate::methods::{Jump, StepReport};
use crate::rod::{RodState, Supports};
use crate::solve::{External, NewtonReport, StopReason};

/// How a part of a command is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// To the equilibrium near the prediction, friction following the wall's forces.
    Near,
    /// The same, friction held to the wall's forces where the part begins; then the device slides to where it rests.
    Held,
    /// To where the device comes to rest, however far away.
    Flight,
    /// As far to where it comes to rest as a tick goes.
    Moving,
}

/// What a part of a command has come to.
pub(super) struct Found {
    /// How often the device slid on while the hand held still.
    pub(super) slides: u32,
    /// Energy that friction took, mJ.
    pub(super) dissipated_mj: f64,
    /// Energy that came from nowhere on a way to rest: less is set free on the rest of it, mJ.
    pub(super) borrowed_mj: f64,
    /// Residual over force scale.
    pub(super) residual: f64,
    /// Part by which the normal forces that friction follows differ from those of the wall.
    pub(super) unsettled: f64,
    /// Whether it is an equilibrium.
    pub(super) balanced: bool,
    /// Whether more energy is stored and taken by friction than was put in: it is none that a motion of this part leads to.
    pub(super) lacks: bool,
    /// How far it is from the prediction, over how far is near.
    pub(super) off: f64,
    /// The jump, if it is one.
    pub(super) jump: Option<Jump>,
}

/// Why a part came to nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Lost {
    /// The prediction is on the other side of the wall, or of the device itself.
    Beyond,
    /// What was found is.
    Passed,
    /// Energy came from nowhere.
    Unbalanced,
    /// No equilibrium was found, and that residual over force scale is left.
    Unsolved(StopReason, f64),
    /// The linear solves of a tick were used up first.
    UnderWay,
}

impl Lost {
    /// What is wrong with a solution that is so far `off` its prediction, which it is to be `near` or not, and which may have `used_up` its
    /// linear solves.
    fn of(found: &NewtonReport, (near, used_up): (bool, bool), balanced: bool, off: f64) -> Option<Self> {
        let folded = !found.residual.is_finite() || found.reason == StopReason::Folded;
        let reason = match (near, found.converged) {
            (true, false) if used_up => return Some(Self::UnderWay),
            (true, false) => found.reason,
            (true, true) if !balanced => StopReason::Unsettled,
            (true, true) if off > 1.0 => StopReason::Left,
            (false, _) if folded => found.reason,
            _ => return None,
        };
        Some(Self::Unsolved(reason, found.residual))
    }
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Beyond => f.write_str("the device would be predicted beyond the wall or through itself"),
            Self::Passed => f.write_str("the device would pass through the wall"),
            Self::Unbalanced => f.write_str("more energy is stored and taken by friction than was put in"),
            Self::Unsolved(reason, residual) => write!(f, "{reason} (residual {residual:.1e})"),
            Self::UnderWay => f.write_str("the linear solves of the tick are used up"),
        }
    }
}

/// How far a part goes, and how.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt<'a> {
    /// Where the hands are after it.
    pub(super) hands: &'a [Hand],
    /// How it is gone.
    pub(super) effort: Effort,
    /// Most Newton iterations.
    pub(super) most: usize,
    /// Most linear solves: those of a tick, as many as it takes in a step.
    pub(super) solves: usize,
    /// How far ticks have come with this part already.
    pub(super) resumed: Option<&'a UnderWay>,
    /// Where the vessel moves: what was before it did, and how it does. The part then starts with the device taken along.
    pub(super) left: Option<(Start<'a>, Passage<'a>)>,
}

impl<const C: usize> Tools<C> {
    /// Slides the device at `start` to where the hands are, on the mesh of what is in then, with its friction and what is known of the wall;
    /// coils stay where they are.
    fn transport_to(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        Attempt { hands, left, resumed, .. }: Attempt<'_>,
        next: &mut Configuration,
    ) {
        let (mesh, after) = next.parts();
        meshed(environment, hands, mesh);
        let stack = environment.surroundings.stack;
        let transport_from = |start: Start<'_>, rod: &mut RodState| {
            let from = (start.mesh, &start.state.rod);
            if mesh.elements.is_empty() {
                rod.copy_from(from.1);
                rod.truncate(1);
            } else if stack.is_several() {
                transport_together(from, mesh, stack.sets(), rod);
            } else {
                transport(from, mesh, rod);
            }
        };
        motions(&start.state.report, hands, &mut self.guess.motions);
        if self.friction.acts() {
            // What slips is counted from where the device lay before the vessel moved.
            transport_from(left.map_or(start, |(was, _)| was), &mut after.rod);
            let before = (&start.mesh.points[..], &start.state.forces[..]);
            self.friction.begin(&mesh.elements, &after.rod, &mesh.points, before, &self.guess.motions);
            if let Some((_, passage)) = left {
                self.friction.carry(passage, &self.guess.motions);
            }
        }
        // Where the vessel did not move it lies there already.
        if !self.friction.acts() || left.is_some() {
            transport_from(start, &mut after.rod);
        }
        let (places, moves) = (&mut self.friction.between, &self.guess.motions);
        let pressed = resumed.map_or(start, |resumed| Start { mesh, state: &resumed.state });
        inner_friction::begin(stack, pressed, (mesh, &after.rod), moves, places);
        after.turn_tails(stack, hands);
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
            let advance_mm = mesh.from_tip_mm[0] - start.mesh.from_tip_mm[0];
            let points = &mesh.points[..on_line];
            self.cache.begin(&start.state.known, &start.mesh.points, points, advance_mm);
            start.state.coils.iter().for_each(|coil| self.cache.go_on(&coil.known));
        }
    }

    /// Begins a part for loops and coils, with its friction; returns whether the tip would be pushed through one.
    fn begin_loops(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        (mesh, rod): (&Mesh, &RodState),
    ) -> bool {
        let (stack, motions) = (environment.surroundings.stack, &self.guess.motions);
        let radius_mm = mesh.points.first().map_or(0.0, |point| point.potential.radius_mm);
        let friction = Rubs {
            coefficient: environment.options.self_friction,
            stick_mm: stick_mm(motions, radius_mm),
            least_n: least_force_n(stack.softest_nmm2()),
        };
        self.loops.renew(&mesh.elements, skins(mesh, stack).chain(self.joined.skins()));
        self.loops.begin_friction(rod, advances_mm(mesh, stack, motions), friction);
        let advance_mm = mesh.from_tip_mm[0] - start.mesh.from_tip_mm[0];
        self.loops.blocks_its_tip(&mesh.elements, rod, advance_mm)
    }

    /// Gives the state what the next sub-step starts with, and takes the coils off the line.
    fn keep(&self, start: Start<'_>, mesh: &mut Mesh, after: &mut KirchhoffState) {
        self.friction.keep(&mut after.forces);
        self.cache.keep(&mut after.known);
        let coils = &start.state.coils;
        after.coils = match self.joined.is_empty() {
            true => Arc::clone(coils),
            false => Arc::new(self.joined.take_off(coils, mesh, after)),
        };
        inner_friction::keep(&self.friction.between, &after.rod, mesh, &mut after.inner_friction);
    }

    /// One part from `start`: slides and solves on `next`, which is worth nothing if that fails.
    pub(super) fn try_step(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        attempt: Attempt<'_>,
        next: &mut Configuration,
    ) -> std::result::Result<Found, Lost> {
        let (surroundings, options) = (&environment.surroundings, environment.options);
        let Attempt { hands, effort, most, left, resumed, .. } = attempt;
        self.transport_to(environment, start, attempt, next);
        let (mesh, after) = next.parts();
        let rod = &mut after.rod;
        let in_its_own_way = options.self_contact && self.begin_loops(environment, start, (mesh, rod));
        let softest_nmm2 = surroundings.stack.softest_nmm2();
        let (cache, friction) = (&mut self.cache, &mut self.friction);
        let mut contact = WallContact::new(environment.wall(), &mesh.points, cache, friction, softest_nmm2);
        let slid_mj = contact.begin_drag(surroundings.flow, &mut self.drag, &mesh.elements, rod);
        let mut loops = options.self_contact.then_some(&mut self.loops);
        let near = matches!(effort, Effort::Near | Effort::Held);
        if let Some(resumed) = resumed {
            let mut under_way = resumed.state.rod.clone();
            join(&mut under_way, &resumed.state.coils);
            self.guess.resume(&under_way, rod);
            self.newton.neighbourhood.clone_from(&resumed.neighbourhood);
        } else {
            let guessed = self.guess.choose(&mut contact, loops.as_deref_mut(), (start, &*mesh, &mut *rod));
            let inside = guessed && !in_its_own_way;
            if in_its_own_way || (effort != Effort::Flight && !inside) {
                self.counters.add(&contact.count());
                return Err(Lost::Beyond);
            }
            contact.rooms(&mesh.elements, rod, &mut self.guess.room_mm);
            self.newton.neighbourhood.begin(rod, &self.guess.room_mm);
        }
        self.newton.neighbourhood.bounds = near;
        let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
        let coils = !self.joined.is_empty();
        let mut free = coils.then(|| Resistance::of(&mesh.elements, rod, mesh.line() + 1));
        let mut fields = environment.field_load(&*mesh);
        let free = free.as_mut().map(|free| free as &mut dyn External);
        let fields = fields.as_mut().map(|fields| fields as &mut dyn External);
        let mut search = Search {
            newton: &mut self.newton,
            guess: &mut self.guess,
            contact: &mut contact,
            loops,
            beside: free.into_iter().chain(fields).collect(),
            supports: &mut supports,
            elements: &mesh.elements,
            state: rod,
            has_friction: environment.has_friction(),
            tolerance: options.tolerance,
            effort,
            most: most.min(options.max_iterations),
            most_solves: attempt.solves,
            iterations: 0,
            solves: 0,
            slides: 0,
        };
        let found = search.run();
        let found = search.dragged(found, surroundings.flow);
        let (found, lagging) = search.rubbed(found, surroundings.stack, mesh);
        let unsettled = search.unsettled().max(lagging);
        let (taken, slides) = ((search.iterations, search.solves), search.slides);
        let off = self.newton.neighbourhood.off(rod);
        // What has come to rest is in equilibrium as exactly as friction is with the wall elsewhere.
        let balanced = (found.converged || (!near && found.residual < SETTLED)) && unsettled < SETTLED;
        let used_up = found.reason == StopReason::MaxIterations && taken.1 >= attempt.solves;
        let wrong = Lost::of(&found, (near, used_up), balanced, off).or_else(|| {
            contact.know_whole_base(&mesh.elements);
            contact.passes_through(&mesh.elements, rod).then_some(Lost::Passed)
        });
        if wrong.is_none() {
            contact.touches(&mesh.elements, rod, &mut self.touches);
            if effort == Effort::Moving && !balanced {
                // The next tick slides on from here, with what presses here.
                contact.anchor_friction(&mesh.elements, rod);
            }
        }
        let aside_mj = (contact.drag_mj(&mesh.elements, rod) - slid_mj).abs();
        self.counters.add(&contact.count());
        self.work.add(taken, mesh.elements.len());
        if let Some(wrong) = wrong {
            if wrong == Lost::UnderWay {
                self.keep(start, mesh, after);
            }
            return Err(wrong);
        }
        let (least_mj, most_mj) = self.friction.dissipated_mj(&mesh.elements, rod, &mesh.points);
        let farthest_mm = self.newton.neighbourhood.farthest(rod);
        let (least_loops_mj, most_loops_mj) = self.loops.dissipated_mj();
        let (least_mj, most_mj) = (least_mj + least_loops_mj, most_mj + most_loops_mj);
        let between_mj = self.friction.between.taken_mj(rod);
        self.keep(start, mesh, after);
        let elsewhere_mj = between_mj + self.write_report(environment, hands, next);
        if found.residual > AT_REST {
            hold_hands(&start.state.report, &mut next.parts().1.report);
        }
        let rubbed_mj = (least_mj + elsewhere_mj, most_mj + elsewhere_mj);
        let by_fields = work_of_fields(environment, start, next.start());
        let after = next.parts().1;
        let reports = (&start.state.report, &after.report);
        let flow_mj = aside_mj + self.drag.size_n() * longest_mm(reports);
        let by_wall = WallWork::new(left.map(|(_, passage)| passage), reports).with_flow(flow_mj);
        let balance = Balance::new(surroundings.stack, reports, by_wall.with(by_fields), rubbed_mj);
        let lacks = balance.lacks();
        if near && lacks {
            return Err(Lost::Unbalanced);
        }
        let jumps = (effort == Effort::Flight && off > 1.0) || balance.is_set_free();
        let lost_mj = balance.lost_mj(jumps);
        let (dissipated_mj, released_mj) = lost_mj;
        let borrowed_mj = if near { 0.0 } else { balance.borrowed_mj(lost_mj) };
        let jump = jumps.then_some(Jump { released_mj, position_mm: farthest_mm });
        self.guess.teach(&after.rod, &mut after.correction);
        let residual = found.residual;
        Ok(Found { slides, dissipated_mj, borrowed_mj, residual, unsettled, balanced, lacks, off, jump })
    }
}

/// What is not at rest presses on the hands with forces that no motion leads to, and they would count as work: those before stand.
fn hold_hands(before: &StepReport, after: &mut StepReport) {
    (after.push_force_n, after.torque_nmm) = (before.push_force_n, before.torque_nmm);
    for (was, is) in before.instruments.iter().zip(&mut after.instruments) {
        (is.push_force_n, is.torque_nmm) = (was.push_force_n, was.torque_nmm);
    }
}

/// Work of fields that change, mJ: by what they add to the energy of the device where it was, and of the device where it is now.
fn work_of_fields(environment: &Environment<'_>, was: Start<'_>, is: Start<'_>) -> [f64; 2] {
    let at_first = environment.field_mj(was.mesh, &was.state.rod) - was.state.report.energy.field;
    if !environment.surroundings.fields_change() {
        return [at_first; 2];
    }
    let before = environment.with_fields_at(0.0);
    [at_first, is.state.report.energy.field - before.field_mj(is.mesh, &is.state.rod)]
}

/// The farthest way of a hand, mm.
fn longest_mm((before, after): (&StepReport, &StepReport)) -> f64 {
    let way = |index: usize| (after.hand(index).inserted_mm - before.hand(index).inserted_mm).abs();
    (0..after.instruments.len().max(1)).map(way).fold(0.0, f64::max)
}
