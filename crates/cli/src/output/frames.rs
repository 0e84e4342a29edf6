//! Frames: the scene's `[view]` table, the renderer it asks for, and the files.

use std::io;
use std::path::Path;

use endowire_core::Error;
use endowire_core::insertion::{Script, Simulation};
use endowire_core::shape::Shape;
use endowire_core::vessel::Wall;
use endowire_methods::Scene;
use endowire_viewer::{Moment, Pushed, Renderer, View, ViewSpec};

use super::injections::Injected;
use super::recorder::Recorder;
use crate::failure::Failure;

/// Draws the steps of a run that the scene wants to see.
pub(crate) struct FrameWriter {
    spec: ViewSpec,
    pushed: Pushed,
    /// Of the vessel, if any view is asked for: else nothing is built.
    wall: Option<Wall>,
    renderer: Option<Renderer>,
    /// Whether medium flows that the renderer does not know.
    injected: bool,
}

impl FrameWriter {
    /// Prepares what the scene file asks for; without a simulation nothing is drawn.
    pub(crate) fn new(path: &Path, scene: &Scene, drawn: Option<&Simulation>) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        let spec = ViewSpec::of_scene(scene, path)?;
        spec.validate().map_err(in_scene)?;
        let drawn = drawn.filter(|_| !spec.views.is_empty());
        let wall = drawn.map(|simulation| simulation.wall().clone());
        let renderer =
            wall.as_ref().map(|wall| Renderer::of_wall(&spec, wall)).transpose().map_err(in_scene)?;
        let pushed = Pushed::new(scene, &spec).map_err(in_scene)?;
        Ok(Self { pushed, spec, wall, renderer, injected: false })
    }

    /// What draws, for the summary.
    pub(crate) fn renderer(&self) -> Option<String> {
        self.renderer.as_ref().map(|r| r.backend().to_owned())
    }

    /// Refuses a script that injects where its frames could not show it.
    pub(crate) fn check(&self, script: &Script) -> Result<(), Error> {
        if script.injects() && self.spec.wants(View::Fluoro) && self.spec.flow.tree.is_none() {
            let mend = "a line of the script injects, and contrast medium flows along a centre line: give the vessel's";
            return Err(Error::parameter("view.flow.tree", "none", mend));
        }
        Ok(())
    }

    /// Lets medium flow in the frames from the next on.
    pub(crate) fn inject(&mut self, injected: &Injected) {
        self.spec.injection.push(injected.spec());
        self.injected = true;
    }

    /// Time at the end of a step whose script has no speeds, s: that of its frame.
    pub(crate) fn time_s(&self, step: usize) -> f64 {
        step as f64 / self.spec.frames_per_s
    }

    /// Writes the frames of step `step`, which ends at `time_s`, if they are due; the last step always is.
    pub(crate) fn step(
        &mut self,
        (step, time_s): (usize, f64),
        last: bool,
        (shape, inserted_mm): (&Shape, &[f64]),
        recorder: &mut Recorder,
    ) -> Result<(), Failure> {
        let due = last || step.is_multiple_of(self.spec.every as usize);
        if let (true, true, Some(wall)) = (due, self.injected, &self.wall) {
            // What it remembers is of a vessel without: masks are taken anew, as for every injection in a room.
            self.renderer = Some(Renderer::of_wall(&self.spec, wall)?);
            self.injected = false;
        }
        let Some(renderer) = self.renderer.as_mut().filter(|_| due) else { return Ok(()) };
        let views = self.pushed.views(shape, inserted_mm);
        let moment = Moment { frame: step as u64, time_s };
        let frames = renderer.render_at(&views, moment)?;
        for (name, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                recorder.frame(step, name, |path| image.write_png(path).map_err(bare))?;
            }
        }
        Ok(())
    }
}

/// What the system said, without the path that it said it of.
fn bare(error: Error) -> io::Error {
    match error {
        Error::File { source, .. } => source,
        other => io::Error::other(other.to_string()),
    }
}
