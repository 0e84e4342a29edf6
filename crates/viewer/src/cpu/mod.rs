//! Frames without any adapter: the exact fluoroscopic reference and a software rasteriser for the 3D view.

mod devices;
mod fluoro;
mod piece;
mod raster;
mod view3d;
mod wall;

use std::sync::Arc;

pub(crate) use devices::{pieces_in_beam, pixels_of};
pub(crate) use wall::{check_closed, check_drawable, wall_path_mm};

use crate::renderer::Engines;
use crate::scene::Setup;
use fluoro::CpuFluoro;
use view3d::CpuView3d;

/// Prepares the views of `setup`.
pub(crate) fn engines(setup: &Setup) -> Engines {
    let mut engines = Engines { fluoro: None, three_d: None, name: "CPU reference".into() };
    if let Some(fluoro) = &setup.fluoro {
        engines.fluoro = Some(Box::new(CpuFluoro::new(fluoro, Arc::clone(&setup.wall))));
    }
    if let Some(camera) = &setup.camera {
        engines.three_d = Some(Box::new(CpuView3d::new(camera, &setup.wall)));
    }
    engines
}
