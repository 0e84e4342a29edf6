//! What stays in the beam: lengths of each ray in tissue, bone, lung and lumen.

use endowire_core::Result;

use super::PathEngine;
use crate::c_arm::CArm;
use crate::patient::{Body, Patient};
use crate::scene::Setup;
use crate::xray::Material;

/// Lengths in mm on every ray. A map that would be zero everywhere is empty.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anatomy {
    /// Soft tissue and all that lies in it.
    pub(crate) body: Vec<f32>,
    pub(crate) bone: Vec<f32>,
    pub(crate) lung: Vec<f32>,
    pub(crate) lumen: Vec<f32>,
}

impl Anatomy {
    /// Casts the rays of `view` through the scene.
    pub(crate) fn new(setup: &Setup, view: &CArm, engine: &mut dyn PathEngine) -> Result<Self> {
        let lumen = if setup.lumen {
            engine.mesh(view, &setup.wall)?
        } else {
            view.obliquities().map(|_| 0.0).collect()
        };
        let mut maps = Self { lumen, ..Self::default() };
        match &setup.patient {
            Patient::Slab { tissue_mm } => {
                maps.body = view.obliquities().map(|obliquity| (tissue_mm * obliquity) as f32).collect();
            }
            Patient::Torso(body) => {
                maps.body = engine.mesh(view, &body.skin)?;
                if !body.bones.triangles.is_empty() {
                    maps.bone = engine.mesh(view, &body.bones)?;
                    let marrow = engine.mesh(view, &body.marrow)?;
                    maps.bone.iter_mut().zip(marrow).for_each(|(b, m)| *b -= Body::NOT_BONE as f32 * m);
                }
                if !body.lungs.triangles.is_empty() {
                    maps.lung = engine.mesh(view, &body.lungs)?;
                }
            }
            Patient::Tomogram(volume) => {
                let [tissue, bone] = volume.project(view);
                maps.body = tissue.iter().zip(&bone).map(|(a, b)| a + b).collect();
                maps.bone = bone;
            }
        }
        Ok(maps)
    }

    /// Number of rays.
    pub(crate) fn rays(&self) -> usize {
        self.lumen.len()
    }

    /// Lengths in tissue, bone, lung and lumen.
    #[inline]
    pub(crate) fn at(&self, ray: usize) -> [f32; 4] {
        let at = |map: &[f32]| if map.is_empty() { 0.0 } else { map[ray] };
        let [bone, lung, lumen] = [at(&self.bone), at(&self.lung), self.lumen[ray]];
        [(self.body[ray] - bone - lung - lumen).max(0.0), bone, lung, lumen]
    }

    /// Thickness of soft tissue that stands for the middle of the picture: the median over its middle ninth, where exposure
    /// control looks.
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
                let lengths = self.at(y * width + x);
                depths.push(lengths.iter().zip(factors).map(|(l, f)| l * f).sum::<f32>());
            }
        }
        let middle = depths.len() / 2;
        let (_, median, _) = depths.select_nth_unstable_by(middle, f32::total_cmp);
        f64::from(*median)
    }
}
