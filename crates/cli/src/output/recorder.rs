//! A run on disk. Every step is there as soon as it is recorded, in steps.csv and in the arrays, and summary.json follows once a second:
//! a run that is killed leaves a recording. At the end, also at an early one, the arrays are packed and the summary is complete.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::insertion::{Command, Energy, StepReport};
use endowire_core::shape::Shape;
use serde::Serialize;

use super::arrays::{self, ShapeArrays};
use super::folder::{self, Claim};
use super::provenance::Provenance;
use super::{SUMMARY, to_json, whole};
use crate::failure::Failure;

/// What `run` tells of a whole insertion: summary.json.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// Where the result comes from.
    #[serde(flatten)]
    pub(crate) provenance: Provenance,
    /// Whether the run has ended, if at a failure, and all of it is written. False while it goes on, and for ever once it is killed:
    /// then the summary is that of a step before.
    pub(crate) complete: bool,
    /// Name of the scene.
    pub(crate) scene: String,
    /// The scene's file, for frames afterwards.
    pub(crate) scene_file: PathBuf,
    /// Name of the method.
    pub(crate) method: &'static str,
    /// Steps carried out.
    pub(crate) steps: usize,
    /// Steps of the script.
    pub(crate) steps_asked: usize,
    /// Whether all steps were carried out and every one met its convergence test.
    pub(crate) converged: bool,
    /// The step that failed and why, if one did.
    pub(crate) failure: Option<StepFailure>,
    /// Length inserted at the end, mm.
    pub(crate) inserted_mm: f64,
    /// Turn of the tail at the end, rad.
    pub(crate) rotation_rad: f64,
    /// Tip at the end, mm.
    pub(crate) tip_mm: Option<[f64; 3]>,
    /// Push force at the end, N.
    pub(crate) push_force_n: f64,
    /// Torque at the end, N·mm.
    pub(crate) torque_nmm: f64,
    /// Energy at the end, mJ.
    pub(crate) energy_mj: Energy,
    /// Deepest penetration of the wall in any step, mm.
    pub(crate) max_penetration_mm: f64,
    /// The opening through which the tip has left the vessel at the end.
    pub(crate) left_through: Option<usize>,
    /// Time of the simulation, s, without recording and frames.
    pub(crate) step_time_s: f64,
    /// Time of the whole run, s.
    pub(crate) wall_time_s: f64,
    /// What drew the frames.
    pub(crate) renderer: Option<String>,
    /// Frames, relative to the folder of this file.
    pub(crate) frames: Vec<String>,
}

/// What ended a run early: no equilibrium, a recording or frame that could not be written, or an interrupt.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct StepFailure {
    /// Number of the step, from 1.
    pub(crate) step: usize,
    /// What was said.
    pub(crate) reason: String,
}

/// One line of steps.csv.
#[derive(Serialize)]
struct Row {
    step: usize,
    advance_mm: f64,
    rotate_rad: f64,
    inserted_mm: f64,
    rotation_rad: f64,
    tip_rotation_rad: f64,
    nodes: usize,
    tip_x_mm: f64,
    tip_y_mm: f64,
    tip_z_mm: f64,
    push_force_n: f64,
    torque_nmm: f64,
    bend_mj: f64,
    twist_mj: f64,
    wall_mj: f64,
    dissipated_mj: f64,
    contacts: usize,
    max_penetration_mm: f64,
    iterations: u32,
    substeps: u32,
    jumped: bool,
    left_through: Option<usize>,
    nodes_solved: u64,
    nodes_frozen: u64,
    angles: bool,
    converged: bool,
}

/// How often a run that goes on writes its summary, and has the disk keep what a power failure would take.
const CHECKPOINT_S: f64 = 1.0;

/// Writes a run into a folder.
pub(crate) struct Recorder {
    folder: PathBuf,
    table: csv::Writer<File>,
    arrays: ShapeArrays,
    steps: usize,
    /// Frames written so far, relative to the folder.
    pub(crate) frames: Vec<String>,
    checkpoint: Option<Instant>,
    _claim: Claim,
}

impl Recorder {
    /// Starts a recording in `folder`, which is made if it is not there; an earlier recording in it is replaced. A folder that holds
    /// other files is refused, or, with `force`, used as it is.
    pub(crate) fn new(folder: &Path, force: bool) -> Result<Self, Failure> {
        let claim = folder::claim(folder, force)?;
        let start = || -> io::Result<_> {
            Ok((File::create(folder.join(folder::TABLE))?, ShapeArrays::new(folder)?))
        };
        let (table, arrays) = start().map_err(|e| Failure::write(folder, &e))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            table: csv::Writer::from_writer(table),
            arrays,
            steps: 0,
            frames: Vec::new(),
            checkpoint: None,
            _claim: claim,
        })
    }

    /// Adds one step; where that fails, the steps before it stay.
    pub(crate) fn record(
        &mut self,
        command: Command,
        report: &StepReport,
        shape: &Shape,
    ) -> Result<(), Failure> {
        let tip = shape.tip_mm().unwrap_or_default();
        let row = Row {
            step: self.steps + 1,
            advance_mm: command.advance_mm,
            rotate_rad: command.rotate_rad,
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            tip_rotation_rad: report.tip_rotation_rad,
            nodes: shape.len(),
            tip_x_mm: tip.x,
            tip_y_mm: tip.y,
            tip_z_mm: tip.z,
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            bend_mj: report.energy.bend,
            twist_mj: report.energy.twist,
            wall_mj: report.energy.wall,
            dissipated_mj: report.dissipated_mj,
            contacts: report.contacts.len(),
            max_penetration_mm: report.max_penetration_mm,
            iterations: report.iterations,
            substeps: report.substeps,
            jumped: report.jumped,
            left_through: report.left_through,
            nodes_solved: report.nodes_solved,
            nodes_frozen: report.nodes_frozen,
            angles: report.angles,
            converged: report.converged,
        };
        // The row comes last: every step of the table is in the arrays.
        let write_row = || {
            self.table.serialize(row)?;
            self.table.flush()
        };
        let pushed = self.arrays.push(shape, report, write_row);
        pushed.map_err(|error| Failure::write(&self.folder, &error))?;
        self.steps += 1;
        Ok(())
    }

    /// Now and then, writes the summary as it is: what a run that is killed leaves.
    pub(crate) fn checkpoint(&mut self, summary: impl FnOnce(&Self) -> Summary) -> Result<(), Failure> {
        if self.checkpoint.is_some_and(|last| last.elapsed().as_secs_f64() < CHECKPOINT_S) {
            return Ok(());
        }
        let sync = || self.arrays.sync().and_then(|()| self.table.get_ref().sync_data());
        sync().map_err(|e| Failure::write(&self.folder, &e))?;
        write_summary(&self.folder, &summary(self))?;
        self.checkpoint = Some(Instant::now());
        Ok(())
    }

    /// Writes a frame of the current step with `write`, and notes it for the summary.
    pub(crate) fn frame(
        &mut self,
        view: &str,
        write: impl FnOnce(&Path) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let folder = self.folder.join("frames");
        std::fs::create_dir_all(&folder).map_err(|e| Failure::write(&folder, &e))?;
        let name = folder::frame_name(self.steps, view);
        let path = folder.join(&name);
        let part = whole::unfinished(&path);
        write(&part)?;
        std::fs::rename(&part, &path).map_err(|e| Failure::write(&path, &e))?;
        self.frames.push(format!("frames/{name}"));
        Ok(())
    }

    /// Steps recorded so far.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Packs shapes.npz and writes summary.json; the second also where the first cannot be written.
    pub(crate) fn finish(self, summary: &mut Summary) -> Result<(), Failure> {
        // The claim ends with this function, when all is written.
        let Self { folder, arrays, _claim, .. } = self;
        let packed = arrays.pack(&folder).map_err(|e| Failure::write(&folder.join(arrays::PACKED), &e));
        summary.complete = packed.is_ok();
        write_summary(&folder, summary)?;
        packed
    }
}

fn write_summary(folder: &Path, summary: &Summary) -> Result<(), Failure> {
    let path = folder.join(SUMMARY);
    whole::write_text(&path, &(to_json(summary)? + "\n")).map_err(|e| Failure::write(&path, &e))
}
