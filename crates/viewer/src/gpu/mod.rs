//! Frames through wgpu.

mod context;
mod fluoro;
mod later;
mod view3d;

use crate::engine::{Engines, process};
use crate::fluoro::SUBRAYS;
use crate::scene::Setup;
use context::Gpu;
use fluoro::GpuPaths;
pub use later::{Drawing, Graphics};
pub(crate) use view3d::GpuView3d;

/// Opens an adapter and prepares the views of `setup`; software adapters only if `software` allows them.
///
/// # Errors
/// Why there is no suitable adapter, as a clause.
pub(crate) fn engines(setup: &Setup, software: bool) -> Result<Engines, String> {
    let mut features = wgpu::Features::empty();
    if setup.c_arm.is_some() {
        features |= wgpu::Features::FLOAT32_BLENDABLE;
    }
    prepared(setup, &Gpu::open(features, software)?)
}

/// Prepares the views of `setup` on an open adapter.
fn prepared(setup: &Setup, gpu: &Gpu) -> Result<Engines, String> {
    let fluoro_size = setup.c_arm.as_ref().map(|c| c.size_px().map(|n| n * SUBRAYS));
    let camera_size = setup.camera.as_ref().map(|c| c.size_px);
    let needed = [fluoro_size, camera_size].into_iter().flatten().flatten().max().unwrap_or(0);
    if needed > gpu.largest_side {
        let (name, most, size) = (gpu.name(), gpu.largest_side, setup.spec.size_px);
        return Err(format!(
            "{name} draws at most {most} pixels a side, and view.size_px = {size:?} needs {needed}: make it smaller"
        ));
    }
    let paths = setup.c_arm.is_some().then(|| Box::new(GpuPaths::new(gpu)) as _);
    let three_d =
        setup.camera.as_ref().map(|camera| Box::new(GpuView3d::new(gpu, camera, setup.wall_now())) as _);
    let engines = Engines { paths, three_d, later: None, name: gpu.name().to_string(), process: process() };
    gpu.check().map_err(|e| format!("{}: {e}", gpu.name()))?;
    Ok(engines)
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::{View, ViewSpec};

    #[test]
    fn a_field_larger_than_the_adapter_draws_is_refused_with_the_key_and_the_remedy() {
        let Some(mut gpu) = context::tests::opened() else { return };
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let prepared = |view, side, gpu: &Gpu| {
            let spec = ViewSpec { views: vec![view], size_px: [side, 20], ..ViewSpec::default() };
            prepared(&Setup::new(&spec, &wall).unwrap(), gpu).map(drop)
        };
        gpu.largest_side = 64;
        // Fluoroscopy casts two rays per pixel in each direction.
        for (view, fits, too_large, needed) in [(View::Fluoro, 32, 33, 66), (View::ThreeD, 64, 65, 65)] {
            prepared(view, fits, &gpu).unwrap();
            let reason = prepared(view, too_large, &gpu).unwrap_err();
            let expected = format!(
                "draws at most 64 pixels a side, and view.size_px = [{too_large}, 20] needs {needed}: make it smaller"
            );
            assert!(reason.ends_with(&expected), "{reason}");
        }
    }
}
