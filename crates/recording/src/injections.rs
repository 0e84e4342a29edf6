//! Injections of contrast medium: injections.csv, beside steps.csv. Each row has the position of the tip at the start,
//! from where the medium flows.

use std::path::Path;

use endowire_core::insertion::{Injection, ScriptRun, Simulation};
use endowire_core::{Error, Result};

use crate::columns::columns;
use crate::outlet::Outlet;
use crate::table;

/// The table; absent if nothing was injected.
pub const INJECTIONS: &str = "injections.csv";

columns! {
    /// A row of injections.csv.
    pub struct InjectionRow {
        /// Number of steps carried out before it.
        pub after_step: usize,
        /// Time of its begin.
        pub time_s: f64,
        /// Name of the instrument through which it flows.
        pub instrument: String,
        /// Volume.
        pub volume_ml: f64,
        /// Flow rate.
        pub rate_ml_per_s: f64,
        /// Inserted length of the instrument.
        pub inserted_mm: f64,
        /// Place of the instrument's tip.
        pub tip_x_mm: f64,
        /// As `tip_x_mm`.
        pub tip_y_mm: f64,
        /// As `tip_x_mm`.
        pub tip_z_mm: f64,
        /// Sum of the wall forces at the tip; absent in recordings of earlier versions.
        pub tip_force_n: Option<f64>,
    }
}

impl InjectionRow {
    /// The injections of a script after the first `known` ones; they begin at the current position. A script without
    /// speeds has `frames_per_s` steps per second.
    pub fn begun(run: &ScriptRun<'_>, known: usize, frames_per_s: f64, simulation: &Simulation) -> Vec<Self> {
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

    /// Writes the table of a recording, which has all injections so far; without any there is none.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be written.
    pub fn write(folder: &Path, injected: &[Self]) -> Result<()> {
        let path = folder.join(INJECTIONS);
        table::write(&path, injected).map_err(|e| Error::file(&path, e))
    }

    /// The injections of a recorded run.
    ///
    /// # Errors
    /// [`Error::Content`] for a table that cannot be read.
    pub fn read(folder: &Path) -> Result<Vec<Self>> {
        Ok(table::read_if_any(&folder.join(INJECTIONS))?.unwrap_or_default())
    }
}
