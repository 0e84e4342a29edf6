//! Which pixels a device covers, by 8 × 8 rays each.
//!
//! The rays of a pixel are the bits of a word. Most pixels near a piece are told by the distance of their centre from the projected
//! axis: those well inside the silhouette are covered, those well outside are not, and only what is between asks all its rays.

use endowire_core::Vec3;

use crate::c_arm::CArm;
use crate::cpu::devices::pixels_of;
use crate::cpu::piece::chord;
use crate::device::Piece;
use crate::output::Mask;

/// Rays across a pixel.
const RAYS: u32 = 8;
/// Distance of a pixel's corner from its centre, and some more for what perspective does to a silhouette, pixels.
const CORNER_PX: f64 = 0.9;

/// Rays of pixels that meet something.
#[derive(Debug)]
pub(crate) struct Coverage {
    words: Vec<u64>,
    /// Pixels with any.
    touched: Vec<u32>,
}

impl Coverage {
    pub(crate) fn new(c_arm: &CArm) -> Self {
        let pixels = c_arm.size_px().map(|n| n as usize).iter().product();
        Self { words: vec![0; pixels], touched: vec![] }
    }

    /// Adds the rays that meet a piece in beam coordinates.
    pub(crate) fn add(&mut self, c_arm: &CArm, piece: &Piece) {
        let [columns, rows] = pixels_of(c_arm, piece);
        let width = c_arm.size_px()[0] as usize;
        let silhouette = Silhouette::new(c_arm, piece);
        for y in rows {
            for x in columns.clone() {
                let index = y * width + x;
                let word = self.words[index];
                if word == u64::MAX {
                    continue;
                }
                let covered = match silhouette.covers([x as f64 + 0.5, y as f64 + 0.5]) {
                    Some(true) => u64::MAX,
                    Some(false) => 0,
                    None => rays_that_meet(c_arm, piece, [x, y]),
                };
                if word == 0 && covered != 0 {
                    self.touched.push(index as u32);
                }
                self.words[index] = word | covered;
            }
        }
    }

    /// The pixels of which half are covered and that the blades leave half open; nothing is covered afterwards.
    pub(crate) fn take(&mut self, c_arm: &CArm) -> Mask {
        self.touched.sort_unstable();
        let words = &self.words;
        let half = |pixel: &u32| words[*pixel as usize].count_ones() >= RAYS * RAYS / 2;
        let seen = |pixel: &u32| c_arm.openness(*pixel as usize) >= 0.5;
        let pixels = self.touched.iter().copied().filter(|pixel| half(pixel) && seen(pixel)).collect();
        self.touched.drain(..).for_each(|pixel| self.words[pixel as usize] = 0);
        Mask::new(c_arm.size_px(), pixels)
    }
}

/// The rays of a pixel that meet a piece.
fn rays_that_meet(c_arm: &CArm, piece: &Piece, [x, y]: [usize; 2]) -> u64 {
    let mut word = 0;
    for ray in 0..RAYS * RAYS {
        let within = |k: u32| (f64::from(k) + 0.5) / f64::from(RAYS);
        let [sx, sy] = c_arm.slopes([x as f64 + within(ray % RAYS), y as f64 + within(ray / RAYS)]);
        let origin = Vec3::new(sx, sy, 0.0) * c_arm.sod_mm();
        if chord(piece, &origin, &Vec3::new(sx, sy, 1.0)) > 0.0 {
            word |= 1 << ray;
        }
    }
    word
}

/// The projected axis of a piece, with what is surely covered and what surely not.
struct Silhouette {
    start: [f64; 2],
    along: [f64; 2],
    length_px: f64,
    /// A pixel whose centre is nearer to the axis and between the ends by more than `ends_px` is covered.
    inner_px: f64,
    ends_px: f64,
    /// One whose centre is farther from the axis than this is not.
    outer_px: f64,
}

impl Silhouette {
    fn new(c_arm: &CArm, piece: &Piece) -> Self {
        let reach = piece.reach();
        let scale = |z: f64| c_arm.focal_px() / (c_arm.sod_mm() + z).max(f64::MIN_POSITIVE);
        let [near, far] = [piece.start.z.min(piece.end.z) - reach, piece.start.z.max(piece.end.z) + reach];
        let [start, end] = [&piece.start, &piece.end].map(|at| c_arm.pixel_of(at));
        let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
        let length_px = dx.hypot(dy);
        let least = piece.radius.min(piece.radius + piece.slope * (piece.end - piece.start).norm());
        let outer_px = if c_arm.sod_mm() + near > 0.0 { reach * scale(near) * 1.05 } else { f64::INFINITY };
        Self {
            start,
            along: [dx / length_px.max(f64::MIN_POSITIVE), dy / length_px.max(f64::MIN_POSITIVE)],
            length_px,
            inner_px: least * scale(far) * 0.98 - CORNER_PX,
            ends_px: outer_px + CORNER_PX,
            outer_px: outer_px + CORNER_PX,
        }
    }

    /// Whether all or none of a pixel is covered, where its centre tells.
    fn covers(&self, centre: [f64; 2]) -> Option<bool> {
        let [x, y] = [centre[0] - self.start[0], centre[1] - self.start[1]];
        let along = x * self.along[0] + y * self.along[1];
        let across = (y * self.along[0] - x * self.along[1]).abs();
        let beyond = (-along).max(along - self.length_px).max(0.0);
        if across.hypot(beyond) > self.outer_px {
            return Some(false);
        }
        let between = along > self.ends_px && along < self.length_px - self.ends_px;
        (between && across < self.inner_px).then_some(true)
    }
}
