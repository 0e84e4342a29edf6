//! Frames in time: what the detector, the mask, the roadmap and the last image hold remember.

use endowire_core::Result;

use super::display::{Window, fitted, logarithm, picture};
use super::{Fluoroscope, PathEngine, Signal};
use crate::device::RefinedDevice;
use crate::output::Image;
use crate::spec::{Mode, ViewSpec};
use crate::xray::Detector;

/// Frames that make a mask or a stored angiogram.
const MASK_FRAMES: u64 = 4;
/// Numbers from here on belong to the noise of masks and angiograms, not of frames.
const MASK_NUMBERS: u64 = 1 << 63;
/// Weight of the newest frame in the last image hold.
const HOLD_WEIGHT: f32 = 0.4;
/// ln(mask) − ln(frame) shown white and black: 1 cm of blood with a tenth of contrast medium adds about 0.3.
const DSA_WINDOW: Window = [-0.15, 0.75];
/// ln(angiogram) − ln(frame) shown white and black, around a grey background.
const ROADMAP_WINDOW: Window = [-0.55, 0.45];

/// Number and time of a frame. The number seeds its noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moment {
    /// Number of the frame.
    pub frame: u64,
    /// Time since the start of the scene, for injections.
    pub time_s: f64,
}

/// What a sequence of frames remembers.
#[derive(Debug)]
pub(crate) struct Sequence {
    detector: Detector,
    mode: Mode,
    /// Absorbed energy of a pixel at a signal of one, keV.
    kev: f64,
    window: Window,
    bits: u32,
    noisy: bool,
    /// −ln of the stored mask or angiogram.
    mask: Option<Vec<f32>>,
    /// Values of the last frames, the newest weighing most.
    held: Vec<f32>,
}

impl Sequence {
    pub(crate) fn new(spec: &ViewSpec, fluoroscope: &Fluoroscope) -> Self {
        let c_arm = &fluoroscope.c_arm;
        let mode = spec.xray.mode;
        let dose = spec.detector.dose_ngy.unwrap_or_else(|| mode.dose_ngy());
        let offset = fluoroscope.beam.ln_reference();
        let window = match (mode, spec.xray.window) {
            // Line integrals against the open beam, where signals are told against the reference.
            (Mode::Fluoro | Mode::Cine, Some(window)) => window.map(|p| (p + offset) as f32),
            (Mode::Fluoro | Mode::Cine, None) => {
                fitted(&logarithm(&fluoroscope.still.signal), |pixel| c_arm.openness(pixel) == 1.0)
            }
            (_, Some(window)) => window.map(|p| p as f32),
            (Mode::Dsa, None) => DSA_WINDOW,
            (Mode::Roadmap, None) => ROADMAP_WINDOW,
        };
        Self {
            detector: Detector::new(&spec.detector, spec.detector.seed, c_arm.size_px(), c_arm.pixel_mm()),
            mode,
            kev: fluoroscope.beam.kev(c_arm.pixel_mm(), dose),
            window,
            bits: spec.bits,
            noisy: spec.detector.noise,
            mask: None,
            held: vec![],
        }
    }

    /// Reads the next frame and shows it in the scene's mode. The first one of a subtraction takes its mask itself.
    pub(crate) fn next(
        &mut self,
        fluoroscope: &mut Fluoroscope,
        engine: &mut dyn PathEngine,
        devices: &[RefinedDevice],
        moment: Moment,
    ) -> Result<Image> {
        if self.mask.is_none() {
            match self.mode {
                Mode::Fluoro | Mode::Cine => {}
                Mode::Dsa => self.take_mask(fluoroscope, engine, devices)?,
                Mode::Roadmap => {
                    self.store(&fluoroscope.opacified()?, Mode::Dsa.dose_ngy() / self.mode.dose_ngy())
                }
            }
        }
        let signal = fluoroscope.signal(engine, devices, Some(moment.time_s))?;
        let read = self.detector.read(&signal.signal, &signal.energy, self.kev, moment.frame);
        let mut values = logarithm(&read);
        if let Some(mask) = &self.mask {
            values.iter_mut().zip(mask).for_each(|(v, mask)| *v -= mask);
        }
        if self.held.len() == values.len() {
            self.held.iter_mut().zip(&values).for_each(|(held, v)| *held += HOLD_WEIGHT * (v - *held));
        } else {
            self.held.clone_from(&values);
        }
        Ok(self.shown(&values, fluoroscope))
    }

    /// The mean of the last frames, the newest weighing most; `None` before the first.
    pub(crate) fn hold(&self, fluoroscope: &Fluoroscope) -> Option<Image> {
        (!self.held.is_empty()).then(|| self.shown(&self.held, fluoroscope))
    }

    fn shown(&self, values: &[f32], fluoroscope: &Fluoroscope) -> Image {
        picture(values, self.window, fluoroscope.c_arm.size_px(), self.bits, !self.noisy)
    }

    /// Stores what is there now, without injections, as the mask.
    pub(crate) fn take_mask(
        &mut self,
        fluoroscope: &mut Fluoroscope,
        engine: &mut dyn PathEngine,
        devices: &[RefinedDevice],
    ) -> Result<()> {
        let signal = fluoroscope.signal(engine, devices, None)?;
        self.store(&signal, 1.0);
        Ok(())
    }

    /// Stores a signal, read a few times with `dose` times the dose of a frame.
    fn store(&mut self, signal: &Signal, dose: f64) {
        let mut mean = vec![0.0; signal.signal.len()];
        for k in 0..MASK_FRAMES {
            self.detector.reset();
            let read = self.detector.read(&signal.signal, &signal.energy, self.kev * dose, MASK_NUMBERS + k);
            mean.iter_mut().zip(read).for_each(|(mean, v)| *mean += v / MASK_FRAMES as f32);
        }
        self.detector.reset();
        self.mask = Some(logarithm(&mean));
    }
}
