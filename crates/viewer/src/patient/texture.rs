//! The texture of a generated body: lengths of rays in tissue, bone and lung vary as those in a real one do.
//!
//! Fat between muscles, bowel, and small vessels give the background of an X-ray picture a spectrum that falls as
//! 1/f³ (Burgess, Statistically defined backgrounds, 1999). Sheets of noise lie in the body, across front and back
//! and across left and right, so that the texture turns with the C-arm as a body does. A ray takes the noise where
//! it meets them, more of those that it meets squarely.

use endowire_core::Vec3;
use rayon::prelude::*;

use crate::c_arm::CArm;

/// Standard deviation of tissue behind 200 mm of it, mm: a per cent and a half.
const TISSUE_MM: f64 = 3.0;
const TISSUE_OF_MM: f64 = 200.0;
/// Relative standard deviations of lengths in spongy bone and in lung.
const BONE: f64 = 0.1;
const LUNG: f64 = 0.045;
/// Spacings of the noise of each, mm, the coarsest first, halved from one to the next.
const TISSUE_OCTAVES_MM: [f64; 2] = [56.0, 1.2];
const BONE_OCTAVES_MM: [f64; 2] = [3.2, 1.0];
const LUNG_OCTAVES_MM: [f64; 2] = [12.0, 1.4];
/// Plates of spongy bone stand upright: they are this much longer than wide.
const UPRIGHT: f64 = 1.7;
/// Variance of noise between lattice points, of those at the points.
const BETWEEN: f64 = 0.49;
/// Least rows per thread.
const FEWEST_ROWS: usize = 8;

/// Which lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Of {
    Tissue,
    Bone,
    Lung,
}

/// Where the sheets of noise of a body are.
#[derive(Debug, Clone, Default)]
pub(crate) struct Texture {
    /// Middle of the spine, and of the trunk: left, posterior.
    pub(super) spine_mm: [f64; 2],
    pub(super) middle_mm: [f64; 2],
}

impl Texture {
    /// Changes the lengths of the central rays of all pixels.
    pub(crate) fn apply(&self, of: Of, lengths: &mut [f32], c_arm: &CArm) {
        self.apply_again(of, lengths, c_arm, &mut vec![]);
    }

    /// The same with the noise that other lengths on these rays have met, not a number where there is none yet.
    pub(crate) fn apply_again(&self, of: Of, lengths: &mut [f32], c_arm: &CArm, met: &mut Vec<f64>) {
        let width = c_arm.size_px()[0] as usize;
        let sheets = self.sheets(of);
        met.resize(lengths.len(), f64::NAN);
        let rows = lengths.par_chunks_mut(width).zip(met.par_chunks_mut(width)).with_min_len(FEWEST_ROWS);
        rows.enumerate().for_each(|(y, (row, met))| {
            let all = row.iter_mut().zip(met).enumerate();
            for (x, (length, noise)) in all.filter(|(_, (length, _))| **length > 0.0) {
                if noise.is_nan() {
                    let (source, direction) = c_arm.ray([x as f64 + 0.5, y as f64 + 0.5]);
                    *noise = sheets.along(&source, &direction);
                }
                let noise = *noise;
                let mm = f64::from(*length);
                let share = match of {
                    Of::Tissue => TISSUE_MM / libm::sqrt(mm * TISSUE_OF_MM),
                    Of::Bone => BONE,
                    Of::Lung => LUNG,
                };
                // At the skin's edge there is little that could vary.
                let edge = if of == Of::Tissue { (mm / 60.0).min(1.0) } else { 1.0 };
                *length = (mm * (1.0 + share * edge * noise).max(0.0)) as f32;
            }
        });
    }

    fn sheets(&self, of: Of) -> Sheets {
        let [x, y] = self.middle_mm;
        let (x, y, [coarse, fine], upright) = match of {
            Of::Tissue => (vec![x - 70.0, x + 70.0], vec![y - 50.0, y + 50.0], TISSUE_OCTAVES_MM, 1.0),
            Of::Bone => (vec![self.spine_mm[0]], vec![self.spine_mm[1]], BONE_OCTAVES_MM, UPRIGHT),
            Of::Lung => (vec![x - 80.0, x + 80.0], vec![y - 40.0, y + 40.0], LUNG_OCTAVES_MM, 1.0),
        };
        let octaves = std::iter::successors(Some(coarse), |mm| Some(mm / 2.0)).take_while(|mm| *mm > fine);
        // In two dimensions a spectrum of 1/f³ has a variance of 1/f in each octave.
        let mut octaves: Vec<[f64; 2]> = octaves.map(|mm| [mm, libm::sqrt(mm)]).collect();
        let all: f64 = octaves.iter().map(|octave| octave[1] * octave[1]).sum();
        let sheets = x.len().max(y.len()) as f64;
        octaves.iter_mut().for_each(|octave| octave[1] /= libm::sqrt(all * sheets * BETWEEN / 3.0));
        Sheets { places: [x, y], octaves, upright, seed: of as u32 }
    }
}

/// Parallel sheets across the two horizontal axes of a patient.
struct Sheets {
    places: [Vec<f64>; 2],
    /// Spacing and weight of each.
    octaves: Vec<[f64; 2]>,
    upright: f64,
    seed: u32,
}

impl Sheets {
    /// The noise that a ray meets, of variance one.
    fn along(&self, source: &Vec3, direction: &Vec3) -> f64 {
        let level = direction.x * direction.x + direction.y * direction.y;
        let mut sum = 0.0;
        for (axis, places) in self.places.iter().enumerate() {
            let square = direction[axis] * direction[axis] / level.max(f64::MIN_POSITIVE);
            // Sheets that are met edge-on would be stretched into lines.
            let weight = square - 0.03;
            if weight <= 0.0 {
                continue;
            }
            let weight = libm::sqrt(weight / 0.94);
            for (number, place) in (0_u32..).zip(places) {
                let at = source + direction * ((place - source[axis]) / direction[axis]);
                let seed = self.seed * 64 + axis as u32 * 16 + number;
                sum += weight * self.sheet([at[1 - axis], at.z / self.upright], seed);
            }
        }
        sum
    }

    fn sheet(&self, at: [f64; 2], seed: u32) -> f64 {
        let octave = |(number, [mm, weight]): (u32, &[f64; 2])| {
            weight * between(at.map(|x| x / mm), seed.wrapping_mul(31).wrapping_add(number))
        };
        (0..).zip(&self.octaves).map(octave).sum()
    }
}

/// Noise between the points of a lattice, by smooth steps.
fn between(at: [f64; 2], seed: u32) -> f64 {
    // Rounded down, without a call.
    let [x, y] = at.map(|x| x as i32 - i32::from(f64::from(x as i32) > x));
    let [u, v] = [at[0] - f64::from(x), at[1] - f64::from(y)].map(|t| t * t * (3.0 - 2.0 * t));
    let value = |x: i32, y: i32| lattice(x, y, seed);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (x1, y1) = (x.wrapping_add(1), y.wrapping_add(1));
    mix(mix(value(x, y), value(x1, y), u), mix(value(x, y1), value(x1, y1), u), v)
}

/// A number from −1 to 1 of a lattice point: its coordinates and the seed, mixed as in MurmurHash3.
fn lattice(x: i32, y: i32, seed: u32) -> f64 {
    let mut word = (x as u32).wrapping_mul(0x85eb_ca6b) ^ (y as u32).wrapping_mul(0xc2b2_ae35);
    word ^= seed.wrapping_mul(0x9e37_79b9);
    word = (word ^ (word >> 16)).wrapping_mul(0x85eb_ca6b);
    word = (word ^ (word >> 13)).wrapping_mul(0xc2b2_ae35);
    word ^= word >> 16;
    f64::from(word) / f64::from(u32::MAX) * 2.0 - 1.0
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::CArmSpec;

    fn arm(pose: &str) -> CArm {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(40.0)], triangles: vec![] };
        let spec =
            CArmSpec { pose: Some(pose.parse().unwrap()), field_mm: Some(200.0), ..CArmSpec::default() };
        CArm::new(&spec, [128, 128], &wall).unwrap()
    }

    /// Lengths of 200 mm with their texture.
    fn lengths(of: Of, pose: &str) -> Vec<f32> {
        let mut lengths = vec![200.0; 128 * 128];
        Texture::default().apply(of, &mut lengths, &arm(pose));
        lengths
    }

    /// Mean, and standard deviation.
    fn spread(values: &[f32]) -> [f64; 2] {
        let n = values.len() as f64;
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
        let square = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n;
        [mean, square.sqrt()]
    }

    #[test]
    fn lengths_vary_by_as_much_from_all_sides() {
        for pose in ["AP", "LAO 45", "LAO 90", "RAO 30 CAU 25"] {
            for (of, share) in [(Of::Tissue, TISSUE_MM / TISSUE_OF_MM), (Of::Bone, BONE), (Of::Lung, LUNG)] {
                let [mean, off] = spread(&lengths(of, pose));
                // Few of the coarsest waves are in a picture.
                let [low, high] = if of == Of::Tissue { [0.5, 1.5] } else { [0.8, 1.2] };
                assert!((mean / 200.0 - 1.0).abs() < 1.5 * share, "{pose} {of:?} {mean}");
                assert!((low..high).contains(&(off / 200.0 / share)), "{pose} {of:?} {off}");
            }
        }
        assert_ne!(lengths(Of::Tissue, "AP"), lengths(Of::Tissue, "LAO 10"));
    }

    #[test]
    fn tissue_has_the_spectrum_of_patients_and_bone_a_finer_one() {
        // The mean square difference between pixels that are a distance apart grows with it where the spectrum falls
        // as 1/f³: twice as far, twice as much. Bone is the counter-check: beyond its plates nothing grows.
        let growth = |of: Of| {
            let lengths = lengths(of, "AP");
            let apart = |by: usize| -> f64 {
                let rows = lengths.chunks_exact(128);
                let differences = rows.flat_map(|row| row.windows(by + 1).map(|w| f64::from(w[by] - w[0])));
                let squares: Vec<f64> = differences.map(|d| d * d).collect();
                squares.iter().sum::<f64>() / squares.len() as f64
            };
            libm::log2(apart(16) / apart(4)) / 2.0
        };
        let tissue = growth(Of::Tissue);
        assert!((0.7..1.4).contains(&tissue), "{tissue}");
        let bone = growth(Of::Bone);
        assert!(bone < 0.2, "{bone}");
    }
}
