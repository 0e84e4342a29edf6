//! Frames in time: the memory of the detector, the mask, the roadmap and the last image hold.

use endowire_core::Result;

use super::brightness::{Brightness, Control};
use super::display::{Window, fitted, logarithm, picture};
use super::scatter::shading;
use super::{Fluoroscope, Signal};
use crate::device::RefinedDevice;
use crate::output::Image;
use crate::spec::{Mode, ViewSpec};
use crate::xray::{Blur, Detector, Exposure};

/// Number of frames averaged for a mask or a stored angiogram.
const MASK_FRAMES: u64 = 4;
/// Frame numbers from here on are used for the noise of masks and angiograms.
const MASK_NUMBERS: u64 = 1 << 63;
/// Deviation at the detector of the blur that edge enhancement compares with, mm.
const EDGES_MM: f64 = 0.5;
/// Weight of the newest frame in the last image hold.
const HOLD_WEIGHT: f32 = 0.4;
/// Subtracted values shown white and black, relative to the vessels' strongest.
const DSA_SHARES: Window = [-0.15, 1.05];
/// Fraction of the pixels with contrast medium that may be darker than black.
const DSA_OUTLIERS: f64 = 0.02;
/// Smaller opacities do not count as contrast medium.
const LEAST_OPACITY: f32 = 0.02;
/// Part of the window, at its dark end, in which medium keeps its shades that is denser than black: beyond the densest
/// part of the anatomy, so that nothing else is compressed.
const SHOULDER: f32 = 0.3;
/// How far beyond the densest medium it ends, so that its darkest part is not black.
const BEYOND: f32 = 0.1;
/// Strongest opacification assumed for a window if nothing is injected.
const FAINTEST: f32 = 0.3;
/// Roadmap values shown white and black, around a grey background, and the value of the strongest vessel.
const ROADMAP_WINDOW: Window = [-0.55, 0.55];
const ROADMAP_VESSEL: f32 = -0.4;

/// −ln of signals, relative to that behind the body, that are white and black before subtraction: more than a detector
/// tells apart.
const UNSUBTRACTED_WINDOW: Window = [-8.0, 8.0];
/// From white to black.
pub(crate) const UNSUBTRACTED_LN: f64 = 16.0;

/// Number and time of a frame. The number seeds its noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameTime {
    /// Number of the frame.
    pub frame: u64,
    /// Time since the start of the scene, for injections.
    pub time_s: f64,
}

/// Memory of a sequence of frames.
#[derive(Debug)]
pub(crate) struct Sequence {
    detector: Detector,
    mode: Mode,
    /// Absorbed energy of a pixel at unit signal, keV.
    kev: f64,
    window: Window,
    /// Values from which on darker ones are compressed, and the densest that is still told from black.
    shoulder: Option<[f32; 2]>,
    /// Pixels that are always black: those behind blades, with scatter and noise alone.
    shutter: Vec<u32>,
    bits: u32,
    noisy: bool,
    /// Time of a frame at the view's rate, s, and the time of the last frame.
    frame_s: f64,
    last_s: Option<f64>,
    /// Automatic brightness control.
    control: Control,
    /// Edge enhancement: how much, and the deviation of the blur whose loss it adds, pixels.
    edges: [f64; 2],
    /// Subtracted from −ln of each frame: the stored mask or angiogram, or shading.
    mask: Option<Vec<f32>>,
    /// −ln of the last frame of a subtraction, before its mask is subtracted.
    unsubtracted: Vec<f32>,
    /// Weighted mean of the last frames, the newest weighing most.
    held: Vec<f32>,
    /// Signal of the last mask, and of that at the previous position of the C-arm.
    mask_read: Vec<f32>,
    mask_before: Vec<f32>,
}

/// The detector's memory of the last frame, and of the last mask, at the previous position of the C-arm.
#[derive(Debug, Clone)]
pub(crate) struct Afterglow {
    frame: Vec<f32>,
    last_s: Option<f64>,
    mask: Vec<f32>,
    brightness: Option<Brightness>,
}

impl Sequence {
    pub(crate) fn new(spec: &ViewSpec, fluoroscope: &Fluoroscope) -> Self {
        let c_arm = &fluoroscope.c_arm;
        let mode = spec.xray.mode;
        let dose = fluoroscope.exposure.dose_ngy;
        let offset = fluoroscope.beam.ln_reference();
        let share = spec.xray.harmonised as f32;
        let shown = fluoroscope.shows_body();
        let mask: Option<Vec<f32>> = (matches!(mode, Mode::Fluoro | Mode::Cine) && share > 0.0).then(|| {
            // Relative to the reference, whose logarithm is zero: the middle keeps its grey level.
            let values = logarithm(fluoroscope.still.signal.signal.clone());
            shading(&values, &shown, c_arm).iter().map(|v| share * v).collect()
        });
        // What is subtracted needs the exposure of its mask.
        let constant_s = if matches!(mode, Mode::Fluoro | Mode::Cine) { spec.xray.brightness_s } else { 0.0 };
        let still = &fluoroscope.still.signal;
        let control = Control::new(constant_s, fluoroscope.exposure.entrance_ngy, &shown, still);
        let mut shoulder = None;
        let window = match (mode, spec.xray.window) {
            // Line integrals refer to the open beam, signals to the reference.
            (Mode::Fluoro | Mode::Cine, Some(window)) => window.map(|p| (p + offset) as f32),
            (Mode::Fluoro | Mode::Cine, None) => {
                let mut values = logarithm(fluoroscope.still.signal.signal.clone());
                if let Some(mask) = &mask {
                    values.iter_mut().zip(mask).for_each(|(v, mask)| *v -= mask);
                }
                let [white, black] = fitted(&values, &shown, c_arm.size_px());
                // What shows the anatomy has the same greys whether or not medium will come.
                let densest = densest(fluoroscope, mask.as_deref());
                shoulder = (densest > black).then_some([black - SHOULDER, densest + BEYOND]);
                [white, black]
            }
            (_, Some(window)) => window.map(|p| p as f32),
            (Mode::Dsa, None) => {
                let strongest = strongest(fluoroscope);
                DSA_SHARES.map(|share| share * strongest)
            }
            (Mode::Roadmap, None) => ROADMAP_WINDOW,
        };
        let closed = |pixel: &u32| c_arm.openness(*pixel as usize) < 0.5;
        let shutter = match c_arm.opening_px() {
            Some(_) => (0..c_arm.size_px().iter().product()).filter(closed).collect(),
            None => vec![],
        };
        let kev = fluoroscope.beam.kev(c_arm.pixel_mm(), dose);
        // n photons of the energy ε have a standard deviation of √n ε.
        let electronic = fluoroscope.beam.kev(c_arm.pixel_mm(), spec.detector.electronic_ngy);
        let electronic_kev = (electronic * fluoroscope.beam.quantum_kev()).sqrt();
        Self {
            detector: Detector::new(&spec.detector, &spec.xray, c_arm, electronic_kev),
            mode,
            kev,
            window,
            shoulder,
            shutter,
            bits: spec.bits,
            noisy: spec.detector.noise,
            frame_s: 1.0 / spec.frames_per_s,
            control,
            edges: [spec.xray.edges, EDGES_MM / c_arm.pixel_mm()],
            last_s: None,
            mask,
            unsubtracted: vec![],
            held: vec![],
            mask_read: vec![],
            mask_before: vec![],
        }
    }

    /// The detector's memory of the last frame.
    pub(crate) fn into_afterglow(mut self) -> Afterglow {
        Afterglow {
            frame: self.detector.take_stored(),
            last_s: self.last_s,
            mask: self.mask_read,
            brightness: self.control.state(),
        }
    }

    /// Continues with a detector's memory: the next mask is that of a run with the same motion.
    pub(crate) fn go_on_from(&mut self, afterglow: Afterglow) {
        self.detector.store(afterglow.frame);
        self.last_s = afterglow.last_s;
        self.mask_before = afterglow.mask;
        afterglow.brightness.into_iter().for_each(|state| self.control.go_on_from(state));
    }

    /// The automatic brightness control, for another view of the same run.
    pub(crate) fn brightness(&self) -> Option<Brightness> {
        self.control.state()
    }

    /// Goes on from the brightness of another view of the same run.
    pub(crate) fn brighten(&mut self, state: Brightness) {
        self.last_s = Some(state.time_s());
        self.control.go_on_from(state);
    }

    /// The exposure of the last frame.
    pub(crate) fn exposure(&self, settled: &Exposure) -> Exposure {
        settled.times(self.control.gain())
    }

    /// Reads the next frame and displays it in the scene's mode. The first frame of a subtraction takes its mask
    /// itself.
    pub(crate) fn next(
        &mut self,
        fluoroscope: &mut Fluoroscope,
        pulse: &[Vec<RefinedDevice>],
        moment: FrameTime,
    ) -> Result<Image> {
        if self.mask.is_none() {
            match self.mode {
                Mode::Fluoro | Mode::Cine => {}
                Mode::Dsa => self.take_mask(fluoroscope, pulse)?,
                Mode::Roadmap => self.store_roadmap(fluoroscope)?,
            }
        }
        // The injections of a roadmap are those of its angiogram.
        let time = (self.mode != Mode::Roadmap).then_some(moment.time_s);
        let mut signal = fluoroscope.signal(pulse, time)?;
        // A frame that is drawn again, or before the last one, is one of a run at the view's rate.
        let since_s = self.last_s.map_or(self.frame_s, |last_s| moment.time_s - last_s);
        let since_s = if since_s > 0.0 { since_s } else { self.frame_s };
        self.detector.after(since_s);
        self.control.expose(&mut signal, since_s, moment.time_s);
        self.last_s = Some(moment.time_s);
        let read = self.detector.read(signal.signal, signal.energy, self.kev, moment.frame);
        let mut values = logarithm(read);
        if self.mode == Mode::Dsa {
            self.unsubtracted.clone_from(&values);
        }
        if let Some(mask) = &self.mask {
            values.iter_mut().zip(mask).for_each(|(v, mask)| *v -= mask);
        }
        if self.held.len() == values.len() {
            self.held.iter_mut().zip(&values).for_each(|(held, v)| *held += HOLD_WEIGHT * (v - *held));
        } else {
            self.held.clone_from(&values);
        }
        Ok(self.shown(values, fluoroscope))
    }

    /// The mean of the last frames, the newest weighing most; `None` before the first.
    pub(crate) fn hold(&self, fluoroscope: &Fluoroscope) -> Option<Image> {
        (!self.held.is_empty()).then(|| self.shown(self.held.clone(), fluoroscope))
    }

    /// Mask and last frame of a subtraction as they were read: 16 bits, of the logarithm of the signal.
    pub(crate) fn unsubtracted(&self, fluoroscope: &Fluoroscope) -> Option<[Image; 2]> {
        let mask = self.mask.as_ref().filter(|mask| mask.len() == self.unsubtracted.len())?;
        Some([mask, &self.unsubtracted].map(|values| {
            let mut values = values.clone();
            self.shutter.iter().for_each(|&pixel| values[pixel as usize] = f32::INFINITY);
            picture(&values, UNSUBTRACTED_WINDOW, fluoroscope.c_arm.size_px(), 16, false)
        }))
    }

    fn shown(&self, mut values: Vec<f32>, fluoroscope: &Fluoroscope) -> Image {
        let [more, deviation_px] = self.edges;
        if more > 0.0 {
            let mut coarse = values.clone();
            Blur::new(deviation_px, fluoroscope.c_arm.size_px()).spread(&mut coarse);
            values.iter_mut().zip(coarse).for_each(|(v, coarse)| *v += more as f32 * (*v - coarse));
        }
        if let Some([from, densest]) = self.shoulder {
            let share = (self.window[1] - from) / (densest - from);
            values.iter_mut().filter(|v| **v > from).for_each(|v| *v = from + share * (*v - from));
        }
        self.shutter.iter().for_each(|&pixel| values[pixel as usize] = f32::INFINITY);
        picture(&values, self.window, fluoroscope.c_arm.size_px(), self.bits, !self.noisy)
    }

    /// Stores the current image, without injections, as the mask.
    pub(crate) fn take_mask(
        &mut self,
        fluoroscope: &mut Fluoroscope,
        pulse: &[Vec<RefinedDevice>],
    ) -> Result<()> {
        let signal = fluoroscope.signal(pulse, None)?;
        self.mask = Some(self.stored(&signal, self.kev));
        Ok(())
    }

    /// Stores the anatomy, with the vessels of the angiogram at their displayed brightness.
    fn store_roadmap(&mut self, fluoroscope: &Fluoroscope) -> Result<()> {
        let full = fluoroscope.opacified(&fluoroscope.still)?;
        let kev = self.kev * Mode::Dsa.dose_ngy() / self.mode.dose_ngy();
        let scale = ROADMAP_VESSEL / strongest(fluoroscope);
        let full = self.stored(&full, kev);
        let mut map = self.stored(&fluoroscope.still.signal, kev);
        // A frame minus this is −scale in the vessel.
        map.iter_mut().zip(full).for_each(|(map, full)| *map -= scale * (full - *map));
        self.mask = Some(map);
        Ok(())
    }

    /// −ln of a signal's mean over a few frames.
    fn stored(&mut self, signal: &Signal, kev: f64) -> Vec<f32> {
        let mut mean = vec![0.0; signal.signal.len()];
        // The last frame's part, of which a mask has nothing: it has its share of the previous mask.
        let held = self.detector.take_stored();
        self.detector.after(self.frame_s);
        for k in 0..MASK_FRAMES {
            self.detector.store(self.mask_before.clone());
            let read =
                self.detector.read(signal.signal.clone(), signal.energy.clone(), kev, MASK_NUMBERS + k);
            mean.iter_mut().zip(read).for_each(|(mean, v)| *mean += v / MASK_FRAMES as f32);
        }
        self.detector.store(held);
        self.mask_read.clone_from(&mean);
        logarithm(mean)
    }
}

/// Whether a pixel is not touched by a blade: behind one there is scatter alone, which medium darkens like a signal.
fn is_open(fluoroscope: &Fluoroscope, pixel: usize) -> bool {
    fluoroscope.c_arm.openness(pixel) >= 1.0
}

/// Densest displayed value where contrast medium ever comes, without the darkest few pixels.
fn densest(fluoroscope: &Fluoroscope, mask: Option<&[f32]>) -> f32 {
    let Some([still, full]) = opacified(fluoroscope) else { return f32::MIN };
    let filled = (0..full.len()).filter(|&i| is_open(fluoroscope, i) && full[i] - still[i] > LEAST_OPACITY);
    let values = filled.map(|i| full[i] - mask.map_or(0.0, |mask| mask[i])).collect();
    but_for_outliers(values).unwrap_or(f32::MIN)
}

/// Strongest subtracted value that contrast medium ever causes, without the darkest few pixels.
fn strongest(fluoroscope: &Fluoroscope) -> f32 {
    let Some([still, full]) = opacified(fluoroscope) else { return FAINTEST };
    let open = (0..full.len()).filter(|&i| is_open(fluoroscope, i));
    let opacities = open.map(|i| full[i] - still[i]);
    but_for_outliers(opacities.filter(|v| *v > LEAST_OPACITY).collect()).map_or(FAINTEST, |v| v.max(FAINTEST))
}

/// Values without contrast medium and with its maximum over time; `None` without injections.
fn opacified(fluoroscope: &Fluoroscope) -> Option<[Vec<f32>; 2]> {
    let still = &fluoroscope.still;
    let full = fluoroscope.opacified(still).ok()?;
    Some([logarithm(still.signal.signal.clone()), logarithm(full.signal)])
}

/// The largest value, ignoring outliers.
fn but_for_outliers(mut values: Vec<f32>) -> Option<f32> {
    let last = values.len().checked_sub(1)?;
    let place = (last as f64 * (1.0 - DSA_OUTLIERS)).round() as usize;
    Some(*values.select_nth_unstable_by(place, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::cpu;
    use crate::scene::Setup;
    use crate::spec::{DetectorSpec, TorsoSpec, View};

    fn arm(field_mm: f64) -> crate::CArm {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(40.0)], triangles: vec![] };
        let spec = crate::CArmSpec { field_mm: Some(field_mm), ..crate::CArmSpec::default() };
        crate::CArm::new(&spec, [128, 128], &wall).unwrap()
    }

    /// The displayed values of a frame of a trunk, the mask of that display, where the blades leave all open, and the
    /// window.
    fn shown(field_mm: f64, collimation_mm: Option<[f64; 2]>) -> (Vec<f32>, Vec<f32>, Vec<bool>, Window) {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let mut spec = ViewSpec { views: vec![View::Fluoro], size_px: [128, 128], ..ViewSpec::default() };
        spec.detector = DetectorSpec::ideal();
        spec.patient.torso = Some(TorsoSpec::default());
        spec.c_arm.field_mm = Some(field_mm);
        spec.c_arm.collimation_mm = collimation_mm;
        let setup = Setup::new(&spec, &wall).unwrap();
        let mut engine = cpu::CpuPaths;
        let scope = Fluoroscope::new(&setup, setup.c_arm.as_ref().unwrap(), None, &mut engine).unwrap();
        let sequence = Sequence::new(&spec, &scope);
        let mask = sequence.mask.unwrap();
        let values =
            logarithm(scope.still.signal.signal.clone()).iter().zip(&mask).map(|(v, m)| v - m).collect();
        let open = (0..128 * 128).map(|i| scope.c_arm.openness(i) == 1.0).collect();
        (values, mask, open, sequence.window)
    }

    /// Displayed values of a frame of a trunk at the skin's edge and in air, and the window.
    #[test]
    fn air_is_never_darker_than_the_skin_and_blades_narrow_the_window_to_what_they_leave() {
        let (values, mask, open, window) = shown(700.0, None);
        let air = |i: usize| mask[i] == mask.iter().copied().fold(f32::MIN, f32::max) && values[i] < -2.0;
        let brightest = |is: &dyn Fn(usize) -> bool| {
            (0..values.len()).filter(|&i| is(i)).map(|i| values[i]).fold(f32::MAX, f32::min)
        };
        let darkest = (0..values.len()).filter(|&i| air(i)).map(|i| values[i]).fold(f32::MIN, f32::max);
        assert!((0..values.len()).filter(|&i| air(i)).count() > 500 && open.iter().all(|open| *open));
        let skin = brightest(&|i| !air(i));
        assert!(darkest <= skin + 1e-3, "air {darkest}, skin {skin}");
        // Counter-check: shading that mistakes air for a body leaves it darker than the adjacent skin.
        let raw: Vec<f32> = values.iter().zip(&mask).map(|(v, m)| v + m).collect();
        let arm = arm(700.0);
        let leaking = shading(&raw, &vec![true; raw.len()], &arm);
        let leaking: Vec<f32> = raw.iter().zip(leaking).map(|(v, m)| v - 0.55 * m).collect();
        let far = (0..leaking.len()).filter(|&i| air(i)).map(|i| leaking[i]).fold(f32::MIN, f32::max);
        let rim = (0..leaking.len()).filter(|&i| !air(i)).map(|i| leaking[i]).fold(f32::MAX, f32::min);
        assert!(far > rim + 0.1, "{far} {rim}");
        // With collimation to a part of the trunk there is less to show, and less scatter.
        let (wide, narrow) = (shown(200.0, None), shown(200.0, Some([60.0, 50.0])));
        let width = |window: Window| window[1] - window[0];
        assert!(width(narrow.3) < 0.95 * width(wide.3), "{:?} {:?}", narrow.3, wide.3);
        assert!(width(window) > width(wide.3), "{window:?}");
    }
}
