//! A computed tomogram as background: reads NIfTI or a series of DICOM slices, computes lengths of tissue and bone.
//!
//! Hounsfield units give attenuation relative to water. Up to [`SOFT_HU`] a voxel counts as soft tissue of lower or
//! higher density, above as a mixture with cortical bone, so that one volume gives lengths in two materials for any
//! spectrum. A ray is marched in steps of half a voxel through the trilinear interpolation of the voxels.

mod dicom;
mod labels;
mod nifti;
mod warp;

use endowire_core::nalgebra::Matrix3;
use endowire_core::vessel::{Displacement, SurfaceMesh};
use endowire_core::{Error, Result, Vec3};
use rayon::prelude::*;

use crate::c_arm::CArm;
use crate::spec::CtSpec;
pub use labels::read_label_map;
use warp::Warp;

/// Plausible sides of a voxel, mm: a mistake of units is often a factor of a thousand, and rays march by half a side.
const VOXEL_MM: std::ops::RangeInclusive<f64> = 1e-3..=1e3;
/// Largest number of voxels: 512 × 512 × 1024, two gigabytes of materials.
const MOST_VOXELS: u64 = 1 << 28;
/// Upper bound of air: no tissue below this.
const AIR_HU: f32 = -950.0;
/// Lower bound of bone.
const SOFT_HU: f32 = 120.0;
/// Solid cortical bone at 60 keV: (0.574/0.206 − 1) · 1000.
const CORTICAL_HU: f32 = 1790.0;
/// Possible values of Hounsfield units: padding may be lower than air, metal may need 16 bits.
const POSSIBLE_HU: std::ops::RangeInclusive<f32> = -32_768.0..=65_535.0;
/// Range of values below which they are those of an image scaled to [0, 1] or [-1, 1].
const SCALED: f32 = 2.0;
/// Step along a ray, as a fraction of the smallest voxel side.
const STEP: f64 = 0.5;

/// Distance between marched rays, along rows and columns: smallest and largest.
const EVERY: [f64; 2] = [2.0, 16.0];

/// Equivalent lengths per length in a voxel: soft tissue, cortical bone.
fn materials(hu: f32) -> [f32; 2] {
    if hu <= AIR_HU {
        return [0.0, 0.0];
    }
    if hu <= SOFT_HU {
        return [1.0 + hu / 1000.0, 0.0];
    }
    let bone = ((hu - SOFT_HU) / (CORTICAL_HU - SOFT_HU)).min(2.0);
    [(1.0 + SOFT_HU / 1000.0) * (1.0 - bone).max(0.0), bone]
}

/// Values of a scanner, with voxel (i, j, k) at `origin_mm` + `axes` · (i, j, k) in the scene's axes; the first index
/// is the fastest.
#[derive(Debug, PartialEq)]
struct Scan {
    size: [usize; 3],
    axes: Matrix3<f64>,
    origin_mm: Vec3,
    hu: Vec<f32>,
}

impl Scan {
    /// Rejects values that cannot be Hounsfield units: air is -1000, fat about -100, water 0 and bone above 300; a
    /// body contains the first two or is surrounded by air.
    fn check_values(&self) -> std::result::Result<(), String> {
        let place =
            |i: usize| [i % self.size[0], i / self.size[0] % self.size[1], i / self.size[0] / self.size[1]];
        if let Some(i) = self.hu.iter().position(|hu| !POSSIBLE_HU.contains(hu)) {
            return Err(format!(
                "voxel {:?} is {}, and Hounsfield units are {} to {}; mend it, or the slope and intercept",
                place(i),
                self.hu[i],
                POSSIBLE_HU.start(),
                POSSIBLE_HU.end()
            ));
        }
        let [least, most] = self.hu.iter().fold([f32::MAX, f32::MIN], |[l, m], hu| [l.min(*hu), m.max(*hu)]);
        let why = match () {
            () if most <= AIR_HU => "all is air",
            () if most - least <= SCALED => "they seem scaled to one",
            () if least >= 0.0 => {
                "none is below 0, where air and fat are: an intercept of -1024 may be missing"
            }
            () => return Ok(()),
        };
        Err(format!("its values, {least} to {most}, are no Hounsfield units of a body: {why}"))
    }
}

/// A volume of materials in the scene's axes.
#[derive(Debug)]
pub(crate) struct Volume {
    size: [usize; 3],
    /// Voxel index = `into` · (point − `origin_mm`).
    into: Matrix3<f64>,
    origin_mm: Vec3,
    step_mm: f64,
    /// Soft tissue and bone of each voxel, the first index fastest.
    voxels: Vec<[f32; 2]>,
    /// Fraction of the vessel's surface inside the volume, 0 to 1.
    vessel_held: f64,
}

impl Volume {
    /// Reads Hounsfield units: a NIfTI file, or a folder of DICOM slices. `wall` must be at least partly inside the
    /// volume.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the key for a missing file, [`Error::Content`] for an unusable volume, and for one
    /// that contains no part of the vessel.
    pub(crate) fn read(spec: &CtSpec, wall: &SurfaceMesh) -> Result<Self> {
        let path = &spec.file;
        let reported = std::fs::metadata(path)
            .map_err(|source| Error::parameter("view.patient.ct.file", path.display(), source.to_string()))?;
        let bad = |reason: String| Error::content(path, reason);
        let scan = if reported.is_dir() { dicom::read(path)? } else { nifti::read(path)? };
        if scan.size.iter().any(|&n| n < 2) {
            let [nx, ny, nz] = scan.size;
            return Err(bad(format!("{nx} × {ny} × {nz} voxels are no volume")));
        }
        scan.check_values().map_err(bad)?;
        let voxels = scan.hu.into_iter().map(materials).collect();
        let volume = Self::new(scan.size, scan.axes, scan.origin_mm + Vec3::from(spec.offset_mm), voxels);
        let mut volume = volume.ok_or_else(|| {
            bad("its axes do not span space, or its voxels are no 0.001 to 1000 mm wide; mend its sform or pixdim, or PixelSpacing and ImagePositionPatient".into())
        })?;
        volume.check_holds(wall).map_err(bad)?;
        volume.vessel_held = volume.part_held(wall);
        Ok(volume)
    }

    /// Fraction of the vessel's surface inside the volume, 0 to 1.
    pub(crate) fn vessel_held(&self) -> f64 {
        self.vessel_held
    }

    /// Whether a point is in one of its voxels.
    fn holds(&self, point: &Vec3) -> bool {
        let at = self.into * (point - self.origin_mm);
        (0..3).all(|k| (-0.5..=self.size[k] as f64 - 0.5).contains(&at[k]))
    }

    /// Fraction of the area of a surface with its centroids in the volume, 0 to 1.
    fn part_held(&self, wall: &SurfaceMesh) -> f64 {
        let (mut held, mut all) = (0.0, 0.0);
        for index in 0..wall.triangles.len() {
            let [a, b, c] = wall.corners(index);
            let area = (b - a).cross(&(c - a)).norm();
            all += area;
            if self.holds(&((a + b + c) / 3.0)) {
                held += area;
            }
        }
        if all > 0.0 { held / all } else { 1.0 }
    }

    /// Rejects a vessel without a vertex in the volume.
    fn check_holds(&self, wall: &SurfaceMesh) -> std::result::Result<(), String> {
        if wall.vertices_mm.is_empty() || wall.vertices_mm.iter().any(|v| self.holds(v)) {
            return Ok(());
        }
        let axes = self.into.try_inverse().unwrap_or_default();
        let corners = (0..8).map(|k| {
            let at = |axis: usize| if k >> axis & 1 == 1 { self.size[axis] as f64 - 0.5 } else { -0.5 };
            self.origin_mm + axes * Vec3::from_fn(|axis, _| at(axis))
        });
        let spans = |points: &mut dyn Iterator<Item = Vec3>| {
            let [least, most] = points
                .fold([Vec3::repeat(f64::MAX), Vec3::repeat(f64::MIN)], |[l, m], p| [l.inf(&p), m.sup(&p)]);
            let reported = |v: Vec3| format!("[{:.0}, {:.0}, {:.0}]", v.x, v.y, v.z);
            format!("{} to {}", reported(least), reported(most))
        };
        Err(format!(
            "holds nothing of the vessel: in the scene's axes (left, posterior, superior, mm) it is from {}, the vessel from {}; move it with view.patient.ct.offset_mm",
            spans(&mut corners.into_iter()),
            spans(&mut wall.vertices_mm.iter().copied())
        ))
    }

    /// A volume with voxel (i, j, k) at `origin_mm` + `axes` · (i, j, k).
    fn new(size: [usize; 3], axes: Matrix3<f64>, origin_mm: Vec3, voxels: Vec<[f32; 2]>) -> Option<Self> {
        let smallest = axes.column_iter().map(|c| c.norm()).fold(f64::MAX, f64::min);
        let sides = axes.column_iter().map(|c| c.norm());
        if !sides.clone().all(|side| VOXEL_MM.contains(&side)) {
            return None;
        }
        let into = axes.try_inverse().filter(|m| m.iter().all(|x| x.is_finite()))?;
        Some(Self { size, into, origin_mm, step_mm: STEP * smallest, voxels, vessel_held: 1.0 })
    }

    /// Lengths of the central ray of each pixel in the whole body and in its bone.
    pub(crate) fn project(&self, view: &CArm) -> [Vec<f32>; 2] {
        let marched = self.rays(view, |pixel| {
            let [tissue, bone] = self.march(view, pixel, None);
            [tissue + bone, bone]
        });
        [0, 1].map(|k| marched.iter().map(|lengths| lengths[k]).collect())
    }

    /// Lengths in the whole displaced body.
    pub(crate) fn project_moved(&self, view: &CArm, displacement: &Displacement) -> Vec<f32> {
        let warp = Warp::new(self, displacement);
        self.rays(view, |pixel| {
            let [tissue, bone] = self.march(view, pixel, Some(&warp));
            [tissue + bone]
        })
        .into_iter()
        .map(|[body]| body)
        .collect()
    }

    /// The values of `of` for each pixel. Rays evaluated are half a voxel apart at the isocentre, and at most every
    /// fourth; those between are interpolated.
    fn rays<const K: usize>(&self, view: &CArm, of: impl Fn([f64; 2]) -> [f32; K] + Sync) -> Vec<[f32; K]> {
        let ray_mm = view.pixel_mm() * view.sod_mm() / view.sid_mm();
        let every = (self.step_mm / ray_mm).clamp(EVERY[0], EVERY[1]) as usize;
        let [width, height] = view.size_px().map(|n| n as usize);
        let [columns, rows] = [width, height].map(|n| n.div_ceil(every) + 1);
        let node = |n: usize| of([(n % columns * every) as f64, (n / columns * every) as f64]);
        let coarse: Vec<[f32; K]> = (0..columns * rows).into_par_iter().map(node).collect();
        let at = |pixel: usize| {
            let place = |n: usize| ((n as f32 + 0.5) / every as f32, n / every);
            let ((x, i), (y, j)) = (place(pixel % width), place(pixel / width));
            let (u, v) = (x - i as f32, y - j as f32);
            std::array::from_fn(|k| {
                let row =
                    |j: usize| coarse[j * columns + i][k] * (1.0 - u) + coarse[j * columns + i + 1][k] * u;
                row(j) * (1.0 - v) + row(j + 1) * v
            })
        };
        (0..width * height).map(at).collect()
    }

    /// Lengths in soft tissue and bone along one ray, through the volume at rest or displaced.
    fn march(&self, view: &CArm, pixel: [f64; 2], moved: Option<&Warp>) -> [f32; 2] {
        let (source, direction) = view.ray(pixel);
        let (start, slope) = (self.into * (source - self.origin_mm), self.into * direction);
        // The stretch of the ray between the centres of the outermost voxels, in millimetres.
        let (mut near, mut far) = (0.0_f64, f64::MAX);
        for k in 0..3 {
            let last = (self.size[k] - 1) as f64;
            if slope[k] == 0.0 {
                if !(0.0..=last).contains(&start[k]) {
                    return [0.0; 2];
                }
                continue;
            }
            let [a, b] = [-start[k] / slope[k], (last - start[k]) / slope[k]];
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
        if far <= near {
            return [0.0; 2];
        }
        let steps = ((far - near) / self.step_mm).ceil();
        let step = (far - near) / steps;
        let mut sum = [0.0; 2];
        let mut add = |at: [f32; 3]| {
            let value = self.value(at);
            sum = [sum[0] + value[0], sum[1] + value[1]];
        };
        let place = |along: f64| {
            let at = start + slope * (near + along * step);
            [at.x as f32, at.y as f32, at.z as f32]
        };
        let Some(warp) = moved else {
            (0..steps as usize).for_each(|n| add(place(n as f64 + 0.5)));
            return sum.map(|s| s * step as f32);
        };
        // Inverse displacements are evaluated at intervals, and linear in between.
        let stretch = (warp::ASKED_MM / step).ceil() as usize;
        let (mut begin, mut from) = (0, warp.material(place(0.0)));
        while begin < steps as usize {
            let end = (begin + stretch).min(steps as usize);
            let to = warp.material(place(end as f64));
            for n in begin..end {
                let part = (n as f32 + 0.5 - begin as f32) / (end - begin) as f32;
                add(std::array::from_fn(|k| from[k] + (to[k] - from[k]) * part));
            }
            (begin, from) = (end, to);
        }
        sum.map(|s| s * step as f32)
    }

    /// Trilinear interpolation at voxel coordinates.
    fn value(&self, at: [f32; 3]) -> [f32; 2] {
        trilinear(self.size, &self.voxels, at)
    }
}

/// Interpolation of values on a lattice, the first index fastest; constant beyond its outermost ones.
#[inline]
fn trilinear<const K: usize>(size: [usize; 3], values: &[[f32; K]], at: [f32; 3]) -> [f32; K] {
    let place = |k: usize| {
        let x = at[k].clamp(0.0, (size[k] - 1) as f32);
        let i = (x as usize).min(size[k] - 2);
        (i, x - i as f32)
    };
    let [(i, u), (j, v), (k, w)] = [place(0), place(1), place(2)];
    let row = size[0];
    let slice = row * size[1];
    let first = k * slice + j * row + i;
    let mix = |mut a: [f32; K], b: [f32; K], t: f32| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += (b - *a) * t);
        a
    };
    let along = |at: usize| mix(values[at], values[at + 1], u);
    mix(mix(along(first), along(first + row), v), mix(along(first + slice), along(first + slice + row), v), w)
}

#[cfg(test)]
mod format_tests;
#[cfg(test)]
mod label_tests;
#[cfg(test)]
mod tests;
