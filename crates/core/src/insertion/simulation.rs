//! A device, a vessel and a method, stepped by commands.

use std::sync::{Arc, OnceLock};

use crate::contact::{Counters, Touching, WallProperties};
use crate::device::{Device, LENGTH_SLACK_MM, MOST_STEER, Stack, line_mm};
use crate::field::Field;
use crate::flow::BloodFlow;
use crate::insertion::{SimulationBuilder, mark};
use crate::methods::{
    Command, DetachedCoil, LateralForce, Method, Move, Sheath, State, StepReport, Stop, Surroundings,
    WallForce, displacement,
};
use crate::shape::Shape;
use crate::vessel::{Course, Displacement, Lumen, VesselMotion};
use crate::{Error, Result, Vec3};

/// A running insertion.
///
/// Clones of a simulation share the device's environment, and may run on any threads; each has its own state and,
/// from its first step on, its own workspace.
///
/// ```
/// use endowire_core::{Command, Device, GeneratedWall, Resolution, Sheath, Simulation, anatomy};
///
/// let vessel = GeneratedWall::new(&anatomy::tree("straight_tube").expect("built in"), Resolution::EdgeMm(2.0))?;
/// let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
/// let mut simulation = Simulation::builder(vessel.wall, Device::uniform(200.0, 0.45, 10.0)?, sheath).build()?;
/// simulation.step(Command::advance(10.0))?;
///
/// let state = simulation.state();                     // all that the next step depends on
/// let push_n = simulation.step(Command::advance(10.0))?.push_force_n;
/// simulation.restore(&state)?;                        // and back, to the bit
/// assert_eq!(simulation.step(Command::advance(10.0))?.push_force_n, push_n);
/// # Ok::<(), endowire_core::Error>(())
/// ```
pub struct Simulation {
    pub(super) scene: Arc<Environment>,
    pub(super) method: Box<dyn Method>,
    /// Time since the start, s.
    pub(super) time_s: f64,
    /// Fields in which the device is, …
    pub(super) fields: Fields,
    /// … and those in which it was when it last came to rest.
    pub(super) fields_before: Fields,
    /// Says whether a step is to be stopped.
    pub(super) stop: Option<Arc<Stop>>,
}

/// Fields that clones share.
pub(super) type Fields = Arc<[Arc<dyn Field>]>;

/// The immutable part of a simulation.
pub(super) struct Environment {
    pub(super) lumen: Lumen,
    pub(super) properties: WallProperties,
    pub(super) sheath: Sheath,
    pub(super) stack: Stack,
    pub(super) motion: Option<VesselMotion>,
    /// The course of the vessel, if it yields.
    pub(super) course: Option<Arc<Course>>,
    pub(super) flow: Option<BloodFlow>,
    /// Radius of the thickest instrument for which the method's wall was made, mm.
    pub(super) thickest_mm: f64,
    /// A number that stands for it, once it was needed.
    pub(super) mark: OnceLock<u64>,
}

impl Environment {
    /// A number that differs between scenes.
    fn mark(&self) -> u64 {
        *self.mark.get_or_init(|| mark::of(self))
    }

    /// In a step from one time to another, s, outside of fields.
    pub(super) fn surroundings(&self, time_s: [f64; 2]) -> Surroundings<'_> {
        Surroundings {
            motion: self.motion.as_ref(),
            course: self.course.as_ref(),
            flow: self.flow.as_ref(),
            time_s,
            ..Surroundings::at_rest(&self.lumen, &self.properties, &self.sheath, &self.stack)
        }
    }
}

impl Clone for Simulation {
    fn clone(&self) -> Self {
        Self {
            scene: Arc::clone(&self.scene),
            method: self.method.boxed_clone(),
            time_s: self.time_s,
            fields: Arc::clone(&self.fields),
            fields_before: Arc::clone(&self.fields_before),
            stop: self.stop.clone(),
        }
    }
}

/// What surrounds the device in a step of a simulation until a time; apart from its method, which works in these surroundings.
macro_rules! surroundings {
    ($simulation:expr, $time_s:expr) => {
        Surroundings {
            fields: [&$simulation.fields_before, &$simulation.fields],
            stop: $simulation.stop.as_deref(),
            ..$simulation.scene.surroundings([$simulation.time_s, $time_s])
        }
    };
}
pub(super) use surroundings;

impl Simulation {
    /// A builder for a simulation of a device, or of several instruments, that enter a vessel through `sheath`.
    pub fn builder<'a>(
        lumen: impl Into<Lumen>,
        stack: impl Into<Stack>,
        sheath: Sheath,
    ) -> SimulationBuilder<'a> {
        SimulationBuilder::new(lumen.into(), stack.into(), sheath)
    }

    /// Carries out one command; with several instruments, of the innermost. After an error the state is unchanged, to
    /// the bit.
    ///
    /// What it costs is bounded: it ends after [`Simulation::most_solves`] linear solves, and the Newton iteration in
    /// progress. All attempts count, and so does the way of a device that snaps. Hardly any command needs them all; one
    /// that does ends as a tick does. What has been reached is the new state, what is left of the hands' motion is in
    /// [`StepReport::behind`], and the next step or tick goes on with it, or [`Simulation::forget`] drops it. A device
    /// that is seen on its way to where it rests has not converged.
    ///
    /// # Errors
    /// A command that is not finite, rotates by more than a thousand turns, pushes in more than the device's length
    /// or pulls out more than is inserted (all [`Error::Parameter`]); a step without an equilibrium
    /// ([`Error::Computation`]).
    pub fn step(&mut self, command: Command) -> Result<&StepReport> {
        self.step_together(&[Move { instrument: 0, command }])
    }

    /// Moves instruments, each by its own command, all at the same time. After an error the state is unchanged, to
    /// the bit.
    ///
    /// # Errors
    /// As [`Simulation::step`] for each; an instrument that does not exist or is moved twice, and instruments that
    /// cannot be inserted together by these lengths (all [`Error::Parameter`]).
    pub fn step_together(&mut self, moves: &[Move]) -> Result<&StepReport> {
        self.step_until(moves, None)
    }

    /// As [`Simulation::step_together`], while time proceeds uniformly to `time_s`, and the vessel with it if it
    /// moves; without a time none passes.
    ///
    /// # Errors
    /// As [`Simulation::step_together`], and a time before that of the last step or not finite. A vessel does not wait:
    /// one that moves too far to be followed in [`Simulation::most_solves`] is an [`Error::Computation`] too.
    pub fn step_until(&mut self, moves: &[Move], time_s: Option<f64>) -> Result<&StepReport> {
        self.check_moves(moves)?;
        let time_s = self.check_time(time_s)?;
        let surroundings = surroundings!(self, time_s);
        let stepped = self.method.step_together(&surroundings, moves);
        stepped.map_err(|error| self.telling_what_is_behind(error))?;
        self.arrived(time_s);
        Ok(self.method.report())
    }

    /// Time and fields after a command.
    fn arrived(&mut self, time_s: f64) {
        self.time_s = time_s;
        if !self.method.report().is_under_way() {
            self.fields_before = Arc::clone(&self.fields);
        }
    }

    /// The linear solves ([`StepReport::solves`]) after which a command of these moves ends, done or not, with what
    /// earlier ones have left over ([`StepReport::behind`]); a tick ends after its own, if those are fewer. The Newton
    /// iteration in progress is finished. They follow from the motion alone
    /// (`StepTuning::most_solves`). `None` for methods other than
    /// `kirchhoff`, whose commands always go to their end.
    pub fn most_solves(&self, moves: &[Move]) -> Option<usize> {
        self.method.most_solves(moves)
    }

    /// Drops the motion that earlier ticks and steps have left over ([`StepReport::behind`]): the hands are then where
    /// the device is, at the lengths and rotations of its report. Without such motion it does nothing.
    ///
    /// What was dropped has no effect on later steps but one: parts of commands may begin shorter, if that motion was
    /// hard to follow. A device that is seen on its way to where it rests still goes there, in the next step or tick:
    /// until then `behind` is zeros.
    pub fn forget(&mut self) {
        if self.report().is_under_way() {
            self.method.forget();
        }
    }

    /// As [`Simulation::step_until`] in a tick of bounded cost: in about `solves` linear solves
    /// ([`StepReport::solves`]), whether the device comes to rest in them or not, and never more than a step may take.
    /// For haptics and displays that need an answer in time.
    ///
    /// Unfinished motion is reported ([`StepReport::behind`], [`StepReport::imbalance`]), and the next tick or step
    /// continues it, or [`Simulation::forget`] drops it; with still hands ticks reach an equilibrium. No state is beyond a wall: hands whose way is
    /// blocked in the tick wait. If the vessel moves and these solves do not suffice, the tick takes as many as a
    /// step. Methods other than `kirchhoff` take a step.
    ///
    /// # Errors
    /// As [`Simulation::step_until`], and zero solves.
    pub fn tick(&mut self, moves: &[Move], solves: usize, time_s: Option<f64>) -> Result<&StepReport> {
        if solves == 0 {
            return Err(Error::parameter("solves", solves, "allow at least one"));
        }
        self.check_moves(moves)?;
        let time_s = self.check_time(time_s)?;
        let surroundings = surroundings!(self, time_s);
        let ticked = self.method.tick(&surroundings, moves, solves);
        ticked.map_err(|error| self.telling_what_is_behind(error))?;
        self.arrived(time_s);
        Ok(self.method.report())
    }

    /// The time at the end of a step.
    pub(super) fn check_time(&self, time_s: Option<f64>) -> Result<f64> {
        let time_s = time_s.unwrap_or(self.time_s);
        if (self.time_s..=LATEST_S).contains(&time_s) {
            return Ok(time_s);
        }
        let remedy = format!("must be a time from that of the last step, {} s, to {LATEST_S}", self.time_s);
        Err(Error::parameter("time_s", time_s, remedy))
    }

    /// Detaches the coil of an instrument, which comes to rest, and withdraws its pusher. After an error the state is
    /// unchanged, to the bit. What is behind of other instruments goes on in it, as in [`Simulation::step`], which it
    /// resembles in cost too.
    ///
    /// # Errors
    /// An instrument that does not exist, is not a coil, is already detached or is not yet fully out
    /// ([`Error::Parameter`]); a coil or remaining device that does not come to rest ([`Error::Computation`]).
    pub fn detach(&mut self, instrument: usize) -> Result<&StepReport> {
        self.check_detach(instrument)?;
        let surroundings = surroundings!(self, self.time_s);
        let detached = self.method.detach(&surroundings, instrument);
        detached.map_err(|error| self.telling_what_is_behind(error))?;
        self.arrived(self.time_s);
        Ok(self.method.report())
    }

    /// Checks whether the coil of an instrument can be detached where it is.
    ///
    /// # Errors
    /// As [`Simulation::detach`], except [`Error::Computation`].
    pub fn check_detach(&self, instrument: usize) -> Result<()> {
        let instruments = self.scene.stack.instruments().len();
        if instrument >= instruments {
            let remedy = format!("there are {instruments}, the innermost is 0");
            return Err(Error::parameter("detach", instrument, remedy));
        }
        self.method.check_detach(&surroundings!(self, self.time_s), instrument)
    }

    /// Replaces the fields in which the device lies. The next step follows the equilibrium from the old fields to the
    /// new ones, also in a command without motion; so does a tick, as far as its linear solves permit. The length inside the sheath
    /// and detached coils do not feel fields. A [`State`] contains none: a restored simulation keeps its own.
    ///
    /// # Errors
    /// A method that supports no fields; a field that acts on none of the instruments; a magnet that ends beyond its
    /// instrument.
    pub fn set_fields(&mut self, fields: impl IntoIterator<Item = Arc<dyn Field>>) -> Result<()> {
        let fields: Fields = fields.into_iter().collect();
        if !fields.is_empty() && !self.method.takes_fields() {
            let remedy = "this method knows no fields: use kirchhoff";
            return Err(Error::parameter("fields", fields.len(), remedy));
        }
        fields.iter().enumerate().try_for_each(|(index, field)| self.check_field(index, &**field))?;
        self.fields = fields;
        Ok(())
    }

    fn check_field(&self, index: usize, field: &dyn Field) -> Result<()> {
        let name = format!("field[{index}]");
        if let Some(spec) = field.spec() {
            return spec.check(&name, &self.scene.stack);
        }
        let instruments = self.scene.stack.instruments().len();
        if (0..instruments).any(|instrument| !field.acts_on(instrument).is_empty()) {
            return Ok(());
        }
        let remedy = format!("acts on none of the {instruments} instruments: the innermost is 0");
        Err(Error::parameter(name, format!("{field:?}"), remedy))
    }

    /// The fields in which the device was when it last came to rest, and those to which the next step leads.
    pub fn fields(&self) -> [&[Arc<dyn Field>]; 2] {
        [&self.fields_before, &self.fields]
    }

    /// Ends long steps of this simulation and its later clones with [`Error::Stopped`] once `stop` returns true. It is called between the sub-steps of a
    /// command, and not in commands of a single sub-step.
    pub fn stop_when(&mut self, stop: impl Fn() -> bool + Send + Sync + 'static) {
        self.stop = Some(Arc::new(stop));
    }

    /// Detached coils, in the order of detachment.
    pub fn coils(&self) -> &[DetachedCoil] {
        self.method.coils()
    }

    /// Rejects advancing an instrument whose coil is detached.
    fn check_attached(&self, command: Command, instrument: usize) -> Result<()> {
        if command.advance_mm <= 0.0 || self.coils().iter().all(|coil| coil.instrument != instrument) {
            return Ok(());
        }
        let name = &self.scene.stack.instruments()[instrument].name;
        let remedy = "its coil is detached: advance the next one";
        Err(Error::parameter("advance_mm", format!("{} of {name:?}", command.advance_mm), remedy))
    }

    fn check_moves(&self, moves: &[Move]) -> Result<()> {
        self.check_moves_after(self.method.report(), moves)
    }

    /// Checks moves that follow the step of this report.
    pub(super) fn check_moves_after(&self, report: &StepReport, moves: &[Move]) -> Result<()> {
        let instruments = self.scene.stack.instruments();
        // Including motion left over by earlier commands.
        let reached = |index: usize| report.hand(index).inserted_mm;
        let inserted =
            |index: usize| reached(index) + report.behind.get(index).map_or(0.0, |left| left.advance_mm);
        for (index, one) in moves.iter().enumerate() {
            let Some(instrument) = instruments.get(one.instrument) else {
                let remedy = format!("there are {}, the innermost is 0", instruments.len());
                return Err(Error::parameter(format!("move[{index}].instrument"), one.instrument, remedy));
            };
            if moves[..index].iter().any(|other| other.instrument == one.instrument) {
                let remedy = format!("{:?} is moved twice: add its motions up", instrument.name);
                return Err(Error::parameter(format!("move[{index}].instrument"), one.instrument, remedy));
            }
            self.check_attached(one.command, one.instrument)?;
            let device_mm = instrument.device.length_mm();
            let checked = check_command(one.command, inserted(one.instrument), device_mm);
            // A single device has no name given by the user.
            let several = instruments.len() > 1;
            let checked =
                checked.map_err(|error| if several { within(&instrument.name, error) } else { error });
            let steered = |from: f64| check_steer(one.command, from, &instrument.device);
            let left = report.behind.get(one.instrument).map_or(0.0, |left| left.steer);
            let checked = checked.and_then(|()| steered(report.hand(one.instrument).steer + left));
            let would_do = || check_command(one.command, reached(one.instrument), device_mm).is_ok();
            checked.map_err(|error| if would_do() { self.telling_what_is_behind(error) } else { error })?;
        }
        let by =
            |index: usize| moves.iter().find(|m| m.instrument == index).map_or(0.0, |m| m.command.advance_mm);
        let places = |from: &dyn Fn(usize) -> f64| {
            self.scene.stack.check_places((0..instruments.len()).map(|index| from(index) + by(index)))
        };
        places(&inserted).map_err(|error| match places(&reached) {
            Ok(()) => self.telling_what_is_behind(error),
            Err(_) => error,
        })
    }

    /// The same error of a refused or failed command; if motion of earlier ones is left, it tells of which hand how
    /// much is, and what to do about it.
    fn telling_what_is_behind(&self, error: Error) -> Error {
        let hands = self.report().behind.iter().zip(self.scene.stack.instruments());
        let each = hands.filter(|(left, _)| **left != Command::default()).map(|(left, instrument)| {
            let Command { advance_mm, rotate_rad, steer } = left;
            let steered = if *steer == 0.0 { String::new() } else { format!(" and {steer:.3} of steering") };
            format!("{advance_mm:.3} mm and {rotate_rad:.3} rad{steered} of {:?}", instrument.name)
        });
        let each: Vec<String> = each.collect();
        if each.is_empty() {
            return error;
        }
        let with_rest = |text: String| {
            format!(
                "{text}; {} are behind, from commands before: finish them with ticks or steps without motion, or drop \
                 them with forget",
                each.join(", ")
            )
        };
        match error {
            Error::Parameter { name, value, remedy } => {
                Error::Parameter { name, value, remedy: with_rest(remedy) }
            }
            Error::Computation(reason) => Error::Computation(with_rest(reason)),
            other => other,
        }
    }

    /// Everything the next step depends on, except the device's environment.
    pub fn state(&self) -> State {
        self.method.state().of_scene(self.scene.mark(), self.time_s)
    }

    /// A number that stands for the scene: vessel and how it yields, wall, instruments and sheath. Simulations of the same scene
    /// have the same number.
    pub fn scene_number(&self) -> u64 {
        self.scene.mark()
    }

    /// Continues from a state of this scene: shape, report and all further steps are those of the simulation it was
    /// taken from, to the bit. After an error nothing has changed.
    ///
    /// # Errors
    /// A state of another method, vessel, wall, device, sheath or element length, and one with a number that is not
    /// finite ([`Error::Parameter`]).
    pub fn restore(&mut self, state: &State) -> Result<()> {
        if !(0.0..=LATEST_S).contains(&state.time_s()) {
            let remedy = format!("must be a time from 0 to {LATEST_S} s: restore a state of this scene");
            return Err(Error::parameter("state.time_s", state.time_s(), remedy));
        }
        if state.scene() != self.scene.mark() {
            let remedy = "it was taken in another scene: its vessel, wall, instruments or sheath are others; restore a state of this scene";
            return Err(Error::parameter("state.scene", format!("{:016x}", state.scene()), remedy));
        }
        state.check_finite()?;
        self.method.restore(&self.scene.surroundings([self.time_s; 2]), state)?;
        self.time_s = state.time_s();
        self.fields_before = Arc::clone(&self.fields);
        Ok(())
    }

    /// Frees the workspace, which the next step allocates again; results do not change. For simulations that wait.
    pub fn drop_workspace(&mut self) {
        self.method.drop_workspace();
    }

    /// Wall queries since the start, of the simulation and those it was cloned from.
    pub fn counters(&self) -> Counters {
        self.method.counters()
    }

    /// Forces across the line on an instrument and all inside it by those outside it, at every node of
    /// [`shape`](Simulation::shape). `None` where nothing is outside the instrument or it has ended, and at the
    /// sheath's mouth; empty for a single device.
    pub fn lateral_forces(&self, instrument: usize) -> Vec<LateralForce> {
        self.method.lateral_forces(&self.scene.surroundings([self.time_s; 2]), instrument)
    }

    /// Contacts between loops of the device; empty for methods without self-contact.
    pub fn touching(&self) -> Vec<Touching> {
        self.method.touching(&self.scene.surroundings([self.time_s; 2]))
    }

    /// The inserted centre line, sheath to tip.
    pub fn shape(&self) -> &Shape {
        self.method.shape()
    }

    /// Position of the tip of an instrument; `None` while it is not inserted.
    pub fn tip_of_mm(&self, instrument: usize) -> Option<Vec3> {
        let report = self.report();
        let inserted_mm = report.lengths_mm().get(instrument).copied().filter(|mm| *mm > 0.0)?;
        self.shape().behind(report.inserted_mm - inserted_mm).tip_mm()
    }

    /// The report of the last step.
    pub fn report(&self) -> &StepReport {
        self.method.report()
    }

    /// Magnitudes of the wall's forces ([`StepReport::wall_force`]); the tip is that of the instrument inserted
    /// farthest, of several that far the thickest.
    pub fn wall_force(&self) -> WallForce {
        let lengths_mm = self.report().lengths_mm();
        let line_mm = line_mm(lengths_mm.iter().copied());
        let farthest = self.scene.stack.devices().zip(&lengths_mm).filter(|(_, mm)| **mm >= line_mm);
        let radius_mm = farthest.map(|(device, _)| device.section_at(0.0).radius_mm).fold(0.0, f64::max);
        self.report().wall_force(self.shape(), radius_mm)
    }

    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Motion of the vessel; `None` if it rests.
    pub fn motion(&self) -> Option<&VesselMotion> {
        self.scene.motion.as_ref()
    }

    /// Displacement of the vessel; `None` if it never moves.
    pub fn displacement(&self) -> Option<Displacement> {
        let course = self.scene.course.as_ref();
        displacement(self.motion(), course, self.time_s, self.method.course_mm())
    }

    /// The course of the vessel, if it yields.
    pub fn course(&self) -> Option<&Course> {
        self.scene.course.as_deref()
    }

    /// Displacements of the unknowns of the vessel's course, mm; empty if it does not yield.
    pub fn course_mm(&self) -> &[Vec3] {
        self.method.course_mm()
    }

    /// A bound of how far any point of the vessel is displaced because its course yields, mm.
    pub fn yielded_mm(&self) -> f64 {
        self.course().map_or(0.0, |course| course.largest_mm(self.course_mm()))
    }

    /// The undisplaced vessel.
    pub fn lumen(&self) -> &Lumen {
        &self.scene.lumen
    }

    /// The device; with several instruments the innermost.
    pub fn device(&self) -> &Device {
        self.scene.stack.first()
    }

    /// All instruments.
    pub fn stack(&self) -> &Stack {
        &self.scene.stack
    }

    /// The sheath.
    pub fn sheath(&self) -> &Sheath {
        &self.scene.sheath
    }
}

/// Slack of a steering value: the rounding of thousands of summed increments.
const STEER_SLACK: f64 = 1e-9;

/// Latest time of a step, s: beyond it too few digits are left to resolve a heartbeat.
const LATEST_S: f64 = 1e9;

/// Largest rotation of one command, rad: a thousand turns. More is a mistake, and far beyond it an angle has too few
/// digits to resolve the position on the circle.
const TURN_LIMIT_RAD: f64 = 1000.0 * std::f64::consts::TAU;

/// The same error, with the name of the instrument.
fn within(instrument: &str, error: Error) -> Error {
    match error {
        Error::Parameter { name, value, remedy } => {
            Error::Parameter { name: format!("{instrument}.{name}"), value, remedy }
        }
        other => other,
    }
}

/// Checks the change of the steering in a command, from this value.
pub(super) fn check_steer(command: Command, from: f64, device: &Device) -> Result<()> {
    let to = from + command.steer;
    if command.steer == 0.0 {
        return Ok(());
    }
    let remedy = if !device.is_steerable() {
        "it is not steered: give a section of it steer, or leave it out".to_owned()
    } else if !to.is_finite() || to.abs() > MOST_STEER + STEER_SLACK {
        format!("it is steered to {from}, and values are −1 to 1: steer it by less")
    } else {
        return Ok(());
    };
    Err(Error::parameter("steer", command.steer, remedy))
}

pub(super) fn check_command(command: Command, inserted_mm: f64, device_mm: f64) -> Result<()> {
    // Rounded, to hide the error of summed increments.
    let shown_mm = (inserted_mm * 1e6).round() / 1e6;
    for (name, value) in [("advance_mm", command.advance_mm), ("rotate_rad", command.rotate_rad)] {
        if !value.is_finite() {
            return Err(Error::parameter(name, value, "must be a finite number"));
        }
    }
    if command.rotate_rad.abs() > TURN_LIMIT_RAD {
        return Err(Error::parameter(
            "rotate_rad",
            command.rotate_rad,
            format!(
                "is more than {:.0} turns in one command: turn less, in several commands if it is meant",
                TURN_LIMIT_RAD / std::f64::consts::TAU
            ),
        ));
    }
    let target = inserted_mm + command.advance_mm;
    if target > device_mm + LENGTH_SLACK_MM {
        return Err(Error::parameter(
            "advance_mm",
            command.advance_mm,
            format!("the device is {device_mm} mm long and {shown_mm} mm are inserted: advance less"),
        ));
    }
    if target < -LENGTH_SLACK_MM {
        return Err(Error::parameter(
            "retract_mm",
            -command.advance_mm,
            format!("only {shown_mm} mm are inserted: retract less"),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_without_meaning_are_refused() {
        let reported = |rad: f64| check_command(Command::rotate(rad), 0.0, 100.0).unwrap_err().to_string();
        for rad in [1e308, -1e5, f64::MAX] {
            assert!(reported(rad).contains("more than 1000 turns"), "{}", reported(rad));
        }
        assert!(reported(f64::NAN).contains("finite"));
        assert!(check_command(Command::rotate(-6000.0), 0.0, 100.0).is_ok());
    }
}
