//! Records a run on disk. Each step is written as soon as it is recorded, to steps.csv and to the arrays;
//! summary.json is updated once a second. A run that is killed thus leaves a valid recording. At the end, also an
//! early one, the arrays are packed and the summary is completed.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::insertion::{DetachedCoil, Move, Simulation, Tally};
use endowire_core::vessel::Sac;
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

use crate::arrays::{SHAPES, ShapeArrays};
use crate::folder::{self, Among, Claim, FRAMES, Replaced};
use crate::next::{Reached, check_step};
use crate::outcome::{EndedBy, RunOutcome};
use crate::packing::Packed;
use crate::provenance::Provenance;
use crate::recording::Recording;
use crate::steps::{STEPS, StepRow};
use crate::summary::{About, Summary};
use crate::table::step_of;
use crate::tables::Tables;

/// Position of the foremost tip, in the sheath's mouth if nothing is inserted: where its way begins, mm.
pub fn start_mm(simulation: &Simulation) -> Vec3 {
    simulation.shape().tip_mm().unwrap_or(simulation.sheath().position_mm)
}

/// Interval at which a running recording writes its summary and syncs to disk, s.
const CHECKPOINT_S: f64 = 1.0;

/// Writes a run into a folder, step by step. The folder is locked until it is dropped.
pub struct Recorder {
    folder: PathBuf,
    tables: Tables,
    arrays: ShapeArrays,
    steps: usize,
    /// Of the steps that this recorder has recorded.
    tally: Tally,
    /// End of the last step, s.
    last_s: f64,
    reached: Reached,
    start_mm: Option<Vec3>,
    frames: Vec<String>,
    checkpoint: Option<Instant>,
    _claim: Claim,
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder")
            .field("folder", &self.folder)
            .field("steps", &self.steps)
            .finish_non_exhaustive()
    }
}

impl Recorder {
    /// Starts a recording of a simulation as it is in `folder`, which is created if necessary; an earlier recording in it
    /// is replaced.
    ///
    /// # Errors
    /// [`Error::Content`] for a folder of other files, and one into which another program records; [`Error::File`] for
    /// what cannot be written.
    pub fn new(folder: &Path, at: &Simulation) -> Result<Self> {
        Self::among(folder, Among::Nothing, at).map(|(recorder, _)| recorder)
    }

    /// As [`Self::new`], in a folder with other files if `among` says so; also tells what was replaced.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn among(folder: &Path, among: Among, at: &Simulation) -> Result<(Self, Replaced)> {
        let (claim, replaced) = folder::claim(folder, among)?;
        let start = || -> io::Result<_> { Ok((Tables::new(folder, at)?, ShapeArrays::new(folder)?)) };
        let (tables, arrays) = start().map_err(|e| Error::file(folder, e))?;
        let recorder = Self {
            folder: folder.to_path_buf(),
            tables,
            arrays,
            steps: 0,
            tally: Tally::default(),
            last_s: 0.0,
            reached: Reached::of(at),
            start_mm: Some(start_mm(at)),
            frames: Vec::new(),
            checkpoint: None,
            _claim: claim,
        };
        Ok((recorder, replaced))
    }

    /// Resumes the recording in `folder` after step `steps`, the current step of the simulation; later steps are
    /// dropped. Returns the steps that remain. If nothing has been recorded, the recording begins with the next step.
    ///
    /// # Errors
    /// As [`Self::new`], and a recording that has not this step, or has it with another shape.
    pub fn go_on(
        folder: &Path,
        among: Among,
        steps: usize,
        at: &Simulation,
    ) -> Result<(Self, Option<Recording>)> {
        if !folder::is_recording(folder) {
            let (mut recorder, _) = Self::among(folder, among, at)?;
            recorder.steps = steps;
            return Ok((recorder, None));
        }
        let claim = folder::claim_again(folder)?;
        let table_path = folder.join(STEPS);
        let rows = std::fs::read(&table_path).map_err(|e| Error::file(&table_path, e))?;
        let kept = Kept::of(&rows, steps);
        let refuse = |what: String| {
            let remedy =
                "give the folder that the state was saved beside, or a new one for the steps to come";
            Error::content(folder, format!("{what}: {remedy}"))
        };
        let Some(kept) = kept else {
            return Err(refuse(format!(
                "step {steps}, after which the state was saved, is not recorded there with all steps before it"
            )));
        };
        let recording = if kept.rows > 0 { Some(Recording::read_first(folder, kept.rows)?) } else { None };
        if recording.as_ref().is_some_and(|recording| recording.shape(kept.rows) != *at.shape()) {
            return Err(refuse(format!(
                "step {steps} is recorded there with another shape than that of the state"
            )));
        }
        let start_mm = match recording {
            Some(_) => About::read(folder).ok().and_then(|about| about.start_mm),
            None => Some(start_mm(at)),
        };
        let last_s = recording.as_ref().and_then(|recording| recording.rows().last()?.time_s);
        // First, so that a kill in between leaves the recording of a run that was killed.
        About::reopen(folder, steps)?;
        let start = || -> io::Result<_> {
            let arrays = match recording {
                Some(_) => ShapeArrays::go_on(folder, kept.rows)?,
                None => ShapeArrays::anew(folder)?,
            };
            folder::remove_frames(folder)?;
            Ok(arrays)
        };
        let arrays = start().map_err(|e| Error::file(folder, e))?;
        let tables = Tables::go_on(folder, (steps, kept.bytes), at)?;
        let recorder = Self {
            folder: folder.to_path_buf(),
            tables,
            arrays,
            steps,
            tally: Tally::default(),
            last_s: last_s.unwrap_or_default(),
            reached: Reached::of(at),
            start_mm,
            frames: Vec::new(),
            checkpoint: None,
            _claim: claim,
        };
        Ok((recorder, recording))
    }

    /// Also records the packing of a sac, if there is one, from the next step on.
    ///
    /// # Errors
    /// A table that cannot be written, and a sac that does not belong to the simulation.
    pub fn pack(&mut self, sac: Option<Sac>, simulation: &Simulation) -> Result<()> {
        self.tables.pack(&self.folder, sac, self.steps, simulation)
    }

    /// Records the step that the simulation has just carried out with these moves, which ends at `time_s`; if that
    /// fails, earlier steps are kept.
    ///
    /// # Errors
    /// [`Error::File`] for what cannot be written, [`Error::Parameter`] for a time before that of the last step and numbers that
    /// are not finite, [`Error::Content`] for a step that is not the next one of the same simulation: of another vessel or other
    /// instruments, recorded already, or after steps that were not recorded.
    pub fn record(&mut self, moves: &[Move], time_s: f64, simulation: &Simulation) -> Result<()> {
        let step = self.steps + 1;
        check_step(moves, time_s, self.last_s)?;
        if let Some(what) = self.reached.not_next(moves, simulation) {
            let text = format!(
                "step {step} is not the next one of the simulation that is recorded: {what}: record each step once, right after it, with its moves"
            );
            return Err(Error::content(&self.folder, text));
        }
        let row = StepRow::of(step, moves, time_s, simulation);
        // Split, because the arrays keep a step only if everything else of it is written.
        let Self { arrays, tables, .. } = self;
        let write_rows = || tables.write(row, moves, simulation);
        let pushed = arrays.push(simulation.shape(), simulation.report(), write_rows);
        if let Err(error) = pushed {
            tables.take_back();
            return Err(Error::file(&self.folder, error));
        }
        tables.keep();
        self.steps += 1;
        (self.last_s, self.reached) = (time_s, Reached::of(simulation));
        self.tally.count(self.steps, simulation);
        Ok(())
    }

    /// Packing of the scene's sac, if it has one.
    pub fn packed(&self) -> Option<Packed> {
        self.tables.packed()
    }

    /// Detached coils after the last step.
    pub fn coils(&self) -> &[DetachedCoil] {
        self.tables.coils()
    }

    /// The summary so far of a program that moves the simulation by itself. Where that is of a scene, add name and file.
    pub fn summary(&self, provenance: &Provenance, simulation: &Simulation) -> Summary {
        let outcome = RunOutcome::of_program(simulation, self.steps, self.tally);
        let summary = Summary::of_program(provenance.clone(), self.start_mm, outcome, simulation);
        Summary { packing: self.packed(), frames: self.frames.clone(), ..summary }
    }

    /// Where the way of the tip begins, mm, if that is known.
    pub fn start_mm(&self) -> Option<Vec3> {
        self.start_mm
    }

    /// Paths of the frames so far, relative to the folder.
    pub fn frames(&self) -> &[String] {
        &self.frames
    }

    /// Folder of the recording.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Number of steps recorded so far.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Writes the current summary at intervals, in case the run is killed.
    ///
    /// # Errors
    /// [`Error::File`] for what cannot be written, [`Error::Computation`] for a recording that was removed meanwhile.
    pub fn checkpoint<E: Serialize>(&mut self, summary: impl FnOnce(&Self) -> Summary<E>) -> Result<()> {
        if self.checkpoint.is_some_and(|last| last.elapsed().as_secs_f64() < CHECKPOINT_S) {
            return Ok(());
        }
        self.sync()?;
        self.check_there()?;
        summary(self).write(&self.folder)?;
        self.checkpoint = Some(Instant::now());
        Ok(())
    }

    /// Syncs all steps to disk.
    ///
    /// # Errors
    /// [`Error::File`] if that fails.
    pub fn sync(&self) -> Result<()> {
        let synced = || -> io::Result<()> {
            self.arrays.sync()?;
            self.tables.sync()
        };
        synced().map_err(|e| Error::file(&self.folder, e))
    }

    /// Fails if the table of steps was removed or replaced: an open file still accepts writes after it has been
    /// deleted.
    fn check_there(&self) -> Result<()> {
        let path = self.folder.join(STEPS);
        match (self.tables.bytes_of_steps(), path.metadata()) {
            (Ok(own), Ok(there)) if there.len() == own => Ok(()),
            _ => Err(Error::Computation(format!(
                "{}: was removed or replaced while the run went on, and steps with it; run the scene again",
                path.display()
            ))),
        }
    }

    /// Writes a frame of a step with `write`, which gets the path, and lists it in the summary.
    ///
    /// # Errors
    /// Those of `write`, and a folder that is not there any more.
    pub fn frame(&mut self, step: usize, view: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let folder = self.folder.join(FRAMES);
        // The folder of the recording is not created again: if it has vanished, so have the earlier steps.
        match std::fs::create_dir(&folder) {
            Err(e) if e.kind() != io::ErrorKind::AlreadyExists => return Err(Error::file(&folder, e)),
            _ => {}
        }
        let name = folder::frame_name(step, view);
        write(&folder.join(&name))?;
        self.frames.push(format!("{FRAMES}/{name}"));
        Ok(())
    }

    /// Packs the arrays and writes the summary; the latter even if the former fails.
    ///
    /// # Errors
    /// As [`Self::checkpoint`].
    pub fn finish<E: Serialize>(self, summary: &mut Summary<E>) -> Result<()> {
        self.check_there()?;
        // The lock is released at the end of this function, when everything is written.
        let Self { folder, arrays, _claim, .. } = self;
        let packed = arrays.pack(&folder).map_err(|e| Error::file(&folder.join(SHAPES), e));
        summary.complete = packed.is_ok();
        summary.outcome.ended_by.get_or_insert(EndedBy::Closed);
        summary.write(&folder)?;
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
        let mut before = None;
        for (index, line) in table.split_inclusive(|byte| *byte == b'\n').enumerate() {
            let whole = line.ends_with(b"\n");
            match (index, whole) {
                (_, false) => break,
                (0, _) => {}
                _ => {
                    let step = step_of(line)?;
                    // A step that is missing would move all later ones to other shapes.
                    if before.is_some_and(|before| step != before + 1) {
                        return None;
                    }
                    before = Some(step);
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
