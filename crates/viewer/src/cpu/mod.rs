//! Frames without any adapter: the exact fluoroscopic reference and a software rasteriser for the 3D view.

mod band;
mod cells;
mod coverage;
mod devices;
mod fluoro;
mod lumen;
mod piece;
mod raster;
mod view3d;
mod wall;

pub(crate) use cells::{CELLS, DeviceCells, quarter};
pub(crate) use coverage::Coverage;
pub(crate) use devices::layers_in_beam;
pub(crate) use fluoro::CpuPaths;
pub(crate) use lumen::covered_by_half;
#[cfg(feature = "gpu")]
pub(crate) use raster::GRID;
pub(crate) use raster::ScreenTriangle;
#[cfg(feature = "gpu")]
pub(crate) use wall::seen;
pub(crate) use wall::{check_closed, check_drawable, wall_crossings};

use endowire_core::vessel::SurfaceMesh;

use crate::engine::{Engines, ThreeDEngine, process};
use crate::three_d::Camera;
use view3d::CpuView3d;

/// Name of the CPU engine for display.
pub(crate) const NAME: &str = "CPU reference";

/// Prepares the fluoroscopic view if wanted; the 3D view is created with the first frame ([`three_d`]).
pub(crate) fn engines(fluoro: bool) -> Engines {
    let paths = fluoro.then(|| Box::new(CpuPaths) as _);
    Engines {
        paths,
        three_d: None,
        #[cfg(feature = "gpu")]
        later: None,
        name: NAME.into(),
        process: process(),
    }
}

/// The 3D view with the picture of the wall.
pub(crate) fn three_d(camera: &Camera, wall: &SurfaceMesh) -> Box<dyn ThreeDEngine> {
    Box::new(CpuView3d::new(camera, wall))
}
