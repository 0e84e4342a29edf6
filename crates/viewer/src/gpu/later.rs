//! A graphics processor with asynchronous results, as in a browser: the static anatomy is requested at once, and
//! awaited.
//!
//! The requesting code is that which casts rays synchronously ([`Anatomy::new`]): run once with an engine that
//! submits everything and returns nothing, and again with one that has the results.

use std::sync::{Mutex, PoisonError};

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result};

use crate::c_arm::CArm;
use crate::engine::PathEngine;
use crate::fluoro::{Anatomy, SUBRAYS};
use crate::gpu::context::{Gpu, Reading};
use crate::gpu::fluoro::{GpuPaths, lengths};
use crate::gpu::view3d::GpuView3d;
use crate::output::Image;
use crate::scene::Setup;
use crate::spec::CameraSpec;
use crate::three_d::{Camera, ContactView, annotate};

/// An open graphics processor with asynchronous results ([`Renderer::prepare_on`](crate::Renderer::prepare_on)).
#[derive(Debug)]
pub struct Graphics {
    gpu: Gpu,
    paths: Mutex<GpuPaths>,
}

impl Graphics {
    /// Opens the best adapter.
    ///
    /// # Errors
    /// [`Error::Computation`] with the reason why there is no suitable one.
    pub async fn open() -> Result<Self> {
        let gpu = Gpu::request(wgpu::Features::FLOAT32_BLENDABLE, true).await.map_err(Error::Computation)?;
        let paths = Mutex::new(GpuPaths::new(&gpu));
        gpu.check()?;
        Ok(Self { gpu, paths })
    }

    /// Graphics interface and adapter.
    pub fn name(&self) -> &str {
        self.gpu.name()
    }

    /// The static anatomy of a set-up.
    pub(crate) async fn anatomy(&self, setup: &Setup, c_arm: &CArm) -> Result<Anatomy> {
        self.check_size(c_arm.size_px().map(|n| n * SUBRAYS))?;
        let mut asking = Asking { graphics: self, readings: vec![] };
        Anatomy::new(setup, c_arm, SUBRAYS, &mut asking)?;
        let mut answers = Vec::with_capacity(asking.readings.len());
        for reading in asking.readings {
            answers.push(lengths(reading).await?);
        }
        Anatomy::new(setup, c_arm, SUBRAYS, &mut Answered(answers.into_iter()))
    }

    /// The 3D engine for a set-up.
    pub(crate) fn three_d(&self, camera: &Camera, wall: &SurfaceMesh) -> Result<Box<GpuView3d>> {
        self.check_size(camera.size_px)?;
        Ok(Box::new(GpuView3d::new(&self.gpu, camera, wall)))
    }

    fn check_size(&self, size_px: [u32; 2]) -> Result<()> {
        let (needed, most) = (size_px[0].max(size_px[1]), self.gpu.largest_side);
        if needed <= most {
            return Ok(());
        }
        Err(Error::Computation(format!("it draws at most {most} pixels a side, not {needed}")))
    }
}

/// A 3D frame being drawn.
#[derive(Debug)]
pub struct Drawing {
    pub(crate) reading: Reading,
    pub(crate) camera: Camera,
    pub(crate) spec: CameraSpec,
    pub(crate) contacts: Vec<ContactView>,
}

impl Drawing {
    /// The frame.
    ///
    /// # Errors
    /// [`Error::Computation`] with the graphics processor's report.
    pub async fn image(self) -> Result<Image> {
        let mut image = GpuView3d::image(&self.camera, self.reading.bytes().await?);
        annotate(&mut image, &self.camera, &self.spec, &self.contacts);
        Ok(image)
    }
}

/// Submits requests; no results yet.
struct Asking<'a> {
    graphics: &'a Graphics,
    readings: Vec<Reading>,
}

impl PathEngine for Asking<'_> {
    fn mesh(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Vec<f32>> {
        let mut paths = self.graphics.paths.lock().unwrap_or_else(PoisonError::into_inner);
        self.readings.push(paths.submit(view, mesh)?);
        Ok(vec![0.0; view.size_px().map(|n| n as usize).iter().product()])
    }
}

/// Returns the results in the order of the requests.
struct Answered(std::vec::IntoIter<Vec<f32>>);

impl PathEngine for Answered {
    fn mesh(&mut self, _: &CArm, _: &SurfaceMesh) -> Result<Vec<f32>> {
        self.0.next().ok_or_else(|| Error::Computation("more was asked for than answered".into()))
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

    use super::*;
    use crate::spec::{Backend, DetectorSpec, TorsoSpec, View, ViewSpec};
    use crate::{DeviceView, Renderer};

    fn renderer(magnification: f64) -> Renderer {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::Triangles(4000)).unwrap().wall;
        let mut spec = ViewSpec {
            views: vec![View::Fluoro],
            size_px: [96; 2],
            bits: 8,
            backend: Backend::Cpu,
            // Without noise, so that only rays can differ.
            detector: DetectorSpec { noise: false, ..DetectorSpec::default() },
            ..ViewSpec::default()
        };
        spec.patient.torso = Some(TorsoSpec::default());
        spec.c_arm.magnification = magnification;
        Renderer::of_wall(&spec, &wall).unwrap()
    }

    #[test]
    fn pictures_by_a_processor_that_is_waited_for_are_those_of_the_reference() {
        if crate::gpu::context::tests::opened().is_none() {
            return;
        }
        let graphics = pollster::block_on(Graphics::open()).unwrap();
        let devices: [DeviceView; 0] = [];
        let mut by_graphics = renderer(1.0);
        pollster::block_on(by_graphics.prepare_on(&graphics)).unwrap();
        assert_eq!(by_graphics.backend(), graphics.name());
        let seen = by_graphics.render(&devices).unwrap().fluoro.unwrap();
        let apart = |other: &mut Renderer| {
            let other = other.render(&devices).unwrap().fluoro.unwrap();
            seen.data().iter().zip(other.data()).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
        };
        assert!(apart(&mut renderer(1.0)) <= 2);
        // Counter-check: another position differs.
        assert!(apart(&mut renderer(1.2)) > 50);
    }

    #[test]
    fn a_3d_frame_that_is_waited_for_is_that_of_an_engine_that_waits() {
        if crate::gpu::context::tests::opened().is_none() {
            return;
        }
        let graphics = pollster::block_on(Graphics::open()).unwrap();
        let renderer = |azimuth_deg: f64, backend| {
            let tree = anatomy::tree("aortic_arch").unwrap();
            let wall = GeneratedWall::new(&tree, Resolution::Triangles(4000)).unwrap().wall;
            let mut spec =
                ViewSpec { views: vec![View::ThreeD], size_px: [96; 2], backend, ..ViewSpec::default() };
            (spec.camera.azimuth_deg, spec.camera.scale_bar) = (Some(azimuth_deg), true);
            Renderer::of_wall(&spec, &wall).unwrap()
        };
        let at_once = renderer(20.0, Backend::Gpu).render(&[]).unwrap().three_d.unwrap();
        let later = |renderer: &mut Renderer| {
            pollster::block_on(renderer.three_d_on(&graphics, &[]).unwrap().image()).unwrap()
        };
        let mut waited = renderer(0.0, Backend::Cpu);
        assert_ne!(later(&mut waited), at_once, "from elsewhere");
        let turned =
            ViewSpec { camera: renderer(20.0, Backend::Cpu).spec().camera.clone(), ..waited.spec().clone() };
        waited.change(&turned).unwrap();
        assert_eq!(later(&mut waited), at_once);
        graphics.gpu.device.destroy();
        let lost = waited.three_d_on(&graphics, &[]).and_then(|drawing| pollster::block_on(drawing.image()));
        assert!(matches!(lost, Err(Error::Computation(_))));
    }

    #[test]
    fn a_lost_adapter_leaves_the_work_to_the_reference() {
        if crate::gpu::context::tests::opened().is_none() {
            return;
        }
        let graphics = pollster::block_on(Graphics::open()).unwrap();
        graphics.gpu.device.destroy();
        let mut renderer = renderer(1.0);
        pollster::block_on(renderer.prepare_on(&graphics)).unwrap();
        assert!(renderer.backend().starts_with("CPU reference (adapter failed"), "{}", renderer.backend());
        assert!(renderer.render(&[]).unwrap().fluoro.is_some());
    }
}
