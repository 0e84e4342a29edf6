//! The static anatomy in the beam: lengths of each ray in tissue, bone, lung and lumen.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;
use rayon::prelude::*;

use crate::c_arm::CArm;
use crate::engine::PathEngine;
use crate::material::Material;
use crate::patient::{Body, Of, Patient};
use crate::scene::Setup;
use crate::tails::Filled;

/// Smallest number of rows per thread.
const FEWEST_ROWS: usize = 16;

/// Lengths in mm on every ray. A map that is zero everywhere is empty.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anatomy {
    /// Soft tissue and everything within it.
    pub(crate) body: Vec<f32>,
    pub(crate) bone: Vec<f32>,
    pub(crate) lung: Vec<f32>,
    /// Lung on the rays through the middles of pixels.
    pub(super) lung_of_pixels: Vec<f32>,
    pub(crate) lumen: Vec<f32>,
    /// The part of the lumen, beyond ends of vessels, in which medium that is everywhere is not seen.
    pub(crate) faded: Vec<f32>,
}

impl Anatomy {
    /// Casts `rays` × `rays` rays for each pixel of `c_arm` through the scene. A generated body is cast with one ray
    /// per pixel and interpolated: it only has to look right, and its bones are most of what rays meet.
    pub(crate) fn new(setup: &Setup, c_arm: &CArm, rays: u32, engine: &mut dyn PathEngine) -> Result<Self> {
        let view = &c_arm.refined(rays);
        let (lumen, faded) = match setup.lumen {
            true => filled(setup, view, engine)?,
            false => (view.obliquities().map(|_| 0.0).collect(), vec![]),
        };
        let mut maps = Self { lumen, faded, ..Self::default() };
        match &*setup.patient {
            Patient::Slab { tissue_mm } => {
                maps.body = view.obliquities().map(|obliquity| (tissue_mm * obliquity) as f32).collect();
            }
            Patient::Torso(body) => {
                let mut cast = |mesh: &SurfaceMesh| cast(mesh, c_arm, engine);
                let finer = |map: Vec<f32>| finer(map, c_arm.size_px(), rays);
                let mut skin = cast(&body.skin)?;
                body.texture.apply(Of::Tissue, &mut skin, c_arm);
                maps.body = finer(skin);
                let (mut bone, marrow) = (cast(&body.bones)?, cast(&body.marrow)?);
                bone.iter_mut().zip(marrow).for_each(|(b, m)| *b = (*b - Body::NOT_BONE as f32 * m).max(0.0));
                body.texture.apply(Of::Bone, &mut bone, c_arm);
                maps.bone = finer(bone);
                maps.breathe(air(setup, c_arm, engine)?, c_arm, rays);
            }
            Patient::Tomogram(volume) => {
                [maps.body, maps.bone] = volume.project(view);
                if let Some(displacement) = setup.displacement() {
                    maps.body = volume.project_moved(view, displacement);
                }
            }
        }
        Ok(maps)
    }

    /// As [`Self::new`], with the displaced vessel, and the displaced air of a generated body or soft tissue of a
    /// tomogram; bones and the skin of a generated body do not move.
    pub(crate) fn moved(
        &self,
        setup: &Setup,
        c_arm: &CArm,
        rays: u32,
        engine: &mut dyn PathEngine,
    ) -> Result<Self> {
        let mut moved = self.clone();
        if setup.lumen {
            (moved.lumen, moved.faded) = filled(setup, &c_arm.refined(rays), engine)?;
        }
        moved.breathe(air(setup, c_arm, engine)?, c_arm, rays);
        if let Patient::Tomogram(volume) = &*setup.patient {
            let view = &c_arm.refined(rays);
            moved.body = match setup.displacement() {
                Some(displacement) => volume.project_moved(view, displacement),
                None => {
                    let [body, _] = volume.project(view);
                    body
                }
            };
        }
        Ok(moved)
    }

    /// Sets the air, from that on the rays through the middles of pixels.
    fn breathe(&mut self, air: Vec<f32>, c_arm: &CArm, rays: u32) {
        self.lung = finer(air.clone(), c_arm.size_px(), rays);
        self.lung_of_pixels = air;
    }

    /// Whether a ray meets the body.
    pub(crate) fn is_body(&self, ray: usize) -> bool {
        self.body[ray] > 0.0
    }

    /// Lengths in tissue, bone, lung, with this much more of it, and lumen.
    #[inline]
    pub(crate) fn at(&self, ray: usize, more_air_mm: f32) -> [f32; 4] {
        let at = |map: &[f32]| if map.is_empty() { 0.0 } else { map[ray] };
        let [bone, lung, lumen] = [at(&self.bone), at(&self.lung) + more_air_mm, self.lumen[ray]];
        [(self.body[ray] - bone - lung - lumen).max(0.0), bone, lung, lumen]
    }

    /// Length of the lumen on a ray in which medium that is everywhere is not seen.
    #[inline]
    pub(crate) fn faded(&self, ray: usize) -> f32 {
        if self.faded.is_empty() { 0.0 } else { self.faded[ray] }
    }

    /// Thickness of soft tissue equivalent to the middle of the image: what lets through as much as the body does in the
    /// mean over the middle ninth, where exposure control measures. Air beside the body does not count.
    pub(crate) fn reference_mm(&self, view: &CArm) -> f64 {
        // Relative attenuation at the 58 keV of an average quantum.
        const KEV: f64 = 58.0;
        let relative = |material: Material| {
            let mu = |m: Material| m.attenuation_per_mm(KEV).unwrap_or(0.0);
            (mu(material) / mu(Material::SoftTissue)) as f32
        };
        let factors =
            [Material::SoftTissue, Material::CorticalBone, Material::Lung, Material::Blood].map(relative);
        let [width, height] = view.size_px().map(|n| n as usize);
        let mut depths = Vec::new();
        for y in height / 3..(2 * height).div_ceil(3) {
            for x in width / 3..(2 * width).div_ceil(3) {
                let ray = y * width + x;
                if self.is_body(ray) {
                    depths.push(self.at(ray, 0.0).iter().zip(factors).map(|(l, f)| l * f).sum::<f32>());
                }
            }
        }
        if depths.is_empty() {
            return 0.0;
        }
        let per_mm = Material::SoftTissue.attenuation_per_mm(KEV).unwrap_or(0.0);
        let thinnest = f64::from(depths.iter().copied().fold(f32::MAX, f32::min));
        let passed = depths.iter().map(|d| libm::exp(per_mm * (thinnest - f64::from(*d)))).sum::<f64>();
        thinnest - libm::log(passed / depths.len() as f64) / per_mm
    }
}

/// Lengths in a mesh; empty for a mesh without triangles.
fn cast(mesh: &SurfaceMesh, c_arm: &CArm, engine: &mut dyn PathEngine) -> Result<Vec<f32>> {
    match mesh.triangles.is_empty() {
        true => Ok(vec![]),
        false => engine.mesh(c_arm, mesh),
    }
}

/// Lengths in the lumen, and those of it in which medium has faded.
fn filled(setup: &Setup, view: &CArm, engine: &mut dyn PathEngine) -> Result<(Vec<f32>, Vec<f32>)> {
    let filled = setup.filled_now();
    let lumen = engine.mesh(view, &filled.surface)?;
    let mut faded = cast(&filled.faded, view, engine)?;
    faded.iter_mut().for_each(|length| *length /= Filled::DEPTH);
    Ok((lumen, faded))
}

/// Lengths of the rays through the middles of pixels in the air of a generated body, at its displacement.
fn air(setup: &Setup, c_arm: &CArm, engine: &mut dyn PathEngine) -> Result<Vec<f32>> {
    setup.air_now().map_or(Ok(vec![]), |mesh| air_of(setup, mesh, c_arm, engine, &mut vec![]))
}

/// Lengths of the central rays of pixels in the air of a generated body with this surface, and the noise that they have
/// met.
pub(super) fn air_of(
    setup: &Setup,
    mesh: &SurfaceMesh,
    c_arm: &CArm,
    engine: &mut dyn PathEngine,
    met: &mut Vec<f64>,
) -> Result<Vec<f32>> {
    let mut air = cast(mesh, c_arm, engine)?;
    // Vessels of a lung overlap where they divide.
    air.iter_mut().for_each(|length| *length = length.max(0.0));
    if let Patient::Torso(body) = &*setup.patient {
        body.texture.apply_again(Of::Lung, &mut air, c_arm, met);
    }
    Ok(air)
}

/// The pixels before and after a ray along a row or column, and the weight of the second.
#[inline]
fn beside(ray: usize, rays: usize, pixels: usize) -> (usize, usize, f32) {
    let at = ((ray as f32 + 0.5) / rays as f32 - 0.5).clamp(0.0, (pixels - 1) as f32);
    let first = at as usize;
    (first, (first + 1).min(pixels - 1), at - first as f32)
}

/// One value of [`finer`], of a map that is not empty.
#[inline]
pub(super) fn finer_at(map: &[f32], size_px: [u32; 2], rays: usize, ray: usize) -> f32 {
    let [width, height] = size_px.map(|n| n as usize);
    let (i, j, u) = beside(ray % (rays * width), rays, width);
    let (above, below, v) = beside(ray / (rays * width), rays, height);
    let mix = |row: usize| map[row * width + i] * (1.0 - u) + map[row * width + j] * u;
    mix(above) * (1.0 - v) + mix(below) * v
}

/// A map with `rays` × `rays` values per pixel, bilinear between pixel centres.
pub(super) fn finer(map: Vec<f32>, size_px: [u32; 2], rays: u32) -> Vec<f32> {
    if rays == 1 || map.is_empty() {
        return map;
    }
    let [width, height] = size_px.map(|n| n as usize);
    let rays = rays as usize;
    let columns: Vec<_> = (0..rays * width).map(|ray| beside(ray, rays, width)).collect();
    let mut finer = vec![0.0; map.len() * rays * rays];
    let rows = finer.par_chunks_exact_mut(rays * width).with_min_len(FEWEST_ROWS).enumerate();
    rows.for_each(|(ray, row)| {
        let (above, below, v) = beside(ray, rays, height);
        let (above, below) = (&map[above * width..][..width], &map[below * width..][..width]);
        for (value, &(i, j, u)) in row.iter_mut().zip(&columns) {
            let mix = |line: &[f32]| line[i] * (1.0 - u) + line[j] * u;
            *value = mix(above) * (1.0 - v) + mix(below) * v;
        }
    });
    finer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_stays_a_plane_between_the_middles_of_pixels() {
        let of = |x: f32, y: f32| 3.0 + 0.5 * x - 0.25 * y;
        let map: Vec<f32> = (0..48).map(|i| of((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5)).collect();
        let twice = finer(map.clone(), [8, 6], 2);
        for row in 1..11 {
            for column in 1..15 {
                let at = of((column as f32 + 0.5) / 2.0, (row as f32 + 0.5) / 2.0);
                assert!((twice[row * 16 + column] - at).abs() < 1e-5, "{row} {column}");
            }
        }
        assert!((0..twice.len()).all(|ray| finer_at(&map, [8, 6], 2, ray) == twice[ray]));
        assert_eq!(finer(map.clone(), [8, 6], 1), map);
    }
}
