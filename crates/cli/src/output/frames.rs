//! Frames: the scene's `[view]` table, its renderers, and the files.

use std::path::Path;

use endowire_core::insertion::{Script, Simulation};
use endowire_core::shape::Shape;
use endowire_core::vessel::{Displacement, Wall};
use endowire_core::{Error, Vec3};
use endowire_methods::Scene;
use endowire_recording::{InjectionRow, Plane, Recorder};
use endowire_viewer::{
    Exposure, FrameTime, InjectionSpec, Mode, Moment, Pushed, Renderer, Seen, View, ViewSpec,
};

use super::{film, in_folder};
use crate::cache::Cache;
use crate::failure::Failure;
use crate::scenes;

/// Draws the frames of a run that the scene requests.
pub(crate) struct FrameWriter {
    spec: ViewSpec,
    pushed: Pushed,
    /// Wall of the vessel; `None` if no view is requested, to save the work.
    wall: Option<Wall>,
    /// The renderers of one or two planes; empty if no view is requested, to save the work.
    planes: Vec<Renderer>,
    /// State after the previous step, if pulses show the motion since then.
    before: Option<Before>,
    /// Whether there are injections that the renderers do not know yet.
    injected: bool,
    /// Material places of the tip after each step, with times, s; kept if the scene injects through it.
    tips: Vec<(f64, Vec3)>,
}

/// What is drawn of a step: the line, the inserted lengths, mm, and the displacement of the vessel if it ever moves.
#[derive(Clone, Copy)]
pub(crate) struct Drawn<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) inserted_mm: &'a [f64],
    pub(crate) displacement: Option<&'a Displacement>,
}

/// The state after a step, with its time.
struct Before {
    shape: Shape,
    inserted_mm: Vec<f64>,
    time_s: f64,
}

/// A recorded injection in the pictures.
pub(crate) fn flowing(injected: &InjectionRow) -> InjectionSpec {
    InjectionSpec {
        start_s: injected.time_s,
        duration_s: injected.volume_ml / injected.rate_ml_per_s,
        rate_ml_per_s: injected.rate_ml_per_s,
        at_mm: Some([injected.tip_x_mm, injected.tip_y_mm, injected.tip_z_mm]),
        at_tip: false,
    }
}

/// One renderer for each plane.
fn planes(spec: &ViewSpec, wall: &Wall) -> Result<Vec<Renderer>, Error> {
    spec.planes().iter().map(|plane| Renderer::of_wall(plane, wall)).collect()
}

/// A message on how much of the vessel lies in the patient's tomogram; `None` without a tomogram.
pub(crate) fn tomogram_holds(renderer: &Renderer) -> Option<String> {
    let part = renderer.vessel_held()?;
    Some(format!("the tomogram (view.patient.ct) holds {:.0} % of the vessel's surface", 100.0 * part))
}

impl FrameWriter {
    /// Prepares the views that the scene file requests; nothing is drawn without a simulation.
    pub(crate) fn new(
        path: &Path,
        scene: &Scene,
        drawn: Option<&Simulation>,
        store: &Cache,
    ) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        let mut spec = ViewSpec::of_scene(scene, path)?;
        spec.validate().map_err(in_scene)?;
        let drawn = drawn.filter(|_| !spec.views.is_empty());
        if drawn.is_some() && spec.wants(View::Fluoro) {
            scenes::let_medium_flow(&mut spec, scene, store).map_err(in_scene)?;
        }
        let wall = drawn.map(|simulation| simulation.lumen().wall(store).cloned());
        let wall = wall.transpose().map_err(in_scene)?;
        let planes = wall.as_ref().map_or(Ok(Vec::new()), |wall| planes(&spec, wall)).map_err(in_scene)?;
        let pushed = Pushed::new(scene, &spec).map_err(in_scene)?;
        Ok(Self { spec, pushed, wall, planes, before: None, injected: false, tips: vec![] })
    }

    /// Refuses a roadmap whose first frame may be drawn before anything is injected, by the scene or by its script: there
    /// would be no angiogram to show.
    pub(crate) fn check_angiogram(&self, script: Option<&Script>) -> Result<(), Error> {
        let shows = self.spec.xray.mode == Mode::Roadmap && self.spec.wants(View::Fluoro);
        if self.planes.is_empty() || !shows || !self.spec.injection.is_empty() {
            return Ok(());
        }
        let refused = |remedy: String| Err(Error::parameter("view.xray.mode", "roadmap", remedy));
        let injects = script.and_then(|script| Some((script.steps_before_injection()?, script.len())));
        let Some((before, all)) = injects else {
            let remedy = "a roadmap shows an angiogram: give a [[view.injection]], or in endowire run inject in a line of the script";
            return refused(remedy.to_owned());
        };
        let first = (self.spec.every as usize).min(all);
        if before < first {
            return Ok(());
        }
        let later = if before < all { format!(", or set view.every above {before}") } else { String::new() };
        refused(format!(
            "a roadmap shows an angiogram, and the script injects after as many as {before} steps, when that of step {first} is drawn already: \
             inject before, give a [[view.injection]]{later}"
        ))
    }

    /// Name of the backend, for the summary.
    pub(crate) fn renderer(&self) -> Option<String> {
        self.planes.first().map(|r| r.backend().to_owned())
    }

    /// A message on how much of the vessel lies in the patient's tomogram; `None` without a tomogram.
    pub(crate) fn held(&self) -> Option<String> {
        self.planes.first().and_then(tomogram_holds)
    }

    /// Geometry of each plane of fluoroscopy, for the summary.
    pub(crate) fn planes(&self) -> Vec<Plane<Exposure>> {
        let arms = self.planes.iter().filter_map(|plane| Some((plane.c_arm()?, plane.exposure())));
        let reported = arms.map(|(arm, exposure)| {
            let [primary_deg, secondary_deg] = arm.angles_deg();
            Plane { primary_deg, secondary_deg, camera_matrix: arm.matrix(), exposure }
        });
        reported.collect()
    }

    /// Adds an injection, from the next frame on.
    pub(crate) fn inject(&mut self, injected: &InjectionRow) {
        self.spec.injection.push(flowing(injected));
        self.injected = true;
    }

    /// Frames per second; steps per second of a script without speeds.
    pub(crate) fn frames_per_s(&self) -> f64 {
        self.spec.frames_per_s
    }

    /// Time at the end of a step if the script has no speeds, s: that of its frame.
    pub(crate) fn time_s(&self, step: usize) -> f64 {
        step as f64 / self.spec.frames_per_s
    }

    /// Writes the frames of step `step`, which ends at `time_s`, if they are due; those of the last step always are.
    pub(crate) fn step(
        &mut self,
        (step, time_s): (usize, f64),
        last: bool,
        seen: Drawn<'_>,
        recorder: &mut Recorder,
    ) -> Result<(), Failure> {
        let due = last || step.is_multiple_of(self.spec.every as usize);
        let drawn = if due { self.draw((step, time_s), seen, recorder) } else { Ok(()) };
        self.stood(seen, time_s).and(drawn)
    }

    /// Combines all frames to a film, if the scene requests one; returns its name in the folder.
    pub(crate) fn film(&self, recorder: &Recorder) -> Result<Option<String>, Failure> {
        let Some(kind) = &self.spec.film else { return Ok(None) };
        film::write(recorder.folder(), kind, recorder.frames(), self.spec.frames_per_s)
    }

    /// Stores the state at a time: a pulse of the next step shows the motion since then, and injections at the tip
    /// start from its position then.
    pub(crate) fn stood(
        &mut self,
        Drawn { shape, inserted_mm, displacement }: Drawn<'_>,
        time_s: f64,
    ) -> Result<(), Failure> {
        if self.planes.is_empty() {
            return Ok(());
        }
        if self.spec.injects_at_tip()
            && let Some(tip_mm) = self.pushed.tip_at_rest_mm(shape, inserted_mm, displacement)
        {
            self.tips.push((time_s, tip_mm));
            self.planes.iter_mut().try_for_each(|plane| plane.follow_tip(time_s, tip_mm))?;
        }
        if self.spec.xray.pulse_ms > 0.0 {
            self.before = Some(Before { shape: shape.clone(), inserted_mm: inserted_mm.to_vec(), time_s });
        }
        Ok(())
    }

    fn draw(
        &mut self,
        (step, time_s): (usize, f64),
        Drawn { shape, inserted_mm, displacement }: Drawn<'_>,
        recorder: &mut Recorder,
    ) -> Result<(), Failure> {
        if let (true, Some(wall)) = (self.injected, &self.wall) {
            // The renderers' masks show a vessel without medium; new renderers make new ones, as for every injection
            // in a cath lab.
            self.planes = planes(&self.spec, wall)?;
            for plane in &mut self.planes {
                self.tips.iter().try_for_each(|(then_s, place_mm)| plane.follow_tip(*then_s, *place_mm))?;
            }
            self.injected = false;
        }
        let before = self.before.as_ref();
        let before = before.map(|b| Seen { shape: &b.shape, inserted_mm: &b.inserted_mm, time_s: b.time_s });
        for (plane, names) in self.planes.iter_mut().zip([["3d", "fluoro"], ["3d_b", "fluoro_b"]]) {
            let moment = Moment {
                frame: FrameTime { frame: step as u64, time_s },
                shape,
                inserted_mm,
                coils: recorder.coils(),
                contacts: &[],
                displacement,
                before,
            };
            let frames = plane.draw(&mut self.pushed, &moment)?;
            for (name, image) in names.into_iter().zip([&frames.three_d, &frames.fluoro]) {
                if let Some(image) = image {
                    recorder.frame(step, name, |path| image.write_png(path)).map_err(in_folder)?;
                }
            }
        }
        Ok(())
    }
}
