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
//!
//! Seen end on, a piece is a spot that may be smaller than a cell. Rays a quarter of its radius apart tell how it is
//! distributed over cells, and its volume V what the sum over all cells is: a ray is o = √(1 + x² + y²) times as long as it is
//! deep, and a square millimetre at the depth z has (f/z)² cells, with f from source to detector in cells, so
//!
//! ```text
//! Σ lengths = ∫ o (f/z)² dV ≈ o f² V/(z₀ z₁)
//! ```
//!
//! with the depths z₀ and z₁ of its ends.

use endowire_core::Vec3;
use rustc_hash::FxHashMap;

use super::band::Band;
use super::piece::{Row, chord};
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
/// Spacing of rays through a piece seen end on, in radii, and number of lines of them along it that are enough.
const RAYS_END_ON: (f64, f64) = (0.25, 16.0);
/// Ratio of the radius of a piece seen end on to a cell's width above which the lengths at the middles of cells sum up to its
/// volume within a hundredth.
const FINE: f64 = 16.0;

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

    /// Adds the signed lengths inside the pieces of each material, in beam coordinates.
    pub(crate) fn add(&mut self, layers: &[(Material, Vec<(Piece, f64)>)]) {
        let mut lengths = vec![];
        for Shared { piece, parts } in self.shared(layers) {
            let Self { view, width, places, pixels, maps } = self;
            // Not a variable, by which a closure would divide.
            const ACROSS_PX: usize = ACROSS as usize;
            cast(view, &piece, &mut lengths, |first, along, lengths| {
                // Pixel by pixel of the line.
                let (mut done, mut of_run) = (0, [0.0; ACROSS_PX]);
                while done < lengths.len() {
                    let mut at = first;
                    at[along] += done;
                    let of_pixel = ACROSS_PX - at[along] % ACROSS_PX;
                    let lengths = &lengths[done..lengths.len().min(done + of_pixel)];
                    done += lengths.len();
                    if lengths.iter().all(|length| *length <= 0.0) {
                        continue;
                    }
                    let [x, y] = at;
                    let pixel = y / ACROSS_PX * *width + x / ACROSS_PX;
                    if places[pixel] == 0 {
                        pixels.push(pixel as u32);
                        places[pixel] = pixels.len() as u32;
                        maps.iter_mut().for_each(|map| map.1.push([0.0; CELLS]));
                    }
                    let cell = y % ACROSS_PX * ACROSS_PX + x % ACROSS_PX;
                    of_run.iter_mut().zip(lengths).for_each(|(of, length)| *of = *length as f32);
                    for (of_material, sign) in &parts {
                        let cells = &mut maps[*of_material].1[places[pixel] as usize - 1][cell..];
                        let more = of_run[..lengths.len()].iter().map(|length| *sign as f32 * length);
                        match along {
                            0 => cells.iter_mut().zip(more).for_each(|(cell, more)| *cell += more),
                            _ => cells
                                .iter_mut()
                                .step_by(ACROSS_PX)
                                .zip(more)
                                .for_each(|(cell, more)| *cell += more),
                        }
                    }
                }
            });
        }
    }

    /// The pieces of all layers, each once: a core and the tube around it have the boundary between them in common.
    fn shared(&mut self, layers: &[(Material, Vec<(Piece, f64)>)]) -> Vec<Shared> {
        let mut all: Vec<Shared> = vec![];
        let mut known: FxHashMap<[u64; 8], usize> = FxHashMap::default();
        for (material, pieces) in layers {
            let of_material = match self.maps.iter().position(|map| map.0 == *material) {
                Some(known) => known,
                None => {
                    self.maps.push((*material, vec![[0.0; CELLS]; self.pixels.len()]));
                    self.maps.len() - 1
                }
            };
            for (piece, sign) in pieces {
                let index = *known.entry(piece.key()).or_insert(all.len());
                if index == all.len() {
                    all.push(Shared { piece: *piece, parts: vec![] });
                }
                all[index].parts.push((of_material, *sign));
            }
        }
        all
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

/// A piece, and the materials whose lengths it is a part of, with its signs.
struct Shared {
    piece: Piece,
    parts: Vec<(usize, f64)>,
}

/// The quarter of a pixel that contains a cell, in the order of the 2 × 2 rays.
pub(crate) fn quarter(cell: usize) -> usize {
    let (across, half) = (ACROSS as usize, ACROSS as usize / 2);
    cell / across / half * 2 + cell % across / half
}

/// Calls `visit(cell, along, lengths_mm)` for every run of cells of `view` in which `piece` is visible, possibly with
/// several parts of their lengths: from a cell on along rows (0) or columns (1). `lengths` is room for those of a line.
fn cast(
    view: &CArm,
    piece: &Piece,
    lengths: &mut Vec<f64>,
    mut visit: impl FnMut([usize; 2], usize, &[f64]),
) {
    let size = view.size_px();
    let band = Band::new(view, piece);
    if let Some(end_on) = EndOn::new(view, piece, &band) {
        return end_on.cast(view, piece, &band, visit);
    }
    let [low, high] = band.lines();
    let mean_radius = mean_radius(piece);
    let arch = pulp::Arch::new();
    for line in span(low, high, size[band.v]) {
        let across = line as f64 + 0.5;
        let [first, last] = band.along(across);
        let cells = span(first, last, size[band.u]);
        if cells.is_empty() {
            continue;
        }
        let place = |along: f64| band.place(along, across);
        let first = cells.start as f64;
        let (from, sine) = off_axis(view, piece, place(first));
        let (to, sine_to) = off_axis(view, piece, place(cells.end as f64));
        let step = (to - from) / cells.len() as f64;
        let is_oblique = sine >= LEAST_SINE;
        lengths.clear();
        if is_oblique && step.abs() >= NARROW * mean_radius {
            lengths.extend((0..cells.len()).map(|k| {
                let at = from + k as f64 * step;
                mean_length(mean_radius, [at, at + step], |part| {
                    length(view, piece, place(first + k as f64 + part))
                })
            }));
        } else if is_oblique && sine_to >= LEAST_SINE && piece.slope == 0.0 {
            lengths.resize(cells.len(), 0.0);
            let row = Row { view, piece, along: band.u, first: place(first + 0.5) };
            arch.dispatch(row.into(lengths));
        } else {
            lengths.extend(cells.clone().map(|cell| length(view, piece, place(cell as f64 + 0.5))));
        }
        visit(if band.u == 0 { [cells.start, line] } else { [line, cells.start] }, band.u, lengths);
    }
}

fn mean_radius(piece: &Piece) -> f64 {
    piece.radius + 0.5 * piece.slope * (piece.end - piece.start).norm()
}

/// A piece seen end on, in cells not much narrower than it is: rays through their middles would miss it or meet it too often.
struct EndOn {
    /// Its radius in cells.
    radius: f64,
    /// Sum of the mean lengths of all cells, also of those beyond the border, mm: its volume, projected.
    sum_mm: f64,
}

impl EndOn {
    /// `None` for a piece that is not.
    fn new(view: &CArm, piece: &Piece, band: &Band) -> Option<Self> {
        let middle = [0, 1].map(|k| 0.5 * (band.ends[0][k] + band.ends[1][k]));
        let depths = [&piece.start, &piece.end].map(|end| view.sod_mm() + end.z);
        // Square of the number of cells per mm; along the axis this product is its mean.
        let scale = view.focal_px().powi(2) / (depths[0] * depths[1]);
        let radius = mean_radius(piece) * scale.sqrt();
        let coarse = radius > 0.0 && radius < FINE && band.outer.is_finite();
        if !coarse || off_axis(view, piece, middle).1 >= LEAST_SINE {
            return None;
        }
        let length_mm = (piece.end - piece.start).norm();
        let [first, last] = [piece.radius, piece.radius + piece.slope * length_mm];
        let volume_mm3 =
            std::f64::consts::PI / 3.0 * length_mm * (first * first + first * last + last * last);
        let [x, y] = view.slopes(middle);
        Some(Self { radius, sum_mm: volume_mm3 * scale * (1.0 + x * x + y * y).sqrt() })
    }

    /// As [`cast`], with the lengths of rays that are denser than the cells, scaled to the right sum.
    fn cast(
        &self,
        view: &CArm,
        piece: &Piece,
        band: &Band,
        mut visit: impl FnMut([usize; 2], usize, &[f64]),
    ) {
        let size = view.size_px().map(f64::from);
        let [low, high] = band.lines();
        let (share, fewest) = RAYS_END_ON;
        let spacing = share * self.radius;
        let length = (band.ends[1][band.v] - band.ends[0][band.v]).abs() + 2.0 * self.radius;
        // Numbers of rays across a cell.
        let rays = (1.0 / spacing).ceil();
        let lines = (1.0 / spacing.max(length / fewest)).ceil();
        let numbers =
            |[from, to]: [f64; 2], each: f64| (from * each).floor() as i64..(to * each).ceil() as i64;
        let mut met: Vec<([f64; 2], f64)> = Vec::new();
        for line in numbers([low, high], lines) {
            let across = (line as f64 + 0.5) / lines;
            for ray in numbers(band.along(across), rays) {
                let at = band.place((ray as f64 + 0.5) / rays, across);
                let length = self::length(view, piece, at);
                if length > 0.0 {
                    met.push((at, length));
                }
            }
        }
        let each = self.sum_mm / met.iter().map(|ray| ray.1).sum::<f64>();
        let seen = |at: &[f64; 2]| (0..2).all(|k| (0.0..size[k]).contains(&at[k]));
        for (at, length) in met.into_iter().filter(|(at, _)| seen(at)) {
            visit(at.map(|x| x as usize), 0, &[each * length]);
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
