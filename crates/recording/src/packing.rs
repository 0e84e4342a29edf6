//! Packing of the scene's sac with coils, step by step: packing.csv, beside steps.csv.

use std::io;
use std::path::Path;

use endowire_core::insertion::{Packing, Simulation};
use endowire_core::vessel::Sac;
use endowire_core::{Error, Result};
use serde::Serialize;

use crate::columns::columns;
use crate::table::{self, StepTable};

/// The table.
pub const PACKING: &str = "packing.csv";

columns! {
    /// A row of packing.csv: how much coils fill of the scene's sac after a step.
    pub struct PackingRow {
        /// Number of the step.
        pub step: usize,
        /// Volume of the coils in the sac.
        pub coils_mm3: f64,
        /// That volume over the volume of the sac.
        pub packing: f64,
        /// Fraction of the neck that is covered by coils.
        pub neck_coverage: f64,
        /// Length of coils outside the neck.
        pub outside_mm: f64,
        /// Whether a loop has herniated.
        pub herniated: bool,
        /// Force on the dome.
        pub dome_force_n: f64,
    }
}

/// The packing in the summary.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Packed {
    /// Volume of the sac.
    pub sac_mm3: f64,
    /// Diameter of its neck.
    pub neck_diameter_mm: f64,
    /// At the end: volume of the coils over the volume of the sac.
    pub density: f64,
    /// At the end: fraction of the neck that is covered by coils.
    pub neck_coverage: f64,
    /// At the end: length of coils outside the neck, mm.
    pub outside_mm: f64,
    /// Number of steps after which loops had herniated.
    pub herniated_steps: usize,
    /// The first such step.
    pub first_herniated_step: Option<usize>,
}

/// Writes the table of a run in a vessel with a sac.
pub(crate) struct PackingTable {
    pub(crate) table: StepTable,
    sac: Sac,
    reported: Packed,
    /// With the last step, which may be taken back.
    next: Packed,
}

impl PackingTable {
    /// The table of a recording that begins, or resumes with this simulation after step `steps`; rows of later steps are
    /// dropped.
    pub(crate) fn go_on(folder: &Path, sac: Sac, steps: usize, simulation: &Simulation) -> Result<Self> {
        let path = folder.join(PACKING);
        let table = StepTable::go_on(&path, steps).map_err(|e| Error::file(&path, e))?;
        let (mut reported, rows) = (Packed::none(&sac), table::read::<PackingRow>(&path)?);
        // In a new folder earlier steps have no rows, and the state is all that is known of them.
        if steps > 0 && rows.is_empty() {
            let Packing { density, neck_coverage, outside_mm, .. } = Packing::of(simulation, &sac)?;
            reported = Packed { density, neck_coverage, outside_mm, ..reported };
        }
        rows.iter().for_each(|row| reported.add(row));
        Ok(Self { table, reported, next: reported, sac })
    }

    /// Adds the row of a step.
    pub(crate) fn push(&mut self, step: usize, simulation: &Simulation) -> io::Result<()> {
        let packing = Packing::of(simulation, &self.sac).map_err(io::Error::other)?;
        let row = PackingRow {
            step,
            coils_mm3: packing.coils_mm3,
            packing: packing.density,
            neck_coverage: packing.neck_coverage,
            outside_mm: packing.outside_mm,
            herniated: packing.herniated,
            dome_force_n: packing.dome_force_n,
        };
        self.next = self.reported;
        self.next.add(&row);
        self.table.push(row)
    }

    /// Counts the last step.
    pub(crate) fn keep(&mut self) {
        self.reported = self.next;
    }

    /// The packing for the summary.
    pub(crate) fn reported(&self) -> Packed {
        self.reported
    }
}

impl Packed {
    fn none(sac: &Sac) -> Self {
        Self {
            sac_mm3: sac.volume_mm3,
            neck_diameter_mm: sac.neck_diameter_mm,
            density: 0.0,
            neck_coverage: 0.0,
            outside_mm: 0.0,
            herniated_steps: 0,
            first_herniated_step: None,
        }
    }

    fn add(&mut self, row: &PackingRow) {
        (self.density, self.neck_coverage, self.outside_mm) =
            (row.packing, row.neck_coverage, row.outside_mm);
        if row.herniated {
            self.herniated_steps += 1;
            self.first_herniated_step.get_or_insert(row.step);
        }
    }

    /// In words.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{:.1} % of {:.1} mm³ filled, {:.0} % of the neck covered, {:.1} mm of coils outside",
            100.0 * self.density,
            self.sac_mm3,
            100.0 * self.neck_coverage,
            self.outside_mm
        );
        if let Some(first) = self.first_herniated_step {
            text += &format!("; loops herniated in {} steps, the first step {first}", self.herniated_steps);
        }
        text
    }
}
