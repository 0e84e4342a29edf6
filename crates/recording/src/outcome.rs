//! Outcome of a scripted insertion.

use endowire_core::insertion::{Energy, InstrumentReport, Met, ScriptRun, Simulation, Tally, WallForce};
use endowire_core::{Error, PhysicalEnd};
use serde::{Deserialize, Serialize};

/// Outcome of a run, or its current state while it is running.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunOutcome {
    /// Number of steps carried out.
    pub steps: usize,
    /// Number of steps in the script.
    pub steps_asked: usize,
    /// Whether all steps were carried out and all of them converged.
    pub converged: bool,
    /// The reason for its end; `None` while it is running.
    pub ended_by: Option<EndedBy>,
    /// The step that failed and the reason, if one did.
    pub failure: Option<StepFailure>,
    /// Inserted length at the end, mm.
    pub inserted_mm: f64,
    /// Rotation of the hand at the end, rad.
    pub rotation_rad: f64,
    /// Rotation of the device at the sheath's mouth at the end, rad.
    pub mouth_rotation_rad: f64,
    /// Rotation of the tip at the end, rad.
    pub tip_rotation_rad: f64,
    /// Tip position at the end, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// Push force at the end, N.
    pub push_force_n: f64,
    /// Torque at the end, N·mm.
    pub torque_nmm: f64,
    /// Script lines with a condition that have ended.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub until: Vec<UntilOutcome>,
    /// The instruments at the end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<InstrumentOutcome>,
    /// Energy at the end, mJ.
    pub energy_mj: Energy,
    /// Wall forces on the device at the end.
    pub wall_force: WallForce,
    /// Statistics of the steps.
    #[serde(flatten)]
    pub tally: Tally,
    /// The opening through which the device has left the vessel at the end, if it has.
    pub left_through: Option<usize>,
}

/// End of a script line with a condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UntilOutcome {
    /// The line.
    pub line: String,
    /// Number of its steps.
    pub steps: usize,
    /// Number of the script's step after which it ended.
    pub after_step: usize,
    /// The condition that was met; `None` if the line was carried out in full.
    pub met: Option<Met>,
}

/// State of an instrument at the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InstrumentOutcome {
    /// Its name.
    pub name: String,
    /// Its motion and the reaction forces.
    #[serde(flatten)]
    pub report: InstrumentReport,
}

/// The reason for the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedBy {
    /// All script lines were carried out in full, or were ended by their condition with another line following.
    Script,
    /// The condition of the last line: the tip came as near to its target as requested.
    Arrived,
    /// The condition of the last line: the push force reached the given value.
    PushForce,
    /// The vessel is narrower than the device.
    Blocked,
    /// The tip has left the vessel and the region around it that is known.
    Left,
    /// A step found no equilibrium or could not be carried out, or the program that moved the instruments failed.
    Failed,
    /// An interrupt.
    Interrupted,
    /// An output could not be written.
    Unrecorded,
    /// The program that moved the instruments closed the recording; there was no script.
    Closed,
}

impl EndedBy {
    /// Name in outputs.
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
            Self::Closed => "closed",
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

/// The reason for an early end of a run: no equilibrium, a recording or frame that could not be written, or an
/// interrupt.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepFailure {
    /// Number of the step, from 1.
    pub step: usize,
    /// The error message.
    pub reason: String,
    /// Its kind.
    pub kind: EndedBy,
}

impl StepFailure {
    /// The failure of a step that the simulation or its script refused.
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
    /// The outcome of `steps` steps of a program without a script, with the statistics `tally`.
    pub fn of_program(simulation: &Simulation, steps: usize, tally: Tally) -> Self {
        Self::now(simulation, (steps, steps), tally, None)
    }

    /// The same outcome, of a run that this failure has ended.
    pub fn failed(self, failure: StepFailure) -> Self {
        Self { converged: false, ended_by: Some(failure.kind), failure: Some(failure), ..self }
    }

    /// The state of a simulation as an outcome, without what a script says of it.
    fn now(
        simulation: &Simulation,
        (steps, steps_asked): (usize, usize),
        tally: Tally,
        failure: Option<StepFailure>,
    ) -> Self {
        let report = simulation.report();
        let names = simulation.stack().instruments().iter().map(|one| one.name.clone());
        let instruments = names.zip(report.hands());
        Self {
            steps,
            steps_asked,
            converged: tally.unconverged_steps == 0 && failure.is_none(),
            ended_by: failure.as_ref().map(|failure| failure.kind),
            failure,
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            mouth_rotation_rad: report.mouth_rotation_rad,
            tip_rotation_rad: report.tip_rotation_rad,
            tip_mm: simulation.shape().tip_mm().map(Into::into),
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            until: vec![],
            instruments: instruments.map(|(name, report)| InstrumentOutcome { name, report }).collect(),
            energy_mj: report.energy,
            wall_force: simulation.wall_force(),
            tally,
            left_through: report.left_through,
        }
    }

    /// The outcome of a script of at most `steps_asked` steps after `steps` of them, with the statistics `tally`.
    pub fn new(
        simulation: &Simulation,
        hand: &ScriptRun<'_>,
        (steps, steps_asked): (usize, usize),
        tally: Tally,
        failure: Option<StepFailure>,
    ) -> Self {
        let condition = || hand.course().motions.last().and_then(|line| line.met);
        let at_its_end = || hand.has_ended().then(|| condition().map_or(EndedBy::Script, EndedBy::from));
        let until = hand.conditions().map(|(line, course, after_step)| UntilOutcome {
            line: line.to_owned(),
            steps: course.steps,
            after_step,
            met: course.met,
        });
        let now = Self::now(simulation, (steps, steps_asked), tally, failure);
        Self { ended_by: now.ended_by.or_else(at_its_end), until: until.collect(), ..now }
    }
}
