//! One sub-step: a guess of where the device will be, and Newton's method from there.

use std::borrow::Cow;

use super::active_set::Held;
use super::carried::{Passage, WallWork};
use super::configuration::{Configuration, Start};
use super::guess::Quality;
use super::hands::{Hand, motions};
use super::mesh::Mesh;
use super::search::Search;
use super::state::KirchhoffState;
use super::transport::{transport, transport_together};
use super::workspace::Tools;
use super::{Environment, inner_friction, meshed};
use crate::contact::{SETTLED, WallContact};
use crate::device::Stack;
use crate::methods::StepReport;
use crate::rod::{RodState, Supports};
use crate::solve::NewtonReport;

/// A wall is stiff that is stiffer than this many elements of the rod, EI/h⁴, …
const STIFF: f64 = 30.0;
/// … and yields where it is not stiffer than this many. …
const YIELDING: f64 = 300.0;
/// … One that is stiff is approached from softer walls: from one that is as stiff as so many elements, …
const SOFTEST: f64 = 3000.0;
/// … or from this part of its modulus, if that is softer, but none that is not stiff itself: near enough for contacts to stay where they
/// are, and the device where it is.
const FIRM: f64 = 0.1;
/// Residual over force scale above which the last resort has found nothing.
pub(super) const AT_REST: f64 = 0.05;
/// What is the matter where an equilibrium is on the other side of the wall.
const PASSED: &str = "the device would pass through the wall";
/// An equilibrium is on another branch where more energy is stored than the hand gives: than this many times what the larger of its
/// forces before and after does on the way, …
const LARGEST_RISE: f64 = 10.0;
/// … and this part of what was stored before, …
const RISE_SHARE: f64 = 0.02;
/// … beyond what is too little to tell, mJ.
const RISE_FLOOR_MJ: f64 = 1e-3;
/// What is the matter where it is.
const STORED: &str = "more energy would be stored than the hand gives";
/// What is the matter where they do not.
const UNSETTLED: &str = "friction and wall forces do not settle";
/// A device with friction on which nothing pressed may first touch the wall in a step of this part of its radius; …
const FIRST_TOUCH: f64 = 0.05;
/// … what is the matter with a longer one.
const TOUCHED: &str = "the wall is first touched on the way";

/// How an equilibrium was found.
pub(super) struct Found {
    /// How often the device slid on while the hand held still.
    pub(super) slides: u32,
    /// Energy that friction took, mJ.
    pub(super) dissipated_mj: f64,
    /// Work that blood may have done, or had done against it, mJ.
    pub(super) flow_mj: f64,
    /// Residual over force scale.
    pub(super) residual: f64,
    /// Part by which the normal forces that friction follows differ from those of the wall.
    pub(super) unsettled: f64,
    /// Whether it is an equilibrium.
    pub(super) balanced: bool,
    /// Whether the device was let come to rest as it can.
    pub(super) relaxed: bool,
}

/// Why a sub-step came to nothing.
pub(super) struct Lost {
    pub(super) reason: Cow<'static, str>,
    /// Whether the search did not come to an end. What it came to may be no step of this command otherwise.
    pub(super) astray: bool,
}

impl From<&'static str> for Lost {
    fn from(reason: &'static str) -> Self {
        Self { reason: reason.into(), astray: false }
    }
}

/// How hard a sub-step tries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Effort {
    /// As long as what is near takes to be found.
    Usual,
    /// As long as the budget lasts: to where the device comes to rest far away.
    Patient,
    /// Without a budget, to where the device comes to rest as it can: what is nearly in balance, up to this residual over force scale, is
    /// taken, or whatever there is if that is infinite.
    Resort(f64),
}

/// How far a sub-step goes, and how hard it tries.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt<'a> {
    /// Where the hands are after it.
    pub(super) hands: &'a [Hand],
    /// How hard it tries.
    pub(super) effort: Effort,
    /// Where the vessel moves: what was before it did, and how it does. The sub-step then starts with the device taken along.
    pub(super) left: Option<(Start<'a>, Passage<'a>)>,
}

impl<const C: usize> Tools<C> {
    /// Slides the device at `start` to where the hands are, on the mesh of what is in then, with its friction and what is known of the wall.
    fn transport_to(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        Attempt { hands, left, .. }: Attempt<'_>,
        next: &mut Configuration,
    ) {
        let (mesh, after) = next.parts();
        meshed(environment, hands, mesh);
        let stack = environment.surroundings.stack;
        let transport_from = |start: Start<'_>, rod: &mut RodState| {
            let from = (start.mesh, &start.state.rod);
            if stack.is_several() {
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
        inner_friction::begin(stack, start, (mesh, &after.rod), moves, places);
        after.turn_tails(stack, hands);
        self.newton.resize(mesh.elements.len());
        let advance_mm = mesh.from_tip_mm[0] - start.mesh.from_tip_mm[0];
        self.cache.begin(&start.state.known, &start.mesh.points, &mesh.points, advance_mm);
    }

    /// Gives the state what the next sub-step starts with.
    fn keep(&self, mesh: &Mesh, after: &mut KirchhoffState) {
        self.friction.keep(&mut after.forces);
        inner_friction::keep(&self.friction.between, &after.rod, mesh, &mut after.inner_friction);
        self.cache.keep(&mut after.known);
    }

    /// One sub-step from `start`: slides and solves on `next`, which is worth nothing if that fails. Newton iterations are taken from
    /// `budget`.
    pub(super) fn try_step(
        &mut self,
        environment: &Environment<'_>,
        start: Start<'_>,
        attempt: Attempt<'_>,
        next: &mut Configuration,
        budget: &mut usize,
    ) -> std::result::Result<Found, Lost> {
        let (surroundings, options) = (&environment.surroundings, environment.options);
        let Attempt { hands, effort, left } = attempt;
        let resort = matches!(effort, Effort::Resort(_));
        self.transport_to(environment, start, attempt, next);
        let (mesh, after) = next.parts();
        let rod = &mut after.rod;
        let elements = mesh.elements.len();
        let softest_nmm2 = surroundings.stack.softest_nmm2();
        let mut contact = WallContact::new(
            environment.wall(),
            &mesh.points,
            &mut self.cache,
            &mut self.friction,
            softest_nmm2,
        );
        let data = &mesh.elements[elements - 1];
        let element_stiffness = data.bending[2] / options.element_mm.powi(4);
        // How many elements the wall is as stiff as.
        let stiffness = surroundings.properties.stiffest_n_per_mm2() / element_stiffness;
        contact.stiff = stiffness > 1.0;
        let slid_mj = contact.begin_drag(surroundings.flow, &mut self.drag, &mesh.elements, rod);
        if !contact.stiff {
            contact.trust_guess();
        }
        let began_free = contact.began_free();
        let candidates = (start, &*mesh, &mut *rod);
        let quality = self.guess.choose(&mut contact, candidates);
        let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
        let held = match quality {
            Quality::Beyond => Held::Lost,
            _ => self.guess.active_set_step(&mut self.newton, &mut contact, &supports, &mesh.elements, rod),
        };
        let moved = held == Held::Moved;
        // A guess that has learnt from the last step or kept its contacts is near, unless it has lost them.
        let near = moved || (quality == Quality::Learnt && held == Held::Fits);
        let mut search = Search {
            newton: &mut self.newton,
            settle: &mut self.settle,
            guess: &mut self.guess,
            contact: &mut contact,
            supports: &mut supports,
            elements: &mesh.elements,
            state: rod,
            stiff: stiffness > STIFF,
            softest: (SOFTEST / stiffness).min(FIRM).max(STIFF / stiffness).min(1.0),
            inner_friction: surroundings.properties.has_friction(),
            tolerance: options.tolerance,
            max_iterations: options.max_iterations,
            budget: (!resort).then_some(budget),
            patient: effort != Effort::Usual,
            iterations: usize::from(moved),
            slides: 0,
        };
        let found = search.run(near);
        let found = search.dragged(found, surroundings.flow);
        let (found, lagging) = search.rubbed(found, surroundings.stack, mesh);
        let (iterations, slides, relaxed) = (search.iterations, search.slides, search.budget.is_none());
        let unsettled = if surroundings.properties.has_friction() { contact.unsettled() } else { 0.0 };
        let unsettled = unsettled.max(lagging);
        // What comes to rest as it can is in equilibrium as exactly as friction is with the wall elsewhere.
        let balanced = (found.converged || (relaxed && found.residual < SETTLED)) && unsettled < SETTLED;
        let at_rest = balanced || matches!(effort, Effort::Resort(least) if found.residual <= least);
        let mut passed = false;
        if at_rest {
            contact.know_whole_base(&mesh.elements);
            passed = contact.passes_through(&mesh.elements, rod);
            if !passed {
                contact.touches(&mesh.elements, rod, &mut self.touches);
            }
        }
        let aside_mj = (contact.drag_mj(&mesh.elements, rod) - slid_mj).abs();
        self.counters.add(&contact.count());
        self.work.add(iterations, elements);
        if !at_rest || passed {
            return Err(what_is_wrong(&found, at_rest));
        }
        let along_mj = self.friction.dissipated_mj(&mesh.elements, rod, &mesh.points);
        let dissipated_mj = along_mj + self.friction.between.taken_mj(rod);
        let dissipated_mj = dissipated_mj + self.write_report(environment, hands, next);
        let (mesh, after) = next.parts();
        let reports = (&start.state.report, &after.report);
        let way_mm = farthest_mm(reports);
        // Without a normal force to begin with it has slid from where it touches to anywhere, and stays there.
        if began_free && slides > 0 && !relaxed && way_mm > FIRST_TOUCH * surroundings.device.min_radius_mm()
        {
            return Err(TOUCHED.into());
        }
        let flow_mj = aside_mj + self.drag.size_n() * way_mm;
        let by_wall = WallWork::new(left.map(|(_, passage)| passage), reports).with_flow(flow_mj);
        if !(effort == Effort::Resort(f64::INFINITY) && balanced)
            && rises(environment.surroundings.stack, reports, dissipated_mj, by_wall)
        {
            return Err(STORED.into());
        }
        let corrections = (&start.state.correction, &mut after.correction);
        self.guess.teach(&mesh.elements, &after.rod, stiffness <= YIELDING, corrections);
        self.keep(mesh, after);
        Ok(Found { slides, dissipated_mj, flow_mj, residual: found.residual, unsettled, balanced, relaxed })
    }
}

/// What is the matter with what was found, which is not at rest or has passed through the wall.
fn what_is_wrong(found: &NewtonReport, at_rest: bool) -> Lost {
    match (at_rest, found.converged) {
        (true, _) => PASSED.into(),
        (false, true) => UNSETTLED.into(),
        (false, false) => Lost {
            reason: format!("{} (residual {:.1e})", found.reason, found.residual).into(),
            astray: true,
        },
    }
}

/// The farthest way of a hand, mm.
fn farthest_mm((before, after): (&StepReport, &StepReport)) -> f64 {
    let way = |index: usize| (after.hand(index).inserted_mm - before.hand(index).inserted_mm).abs();
    (0..after.instruments.len().max(1)).map(way).fold(0.0, f64::max)
}

/// Energy that the sheath no longer stores, mJ: of the shape of what has come out of it, which is straight in it.
pub(super) fn released_mj(stack: &Stack, before: &StepReport, after: &StepReport) -> f64 {
    let each = stack.devices().enumerate().map(|(index, device)| {
        let straightening = |report: &StepReport| device.straightening_mj(report.hand(index).inserted_mm);
        straightening(after) - straightening(before)
    });
    each.sum()
}

/// Whether more energy is stored, or taken by friction, than the hand can have put in. A device that was led to the far side of a
/// crest, or into a corner of the wall that holds it from both sides, is in equilibrium there, at any energy, and nothing leads
/// there from where it was; shorter steps stay on the branch on which it is.
fn rises(
    stack: &Stack,
    (before, after): (&StepReport, &StepReport),
    dissipated_mj: f64,
    by_wall: WallWork,
) -> bool {
    let most = |before: f64, after: f64, way: f64| before.abs().max(after.abs()) * way.abs();
    let mut work = by_wall.most_mj;
    for index in 0..after.instruments.len().max(1) {
        let (was, is) = (before.hand(index), after.hand(index));
        let (Some(push), Some(pushes)) = (was.push_force_n, is.push_force_n) else {
            // At the tip of another its force jumps, and nothing can be said.
            return false;
        };
        work += most(push, pushes, is.inserted_mm - was.inserted_mm)
            + most(was.torque_nmm, is.torque_nmm, is.rotation_rad - was.rotation_rad);
    }
    let gained = after.energy.total() - before.energy.total() - released_mj(stack, before, after);
    let stored = gained + dissipated_mj;
    stored > LARGEST_RISE * work + RISE_SHARE * before.energy.total() + RISE_FLOOR_MJ
}
