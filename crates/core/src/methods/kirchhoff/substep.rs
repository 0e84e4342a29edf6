//! One sub-step: a guess of where the device will be, and Newton's method from there.

use std::borrow::Cow;

use super::active_set::Held;
use super::carried::Passage;
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
/// What is the matter where an equilibrium is another than the one that was predicted.
const FAR: &str = "the equilibrium is far from where the device was predicted";
pub(super) fn near_limit() -> f64 {
    static V: std::sync::OnceLock<f64> = std::sync::OnceLock::new();
    *V.get_or_init(|| std::env::var("NEAR").map_or(1.0, |v| v.parse().unwrap()))
}
/// What is the matter where they do not.
const UNSETTLED: &str = "friction and wall forces do not settle";

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
    /// The farthest that a point is from where it was predicted, over the room that it has there.
    pub(super) off_prediction: f64,
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
        let candidates = (start, &*mesh, &mut *rod);
        let quality = self.guess.choose(&mut contact, candidates);
        contact.predict(&mesh.elements, rod);
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
        let off_prediction = contact.off_prediction(&mesh.elements, rod);
        if effort == Effort::Usual && at_rest && off_prediction > near_limit() {
            self.counters.add(&contact.count());
            self.work.add(iterations, elements);
            return Err(FAR.into());
        }
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
        let flow_mj = aside_mj + self.drag.size_n() * way_mm;
        let corrections = (&start.state.correction, &mut after.correction);
        self.guess.teach(&mesh.elements, &after.rod, stiffness <= YIELDING, corrections);
        self.keep(mesh, after);
        Ok(Found { slides, dissipated_mj, flow_mj, residual: found.residual, unsettled, balanced, relaxed, off_prediction })
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
