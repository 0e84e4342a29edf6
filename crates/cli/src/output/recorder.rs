//! Records a run on disk. Each step is written as soon as it is recorded, to steps.csv and to the arrays;
//! summary.json is updated once a second. A run that is killed thus leaves a valid recording. At the end, also an
//! early one, the arrays are packed and the summary is completed.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::insertion::{DetachedCoil, Move, Simulation};
use endowire_core::vessel::Sac;
use endowire_sweep::RunOutcome;
use serde::Serialize;

use super::arrays::{self, ShapeArrays};
use super::coils::CoilTable;
use super::folder::{self, Claim};
use super::frames::PlaneTold;
use super::instruments::InstrumentTable;
use super::packing::{Packed, PackingTable};
use super::provenance::Provenance;
use super::recording::{RecordedSummary, Recording};
use super::vessel::VesselTables;
use super::{SUMMARY, to_json, whole};
use crate::failure::Failure;

/// The results of a whole insertion by `run`: summary.json.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// Provenance.
    #[serde(flatten)]
    pub(crate) provenance: Provenance,
    /// Whether the run has ended, successfully or not, and everything is written. False while it is running, and if
    /// it was killed; the summary is then that of an earlier step.
    pub(crate) complete: bool,
    /// Name of the scene.
    pub(crate) scene: String,
    /// File of the scene, for drawing frames later.
    #[serde(serialize_with = "super::path_text")]
    pub(crate) scene_file: PathBuf,
    /// File of its script, if that is not the scene's own.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "super::path_text_if_any")]
    pub(crate) script_file: Option<PathBuf>,
    /// Name of the method.
    pub(crate) method: &'static str,
    /// Whether the vessel's centre line was needed and, since the scene names none, was extracted from its surface.
    pub(crate) centreline_found: bool,
    /// Position of the foremost tip before the first step, mm: in the sheath's mouth if nothing is inserted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) start_mm: Option<Vec3>,
    /// Outcome of the run.
    #[serde(flatten)]
    pub(crate) outcome: RunOutcome,
    /// Packing of the scene's sac, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) packing: Option<Packed>,
    /// Time of the simulation, s, without recording and frames.
    pub(crate) step_time_s: f64,
    /// Time of the whole run, s.
    pub(crate) wall_time_s: f64,
    /// Backend that drew the frames.
    pub(crate) renderer: Option<String>,
    /// Planes of fluoroscopy.
    pub(crate) planes: Vec<PlaneTold>,
    /// Paths of the frames, relative to the folder of this file.
    pub(crate) frames: Vec<String>,
    /// File name of the film.
    pub(crate) film: Option<String>,
}

/// A row of steps.csv.
#[derive(Serialize)]
struct Row {
    step: usize,
    advance_mm: f64,
    rotate_rad: f64,
    inserted_mm: f64,
    rotation_rad: f64,
    mouth_rotation_rad: f64,
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
    field_mj: f64,
    tail_mj: f64,
    vessel_mj: f64,
    dissipated_mj: f64,
    contacts: usize,
    max_penetration_mm: f64,
    largest_bend_rad: f64,
    iterations: u32,
    substeps: u32,
    jumped: bool,
    left_through: Option<usize>,
    nodes_solved: u64,
    angles: bool,
    converged: bool,
    relaxations: u32,
    imbalance: f64,
    released_mj: f64,
    wall_force_sum_n: f64,
    wall_force_largest_n: f64,
    wall_force_tip_n: f64,
    drag_n: f64,
    /// Bound of the displacement of a vessel that yields.
    vessel_displacement_mm: f64,
    time_s: f64,
}

/// Interval at which a running recording writes its summary and syncs to disk, s.
const CHECKPOINT_S: f64 = 1.0;

/// Writes a run into a folder.
pub(crate) struct Recorder {
    folder: PathBuf,
    table: csv::Writer<File>,
    instruments: InstrumentTable,
    packing: Option<PackingTable>,
    arrays: ShapeArrays,
    steps: usize,
    /// Where the way of the tip begins, if that is known.
    pub(crate) start_mm: Option<Vec3>,
    coils: CoilTable,
    vessel: Option<VesselTables>,
    /// Frames so far, relative to the folder.
    pub(crate) frames: Vec<String>,
    checkpoint: Option<Instant>,
    _claim: Claim,
}

impl Recorder {
    /// Starts a recording of a simulation as it is in `folder`, which is created if necessary; an earlier recording in it
    /// is replaced. A folder with other files is refused, unless `force` is set.
    pub(crate) fn new(folder: &Path, force: bool, at: &Simulation) -> Result<Self, Failure> {
        let claim = folder::claim(folder, force)?;
        let start = || -> io::Result<_> {
            let table = File::create(folder.join(folder::TABLE))?;
            let vessel = VesselTables::go_on(folder, 0, at)?;
            Ok((table, InstrumentTable::new(folder)?, ShapeArrays::new(folder)?, vessel))
        };
        let (table, instruments, arrays, vessel) = start().map_err(|e| Failure::write(folder, &e))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            table: csv::Writer::from_writer(table),
            instruments,
            packing: None,
            arrays,
            steps: 0,
            start_mm: Some(endowire_assess::start_mm(at)),
            coils: CoilTable::new(folder),
            vessel,
            frames: Vec::new(),
            checkpoint: None,
            _claim: claim,
        })
    }

    /// Resumes the recording in `folder` after step `steps`, the current step of the simulation; later steps are
    /// dropped. Returns the steps that remain. If nothing has been recorded, the recording begins with the next step.
    pub(crate) fn go_on(
        folder: &Path,
        force: bool,
        steps: usize,
        at: &Simulation,
    ) -> Result<(Self, Option<Recording>), Failure> {
        if !folder::is_recording(folder) {
            let mut recorder = Self::new(folder, force, at)?;
            recorder.steps = steps;
            return Ok((recorder, None));
        }
        let claim = folder::claim_again(folder)?;
        let table_path = folder.join(folder::TABLE);
        let rows = std::fs::read(&table_path).map_err(|e| Failure::write(&table_path, &e))?;
        let kept = Kept::of(&rows, steps);
        let refuse = |what: String| {
            Failure::Input(format!(
                "--out {}: {what}: give the folder that the state was saved beside, or a new one for the steps to come",
                folder.display()
            ))
        };
        let Some(kept) = kept else {
            return Err(refuse(format!(
                "step {steps}, after which the state was saved, is not recorded there"
            )));
        };
        let recording = if kept.rows > 0 { Some(Recording::read_arrays(folder, kept.rows)?) } else { None };
        if recording.as_ref().is_some_and(|recording| recording.shape(kept.rows) != *at.shape()) {
            return Err(refuse(format!(
                "step {steps} is recorded there with another shape than that of the state"
            )));
        }
        let start = || -> io::Result<_> {
            let arrays = match recording {
                Some(_) => ShapeArrays::go_on(folder, kept.rows)?,
                None => ShapeArrays::anew(folder)?,
            };
            let table = OpenOptions::new().append(true).open(&table_path)?;
            table.set_len(kept.bytes)?;
            folder::remove_frames(folder)?;
            let vessel = VesselTables::go_on(folder, steps, at)?;
            Ok((table, InstrumentTable::go_on(folder, steps)?, arrays, vessel))
        };
        let (table, instruments, arrays, vessel) = start().map_err(|e| Failure::write(folder, &e))?;
        let start_mm = match recording {
            Some(_) => RecordedSummary::read(&folder.join(SUMMARY)).ok().and_then(|summary| summary.start_mm),
            None => Some(endowire_assess::start_mm(at)),
        };
        let coils = CoilTable::go_on(folder, at.stack(), steps)?;
        let table = csv::WriterBuilder::new().has_headers(kept.bytes == 0).from_writer(table);
        let recorder = Self {
            folder: folder.to_path_buf(),
            table,
            instruments,
            packing: None,
            arrays,
            steps,
            start_mm,
            coils,
            vessel,
            frames: Vec::new(),
            checkpoint: None,
            _claim: claim,
        };
        Ok((recorder, recording))
    }

    /// Also records the packing of the scene's sac, if it has one, from the next step on.
    pub(crate) fn pack(&mut self, sac: Option<Sac>, simulation: &Simulation) -> Result<(), Failure> {
        let table = |sac| PackingTable::go_on(&self.folder, sac, self.steps, simulation);
        self.packing = sac.map(table).transpose()?;
        Ok(())
    }

    /// Records one step, which ends at `time_s`; if that fails, earlier steps are kept.
    pub(crate) fn record(
        &mut self,
        moves: &[Move],
        time_s: f64,
        simulation: &Simulation,
    ) -> Result<(), Failure> {
        let (report, shape) = (simulation.report(), simulation.shape());
        let command = moves.first().map(|one| one.command).unwrap_or_default();
        let tip = shape.tip_mm().unwrap_or_default();
        let force = simulation.wall_force();
        let row = Row {
            step: self.steps + 1,
            advance_mm: command.advance_mm,
            rotate_rad: command.rotate_rad,
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            mouth_rotation_rad: report.mouth_rotation_rad,
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
            field_mj: report.energy.field,
            tail_mj: report.energy.tail,
            vessel_mj: report.energy.vessel,
            dissipated_mj: report.dissipated_mj,
            contacts: report.contacts.len(),
            max_penetration_mm: report.max_penetration_mm,
            largest_bend_rad: report.largest_bend_rad,
            iterations: report.iterations,
            substeps: report.substeps,
            jumped: report.jumped,
            left_through: report.left_through,
            nodes_solved: report.nodes_solved,
            angles: report.angles,
            converged: !report.has_failed(),
            relaxations: report.relaxations,
            imbalance: report.imbalance,
            released_mj: report.jump.map_or(0.0, |jump| jump.released_mj),
            wall_force_sum_n: force.sum_n,
            wall_force_largest_n: force.largest_n,
            wall_force_tip_n: force.tip_n,
            drag_n: report.drag_n.norm(),
            vessel_displacement_mm: simulation.yielded_mm(),
            time_s,
        };
        // Written last, so that every step of the table is also in the arrays.
        let write_row = || {
            self.instruments.push(row.step, moves, simulation)?;
            if let Some(packing) = &mut self.packing {
                packing.push(row.step, simulation)?;
            }
            self.coils.push(row.step, simulation)?;
            if let Some(vessel) = &mut self.vessel {
                vessel.push(row.step, simulation)?;
            }
            self.table.serialize(row)?;
            self.table.flush()
        };
        let pushed = self.arrays.push(shape, report, write_row);
        pushed.map_err(|error| Failure::write(&self.folder, &error))?;
        self.steps += 1;
        Ok(())
    }

    /// Packing of the scene's sac, if it has one.
    pub(crate) fn packed(&self) -> Option<Packed> {
        self.packing.as_ref().map(PackingTable::reported)
    }

    /// Detached coils after the last step.
    pub(crate) fn coils(&self) -> &[DetachedCoil] {
        self.coils.reported()
    }

    /// Writes the current summary at intervals, in case the run is killed.
    pub(crate) fn checkpoint(&mut self, summary: impl FnOnce(&Self) -> Summary) -> Result<(), Failure> {
        if self.checkpoint.is_some_and(|last| last.elapsed().as_secs_f64() < CHECKPOINT_S) {
            return Ok(());
        }
        self.sync()?;
        self.check_there()?;
        write_summary(&self.folder, &summary(self))?;
        self.checkpoint = Some(Instant::now());
        Ok(())
    }

    /// Syncs all steps to disk.
    pub(crate) fn sync(&self) -> Result<(), Failure> {
        let packing = || self.packing.as_ref().map_or(Ok(()), PackingTable::sync);
        let synced = self.arrays.sync().and_then(|()| self.instruments.sync()).and_then(|()| packing());
        let synced = synced.and_then(|()| self.coils.sync());
        let vessel = || self.vessel.as_ref().map_or(Ok(()), VesselTables::sync);
        let synced = synced.and_then(|()| vessel());
        let synced = synced.and_then(|()| self.table.get_ref().sync_data());
        synced.map_err(|e| Failure::write(&self.folder, &e))
    }

    /// Fails if the table of steps was removed or replaced: an open file still accepts writes after it has been
    /// deleted.
    fn check_there(&self) -> Result<(), Failure> {
        let path = self.folder.join(folder::TABLE);
        let own = self.table.get_ref().metadata().map(|own| own.len());
        match (own, path.metadata()) {
            (Ok(own), Ok(there)) if there.len() == own => Ok(()),
            _ => Err(Failure::Computation(format!(
                "{}: was removed or replaced while the run went on, and steps with it; run the scene again",
                path.display()
            ))),
        }
    }

    /// Writes a frame of a step with `write`, and lists it in the summary.
    pub(crate) fn frame(
        &mut self,
        step: usize,
        view: &str,
        write: impl FnOnce(&Path) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let folder = self.folder.join("frames");
        // The folder of the recording is not created again: if it has vanished, so have the earlier steps.
        match std::fs::create_dir(&folder) {
            Err(e) if e.kind() != io::ErrorKind::AlreadyExists => return Err(Failure::write(&folder, &e)),
            _ => {}
        }
        let name = folder::frame_name(step, view);
        let path = folder.join(&name);
        whole::write_at(&path, write).map_err(|e| Failure::write(&path, &e))?;
        self.frames.push(format!("frames/{name}"));
        Ok(())
    }

    /// Folder of the recording.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Number of steps recorded so far.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Packs shapes.npz and writes summary.json; the latter even if the former fails.
    pub(crate) fn finish(self, summary: &mut Summary) -> Result<(), Failure> {
        self.check_there()?;
        // The lock is released at the end of this function, when everything is written.
        let Self { folder, arrays, _claim, .. } = self;
        let packed = arrays.pack(&folder).map_err(|e| Failure::write(&folder.join(arrays::PACKED), &e));
        summary.complete = packed.is_ok();
        write_summary(&folder, summary)?;
        packed
    }
}

/// The first part of a table of steps.
#[derive(Debug, PartialEq, Eq)]
struct Kept {
    rows: usize,
    bytes: u64,
}

impl Kept {
    /// The part up to and including step `steps`; `None` if that step was not recorded.
    fn of(table: &[u8], steps: usize) -> Option<Self> {
        let mut bytes = 0;
        let mut rows = 0;
        for (index, line) in table.split_inclusive(|byte| *byte == b'\n').enumerate() {
            let whole = line.ends_with(b"\n");
            let number = || std::str::from_utf8(line).ok()?.split(',').next()?.parse::<usize>().ok();
            match (index, whole) {
                (_, false) => break,
                (0, _) => {}
                _ => {
                    let step = number()?;
                    if step > steps {
                        // The recording began at the step of the saved state.
                        return (step == steps + 1).then_some(Self { rows, bytes });
                    }
                    rows += 1;
                    if step == steps {
                        return Some(Self { rows, bytes: bytes + line.len() as u64 });
                    }
                }
            }
            bytes += line.len() as u64;
        }
        (steps == 0).then_some(Self { rows, bytes })
    }
}

fn write_summary(folder: &Path, summary: &Summary) -> Result<(), Failure> {
    let path = folder.join(SUMMARY);
    whole::write_bytes(&path, (to_json(summary)? + "\n").as_bytes()).map_err(|e| Failure::write(&path, &e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_kept_up_to_the_step_of_the_state() {
        let whole = "step,advance_mm\n1,2.0\n2,2.0\n3,2.0\n";
        let kept = |table: &str, steps: usize| Kept::of(table.as_bytes(), steps).map(|k| (k.rows, k.bytes));
        assert_eq!(kept(whole, 0), Some((0, 16)));
        assert_eq!(kept(whole, 2), Some((2, 28)));
        assert_eq!(kept(whole, 3), Some((3, 34)));
        assert_eq!(kept(whole, 4), None);
        // Killed within a row, within the header, and before it.
        assert_eq!(kept(&whole[..32], 2), Some((2, 28)));
        assert_eq!(kept(&whole[..32], 3), None);
        assert_eq!(kept(&whole[..9], 0), Some((0, 0)));
        assert_eq!(kept("", 0), Some((0, 0)));
        assert_eq!(kept("", 1), None);
        // A recording that began after step 7.
        let later = "step,advance_mm\n8,2.0\n9,2.0\n";
        assert_eq!((kept(later, 7), kept(later, 8)), (Some((0, 16)), Some((1, 22))));
        assert_eq!((kept(later, 6), kept(later, 0), kept("step\nx\n", 1)), (None, None, None));
    }
}
