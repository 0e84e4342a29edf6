//! The fluoroscopic view: static contributions are computed once per pose of the C-arm, moving ones for each frame.
//!
//! Materials nest by what they displace. With the geometric lengths B (body), O (bone), L (lungs), V (inside the wall) and Dⱼ
//! (device j) along a ray,
//!
//! ```text
//! p = µ_tissue · max(B − O − L − V, 0) + µ_bone · O + µ_lung · L + µ_lumen · V + Σⱼ (µⱼ − µ_lumen) · Dⱼ
//! ```
//!
//! with µ_lumen = (1 − f) µ_blood + f µ_contrast at the local fraction f of contrast medium. The max covers a vessel
//! that protrudes from the body, and a phantom in air (B = 0). Devices are assumed to be inside the lumen: a part
//! outside the wall displaces the lumen's content all the same.
//!
//! Pixels collect energy over their area, so signals, not line integrals, are averaged over [`SUBRAYS`]² rays per
//! pixel, and over many more at devices ([`DeviceCells`]).

mod anatomy;
mod brightness;
mod display;
mod labels;
mod moving;
mod rays;
mod scatter;
mod sequence;

use std::sync::Arc;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result, Vec3};
use rayon::prelude::*;

pub(crate) use anatomy::Anatomy;
pub use brightness::Brightness;
pub(crate) use labels::labels;
use moving::Moving;
use rays::Room;
use scatter::Scatter;
pub use sequence::FrameTime;
pub(crate) use sequence::{Afterglow, Sequence, UNSUBTRACTED_LN};

use crate::c_arm::CArm;
use crate::contrast::{ContrastMap, Medium, Shares};
use crate::cpu::{DeviceCells, covered_by_half, layers_in_beam};
use crate::device::{Layer, RefinedDevice};
use crate::engine::PathEngine;
use crate::material::Material;
use crate::output::Mask;
use crate::scene::Setup;
use crate::spec::{ViewSpec, XRaySpec};
use crate::xray::{Beam, Exposure, LANES, Lanes, PathLengths};

/// Number of rays across a pixel in each direction. Two give four grey levels of edge smoothing, enough given a real
/// detector's blur, at four times the cost of one.
pub(crate) const SUBRAYS: u32 = 2;

/// Lengths inside the lumen below this are rounding, mm.
const LEAST_LUMEN_MM: f32 = 1e-3;

/// Fractions of contrast medium below this are blood.
const LEAST_FRACTION: f32 = 1e-4;

/// Lengths of contrast medium in tissue below this are ignored, mm.
const LEAST_MEDIUM_MM: f32 = 1e-4;

/// Number of rays of a pixel.
const RAYS: usize = (SUBRAYS * SUBRAYS) as usize;

/// Smallest number of pixels per thread.
const FEWEST_PIXELS: usize = 1024;

/// Signal of each pixel, and signal times photon energy.
#[derive(Debug, Clone, Default)]
pub(crate) struct Signal {
    pub(crate) signal: Vec<f32>,
    pub(crate) energy: Vec<f32>,
}

/// The signal of the anatomy alone, without devices and injections.
#[derive(Debug, Clone)]
pub(crate) struct Still {
    pub(crate) signal: Signal,
    scatter: Scatter,
}

/// Data of a fluoroscopic view that are constant between frames, and the buffers of the next one.
#[derive(Debug)]
pub(crate) struct Fluoroscope {
    pub(crate) c_arm: CArm,
    pub(crate) exposure: Exposure,
    pub(crate) beam: Beam,
    anatomy: Arc<Anatomy>,
    /// Attenuation of tissue, bone, lung, blood and contrast medium minus blood.
    lanes: [Lanes; 5],
    /// Their means over the reference signal, 1/mm.
    mu: [f32; 5],
    fraction: f32,
    contrast: Option<ContrastMap>,
    /// Material of devices that specify none.
    default_material: Material,
    pub(crate) still: Still,
    /// The body's own motion.
    moving: Option<Moving>,
    /// Pixels that show the vessel, once requested.
    vessel: Option<Mask>,
    /// Lengths inside devices, none between frames.
    devices: DeviceCells,
    /// Attenuation of their materials in the same order, and its mean.
    device_lanes: Vec<(Material, Lanes, f32)>,
}

/// Data that another view of the same vessel and body can reuse if it has the same rays: blades, modes, doses and
/// injections do not change them.
#[derive(Debug, Clone)]
pub(crate) struct Kept {
    rays: u128,
    anatomy: Arc<Anatomy>,
    shares: Option<Arc<Shares>>,
}

impl Kept {
    /// The results of casting a scene.
    #[cfg(feature = "gpu")]
    pub(crate) fn of(c_arm: &CArm, anatomy: Anatomy) -> Self {
        Self { rays: c_arm.fingerprint(), anatomy: Arc::new(anatomy), shares: None }
    }

    /// The part reusable for a set-up `after` the given one.
    pub(crate) fn between(mut self, before: &Setup, after: &Setup) -> Option<Self> {
        let rays = after.c_arm.as_ref().map(CArm::fingerprint);
        let alike = Arc::ptr_eq(&before.patient, &after.patient)
            && std::ptr::eq(before.filled_now(), after.filled_now())
            && before.lumen == after.lumen;
        if before.spec.flow != after.spec.flow {
            self.shares = None;
        }
        (alike && rays == Some(self.rays)).then_some(self)
    }
}

impl Fluoroscope {
    /// Computes the constant data, except those `kept` from a view with the same rays.
    pub(crate) fn new(
        setup: &Setup,
        c_arm: &CArm,
        kept: Option<&Kept>,
        engine: &mut dyn PathEngine,
    ) -> Result<Self> {
        let spec: &ViewSpec = &setup.spec;
        let rays = c_arm.refined(SUBRAYS);
        let anatomy = match kept {
            Some(kept) => Arc::clone(&kept.anatomy),
            None => Arc::new(Anatomy::new(setup, c_arm, SUBRAYS, engine)?),
        };
        let exposure = Exposure::new(spec, anatomy.reference_mm(&rays))?;
        let beam = Beam::new(&XRaySpec { kvp: exposure.kvp, ..spec.xray.clone() }, exposure.tissue_mm)?;
        let lanes = [
            beam.excess(Material::SoftTissue, None)?,
            beam.excess(Material::CorticalBone, None)?,
            beam.excess(Material::Lung, None)?,
            beam.excess(Material::Blood, None)?,
            beam.excess(Material::Contrast370, Some(Material::Blood))?,
        ];
        let mu = lanes.each_ref().map(|lanes| beam.mean(lanes));
        let contrast = setup.flow.as_ref().map(|flow| {
            let known = kept.and_then(|kept| kept.shares.clone());
            let shares =
                || Arc::new(Shares::new(flow, c_arm, &setup.filled_now().surface, setup.displacement()));
            ContrastMap::new(flow, known.unwrap_or_else(shares), setup.displacement())
        });
        let pixels = c_arm.size_px().map(|n| n as usize).iter().product();
        let dark = Signal { signal: vec![0.0; pixels], energy: vec![0.0; pixels] };
        let scatter = Scatter::new(&dark, c_arm, spec.detector.scatter_fraction);
        let mut fluoroscope = Self {
            c_arm: c_arm.clone(),
            exposure,
            beam,
            anatomy,
            mu,
            lanes,
            fraction: spec.xray.contrast_fraction as f32,
            contrast,
            default_material: spec.xray.device_material,
            still: Still { signal: dark, scatter },
            moving: Moving::new(setup)?,
            vessel: None,
            devices: DeviceCells::new(c_arm),
            device_lanes: vec![],
        };
        fluoroscope.look(spec);
        Ok(fluoroscope)
    }

    /// Computes the constant signals from their lengths.
    fn look(&mut self, spec: &ViewSpec) {
        let whole = self.primaries();
        if let Some(moving) = &mut self.moving {
            moving.rests(&whole);
        }
        let of = |i: usize| {
            whole.iter().enumerate().map(|(pixel, v)| v[i] * self.c_arm.openness(pixel) as f32).collect()
        };
        let mut signal = Signal { signal: of(0), energy: of(1) };
        let scatter = Scatter::new(&signal, &self.c_arm, spec.detector.scatter_fraction);
        scatter.add_still(&mut signal);
        self.still = Still { signal, scatter };
    }

    /// Signal and energy of the unscattered photons of all pixels, without blades and devices.
    fn primaries(&self) -> Vec<[f32; 2]> {
        let whole = (0..self.pixels()).into_par_iter().with_min_len(FEWEST_PIXELS);
        whole.map_init(Room::default, |room, pixel| self.primary(pixel, [self.fraction, 0.0], room)).collect()
    }

    /// Whether a pixel shows the body, and no blade.
    pub(crate) fn shows_body(&self) -> Vec<bool> {
        let any = |pixel: usize| {
            let (first, stride) = self.first_ray(pixel);
            [first, first + 1, first + stride, first + stride + 1]
                .iter()
                .any(|&ray| self.anatomy.is_body(ray))
        };
        (0..self.pixels()).map(|pixel| self.c_arm.openness(pixel) >= 1.0 && any(pixel)).collect()
    }

    /// Number of pixels.
    fn pixels(&self) -> usize {
        self.c_arm.size_px().map(|n| n as usize).iter().product()
    }

    /// Displaces the vessel. Exposure is unchanged, as an exposure control would hold it.
    pub(crate) fn move_vessel(&mut self, setup: &Setup, engine: &mut dyn PathEngine) -> Result<()> {
        self.anatomy = Arc::new(self.anatomy.moved(setup, &self.c_arm, SUBRAYS, engine)?);
        self.vessel = None;
        self.moving = Moving::new(setup)?;
        if let Some(flow) = &setup.flow {
            let shares = Shares::new(flow, &self.c_arm, &setup.filled_now().surface, setup.displacement());
            self.contrast = Some(ContrastMap::new(flow, Arc::new(shares), setup.displacement()));
        }
        self.look(&setup.spec);
        Ok(())
    }

    /// Data that another view may reuse.
    pub(crate) fn into_kept(self) -> Kept {
        let shares = self.contrast.map(ContrastMap::into_shares);
        Kept { rays: self.c_arm.fingerprint(), anatomy: self.anatomy, shares }
    }

    /// Pixels at least half covered by the vessel enclosed by `wall`, not behind a blade. The filled lumen may extend
    /// beyond its surface: its lengths only indicate where to test.
    pub(crate) fn vessel(&mut self, wall: &SurfaceMesh, filled: &SurfaceMesh) -> Mask {
        if let Some(known) = &self.vessel {
            return known.clone();
        }
        let size_px = self.c_arm.size_px();
        let beyond = self.beyond(wall, filled);
        let (mut inside, mut edge) = (vec![], vec![]);
        for pixel in 0..size_px[0] * size_px[1] {
            let (first, stride) = self.first_ray(pixel as usize);
            let rays = (0..SUBRAYS as usize)
                .flat_map(|row| first + row * stride..first + row * stride + SUBRAYS as usize);
            match rays.filter(|&ray| self.anatomy.lumen[ray] > LEAST_LUMEN_MM).count() {
                0 => {}
                RAYS if !beyond[pixel as usize] => inside.push(pixel),
                _ => edge.push(pixel),
            }
        }
        inside.extend(covered_by_half(&self.c_arm, wall, &edge));
        inside.retain(|&pixel| self.c_arm.openness(pixel as usize) >= 0.5);
        inside.sort_unstable();
        self.vessel.insert(Mask::new(size_px, inside)).clone()
    }

    /// Pixels near the part of the filled lumen beyond the wall: triangles that the two do not share.
    fn beyond(&self, wall: &SurfaceMesh, filled: &SurfaceMesh) -> Vec<bool> {
        let mut near = vec![false; self.pixels()];
        let [width, height] = self.c_arm.size_px();
        let pairs = wall.triangles.iter().zip(&filled.triangles);
        let common = pairs.take_while(|(a, b)| a == b).count();
        for triangle in common..filled.triangles.len() {
            let corners = filled.corners(triangle).map(|corner| self.c_arm.project(&corner));
            let range = |k: usize, side: u32| {
                let [low, high] =
                    [f64::min, f64::max].map(|of| corners.iter().map(|c| c[k]).fold(corners[0][k], of));
                low.clamp(0.0, f64::from(side)) as usize..(high.clamp(0.0, f64::from(side)).ceil() as usize)
            };
            let columns = range(0, width);
            range(1, height).for_each(|y| near[y * width as usize..][columns.clone()].fill(true));
        }
        near
    }

    /// Signal with devices, averaged over the instants of a pulse, and the contrast medium at a time; without a time,
    /// before any injection.
    pub(crate) fn signal(&mut self, pulse: &[Vec<RefinedDevice>], time_s: Option<f64>) -> Result<Signal> {
        let mut medium = match (&mut self.contrast, time_s) {
            (Some(contrast), Some(time)) => {
                contrast.at(time, pulse.last().and_then(|devices| injecting_tip_mm(devices)))
            }
            _ => vec![],
        };
        medium.retain(|m| m.fraction > LEAST_FRACTION || m.tissue_mm > LEAST_MEDIUM_MM);
        let Some((first, others)) = pulse.split_first() else { return self.instant(&[], &medium) };
        let mut sum = self.instant(first, &medium)?;
        for devices in others {
            let more = self.instant(devices, &medium)?;
            sum.signal.iter_mut().zip(more.signal).for_each(|(sum, v)| *sum += v);
            sum.energy.iter_mut().zip(more.energy).for_each(|(sum, v)| *sum += v);
        }
        if !others.is_empty() {
            let each = 1.0 / pulse.len() as f32;
            sum.signal.iter_mut().chain(&mut sum.energy).for_each(|v| *v *= each);
        }
        Ok(sum)
    }

    /// Signal with devices at one instant.
    fn instant(&mut self, devices: &[RefinedDevice], medium: &[Medium]) -> Result<Signal> {
        self.cast(devices)?;
        let mut pixels = self.devices.pixels().to_vec();
        pixels.sort_unstable();
        let now = self.draw(&self.still, &pixels, medium);
        self.devices.clear();
        Ok(now)
    }

    /// Computes the lengths inside devices.
    fn cast(&mut self, devices: &[RefinedDevice]) -> Result<()> {
        self.devices.clear();
        for device in devices {
            let layers = layers_in_beam(&self.c_arm, device).into_iter();
            let of = |(layer, pieces): (&Layer, _)| (layer.material.unwrap_or(self.default_material), pieces);
            self.devices.add(&layers.map(of).collect::<Vec<_>>());
        }
        for (material, _) in &self.devices.maps()[self.device_lanes.len()..] {
            let lanes = self.beam.excess(*material, None)?;
            let mean = self.beam.mean(&lanes);
            self.device_lanes.push((*material, lanes, mean));
        }
        Ok(())
    }

    /// Mean lengths of pixels inside devices, by material.
    pub(crate) fn inside_devices(&mut self, devices: &[RefinedDevice]) -> Result<Vec<(Material, Vec<f32>)>> {
        self.cast(devices)?;
        let means = self.devices.means();
        self.devices.clear();
        Ok(means)
    }

    /// Ratio of every pixel's signal to the open beam behind devices and medium: the image's own signal, without
    /// scatter and blades.
    pub(crate) fn transmitted(&mut self, devices: &[RefinedDevice], medium: &[Medium]) -> Result<Vec<f32>> {
        self.cast(devices)?;
        let mut of_pixel = vec![[self.fraction, 0.0]; self.pixels()];
        for m in medium {
            of_pixel[m.pixel as usize] = [(self.fraction + m.fraction).min(1.0), m.tissue_mm];
        }
        let open = libm::exp(self.beam.ln_reference()) as f32;
        let pixels = of_pixel.into_par_iter().enumerate().with_min_len(FEWEST_PIXELS);
        let left = pixels
            .map_init(Room::default, |room, (pixel, medium)| self.primary(pixel, medium, room)[0] * open);
        let left = left.collect();
        self.devices.clear();
        Ok(left)
    }

    /// The medium injected up to a time, pixels ascending.
    pub(crate) fn injected(&self, time_s: f64, tip_mm: Option<Vec3>) -> Vec<Medium> {
        self.contrast.as_ref().map_or_else(Vec::new, |contrast| contrast.at(time_s, tip_mm))
    }

    /// Ratio of the signal behind path lengths to that of the open beam. Where they equal those of `before`, its
    /// transmission is reused.
    pub(crate) fn transmission(
        &self,
        paths: &PathLengths,
        before: Option<&(PathLengths, Vec<f32>)>,
    ) -> Result<Vec<f32>> {
        let mut devices = Vec::with_capacity(paths.devices_mm.len());
        for (material, lengths) in &paths.devices_mm {
            devices.push((self.beam.excess(*material, None)?, lengths));
        }
        let at = |map: &[f32], i: usize| map.get(i).copied().unwrap_or(0.0);
        let open = libm::exp(self.beam.ln_reference()) as f32;
        let rays = (0..paths.lumen_mm.len()).into_par_iter().with_min_len(FEWEST_PIXELS);
        let before = before.filter(|before| before.0.is_like(paths));
        let behind = rays.map_init(Lanes::new, |room, i| {
            if let Some((before, left)) = before
                && before.is_same_at(paths, i)
            {
                return left[i];
            }
            let [bone, lung, lumen] = [&paths.bone_mm, &paths.lung_mm, &paths.lumen_mm].map(|map| at(map, i));
            let tissue = (at(&paths.body_mm, i) - bone - lung - lumen).max(0.0);
            let inside: f32 = devices.iter().map(|(_, map)| at(map, i)).sum();
            let lengths =
                [tissue - self.beam.reference_mm(), bone, lung, lumen - inside, at(&paths.contrast_mm, i)];
            let layers =
                self.lanes.iter().zip(lengths).chain(devices.iter().map(|(mu, map)| (mu, at(map, i))));
            let mut sum = [[0.0; LANES]; 2];
            self.beam.add(layers.filter(|layer| layer.1 != 0.0), room, &mut sum);
            sum[0].iter().sum::<f32>() * open
        });
        Ok(behind.collect())
    }

    /// Largest fraction of contrast medium over all times, shown everywhere at once, added to `still`: the source of
    /// a roadmap.
    pub(crate) fn opacified(&self, still: &Still) -> Result<Signal> {
        let contrast = self.contrast.as_ref().ok_or_else(|| {
            let remedy = "a roadmap shows an angiogram; give a [[view.injection]]";
            Error::parameter("view.xray.mode", "roadmap", remedy)
        })?;
        Ok(self.draw(still, &[], &contrast.largest()))
    }

    /// Adds pixels touched by devices and those with contrast medium, both ascending, to the static signal.
    fn draw(&self, still: &Still, pixels: &[u32], medium: &[Medium]) -> Signal {
        let base = self.moving.as_ref().and_then(Moving::signal).unwrap_or(&still.signal);
        let mut now = base.clone();
        let mut lost = Vec::with_capacity(medium.len());
        let anew = merged(pixels, medium);
        let drawn =
            anew.par_iter().with_min_len(FEWEST_PIXELS).map_init(Room::default, |room, (pixel, more)| {
                let pixel = *pixel as usize;
                match self.c_arm.openness(pixel) as f32 {
                    0.0 => [0.0; 2],
                    open => {
                        let [more, tissue_mm] = more.map_or([0.0; 2], |m| [m.fraction, m.tissue_mm]);
                        let medium = [(self.fraction + more).min(1.0), tissue_mm];
                        self.primary(pixel, medium, room).map(|primary| primary * open)
                    }
                }
            });
        let drawn: Vec<[f32; 2]> = drawn.collect();
        for ((pixel, more), primary) in anew.into_iter().zip(drawn) {
            let pixel = pixel as usize;
            let scattered = still.scatter.still(pixel);
            if more.is_some() {
                let before = [base.signal[pixel], base.energy[pixel]];
                lost.push((pixel, std::array::from_fn(|i| primary[i] + scattered[i] - before[i])));
            }
            now.signal[pixel] = primary[0] + scattered[0];
            now.energy[pixel] = primary[1] + scattered[1];
        }
        if !lost.is_empty() {
            still.scatter.add_change(lost.into_iter(), &mut now);
        }
        now
    }
}

/// Tip of the innermost device with a lumen, from which medium flows.
pub(crate) fn injecting_tip_mm(devices: &[RefinedDevice]) -> Option<Vec3> {
    devices.iter().find(|device| device.has_bore())?.points.last().map(|tip| tip.position_mm)
}

/// Pixels of both lists, each ascending, with the medium of the second.
fn merged(pixels: &[u32], medium: &[Medium]) -> Vec<(u32, Option<Medium>)> {
    let mut all = Vec::with_capacity(pixels.len() + medium.len());
    let (mut pixels, mut medium) = (pixels.iter().peekable(), medium.iter().peekable());
    while let Some(pixel) = pixels.peek().copied().into_iter().chain(medium.peek().map(|m| &m.pixel)).min() {
        pixels.next_if_eq(&pixel);
        all.push((*pixel, medium.next_if(|m| m.pixel == *pixel).copied()));
    }
    all
}

#[cfg(test)]
mod tests;
