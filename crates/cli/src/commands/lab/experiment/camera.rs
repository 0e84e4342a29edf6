//! Numbered frames of both views of a simulation.

use std::path::{Path, PathBuf};

use endowire_core::insertion::Simulation;
use endowire_core::vessel::Wall;
use endowire_viewer::{DeviceView, Renderer, View, ViewSpec};

use crate::failure::Failure;

/// Draws into FOLDER/STEM_NN_VIEW.png.
pub(super) struct Camera {
    renderer: Renderer,
    stem: PathBuf,
    /// Paths of the frames.
    pub(super) frames: Vec<PathBuf>,
}

impl Camera {
    /// A camera with the angles and sizes of `spec`, which draws both views.
    pub(super) fn new(folder: &Path, stem: &str, spec: ViewSpec, wall: &Wall) -> Result<Self, Failure> {
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
        let spec = ViewSpec { views: vec![View::ThreeD, View::Fluoro], ..spec };
        Ok(Self { renderer: Renderer::of_wall(&spec, wall)?, stem: folder.join(stem), frames: Vec::new() })
    }

    /// Number of times it was used.
    pub(super) fn taken(&self) -> usize {
        self.frames.len() / 2
    }

    /// Draws the current state.
    pub(super) fn take(&mut self, simulation: &Simulation) -> Result<(), Failure> {
        let device = simulation.device();
        let view =
            DeviceView::from_shape(simulation.shape(), |from_tip| device.section_at(from_tip).radius_mm);
        let frames = self.renderer.render(&[view])?;
        let number = self.taken() + 1;
        for (name, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                let path = PathBuf::from(format!("{}_{number:02}_{name}.png", self.stem.display()));
                image.write_png(&path)?;
                self.frames.push(path);
            }
        }
        Ok(())
    }
}
