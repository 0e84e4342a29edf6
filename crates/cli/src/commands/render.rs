//! `endowire render`: frames of a recorded run.

use std::path::Path;

use endowire_core::vessel::Lumen;
use endowire_recording::{
    InjectionRow, Lengths, RecordedVessel, Recording, WallContact, coils_after, read_coils,
};
use endowire_viewer::{ContactView, FrameTime, Moment, Seen, largest_force_n};

use super::studio::{Plan, Still, Studio};
use crate::args::{RenderArgs, ViewChoice};
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::flowing;
use crate::output::{progress, refuse_recording, tell};
use crate::scenes;

/// Draws the requested steps.
pub(crate) fn render(args: &RenderArgs) -> Result<(), Failure> {
    let recording = scenes::recording(&args.dir, args.scene.as_deref())?;
    args.out.as_deref().map_or(Ok(()), refuse_recording)?;
    let (settings, _) = scenes::of_scene_and_view(&args.frames.set)?;
    scenes::check_recorded(&settings)?;
    let (path, scene) = scenes::of_recording(recording.about(), args.scene.as_deref(), &settings)?;
    tell_of(args, &recording, &path)?;
    if recording.steps() == 0 {
        return Err(Failure::Input(format!(
            "{}: the run has recorded no step; run its scene again (endowire run)",
            args.dir.display()
        )));
    }
    let times_s = recording.step_times()?;
    // A run that was resumed in a folder of its own begins after the steps before it.
    let earlier = times_s.first().map_or(0, |(first, _)| first.saturating_sub(1));
    let steps = wanted(args, &recording, earlier)?;
    let frames = match (steps.len(), args.count.map(|count| count as usize)) {
        (1, count) => count.unwrap_or(1),
        (several, None) if args.frames.deg_per_s.is_none() => several,
        (several, _) => {
            let text = format!(
                "--count and --deg-per-s belong to one step, and {several} are drawn: give it as --from and --to"
            );
            return Err(Failure::Input(text));
        }
    };
    let folder = args.out.clone().unwrap_or_else(|| args.dir.join("render"));
    let cache = Cache::new(&args.frames.cache);
    let wall = scene.wall(&cache).map_err(|e| Failure::from(e).at(path.display()))?;
    let lumen = Lumen::from(wall.clone());
    let vessel = RecordedVessel::read(&args.dir, &scene, &lumen, &cache)?;
    let seen = (path.as_path(), &scene);
    let plan = Plan::new("render", &args.frames, seen, ViewChoice::Both, folder, frames)?;
    let (frames, frame_s) = (plan.frames(), 1.0 / plan.frames_per_s());
    let ended_s = |step: usize| times_s[step - earlier - 1].1;
    // Either all frames show one step, or each frame shows its own step.
    let one = steps.len() == 1 && frames > 1;
    let moment = |k: usize| {
        let (step, later) = if one { (steps[0], k) } else { (steps[k], 0) };
        FrameTime { frame: (step + later) as u64, time_s: ended_s(step) + later as f64 * frame_s }
    };
    // One scale for all arrows: the largest force of what is drawn.
    let shown = if one { &steps[..1] } else { &steps[..] };
    let largest = shown.iter().map(|step| largest_force_n(&contact_views(&recording, step - earlier)));
    let plan = plan.with_forces_up_to(largest.fold(0.0, f64::max));
    let plan = plan.at(&(0..frames).map(|k| moment(k).time_s).collect::<Vec<_>>());
    let still_name = |k: usize| match one {
        true => format!("step_{:06}_frame_{k:06}", steps[0]),
        false => format!("step_{:06}", steps[k]),
    };
    plan.check_free((0..frames).map(still_name))?;
    let injections = InjectionRow::read(&args.dir)?;
    let injections = injections.iter().map(flowing);
    let mut studio = Studio::new(plan, wall, injections, (&scene, &cache))?;
    scenes::tell_found(&path, &scene);
    let stack = scene.stack().map_err(|e| Failure::from(e).at(path.display()))?;
    let lengths = Lengths::read(&args.dir, &stack)?;
    let left = read_coils(&args.dir, &stack)?;
    let bar = progress::bar(frames, "frame");
    // The last step whose tip was passed on.
    let mut reported = earlier;
    for k in 0..frames {
        let step = if one { steps[0] } else { steps[k] };
        while studio.follows_tip() && reported < step {
            reported += 1;
            let (shape, time_s) = (recording.shape(reported - earlier), ended_s(reported));
            let inserted_mm = &lengths.after(reported, &shape)?;
            let displacement = vessel.at(reported, time_s);
            studio.follow_tip(Seen { shape: &shape, inserted_mm, time_s }, displacement.as_ref())?;
        }
        let contacts = contact_views(&recording, step - earlier);
        let shape = recording.shape(step - earlier);
        let inserted_mm = lengths.after(step, &shape)?;
        // The device rests in a step that is drawn several times.
        let before = match step.checked_sub(1).filter(|before| *before > earlier && !one) {
            Some(before) => {
                let shape = recording.shape(before - earlier);
                Some((lengths.after(before, &shape)?, shape, ended_s(before)))
            }
            None => None,
        };
        let before = before.as_ref();
        // The vessel rests too in a step that is drawn several times.
        let displacement = vessel.at(step, ended_s(step));
        studio.draw(&Still {
            name: still_name(k),
            moment: Moment {
                frame: moment(k),
                shape: &shape,
                inserted_mm: &inserted_mm,
                coils: &coils_after(&left, step),
                contacts: &contacts,
                displacement: displacement.as_ref(),
                before: before.map(|(inserted_mm, shape, time_s)| Seen {
                    shape,
                    inserted_mm,
                    time_s: *time_s,
                }),
            },
        })?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    studio.finish()?.tell(args.frames.json)
}

/// The contacts of a recorded step, by its row.
fn contact_views(recording: &Recording, row: usize) -> Vec<ContactView> {
    let view = |one: WallContact| ContactView { position_mm: one.position_mm, force_n: one.force_n };
    recording.contacts(row).into_iter().map(view).collect()
}

/// Warns about a recording that is drawn in this scene.
fn tell_of(args: &RenderArgs, recording: &Recording, path: &Path) -> Result<(), Failure> {
    let (about, dir, steps) = (recording.about(), args.dir.display(), recording.steps());
    let given = args.scene.as_deref();
    if let Some(other) = scenes::other_than_recorded(about, &args.dir, given, path)? {
        tell(format_args!("endowire: {other}"));
    }
    if !about.is_complete() {
        tell(format_args!(
            "endowire: the run in {dir} goes on or was ended from outside: {steps} steps of it are recorded"
        ));
    }
    if about.unconverged_steps > 0 {
        tell(format_args!(
            "endowire: {} of the {steps} steps in {dir} are no equilibria: steps.csv says which (converged)",
            about.unconverged_steps
        ));
    }
    Ok(())
}

/// The recorded steps to draw, always including the last one requested. A run that goes on may be asked for steps that
/// it has not reached. So many steps were `earlier` than those recorded.
fn wanted(args: &RenderArgs, recording: &Recording, earlier: usize) -> Result<Vec<usize>, Failure> {
    let recorded = earlier + recording.steps();
    let first = earlier + 1;
    let from = args.from.unwrap_or(first);
    let to = args.to.unwrap_or(recorded);
    let last = to.min(recorded);
    let beyond = to > recorded && recording.about().is_complete();
    if args.to.is_some_and(|to| from > to) {
        return Err(Failure::Input(format!(
            "--from {from} --to {to}: the last step to draw comes before the first: give --to a step from {from} on"
        )));
    }
    if args.every == 0 {
        return Err(Failure::Input("--every 0: must be 1 or more: every so many steps are drawn".to_owned()));
    }
    if from < first || from > last || beyond {
        return Err(Failure::Input(format!(
            "--from {from} --to {to}: {} has steps {first} to {}",
            args.dir.display(),
            recorded
        )));
    }
    let mut steps: Vec<usize> = (from..=last).step_by(args.every).collect();
    if steps.last() != Some(&last) {
        steps.push(last);
    }
    Ok(steps)
}
