//! A flat detector: quanta, light spread and lag.
//!
//! The signal of a pixel is the energy absorbed in it, one at the reference dose. Of it, n = Poisson(λ) quanta of the local mean
//! energy arrive; the scintillator's light spreads over the neighbours, signal and noise alike (a Gaussian of deviation
//! `blur_mm`); and a share `lag` of what was stored before is read again.

use super::noise::{normal_table, philox, poisson};
use crate::spec::DetectorSpec;

/// The blur's kernel ends at this many deviations.
const KERNEL_REACH: f64 = 3.0;
/// Deviations of the blur below this many pixels change nothing visible.
const LEAST_BLUR_PX: f64 = 0.05;

/// Turns signals into noisy, blurred and lagging ones.
#[derive(Debug)]
pub(crate) struct Detector {
    size_px: [usize; 2],
    seed: u64,
    noisy: bool,
    /// Symmetric kernel: the middle and one side.
    kernel: Vec<f32>,
    lag: f32,
    /// The last signal read; empty before the first.
    stored: Vec<f32>,
    padded: Vec<f32>,
}

impl Detector {
    pub(crate) fn new(spec: &DetectorSpec, seed: u64, size_px: [u32; 2], pixel_mm: f64) -> Self {
        let deviation = spec.blur_mm / pixel_mm;
        let reach = if deviation < LEAST_BLUR_PX { 0 } else { (KERNEL_REACH * deviation).ceil() as usize };
        // Integrals of the Gaussian over pixels tend to samples of it; a slim one is summed over parts of pixels.
        const PARTS: i32 = 16;
        let weight = |k: usize| -> f64 {
            (0..PARTS)
                .map(|part| {
                    let x = k as f64 + (f64::from(part) + 0.5) / f64::from(PARTS) - 0.5;
                    (-0.5 * (x / deviation.max(LEAST_BLUR_PX)).powi(2)).exp()
                })
                .sum()
        };
        let side: Vec<f64> = (0..=reach).map(weight).collect();
        let total = side[0] + 2.0 * side[1..].iter().sum::<f64>();
        Self {
            size_px: size_px.map(|n| n as usize),
            seed,
            noisy: spec.noise,
            kernel: side.iter().map(|w| (w / total) as f32).collect(),
            lag: spec.lag as f32,
            stored: vec![],
            padded: vec![],
        }
    }

    /// Forgets what was stored.
    pub(crate) fn reset(&mut self) {
        self.stored.clear();
    }

    /// Reads one frame. `signal` and `energy` (signal times keV a quantum) are those of the pixels; `kev` is the energy that a
    /// signal of one stands for; `frame` numbers the noise.
    pub(crate) fn read(&mut self, signal: &[f32], energy: &[f32], kev: f64, frame: u64) -> Vec<f32> {
        let mut image = if self.noisy { self.counted(signal, energy, kev, frame) } else { signal.to_vec() };
        if self.kernel.len() > 1 {
            self.spread(&mut image);
        }
        if self.stored.len() == image.len() && self.lag > 0.0 {
            for (new, old) in image.iter_mut().zip(&self.stored) {
                *new += self.lag * (old - *new);
            }
        }
        if self.lag > 0.0 {
            self.stored.clone_from(&image);
        }
        image
    }

    /// Counts quanta.
    fn counted(&self, signal: &[f32], energy: &[f32], kev: f64, frame: u64) -> Vec<f32> {
        let key = [self.seed as u32, (self.seed >> 32) as u32];
        let [low, high] = [frame as u32, (frame >> 32) as u32];
        let (kev, each) = (kev as f32, 1.0 / kev as f32);
        let normal = normal_table();
        let mut image = vec![0.0; signal.len()];
        let groups = image.chunks_mut(4).zip(signal.chunks(4).zip(energy.chunks(4)));
        for (group, (image, (signal, energy))) in (0_u32..).zip(groups) {
            let words = philox([group, 0, low, high], key);
            for (((out, &s), &e), word) in image.iter_mut().zip(signal).zip(energy).zip(words) {
                // An energy of e/s each: s·kev/(e/s) quanta.
                let quantum = e / s.max(f32::MIN_POSITIVE);
                let mean = s * kev / quantum.max(1.0);
                *out = (poisson(mean, word, normal) * quantum * each).max(0.0);
            }
        }
        image
    }

    /// Spreads light along rows, then along columns; borders repeat.
    fn spread(&mut self, image: &mut [f32]) {
        let [width, height] = self.size_px;
        let reach = self.kernel.len() - 1;
        let mut line = vec![0.0; width + 2 * reach];
        for row in image.chunks_exact_mut(width) {
            line[reach..reach + width].copy_from_slice(row);
            line[..reach].fill(row[0]);
            line[reach + width..].fill(row[width - 1]);
            row.iter_mut().zip(&line[reach..]).for_each(|(out, v)| *out = v * self.kernel[0]);
            for k in 1..=reach {
                let sides = line[reach - k..].iter().zip(&line[reach + k..]);
                row.iter_mut().zip(sides).for_each(|(out, (a, b))| *out += self.kernel[k] * (a + b));
            }
        }
        self.padded.clear();
        self.padded.extend_from_slice(image);
        let source = |y: isize| {
            let y = y.clamp(0, height as isize - 1) as usize;
            &self.padded[y * width..][..width]
        };
        for (y, row) in (0..).zip(image.chunks_exact_mut(width)) {
            row.iter_mut().zip(source(y)).for_each(|(out, v)| *out = v * self.kernel[0]);
            for k in 1..=reach as isize {
                let sides = source(y - k).iter().zip(source(y + k));
                let weight = self.kernel[k as usize];
                row.iter_mut().zip(sides).for_each(|(out, (a, b))| *out += weight * (a + b));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detector(spec: &DetectorSpec) -> Detector {
        Detector::new(spec, 5, [32, 8], 0.3)
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
            // 100 quanta of 60 keV at a signal of one.
            for (i, v) in detector.read(&signal, &energy, 6000.0, frame).into_iter().enumerate() {
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
        // A signal s has 100 s quanta: variance s/100. One pixel's variance is known to 4.5 %, that of 256 to 0.3 %.
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
        // The twin: spread light has less variance than quanta.
        let (mean, variance) = moments(300, 0.2);
        let ratio: f64 = mean.iter().zip(&variance).map(|(m, v)| v / (m / 100.0)).sum::<f64>() / 256.0;
        assert!(ratio < 0.7, "{ratio}");
    }

    #[test]
    fn the_same_seed_and_frame_give_the_same_noise_and_others_do_not() {
        let signal = ramp();
        let energy: Vec<f32> = signal.iter().map(|s| s * 60.0).collect();
        let read = |seed, frame| {
            Detector::new(&DetectorSpec::default(), seed, [32, 8], 0.3).read(&signal, &energy, 6000.0, frame)
        };
        assert_eq!(read(1, 4), read(1, 4));
        assert_ne!(read(1, 4), read(2, 4));
        assert_ne!(read(1, 4), read(1, 5));
    }

    #[test]
    fn light_spreads_as_a_gaussian_and_nothing_is_lost() {
        let spec = DetectorSpec { noise: false, lag: 0.0, blur_mm: 0.36, ..DetectorSpec::default() };
        let mut detector = Detector::new(&spec, 5, [32, 20], 0.3);
        let mut signal = vec![0.0; 640];
        signal[10 * 32 + 16] = 1.0;
        let image = detector.read(&signal, &signal, 1.0, 0);
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
        assert_eq!(detector.read(&[1.0; 256], &[60.0; 256], 1.0, 0), [1.0; 256]);
        assert_eq!(detector.read(&[2.0; 256], &[60.0; 256], 1.0, 1), [1.75; 256]);
        detector.reset();
        assert_eq!(detector.read(&[2.0; 256], &[60.0; 256], 1.0, 2), [2.0; 256]);
    }
}
