//! A scale bar in the lower left corner of the 3D view.
//!
//! The view is in perspective: the bar tells lengths at the depth of the vessel's middle.

use crate::output::Image;
use crate::three_d::Camera;

/// Lengths that a bar may have, mm.
const LENGTHS_MM: [u32; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
/// Longest bar, as part of the width.
const LONGEST: f64 = 0.25;
const INK: [u8; 4] = [70, 78, 90, 255];

/// Glyphs of 3 × 5 dots, a row in three bits, the left one highest.
const DIGITS: [[u8; 5]; 10] = [
    [7, 5, 5, 5, 7],
    [2, 6, 2, 2, 7],
    [7, 1, 7, 4, 7],
    [7, 1, 7, 1, 7],
    [5, 5, 7, 1, 1],
    [7, 4, 7, 1, 7],
    [7, 4, 7, 5, 7],
    [7, 1, 1, 2, 2],
    [7, 5, 7, 5, 7],
    [7, 5, 7, 1, 7],
];
/// The letter m takes five columns.
const M: [u8; 5] = [0, 0b11010, 0b10101, 0b10101, 0b10101];

/// Draws the longest bar that fits.
pub(crate) fn draw(image: &mut Image, camera: &Camera) {
    let [near, far] = camera.wall_range;
    let pixel_mm = camera.pixel_mm_at((near + far) / 2.0);
    let most = f64::from(image.width()) * LONGEST * pixel_mm;
    let Some(length) = LENGTHS_MM.into_iter().rev().find(|&mm| f64::from(mm) <= most) else { return };
    let dot = (image.height() / 320).max(1);
    let (left, bottom) = (8 * dot, image.height().saturating_sub(8 * dot));
    let width = (f64::from(length) / pixel_mm).round() as u32;
    let mut fill = |x: u32, y: u32, w: u32, h: u32| {
        for y in y..y + h {
            for x in x..x + w {
                image.set(x, y, INK);
            }
        }
    };
    fill(left, bottom.saturating_sub(dot), width, dot);
    fill(left, bottom.saturating_sub(4 * dot), dot, 4 * dot);
    fill(left + width.saturating_sub(dot), bottom.saturating_sub(4 * dot), dot, 4 * dot);
    let digits = length.to_string().into_bytes().into_iter().map(|d| (DIGITS[usize::from(d - b'0')], 3));
    let mut x = left + 3 * dot;
    let top = bottom.saturating_sub(10 * dot);
    for (glyph, columns) in digits.chain([([0; 5], 1), (M, 5), (M, 5)]) {
        for (row, bits) in (0..).zip(glyph) {
            for column in 0..columns {
                if bits >> (columns - 1 - column) & 1 == 1 {
                    fill(x + column * dot, top + row * dot, dot, dot);
                }
            }
        }
        x += (columns + 1) * dot;
    }
}
