//! `endowire run`: a scripted insertion, recorded.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use endowire_core::insertion::{Move, ScriptCourse, ScriptRun, Simulation, Step, StepReport};
use endowire_core::methods::MethodChoice;
use endowire_methods::Scene;
use endowire_sweep::{RunOutcome, StepFailure};

use crate::args::RunArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::instruments::Lengths;
use crate::output::progress;
use crate::output::provenance::{Provenance, read_input};
use crate::output::recorder::{Recorder, Summary};
use crate::output::recording::Recording;
use crate::output::saved::{Course, Saved, Saver};
use crate::output::{frames::FrameWriter, print_json, tell, whole};

/// Runs the scene's script and records every step.
pub(crate) fn run(args: &RunArgs) -> Result<(), Failure> {
    let started = Instant::now();
    let mut scene = Scene::read(&args.scene)?;
    args.script.as_deref().map_or(Ok(()), |path| scene.take_script(path))?;
    let scene = scene;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    let saved = args.resume.as_deref().map(Saved::read).transpose()?;
    let script = scene.stack().and_then(|stack| scene.steps(&stack)).map_err(in_scene)?;
    if script.is_empty() {
        let text = "script = []: give at least one [[script]] table, what the hand does".to_owned();
        return Err(Failure::Input(text).at(args.scene.display()));
    }
    let mut simulation = scene.simulation(&Cache::new(&args.cache)).map_err(in_scene)?;
    let mut saver = args.save_state.as_ref().map(|path| Saver::new(path, &scene, &simulation));
    let mut frames = FrameWriter::new(&args.scene, &scene, Some(&simulation))?;
    let mut times_s = Vec::new();
    let mut hand = match &saved {
        Some(saved) => saved.restore(&scene, &mut simulation, &script, |step| {
            times_s.push(step.time_s.unwrap_or_else(|| frames.time_s(times_s.len() + 1)));
        })?,
        None => script.begin(),
    };
    let mut next = own(hand.next(&simulation)?);
    let mut inputs = vec![scene.text().as_bytes().to_vec()];
    for path in scene.input_paths() {
        inputs.push(read_input(&path)?);
    }
    let provenance = Provenance::new(&inputs, scene.seed);
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));
    let mut course = saved.map_or_else(Course::begin, |saved| saved.course());
    let mut recorder = if args.resume.is_some() {
        let (mut recorder, earlier) = Recorder::go_on(&folder, args.force, course.steps, &simulation)?;
        let times = (times_s.as_slice(), next.is_none());
        draw_again(&mut frames, earlier.as_ref(), (&folder, &simulation), times, &mut recorder)?;
        recorder
    } else {
        let recorder = Recorder::new(&folder, args.force, simulation.stack())?;
        if let Some(path) = &args.save_state {
            forget_state(path)?;
        }
        recorder
    };

    // From here on something is recorded: whatever happens, it is kept.
    let interrupted = interrupts();
    let bar = if args.quiet { progress::hidden() } else { progress::bar(script.len(), "step") };
    let mut jumps = 0;
    bar.inc(course.steps as u64);
    let mut failure: Option<StepFailure> = None;
    // Whether a step was taken that could not be recorded.
    let mut ahead = false;
    let summary = |course: &Course,
                   failure: &Option<StepFailure>,
                   (simulation, hand): (&Simulation, &ScriptRun<'_>),
                   frames: &FrameWriter,
                   recorder: &Recorder| {
        let steps = (recorder.steps(), script.len());
        let so_far = (course.converged, course.max_penetration_mm);
        Summary {
            provenance: provenance.clone(),
            complete: false,
            scene: scene.name.clone(),
            scene_file: std::path::absolute(&args.scene).unwrap_or_else(|_| args.scene.clone()),
            method: scene.method.name(),
            outcome: RunOutcome::new(simulation, hand, steps, so_far, failure.clone()),
            step_time_s: course.step_time_s,
            wall_time_s: started.elapsed().as_secs_f64(),
            renderer: frames.renderer(),
            frames: recorder.frames.clone(),
        }
    };
    let save = |saver: &mut Option<Saver>,
                simulation: &Simulation,
                lines: &ScriptCourse,
                course: Course,
                recorder: &Recorder| {
        let Some(saver) = saver else { return Ok(()) };
        saver.save(simulation, (&script, lines), course, || recorder.sync())
    };
    recorder.checkpoint(|recorder| summary(&course, &failure, (&simulation, &hand), &frames, recorder))?;
    save(&mut saver, &simulation, hand.course(), course, &recorder)?;
    while let Some((moves, time_s)) = next.take() {
        let index = course.steps;
        let failed = |reason: String| Some(StepFailure { step: index + 1, reason });
        if interrupted.load(Ordering::Relaxed) {
            failure = failed("interrupted before it".to_owned());
            break;
        }
        let clock = Instant::now();
        let result = simulation.step_together(&moves);
        course.step_time_s += clock.elapsed().as_secs_f64();
        match result {
            Ok(report) => {
                course.max_penetration_mm = course.max_penetration_mm.max(report.max_penetration_mm);
                course.converged &= report.converged;
                jumps += usize::from(report.jumped);
            }
            Err(error) => {
                failure = failed(error.to_string());
                break;
            }
        }
        hand.carried_out();
        let time_s = time_s.unwrap_or_else(|| frames.time_s(index + 1));
        match hand.next(&simulation) {
            Ok(step) => next = own(step),
            Err(error) => failure = failed(error.to_string()),
        }
        let last = next.is_none();
        let lengths_mm = simulation.report().lengths_mm();
        let seen = (simulation.shape(), lengths_mm.as_slice());
        let recorded = recorder
            .record(&moves, time_s, &simulation)
            .and_then(|()| {
                course.steps = index + 1;
                frames.step((index + 1, time_s), last, seen, &mut recorder)
            })
            .and_then(|()| {
                let now = (&simulation, &hand);
                recorder.checkpoint(|recorder| summary(&course, &failure, now, &frames, recorder))
            })
            .and_then(|()| match saver.as_ref().is_some_and(Saver::is_due) {
                true => save(&mut saver, &simulation, hand.course(), course, &recorder),
                false => Ok(()),
            });
        if let Err(error) = recorded {
            failure = failed(error.to_string());
            ahead = recorder.steps() == index;
            break;
        }
        times_s.push(time_s);
        bar.set_message(live(simulation.report(), jumps));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let saved = if ahead { Ok(()) } else { save(&mut saver, &simulation, hand.course(), course, &recorder) };
    if failure.is_some() && recorder.steps() > 0 {
        // The picture of the end is a help; the first failure is the one to tell.
        let lengths_mm = simulation.report().lengths_mm();
        let seen = (simulation.shape(), lengths_mm.as_slice());
        let now = (recorder.steps(), times_s.last().copied().unwrap_or_default());
        let _ = frames.step(now, true, seen, &mut recorder);
    }

    let mut summary = summary(&course, &failure, (&simulation, &hand), &frames, &recorder);
    let finished = recorder.finish(&mut summary).and(saved).map_err(Failure::into_computation);
    for line in summary.outcome.until.iter().filter(|line| line.met.is_none()) {
        let what = "its condition (until) was not met on all of its way";
        tell(format_args!("{}: {}: {what}, {} steps", args.scene.display(), line.line, line.steps));
    }
    if args.json {
        print_json(&summary)?;
    } else if !args.quiet {
        tell(text(&summary, &folder, &simulation));
    }
    match failure {
        Some(StepFailure { step, reason }) => {
            let kept = match finished {
                Ok(()) => format!("{} steps are kept in {}", summary.outcome.steps, folder.display()),
                Err(error) => error.to_string(),
            };
            Err(Failure::Computation(format!("{}: step {step}: {reason} ({kept})", args.scene.display())))
        }
        None => finished,
    }
}

/// What a person wants to see while it goes on.
fn live(report: &StepReport, jumps: usize) -> String {
    let mut line = format!("{:.1} mm in, push {:.3} N", report.inserted_mm, report.push_force_n);
    if jumps > 0 {
        line += &format!(", {jumps} jumped");
    }
    if report.left_through.is_some() {
        line += ", tip outside";
    }
    line
}

/// The moves of a step and its time, on their own.
fn own(step: Option<Step<'_>>) -> Option<(Vec<Move>, Option<f64>)> {
    step.map(|step| (step.moves.to_vec(), step.time_s))
}

/// Removes the state of an earlier run: until this one has saved its own, there is none to go on from.
fn forget_state(path: &Path) -> Result<(), Failure> {
    whole::remove(path).map_err(|e| Failure::write(path, &e))
}

/// Draws the frames of a recording that goes on once more: the detector remembers those before. `times_s` are those of all steps so far.
fn draw_again(
    frames: &mut FrameWriter,
    earlier: Option<&Recording>,
    (folder, simulation): (&Path, &Simulation),
    (times_s, ended): (&[f64], bool),
    recorder: &mut Recorder,
) -> Result<(), Failure> {
    let Some(earlier) = earlier else { return Ok(()) };
    let before = recorder.steps() - earlier.steps();
    let lengths = Lengths::read(folder, simulation.stack())?;
    for row in 1..=earlier.steps() {
        let step = before + row;
        let shape = earlier.shape(row);
        let lengths_mm = lengths.after(step, &shape)?;
        let last = ended && step == times_s.len();
        frames.step((step, times_s[step - 1]), last, (&shape, &lengths_mm), recorder)?;
    }
    Ok(())
}

/// Set by Ctrl-C, or by a request to terminate: the step under way is finished and recorded. A second one ends at once.
pub(crate) fn interrupts() -> Arc<AtomicBool> {
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
    let outcome = &summary.outcome;
    let tip = outcome.tip_mm.unwrap_or_default();
    let mut lines = vec![
        format!(
            "{}: {} of {} steps by {} in {:.2} s ({:.2} s simulating)",
            summary.scene,
            outcome.steps,
            outcome.steps_asked,
            summary.method,
            summary.wall_time_s,
            summary.step_time_s
        ),
        format!("  inserted       {:.2} mm", outcome.inserted_mm),
        format!("  tip            [{:.2}, {:.2}, {:.2}] mm", tip[0], tip[1], tip[2]),
        format!("  push force     {:.4} N, torque {:.4} N·mm", outcome.push_force_n, outcome.torque_nmm),
    ];
    lines.extend(outcome.instruments.iter().map(|one| {
        let push = one.report.push_force_n.map_or_else(|| "jumps".to_owned(), |n| format!("{n:.4} N"));
        let (mm, torque) = (one.report.inserted_mm, one.report.torque_nmm);
        format!("    {:<12} {mm:.2} mm, push {push}, torque {torque:.4} N·mm", one.name)
    }));
    let contacts = simulation.report().contacts.len();
    lines.push(format!(
        "  wall           {contacts} contacts, deepest penetration {:.3} mm",
        outcome.max_penetration_mm
    ));
    if let Some(opening) = outcome.left_through {
        lines.push(format!("  left           the tip is out of opening {opening}"));
    }
    let renderer = summary.renderer.as_ref().map_or(String::new(), |r| format!(" by {r}"));
    lines.push(format!("  recorded       {} frames{renderer} in {}", summary.frames.len(), folder.display()));
    lines.join("\n")
}
