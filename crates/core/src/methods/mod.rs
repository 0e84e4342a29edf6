//! Complete methods that compute the equilibrium after a command, behind one trait, with their inputs and outputs.

mod command;
mod detached;
mod finite;
mod gradient;
pub mod kirchhoff;
mod parameter;
mod report;
mod sheath;
mod state;

pub use command::{Command, Move};
pub use detached::DetachedCoil;
pub use gradient::{Gradient, Margin, Passed, Pulled, Slope, Tape, Weights};
pub use parameter::Parameter;
pub(crate) use parameter::{Parts, Together};
pub use report::{Energy, InstrumentReport, Jump, LateralForce, StepReport, WallForce};
pub use sheath::Sheath;
pub use state::{ChainState, Content, NodesState, State, TouchedPlane, check_inserted};

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::{Counters, Touching, WallProperties};
use crate::device::{Device, Stack};
use crate::field::Field;
use crate::flow::BloodFlow;
use crate::shape::Shape;
use crate::vessel::{Course, Displacement, Lumen, VesselMotion, WallStore};
use crate::{Error, Result, Vec3};
use kirchhoff::KirchhoffOptions;

/// The environment of a method's unknowns, which it may read but not change.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// The vessel.
    pub lumen: &'a Lumen,
    /// Stiffness and friction of the vessel's wall.
    pub properties: &'a WallProperties,
    /// The sheath, from which the device comes.
    pub sheath: &'a Sheath,
    /// The device; with several instruments the innermost.
    pub device: &'a Device,
    /// All instruments.
    pub stack: &'a Stack,
    /// Motion of the vessel; `None` if it rests.
    pub motion: Option<&'a VesselMotion>,
    /// The course of the vessel, if it yields; `None` if only its wall does.
    pub course: Option<&'a Arc<Course>>,
    /// Blood flow, which exerts drag on the device; `None` if not modelled.
    pub flow: Option<&'a BloodFlow>,
    /// The fields in which the device is before and after the step.
    pub fields: [&'a [Arc<dyn Field>]; 2],
    /// Returns true once a long step is to end without a result; called between sub-steps.
    pub stop: Option<&'a Stop>,
    /// Time before and after the step, s.
    pub time_s: [f64; 2],
}

/// Moves of commands, and the time after each, s.
pub(crate) type Timed<'a> = (&'a [Vec<Move>], &'a [f64]);

/// Returns true once a long computation is to end; called from any thread.
pub(crate) type Stop = dyn Fn() -> bool + Send + Sync;

impl<'a> Surroundings<'a> {
    /// A vessel that rests, without flow and fields.
    pub fn at_rest(
        lumen: &'a Lumen,
        properties: &'a WallProperties,
        sheath: &'a Sheath,
        stack: &'a Stack,
    ) -> Self {
        Self {
            lumen,
            properties,
            sheath,
            device: stack.first(),
            stack,
            motion: None,
            course: None,
            flow: None,
            fields: [&[], &[]],
            stop: None,
            time_s: [0.0; 2],
        }
    }

    /// Whether the vessel moves in the step.
    pub(crate) fn moves(&self) -> bool {
        let [before, after] = self.time_s;
        before != after && self.motion.is_some_and(VesselMotion::changes)
    }

    /// Ends a step that is to be stopped.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub(crate) fn check_stop(&self) -> Result<()> {
        if self.stop.is_some_and(|stop| stop()) { Err(Error::Stopped) } else { Ok(()) }
    }

    /// Whether the device is in other fields after the step.
    pub(crate) fn fields_change(&self) -> bool {
        let [before, after] = self.fields;
        before.len() != after.len() || before.iter().zip(after).any(|(a, b)| !Arc::ptr_eq(a, b))
    }

    /// The fields in which the device is after this part of the step, 0 to 1, with their weights: those before go over into those after evenly.
    pub(crate) fn fields_at(&self, part: f64) -> impl Iterator<Item = (&'a dyn Field, f64)> + use<'a> {
        let weights = if self.fields_change() { [1.0 - part, part] } else { [0.0, 1.0] };
        let each = self.fields.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
        each.flat_map(|(fields, weight)| fields.iter().map(move |field| (&**field, weight)))
    }

    /// Where the vessel is after this part of the step, 0 to 1, its course displaced by `course_mm`; none where it never moves.
    pub(crate) fn displacement(&self, part: f64, course_mm: &[Vec3]) -> Option<Displacement> {
        let [before, after] = self.time_s;
        let time_s = if part == 1.0 { after } else { before + (after - before) * part };
        displacement(self.motion, self.course, time_s, course_mm)
    }

    /// Rejects a vessel that moves or yields, and blood flow, for a method that supports none of them.
    ///
    /// # Errors
    /// Any of them.
    pub fn refuse_motion(&self, method: &str) -> Result<()> {
        let given = [
            ("motion", self.motion.is_some()),
            ("yielding", self.course.is_some()),
            ("flow", self.flow.is_some()),
        ];
        let Some((key, _)) = given.into_iter().find(|(_, given)| *given) else { return Ok(()) };
        let remedy = format!("{method} knows a vessel at rest: leave {key} out or use the method kirchhoff");
        Err(Error::parameter(format!("vessel.{key}"), "given", remedy))
    }
}

/// Where a vessel is at a time, s, its course displaced by `course_mm`; none where it never moves.
pub(crate) fn displacement(
    motion: Option<&VesselMotion>,
    course: Option<&Arc<Course>>,
    time_s: f64,
    course_mm: &[Vec3],
) -> Option<Displacement> {
    let moved = motion.map(|motion| motion.at(time_s));
    match course {
        Some(course) => Some(course.displaced(moved, course_mm)),
        None => moved,
    }
}

/// A method keeps its own unknowns from step to step and moves them by commands.
///
/// The next step depends on its [`State`] alone; everything else is a workspace, which may be dropped at any time.
pub trait Method: Send {
    /// Carries out one command and finds the equilibrium after it.
    ///
    /// After an error the state is bitwise the same as before the command.
    ///
    /// # Errors
    /// A command that the device or the method cannot follow (input), or no equilibrium found (computation).
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()>;

    /// Moves instruments at the same time; a method of one device takes the step of that.
    ///
    /// # Errors
    /// As [`Method::step`].
    fn step_together(&mut self, surroundings: &Surroundings<'_>, moves: &[Move]) -> Result<()> {
        self.step(surroundings, moves.first().map_or_else(Command::default, |one| one.command))
    }

    /// The linear solves after which a command of these moves ends, with what earlier ones have left over; `None` for
    /// methods whose commands always go to their end.
    fn most_solves(&self, _moves: &[Move]) -> Option<usize> {
        None
    }

    /// Carries out commands, one after the other, each with the time after it, s, from the state as it is, and records them to be
    /// differentiated; the state does not change. Each command was `checked` against the report before it.
    ///
    /// # Errors
    /// A method without gradients; as [`Method::step`]; a result that has no derivative.
    fn record(
        &self,
        _surroundings: &Surroundings<'_>,
        _commands: Timed<'_>,
        _checked: &dyn Fn(&StepReport, &[Move]) -> Result<()>,
    ) -> Result<Box<dyn Tape>> {
        Err(Error::parameter("method.name", "another one", "this method has no gradients: use kirchhoff"))
    }

    /// Drops motion of the hands that earlier commands have left over ([`StepReport::behind`]).
    fn forget(&mut self) {}

    /// Moves instruments within about `solves` linear solves, whether the device comes to rest in them or not: no
    /// state is beyond a wall, and remaining motion of the hands, or imbalance of forces, is left to the next tick or
    /// step ([`StepReport::behind`]). If the vessel moves, and moves the device, and these solves do not suffice, it
    /// takes as many as a step. Methods without ticks take a step.
    ///
    /// # Errors
    /// As [`Method::step`], except that a missing equilibrium is not an error.
    fn tick(&mut self, surroundings: &Surroundings<'_>, moves: &[Move], _solves: usize) -> Result<()> {
        self.step_together(surroundings, moves)
    }

    /// Detaches the coil of an instrument and withdraws its pusher; only called for methods that support coils.
    ///
    /// # Errors
    /// An instrument that is not a coil, is already detached or is not yet fully out (input); a coil or a device that
    /// does not come to rest afterwards (computation).
    fn detach(&mut self, _surroundings: &Surroundings<'_>, instrument: usize) -> Result<()> {
        Err(Error::parameter("detach", instrument, "this method knows no coils: use kirchhoff"))
    }

    /// Checks whether [`Method::detach`] is possible in the current state.
    ///
    /// # Errors
    /// As [`Method::detach`], except [`Error::Computation`].
    fn check_detach(&self, _surroundings: &Surroundings<'_>, instrument: usize) -> Result<()> {
        Err(Error::parameter("detach", instrument, "this method knows no coils: use kirchhoff"))
    }

    /// Coils that were detached, in their order.
    fn coils(&self) -> &[DetachedCoil] {
        &[]
    }

    /// Displacements of the unknowns of the vessel's course, mm; empty if it does not yield.
    fn course_mm(&self) -> &[Vec3] {
        &[]
    }

    /// Whether it supports fields ([`Surroundings::fields`]).
    fn takes_fields(&self) -> bool {
        false
    }

    /// The inserted centre line.
    fn shape(&self) -> &Shape;

    /// The report of the last step.
    fn report(&self) -> &StepReport;

    /// Wall queries since the method was created, including those of the one it was cloned from.
    fn counters(&self) -> Counters {
        Counters::default()
    }

    /// Forces on an instrument from those outside it, at every node; empty for methods with a single device.
    fn lateral_forces(&self, _surroundings: &Surroundings<'_>, _instrument: usize) -> Vec<LateralForce> {
        vec![LateralForce::default(); self.shape().len()]
    }

    /// Contacts between loops of the device; empty for methods without self-contact.
    fn touching(&self, _surroundings: &Surroundings<'_>) -> Vec<Touching> {
        Vec::new()
    }

    /// All that the next step depends on.
    fn state(&self) -> State;

    /// Continues from `state`. After an error nothing has changed.
    ///
    /// # Errors
    /// A state of another method, vessel or device, as far as that can be detected.
    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()>;

    /// Drops caches that make steps faster but not different: the next one rebuilds them.
    fn drop_workspace(&mut self) {}

    /// A clone in the same state.
    fn boxed_clone(&self) -> Box<dyn Method>;
}

/// A method with its options: what a scene names in `[method]`, and what a simulation starts with.
///
/// A scene deserialises its table into any type with this trait and `serde`'s `Deserialize`: in this crate
/// [`OwnMethod`].
pub trait MethodChoice: Debug {
    /// The name used in scene files and results.
    fn name(&self) -> &'static str;

    /// Whether it supports several coaxial instruments.
    fn takes_several(&self) -> bool {
        false
    }

    /// Whether it supports devices that are steered.
    fn takes_steering(&self) -> bool {
        false
    }

    /// Whether it supports sections that bend more easily in one plane.
    fn takes_soft_planes(&self) -> bool {
        false
    }

    /// Checks whether coils can be detached with this method and its options.
    ///
    /// # Errors
    /// The method, or the option that forbids it.
    fn check_detach(&self) -> Result<()> {
        Err(Error::parameter("method.name", self.name(), "this method knows no coils: use kirchhoff"))
    }

    /// The method at its start at the sheath, nothing inserted; walls that are costly to build come from `store`.
    ///
    /// # Errors
    /// Options out of range, and features the method does not support.
    fn start(&self, surroundings: &Surroundings<'_>, store: &dyn WallStore) -> Result<Box<dyn Method>>;
}

/// The methods of this crate, as `[method]` of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name")]
pub enum OwnMethod {
    /// The exact rod in equilibrium with the wall.
    #[serde(rename = "kirchhoff")]
    Kirchhoff(KirchhoffOptions),
}

impl Default for OwnMethod {
    fn default() -> Self {
        Self::Kirchhoff(KirchhoffOptions::default())
    }
}

impl MethodChoice for OwnMethod {
    fn name(&self) -> &'static str {
        let Self::Kirchhoff(options) = self;
        options.name()
    }

    fn takes_several(&self) -> bool {
        let Self::Kirchhoff(options) = self;
        options.takes_several()
    }

    fn takes_steering(&self) -> bool {
        let Self::Kirchhoff(options) = self;
        options.takes_steering()
    }

    fn takes_soft_planes(&self) -> bool {
        let Self::Kirchhoff(options) = self;
        options.takes_soft_planes()
    }

    fn check_detach(&self) -> Result<()> {
        let Self::Kirchhoff(options) = self;
        options.check_detach()
    }

    fn start(&self, surroundings: &Surroundings<'_>, store: &dyn WallStore) -> Result<Box<dyn Method>> {
        let Self::Kirchhoff(options) = self;
        options.start(surroundings, store)
    }
}
