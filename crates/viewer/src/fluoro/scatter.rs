//! Contributions smooth over tens of millimetres: scattered photons, and the shading that displays remove.
//!
//! Photons scattered in patients reach the detector tens of millimetres from where the primary beam would have, so
//! the scatter image is the primary one, blurred widely and scaled to the wanted fraction of all photons. It is
//! computed for the anatomy; a device changes it by less than a thousandth, but contrast medium in a large vessel by
//! a quarter: so the medium's absorption is blurred too. Over opacified vessels scatter still fills the shadow, so a
//! subtraction keeps edges of bones there, as real ones do.

use rayon::prelude::*;

use super::{FEWEST_PIXELS, Signal};
use crate::c_arm::CArm;

/// Standard deviation of the scatter at the detector, mm.
const SCATTER_MM: f64 = 35.0;
/// The same for shading.
const SHADING_MM: f64 = 25.0;
/// Size of the cells in which pixels are summed, as a fraction of it.
const CELLS: f64 = 4.0;
/// Number of deviations at which the Gaussian is truncated.
const REACH: f64 = 3.0;

/// Scattered signal and signal times photon energy.
#[derive(Debug, Clone)]
pub(super) struct Scatter {
    cells: Cells,
    /// Scatter per unit of primary signal.
    gain: f32,
    /// Scatter of the anatomy, by pixels; empty without scatter.
    still: Vec<[f32; 2]>,
}

impl Scatter {
    /// The scatter for the anatomy's `primary` that is on average a fraction `share` of the total.
    pub(super) fn new(primary: &Signal, c_arm: &CArm, share: f64) -> Self {
        let gain = (share / (1.0 - share)) as f32;
        let mut scatter = Self { cells: Cells::new(c_arm, SCATTER_MM), gain, still: vec![] };
        if scatter.gain > 0.0 {
            let values = primary.signal.iter().zip(&primary.energy).map(|(s, e)| [*s, *e]);
            scatter.still = scatter.cells.spread_out(&scatter.spread(values.enumerate()));
        }
        scatter
    }

    /// Scatter of pixels, by cells.
    fn spread(&self, primary: impl Iterator<Item = (usize, [f32; 2])>) -> Vec<[f32; 2]> {
        let mut cells = self.cells.blurred(&self.cells.gathered(primary));
        cells.iter_mut().for_each(|cell| *cell = cell.map(|v| v * self.gain));
        cells
    }

    /// Scatter of the anatomy at a pixel.
    pub(super) fn still(&self, pixel: usize) -> [f32; 2] {
        self.still.get(pixel).copied().unwrap_or_default()
    }

    /// Adds the scatter of the anatomy.
    pub(super) fn add_still(&self, to: &mut Signal) {
        add(&self.still, to);
    }

    /// Adds the change of scatter where the primary signal of the given pixels differs from the anatomy's.
    pub(super) fn add_change(&self, primary: impl Iterator<Item = (usize, [f32; 2])>, to: &mut Signal) {
        if self.gain > 0.0 {
            add(&self.cells.spread_out(&self.spread(primary)), to);
        }
    }
}

fn add(scattered: &[[f32; 2]], to: &mut Signal) {
    for ((signal, energy), [more, more_energy]) in to.signal.iter_mut().zip(&mut to.energy).zip(scattered) {
        *signal += more;
        *energy += more_energy;
    }
}

/// The low-frequency part of logarithmic values where the body is `shown`, from those values alone. Elsewhere, in air
/// and behind blades, it is its maximum over the body: background beside the body is then as bright as its brightest
/// part, and no skin is brighter than air.
pub(super) fn shading(values: &[f32], shown: &[bool], c_arm: &CArm) -> Vec<f32> {
    let cells = Cells::new(c_arm, SHADING_MM);
    let weighted = values.iter().zip(shown).map(|(v, shown)| if *shown { [*v, 1.0] } else { [0.0; 2] });
    let coarse = cells.spread_out(&cells.blurred(&cells.gathered(weighted.enumerate())));
    let mean = |(of, shown): (&[f32; 2], &bool)| shown.then(|| of[0] / of[1].max(f32::MIN_POSITIVE));
    let means: Vec<Option<f32>> = coarse.iter().zip(shown).map(mean).collect();
    let most = means.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
    let most = if most.is_finite() { most } else { 0.0 };
    means.into_iter().map(|mean| mean.unwrap_or(most)).collect()
}

/// An image in cells, a quarter of a deviation wide each.
#[derive(Debug, Clone)]
struct Cells {
    size_px: [usize; 2],
    side_px: usize,
    count: [usize; 2],
}

impl Cells {
    fn new(c_arm: &CArm, deviation_mm: f64) -> Self {
        let size_px = c_arm.size_px().map(|n| n as usize);
        let side = (deviation_mm / CELLS / c_arm.pixel_mm()).round() as usize;
        let side_px = side.clamp(1, size_px[0].min(size_px[1]));
        Self { size_px, side_px, count: size_px.map(|n| n.div_ceil(side_px)) }
    }

    /// Sums over cells divided by their numbers of pixels.
    fn gathered<const N: usize>(&self, values: impl Iterator<Item = (usize, [f32; N])>) -> Vec<[f32; N]> {
        let mut sums = vec![[0.0; N]; self.count[0] * self.count[1]];
        for (pixel, value) in values {
            let [x, y] = [pixel % self.size_px[0], pixel / self.size_px[0]].map(|i| i / self.side_px);
            let sum = &mut sums[y * self.count[0] + x];
            (0..N).for_each(|i| sum[i] += value[i]);
        }
        for (cell, sum) in sums.iter_mut().enumerate() {
            let side =
                |cell: usize, axis: usize| (self.size_px[axis] - cell * self.side_px).min(self.side_px);
            let pixels = side(cell % self.count[0], 0) * side(cell / self.count[0], 1);
            *sum = sum.map(|v| v / pixels as f32);
        }
        sums
    }

    /// The cells before and after a column or row of pixels, and the weight of the second.
    fn place(&self, pixel: usize, axis: usize) -> (usize, usize, f32) {
        let n = self.count[axis];
        let v = ((pixel as f32 + 0.5) / self.side_px as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        let i = (v as usize).min(n.saturating_sub(2));
        (i, (i + 1).min(n - 1), v - i as f32)
    }

    /// The value at each pixel, bilinear between cell centres.
    fn spread_out<const N: usize>(&self, cells: &[[f32; N]]) -> Vec<[f32; N]> {
        let [width, height] = self.size_px;
        let columns: Vec<_> = (0..width).map(|x| self.place(x, 0)).collect();
        let mut out = vec![[0.0; N]; width * height];
        let rows = out.par_chunks_exact_mut(width).with_min_len(FEWEST_PIXELS.div_ceil(width)).enumerate();
        rows.for_each(|(y, row)| {
            let (y0, y1, v) = self.place(y, 1);
            let [above, below] = [y0, y1].map(|y| &cells[y * self.count[0]..][..self.count[0]]);
            for (out, &(x0, x1, u)) in row.iter_mut().zip(&columns) {
                let [a, b, c, d] = [above[x0], above[x1], below[x0], below[x1]];
                for i in 0..N {
                    out[i] = (a[i] * (1.0 - u) + b[i] * u) * (1.0 - v) + (c[i] * (1.0 - u) + d[i] * u) * v;
                }
            }
        });
        out
    }

    /// Blurs along rows, then along columns; borders are repeated, since the body continues.
    fn blurred<const N: usize>(&self, cells: &[[f32; N]]) -> Vec<[f32; N]> {
        let [width, height] = self.count.map(|n| n as isize);
        let reach = (REACH * CELLS) as isize;
        let weights: Vec<f32> =
            (-reach..=reach).map(|k| libm::exp(-0.5 * (k as f64 / CELLS).powi(2)) as f32).collect();
        let total: f32 = weights.iter().sum();
        let along = |cells: &[[f32; N]], step: [isize; 2]| -> Vec<[f32; N]> {
            (0..cells.len() as isize)
                .map(|i| {
                    let (x, y) = (i % width, i / width);
                    let mut sum = [0.0; N];
                    for (k, w) in (-reach..=reach).zip(&weights) {
                        let x = (x + k * step[0]).clamp(0, width - 1);
                        let y = (y + k * step[1]).clamp(0, height - 1);
                        let cell = &cells[(y * width + x) as usize];
                        (0..N).for_each(|i| sum[i] += w * cell[i]);
                    }
                    sum.map(|v| v / total)
                })
                .collect()
        };
        along(&along(cells, [1, 0]), [0, 1])
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::CArmSpec;

    #[test]
    fn scatter_has_the_wanted_share_and_is_smooth() {
        let wall =
            SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::new(50.0, 0.0, 50.0)], triangles: vec![] };
        let spec = CArmSpec { pixel_mm: Some(0.5), ..CArmSpec::default() };
        let arm = CArm::new(&spec, [400, 300], &wall).unwrap();
        let scattered = |primary: &Signal, share: f64| {
            let mut out = Signal { signal: vec![0.0; 120_000], energy: vec![0.0; 120_000] };
            Scatter::new(primary, &arm, share).add_still(&mut out);
            out
        };
        let flat = Signal { signal: vec![2.0; 120_000], energy: vec![100.0; 120_000] };
        let scatter = scattered(&flat, 0.25);
        assert!(scatter.signal.iter().all(|s| (s / (s + 2.0) - 0.25).abs() < 1e-4));
        assert!((scatter.energy[777] - 100.0 / 3.0).abs() < 1e-2);
        // A sharp edge in the primary signal is smooth in the scatter, and the fraction is preserved.
        let edge: Vec<f32> = (0..120_000).map(|i| if i % 400 < 200 { 1.0 } else { 3.0 }).collect();
        let edge = Signal { signal: edge.clone(), energy: edge };
        let scatter = scattered(&edge, 0.5).signal;
        assert!((scatter.iter().sum::<f32>() / edge.signal.iter().sum::<f32>() - 1.0).abs() < 0.02);
        let steepest = scatter.windows(2).take(399).map(|p| (p[1] - p[0]).abs()).fold(0.0, f32::max);
        assert!(steepest < 0.02, "{steepest}");
        // Updating some pixels gives the same as recomputing all.
        let mut changed = flat.clone();
        let of = |x: usize| if (100..260).contains(&x) { -1.5 } else { 0.0 };
        (0..120_000).for_each(|i| changed.signal[i] += of(i % 400));
        let anew = scattered(&changed, 0.25).signal;
        let mut more = scattered(&flat, 0.25);
        let pixels = (0..120_000).filter(|i| of(i % 400) != 0.0).map(|i| (i, [of(i % 400), 0.0]));
        Scatter::new(&flat, &arm, 0.25).add_change(pixels, &mut more);
        assert!(anew.iter().zip(&more.signal).all(|(a, b)| (a - b).abs() < 1e-5));
        assert!(anew[60_200] < 0.8 * anew[60_010], "less is scattered where less arrives");
    }
}
