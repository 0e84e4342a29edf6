//! State of each instrument, step by step: instruments.csv, beside steps.csv.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use endowire_core::device::Stack;
use endowire_core::insertion::{Move, Simulation};
use endowire_core::shape::Shape;
use serde::{Deserialize, Serialize};

use super::step_table::StepTable;
use crate::failure::Failure;

/// The table.
pub(crate) const INSTRUMENTS: &str = "instruments.csv";

/// A row of the table.
#[derive(Debug, Serialize, Deserialize)]
struct Row {
    step: usize,
    instrument: String,
    advance_mm: f64,
    rotate_rad: f64,
    inserted_mm: f64,
    rotation_rad: f64,
    #[serde(default)]
    mouth_rotation_rad: f64,
    tip_rotation_rad: f64,
    tip_x_mm: Option<f64>,
    tip_y_mm: Option<f64>,
    tip_z_mm: Option<f64>,
    push_force_n: Option<f64>,
    torque_nmm: f64,
    /// Length beyond the enclosing instruments, where it touches the wall itself.
    felt_mm: f64,
    /// Its largest radius there.
    felt_radius_mm: f64,
    /// Sum of the forces across the line between it and the instruments around and inside it.
    #[serde(default)]
    lateral_n: f64,
}

/// Writes the table of a run.
pub(crate) struct InstrumentTable {
    table: StepTable,
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
            self.table.push(Row {
                step,
                instrument: instrument.name.clone(),
                advance_mm: command.advance_mm,
                rotate_rad: command.rotate_rad,
                inserted_mm: reported.inserted_mm,
                rotation_rad: reported.rotation_rad,
                mouth_rotation_rad: reported.mouth_rotation_rad,
                tip_rotation_rad: reported.tip_rotation_rad,
                tip_x_mm: tip.map(|tip| tip.x),
                tip_y_mm: tip.map(|tip| tip.y),
                tip_z_mm: tip.map(|tip| tip.z),
                push_force_n: reported.push_force_n,
                torque_nmm: reported.torque_nmm,
                felt_mm,
                felt_radius_mm: instrument.device.max_radius_within(felt_mm),
                lateral_n: lateral.fold(0.0, |sum, force_n| sum + force_n),
            })?;
        }
        self.table.flush()
    }

    /// Syncs all rows to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.table.sync()
    }
}

/// Inserted lengths of the instruments after the steps of a recording.
pub(crate) struct Lengths {
    folder: PathBuf,
    /// By step; `None` for a single device, whose length is that of the line: earlier versions did not write its table.
    steps: Option<BTreeMap<usize, Vec<f64>>>,
}

impl Lengths {
    /// Reads the lengths of the instruments of `stack` from the folder of a recording.
    pub(crate) fn read(folder: &Path, stack: &Stack) -> Result<Self, Failure> {
        let steps = if stack.is_several() {
            let path = folder.join(INSTRUMENTS);
            let read = by_step(&path, stack);
            Some(read.map_err(|error| {
                let text = "give the folder of a run of this scene (endowire run)";
                Failure::Input(format!("{}: {error}; {text}", path.display()))
            })?)
        } else {
            None
        };
        Ok(Self { folder: folder.to_path_buf(), steps })
    }

    /// Inserted lengths after a step that led to this shape, mm.
    pub(crate) fn after(&self, step: usize, shape: &Shape) -> Result<Vec<f64>, Failure> {
        let Some(steps) = &self.steps else {
            return Ok(vec![shape.from_tip_mm.first().copied().unwrap_or(0.0)]);
        };
        steps.get(&step).cloned().ok_or_else(|| {
            let path = self.folder.join(INSTRUMENTS);
            Failure::Input(format!("{}: has no step {step}; run the scene again", path.display()))
        })
    }
}

/// Inserted lengths of the instruments of `stack` by step, mm.
fn by_step(path: &Path, stack: &Stack) -> io::Result<BTreeMap<usize, Vec<f64>>> {
    let mut text = std::fs::read(path)?;
    // A killed run may leave an incomplete row.
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let mut steps: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for row in csv::Reader::from_reader(text.as_slice()).deserialize() {
        let row: Row = row?;
        let Ok(index) = stack.find(&row.instrument) else { continue };
        steps.entry(row.step).or_insert_with(|| vec![0.0; stack.instruments().len()])[index] =
            row.inserted_mm;
    }
    Ok(steps)
}
