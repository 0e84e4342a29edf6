//! Gaussian blurs, along rows and then along columns.

use rayon::prelude::*;

/// Number of deviations at which the kernel is truncated.
const KERNEL_REACH: f64 = 3.0;
/// Deviation below which a blur is invisible, pixels.
const LEAST_PX: f64 = 0.05;

/// Smallest number of rows per thread.
const FEWEST_ROWS: usize = 16;

/// A Gaussian kernel for one image size.
#[derive(Debug)]
pub(crate) struct Blur {
    size_px: [usize; 2],
    /// Symmetric kernel: the middle and one side.
    kernel: Vec<f32>,
    padded: Vec<f32>,
}

impl Blur {
    /// For a deviation in pixels.
    pub(crate) fn new(deviation_px: f64, size_px: [u32; 2]) -> Self {
        let reach = if deviation_px < LEAST_PX { 0 } else { (KERNEL_REACH * deviation_px).ceil() as usize };
        // Integrals of the Gaussian over pixels tend to its samples; a narrow one is summed over sub-pixels.
        const PARTS: i32 = 16;
        let weight = |k: usize| -> f64 {
            (0..PARTS)
                .map(|part| {
                    let x = k as f64 + (f64::from(part) + 0.5) / f64::from(PARTS) - 0.5;
                    libm::exp(-0.5 * (x / deviation_px.max(LEAST_PX)).powi(2))
                })
                .sum()
        };
        let side: Vec<f64> = (0..=reach).map(weight).collect();
        let total = side[0] + 2.0 * side[1..].iter().sum::<f64>();
        Self {
            size_px: size_px.map(|n| n as usize),
            kernel: side.iter().map(|w| (w / total) as f32).collect(),
            padded: vec![],
        }
    }

    /// Whether it changes anything.
    pub(super) fn is_visible(&self) -> bool {
        self.kernel.len() > 1
    }

    /// Blurs an image; borders are repeated.
    pub(crate) fn spread(&mut self, image: &mut [f32]) {
        if !self.is_visible() {
            return;
        }
        let [width, height] = self.size_px;
        let reach = self.kernel.len() - 1;
        let kernel = &self.kernel;
        let rows = image.par_chunks_exact_mut(width).with_min_len(FEWEST_ROWS);
        rows.for_each_init(
            || vec![0.0; width + 2 * reach],
            |line, row| {
                line[reach..reach + width].copy_from_slice(row);
                line[..reach].fill(row[0]);
                line[reach + width..].fill(row[width - 1]);
                row.iter_mut().zip(&line[reach..]).for_each(|(out, v)| *out = v * kernel[0]);
                for k in 1..=reach {
                    let sides = line[reach - k..].iter().zip(&line[reach + k..]);
                    row.iter_mut().zip(sides).for_each(|(out, (a, b))| *out += kernel[k] * (a + b));
                }
            },
        );
        self.padded.clear();
        self.padded.extend_from_slice(image);
        let padded = &self.padded;
        let source = |y: isize| {
            let y = y.clamp(0, height as isize - 1) as usize;
            &padded[y * width..][..width]
        };
        let rows = image.par_chunks_exact_mut(width).with_min_len(FEWEST_ROWS).enumerate();
        rows.for_each(|(y, row)| {
            let y = y as isize;
            row.iter_mut().zip(source(y)).for_each(|(out, v)| *out = v * kernel[0]);
            for k in 1..=reach as isize {
                let sides = source(y - k).iter().zip(source(y + k));
                let weight = kernel[k as usize];
                row.iter_mut().zip(sides).for_each(|(out, (a, b))| *out += weight * (a + b));
            }
        });
    }
}
