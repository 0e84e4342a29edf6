//! Injections of contrast medium by a script: injections.csv, beside steps.csv. Each row has the position of the tip
//! at the start, from where the medium flows.

use std::path::Path;

use endowire_assess::Outlet;
use endowire_core::insertion::{Injection, ScriptRun, Simulation};
use endowire_viewer::InjectionSpec;
use serde::{Deserialize, Serialize};

use super::rows;
use crate::failure::Failure;

/// The table; absent if nothing was injected.
pub(crate) const INJECTIONS: &str = "injections.csv";

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Injected {
    /// Number of steps carried out before it.
    pub(crate) after_step: usize,
    time_s: f64,
    instrument: String,
    volume_ml: f64,
    rate_ml_per_s: f64,
    inserted_mm: f64,
    tip_x_mm: f64,
    tip_y_mm: f64,
    tip_z_mm: f64,
    /// Sum of the wall forces at the tip; absent in recordings of earlier versions.
    #[serde(default)]
    tip_force_n: Option<f64>,
}

impl Injected {
    /// The injections of a script after the first `known` ones; they begin at the current position. A script without
    /// speeds has `frames_per_s` steps per second.
    pub(crate) fn begun(
        run: &ScriptRun<'_>,
        known: usize,
        frames_per_s: f64,
        simulation: &Simulation,
    ) -> Vec<Self> {
        let begun = run.injections()[known..].iter();
        begun.map(|one| Self::new(one, frames_per_s, simulation)).collect()
    }

    fn new(injection: &Injection, frames_per_s: f64, simulation: &Simulation) -> Self {
        let tip = simulation.tip_of_mm(injection.instrument).unwrap_or_default();
        Self {
            after_step: injection.after_step,
            time_s: injection.time_s.unwrap_or(injection.after_step as f64 / frames_per_s),
            instrument: simulation.stack().instruments()[injection.instrument].name.clone(),
            volume_ml: injection.ml,
            rate_ml_per_s: injection.ml_per_s,
            inserted_mm: simulation.report().lengths_mm()[injection.instrument],
            tip_x_mm: tip.x,
            tip_y_mm: tip.y,
            tip_z_mm: tip.z,
            tip_force_n: Outlet::of(simulation, Some(injection.instrument)).tip_force_n,
        }
    }

    /// The injection in the pictures.
    pub(crate) fn spec(&self) -> InjectionSpec {
        InjectionSpec {
            start_s: self.time_s,
            duration_s: self.volume_ml / self.rate_ml_per_s,
            rate_ml_per_s: self.rate_ml_per_s,
            at_mm: Some([self.tip_x_mm, self.tip_y_mm, self.tip_z_mm]),
            at_tip: false,
        }
    }
}

/// Writes the table of a recording.
pub(crate) fn write(folder: &Path, injected: &[Injected]) -> Result<(), Failure> {
    rows::write(&folder.join(INJECTIONS), injected)
}

/// The injections of a recorded run.
pub(crate) fn read(folder: &Path) -> Result<Vec<Injected>, Failure> {
    rows::read(&folder.join(INJECTIONS))
}
