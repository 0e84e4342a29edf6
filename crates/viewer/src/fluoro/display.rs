//! From signals to grey values.
//!
//! The display is logarithmic, as usual: v = −ln S is mapped linearly from white to black, so that a layer darkens by
//! the same step wherever it is. Subtracted images are already differences of logarithms.

use rayon::prelude::*;

use super::FEWEST_PIXELS;
use crate::output::{Image, PixelFormat};
use crate::xray::ln_lanes;

/// Part of the window brighter than the most transparent position of the anatomy: the background is grey rather than
/// white.
const WINDOW_BELOW: f32 = 0.12;
/// Part of the window darker than the densest position of the anatomy: 0.4 mm of steel or 0.55 mm of nitinol on top
/// of it appear black.
const WINDOW_ABOVE: f32 = 0.4;
/// Fraction of the pixels that may be brighter or darker than the anatomy's range.
const OUTLIERS: f64 = 0.01;
/// The window is fitted to this part of the frame's width and height, around its middle.
const FITTED: f64 = 0.8;
/// Lower bound of signals.
const DARKEST: f32 = 1e-6;

/// Values shown white and black.
pub(super) type Window = [f32; 2];

/// −ln S of each pixel.
pub(super) fn logarithm(mut signal: Vec<f32>) -> Vec<f32> {
    signal.par_chunks_mut(FEWEST_PIXELS).for_each(|signal| {
        signal.iter_mut().for_each(|s| *s = s.max(DARKEST));
        ln_lanes(signal);
        signal.iter_mut().for_each(|v| *v = -*v);
    });
    signal
}

/// The window for the middle of an anatomy where it is `shown`: collimation to a part of it increases contrast.
pub(super) fn fitted(values: &[f32], shown: &[bool], size: [u32; 2]) -> Window {
    let width = size[0] as usize;
    let middle = |i: usize| {
        let off = |at: usize, n: u32| ((at as f64 + 0.5) / f64::from(n) - 0.5).abs();
        off(i % width, size[0]) <= FITTED / 2.0 && off(i / width, size[1]) <= FITTED / 2.0
    };
    let mut sorted: Vec<f32> =
        (0..values.len()).filter(|&i| shown[i] && middle(i)).map(|i| values[i]).collect();
    if sorted.is_empty() {
        return [0.0, 1.0];
    }
    let place = |share: f64, n: usize| ((n - 1) as f64 * share).round() as usize;
    let n = sorted.len();
    let low = *sorted.select_nth_unstable_by(place(OUTLIERS, n), f32::total_cmp).1;
    let high = *sorted.select_nth_unstable_by(place(1.0 - OUTLIERS, n), f32::total_cmp).1;
    [low - WINDOW_BELOW, high + WINDOW_ABOVE]
}

/// Rounding offset in [0, 1) of a pixel: interleaved gradient noise (Jimenez, Next Generation Post Processing in Call
/// of Duty, SIGGRAPH 2014). Rounding all pixels equally would draw contour lines into a smooth background.
fn dither(x: usize, y: usize) -> f32 {
    (52.982_918 * (0.067_110_56 * x as f32 + 0.005_837_15 * y as f32).fract()).fract()
}

/// The image of values in a window; `dithered` if no noise hides the steps of eight bits.
pub(super) fn picture(
    values: &[f32],
    [white, black]: Window,
    size: [u32; 2],
    bits: u32,
    dithered: bool,
) -> Image {
    let [width, height] = size;
    let scale = 1.0 / (black - white);
    if bits == 16 {
        let level = |v: &f32| ((black - v) * scale).clamp(0.0, 1.0);
        let data = values.iter().flat_map(|v| ((level(v) * 65_535.0 + 0.5) as u16).to_be_bytes()).collect();
        return Image::new(width, height, PixelFormat::Gray16, data);
    }
    let mut data = vec![0; values.len()];
    let columns = width as usize;
    let rows = data.par_chunks_exact_mut(columns).zip(values.par_chunks_exact(columns)).enumerate();
    rows.with_min_len(FEWEST_PIXELS.div_ceil(columns)).for_each(|(y, (out, values))| {
        for (x, (out, v)) in out.iter_mut().zip(values).enumerate() {
            let level = ((black - v) * scale).clamp(0.0, 1.0) * 255.0;
            *out = (level + if dithered { dither(x, y) } else { 0.5 }) as u8;
        }
    });
    Image::new(width, height, PixelFormat::Gray8, data)
}
