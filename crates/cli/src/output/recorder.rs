//! A run on disk: steps.csv line by line, shapes.npz and summary.json at the end — also at an early one.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use endowire_core::insertion::{Command, Energy, StepReport};
use endowire_core::shape::Shape;
use serde::Serialize;

use super::npz::{self, ArrayStream, Kind};
use super::provenance::Provenance;
use super::to_json;
use crate::failure::Failure;

/// What `run` tells of a whole insertion: summary.json.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// Where the result comes from.
    #[serde(flatten)]
    pub(crate) provenance: Provenance,
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
    queries: u64,
    queries_avoided: u64,
    nodes_solved: u64,
    nodes_frozen: u64,
    angles: bool,
    converged: bool,
}

/// Writes a run into a folder.
pub(crate) struct Recorder {
    folder: PathBuf,
    table: csv::Writer<File>,
    positions: ArrayStream,
    tangents: ArrayStream,
    from_tip: ArrayStream,
    offsets: ArrayStream,
    contact_points: ArrayStream,
    contact_forces: ArrayStream,
    contact_offsets: ArrayStream,
    contacts: i64,
    nodes: i64,
    steps: usize,
    /// Frames written so far, relative to the folder.
    pub(crate) frames: Vec<String>,
}

impl Recorder {
    /// Starts a recording in `folder`, which is made if it is not there; an earlier recording in it is replaced. A folder that holds
    /// other files is refused.
    pub(crate) fn new(folder: &Path) -> Result<Self, Failure> {
        check_free(folder)?;
        let table = || -> io::Result<_> {
            std::fs::create_dir_all(folder)?;
            remove_earlier(folder)?;
            File::create(folder.join("steps.csv"))
        };
        let table = csv::Writer::from_writer(table().map_err(|e| Failure::write(folder, &e))?);
        let array = |name, kind, columns| {
            ArrayStream::new(name, kind, columns).map_err(|error| {
                let place = std::env::temp_dir();
                Failure::Input(format!(
                    "cannot write temporary files in {}: {error} (TMPDIR names another folder)",
                    place.display()
                ))
            })
        };
        let mut offsets = array("offsets", Kind::I64, 1)?;
        offsets.push_i64(0).map_err(|e| Failure::write(folder, &e))?;
        let mut contact_offsets = array("contact_offsets", Kind::I64, 1)?;
        contact_offsets.push_i64(0).map_err(|e| Failure::write(folder, &e))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            table,
            positions: array("positions_mm", Kind::F64, 3)?,
            tangents: array("tangents", Kind::F64, 3)?,
            from_tip: array("from_tip_mm", Kind::F64, 1)?,
            offsets,
            contact_points: array("contact_positions_mm", Kind::F64, 3)?,
            contact_forces: array("contact_forces_n", Kind::F64, 3)?,
            contact_offsets,
            contacts: 0,
            nodes: 0,
            steps: 0,
            frames: Vec::new(),
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
            queries: report.counters.queries,
            queries_avoided: report.counters.near + report.counters.avoided,
            nodes_solved: report.counters.nodes_solved,
            nodes_frozen: report.counters.nodes_frozen,
            angles: report.angles,
            converged: report.converged,
        };
        let whole = self.arrays().map(|array| array.len());
        let write = || -> io::Result<()> {
            self.table.serialize(row)?;
            self.table.flush()?;
            self.positions.push_f64(shape.positions_mm.iter().flat_map(|x| [x.x, x.y, x.z]))?;
            self.tangents.push_f64(shape.tangents.iter().flat_map(|t| [t.x, t.y, t.z]))?;
            self.from_tip.push_f64(shape.from_tip_mm.iter().copied())?;
            let contacts = &report.contacts;
            self.contact_points.push_f64(contacts.iter().flat_map(|c| <[f64; 3]>::from(c.position_mm)))?;
            self.contact_forces.push_f64(contacts.iter().flat_map(|c| <[f64; 3]>::from(c.total_n())))?;
            self.contact_offsets.push_i64(self.contacts + contacts.len() as i64)?;
            self.offsets.push_i64(self.nodes + shape.len() as i64)
        };
        match write() {
            Ok(()) => {
                self.steps += 1;
                self.nodes += shape.len() as i64;
                self.contacts += report.contacts.len() as i64;
                Ok(())
            }
            Err(error) => {
                self.arrays().into_iter().zip(whole).for_each(|(array, numbers)| array.truncate(numbers));
                Err(Failure::write(&self.folder, &error))
            }
        }
    }

    fn arrays(&mut self) -> [&mut ArrayStream; 7] {
        [
            &mut self.positions,
            &mut self.tangents,
            &mut self.from_tip,
            &mut self.offsets,
            &mut self.contact_points,
            &mut self.contact_forces,
            &mut self.contact_offsets,
        ]
    }

    /// Writes a frame of the current step with `write`, and notes it for the summary.
    pub(crate) fn frame(
        &mut self,
        view: &str,
        write: impl FnOnce(&Path) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let folder = self.folder.join("frames");
        std::fs::create_dir_all(&folder).map_err(|e| Failure::write(&folder, &e))?;
        let name = format!("step_{:06}_{view}.png", self.steps);
        write(&folder.join(&name))?;
        self.frames.push(format!("frames/{name}"));
        Ok(())
    }

    /// Steps recorded so far.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Writes shapes.npz and summary.json; the second also where the first cannot be written.
    pub(crate) fn finish(self, summary: &Summary) -> Result<(), Failure> {
        let folder = &self.folder;
        let arrays = vec![
            self.positions,
            self.tangents,
            self.from_tip,
            self.offsets,
            self.contact_points,
            self.contact_forces,
            self.contact_offsets,
        ];
        let shapes = npz::write(&folder.join("shapes.npz"), arrays)
            .map_err(|e| Failure::write(&folder.join("shapes.npz"), &e));
        let path = folder.join("summary.json");
        std::fs::write(&path, to_json(summary)? + "\n").map_err(|e| Failure::write(&path, &e))?;
        shapes
    }
}

/// How the table of steps begins.
const TABLE_BEGINS: &[u8] = b"step,advance_mm,rotate_rad,";

/// Refuses a folder with files in it that no recording has left there: some could have the names of those to be written.
fn check_free(folder: &Path) -> Result<(), Failure> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let first = entries.flatten().map(|entry| entry.file_name()).min();
    // A recording that was ended at once has an empty table.
    let begins = File::open(folder.join("steps.csv")).and_then(|file| {
        let mut begins = Vec::new();
        file.take(TABLE_BEGINS.len() as u64).read_to_end(&mut begins).map(|_| begins)
    });
    let ours = begins.is_ok_and(|begins| begins.is_empty() || begins == TABLE_BEGINS);
    match first {
        Some(name) if !ours => Err(Failure::Input(format!(
            "--out {}: the folder is no earlier recording, and a recording would mix with its files ({} …): give a new or an \
             empty folder, such as {}",
            folder.display(),
            Path::new(&name).display(),
            folder.join("recording").display()
        ))),
        _ => Ok(()),
    }
}

/// Removes what an earlier recording left, and nothing else.
fn remove_earlier(folder: &Path) -> io::Result<()> {
    for name in ["summary.json", "steps.csv", "shapes.npz"] {
        match std::fs::remove_file(folder.join(name)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    let Ok(frames) = std::fs::read_dir(folder.join("frames")) else { return Ok(()) };
    for entry in frames {
        let path = entry?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if name.starts_with("step_") && name.ends_with(".png") {
            std::fs::remove_file(path)?;
        }
    }
    Ok(())
}
