//! State of each instrument, step by step: instruments.csv, beside steps.csv.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use endowire_core::device::Stack;
use endowire_core::insertion::{Move, Simulation};
use endowire_core::shape::Shape;
use endowire_core::{Error, Result};

use crate::columns::columns;
use crate::table::{self, StepTable};

/// The table.
pub const INSTRUMENTS: &str = "instruments.csv";

columns! {
    /// A row of instruments.csv: an instrument in a step. Columns that earlier versions did not write, and those that a
    /// table written by hand may leave out, are `None` there.
    pub struct InstrumentRow {
        /// Number of the step.
        pub step: usize,
        /// Name of the instrument.
        pub instrument: String,
        ..hand,
        /// Value to which it is steered.
        pub steer: Option<f64>,
        /// Place of its tip; empty if it is not inserted.
        pub tip_x_mm: Option<f64>,
        /// As `tip_x_mm`.
        pub tip_y_mm: Option<f64>,
        /// As `tip_x_mm`.
        pub tip_z_mm: Option<f64>,
        /// Force with which its hand must push; empty where it jumps.
        pub push_force_n: Option<f64>,
        /// Torque of its hand.
        pub torque_nmm: f64,
        /// Length beyond the enclosing instruments, where it touches the wall itself.
        pub felt_mm: Option<f64>,
        /// Its largest radius there.
        pub felt_radius_mm: Option<f64>,
        /// Sum of the forces across the line between it and the instruments around and inside it.
        pub lateral_n: Option<f64>,
    }
}

/// Writes the table of a run.
pub(crate) struct InstrumentTable {
    pub(crate) table: StepTable,
}

impl InstrumentTable {
    /// The table of a new recording in `folder`.
    pub(crate) fn new(folder: &Path) -> io::Result<Self> {
        StepTable::new(&folder.join(INSTRUMENTS)).map(|table| Self { table })
    }

    /// The table of a recording that resumes after step `steps`; rows of later steps are dropped.
    pub(crate) fn go_on(folder: &Path, steps: usize) -> io::Result<Self> {
        StepTable::go_on(&folder.join(INSTRUMENTS), steps).map(|table| Self { table })
    }

    /// Adds the rows of a step.
    pub(crate) fn push(&mut self, step: usize, moves: &[Move], simulation: &Simulation) -> io::Result<()> {
        let (hands, stack) = (simulation.report().hands(), simulation.stack());
        for (index, (instrument, reported)) in stack.instruments().iter().zip(&hands).enumerate() {
            let moved = moves.iter().find(|one| one.instrument == index);
            let command = moved.map(|one| one.command).unwrap_or_default();
            let tip = simulation.tip_of_mm(index);
            let outside = hands[index + 1..].iter().map(|other| other.inserted_mm);
            let felt_mm = (reported.inserted_mm - outside.fold(0.0, f64::max)).max(0.0);
            let lateral = simulation.lateral_forces(index).into_iter().map(|at| at.force_n.norm());
            self.table.push(InstrumentRow {
                step,
                instrument: instrument.name.clone(),
                advance_mm: command.advance_mm,
                rotate_rad: command.rotate_rad,
                inserted_mm: reported.inserted_mm,
                rotation_rad: Some(reported.rotation_rad),
                mouth_rotation_rad: Some(reported.mouth_rotation_rad),
                tip_rotation_rad: Some(reported.tip_rotation_rad),
                steer: Some(reported.steer),
                tip_x_mm: tip.map(|tip| tip.x),
                tip_y_mm: tip.map(|tip| tip.y),
                tip_z_mm: tip.map(|tip| tip.z),
                push_force_n: reported.push_force_n,
                torque_nmm: reported.torque_nmm,
                felt_mm: Some(felt_mm),
                felt_radius_mm: Some(instrument.device.max_radius_within(felt_mm)),
                lateral_n: Some(lateral.fold(0.0, |sum, force_n| sum + force_n)),
            })?;
        }
        Ok(())
    }
}

/// Inserted lengths of the instruments after the steps of a recording.
pub struct Lengths {
    folder: PathBuf,
    /// By step; `None` for a single device, whose length is that of the line: earlier versions did not write its table.
    steps: Option<BTreeMap<usize, Vec<f64>>>,
}

impl Lengths {
    /// Reads the lengths of the instruments of `stack` from the folder of a recording.
    ///
    /// # Errors
    /// [`Error::Content`] for a table that is missing, cannot be read or is of other instruments.
    pub fn read(folder: &Path, stack: &Stack) -> Result<Self> {
        let steps = if stack.is_several() { Some(by_step(&folder.join(INSTRUMENTS), stack)?) } else { None };
        Ok(Self { folder: folder.to_path_buf(), steps })
    }

    /// Inserted lengths after a step that led to this shape, mm.
    ///
    /// # Errors
    /// [`Error::Content`] if the table has no such step.
    pub fn after(&self, step: usize, shape: &Shape) -> Result<Vec<f64>> {
        let Some(steps) = &self.steps else {
            return Ok(vec![shape.from_tip_mm.first().copied().unwrap_or(0.0)]);
        };
        steps.get(&step).cloned().ok_or_else(|| {
            let path = self.folder.join(INSTRUMENTS);
            Error::content(&path, format!("has no step {step}; run the scene again"))
        })
    }
}

/// Inserted lengths of the instruments of `stack` by step, mm.
fn by_step(path: &Path, stack: &Stack) -> Result<BTreeMap<usize, Vec<f64>>> {
    let mut steps: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for row in table::read::<InstrumentRow>(path)? {
        let Ok(index) = stack.find(&row.instrument) else {
            let what = format!(
                "step[{}].instrument = {:?}: is none of the scene: give the scene of the run (--scene)",
                row.step, row.instrument
            );
            return Err(Error::content(path, what));
        };
        steps.entry(row.step).or_insert_with(|| vec![0.0; stack.instruments().len()])[index] =
            row.inserted_mm;
    }
    Ok(steps)
}
