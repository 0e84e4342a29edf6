//! A scale bar in the lower left corner of the 3D view.
//!
//! The view is in perspective: the bar is valid at the depth of the vessel's middle.

use crate::output::Image;
use crate::three_d::Camera;
use crate::three_d::room::Room;
use crate::three_d::text::{columns, text};

/// Possible lengths of a bar, mm.
const LENGTHS_MM: [u32; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
/// Longest bar, as a fraction of the width.
const LONGEST: f64 = 0.25;
pub(super) const INK: [u8; 4] = [70, 78, 90, 255];

/// Draws the longest bar that fits, if there is room for its text.
pub(super) fn draw(image: &mut Image, camera: &Camera, room: &mut Room) {
    let [near, far] = camera.wall_range;
    let pixel_mm = camera.pixel_mm_at((near + far) / 2.0);
    let most = f64::from(image.width()) * LONGEST * pixel_mm;
    let Some(length) = LENGTHS_MM.into_iter().rev().find(|&mm| f64::from(mm) <= most) else { return };
    let dot = (image.height() / 320).max(1);
    let (left, bottom) = (8 * dot, image.height().saturating_sub(8 * dot));
    let width = (f64::from(length) / pixel_mm).round() as u32;
    let label = format!("{length} mm");
    let wide = width.max(3 * dot + columns(&label) * dot);
    if !room.take([left, bottom.saturating_sub(10 * dot)], [wide, 10 * dot]) {
        return;
    }
    let mut fill = |x: u32, y: u32, w: u32, h: u32| image.fill([x, y], [w, h], INK);
    fill(left, bottom.saturating_sub(dot), width, dot);
    fill(left, bottom.saturating_sub(4 * dot), dot, 4 * dot);
    fill(left + width.saturating_sub(dot), bottom.saturating_sub(4 * dot), dot, 4 * dot);
    text(image, [left + 3 * dot, bottom.saturating_sub(10 * dot)], dot, &label, INK);
}
