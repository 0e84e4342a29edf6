//! Lengths inside devices in sub-pixel cells.
//!
//! A wire of 0.014″ is a fraction of a pixel wide: a few rays per pixel alias with it, and it seems broken where they
//! miss it. So the few pixels touched by devices are divided into 8 × 8 cells, and a cell has the *mean* length of
//! its rays: along rows, or along columns where a device runs along the rows, it is integrated over the cell exactly.
//! For a cylinder of radius r at a distance s from its axis, that is
//!
//! ```text
//! ∫ 2 √(r² − s²) ds = s √(r² − s²) + r² asin(s/r)
//! ```
//!
//! For a mitred or tapering piece, the length in the middle of the covered part of the cell is used, scaled by that
//! integral for a cylinder: the sum over a row is its area wherever the wire lies between pixels.

use endowire_core::Vec3;

use super::piece::chord;
use super::raster::span;
use crate::c_arm::CArm;
use crate::device::Piece;
use crate::material::Material;

/// Number of cells across a pixel.
const ACROSS: u32 = 8;
/// Number of cells of a pixel.
pub(crate) const CELLS: usize = (ACROSS * ACROSS) as usize;
/// Ratio of a cell's width to the radius below which the length at its middle is its mean within a thousandth.
const NARROW: f64 = 0.1;
/// Sine of the smallest angle between ray and axis at which a piece is integrated across: end on, its length matters,
/// not its width.
const LEAST_SINE: f64 = 0.3;

/// The cells of the pixels touched by devices, by material.
#[derive(Debug)]
pub(crate) struct DeviceCells {
    /// The view with one pixel per cell.
    view: CArm,
    width: usize,
    /// One plus the position of a pixel's cells; zero without any.
    places: Vec<u32>,
    pixels: Vec<u32>,
    maps: Vec<(Material, Vec<[f32; CELLS]>)>,
}

impl DeviceCells {
    pub(crate) fn new(c_arm: &CArm) -> Self {
        let [width, height] = c_arm.size_px().map(|n| n as usize);
        Self {
            view: c_arm.refined(ACROSS),
            width,
            places: vec![0; width * height],
            pixels: vec![],
            maps: vec![],
        }
    }

    /// Removes all devices.
    pub(crate) fn clear(&mut self) {
        self.pixels.drain(..).for_each(|pixel| self.places[pixel as usize] = 0);
        self.maps.iter_mut().for_each(|map| map.1.clear());
    }

    /// Adds the signed lengths inside pieces of a material, in beam coordinates.
    pub(crate) fn add(&mut self, material: Material, pieces: &[(Piece, f64)]) {
        let of_material = match self.maps.iter().position(|map| map.0 == material) {
            Some(known) => known,
            None => {
                self.maps.push((material, vec![[0.0; CELLS]; self.pixels.len()]));
                self.maps.len() - 1
            }
        };
        let Self { view, width, places, pixels, maps } = self;
        for (piece, sign) in pieces {
            cast(view, piece, |[x, y], length| {
                let across = ACROSS as usize;
                let pixel = y / across * *width + x / across;
                if places[pixel] == 0 {
                    pixels.push(pixel as u32);
                    places[pixel] = pixels.len() as u32;
                    maps.iter_mut().for_each(|map| map.1.push([0.0; CELLS]));
                }
                let cell = y % across * across + x % across;
                maps[of_material].1[places[pixel] as usize - 1][cell] += (sign * length) as f32;
            });
        }
    }

    /// The touched pixels, in the order in which they were touched.
    pub(crate) fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Materials, with lengths by position.
    pub(crate) fn maps(&self) -> &[(Material, Vec<[f32; CELLS]>)] {
        &self.maps
    }

    /// Position of the cells of a pixel, if a device touches it.
    pub(crate) fn place(&self, pixel: usize) -> Option<usize> {
        (self.places[pixel] as usize).checked_sub(1)
    }

    /// Mean length of each pixel in each material.
    pub(crate) fn means(&self) -> Vec<(Material, Vec<f32>)> {
        let mean = |(material, cells): &(Material, Vec<[f32; CELLS]>)| {
            let mut map = vec![0.0; self.places.len()];
            for (pixel, cells) in self.pixels.iter().zip(cells) {
                map[*pixel as usize] = cells.iter().sum::<f32>() / CELLS as f32;
            }
            (*material, map)
        };
        self.maps.iter().filter(|map| !map.1.is_empty()).map(mean).collect()
    }
}

/// The quarter of a pixel that contains a cell, in the order of the 2 × 2 rays.
pub(crate) fn quarter(cell: usize) -> usize {
    let (across, half) = (ACROSS as usize, ACROSS as usize / 2);
    cell / across / half * 2 + cell % across / half
}

/// Calls `visit(cell, length_mm)` for every cell of `view` in which `piece` is visible.
fn cast(view: &CArm, piece: &Piece, mut visit: impl FnMut([usize; 2], f64)) {
    let size = view.size_px();
    let reach = piece.reach();
    let near = view.sod_mm() + piece.start.z.min(piece.end.z) - reach;
    let ends = [&piece.start, &piece.end].map(|at| view.pixel_of(at));
    // A piece that reaches behind the source may be visible anywhere.
    let outer = if near > 0.0 { 1.05 * reach * view.focal_px() / near } else { f64::INFINITY };
    let run = [0, 1].map(|k| (ends[1][k] - ends[0][k]).abs());
    // Lines are rows where the piece is vertical in the image, otherwise columns; cells of a line are counted along
    // `u`.
    let (u, v) = if run[1] >= run[0] { (0, 1) } else { (1, 0) };
    let (low, high) = (ends[0][v].min(ends[1][v]), ends[0][v].max(ends[1][v]));
    let mean_radius = piece.radius + 0.5 * piece.slope * (piece.end - piece.start).norm();
    for line in span(low - outer, high + outer, size[v]) {
        let across = line as f64 + 0.5;
        let part = ((across - ends[0][v]) / (ends[1][v] - ends[0][v])).clamp(0.0, 1.0);
        let middle = if part.is_nan() { ends[0][u] } else { ends[0][u] + part * (ends[1][u] - ends[0][u]) };
        // Lines meet the piece at 45° or more.
        let reach = 1.5 * outer + 1.0;
        let cells = span(middle - reach, middle + reach, size[u]);
        if cells.is_empty() {
            continue;
        }
        let place = |along: f64| if u == 0 { [along, across] } else { [across, along] };
        let first = cells.start as f64;
        let (from, sine) = off_axis(view, piece, place(first));
        let (to, _) = off_axis(view, piece, place(cells.end as f64));
        let step = (to - from) / cells.len() as f64;
        let plain = sine < LEAST_SINE || step.abs() < NARROW * mean_radius;
        for cell in cells {
            let length = if plain {
                length(view, piece, place(cell as f64 + 0.5))
            } else {
                let at = from + (cell as f64 - first) * step;
                mean_length(mean_radius, [at, at + step], |part| {
                    length(view, piece, place(cell as f64 + part))
                })
            };
            if length > 0.0 {
                visit(if u == 0 { [cell, line] } else { [line, cell] }, length);
            }
        }
    }
}

/// Mean length of the rays of a cell between two distances from the axis; `length` gives it at a fraction of the
/// cell's width.
fn mean_length(radius: f64, [from, to]: [f64; 2], length: impl Fn(f64) -> f64) -> f64 {
    let within = [from, to].map(|s| (s / radius).clamp(-1.0, 1.0));
    let covered = (within[1] - within[0]) * radius / (to - from);
    if covered <= 0.0 {
        return 0.0;
    }
    let middle = 0.5 * (within[0] + within[1]);
    let [a, b] = within.map(|s| s * (1.0 - s * s).sqrt() + libm::asin(s));
    let mean = 0.5 * (b - a) / (within[1] - within[0]);
    covered * length((middle * radius - from) / (to - from)) * mean / (1.0 - middle * middle).sqrt()
}

/// Signed distance of a ray from the axis of a piece, and the sine of the angle between them.
fn off_axis(view: &CArm, piece: &Piece, pixel: [f64; 2]) -> (f64, f64) {
    let [sx, sy] = view.slopes(pixel);
    let direction = Vec3::new(sx, sy, 1.0);
    let across = direction.cross(&piece.axis);
    let norm = across.norm();
    let origin = Vec3::new(sx, sy, 0.0) * view.sod_mm();
    ((origin - piece.start).dot(&across) / norm.max(f64::MIN_POSITIVE), norm / direction.norm())
}

/// Length of a ray inside a piece.
fn length(view: &CArm, piece: &Piece, pixel: [f64; 2]) -> f64 {
    let [sx, sy] = view.slopes(pixel);
    let origin = Vec3::new(sx, sy, 0.0) * view.sod_mm();
    chord(piece, &origin, &Vec3::new(sx, sy, 1.0))
}
