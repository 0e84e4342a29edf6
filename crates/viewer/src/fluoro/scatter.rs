//! What is smooth over tens of millimetres: scattered quanta, and the shading that displays take out.
//!
//! What patients scatter reaches the detector tens of millimetres from where the primary beam would have, so it is the primary
//! picture, spread widely, scaled to the wanted share of all quanta. It is computed for the anatomy; a device changes it by less
//! than a part in a thousand.

use super::Signal;
use crate::c_arm::CArm;

/// Standard deviation of the spread at the detector, mm.
const SCATTER_MM: f64 = 35.0;
/// The same for shading.
const SHADING_MM: f64 = 25.0;
/// Pixels are gathered into cells of a quarter of it.
const CELLS: f64 = 4.0;
/// The Gaussian ends at this many deviations.
const REACH: f64 = 3.0;

/// The scattered signal beside `primary` when it is on average `share` of all.
pub(super) fn scattered(primary: &Signal, c_arm: &CArm, share: f64) -> Signal {
    let gain = (share / (1.0 - share)) as f32;
    let spread = |map: &[f32]| {
        let mut map = spread(map, c_arm, SCATTER_MM);
        map.iter_mut().for_each(|v| *v *= gain);
        map
    };
    Signal { signal: spread(&primary.signal), energy: spread(&primary.energy) }
}

/// The coarse part of logarithmic values.
pub(super) fn shading(values: &[f32], c_arm: &CArm) -> Vec<f32> {
    spread(values, c_arm, SHADING_MM)
}

/// A map convolved with a wide Gaussian.
fn spread(map: &[f32], c_arm: &CArm, deviation_mm: f64) -> Vec<f32> {
    let size = c_arm.size_px().map(|n| n as usize);
    let cell = ((deviation_mm / CELLS / c_arm.pixel_mm()).round() as usize).clamp(1, size[0].min(size[1]));
    let (coarse, cells) = gathered(map, size, cell);
    let coarse = blurred(&coarse, cells);
    let at = |x: f32, y: f32| {
        let place = |v: f32, n: usize| {
            let v = (v / cell as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let i = (v as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), v - i as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (place(x, cells[0]), place(y, cells[1]));
        let row = |y: usize| coarse[y * cells[0] + x0] * (1.0 - u) + coarse[y * cells[0] + x1] * u;
        row(y0) * (1.0 - v) + row(y1) * v
    };
    (0..size[0] * size[1]).map(|i| at((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5)).collect()
}

/// Means over cells, and their numbers.
fn gathered(map: &[f32], size: [usize; 2], cell: usize) -> (Vec<f32>, [usize; 2]) {
    let cells = size.map(|n| n.div_ceil(cell));
    let mut sums = vec![(0.0, 0_u32); cells[0] * cells[1]];
    for (i, value) in map.iter().enumerate() {
        let sum = &mut sums[i / size[0] / cell * cells[0] + i % size[0] / cell];
        *sum = (sum.0 + value, sum.1 + 1);
    }
    (sums.into_iter().map(|(sum, count)| sum / count as f32).collect(), cells)
}

/// Blurs along rows, then along columns; borders repeat: the body goes on.
fn blurred(map: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let reach = (REACH * CELLS) as isize;
    let weights: Vec<f32> =
        (-reach..=reach).map(|k| (-0.5 * (k as f64 / CELLS).powi(2)).exp() as f32).collect();
    let total: f32 = weights.iter().sum();
    let along = |map: &[f32], step: [isize; 2]| -> Vec<f32> {
        (0..map.len() as isize)
            .map(|i| {
                let (x, y) = (i % width as isize, i / width as isize);
                let sum: f32 = (-reach..=reach)
                    .zip(&weights)
                    .map(|(k, w)| {
                        let x = (x + k * step[0]).clamp(0, width as isize - 1);
                        let y = (y + k * step[1]).clamp(0, height as isize - 1);
                        w * map[(y * width as isize + x) as usize]
                    })
                    .sum();
                sum / total
            })
            .collect()
    };
    along(&along(map, [1, 0]), [0, 1])
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::CArmSpec;

    #[test]
    fn it_is_the_wanted_share_and_smooth() {
        let wall =
            SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::new(50.0, 0.0, 50.0)], triangles: vec![] };
        let spec = CArmSpec { pixel_mm: Some(0.5), ..CArmSpec::default() };
        let arm = CArm::new(&spec, [400, 300], &wall).unwrap();
        let flat = Signal { signal: vec![2.0; 120_000], energy: vec![100.0; 120_000] };
        let scatter = scattered(&flat, &arm, 0.25);
        assert!(scatter.signal.iter().all(|s| (s / (s + 2.0) - 0.25).abs() < 1e-4));
        assert!((scatter.energy[777] - 100.0 / 3.0).abs() < 1e-2);
        // A sharp edge in the primary is none in what is scattered, and the share is kept.
        let edge: Vec<f32> = (0..120_000).map(|i| if i % 400 < 200 { 1.0 } else { 3.0 }).collect();
        let scatter = scattered(&Signal { signal: edge.clone(), energy: edge.clone() }, &arm, 0.5).signal;
        assert!((scatter.iter().sum::<f32>() / edge.iter().sum::<f32>() - 1.0).abs() < 0.02);
        let steepest = scatter.windows(2).take(399).map(|p| (p[1] - p[0]).abs()).fold(0.0, f32::max);
        assert!(steepest < 0.02, "{steepest}");
    }
}
