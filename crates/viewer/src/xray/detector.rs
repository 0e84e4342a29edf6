//! A flat detector: focal spot, photon noise, light spread, electronics and lag.
//!
//! The signal of a pixel is the energy absorbed in it, one at the reference dose. A focal spot of width f causes a
//! penumbra of f (SID − SOD)/SOD for the isocentre; here it is a Gaussian of the same variance, for all depths that
//! of the isocentre. Of the signal, n = Poisson(λ) photons of the local mean energy arrive; the scintillator's light
//! spreads over the neighbours, signal and noise alike (a Gaussian of deviation `blur_mm`); reading adds electronic
//! noise, as strong as that of the photons of `electronic_ngy`, per pixel; and a part of the last stored signal is read
//! again. It decays with time, whatever the number of frames: λ = `lag` after a thirtieth of a second, λ^(30 t) after t.
//!
//! Random words depend on (seed, geometry, frame, pixel): every pose and plane has independent noise.

use rayon::prelude::*;

use super::blur::Blur;
use super::exp::LANES;
use super::noise::{normal, normal_table, philox, poisson};
use crate::c_arm::CArm;
use crate::spec::{DetectorSpec, XRaySpec};

/// Streams of random words.
const QUANTA: u32 = 0;
const ELECTRONS: u32 = 1;

/// Time after which `lag` of a signal is left, s: the detectors that it is measured of have thirty frames a second.
const LAG_S: f64 = 1.0 / 30.0;

/// Number of pixels whose random words are computed together.
const BLOCK: usize = 4 * LANES;
/// Number of pixels per task of a thread: whole blocks.
const RUN: usize = 256 * BLOCK;

/// Adds noise, blur and lag to signals.
#[derive(Debug)]
pub(crate) struct Detector {
    /// Key of the random words.
    key: [u32; 2],
    noisy: bool,
    focal_spot: Blur,
    light: Blur,
    /// Standard deviation of the electronic noise of a pixel, keV.
    electronic_kev: f32,
    /// Fraction of a signal that is left after [`LAG_S`].
    lag: f64,
    /// Time from the last signal read to the next, s.
    after_s: f64,
    /// The last signal read; empty before the first.
    stored: Vec<f32>,
    /// Widest vector instructions available: the operations are the same with any.
    arch: pulp::Arch,
}

impl Detector {
    /// For a view; `electronic_kev` is the standard deviation of the electronic noise of a pixel.
    pub(crate) fn new(spec: &DetectorSpec, xray: &XRaySpec, c_arm: &CArm, electronic_kev: f64) -> Self {
        let key = u128::from(spec.seed) ^ c_arm.fingerprint();
        let key = (key ^ (key >> 64)) as u64;
        let penumbra_px = xray.focal_spot_mm * (c_arm.sid_mm() / c_arm.sod_mm() - 1.0) / c_arm.pixel_mm();
        Self {
            key: [key as u32, (key >> 32) as u32],
            noisy: spec.noise,
            // A box of width w has the variance w²/12.
            focal_spot: Blur::new(penumbra_px / 12.0_f64.sqrt(), c_arm.size_px()),
            light: Blur::new(spec.blur_mm / c_arm.pixel_mm(), c_arm.size_px()),
            electronic_kev: if spec.noise { electronic_kev as f32 } else { 0.0 },
            lag: spec.lag,
            after_s: LAG_S,
            stored: vec![],
            arch: pulp::Arch::new(),
        }
    }

    /// Removes the stored last frame, so that the next one has no lag from it.
    pub(crate) fn take_stored(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.stored)
    }

    /// Stores the signal of which the next frame has its share.
    pub(crate) fn store(&mut self, signal: Vec<f32>) {
        self.stored = signal;
    }

    /// Sets the time from the last frame to the next.
    pub(crate) fn after(&mut self, after_s: f64) {
        self.after_s = after_s;
    }

    /// Reads one frame. `signal` and `energy` (signal times keV per photon) are those of the pixels; `kev` is the
    /// energy of a unit signal; `frame` numbers the noise.
    pub(crate) fn read(
        &mut self,
        mut signal: Vec<f32>,
        mut energy: Vec<f32>,
        kev: f64,
        frame: u64,
    ) -> Vec<f32> {
        self.focal_spot.spread(&mut signal);
        self.focal_spot.spread(&mut energy);
        let mut image = signal;
        if self.noisy {
            self.count(&mut image, &energy, kev, frame);
        }
        self.light.spread(&mut image);
        if self.electronic_kev > 0.0 {
            self.add_electronic(&mut image, kev, frame);
        }
        if self.stored.len() == image.len() && self.lag > 0.0 {
            let left = libm::pow(self.lag, self.after_s / LAG_S) as f32;
            for (new, old) in image.iter_mut().zip(&self.stored) {
                *new += left * (old - *new);
            }
        }
        if self.lag > 0.0 {
            self.stored.clone_from(&image);
        }
        image
    }

    /// Photon counting: replaces signals by those of random numbers of photons.
    fn count(&self, image: &mut [f32], energy: &[f32], kev: f64, frame: u64) {
        let runs = image.par_chunks_mut(RUN).zip(energy.par_chunks(RUN)).enumerate();
        runs.for_each(|(run, (signal, energy))| {
            let words = Words { key: self.key, first: run * RUN, stream: QUANTA, frame };
            self.arch.dispatch(Counted { words, signal, energy, kev: kev as f32, each: 1.0 / kev as f32 });
        });
    }

    /// Adds electronic noise.
    fn add_electronic(&self, image: &mut [f32], kev: f64, frame: u64) {
        let deviation = self.electronic_kev / kev as f32;
        image.par_chunks_mut(RUN).enumerate().for_each(|(run, signal)| {
            let words = Words { key: self.key, first: run * RUN, stream: ELECTRONS, frame };
            self.arch.dispatch(Disturbed { words, signal, deviation });
        });
    }
}

/// Source of the random words of a run of pixels: four pixels share the words of one counter.
#[derive(Clone, Copy)]
struct Words {
    key: [u32; 2],
    /// Index of the first pixel.
    first: usize,
    stream: u32,
    frame: u64,
}

impl Words {
    /// The words of a block of the run.
    #[inline(always)]
    fn of(&self, block: usize) -> [u32; BLOCK] {
        let mut groups = [(self.first / 4 + block * LANES) as u32; LANES];
        for (lane, group) in groups.iter_mut().enumerate() {
            *group = group.wrapping_add(lane as u32);
        }
        let frame = [self.frame as u32, (self.frame >> 32) as u32];
        let words = philox([groups, [self.stream; LANES], [frame[0]; LANES], [frame[1]; LANES]], self.key);
        let mut of_pixels = [0; BLOCK];
        for lane in 0..LANES {
            for (k, word) in words.iter().enumerate() {
                of_pixels[4 * lane + k] = word[lane];
            }
        }
        of_pixels
    }
}

/// Signals to be replaced by those of numbers of photons. Structs, and loops instead of maps, are inlined where
/// closures are not, and use the widest instructions available.
struct Counted<'a> {
    words: Words,
    signal: &'a mut [f32],
    energy: &'a [f32],
    kev: f32,
    each: f32,
}

impl pulp::WithSimd for Counted<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { words, signal, energy, kev, each } = self;
        let table = normal_table();
        for (block, (signal, energy)) in signal.chunks_mut(BLOCK).zip(energy.chunks(BLOCK)).enumerate() {
            // The last block of an image may be incomplete.
            let (mut s, mut quanta, mut means) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
            s[..signal.len()].copy_from_slice(signal);
            quanta[..energy.len()].copy_from_slice(energy);
            for i in 0..BLOCK {
                // Photons of energy e/s each: s·kev/(e/s) photons.
                quanta[i] /= s[i].max(f32::MIN_POSITIVE);
                means[i] = s[i] * kev / quanta[i].max(1.0);
            }
            let counts = poisson(means, words.of(block), table);
            for i in 0..BLOCK {
                s[i] = (counts[i] * quanta[i] * each).max(0.0);
            }
            signal.copy_from_slice(&s[..signal.len()]);
        }
    }
}

/// Signals to which electronic noise is added.
struct Disturbed<'a> {
    words: Words,
    signal: &'a mut [f32],
    deviation: f32,
}

impl pulp::WithSimd for Disturbed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { words, signal, deviation } = self;
        let table = normal_table();
        for (block, signal) in signal.chunks_mut(BLOCK).enumerate() {
            let words = words.of(block);
            signal.iter_mut().zip(words).for_each(|(s, word)| *s += deviation * normal(word, table));
        }
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::CArmSpec;

    /// Pixels of 0.3 mm, SID 1100 mm and SOD 750 mm.
    fn arm(primary_deg: f64, size_px: [u32; 2]) -> CArm {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
        let spec = CArmSpec { primary_deg, pixel_mm: Some(0.3), ..CArmSpec::default() };
        CArm::new(&spec, size_px, &wall).unwrap()
    }

    /// A tube whose focal spot is a point.
    fn tube() -> XRaySpec {
        XRaySpec { focal_spot_mm: 0.0, ..XRaySpec::default() }
    }

    fn detector(spec: &DetectorSpec) -> Detector {
        Detector::new(&DetectorSpec { seed: 5, ..spec.clone() }, &tube(), &arm(0.0, [32, 8]), 0.0)
    }

    fn ramp() -> Vec<f32> {
        (0..256).map(|i| 0.02 + 0.01 * i as f32).collect()
    }

    /// Mean and variance of each pixel over `frames`.
    fn moments(frames: u64, correlated: f64) -> (Vec<f64>, Vec<f64>) {
        let mut detector =
            detector(&DetectorSpec { blur_mm: correlated, lag: 0.0, ..DetectorSpec::default() });
        let signal = ramp();
        let energy: Vec<f32> = signal.iter().map(|s| s * 60.0).collect();
        let (mut sum, mut squares) = (vec![0.0; 256], vec![0.0; 256]);
        for frame in 0..frames {
            // 100 photons of 60 keV at unit signal.
            for (i, v) in detector.read(signal.clone(), energy.clone(), 6000.0, frame).into_iter().enumerate()
            {
                sum[i] += f64::from(v);
                squares[i] += f64::from(v).powi(2);
            }
        }
        let n = frames as f64;
        let variance = sum.iter().zip(&squares).map(|(s, q)| (q - s * s / n) / (n - 1.0)).collect();
        (sum.into_iter().map(|s| s / n).collect(), variance)
    }

    #[test]
    fn over_a_thousand_frames_the_variance_is_that_of_the_quanta() {
        let (mean, variance) = moments(1000, 0.0);
        // A signal s has 100 s photons: variance s/100. The error of one pixel's variance is 4.5 %, that of 256 0.3
        // %.
        let ratio: f64 = mean.iter().zip(&variance).map(|(m, v)| v / (m / 100.0)).sum::<f64>() / 256.0;
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        // A line through variance against mean has the slope 1/100 and passes through the origin.
        let mm = mean.iter().sum::<f64>() / 256.0;
        let vm = variance.iter().sum::<f64>() / 256.0;
        let slope = mean.iter().zip(&variance).map(|(m, v)| (m - mm) * (v - vm)).sum::<f64>()
            / mean.iter().map(|m| (m - mm).powi(2)).sum::<f64>();
        assert!((slope * 100.0 - 1.0).abs() < 0.02, "{slope}");
        for (m, s) in mean.iter().zip(ramp()) {
            assert!((m - f64::from(s)).abs() < 5.0 * (f64::from(s) / 1e5).sqrt(), "{m} {s}");
        }
        // Counter-check: spread light has a smaller variance than photons.
        let (mean, variance) = moments(300, 0.2);
        let ratio: f64 = mean.iter().zip(&variance).map(|(m, v)| v / (m / 100.0)).sum::<f64>() / 256.0;
        assert!(ratio < 0.7, "{ratio}");
    }

    #[test]
    fn the_same_seed_frame_and_pose_give_the_same_noise_and_others_do_not() {
        let size = [512, 512];
        let flat = vec![1.0_f32; 512 * 512];
        let energy = vec![60.0_f32; 512 * 512];
        let read = |seed, frame, primary_deg| {
            let spec = DetectorSpec { seed, blur_mm: 0.0, ..DetectorSpec::default() };
            let mut detector = Detector::new(&spec, &XRaySpec::default(), &arm(primary_deg, size), 0.0);
            detector.read(flat.clone(), energy.clone(), 6000.0, frame)
        };
        let correlation = |a: &[f32], b: &[f32]| {
            let product = |a: &[f32], b: &[f32]| {
                a.iter().zip(b).map(|(a, b)| f64::from(a - 1.0) * f64::from(b - 1.0)).sum::<f64>()
            };
            product(a, b) / (product(a, a) * product(b, b)).sqrt()
        };
        let one = read(1, 4, 0.0);
        assert_eq!(one, read(1, 4, 0.0));
        // Over 512 × 512 pixels, independent noise has a correlation of 0.002.
        for other in [read(2, 4, 0.0), read(1, 5, 0.0), read(1, 4, 1e-6), read(1, 4, -30.0)] {
            assert!(correlation(&one, &other).abs() < 0.01, "{}", correlation(&one, &other));
        }
        assert!(correlation(&one, &one) > 0.999, "the twin: one field correlates with itself");
    }

    #[test]
    fn electronics_are_as_noisy_as_the_quanta_of_their_dose() {
        // 100 photons of 60 keV, and electronics with the noise of 100 more: √(100) · 60 keV.
        let spec = DetectorSpec { blur_mm: 0.0, lag: 0.0, ..DetectorSpec::default() };
        let variance = |electronic_kev: f64| {
            let size = [256, 256];
            let mut detector = Detector::new(&spec, &XRaySpec::default(), &arm(0.0, size), electronic_kev);
            let image = detector.read(vec![1.0; 65_536], vec![60.0; 65_536], 6000.0, 0);
            image.iter().map(|v| f64::from(v - 1.0).powi(2)).sum::<f64>() / 65_536.0
        };
        assert!((variance(0.0) * 100.0 - 1.0).abs() < 0.02, "{}", variance(0.0));
        assert!((variance(600.0) * 50.0 - 1.0).abs() < 0.02, "{}", variance(600.0));
    }

    #[test]
    fn a_focal_spot_throws_its_penumbra_before_quanta_are_counted() {
        let spec = DetectorSpec { noise: false, blur_mm: 0.0, lag: 0.0, ..DetectorSpec::default() };
        let xray = XRaySpec { focal_spot_mm: 1.2, ..XRaySpec::default() };
        let mut signal = vec![0.0; 640];
        signal[10 * 32 + 16] = 1.0;
        let mut detector = Detector::new(&spec, &xray, &arm(0.0, [32, 20]), 0.0);
        let image = detector.read(signal.clone(), signal.clone(), 1.0, 0);
        let row = &image[320..352];
        let second: f64 = (0..32).map(|x| (f64::from(x) - 16.0).powi(2) * f64::from(row[x as usize])).sum();
        let sum: f64 = row.iter().map(|v| f64::from(*v)).sum();
        // 1.2 mm · 350/750 are 1.87 pixels: a variance of 1.87²/12, and the width of a pixel.
        let expected = 1.8667_f64.powi(2) / 12.0 + 1.0 / 12.0;
        assert!((second / sum / expected - 1.0).abs() < 0.05, "{} {expected}", second / sum);
        // Photon noise after it is independent from pixel to pixel.
        let noisy = DetectorSpec { noise: true, ..spec };
        let mut detector = Detector::new(&noisy, &xray, &arm(0.0, [256, 256]), 0.0);
        let image = detector.read(vec![1.0; 65_536], vec![60.0; 65_536], 6000.0, 0);
        let [own, next] = [0, 1]
            .map(|k| image.windows(2).map(|p| f64::from(p[0] - 1.0) * f64::from(p[k] - 1.0)).sum::<f64>());
        assert!((next / own).abs() < 0.02, "{}", next / own);
    }

    #[test]
    fn light_spreads_as_a_gaussian_and_nothing_is_lost() {
        let spec = DetectorSpec { noise: false, lag: 0.0, blur_mm: 0.36, ..DetectorSpec::default() };
        let mut detector = Detector::new(&spec, &tube(), &arm(0.0, [32, 20]), 0.0);
        let mut signal = vec![0.0; 640];
        signal[10 * 32 + 16] = 1.0;
        let image = detector.read(signal.clone(), signal.clone(), 1.0, 0);
        assert!((image.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let row = &image[320..352];
        let second: f64 = (0..32).map(|x| (f64::from(x) - 16.0).powi(2) * f64::from(row[x as usize])).sum();
        let sum: f64 = row.iter().map(|v| f64::from(*v)).sum();
        // 1.2 pixels, and the width of a pixel: σ² + 1/12.
        assert!((second / sum - (1.44 + 1.0 / 12.0)).abs() < 0.05, "{}", second / sum);
    }

    #[test]
    fn lag_keeps_a_share_of_the_last_frame() {
        let spec = DetectorSpec { noise: false, blur_mm: 0.0, lag: 0.25, ..DetectorSpec::default() };
        let mut detector = detector(&spec);
        assert_eq!(detector.read(vec![1.0; 256], vec![60.0; 256], 1.0, 0), [1.0; 256]);
        assert_eq!(detector.read(vec![2.0; 256], vec![60.0; 256], 1.0, 1), [1.75; 256]);
        // With half of the time between, twice as many frames keep as much: it is of time, not of frames.
        detector.after(0.5 * LAG_S);
        detector.store(vec![1.0; 256]);
        detector.read(vec![2.0; 256], vec![60.0; 256], 1.0, 2);
        let after_two = detector.read(vec![2.0; 256], vec![60.0; 256], 1.0, 3);
        assert!((after_two[0] - 1.75).abs() < 1e-6, "{}", after_two[0]);
        detector.after(10.0 * LAG_S);
        detector.store(vec![1.0; 256]);
        assert!((detector.read(vec![2.0; 256], vec![60.0; 256], 1.0, 4)[0] - 2.0).abs() < 1e-5);
        detector.take_stored();
        assert_eq!(detector.read(vec![2.0; 256], vec![60.0; 256], 1.0, 2), [2.0; 256]);
    }
}
