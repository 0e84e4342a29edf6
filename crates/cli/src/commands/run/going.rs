//! A run in progress: its steps and their recording.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use endowire_core::insertion::{Move, Script, ScriptRun, Simulation, Step};
use endowire_core::methods::MethodChoice;
use endowire_methods::Scene;
use endowire_recording::{EndedBy, InjectionRow, Recorder, RunOutcome, StepFailure, VERSION};
use endowire_viewer::Exposure;
use indicatif::ProgressBar;

use super::reported::live;
use crate::failure::Failure;
use crate::output::frames::{Drawn, FrameWriter};
use crate::output::in_folder;
use crate::output::provenance::Provenance;
use crate::output::saved::{Course, Saver};

/// The summary of a run with pictures.
pub(super) type Summary = endowire_recording::Summary<Exposure>;

/// The state of a run.
pub(super) struct SoFar<'a> {
    pub(super) scene: &'a Scene,
    pub(super) scene_file: &'a Path,
    /// File of the script, if it is not the scene's own.
    pub(super) script_file: Option<&'a Path>,
    pub(super) script: &'a Script,
    pub(super) provenance: Provenance,
    pub(super) started: Instant,
    pub(super) simulation: Simulation,
    pub(super) hand: ScriptRun<'a>,
    pub(super) frames: FrameWriter,
    pub(super) course: Course,
    pub(super) failure: Option<StepFailure>,
}

impl SoFar<'_> {
    fn summary(&self, recorder: &Recorder) -> Summary {
        let &Course { tally, step_time_s, .. } = &self.course;
        let steps = (recorder.steps(), self.script.len());
        let failure = self.failure.clone();
        Summary {
            schema: VERSION,
            provenance: self.provenance.recorded(),
            complete: false,
            scene: self.scene.name.clone(),
            scene_file: Some(anywhere(self.scene_file)),
            script_file: self.script_file.map(anywhere),
            method: self.scene.method.name().to_owned(),
            centreline_found: self.scene.finds_centreline(),
            start_mm: recorder.start_mm(),
            outcome: RunOutcome::new(&self.simulation, &self.hand, steps, tally, failure),
            packing: recorder.packed(),
            step_time_s,
            wall_time_s: self.started.elapsed().as_secs_f64(),
            renderer: self.frames.renderer(),
            planes: self.frames.planes(),
            frames: recorder.frames().to_vec(),
            film: None,
        }
    }

    /// Records that the next step was not carried out because of an interrupt.
    fn interrupt(&mut self, reason: &str) {
        let (step, reason) = (self.course.steps + 1, reason.to_owned());
        self.failure = Some(StepFailure { step, reason, kind: EndedBy::Interrupted });
    }

    /// Records that the step after `after` steps failed.
    fn fail(&mut self, after: usize, error: &endowire_core::Error) {
        self.failure = Some(StepFailure::new(after + 1, error));
    }

    /// Carries out a step.
    fn simulate(&mut self, step: &Step<'_>) -> endowire_core::Result<()> {
        let clock = Instant::now();
        let result = step.carry_out(&mut self.simulation).map(|_| ());
        self.course.step_time_s += clock.elapsed().as_secs_f64();
        result?;
        self.course.tally.count(self.course.steps + 1, &self.simulation);
        self.hand.carried_out();
        Ok(())
    }

    /// Draws the frames of a step that the scene requests.
    fn draw(&mut self, now: (usize, f64), last: bool, recorder: &mut Recorder) -> Result<(), Failure> {
        let lengths_mm = self.simulation.report().lengths_mm();
        let displacement = self.simulation.displacement();
        let (shape, inserted_mm) = (self.simulation.shape(), &lengths_mm[..]);
        self.frames.step(
            now,
            last,
            Drawn { shape, inserted_mm, displacement: displacement.as_ref() },
            recorder,
        )
    }
}

/// A path for other working directories.
fn anywhere(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// A run and its recording.
pub(super) struct Going<'a> {
    pub(super) so_far: SoFar<'a>,
    pub(super) recorder: Recorder,
    pub(super) saver: Option<Saver>,
    /// End time of each step, s.
    pub(super) times_s: Vec<f64>,
    /// Whether the simulation is one step ahead of the recording, because that step could not be recorded.
    pub(super) ahead: bool,
}

/// A run that has ended.
pub(super) struct Ended {
    pub(super) summary: Summary,
    pub(super) simulation: Simulation,
    /// Whether the recording was written completely.
    pub(super) written: Result<(), Failure>,
}

impl Going<'_> {
    /// Records the state before the first step.
    pub(super) fn begin(&mut self) -> Result<(), Failure> {
        self.inject();
        InjectionRow::write(self.recorder.folder(), &self.so_far.course.injected).map_err(in_folder)?;
        self.checkpoint()?;
        self.save()
    }

    /// Carries out `next` and all later steps, until one fails.
    pub(super) fn carry_out(
        &mut self,
        mut next: Option<Step<'static>>,
        interrupted: &AtomicBool,
        bar: &ProgressBar,
    ) {
        while let Some(step) = next.take() {
            if interrupted.load(Ordering::Relaxed) {
                self.so_far.interrupt("interrupted before it");
                break;
            }
            let recorded = self.times_s.len();
            next = self.step(&step);
            if self.times_s.len() > recorded {
                bar.set_message(live(self.so_far.simulation.report(), &self.so_far.course.tally));
                bar.inc(1);
            }
        }
    }

    /// Carries out and records a step; returns the next one, unless there is none or something failed.
    fn step(&mut self, step: &Step<'_>) -> Option<Step<'static>> {
        let before = self.so_far.course.steps;
        if let Err(error) = self.so_far.simulate(step) {
            match error {
                endowire_core::Error::Stopped => self.so_far.interrupt("interrupted in it"),
                error => self.so_far.fail(before, &error),
            }
            return None;
        }
        let time_s = step.time_s.unwrap_or_else(|| self.so_far.frames.time_s(before + 1));
        let next = match self.so_far.hand.next(&self.so_far.simulation) {
            Ok(step) => step.map(Step::into_owned),
            Err(error) => {
                self.so_far.fail(before, &error);
                None
            }
        };
        if let Err(error) = self.record(&step.moves, time_s, next.is_none()) {
            let (step, reason) = (before + 1, error.to_string());
            self.so_far.failure = Some(StepFailure { step, reason, kind: EndedBy::Unrecorded });
            self.ahead = self.recorder.steps() == before;
            return None;
        }
        self.times_s.push(time_s);
        next
    }

    fn record(&mut self, moves: &[Move], time_s: f64, last: bool) -> Result<(), Failure> {
        self.recorder.record(moves, time_s, &self.so_far.simulation).map_err(in_folder)?;
        self.so_far.course.steps += 1;
        self.so_far.draw((self.so_far.course.steps, time_s), last, &mut self.recorder)?;
        if self.inject() {
            InjectionRow::write(self.recorder.folder(), &self.so_far.course.injected).map_err(in_folder)?;
        }
        self.checkpoint()?;
        if self.saver.as_ref().is_some_and(Saver::is_due) { self.save() } else { Ok(()) }
    }

    /// Adds the injections that begin at the end of the last step; returns whether there are any.
    fn inject(&mut self) -> bool {
        let SoFar { hand, simulation, frames, course, .. } = &mut self.so_far;
        let begun = InjectionRow::begun(hand, course.injected.len(), frames.frames_per_s(), simulation);
        begun.iter().for_each(|one| frames.inject(one));
        let any = !begun.is_empty();
        course.injected.extend(begun);
        any
    }

    fn checkpoint(&mut self) -> Result<(), Failure> {
        let so_far = &self.so_far;
        self.recorder.checkpoint(|recorder| so_far.summary(recorder)).map_err(in_folder)
    }

    fn save(&mut self) -> Result<(), Failure> {
        let Some(saver) = &mut self.saver else { return Ok(()) };
        let SoFar { simulation, script, hand, course, .. } = &self.so_far;
        saver.save(simulation, (script, hand.course()), course, || self.recorder.sync().map_err(in_folder))
    }

    /// Writes the remaining data.
    pub(super) fn end(mut self) -> Ended {
        let saved = if self.ahead { Ok(()) } else { self.save() };
        if self.so_far.failure.is_some() && self.recorder.steps() > 0 {
            // This last picture is optional: its error would hide the first failure.
            let now = (self.recorder.steps(), self.times_s.last().copied().unwrap_or_default());
            let _ = self.so_far.draw(now, true, &mut self.recorder);
        }
        let mut summary = self.so_far.summary(&self.recorder);
        let film = self.so_far.frames.film(&self.recorder).map(|film| summary.film = film);
        let written = self
            .recorder
            .finish(&mut summary)
            .map_err(in_folder)
            .and(saved)
            .and(film)
            .map_err(Failure::into_computation);
        Ended { summary, simulation: self.so_far.simulation, written }
    }
}
