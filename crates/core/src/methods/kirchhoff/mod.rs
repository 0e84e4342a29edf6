//! This crate's method: the exact rod in equilibrium with the wall, after every command.
//!
//! The inserted length is a Kirchhoff rod (`rod`) clamped in the sheath's mouth and free at its tip, in the
//! energy of the wall ([`crate::contact`]). Outside lies its tail, which twists between hand and mouth (`tail.rs`). A command
//! changes the inserted length and rotates the end of the tail; the rod
//! slides along its own curve and Newton's method takes it from there to the nearest minimum of the potential energy.
//! The hand's force and torque follow from the equilibrium: with n and m the internal force and moment in the
//! sheath's mouth, and without friction outside the body,
//!
//! ```text
//! F = −n·t − ½ EI |κ|²,    M = m·t
//! ```
//!
//! of which the second term is configurational: the energy that the next piece stores as it leaves the
//! straight sheath ([`Clamp::push_force`](crate::statics::Clamp::push_force)). Its twist it had before. F is the derivative of the stored energy with
//! respect to the inserted length.
//!
//! # The algorithm of a step
//!
//! ```text
//! until the hands are where they should be, and the device rests in equilibrium:     command.rs
//!     propose a part of the remaining motion, and how it is solved                   course.rs, step_control.rs
//!     slide the device along its own curve; add what the last part changed           transport.rs, guess.rs
//!     Newton's method to a minimum, contacts and friction in the model of each step  search.rs, solve/, contact/set/
//!     near its prediction, energies in balance, not through a wall?                  substep.rs, balance.rs
//!         accept: the next part may be longer
//!     otherwise
//!         halve the part; if short, hold friction; if shorter still, relax
//!     if the solves of the command are used up: keep what is unfinished with the state
//! write the report                                                                   report.rs
//! ```
//!
//! All that the next part of a command depends on is in the state ([`KirchhoffState`]); the report is written from it at the end, and nothing here
//! reads it.

mod balance;
mod blocked;
mod carried;
mod coaxial;
#[cfg(test)]
mod coaxial_friction_tests;
#[cfg(test)]
mod coaxial_tests;
mod command;
mod configuration;
mod course;
mod detach;
#[cfg(test)]
mod detach_tests;
#[cfg(test)]
mod drag_tests;
mod environment;
mod extrapolation;
mod guess;
mod hands;
mod inner_friction;
#[cfg(test)]
mod inner_friction_tests;
mod joined;
mod lateral;
mod loops;
#[cfg(test)]
mod loops_tests;
mod material;
mod mesh;
#[cfg(test)]
mod motion_tests;
mod nearby;
mod options;
mod part;
mod readout;
mod report;
mod rims;
#[cfg(test)]
mod rims_tests;
mod search;
mod slopes;
mod state;
mod step_control;
mod stretches;
mod substep;
mod sum;
#[cfg(test)]
mod swept_tests;
mod tail;
mod tails;
#[cfg(test)]
mod tick_tests;
#[cfg(test)]
mod touch_tests;
mod transport;
#[cfg(test)]
mod transport_tests;
mod workspace;
mod yielding;
#[cfg(test)]
mod yielding_tests;

pub(crate) use mesh::{Fineness, Mesh};
pub use options::{Accuracy, KirchhoffOptions};
pub use state::KirchhoffState;

use std::sync::Arc;

use crate::contact::{ContactSurface, Counters, Touching};
use crate::device::line_mm;
use crate::methods::{Command, DetachedCoil, LateralForce, Move, StepReport, Surroundings, Tape, Timed};
use crate::methods::{Content, Method, MethodChoice, State};
use crate::rod::{Layout, PLAIN, TWISTED};
use crate::shape::Shape;
use crate::vessel::WallStore;
use crate::{Error, Result, Vec3};
use coaxial::Nodes;
use command::Driven;
use configuration::Start;
use environment::Environment;
use hands::{Hand, lengths, steered};
use joined::FreeCoil;
use report::Took;
use state::Belongs;
use workspace::Workspace;

impl MethodChoice for KirchhoffOptions {
    fn name(&self) -> &'static str {
        NAME
    }

    fn start(&self, surroundings: &Surroundings<'_>, store: &dyn WallStore) -> Result<Box<dyn Method>> {
        Ok(match surroundings.stack.angles() {
            0 => Box::new(Kirchhoff::<PLAIN>::new(*self, surroundings, store)?),
            1 => Box::new(Kirchhoff::<TWISTED>::new(*self, surroundings, store)?),
            2 => Box::new(Kirchhoff::<{ PLAIN + 8 }>::new(*self, surroundings, store)?),
            _ => Box::new(Kirchhoff::<{ PLAIN + 12 }>::new(*self, surroundings, store)?),
        })
    }

    fn takes_several(&self) -> bool {
        true
    }

    fn takes_steering(&self) -> bool {
        true
    }

    fn takes_soft_planes(&self) -> bool {
        true
    }

    fn check_detach(&self) -> Result<()> {
        if self.self_contact {
            return Ok(());
        }
        let remedy = "what follows a detached coil would pass through it: set it to true";
        Err(Error::parameter("method.self_contact", false, remedy))
    }
}

/// The exact rod as an insertion method, with or without material angles.
pub(crate) struct Kirchhoff<const C: usize> {
    options: KirchhoffOptions,
    surface: Arc<ContactSurface>,
    state: Arc<KirchhoffState>,
    report: Arc<StepReport>,
    /// The centre line of the state, for reports.
    shape: Shape,
    /// The detached coils.
    coils: Vec<DetachedCoil>,
    counters: Counters,
    /// Created with the first command.
    workspace: Option<Box<Workspace<C>>>,
}

impl<const C: usize> Kirchhoff<C> {
    /// The method with nothing inserted; the uniform mesh of the wall comes from `store`.
    ///
    /// # Errors
    /// Options that are out of range or not possible together.
    pub(crate) fn new(
        options: KirchhoffOptions,
        surroundings: &Surroundings<'_>,
        store: &dyn WallStore,
    ) -> Result<Self> {
        options.check(surroundings)?;
        let state = KirchhoffState::at(surroundings, Layout::<C>::ANGLES > 0);
        let report = StepReport {
            converged: true,
            angles: state.has_angles,
            instruments: report::instruments(
                Start { mesh: &Mesh::withdrawn(), state: &state },
                surroundings.stack,
            )
            .collect(),
            ..StepReport::default()
        };
        let Surroundings { lumen, properties, stack, .. } = *surroundings;
        let surface =
            ContactSurface::tuned(lumen, stack.radii_mm(), properties, store, &options.tuning.contact)?;
        let mut method = Self {
            options,
            surface: Arc::new(surface),
            state: Arc::new(state),
            report: Arc::new(report),
            shape: Shape::default(),
            coils: Vec::new(),
            counters: Counters::default(),
            workspace: None,
        };
        method.write_shape(&[0.0]);
        Ok(method)
    }

    /// Whether nothing remains to be done: hands, vessel and device are still; its report then says so.
    fn rests(&mut self, surroundings: &Surroundings<'_>, moves: &[Move]) -> bool {
        let still = moves.iter().all(|one| one.command == Command::default());
        let rests =
            still && !surroundings.moves() && !surroundings.fields_change() && self.state.behind.is_empty();
        if rests {
            Arc::make_mut(&mut self.report).rest();
        }
        rests
    }

    /// Runs `work` in the workspace, and moves to its new state if it reports what that took; on an error the state
    /// is unchanged.
    fn work_on<T>(
        &mut self,
        surroundings: &Surroundings<'_>,
        work: impl FnOnce(&mut Workspace<C>, &Environment<'_>, &KirchhoffState) -> Result<(Option<Took>, T)>,
    ) -> Result<T> {
        let environment = Environment::new(surroundings, &self.surface, &self.options);
        let mut workspace = match self.workspace.take() {
            Some(workspace) => workspace,
            None => {
                let workspace = Workspace::new(&environment, &self.state);
                let (elements, points) = workspace.most;
                self.shape.reserve(elements + 1);
                let contacts = &mut Arc::make_mut(&mut self.report).contacts;
                contacts.reserve((points / state::TOUCHING).saturating_sub(contacts.len()));
                workspace
            }
        };
        let done = work(&mut workspace, &environment, &self.state);
        self.counters.add(&std::mem::take(&mut workspace.tools.counters));
        if let Ok((Some(took), _)) = &done {
            std::mem::swap(&mut self.state, &mut workspace.now.state);
            std::mem::swap(&mut workspace.mesh, &mut workspace.now.mesh);
            let to = Start { mesh: &workspace.mesh, state: &self.state };
            took.write(&environment, to, Arc::make_mut(&mut self.report));
            self.write_shape(&workspace.mesh.from_tip_mm);
        }
        self.workspace = Some(workspace);
        done.map(|(_, reported)| reported)
    }

    /// Carries out moves as a tick of so many linear solves, or as a step with `usize::MAX`.
    fn drive(&mut self, surroundings: &Surroundings<'_>, moves: &[Move], solves: usize) -> Result<()> {
        if self.rests(surroundings, moves) {
            return Ok(());
        }
        let waits = self.work_on(surroundings, |workspace, environment, state| {
            Ok(match workspace.carry_out(environment, state, moves, solves)? {
                Driven::Moved(took) => (Some(took), None),
                others => (None, Some(others)),
            })
        })?;
        match waits {
            // Time proceeds, so the motion of the vessel cannot be postponed.
            Some(Driven::Overtaken(_)) if solves < usize::MAX => {
                return self.drive(surroundings, moves, usize::MAX);
            }
            Some(Driven::Overtaken(most)) => {
                return Err(Error::Computation(format!(
                    "kirchhoff: {most} linear solves do not suffice to follow what changes around the device: change \
                     it, or the time, by less in a step"
                )));
            }
            Some(Driven::Waits(rest)) => {
                let (state, report) = (Arc::make_mut(&mut self.state), Arc::make_mut(&mut self.report));
                rest.write(state);
                report.rest();
                report.behind.clone_from(&state.behind);
                if let Some(Workspace { tools, .. }) = self.workspace.as_deref() {
                    tools.work.write(report);
                }
            }
            Some(Driven::Moved(_)) | None => {}
        }
        Ok(())
    }

    /// Checks that a state is possible for this simulation, and returns its mesh.
    fn check(&self, surroundings: &Surroundings<'_>, state: &KirchhoffState) -> Result<Mesh> {
        let hands = &state.hands;
        let devices = surroundings.stack.devices();
        if hands.len() != devices.len() {
            let remedy =
                format!("there are {} instruments here: restore a state of this scene", devices.len());
            return Err(Error::parameter("state.instruments", hands.len(), remedy));
        }
        for (hand, device) in hands.iter().zip(devices) {
            crate::methods::check_inserted(hand.inserted_mm, device)?;
        }
        surroundings.stack.check_places(hands.iter().map(|hand| hand.inserted_mm))?;
        let environment = Environment::new(surroundings, &self.surface, &self.options);
        let mut mesh = Mesh::default();
        meshed(&environment, hands, &mut mesh);
        state.check(&Belongs {
            stack: surroundings.stack,
            surface: &self.surface,
            course: surroundings.course.map_or(0, |course| course.unknowns()),
            sheath: surroundings.sheath,
            fineness: self.options.fineness(),
            elements: mesh.elements.len(),
            points: mesh.points.len(),
            sets: Layout::<C>::ANGLES,
            inner_friction: surroundings.properties.has_friction(),
            inner: if surroundings.stack.has_inner_friction() { hands.len() - 1 } else { 0 },
        })?;
        Ok(mesh)
    }

    /// Stores the centre lines of the state; the device's nodes are at these arc lengths from the tip.
    fn write_shape(&mut self, from_tip_mm: &[f64]) {
        write_line(&self.state, from_tip_mm, &mut self.shape);
        self.coils.clear();
        self.coils.extend(self.state.coils.iter().map(FreeCoil::reported));
    }
}

impl<const C: usize> Clone for Kirchhoff<C> {
    /// Shares the wall and the state; its workspace is created with its first command.
    fn clone(&self) -> Self {
        Self {
            options: self.options,
            surface: Arc::clone(&self.surface),
            state: Arc::clone(&self.state),
            report: Arc::clone(&self.report),
            shape: self.shape.clone(),
            coils: self.coils.clone(),
            counters: self.counters,
            workspace: None,
        }
    }
}

impl<const C: usize> Method for Kirchhoff<C> {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        self.step_together(surroundings, &[Move { instrument: 0, command }])
    }

    fn step_together(&mut self, surroundings: &Surroundings<'_>, moves: &[Move]) -> Result<()> {
        self.drive(surroundings, moves, usize::MAX)
    }

    fn tick(&mut self, surroundings: &Surroundings<'_>, moves: &[Move], solves: usize) -> Result<()> {
        let done = self.drive(surroundings, moves, solves);
        if done.is_err() && !self.state.behind.is_empty() {
            // The wall has stopped the hands.
            let (state, report) = (Arc::make_mut(&mut self.state), Arc::make_mut(&mut self.report));
            (state.unfinished, state.behind) = (None, Vec::new());
            report.rest();
            report.behind.clear();
            report.converged = false;
        }
        done
    }

    fn record(
        &self,
        surroundings: &Surroundings<'_>,
        commands: Timed<'_>,
        checked: &dyn Fn(&StepReport, &[Move]) -> Result<()>,
    ) -> Result<Box<dyn Tape>> {
        self.recorded(surroundings, commands, checked)
    }

    fn most_solves(&self, moves: &[Move]) -> Option<usize> {
        let mut motions = Vec::new();
        hands::add_moves(self.state.hands.len(), &self.state.behind, moves, &mut motions);
        Some(course::most_solves(&motions, &self.options.tuning.steps))
    }

    fn forget(&mut self) {
        let (state, report) = (Arc::make_mut(&mut self.state), Arc::make_mut(&mut self.report));
        state.forget();
        report.behind.clone_from(&state.behind);
    }

    fn detach(&mut self, surroundings: &Surroundings<'_>, instrument: usize) -> Result<()> {
        self.work_on(surroundings, |workspace, environment, state| {
            workspace.detach(environment, state, instrument).map(|took| (Some(took), ()))
        })
    }

    fn check_detach(&self, surroundings: &Surroundings<'_>, instrument: usize) -> Result<()> {
        let environment = Environment::new(surroundings, &self.surface, &self.options);
        detach::check(&environment, &self.state, instrument).map(drop)
    }

    fn coils(&self) -> &[DetachedCoil] {
        &self.coils
    }

    fn course_mm(&self) -> &[Vec3] {
        &self.state.course_mm
    }

    fn takes_fields(&self) -> bool {
        true
    }

    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn report(&self) -> &StepReport {
        &self.report
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn lateral_forces(&self, surroundings: &Surroundings<'_>, instrument: usize) -> Vec<LateralForce> {
        if instrument + 1 >= self.state.hands.len() {
            return vec![LateralForce::default(); self.shape.len()];
        }
        let environment = Environment::new(surroundings, &self.surface, &self.options);
        lateral::lateral_forces_in::<C>(&environment, &self.state, instrument)
    }

    fn touching(&self, surroundings: &Surroundings<'_>) -> Vec<Touching> {
        if !self.options.self_contact {
            return Vec::new();
        }
        loops::touching(&Environment::new(surroundings, &self.surface, &self.options), &self.state)
    }

    fn state(&self) -> State {
        let (state, report) = (Arc::clone(&self.state), Arc::clone(&self.report));
        State::new(NAME, Content::Kirchhoff { state, report })
    }

    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()> {
        let Content::Kirchhoff { state, report } = state.of(NAME)? else {
            return Err(state.of_another(NAME));
        };
        let mesh = self.check(surroundings, state)?;
        if let Some(under_way) = state.unfinished.as_ref().and_then(|unfinished| unfinished.part.as_ref()) {
            self.check(surroundings, &under_way.state)?;
        }
        report::check(report, state)?;
        (self.state, self.report) = (Arc::clone(state), Arc::clone(report));
        self.write_shape(&mesh.from_tip_mm);
        if let Some(workspace) = &mut self.workspace {
            workspace.mesh = mesh;
        }
        Ok(())
    }

    fn drop_workspace(&mut self) {
        self.workspace = None;
    }

    fn boxed_clone(&self) -> Box<dyn Method> {
        Box::new(self.clone())
    }
}

/// The name of the method in scenes and states.
const NAME: &str = "kirchhoff";

/// Writes the centre line of a state whose nodes are at these arc lengths from the tip.
fn write_line(state: &KirchhoffState, from_tip_mm: &[f64], shape: &mut Shape) {
    shape.positions_mm.clone_from(&state.rod.positions);
    shape.tangents.clear();
    shape.tangents.extend(state.rod.frames.iter().map(|f| f.t));
    shape.from_tip_mm.clear();
    shape.from_tip_mm.extend_from_slice(from_tip_mm);
}

/// Meshes the inserted length.
fn meshed(environment: &Environment<'_>, hands: &[Hand], mesh: &mut Mesh) {
    let Surroundings { stack, properties, .. } = environment.surroundings;
    let stack = &*steered(stack, hands);
    let device = stack.first();
    let (fineness, modulus) = (environment.options.fineness(), properties.modulus_n_per_mm2);
    let line_mm = line_mm(lengths(hands));
    if line_mm == 0.0 {
        mesh.clear();
    } else if stack.is_several() {
        let inserted_mm: Vec<f64> = lengths(hands).collect();
        Nodes::new(stack, &inserted_mm, fineness).mesh(stack, &inserted_mm, modulus, mesh);
    } else {
        mesh.build(device, line_mm, fineness, modulus);
    }
}
