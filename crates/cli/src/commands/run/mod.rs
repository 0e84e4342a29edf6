//! `endowire run`: a scripted insertion, recorded.

mod going;
mod reported;

use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use endowire_core::insertion::{Simulation, Step};

use endowire_methods::Scene;
use endowire_recording::{Among, InjectionRow, Lengths, RecordedVessel, Recorder, Recording};

use crate::args::RunArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::{Drawn, FrameWriter};
use crate::output::provenance::Provenance;
use crate::output::saved::{Course, Saved, Saver};
use crate::output::{in_folder, progress, record_anew, tell, whole};
use crate::scenes;
use going::{Going, SoFar};

/// Runs the scene's script and records every step.
pub(crate) fn run(args: &RunArgs) -> Result<(), Failure> {
    let started = Instant::now();
    let scene = scenes::with_script(&args.scene, &args.set.set, args.script.as_deref())?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    let resume = args.resume.as_deref().filter(|path| is_there(path));
    let saved = resume.map(Saved::read).transpose()?;
    let cache = Cache::new(&args.cache);
    let script = scene.stack().and_then(|stack| scene.steps(&stack, &cache)).map_err(in_scene)?;
    if script.is_empty() {
        let text = "script = []: give at least one [[script]] table, what the hand does".to_owned();
        return Err(Failure::Input(text).at(args.scene.display()));
    }
    let mut simulation = scene.simulation(&cache).map_err(in_scene)?;
    if !args.quiet {
        for hint in scene.hints(simulation.lumen()).map_err(in_scene)? {
            tell(format_args!("{}: {hint}", args.scene.display()));
        }
    }
    let sac = scene.sac(simulation.lumen(), &cache).map_err(in_scene)?;
    if let Some(path) = &args.save_state {
        // What runs that were killed while they saved have left.
        whole::remove_unfinished(path).map_err(|e| Failure::write(path, &e))?;
    }
    let saver = args.save_state.as_ref().map(|path| Saver::new(path, (&scene, sac.as_ref()), &simulation));
    let mut frames = FrameWriter::new(&args.scene, &scene, Some(&simulation), &cache)?;
    frames.check_angiogram(Some(&script)).map_err(in_scene)?;
    if !args.quiet {
        scenes::tell_found(&args.scene, &scene);
    }
    if let Some(held) = frames.held().filter(|_| !args.quiet) {
        tell(format_args!("{}: {held}", args.scene.display()));
    }
    let mut times_s = Vec::new();
    let mut hand = match &saved {
        Some(saved) => saved.restore((&scene, sac.as_ref()), &mut simulation, &script, |step| {
            times_s.push(step.time_s.unwrap_or_else(|| frames.time_s(times_s.len() + 1)));
        })?,
        None => script.begin(),
    };
    let next = hand.next(&simulation)?.map(Step::into_owned);
    let provenance = Provenance::of_scene(&scene, &args.set.set)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));
    let course = saved.map_or_else(Course::begin, |saved| saved.course());
    let mut recorder = if resume.is_some() {
        let among = if args.force { Among::OtherFiles } else { Among::Nothing };
        let (mut recorder, earlier) =
            Recorder::go_on(&folder, among, course.steps, &simulation).map_err(in_folder)?;
        let times = (times_s.as_slice(), next.is_none());
        let seen = (earlier.as_ref(), course.injected.as_slice());
        draw_again(&mut frames, (&scene, &cache), seen, (&folder, &simulation), times, &mut recorder)?;
        recorder
    } else {
        let recorder = record_anew(&folder, args.force, &simulation)?;
        if let Some(path) = &args.save_state {
            forget_state(path)?;
        }
        recorder
    };
    recorder.pack(sac, &simulation).map_err(in_folder)?;

    // From here on data are recorded and must be kept, whatever happens.
    let so_far = SoFar {
        scene: &scene,
        scene_file: &args.scene,
        script_file: args.script.as_deref(),
        script: &script,
        provenance,
        started,
        simulation,
        hand,
        frames,
        course,
        failure: None,
    };
    let interrupted = interrupts();
    let mut going = Going { so_far, recorder, saver, times_s, ahead: false };
    going.so_far.simulation.stop_when(|| interrupted.load(Ordering::Relaxed));
    let bar = if args.quiet { progress::hidden() } else { progress::bar(script.len(), "step") };
    bar.inc(going.so_far.course.steps as u64);
    going.begin()?;
    going.carry_out(next, interrupted, &bar);
    bar.finish_and_clear();
    reported::tell_end(args, &folder, going.end())
}

/// Whether there is a state to resume from. If not, the run starts from the beginning, so that a job script can
/// always use the same command.
fn is_there(path: &Path) -> bool {
    let there = path.symlink_metadata().is_ok();
    if !there {
        tell(format_args!(
            "endowire: --resume {}: is not there yet: the run begins from the start",
            path.display()
        ));
    }
    there
}

/// Removes the state of an earlier run, which must not be used if this run ends before saving its own.
fn forget_state(path: &Path) -> Result<(), Failure> {
    whole::remove(path).map_err(|e| Failure::write(path, &e))
}

/// Draws again the frames of a recording that resumes, with its injections, since the detector remembers earlier
/// frames. `times_s` are the end times of all steps so far.
fn draw_again(
    frames: &mut FrameWriter,
    (scene, cache): (&Scene, &Cache),
    (earlier, injected): (Option<&Recording>, &[InjectionRow]),
    (folder, simulation): (&Path, &Simulation),
    (times_s, ended): (&[f64], bool),
    recorder: &mut Recorder,
) -> Result<(), Failure> {
    let mut flowing = injected.iter().peekable();
    let Some(earlier) = earlier else {
        flowing.for_each(|one| frames.inject(one));
        if let Some(&time_s) = times_s.last() {
            let displacement = simulation.displacement();
            let (shape, inserted_mm) = (simulation.shape(), &simulation.report().lengths_mm()[..]);
            frames.stood(Drawn { shape, inserted_mm, displacement: displacement.as_ref() }, time_s)?;
        }
        return Ok(());
    };
    let before = recorder.steps() - earlier.steps();
    let lengths = Lengths::read(folder, simulation.stack())?;
    let vessel = RecordedVessel::read(folder, scene, simulation.lumen(), cache)?;
    for row in 1..=earlier.steps() {
        let step = before + row;
        let shape = earlier.shape(row);
        let lengths_mm = lengths.after(step, &shape)?;
        let last = ended && step == times_s.len();
        while let Some(one) = flowing.next_if(|one| one.after_step < step) {
            frames.inject(one);
        }
        let time_s = times_s[step - 1];
        let displacement = vessel.at(step, time_s);
        let seen = Drawn { shape: &shape, inserted_mm: &lengths_mm, displacement: displacement.as_ref() };
        frames.step((step, time_s), last, seen, recorder)?;
    }
    flowing.for_each(|one| frames.inject(one));
    Ok(())
}

/// The flag set by Ctrl-C or by a request to terminate: the current step is finished and recorded. A second request
/// ends the program at once. All callers share the flag.
pub(crate) fn interrupts() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static HEARD: Once = Once::new();
    HEARD.call_once(|| {
        // Without a handler, an interrupt ends the program at once.
        let _ = ctrlc::set_handler(|| {
            if FLAG.swap(true, Ordering::Relaxed) {
                std::process::exit(1);
            }
        });
    });
    &FLAG
}
