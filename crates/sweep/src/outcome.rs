//! What a scripted insertion has come to.

use endowire_core::insertion::{Energy, InstrumentReport, Met, ScriptRun, Simulation, Tally, WallForce};
use endowire_core::{Error, PhysicalEnd};
use serde::{Deserialize, Serialize};

/// The end of a run, or where it is while it goes on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunOutcome {
    /// Steps carried out.
    pub steps: usize,
    /// Steps of the script.
    pub steps_asked: usize,
    /// Whether all steps were carried out and every one met its convergence test.
    pub converged: bool,
    /// What ended it; none while it goes on.
    pub ended_by: Option<EndedBy>,
    /// The step that failed and why, if one did.
    pub failure: Option<StepFailure>,
    /// Length inserted at the end, mm.
    pub inserted_mm: f64,
    /// Turn of the tail at the end, rad.
    pub rotation_rad: f64,
    /// Tip at the end, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// Push force at the end, N.
    pub push_force_n: f64,
    /// Torque at the end, N·mm.
    pub torque_nmm: f64,
    /// Lines of the script with a condition that have ended.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub until: Vec<UntilOutcome>,
    /// Each of several instruments at the end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<InstrumentOutcome>,
    /// Energy at the end, mJ.
    pub energy_mj: Energy,
    /// How hard the wall holds the device at the end.
    pub wall_force: WallForce,
    /// How its steps went.
    #[serde(flatten)]
    pub tally: Tally,
    /// The opening through which the tip has left the vessel at the end.
    pub left_through: Option<usize>,
}

/// How a line of the script with a condition has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UntilOutcome {
    /// The line.
    pub line: String,
    /// Its steps.
    pub steps: usize,
    /// The step of the script after which it ended.
    pub after_step: usize,
    /// What has ended it; none where it went all of its way.
    pub met: Option<Met>,
}

/// One of several instruments at the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InstrumentOutcome {
    /// Its name.
    pub name: String,
    /// What its hand has done and feels.
    #[serde(flatten)]
    pub report: InstrumentReport,
}

/// What ended a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedBy {
    /// All lines of the script went all of their way, or were ended by a condition that another line followed.
    Script,
    /// The condition of the last line: the tip is as near to its target as was asked for.
    Arrived,
    /// The condition of the last line: the hand pushes as hard as was said.
    PushForce,
    /// The vessel is narrower than the device.
    Blocked,
    /// The tip has left the vessel, farther than anything is known.
    Left,
    /// A step that found no equilibrium or could not be carried out.
    Failed,
    /// An interrupt.
    Interrupted,
    /// What could not be written.
    Unrecorded,
}

impl EndedBy {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Script => "script",
            Self::Arrived => "arrived",
            Self::PushForce => "push_force",
            Self::Blocked => "blocked",
            Self::Left => "left",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
            Self::Unrecorded => "unrecorded",
        }
    }
}

impl From<Met> for EndedBy {
    fn from(met: Met) -> Self {
        match met {
            Met::TipWithinMm => Self::Arrived,
            Met::PushForceN => Self::PushForce,
        }
    }
}

/// What ended a run early: no equilibrium, a recording or frame that could not be written, or an interrupt.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepFailure {
    /// Number of the step, from 1.
    pub step: usize,
    /// What was said.
    pub reason: String,
    /// What kind of end it is.
    pub kind: EndedBy,
}

impl StepFailure {
    /// That of a step which the simulation or its script refused.
    pub fn new(step: usize, error: &Error) -> Self {
        let kind = match error {
            Error::End(PhysicalEnd::Blocked { .. }) => EndedBy::Blocked,
            Error::End(PhysicalEnd::Left { .. }) => EndedBy::Left,
            _ => EndedBy::Failed,
        };
        Self { step, reason: error.to_string(), kind }
    }
}

impl RunOutcome {
    /// That of a script of at most `steps_asked` steps after `steps` of them, which went as `tally` says.
    pub fn new(
        simulation: &Simulation,
        hand: &ScriptRun<'_>,
        (steps, steps_asked): (usize, usize),
        tally: Tally,
        failure: Option<StepFailure>,
    ) -> Self {
        let report = simulation.report();
        let names = simulation.stack().instruments().iter().map(|one| one.name.clone());
        let instruments = names.zip(&report.instruments);
        let condition = || hand.course().motions.last().and_then(|line| line.met);
        let at_its_end = || hand.has_ended().then(|| condition().map_or(EndedBy::Script, EndedBy::from));
        Self {
            steps,
            steps_asked,
            converged: tally.unconverged_steps == 0 && failure.is_none(),
            ended_by: failure.as_ref().map(|failure| failure.kind).or_else(at_its_end),
            failure,
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            tip_mm: simulation.shape().tip_mm().map(Into::into),
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            until: hand
                .conditions()
                .map(|(line, course, after_step)| UntilOutcome {
                    line: line.to_owned(),
                    steps: course.steps,
                    after_step,
                    met: course.met,
                })
                .collect(),
            instruments: instruments
                .map(|(name, report)| InstrumentOutcome { name, report: *report })
                .collect(),
            energy_mj: report.energy,
            wall_force: simulation.wall_force(),
            tally,
            left_through: report.left_through,
        }
    }
}
