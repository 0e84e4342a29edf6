//! Frames: the scene's `[view]` table, the renderer it asks for, and the files.

use std::io;
use std::path::Path;

use endowire_core::Error;
use endowire_core::insertion::Simulation;
use endowire_core::shape::Shape;
use endowire_methods::Scene;
use endowire_viewer::{Moment, Pushed, Renderer, ViewSpec};

use super::recorder::Recorder;
use crate::failure::Failure;

/// Draws the steps of a run that the scene wants to see.
pub(crate) struct FrameWriter {
    spec: ViewSpec,
    pushed: Pushed,
    /// None where no view is asked for: then nothing is built.
    renderer: Option<Renderer>,
}

impl FrameWriter {
    /// Prepares what the scene file asks for; without a simulation nothing is drawn.
    pub(crate) fn new(path: &Path, scene: &Scene, drawn: Option<&Simulation>) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        let spec = ViewSpec::of_scene(scene, path)?;
        spec.validate().map_err(in_scene)?;
        let drawn = drawn.filter(|_| !spec.views.is_empty());
        let renderer = drawn.map(|simulation| Renderer::of_wall(&spec, simulation.wall()));
        let renderer = renderer.transpose().map_err(in_scene)?;
        Ok(Self { pushed: Pushed::new(scene, &spec).map_err(in_scene)?, spec, renderer })
    }

    /// What draws, for the summary.
    pub(crate) fn renderer(&self) -> Option<String> {
        self.renderer.as_ref().map(|r| r.backend().to_owned())
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
