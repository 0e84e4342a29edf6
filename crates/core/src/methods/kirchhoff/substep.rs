//! One sub-step: a prediction of the device's configuration, and Newton's method from there.

use std::sync::Arc;

use super::balance::Balance;
use super::carried::{Passage, work_of_wall};
use super::configuration::{Configuration, Start};
use super::hands::{Hand, line_advance_mm, longest_mm, set_motions, steered};
use super::joined::join;
use super::loops::{advances_mm, capsules};
use super::mesh::Mesh;
use super::part::{Effort, Found, Limits, Lost};
use super::search::{Beginning, Bounds, Judged, Searched};
use super::state::{KirchhoffState, UnderWay};
use super::transport::{place_on_curve, transport, transport_together};
use super::workspace::Tools;
use super::yielding::Yielding;
use super::{Environment, inner_friction, meshed};
use crate::Vec3;
use crate::contact::{ContactPoint, FrictionLaw, least_force_n, stick_mm};
use crate::methods::Sheath;
use crate::rod::{Frame, RodState};

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

/// A sheath that points in the same direction, to rounding.
const SAME_DIRECTION: f64 = 1e-12;

/// The mouth of a sheath that is elsewhere than that from which a rod comes; none where it is the same.
fn moved_mouth(sheath: &Sheath, rod: &RodState) -> Option<(Frame, Vec3)> {
    let (frame, was) = (sheath.frame(), &rod.frames[0]);
    let turned = (frame.t - was.t).norm().max((frame.u - was.u).norm());
    let same = sheath.position_mm == rod.positions[0] && turned <= SAME_DIRECTION;
    (!same).then_some((frame, sheath.position_mm))
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
        let moved = moved_mouth(environment.surroundings.sheath, &start.state.rod);
        let transport_from = |start: Start<'_>, rod: &mut RodState| {
            let from = (start.mesh, &start.state.rod);
            let own = (&from.1.frames[0], &from.1.positions[0]);
            let mouth = moved.as_ref().map_or(own, |(frame, position)| (frame, position));
            if mesh.elements.is_empty() {
                rod.copy_from(from.1);
                rod.truncate(1);
            } else if stack.is_several() {
                transport_together(from, (mesh, mouth), (stack.sets(), tail), rod);
            } else {
                transport(from, (mesh, mouth), |from_tip_mm| tail(0, from_tip_mm), rod);
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
        let carried_mm = left.map_or(0.0, |(was, _)| was.state.rod.farthest_mm(&start.state.rod));
        let pressed = resumed.map_or(start, |resumed| Start { mesh, state: &resumed.state });
        inner_friction::begin(stack, pressed, (mesh, &after.rod), (moves, carried_mm), places);
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
    pub(super) fn try_step(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        attempt: Attempt<'_>,
        next: &mut Configuration,
    ) -> std::result::Result<Found, Lost> {
        let steered = steered(environment.surroundings.stack, attempt.hands);
        let environment = &environment.steered(&steered);
        let options = environment.options;
        let tuning = &options.tuning;
        let Attempt { part: Part { effort, part_mm, .. }, limits, left, .. } = attempt;
        self.transport_to(environment, start, attempt, next);
        let mut course =
            Yielding::begin(environment, (start, attempt), &mut self.friction, &self.guess.motions);
        let may_snap = part_mm <= tuning.steps.snap_radii * environment.surroundings.device.min_radius_mm();
        let first = course.as_ref().map_or(environment.displacement, |course| Some(course.displacement()));
        let there = environment.displaced(first);
        let mut searched = self.search_from(&there, (start, attempt), (course.as_ref(), may_snap), next)?;
        if let Some(course) = &mut course {
            searched = self.follow_course(environment, (searched, effort, limits, may_snap), course, next);
        }
        self.work.add(searched.taken, next.mesh.elements.len());
        let (mesh, after) = next.parts();
        if let Some(course) = course {
            course.keep(start.state, after);
        }
        if let Some(wrong) = searched.wrong {
            if wrong == Lost::UnderWay {
                self.keep(start, mesh, after);
            }
            return Err(wrong);
        }
        let friction_mj = self.dissipated_mj(mesh, &after.rod);
        self.keep(start, mesh, after);
        let outside_mj = self.write_forces(environment, next);
        let residual = searched.found.residual;
        // Where the device is still moving its own are arbitrary, and would count as work.
        if residual > tuning.steps.at_rest {
            next.parts().1.hand_forces.clone_from(&start.state.hand_forces);
        }
        let by_others = (left, searched.by_drag_mj);
        let balance = self.balance(environment, (start, next.start()), by_others, friction_mj);
        let after = next.parts().1;
        let lacks = balance.lacks();
        // Only a short part shows a jump: in a long one forces may go far beyond their values at its ends.
        let near = effort != Effort::Flight && !searched.is_interrupted;
        if near && (lacks || (balance.is_set_free() && !may_snap)) {
            return Err(Lost::Unbalanced);
        }
        self.guess.teach(&after.rod, &mut after.correction);
        let Searched { slides, unsettled, balanced, is_interrupted, off, farthest_mm, .. } = searched;
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

    /// Searches from the prediction of a part, or goes on where earlier commands have left it.
    fn search_from(
        &mut self,
        environment: &Environment<'_>,
        (start, attempt): (Start<'_>, Attempt<'_>),
        (course, may_snap): (Option<&Yielding<'_>>, bool),
        next: &mut Configuration,
    ) -> std::result::Result<Searched, Lost> {
        let options = environment.options;
        let tuning = &options.tuning;
        let Attempt { part: Part { effort, resumed, .. }, limits, .. } = attempt;
        let (mesh, after) = next.parts();
        let KirchhoffState { rod, touches, .. } = after;
        let in_its_own_way =
            options.self_contact && self.begin_loops(environment, (start, resumed), (mesh, rod));
        let begin = |Beginning { newton, guess, contact, loops, state }: Beginning<'_, '_, C>| {
            if let Some(resumed) = resumed {
                let mut under_way = resumed.state.rod.clone();
                join(&mut under_way, &resumed.state.coils);
                guess.resume(&under_way, state);
                newton.neighbourhood.clone_from(&resumed.neighbourhood);
            } else {
                let guessed = guess.choose(contact, loops, (start, mesh, state), tuning.steps.repeats);
                let inside = guessed && !in_its_own_way;
                if in_its_own_way || (effort != Effort::Flight && !inside) {
                    return Err(Lost::Beyond);
                }
                contact.rooms(&mesh.elements, state, &mut guess.room_mm);
                newton.neighbourhood.begin(state, &guess.room_mm, &tuning.newton);
            }
            // What may end in a snap is solved once, wherever it leads.
            newton.neighbourhood.bounds = effort != Effort::Flight && !may_snap;
            Ok(())
        };
        let bounds = Bounds {
            effort,
            most: match effort {
                Effort::Near | Effort::Held => limits.iterations.min(options.max_iterations),
                Effort::Flight => limits.iterations,
            },
            most_solves: limits.solves,
            resumed: resumed.map(|resumed| (resumed.iterations, resumed.shift)),
            moved_mm: None,
        };
        let before = resumed.map_or(0, |resumed| resumed.iterations);
        let judged =
            Judged { course: course.map(|course| (course, course.most_mm(environment))), before, may_snap };
        let stack = environment.surroundings.stack;
        self.with_search(environment, (mesh, stack, rod), bounds, begin, |search, lagged| {
            search.searched(lagged, &judged, touches)
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
