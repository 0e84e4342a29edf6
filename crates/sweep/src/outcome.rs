//! What a scripted insertion has come to.

use endowire_core::insertion::{Energy, InstrumentReport, Met, ScriptRun, Simulation};
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
    /// Deepest penetration of the wall in any step, mm.
    pub max_penetration_mm: f64,
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

/// What ended a run early: no equilibrium, a recording or frame that could not be written, or an interrupt.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepFailure {
    /// Number of the step, from 1.
    pub step: usize,
    /// What was said.
    pub reason: String,
}

impl RunOutcome {
    /// That of a script of at most `steps_asked` steps after `steps` of them, which all `converged` and went as deep into the wall as
    /// `max_penetration_mm`.
    pub fn new(
        simulation: &Simulation,
        hand: &ScriptRun<'_>,
        (steps, steps_asked): (usize, usize),
        (converged, max_penetration_mm): (bool, f64),
        failure: Option<StepFailure>,
    ) -> Self {
        let report = simulation.report();
        let names = simulation.stack().instruments().iter().map(|one| one.name.clone());
        let instruments = names.zip(&report.instruments);
        Self {
            steps,
            steps_asked,
            converged: converged && failure.is_none(),
            failure,
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            tip_mm: simulation.shape().tip_mm().map(Into::into),
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            until: hand
                .conditions()
                .map(|(line, course)| UntilOutcome {
                    line: line.to_owned(),
                    steps: course.steps,
                    met: course.met,
                })
                .collect(),
            instruments: instruments
                .map(|(name, report)| InstrumentOutcome { name, report: *report })
                .collect(),
            energy_mj: report.energy,
            max_penetration_mm,
            left_through: report.left_through,
        }
    }
}
