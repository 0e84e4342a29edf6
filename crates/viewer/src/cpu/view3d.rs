//! The 3D view in plain Rust: a supersampled rasteriser.
//!
//! The wall's fragments are computed once and stored per sample. A frame draws the devices with a depth buffer and
//! recomposes only the pixels they touch.

use std::ops::Range;

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;
use glam::{Vec3, Vec4};

use crate::cpu::raster::ScreenTriangle;
use crate::engine::ThreeDEngine;
use crate::output::{Image, PixelFormat};
use crate::three_d::{Camera, Solids, Style, Vertex, solid_triangles, wall_triangles};

/// Number of samples across a pixel: nine levels of edge smoothing.
const SAMPLES: u32 = 3;
/// Largest total number of samples. They take about 25 bytes each; a larger frame, in which steps are less visible,
/// gets fewer per pixel.
const MOST_SAMPLES: u64 = 40_000_000;

/// A piece of wall at a sample.
#[derive(Debug, Clone, Copy, Default)]
struct Fragment {
    distance: f32,
    rgba: [u8; 4],
}

#[derive(Debug)]
pub(crate) struct CpuView3d {
    camera: Camera,
    style: Style,
    /// Number of samples across a pixel.
    sub: u32,
    /// Fragments of all samples, and the ends of those of each sample.
    fragments: Vec<Fragment>,
    ends: Vec<u32>,
    /// The image without devices.
    still: Vec<u8>,
    /// Distance and colour of the nearest device; infinite between frames.
    distance: Vec<f32>,
    colour: Vec<[u8; 3]>,
}

impl CpuView3d {
    pub(crate) fn new(camera: &Camera, wall: &SurfaceMesh) -> Self {
        let style = Style::new(camera);
        let pixels: u64 = camera.size_px.map(u64::from).iter().product();
        let sub = (1..=SAMPLES).rev().find(|&n| pixels * u64::from(n * n) <= MOST_SAMPLES).unwrap_or(1);
        let samples = pixels as usize * (sub * sub) as usize;
        let triangles = wall_triangles(camera, wall);
        let mut found: Vec<(u32, Fragment)> = Vec::new();
        for corners in triangles.chunks_exact(3) {
            draw(camera, sub, corners, Faces::Both, |sample, position, normal| {
                let rgba = style.shade_wall(position, normal).to_array().map(to_byte);
                found.push((sample as u32, Fragment { distance: -position.z, rgba }));
            });
        }
        // Counting sort by sample, which keeps the order of the mesh within a sample.
        let mut ends = vec![0_u32; samples + 1];
        found.iter().for_each(|(sample, _)| ends[*sample as usize + 1] += 1);
        for i in 0..samples {
            ends[i + 1] += ends[i];
        }
        let mut fragments = vec![Fragment::default(); found.len()];
        for (sample, fragment) in found {
            let place = &mut ends[sample as usize];
            fragments[*place as usize] = fragment;
            *place += 1;
        }
        // Each start has moved to the end of its sample.
        ends.pop();
        let mut view = Self {
            camera: camera.clone(),
            style,
            sub,
            fragments,
            ends,
            still: Vec::new(),
            distance: vec![f32::INFINITY; samples],
            colour: vec![[0; 3]; samples],
        };
        view.still = view.still();
        view
    }

    /// The image without devices. Without a wall all pixels are equal.
    fn still(&self) -> Vec<u8> {
        let [width, height] = self.camera.size_px.map(|n| n as usize);
        let mut clear = None;
        let mut still = Vec::with_capacity(4 * width * height);
        for pixel in 0..width * height {
            let mut rows = rows_of(pixel, width, self.sub as usize);
            let rgba = match rows.all(|row| self.start(row.start) == self.start(row.end)) {
                true => *clear.get_or_insert_with(|| self.pixel(pixel)),
                false => self.pixel(pixel),
            };
            still.extend(rgba);
        }
        still
    }

    /// The final pixel: the mean of its samples.
    fn pixel(&self, pixel: usize) -> [u8; 4] {
        let mut sum = Vec3::ZERO;
        for sample in samples_of(pixel, self.camera.size_px[0] as usize, self.sub as usize) {
            sum += self.sample(sample);
        }
        let [r, g, b] = (sum / (self.sub * self.sub) as f32).to_array().map(to_byte);
        [r, g, b, 255]
    }

    /// Start of the fragments of a sample, the end of those before.
    fn start(&self, sample: usize) -> usize {
        if sample == 0 { 0 } else { self.ends[sample - 1] as usize }
    }

    fn sample(&self, sample: usize) -> Vec3 {
        let nearest = self.distance[sample];
        let opaque = if nearest.is_finite() {
            Vec3::from_array(self.colour[sample].map(from_byte))
        } else {
            self.style.background()
        };
        let (mut sum, mut through) = (Vec4::ZERO, 1.0);
        for fragment in &self.fragments[self.start(sample)..self.ends[sample] as usize] {
            if fragment.distance < nearest {
                let [r, g, b, a] = fragment.rgba.map(from_byte);
                sum += Vec4::new(r, g, b, 1.0) * (a * self.style.weight(fragment.distance));
                through *= 1.0 - a;
            }
        }
        if sum.w > 0.0 { (sum.truncate() / sum.w).lerp(opaque, through) } else { opaque }
    }
}

impl ThreeDEngine for CpuView3d {
    fn frame(&mut self, solids: &Solids) -> Result<Image> {
        let [width, height] = self.camera.size_px;
        let (row, sub) = ((width * self.sub) as usize, self.sub as usize);
        let mut touched = Vec::new();
        for corners in solid_triangles(&self.camera, solids).chunks_exact(3) {
            let [r, g, b, _] = corners[0].colour;
            let colour = Vec3::from_array([r, g, b].map(from_byte));
            draw(&self.camera, self.sub, corners, Faces::Front, |sample, position, normal| {
                if -position.z < self.distance[sample] {
                    self.distance[sample] = -position.z;
                    self.colour[sample] =
                        self.style.shade_solid(position, normal, colour).to_array().map(to_byte);
                    touched.push(sample / row / sub * width as usize + sample % row / sub);
                }
            });
        }
        touched.sort_unstable();
        touched.dedup();
        let mut data = self.still.clone();
        for &pixel in &touched {
            data[4 * pixel..][..4].copy_from_slice(&self.pixel(pixel));
        }
        for &pixel in &touched {
            for sample in samples_of(pixel, width as usize, sub) {
                self.distance[sample] = f32::INFINITY;
            }
        }
        Ok(Image::new(width, height, PixelFormat::Rgba8, data))
    }
}

/// The samples of a pixel, row by row.
fn rows_of(pixel: usize, width: usize, sub: usize) -> impl Iterator<Item = Range<usize>> {
    let first = pixel / width * sub * width * sub + pixel % width * sub;
    (0..sub).map(move |row| first + row * width * sub).map(move |first| first..first + sub)
}

/// The samples of a pixel.
fn samples_of(pixel: usize, width: usize, sub: usize) -> impl Iterator<Item = usize> {
    rows_of(pixel, width, sub).flatten()
}

/// The triangles to draw.
#[derive(Clone, Copy, PartialEq)]
enum Faces {
    Both,
    /// Those with a visible outside; for an opaque closed surface these are all that can be visible.
    Front,
}

/// Calls `visit(sample, position, normal)` for each sample covered by a triangle; triangles that reach behind the
/// near plane are skipped.
fn draw(
    camera: &Camera,
    sub: u32,
    corners: &[Vertex],
    faces: Faces,
    mut visit: impl FnMut(usize, Vec3, Vec3),
) {
    let size = camera.size_px.map(|n| n * sub);
    let positions = [0, 1, 2].map(|i| Vec3::from_array(corners[i].position));
    let normals = [0, 1, 2].map(|i| Vec3::from_array(corners[i].normal));
    if positions.iter().any(|p| f64::from(-p.z) < camera.near) {
        return;
    }
    let on_screen = positions.map(|p| camera.pixel_of(p.to_array().map(f64::from), sub));
    let Some(triangle) = ScreenTriangle::new(on_screen) else { return };
    if faces == Faces::Front && triangle.area2() > 0.0 {
        return;
    }
    triangle.scan(size, |x, y, weights| {
        // Perspective: weights divided by distance are linear on the screen.
        let w: [f32; 3] = std::array::from_fn(|i| weights[i] as f32 / positions[i].z);
        let scale = 1.0 / (w[0] + w[1] + w[2]);
        let mix = |v: [Vec3; 3]| (v[0] * w[0] + v[1] * w[1] + v[2] * w[2]) * scale;
        visit(y * size[0] as usize + x, mix(positions), mix(normals));
    });
}

fn to_byte(value: f32) -> u8 {
    let level = value.clamp(0.0, 1.0) * 255.0;
    // Rounded half up without the function call of `round` on old processors; the remainder is exact.
    let below = level as u8;
    below + u8::from(level - f32::from(below) >= 0.5)
}

fn from_byte(value: u8) -> f32 {
    f32::from(value) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_rounded_to_the_nearest() {
        let edges = (0..255).map(|k| (k as f32 + 0.5) / 255.0);
        let around = edges.flat_map(|v| [v.next_down(), v, v.next_up()]);
        for value in around.chain([-1.0, 0.0, 1.0, 2.0, 0.499_999_97 / 255.0]) {
            assert_eq!(to_byte(value), (value.clamp(0.0, 1.0) * 255.0).round() as u8, "{value}");
        }
        assert_eq!(to_byte(f32::NAN), 0);
    }
}
