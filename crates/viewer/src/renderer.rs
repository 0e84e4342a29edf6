//! From a scene to frames: chooses an engine, prepares what the wanted views need, draws.

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result};

use crate::c_arm::CArm;
use crate::cpu;
use crate::device::DeviceView;
use crate::gpu;
use crate::image::Image;
use crate::scene::{RefinedDevice, Setup};
use crate::spec::{Backend, ViewSpec};
use crate::xray::{Material, PathLengths};

/// Draws fluoroscopic frames of one set-up.
pub(crate) trait FluoroEngine: Send {
    fn frame(&mut self, devices: &[RefinedDevice]) -> Result<Image>;
    /// Length inside the wall of each pixel's central ray.
    fn lumen_path(&mut self) -> Result<Vec<f32>>;
    /// Length inside one device of each pixel's central ray.
    fn device_path(&mut self, device: &RefinedDevice) -> Result<Vec<f32>>;
}

/// Draws 3D frames of one set-up.
pub(crate) trait ThreeDEngine: Send {
    fn frame(&mut self, devices: &[RefinedDevice]) -> Result<Image>;
}

/// The engines of the wanted views, all on the same processor.
pub(crate) struct Engines {
    pub(crate) fluoro: Option<Box<dyn FluoroEngine>>,
    pub(crate) three_d: Option<Box<dyn ThreeDEngine>>,
    /// Name for people.
    pub(crate) name: String,
}

/// The frames of one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames {
    /// The 3D view, if wanted; 8-bit RGBA.
    pub three_d: Option<Image>,
    /// The fluoroscopic view, if wanted; 8-bit grey.
    pub fluoro: Option<Image>,
}

/// Draws the wanted views of devices in a vessel.
pub struct Renderer {
    setup: Setup,
    engines: Engines,
    is_cpu: bool,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("backend", &self.engines.name).finish_non_exhaustive()
    }
}

impl Renderer {
    /// Prepares the views that `spec` asks for, and nothing else. The fluoroscopic view needs a **closed**
    /// wall with outward triangles (cap the openings); the 3D view shows any.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a bad `spec`, a vessel that is not between source and detector, or `backend =
    /// gpu` without a fitting adapter; [`Error::Mesh`] for a wall that is open, wound inconsistently or
    /// inside out.
    pub fn new(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<Self> {
        let setup = Setup::new(spec, wall)?;
        let nothing = setup.fluoro.is_none() && setup.camera.is_none();
        let on_gpu = match spec.backend {
            Backend::Cpu => None,
            _ if nothing => None,
            Backend::Auto => gpu::engines(&setup, false).ok(),
            Backend::Gpu => Some(gpu::engines(&setup, true).map_err(|reason| {
                Error::parameter("view.backend", "gpu", format!("{reason}; use \"auto\" or \"cpu\""))
            })?),
        };
        let is_cpu = on_gpu.is_none();
        let engines = on_gpu.unwrap_or_else(|| cpu::engines(&setup));
        Ok(Self { setup, engines, is_cpu })
    }

    /// What computes the frames, for people: "CPU reference", or the graphics interface and adapter. Changes
    /// where a lost adapter made the CPU take over.
    pub fn backend(&self) -> &str {
        &self.engines.name
    }

    /// The C-arm of the fluoroscopic view, if that is wanted: projects points exactly as the frames do.
    pub fn c_arm(&self) -> Option<&CArm> {
        self.setup.fluoro.as_ref().map(|f| &f.c_arm)
    }

    /// Draws the wanted views. Fluoroscopy leaves out what of a device is not between source and detector.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a device with values that are not finite.
    pub fn render(&mut self, devices: &[DeviceView]) -> Result<Frames> {
        let devices = RefinedDevice::all(devices)?;
        self.with_fallback(|engines| {
            Ok(Frames {
                three_d: engines.three_d.as_mut().map(|engine| engine.frame(&devices)).transpose()?,
                fluoro: engines.fluoro.as_mut().map(|engine| engine.frame(&devices)).transpose()?,
            })
        })
    }

    /// Path lengths of the rays through the pixel centres.
    ///
    /// # Errors
    /// As [`Self::render`], and [`Error::Parameter`] where the fluoroscopic view was not asked for.
    pub fn path_lengths(&mut self, devices: &[DeviceView]) -> Result<PathLengths> {
        let fluoro = self.setup.fluoro.as_ref().ok_or_else(no_fluoro)?;
        let [width, height] = fluoro.c_arm.size_px();
        let body_mm = (0..width as usize * height as usize)
            .map(|i| (fluoro.beam.tissue_mm * fluoro.c_arm.obliquity_at(i)) as f32)
            .collect();
        let default = fluoro.beam.device_material(None);
        let devices = RefinedDevice::all(devices)?;
        let (lumen_mm, devices_mm) = self.with_fallback(|engines| {
            let engine = engines.fluoro.as_mut().ok_or_else(no_fluoro)?;
            let mut maps: Vec<(Material, Vec<f32>)> = Vec::new();
            for device in &devices {
                let material = device.material.unwrap_or(default);
                let map = engine.device_path(device)?;
                match maps.iter_mut().find(|(m, _)| *m == material) {
                    Some((_, sum)) => sum.iter_mut().zip(map).for_each(|(sum, length)| *sum += length),
                    None => maps.push((material, map)),
                }
            }
            Ok((engine.lumen_path()?, maps))
        })?;
        Ok(PathLengths { width, height, body_mm, lumen_mm, devices_mm })
    }

    /// Transmitted fraction I/I₀ = exp(−Σ μL) of the given path lengths with this scene's energy and
    /// fillings.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the fluoroscopic view was not asked for.
    pub fn transmission(&self, paths: &PathLengths) -> Result<Vec<f32>> {
        self.setup.fluoro.as_ref().ok_or_else(no_fluoro)?.beam.transmission(paths)
    }

    /// Runs `job`; where an adapter fails in it, hands over to the CPU and runs it again.
    fn with_fallback<T>(&mut self, job: impl Fn(&mut Engines) -> Result<T>) -> Result<T> {
        match job(&mut self.engines) {
            Err(Error::Computation(reason)) if !self.is_cpu => {
                let mut engines = cpu::engines(&self.setup);
                engines.name = format!("{} ({} failed: {reason})", engines.name, self.engines.name);
                self.engines = engines;
                self.is_cpu = true;
                job(&mut self.engines)
            }
            done => done,
        }
    }
}

fn no_fluoro() -> Error {
    Error::parameter("view.views", "without fluoro", "this belongs to the fluoroscopic view; add \"fluoro\"")
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;

    use super::*;
    use crate::spec::View;

    /// An adapter that fails in every frame.
    struct Broken;

    fn lost<T>() -> Result<T> {
        Err(Error::Computation("the device was lost".into()))
    }

    impl FluoroEngine for Broken {
        fn frame(&mut self, _: &[RefinedDevice]) -> Result<Image> {
            lost()
        }

        fn lumen_path(&mut self) -> Result<Vec<f32>> {
            lost()
        }

        fn device_path(&mut self, _: &RefinedDevice) -> Result<Vec<f32>> {
            lost()
        }
    }

    impl ThreeDEngine for Broken {
        fn frame(&mut self, _: &[RefinedDevice]) -> Result<Image> {
            lost()
        }
    }

    #[test]
    fn a_lost_adapter_hands_over_to_the_cpu_and_says_so() {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let spec = ViewSpec {
            views: vec![View::ThreeD, View::Fluoro],
            size_px: [32, 32],
            backend: Backend::Cpu,
            ..ViewSpec::default()
        };
        let mut whole = Renderer::new(&spec, &wall).unwrap();
        let broken = || Engines {
            fluoro: Some(Box::new(Broken)),
            three_d: Some(Box::new(Broken)),
            name: "adapter".into(),
        };
        let setup = || Setup::new(&spec, &wall).unwrap();
        let mut renderer = Renderer { setup: setup(), engines: broken(), is_cpu: false };
        assert_eq!(renderer.render(&[]).unwrap(), whole.render(&[]).unwrap());
        assert_eq!(renderer.backend(), "CPU reference (adapter failed: the device was lost)");
        assert_eq!(renderer.path_lengths(&[]).unwrap(), whole.path_lengths(&[]).unwrap());
        // The twin: without anything to fall back on, the failure is reported.
        let mut last = Renderer { setup: setup(), engines: broken(), is_cpu: true };
        assert!(last.render(&[]).is_err());
    }
}
