//! `endowire fluoro`: frames of a scene, without a recording.

use std::path::Path;

use endowire_core::error::number;
use endowire_core::insertion::{Contact, DetachedCoil, Script, Simulation, Step, Tally};
use endowire_core::shape::Shape;
use endowire_core::vessel::{Displacement, VesselMotion};
use endowire_recording::InjectionRow;
use endowire_viewer::{ContactView, FrameTime, Moment, Seen};

use super::studio::{MOST_FRAMES, Plan, Still, Studio, Went};
use crate::args::{FluoroArgs, ViewChoice};
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::flowing;
use crate::output::{progress, refuse_recording};
use crate::scenes;

/// Latest time of a first frame, s: the longest wait of a script.
const LATEST_S: f64 = 1e6;

/// Carries out the script, then draws.
pub(crate) fn fluoro(args: &FluoroArgs) -> Result<(), Failure> {
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(args.scene.display());
    if !(1..=MOST_FRAMES).contains(&args.count) {
        return Err(Failure::Input(format!("--count {}: draw 1 to {MOST_FRAMES} frames", args.count)));
    }
    if !(0.0..=LATEST_S).contains(&args.time) {
        return Err(Failure::Input(format!("--time {}: must be from 0 to {LATEST_S} s", number(args.time))));
    }
    args.out.as_deref().map_or(Ok(()), refuse_recording)?;
    let (settings, _) = scenes::of_scene_and_view(&args.frames.set)?;
    let scene = scenes::read(&args.scene, &settings)?;
    let cache = Cache::new(&args.frames.cache);
    let script = scene.stack().and_then(|stack| scene.steps(&stack, &cache)).map_err(in_scene)?;
    let steps = args.steps.unwrap_or(script.len());
    if steps > script.len() {
        return Err(Failure::Input(format!("--steps {steps}: the script has {} steps", script.len())));
    }
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));
    let frames = args.count as usize;
    let plan = Plan::new("fluoro", &args.frames, (&args.scene, &scene), ViewChoice::Fluoro, folder, frames)?;
    plan.check_free((0..plan.frames()).map(still_name))?;
    // An empty vessel needs no wall for contact, which takes far longer to compute than a picture.
    let mut simulation = match steps {
        0 => None,
        _ => Some(scene.simulation(&cache).map_err(in_scene)?),
    };
    let wall = match &simulation {
        Some(simulation) => simulation.lumen().wall(&cache).map_err(in_scene)?.clone(),
        None => scene.wall(&cache).map_err(in_scene)?,
    };
    let motion = VesselMotion::new(&scene.vessel.motion).map_err(in_scene)?;
    let mut now = match &mut simulation {
        Some(simulation) => after(simulation, &script, steps, args, plan.frames_per_s())?,
        None => Now::default(),
    };
    let (frames, frames_per_s) = (plan.frames(), plan.frames_per_s());
    let injections = now.injections.iter().map(flowing);
    let mut studio = Studio::new(plan, wall, injections, (&scene, &cache))?;
    scenes::tell_found(&args.scene, &scene);
    for k in 0..frames {
        let since_s = k as f64 / frames_per_s;
        let time_s = args.time + since_s;
        let before = now.seen();
        match (&mut simulation, &motion) {
            // An empty vessel moves by the clock of its medium.
            (None, Some(motion)) => now.displacement = Some(motion.at(time_s)),
            (Some(simulation), Some(motion)) if k > 0 && motion.changes() => {
                now.follow(simulation, 1.0 / frames_per_s)
                    .map_err(|e| Failure::Computation(format!("{}: frame {k}: {e}", args.scene.display())))?;
            }
            _ => {}
        }
        studio.draw(&Still {
            name: still_name(k),
            moment: Moment {
                frame: FrameTime { frame: k as u64, time_s },
                shape: &now.shape,
                inserted_mm: &now.inserted_mm,
                coils: &now.coils,
                contacts: &now.contacts,
                displacement: now.displacement.as_ref(),
                before: before.as_ref().filter(|_| k > 0).map(|(shape, inserted_mm)| Seen {
                    shape,
                    inserted_mm,
                    time_s: time_s - 1.0 / frames_per_s,
                }),
            },
        })?;
    }
    let mut written = studio.finish()?;
    let (taken, kept) = (now.steps, format!("the frames are in {}", written.folder.display()));
    written.went = (taken > 0).then_some(Went { steps: taken, tally: now.tally });
    written.tell(args.frames.json)?;
    let allowed = args.convergence.allow_unconverged;
    scenes::check_converged(args.scene.display(), &now.tally, taken, allowed, kept)
}

/// Beginning of the names of the files of a frame.
fn still_name(k: usize) -> String {
    format!("frame_{k:06}")
}

/// The state in which frames are drawn.
#[derive(Default)]
struct Now {
    shape: Shape,
    inserted_mm: Vec<f64>,
    coils: Vec<DetachedCoil>,
    contacts: Vec<ContactView>,
    injections: Vec<InjectionRow>,
    /// Displacement of the vessel.
    displacement: Option<Displacement>,
    /// Number of steps carried out, and their statistics.
    steps: usize,
    tally: Tally,
}

impl Now {
    /// The devices as they are, if any are in.
    fn seen(&self) -> Option<(Shape, Vec<f64>)> {
        (!self.inserted_mm.is_empty()).then(|| (self.shape.clone(), self.inserted_mm.clone()))
    }

    /// Lets the vessel move on while hands rest; the devices follow it.
    fn follow(&mut self, simulation: &mut Simulation, duration_s: f64) -> endowire_core::Result<()> {
        let time_s = Some(simulation.time_s() + duration_s);
        let rest = Step { moves: vec![].into(), detach: None, solves: None, time_s, duration_s };
        rest.carry_out(simulation)?;
        self.steps += 1;
        self.tally.count(self.steps, simulation);
        self.take(simulation);
        Ok(())
    }

    /// Takes the shape of the devices and the vessel's place.
    fn take(&mut self, simulation: &Simulation) {
        let report = simulation.report();
        let contact = |c: &Contact| ContactView { position_mm: c.position_mm, force_n: c.total_n() };
        self.shape = simulation.shape().clone();
        self.inserted_mm = report.lengths_mm();
        self.coils = simulation.coils().to_vec();
        self.contacts = report.contacts.iter().map(contact).collect();
        self.displacement = simulation.displacement();
    }
}

/// Carries out the first steps of the script.
fn after(
    simulation: &mut Simulation,
    script: &Script,
    steps: usize,
    args: &FluoroArgs,
    frames_per_s: f64,
) -> Result<Now, Failure> {
    let bar = progress::bar(steps, "step");
    let mut run = script.begin();
    let (mut injections, mut taken, mut tally) = (Vec::new(), 0, Tally::default());
    for index in 0..=steps {
        let step = run.next(simulation)?.map(Step::into_owned);
        injections.extend(InjectionRow::begun(&run, injections.len(), frames_per_s, simulation));
        // A condition may have ended the script earlier.
        let Some(step) = step.filter(|_| index < steps) else { break };
        step.carry_out(simulation).map_err(|e| {
            Failure::Computation(format!("{}: step {}: {e}", args.scene.display(), index + 1))
        })?;
        run.carried_out();
        taken += 1;
        tally.count(taken, simulation);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut now = Now { injections, steps: taken, tally, ..Now::default() };
    now.take(simulation);
    Ok(now)
}
