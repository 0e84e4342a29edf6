//! Fluoroscopic frames in plain Rust: the exact reference, and the fast path where there is no graphics
//! processor.
//!
//! The anatomy does not move, so its line integrals and its finished picture are kept. A frame copies the
//! picture and redoes only the pixels that a device touches.

use std::sync::Arc;

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::cpu::devices::{cast, pieces_in_beam};
use crate::cpu::wall::wall_path_mm;
use crate::image::{Image, PixelFormat};
use crate::renderer::FluoroEngine;
use crate::scene::{FluoroSetup, RefinedDevice};
use crate::xray::{Beam, SUBRAYS};

/// Everything about a fluoroscopic view that stays from frame to frame.
#[derive(Debug)]
pub(crate) struct CpuFluoro {
    c_arm: CArm,
    /// The same view with one pixel a ray.
    rays: CArm,
    beam: Beam,
    wall: Arc<SurfaceMesh>,
    /// Line integral of the anatomy on each ray.
    anatomy: Vec<f32>,
    /// The picture without devices.
    still: Vec<u8>,
    /// Excess line integral of the devices; all zero between frames.
    excess: Vec<f32>,
}

impl CpuFluoro {
    pub(crate) fn new(setup: &FluoroSetup, wall: Arc<SurfaceMesh>) -> Self {
        let FluoroSetup { c_arm, beam } = setup.clone();
        let rays = c_arm.refined(SUBRAYS);
        let lumen = wall_path_mm(&rays, &wall);
        let anatomy: Vec<f32> =
            (lumen.iter().enumerate()).map(|(i, &l)| beam.anatomy(rays.obliquity_at(i), l) as f32).collect();
        let [width, height] = c_arm.size_px().map(|n| n as usize);
        let excess = vec![0.0; anatomy.len()];
        let mut fluoro = Self { c_arm, rays, beam, wall, anatomy, still: vec![], excess };
        fluoro.still = (0..width * height).map(|pixel| fluoro.grey(pixel)).collect();
        fluoro
    }

    /// First ray and rays a row of a pixel.
    fn first_ray(&self, pixel: usize) -> (usize, usize) {
        let (width, sub) = (self.c_arm.size_px()[0] as usize, SUBRAYS as usize);
        (pixel / width * sub * width * sub + pixel % width * sub, width * sub)
    }

    fn grey(&self, pixel: usize) -> u8 {
        let (first, stride) = self.first_ray(pixel);
        let mut sum = 0.0;
        for row in 0..SUBRAYS as usize {
            for ray in first + row * stride..first + row * stride + SUBRAYS as usize {
                sum += self.beam.relative_transmission(self.anatomy[ray] + self.excess[ray]);
            }
        }
        let width = self.c_arm.size_px()[0] as usize;
        self.beam.grey(sum / (SUBRAYS * SUBRAYS) as f32, pixel % width, pixel / width)
    }
}

impl FluoroEngine for CpuFluoro {
    fn frame(&mut self, devices: &[RefinedDevice]) -> Result<Image> {
        let [width, height] = self.c_arm.size_px();
        let (row, sub) = ((width * SUBRAYS) as usize, SUBRAYS as usize);
        let mut chains = Vec::with_capacity(devices.len());
        for device in devices {
            let weight = self.beam.device_excess_per_mm(device.material)?;
            chains.push((weight, pieces_in_beam(&self.rays, &device.points)));
        }
        let mut touched = Vec::new();
        for (weight, pieces) in &chains {
            for piece in pieces {
                cast(&self.rays, piece, |ray, length| {
                    self.excess[ray] += (weight * length) as f32;
                    let pixel = ray / row / sub * width as usize + ray % row / sub;
                    if touched.last() != Some(&pixel) {
                        touched.push(pixel);
                    }
                });
            }
        }
        touched.sort_unstable();
        touched.dedup();
        let mut data = self.still.clone();
        for &pixel in &touched {
            data[pixel] = self.grey(pixel);
        }
        for &pixel in &touched {
            let (first, stride) = self.first_ray(pixel);
            (0..sub).for_each(|y| self.excess[first + y * stride..][..sub].fill(0.0));
        }
        Ok(Image::new(width, height, PixelFormat::Gray8, data))
    }

    fn lumen_path(&mut self) -> Result<Vec<f32>> {
        Ok(wall_path_mm(&self.c_arm, &self.wall).into_iter().map(|v| v as f32).collect())
    }

    fn device_path(&mut self, device: &RefinedDevice) -> Result<Vec<f32>> {
        let mut path = vec![0.0; self.still.len()];
        for piece in pieces_in_beam(&self.c_arm, &device.points) {
            cast(&self.c_arm, &piece, |pixel, length| path[pixel] += length);
        }
        Ok(path.into_iter().map(|v| v as f32).collect())
    }
}
