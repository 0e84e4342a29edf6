//! `endowire run`: a scripted insertion, recorded.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use endowire_core::insertion::Simulation;
use endowire_core::scene::Scene;

use crate::args::RunArgs;
use crate::failure::Failure;
use crate::output::progress;
use crate::output::provenance::{Provenance, read_input};
use crate::output::recorder::{Recorder, StepFailure, Summary};
use crate::output::{frames::FrameWriter, print_json, tell};

/// Runs the scene's script and records every step.
pub(crate) fn run(args: &RunArgs) -> Result<(), Failure> {
    let started = Instant::now();
    let scene = Scene::read(&args.scene)?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    let commands = scene.commands(&scene.device().map_err(in_scene)?).map_err(in_scene)?;
    if commands.is_empty() {
        let text = "script = []: give at least one [[script]] table, what the hand does".to_owned();
        return Err(Failure::Input(text).at(args.scene.display()));
    }
    let mut simulation = scene.simulation().map_err(in_scene)?;
    let mut frames = FrameWriter::new(&args.scene, &scene, &simulation)?;
    let mut inputs = vec![scene.text().as_bytes().to_vec()];
    for path in scene.input_paths() {
        inputs.push(read_input(&path)?);
    }
    let provenance = Provenance::new(&inputs, scene.seed);
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));
    let mut recorder = Recorder::new(&folder, args.force)?;

    // From here on something is recorded: whatever happens, it is kept.
    let interrupted = interrupts();
    let bar = progress::bar(commands.len(), "step");
    let mut so_far = SoFar { step_time_s: 0.0, max_penetration_mm: 0.0, converged: true, failure: None };
    let summary = |so_far: &SoFar, simulation: &Simulation, frames: &FrameWriter, recorder: &Recorder| {
        let report = simulation.report();
        Summary {
            provenance: provenance.clone(),
            complete: false,
            scene: scene.name.clone(),
            scene_file: std::path::absolute(&args.scene).unwrap_or_else(|_| args.scene.clone()),
            method: scene.method.name(),
            steps: recorder.steps(),
            steps_asked: commands.len(),
            converged: so_far.converged && so_far.failure.is_none(),
            failure: so_far.failure.clone(),
            inserted_mm: report.inserted_mm,
            rotation_rad: report.rotation_rad,
            tip_mm: simulation.shape().tip_mm().map(Into::into),
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            energy_mj: report.energy,
            max_penetration_mm: so_far.max_penetration_mm,
            left_through: report.left_through,
            step_time_s: so_far.step_time_s,
            wall_time_s: started.elapsed().as_secs_f64(),
            renderer: frames.renderer(),
            frames: recorder.frames.clone(),
        }
    };
    recorder.checkpoint(|recorder| summary(&so_far, &simulation, &frames, recorder))?;
    for (index, command) in commands.iter().enumerate() {
        let failed = |reason: String| Some(StepFailure { step: index + 1, reason });
        if interrupted.load(Ordering::Relaxed) {
            so_far.failure = failed("interrupted before it".to_owned());
            break;
        }
        let clock = Instant::now();
        let result = simulation.step(*command);
        so_far.step_time_s += clock.elapsed().as_secs_f64();
        match result {
            Ok(report) => {
                so_far.max_penetration_mm = so_far.max_penetration_mm.max(report.max_penetration_mm);
                so_far.converged &= report.converged;
            }
            Err(error) => {
                so_far.failure = failed(error.to_string());
                break;
            }
        }
        let last = index + 1 == commands.len();
        let recorded = recorder
            .record(*command, simulation.report(), simulation.shape())
            .and_then(|()| frames.step(index + 1, last, &simulation, &mut recorder))
            .and_then(|()| recorder.checkpoint(|recorder| summary(&so_far, &simulation, &frames, recorder)));
        if let Err(error) = recorded {
            so_far.failure = failed(error.to_string());
            break;
        }
        bar.set_message(format!("{:.1} mm inserted", simulation.report().inserted_mm));
        bar.inc(1);
    }
    bar.finish_and_clear();
    if so_far.failure.is_some() && recorder.steps() > 0 {
        // The picture of the end is a help; the first failure is the one to tell.
        let _ = frames.step(recorder.steps(), true, &simulation, &mut recorder);
    }

    let mut summary = summary(&so_far, &simulation, &frames, &recorder);
    let finished = recorder.finish(&mut summary).map_err(Failure::into_computation);
    if args.json {
        print_json(&summary)?;
    } else {
        tell(text(&summary, &folder, &simulation));
    }
    match so_far.failure {
        Some(StepFailure { step, reason }) => {
            let kept = match finished {
                Ok(()) => format!("{} steps are kept in {}", summary.steps, folder.display()),
                Err(error) => error.to_string(),
            };
            Err(Failure::Computation(format!("{}: step {step}: {reason} ({kept})", args.scene.display())))
        }
        None => finished,
    }
}

/// What is known of a run while it goes on.
struct SoFar {
    step_time_s: f64,
    max_penetration_mm: f64,
    converged: bool,
    failure: Option<StepFailure>,
}

/// Set by Ctrl-C, or by a request to terminate: the step under way is finished and recorded. A second one ends at once.
fn interrupts() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&flag);
    // Without a handler an interrupt ends the program at once, as elsewhere.
    let _ = ctrlc::set_handler(move || {
        if heard.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    });
    flag
}

/// The summary for a person, for stderr: stdout is for documents.
fn text(summary: &Summary, folder: &Path, simulation: &Simulation) -> String {
    let tip = summary.tip_mm.unwrap_or_default();
    format!(
        "{}: {} of {} steps by {} in {:.2} s ({:.2} s simulating)\n\
         inserted {:.2} mm, tip at [{:.2}, {:.2}, {:.2}] mm, push force {:.4} N, {} contacts, \
         deepest penetration {:.3} mm\n\
         {} frames{} in {}",
        summary.scene,
        summary.steps,
        summary.steps_asked,
        summary.method,
        summary.wall_time_s,
        summary.step_time_s,
        summary.inserted_mm,
        tip[0],
        tip[1],
        tip[2],
        summary.push_force_n,
        simulation.report().contacts.len(),
        summary.max_penetration_mm,
        summary.frames.len(),
        summary.renderer.as_ref().map_or(String::new(), |r| format!(" by {r}")),
        folder.display()
    )
}
