//! Frames through wgpu.

mod context;
mod fluoro;
mod view3d;

use crate::fluoro::SUBRAYS;
use crate::renderer::Engines;
use crate::scene::Setup;
use context::Gpu;
use fluoro::GpuPaths;
use view3d::GpuView3d;

/// Opens an adapter and prepares the views of `setup`; software adapters only where `software` allows them.
///
/// # Errors
/// Why there is no fitting adapter, as a clause.
pub(crate) fn engines(setup: &Setup, software: bool) -> Result<Engines, String> {
    let mut features = wgpu::Features::empty();
    if setup.c_arm.is_some() {
        features |= wgpu::Features::FLOAT32_BLENDABLE;
    }
    let gpu = Gpu::open(features, software)?;
    let fluoro_size = setup.c_arm.as_ref().map(|c| c.size_px().map(|n| n * SUBRAYS));
    let camera_size = setup.camera.as_ref().map(|c| c.size_px);
    let most = gpu.device.limits().max_texture_dimension_2d;
    for side in [fluoro_size, camera_size].into_iter().flatten().flatten() {
        if side > most {
            return Err(format!("{} draws at most {most} pixels a side, {side} are needed", gpu.name()));
        }
    }
    let paths = setup.c_arm.is_some().then(|| Box::new(GpuPaths::new(&gpu)) as _);
    let three_d =
        setup.camera.as_ref().map(|camera| Box::new(GpuView3d::new(&gpu, camera, &setup.wall)) as _);
    let engines = Engines { paths, three_d, name: gpu.name().to_string() };
    gpu.check().map_err(|e| format!("{}: {e}", gpu.name()))?;
    Ok(engines)
}
