//! `endowire sweep`: runs a scene many times with different values of its keys.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use endowire_core::insertion::{Move, Simulation};
use endowire_core::methods::MethodChoice;
use endowire_methods::Scene;
use endowire_recording::{Recorder, RunOutcome, Summary, VERSION};
use endowire_sweep::{Order, Progress, Record, Recorded, Run, Sweep, merge};
use indicatif::ProgressBar;
use serde::Serialize;

use super::run::interrupts;
use crate::args::{SweepArgs, SweepCommand};
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::{Drawn, FrameWriter};
use crate::output::provenance::{PROGRAM, Provenance};
use crate::output::{in_folder, print_json, progress, record_anew, tell, whole};

/// Document printed with `--json`.
#[derive(Serialize)]
struct Document {
    runs: usize,
    /// Number of runs with a row.
    done: usize,
    /// Number of runs that had a row before.
    earlier: usize,
    /// Number of runs that did not complete their script.
    failed: usize,
    /// Number of runs with steps that did not converge.
    unconverged: usize,
    table: Option<PathBuf>,
}

/// Carries out a sweep, or merges shards.
pub(crate) fn sweep(args: &SweepArgs) -> Result<(), Failure> {
    match (&args.merge, &args.sweep, &args.out) {
        (Some(SweepCommand::Merge { folders, out }), ..) => {
            let runs = merge(folders, out)?;
            tell(format_args!("{runs} runs in {}", out.display()));
            Ok(())
        }
        (None, Some(file), Some(out)) => carry_out(args, file, out),
        // The parser requires both.
        _ => Err(Failure::Input("give a sweep file and --out DIR".to_owned())),
    }
}

fn carry_out(args: &SweepArgs, file: &Path, folder: &Path) -> Result<(), Failure> {
    let sweep = Sweep::read_with(file, &args.set.set)?;
    if let Some(remark) = sweep.remark() {
        tell(format_args!("endowire: {}: {remark}", file.display()));
    }
    let store = &Cache::new(&args.cache);
    let recordings =
        sweep.recorded().map(|what| Recordings { folder: folder.join("recordings"), store, what });
    // What a call that was killed was writing.
    for place in [folder.to_path_buf(), folder.join("recordings")] {
        whole::remove_unfinished_in(&place, |_| true).map_err(|e| Failure::write(&place, &e))?;
    }
    let stop = interrupts();
    let bar = progress::bar(sweep.len(), "run");
    let order = Order {
        folder,
        shard: args.shard,
        jobs: args.jobs.map(usize::from),
        store,
        program: PROGRAM,
        record: recordings.as_ref().map(|recordings| recordings as &dyn Record),
        stop,
        progress: &|progress| show(&bar, progress),
    };
    let reported = sweep.carry_out(&order)?;
    bar.finish_and_clear();
    let Progress { runs, done, failed, unconverged } = reported.progress;
    if args.json {
        let (earlier, table) = (reported.earlier, reported.table.clone());
        print_json(&Document { runs, done, earlier, failed, unconverged, table })?;
    }
    match reported.table {
        Some(table) => {
            let steps = match unconverged {
                0 => String::new(),
                count => format!(", {count} have steps without an equilibrium (unconverged_steps)"),
            };
            tell(format_args!("{runs} runs in {}, {failed} of them failed{steps}", table.display()));
            Ok(())
        }
        None => Err(Failure::Computation(format!(
            "{}: interrupted with {done} of {runs} runs done: the same command goes on",
            file.display()
        ))),
    }
}

/// Shows progress. Runs that had a row before must not affect the estimate of the remaining time.
fn show(bar: &ProgressBar, progress: Progress) {
    let begins = bar.position() == 0;
    bar.set_length(progress.runs as u64);
    bar.set_position(progress.done as u64);
    if begins {
        bar.reset_eta();
    }
    let counts = [(progress.failed, "failed"), (progress.unconverged, "without equilibria")];
    let reported =
        counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
    bar.set_message(reported.collect::<Vec<_>>().join(", "));
}

/// Recordings of all runs: each a folder as from `endowire run`, with its scene beside it.
struct Recordings<'a> {
    folder: PathBuf,
    store: &'a Cache,
    what: Recorded,
}

/// The recording of one run.
struct Recording {
    scene_file: PathBuf,
    scene: Scene,
    provenance: Provenance,
    frames: FrameWriter,
    recorder: Recorder,
    started: Instant,
    /// Time at which the last step was recorded.
    recorded: Instant,
    /// Time between recordings of steps.
    steps: Duration,
}

impl Record for Recordings<'_> {
    fn begin(
        &self,
        run: &Run<'_>,
        simulation: &Simulation,
    ) -> Result<Box<dyn endowire_sweep::Recorder>, String> {
        self.recording(run, simulation)
            .map(|recording| Box::new(recording) as Box<dyn endowire_sweep::Recorder>)
            .map_err(|failure| failure.to_string())
    }
}

impl Recordings<'_> {
    fn recording(&self, run: &Run<'_>, simulation: &Simulation) -> Result<Recording, Failure> {
        let name = format!("{:06}", run.number());
        let (folder, scene_file) = (self.folder.join(&name), self.folder.join(name + ".toml"));
        let mut recorder = record_anew(&folder, false, simulation)?;
        let text = run.standalone()?;
        whole::write_bytes(&scene_file, text.as_bytes()).map_err(|e| Failure::write(&scene_file, &e))?;
        let scene = Scene::read(&scene_file)?;
        recorder.pack(scene.sac(simulation.lumen(), self.store)?, simulation).map_err(in_folder)?;
        let drawn = (self.what == Recorded::Frames).then_some(simulation);
        let frames = FrameWriter::new(&scene_file, &scene, drawn, self.store)?;
        frames.check_angiogram(None)?;
        Ok(Recording {
            frames,
            provenance: Provenance::of_scene(&scene, &[])?,
            scene_file,
            scene,
            recorder,
            started: Instant::now(),
            recorded: Instant::now(),
            steps: Duration::ZERO,
        })
    }
}

impl endowire_sweep::Recorder for Recording {
    fn step(
        &mut self,
        moves: &[Move],
        time_s: Option<f64>,
        last: bool,
        simulation: &Simulation,
    ) -> Result<(), String> {
        self.steps += self.recorded.elapsed();
        let step = self.recorder.steps() + 1;
        let time_s = time_s.unwrap_or_else(|| self.frames.time_s(step));
        let lengths_mm = simulation.report().lengths_mm();
        let (inserted_mm, displacement) = (lengths_mm.as_slice(), simulation.displacement());
        let seen = Drawn { shape: simulation.shape(), inserted_mm, displacement: displacement.as_ref() };
        let recorded = self.recorder.record(moves, time_s, simulation).map_err(in_folder);
        let drawn = recorded.and_then(|()| self.frames.step((step, time_s), last, seen, &mut self.recorder));
        self.recorded = Instant::now();
        drawn.map_err(|failure| failure.to_string())
    }

    fn end(self: Box<Self>, outcome: &RunOutcome) -> Result<(), String> {
        let film = self.frames.film(&self.recorder).map_err(|failure| failure.to_string())?;
        let mut summary = Summary {
            schema: VERSION,
            provenance: self.provenance.recorded(),
            complete: false,
            scene: self.scene.name.clone(),
            scene_file: Some(std::path::absolute(&self.scene_file).unwrap_or(self.scene_file)),
            script_file: None,
            method: self.scene.method.name().to_owned(),
            centreline_found: self.scene.finds_centreline(),
            start_mm: self.recorder.start_mm(),
            outcome: outcome.clone(),
            packing: self.recorder.packed(),
            step_time_s: self.steps.as_secs_f64(),
            wall_time_s: self.started.elapsed().as_secs_f64(),
            renderer: self.frames.renderer(),
            planes: self.frames.planes(),
            frames: self.recorder.frames().to_vec(),
            film,
        };
        self.recorder.finish(&mut summary).map_err(|error| in_folder(error).to_string())
    }
}
