//! Frames of a run: the scene's `[view]` table, the renderer it asks for, and the PNG files.

use std::path::Path;

use endowire_core::input::from_toml;
use endowire_core::insertion::Simulation;
use endowire_viewer::{DeviceView, Renderer, ViewSpec};
use serde::Deserialize;

use super::recorder::Recorder;
use crate::failure::Failure;

/// The part of a scene file that is the viewer's; the core reads the rest.
#[derive(Deserialize)]
struct ViewTable {
    #[serde(default)]
    view: ViewSpec,
}

/// Draws the steps that the scene wants to see.
pub(crate) struct FrameWriter {
    every: usize,
    /// None where no view is asked for: then nothing is built.
    renderer: Option<Renderer>,
}

impl FrameWriter {
    /// Prepares what the scene file asks for.
    pub(crate) fn new(scene: &Path, simulation: &Simulation) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(scene.display());
        let (ViewTable { view }, _) = from_toml(scene)?;
        view.validate().map_err(in_scene)?;
        let renderer = if view.views.is_empty() {
            None
        } else {
            Some(Renderer::new(&view, &simulation.wall().closed_mesh()).map_err(in_scene)?)
        };
        Ok(Self { every: view.every as usize, renderer })
    }

    /// What draws, for the summary.
    pub(crate) fn renderer(&self) -> Option<String> {
        self.renderer.as_ref().map(|r| r.backend().to_owned())
    }

    /// Writes the frames of step `step` if they are due; the last step always is.
    pub(crate) fn step(
        &mut self,
        step: usize,
        last: bool,
        simulation: &Simulation,
        recorder: &mut Recorder,
    ) -> Result<(), Failure> {
        let Some(renderer) = self.renderer.as_mut().filter(|_| last || step.is_multiple_of(self.every))
        else {
            return Ok(());
        };
        let device = simulation.device();
        let view = DeviceView::from_shape(simulation.shape(), |from_tip_mm| {
            device.section_at(from_tip_mm).radius_mm
        });
        let frames = renderer.render(&[view])?;
        for (name, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                recorder.frame(name, |path| Ok(image.write_png(path)?))?;
            }
        }
        Ok(())
    }
}
