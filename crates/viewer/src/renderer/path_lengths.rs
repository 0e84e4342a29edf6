//! Path lengths in every material, and their transmission: the image's physics without its noise.

use endowire_core::Result;

use super::{Renderer, no_fluoro, prepared};
use crate::contrast::Medium;
use crate::device::{DeviceView, RefinedDevice};
use crate::fluoro::{Anatomy, Fluoroscope, injecting_tip_mm};
use crate::scene::Setup;
use crate::spec::Mode;
use crate::xray::PathLengths;

impl Renderer {
    /// Path lengths of the rays through the pixel centres, and inside devices the means over pixels, before any
    /// injection.
    ///
    /// # Errors
    /// As [`Self::render_at`], and [`Error::Parameter`](endowire_core::Error::Parameter) without the fluoroscopic
    /// view.
    pub fn path_lengths(&mut self, devices: &[DeviceView]) -> Result<PathLengths> {
        self.lengths(devices, None)
    }

    /// As [`Self::path_lengths`], with the contrast medium at a time, s.
    ///
    /// # Errors
    /// As [`Self::path_lengths`].
    pub fn path_lengths_at(&mut self, devices: &[DeviceView], time_s: f64) -> Result<PathLengths> {
        self.lengths(devices, Some(time_s))
    }

    fn lengths(&mut self, devices: &[DeviceView], time_s: Option<f64>) -> Result<PathLengths> {
        let c_arm = self.setup.c_arm.clone().ok_or_else(no_fluoro)?;
        let [width, height] = c_arm.size_px();
        let pixels = width as usize * height as usize;
        let devices = self.setup.in_beam(devices)?;
        if self.central.is_none() {
            self.central = Some(self.with_fallback(|setup, engines, _, _| {
                let engine = engines.paths.as_mut().ok_or_else(no_fluoro)?;
                Anatomy::new(setup, &c_arm, 1, engine.as_mut())
            })?);
        }
        let (devices_mm, injected) = self.with_fallback(|setup, engines, fluoro, kept| {
            let (scope, _, paths) = prepared(setup, engines, fluoro, kept)?;
            scope.breathe(setup, time_s, paths)?;
            let maps = scope.inside_devices(&devices)?;
            Ok((maps, injected(setup, scope, &devices, time_s)))
        })?;
        let Anatomy { body, bone, mut lung, lumen, faded, .. } = self.central.clone().unwrap_or_default();
        if let Some((scope, _)) = &self.fluoro {
            scope.add_air(&mut lung);
        }
        let fraction = self.setup.spec.xray.contrast_fraction as f32;
        let mut contrast_mm = vec![];
        if fraction > 0.0 || !injected.is_empty() {
            // A device may fill all of the lumen on a ray, and be longer there by rounding, or at the edge of a vessel,
            // where its length is a mean over the pixel and that of the lumen is not.
            let filling = |i: usize| (lumen[i] - devices_mm.iter().map(|map| map.1[i]).sum::<f32>()).max(0.0);
            let lacking = |i: usize| fraction * faded.get(i).copied().unwrap_or(0.0);
            let constant = |i: usize| (fraction * filling(i) - lacking(i)).max(0.0);
            contrast_mm = (0..pixels).map(constant).collect();
            for medium in injected {
                let i = medium.pixel as usize;
                let in_lumen = (fraction + medium.fraction).min(1.0) * filling(i) - lacking(i);
                contrast_mm[i] = in_lumen.max(0.0) + medium.tissue_mm;
            }
        }
        Ok(PathLengths {
            width,
            height,
            body_mm: body,
            bone_mm: bone,
            lung_mm: lung,
            lumen_mm: lumen,
            contrast_mm,
            devices_mm,
        })
    }

    /// Transmitted fraction of the absorbed energy, per pixel of the image at a time, before scatter, blades and the
    /// detector: the mean over a pixel's rays, where [`Self::transmission`] of its mean lengths would be smaller
    /// behind a thin wire. −ln of it is the line integral.
    ///
    /// # Errors
    /// As [`Self::path_lengths`].
    pub fn transmission_at(&mut self, devices: &[DeviceView], time_s: f64) -> Result<Vec<f32>> {
        let devices = self.setup.in_beam(devices)?;
        self.with_fallback(|setup, engines, fluoro, kept| {
            let (scope, _, paths) = prepared(setup, engines, fluoro, kept)?;
            scope.breathe(setup, Some(time_s), paths)?;
            let medium = injected(setup, scope, &devices, Some(time_s));
            scope.transmitted(&devices, &medium)
        })
    }

    /// Transmitted fraction of the absorbed energy behind the given path lengths, with this scene's spectrum and
    /// detector: the ratio of the signal to that of the open beam. −ln of it is the line integral.
    ///
    /// # Errors
    /// [`Error::Parameter`](endowire_core::Error::Parameter) without the fluoroscopic view.
    pub fn transmission(&mut self, paths: &PathLengths) -> Result<Vec<f32>> {
        let before = self.transmitted.take();
        let left = self.with_fallback(|setup, engines, fluoro, kept| {
            prepared(setup, engines, fluoro, kept)?.0.transmission(paths, before.as_ref())
        })?;
        self.transmitted = Some((paths.clone(), left.clone()));
        Ok(left)
    }
}

/// The medium injected up to a time; none without a time. A roadmap's injections are those of its angiogram.
fn injected(
    setup: &Setup,
    scope: &Fluoroscope,
    devices: &[RefinedDevice],
    time_s: Option<f64>,
) -> Vec<Medium> {
    let injecting = setup.flow.is_some() && setup.spec.xray.mode != Mode::Roadmap;
    let time_s = time_s.filter(|_| injecting);
    time_s.map_or_else(Vec::new, |time_s| scope.injected(time_s, injecting_tip_mm(devices)))
}
