//! The pixels covered by a device, by 8 × 8 rays each.
//!
//! The rays of a pixel are the bits of a word. Most pixels near a piece are decided by the distance of their centre
//! from the projected axis: those well inside the silhouette are covered, those well outside are not, and only those
//! in between test all rays.
//!
//! A wire thinner than a pixel may cover half of none. There it is treated as a line: the pixels crossed by its axis
//! are in its mask too, so that the mask of one wire is connected.

use std::ops::Range;

use endowire_core::Vec3;

use crate::c_arm::CArm;
use crate::cpu::band::outer_px;
use crate::cpu::devices::pixels_of;
use crate::cpu::piece::chord;
use crate::device::Piece;
use crate::output::Mask;

/// Number of rays across a pixel.
const RAYS: u32 = 8;
/// Distance of a pixel's corner from its centre, plus a margin for perspective effects on the silhouette, pixels.
const CORNER_PX: f64 = 0.9;

/// Rays of pixels that hit something.
#[derive(Debug)]
pub(crate) struct Coverage {
    words: Vec<u64>,
    /// Pixels with any such ray.
    touched: Vec<u32>,
    /// Pixels crossed by the axis, possibly repeated.
    on_axis: Vec<u32>,
}

impl Coverage {
    pub(crate) fn new(c_arm: &CArm) -> Self {
        let pixels = c_arm.size_px().map(|n| n as usize).iter().product();
        Self { words: vec![0; pixels], touched: vec![], on_axis: vec![] }
    }

    /// Adds the rays that hit a piece in beam coordinates.
    pub(crate) fn add(&mut self, c_arm: &CArm, piece: &Piece) {
        let [columns, rows] = pixels_of(c_arm, piece);
        let width = c_arm.size_px()[0] as usize;
        let silhouette = Silhouette::new(c_arm, piece);
        silhouette.walk(c_arm.size_px(), |pixel| self.on_axis.push(pixel));
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
                    None => rays_that_meet(c_arm, piece, &silhouette, [x, y]),
                };
                if word == 0 && covered != 0 {
                    self.touched.push(index as u32);
                }
                self.words[index] = word | covered;
            }
        }
    }

    /// Adds the coverage of another.
    pub(crate) fn join(&mut self, other: &Self) {
        for &pixel in &other.touched {
            let word = &mut self.words[pixel as usize];
            if *word == 0 {
                self.touched.push(pixel);
            }
            *word |= other.words[pixel as usize];
        }
        self.on_axis.extend(&other.on_axis);
    }

    /// The pixels at least half covered, or crossed by the axis, and at least half open between the blades; clears
    /// the coverage.
    pub(crate) fn take(&mut self, c_arm: &CArm) -> Mask {
        let words = &self.words;
        let half = |pixel: &u32| words[*pixel as usize].count_ones() >= RAYS * RAYS / 2;
        let seen = |pixel: &u32| c_arm.openness(*pixel as usize) >= 0.5;
        let covered = self.touched.iter().copied().filter(half);
        let mut pixels: Vec<u32> = covered.chain(self.on_axis.drain(..)).filter(seen).collect();
        pixels.sort_unstable();
        pixels.dedup();
        self.touched.drain(..).for_each(|pixel| self.words[pixel as usize] = 0);
        Mask::new(c_arm.size_px(), pixels)
    }
}

/// The rays of a pixel that hit a piece. A frustum is convex, and so is its silhouette: in a row of rays it covers a
/// run, and if the four corners are covered, all.
fn rays_that_meet(c_arm: &CArm, piece: &Piece, silhouette: &Silhouette, [x, y]: [usize; 2]) -> u64 {
    let meets = |column: u32, row: u32| {
        let within = |k: u32| (f64::from(k) + 0.5) / f64::from(RAYS);
        let at = [x as f64 + within(column), y as f64 + within(row)];
        if silhouette.is_beyond(at, 0.0) {
            return false;
        }
        let [sx, sy] = c_arm.slopes(at);
        let origin = Vec3::new(sx, sy, 0.0) * c_arm.sod_mm();
        chord(piece, &origin, &Vec3::new(sx, sy, 1.0)) > 0.0
    };
    const LAST: u32 = RAYS - 1;
    const ROW: u64 = (1 << RAYS) - 1;
    let ends = [0, LAST].map(|row| [meets(0, row), meets(LAST, row)]);
    if ends == [[true; 2]; 2] {
        return u64::MAX;
    }
    let mut word = 0;
    for row in 0..RAYS {
        let ends = match row {
            0 => ends[0],
            LAST => ends[1],
            row => [meets(0, row), meets(LAST, row)],
        };
        let run = match ends {
            [true, true] => ROW,
            // The first uncovered ray after covered ones, and vice versa.
            [true, false] => (1_u64 << first_in(1..LAST, |column| !meets(column, row))) - 1,
            [false, true] => ROW & !((1_u64 << first_in(1..LAST, |column| meets(column, row))) - 1),
            [false, false] => (1..LAST).filter(|&column| meets(column, row)).fold(0, |run, c| run | 1 << c),
        };
        word |= run << (row * RAYS);
    }
    word
}

/// The first number of a range from which on `is` holds, or its end.
fn first_in(range: Range<u32>, is: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (range.start, range.end);
    while low < high {
        let middle = (low + high) / 2;
        if is(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

/// The projected axis of a piece, with inner and outer bounds of its silhouette.
struct Silhouette {
    start: [f64; 2],
    along: [f64; 2],
    length_px: f64,
    /// Distance from the axis beyond which no ray hits.
    outer_px: f64,
    /// A pixel whose centre is nearer to the axis than this, and farther from both ends, is covered.
    inner_px: f64,
    ends_px: f64,
}

impl Silhouette {
    fn new(c_arm: &CArm, piece: &Piece) -> Self {
        let reach = piece.reach();
        let far = piece.start.z.max(piece.end.z) + reach;
        let least_scale = c_arm.focal_px() / (c_arm.sod_mm() + far).max(f64::MIN_POSITIVE);
        let [start, end] = [&piece.start, &piece.end].map(|at| c_arm.pixel_of(at));
        let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
        let length_px = libm::hypot(dx, dy);
        let least = piece.radius.min(piece.radius + piece.slope * (piece.end - piece.start).norm());
        let outer_px = outer_px(c_arm, piece);
        Self {
            start,
            along: [dx / length_px.max(f64::MIN_POSITIVE), dy / length_px.max(f64::MIN_POSITIVE)],
            length_px,
            inner_px: least * least_scale * 0.98 - CORNER_PX,
            ends_px: outer_px + CORNER_PX,
            outer_px,
        }
    }

    /// Calls `visit` for each pixel crossed by the projected axis, from side to side (Amanatides and Woo, A Fast
    /// Voxel Traversal Algorithm, Eurographics 1987).
    fn walk(&self, size_px: [u32; 2], mut visit: impl FnMut(u32)) {
        let [width, height] = size_px.map(i64::from);
        let end = [0, 1].map(|k| self.start[k] + self.along[k] * self.length_px);
        let [mut at, last] = [self.start, end].map(|at| at.map(|x| x.floor() as i64));
        // Fraction of the path to the next side in each direction, and from one to the next.
        let next = |k: usize, at: i64| {
            let run = end[k] - self.start[k];
            let side = if run > 0.0 { at + 1 } else { at };
            if run == 0.0 { f64::INFINITY } else { (side as f64 - self.start[k]) / run }
        };
        let steps = (last[0] - at[0]).unsigned_abs() + (last[1] - at[1]).unsigned_abs();
        // A piece is a few millimetres long: one that covers more pixels passes close to the source.
        for step in 0..=steps.min(size_px.map(u64::from).iter().sum()) {
            if (0..width).contains(&at[0]) && (0..height).contains(&at[1]) {
                visit((at[1] * width + at[0]) as u32);
            }
            if step < steps {
                let k = usize::from(next(1, at[1]) < next(0, at[0]));
                at[k] += if end[k] > self.start[k] { 1 } else { -1 };
            }
        }
    }

    /// Position along the projected axis and distance across it.
    fn place(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = [at[0] - self.start[0], at[1] - self.start[1]];
        [x * self.along[0] + y * self.along[1], (y * self.along[0] - x * self.along[1]).abs()]
    }

    /// Whether a position is farther from the projection than this number of pixels.
    fn is_beyond(&self, at: [f64; 2], more_px: f64) -> bool {
        let [along, across] = self.place(at);
        let beyond = (-along).max(along - self.length_px).max(0.0);
        across * across + beyond * beyond > (self.outer_px + more_px).powi(2)
    }

    /// Whether all or none of a pixel is covered, if its centre decides that.
    fn covers(&self, centre: [f64; 2]) -> Option<bool> {
        if self.is_beyond(centre, CORNER_PX) {
            return Some(false);
        }
        let [along, across] = self.place(centre);
        let between = along > self.ends_px && along < self.length_px - self.ends_px;
        (between && across < self.inner_px).then_some(true)
    }
}
