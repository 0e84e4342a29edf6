//! The session: inputs and ticks go in, readouts and snapshots come out.

mod apply;
mod exam;
mod idle;
mod snapshot;

use endowire_assess::Exam;
use endowire_core::insertion::{InstrumentReport, Packing, Script, Simulation};
use endowire_core::vessel::{NoStore, Sac};
use endowire_core::{Error, PhysicalEnd, Result};
use endowire_viewer::ViewSpec;
pub use snapshot::Snapshot;

use crate::TICKS_PER_S;
use crate::demonstration::{Demonstration, Next};
use crate::hand::{Hand, Motion, steered};
use crate::history::{Done, History, moves_by_itself};
use crate::input::Input;
use crate::lab::Lab;
use crate::meter::Meter;
use crate::readout::{Event, EventKind, Limits, Went};
use crate::replay::Inputs;
use crate::telemetry::Telemetry;

pub use idle::IdleKey;

/// Largest number of events that are kept.
const MOST_EVENTS: usize = 1000;
/// Limit of linear solves per tick for display ([`Session::with_ticks`]): some milliseconds for a wire in arteries.
/// Most ticks take three or four.
pub const TICK_SOLVES: usize = 60;

/// The current packing of a sac, if there is one.
fn packing(sac: Option<&(Sac, Option<Packing>)>) -> Option<Packing> {
    sac.and_then(|(_, packing)| *packing)
}

/// The kind of event for an error.
fn kind_of(error: &Error) -> EventKind {
    match error {
        Error::End(PhysicalEnd::Left { .. }) => EventKind::Left,
        error if error.is_input() => EventKind::Refused,
        _ => EventKind::Blocked,
    }
}

/// An interactive session.
pub struct Session {
    simulation: Simulation,
    hands: Vec<Hand>,
    selected: usize,
    history: History,
    lab: Lab,
    limits: Limits,
    /// Limit of linear solves per tick; `None` if each tick ends in equilibrium.
    solves: Option<usize>,
    /// The script that can be played, and the one being played.
    script: Option<Script>,
    demonstration: Option<Demonstration>,
    ticks: u64,
    /// Whether an instrument moved in the last tick.
    moving: bool,
    /// Whether a moving vessel is paused: from an undo until the next motion, so that undone steps are not lost.
    holds_still: bool,
    events: Vec<Event>,
    events_in_all: usize,
    telemetry: Telemetry,
    /// The sac for coils, and its current packing.
    sac: Option<(Sac, Option<Packing>)>,
    /// The exam, if the session is a subject.
    exam: Option<Exam>,
    meter: Meter,
    /// All inputs, each with the number of ticks before it.
    inputs: Vec<(u64, Input)>,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("steps", &self.history.steps()).finish_non_exhaustive()
    }
}

impl Session {
    /// A session that starts from the current state of a simulation, in the room described by `view`, with a square
    /// fluoroscopic picture of `side_px` pixels.
    ///
    /// # Errors
    /// Limits that are not above 0; as [`ViewSpec::validate`].
    pub fn new(simulation: Simulation, view: ViewSpec, side_px: u32, limits: Limits) -> Result<Self> {
        for (name, limit) in [("warn_n", limits.push_n), ("warn_nmm", limits.torque_nmm)] {
            endowire_core::error::in_range(name, limit, 1e6)?;
        }
        let lab = Lab::new(view, side_px, simulation.lumen().wall(&NoStore)?.mesh())?;
        let mut meter = Meter::default();
        if lab.fluoro().patient.ct.is_some() {
            // A tomogram takes seconds to read: hands do not wait for it at the first step on the pedal.
            meter.measure(&lab, simulation.lumen().wall(&NoStore)?)?;
        }
        let hands = vec![Hand::default(); simulation.stack().instruments().len()];
        let (history, telemetry) = (History::new(&simulation), Telemetry::new(&simulation));
        Ok(Self {
            simulation,
            hands,
            selected: 0,
            history,
            lab,
            limits,
            solves: None,
            script: None,
            demonstration: None,
            ticks: 0,
            moving: false,
            holds_still: false,
            events: Vec::new(),
            events_in_all: 0,
            telemetry,
            sac: None,
            exam: None,
            meter,
            inputs: Vec::new(),
        })
    }

    /// Draws pictures of this many pixels a side from now on; nothing else changes.
    ///
    /// # Errors
    /// A side that is not 1 to 4096.
    pub fn show_at(&mut self, side_px: u32) -> Result<()> {
        self.lab.show_at(side_px)
    }

    /// Adds a script, which starts from the current state and is played by [`Input::Script`].
    #[must_use]
    pub fn with_script(mut self, script: Script) -> Self {
        self.script = Some(script);
        self
    }

    /// Limits each tick to about this many linear solves ([`Simulation::tick`]), so that none takes long; the device
    /// follows the rest of the motion in later ticks. Without it, a tick in which the device jumps takes as long as
    /// it needs.
    ///
    /// # Errors
    /// `solves` is 0.
    pub fn with_ticks(mut self, solves: usize) -> Result<Self> {
        if solves == 0 {
            return Err(Error::parameter("solves", 0, "allow at least one in a tick"));
        }
        self.solves = Some(solves);
        Ok(self)
    }

    /// Adds the vessel's sac, if it has one; readouts then report its packing.
    #[must_use]
    pub fn with_sac(mut self, sac: Option<Sac>) -> Self {
        self.sac = sac.map(|sac| (sac, None));
        self.pack();
        self
    }

    /// Updates the packing. Returns whether loops have newly come out of the neck.
    fn pack(&mut self) -> bool {
        let Some((sac, packing)) = &mut self.sac else { return false };
        let before = packing.is_some_and(|packing| packing.herniated);
        *packing = Packing::of(&self.simulation, sac).ok();
        !before && packing.is_some_and(|packing| packing.herniated)
    }

    /// Advances by 1/60 s. Instruments that move carry out one step; a script that is played carries out the steps
    /// that end in this tick.
    pub fn tick(&mut self) {
        // The beam state of a tick is that at its beginning.
        let begun_s = self.time_s();
        self.measure();
        self.telemetry.beam(self.lab.beam(begun_s));
        self.ticks += 1;
        self.lab.tick();
        if let Some(shown) = self.demonstration.take_if(|shown| !shown.paused) {
            self.demonstration = self.show(shown);
            self.moving = false;
            self.examine();
            return;
        }
        self.telemetry.rest_until(begun_s, (&self.simulation, packing(self.sac.as_ref())));
        let (lengths_mm, steered) = (self.hands_mm(), steered(&self.simulation));
        let instruments = self.simulation.stack().instruments();
        let mut motions = Vec::new();
        for (index, hand) in self.hands.iter_mut().enumerate() {
            let (in_mm, all_mm) = (lengths_mm[index], instruments[index].device.length_mm());
            let room_mm = [-in_mm.max(0.0), (all_mm - in_mm).max(0.0)];
            motions.push(hand.tick(index, room_mm, steered[index]));
        }
        motions.retain(|motion| !motion.rests());
        if !motions.is_empty() {
            let step = Done { motions: motions.clone(), solves: self.solves, ..Self::resting() };
            let done = self.step(step, !self.moving);
            self.note(self.time_s(), if done { &motions } else { &[] });
            self.examine();
            self.moving = true;
            return;
        }
        let goes_on = moves_by_itself(&self.simulation) || self.simulation.report().is_under_way();
        if self.demonstration.is_none() && !self.holds_still && goes_on {
            self.step(Done { solves: self.solves, ..Self::resting() }, false);
        }
        self.moving = false;
        self.note(self.time_s(), &[]);
        self.examine();
    }

    /// A step without motion.
    fn resting() -> Done {
        Done { motions: vec![], per_s: TICKS_PER_S, detach: None, solves: None }
    }

    /// Commanded inserted length of each instrument, mm; the device may not have followed yet.
    fn hands_mm(&self) -> Vec<f64> {
        let report = self.simulation.report();
        let mut lengths_mm = report.lengths_mm();
        lengths_mm.iter_mut().zip(&report.behind).for_each(|(mm, behind)| *mm += behind.advance_mm);
        lengths_mm
    }

    /// Records a step that ends at `time_s`, with these motions.
    fn note(&mut self, time_s: f64, motions: &[Motion]) {
        self.telemetry.step(time_s, motions, (&self.simulation, packing(self.sac.as_ref())));
        if self.lab.is_live() && !motions.is_empty() {
            let tips = motions.iter().filter_map(|motion| self.simulation.tip_of_mm(motion.instrument));
            let tips: Vec<_> = tips.collect();
            // What is still in the sheath moves out of sight anyway.
            let out = !tips.is_empty() && !tips.iter().any(|tip_mm| self.meter.shows(tip_mm));
            self.telemetry.in_picture(!out);
        }
    }

    /// Measures the beam, if it is on in a room that was not measured yet.
    fn measure(&mut self) {
        if !self.lab.is_live() {
            return;
        }
        let wall = self.simulation.lumen().wall(&NoStore);
        match wall.and_then(|wall| self.meter.measure(&self.lab, wall)) {
            Ok(delivered) => delivered.into_iter().for_each(|delivered| self.lab.exposed(delivered)),
            Err(error) => self.happened(kind_of(&error), error.to_string()),
        }
    }

    /// The record of instruments, beam and injector so far, for assessment; it includes undone steps and rests.
    pub fn record(&self) -> &endowire_assess::Record {
        self.telemetry.record()
    }

    /// Carries out and records the steps of a script that end in this tick; returns the script if it continues. A step
    /// takes the time since the one before it, in which its motion is even, so that it is measured as one of a run.
    fn show(&mut self, mut shown: Demonstration) -> Option<Demonstration> {
        shown.tick();
        loop {
            let next = shown.next(&self.simulation);
            for one in shown.injections() {
                if let Err(error) = self.inject(Some(one.instrument), one.ml, one.ml_per_s) {
                    self.happened(EventKind::Refused, error.to_string());
                }
            }
            match next {
                Ok(Next::Later { rests }) => {
                    if rests {
                        self.note(self.time_s(), &[]);
                    }
                    return Some(shown);
                }
                Ok(Next::End) => {
                    self.happened(EventKind::Script, "the script is at its end".to_owned());
                    return None;
                }
                Ok(Next::Step { step, begins, ago_s }) => {
                    let moves = !step.motions.is_empty() || step.detach.is_some();
                    let motions = step.motions.clone();
                    if (moves || moves_by_itself(&self.simulation)) && !self.step(step, begins) {
                        return None;
                    }
                    self.note(self.time_s() - ago_s, &motions);
                }
                Err(error) => {
                    self.happened(EventKind::Refused, error.to_string());
                    return None;
                }
            }
        }
    }

    /// Carries out a step; returns whether it succeeded.
    fn step(&mut self, step: Done, begins: bool) -> bool {
        match self.advance(step, begins) {
            Ok(()) => true,
            Err(error) => {
                self.happened(kind_of(&error), error.to_string());
                false
            }
        }
    }

    /// Carries out a step; `begins` marks the first one of a motion.
    fn advance(&mut self, step: Done, begins: bool) -> Result<()> {
        if begins {
            self.history.begin_motion();
        }
        let (was_out, warned) = (self.simulation.report().left_through, self.warns());
        let was_stopped = self.simulation.report().has_failed();
        let report = step.carry_out(&mut self.simulation)?;
        let stopped = step.solves.is_some() && report.has_failed();
        let (jumped, out, detached) = (report.jumped, report.left_through, step.detach);
        self.holds_still = false;
        self.history.push(step, &self.simulation);
        // A hand that goes on pushing is stopped in every tick: that is one event.
        if stopped && !was_stopped {
            self.happened(EventKind::Blocked, "the wall has stopped the hands".to_owned());
        }
        if jumped {
            self.happened(EventKind::Jumped, "jumped: it let go of energy".to_owned());
        }
        if let Some(instrument) = detached {
            let name = &self.simulation.stack().instruments()[instrument].name;
            let text = format!("the coil of {name:?} is detached: it stays, and its pusher is out");
            self.happened(EventKind::Detached, text);
        }
        if self.pack() {
            self.happened(EventKind::Herniated, "loops have come out of the neck of the sac".to_owned());
        }
        if let (Some(opening), None) = (out, was_out) {
            self.happened(EventKind::Left, format!("the tip has left through opening {opening}"));
        }
        if self.warns() && !warned {
            self.happened(EventKind::Limit, "force or torque is beyond its limit".to_owned());
        }
        Ok(())
    }

    fn beyond(&self, report: &InstrumentReport) -> bool {
        report.push_force_n.is_some_and(|force| force.abs() > self.limits.push_n)
            || report.torque_nmm.abs() > self.limits.torque_nmm
    }

    fn warns(&self) -> bool {
        self.simulation.report().hands().iter().any(|report| self.beyond(report))
    }

    /// Records an event, unless it equals the last one at the same step.
    fn happened(&mut self, kind: EventKind, text: String) {
        let step = self.history.steps();
        let alike = |last: &Event| last.step == step && last.kind == kind && last.text == text;
        if self.events.last().is_some_and(alike) {
            return;
        }
        if self.events.len() == MOST_EVENTS {
            self.events.remove(0);
        }
        self.events.push(Event { step, time_s: self.time_s(), kind, text });
        self.events_in_all += 1;
    }

    /// Time of the session, s.
    pub fn time_s(&self) -> f64 {
        self.ticks as f64 / TICKS_PER_S
    }

    /// Whether the script is being played and not paused.
    pub fn demonstrates(&self) -> bool {
        self.demonstration.as_ref().is_some_and(|shown| !shown.paused)
    }

    /// Whether medium is being injected.
    pub fn is_injecting(&self) -> bool {
        let time_s = self.time_s();
        self.telemetry.record().injections.iter().any(|one| one.end_s() > time_s)
    }

    /// Number of steps carried out, without undone ones.
    pub fn steps(&self) -> usize {
        self.history.steps()
    }

    /// Statistics of these steps.
    pub fn went(&self) -> Went {
        self.history.went()
    }

    /// The last events, at most 1000.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// What hands did, from which [`Inputs::repeat_in`] repeats the session to the bit, with its rests, its beam
    /// and what was undone.
    pub fn inputs(&self) -> Inputs {
        Inputs::of(self.ticks, self.solves, &self.inputs)
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// All motions and injections as `[[script]]` tables of a scene file, which repeat them to the bit.
    pub fn script(&self) -> String {
        self.history.script(&self.simulation)
    }
}
