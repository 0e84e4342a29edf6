//! Frames without any adapter: the exact fluoroscopic reference and a software rasteriser for the 3D view.

mod devices;
mod fluoro;
mod piece;
mod raster;
mod view3d;
mod wall;

use endowire_core::Result;

pub(crate) use devices::{pieces_in_beam, pixels_of};
pub(crate) use wall::{check_closed, wall_path_mm};

use crate::image::Image;
use crate::renderer::Engine;
use crate::scene::{RefinedDevice, Setup};
use fluoro::CpuFluoro;
use view3d::CpuView3d;

/// The plain Rust engine.
#[derive(Debug)]
pub(crate) struct CpuEngine {
    fluoro: Option<CpuFluoro>,
    three_d: Option<CpuView3d>,
}

impl CpuEngine {
    pub(crate) fn new(setup: &Setup) -> Self {
        Self {
            fluoro: setup.fluoro.as_ref().map(|f| CpuFluoro::new(&f.c_arm, &f.beam, &setup.wall)),
            three_d: setup.camera.as_ref().map(|camera| CpuView3d::new(camera, &setup.wall)),
        }
    }
}

impl Engine for CpuEngine {
    fn describe(&self) -> String {
        "CPU reference".into()
    }

    fn fluoro(&mut self, devices: &[RefinedDevice]) -> Result<Option<Image>> {
        self.fluoro.as_mut().map(|f| f.frame(devices)).transpose()
    }

    fn three_d(&mut self, devices: &[RefinedDevice]) -> Result<Option<Image>> {
        Ok(self.three_d.as_mut().map(|view| view.frame(devices)))
    }

    fn lumen_path(&mut self, setup: &Setup) -> Result<Vec<f32>> {
        let Some(f) = &setup.fluoro else { return Ok(vec![]) };
        Ok(wall_path_mm(&f.c_arm, &setup.wall).into_iter().map(|v| v as f32).collect())
    }

    fn device_path(&mut self, setup: &Setup, device: &RefinedDevice) -> Result<Vec<f32>> {
        let Some(f) = &setup.fluoro else { return Ok(vec![]) };
        Ok(fluoro::device_path_mm(&f.c_arm, device)?.into_iter().map(|v| v as f32).collect())
    }
}
