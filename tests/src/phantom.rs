//! A drawn abdomen: an unenhanced tomogram and the label map of its arteries, as files small enough to be assets.
//!
//! The aorta comes in at the top of the picture, gives off a left renal artery that the segmentation follows for a few
//! centimetres, and divides into the iliac arteries, which leave at the bottom. Labels are those of TotalSegmentator:
//! 52 aorta, 65 and 66 left and right iliac artery. Courses are drawn and radii are usual ones; nothing is from a person.

use std::io::{self, Write};
use std::path::Path;

use endowire_core::Vec3;
use flate2::Compression;
use flate2::write::GzEncoder;

/// Number of voxels, and their sides, mm.
const SIZE: [usize; 3] = [110, 84, 64];
const SIDES_MM: [f64; 3] = [2.2, 2.2, 3.0];
/// Centre of the first voxel in LPS, mm.
const ORIGIN_MM: [f64; 3] = [-119.9, -91.3, -60.0];

/// Names of the files.
pub const CT: &str = "abdomen.nii.gz";
/// The label map.
pub const LABELS: &str = "abdomen_labels.nii.gz";

/// Radii of aorta, iliac and renal arteries, mm.
pub const RADII_MM: [f64; 3] = [9.0, 5.0, 3.3];

/// Distance from a line of points.
fn off_line(x: &Vec3, line: &[[f64; 3]]) -> f64 {
    line.windows(2)
        .map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(Vec3::from);
            let along = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            (x - a - (b - a) * along).norm()
        })
        .fold(f64::MAX, f64::min)
}

/// The courses: aorta, left and right iliac artery, left renal artery.
const AORTA: [[f64; 3]; 4] = [[3.0, 14.0, 160.0], [4.0, 12.0, 110.0], [3.0, 8.0, 70.0], [0.0, 6.0, 45.0]];
const LEFT: [[f64; 3]; 4] = [[0.0, 6.0, 48.0], [14.0, 10.0, 15.0], [26.0, 18.0, -20.0], [33.0, 10.0, -90.0]];
const RIGHT: [[f64; 3]; 4] =
    [[0.0, 6.0, 48.0], [-16.0, 10.0, 14.0], [-28.0, 18.0, -22.0], [-36.0, 8.0, -90.0]];
const RENAL: [[f64; 3]; 3] = [[4.0, 12.0, 100.0], [24.0, 18.0, 97.0], [52.0, 30.0, 90.0]];

/// The label at a place in LPS.
fn label(x: &Vec3) -> u8 {
    let [aorta, iliac, renal] = RADII_MM;
    match () {
        () if off_line(x, &AORTA) < aorta || off_line(x, &RENAL) < renal => 52,
        () if off_line(x, &LEFT) < iliac => 65,
        () if off_line(x, &RIGHT) < iliac => 66,
        () => 0,
    }
}

/// Hounsfield units at a place in LPS.
fn hu(x: &Vec3) -> i16 {
    let ellipse = |half: [f64; 2], y: f64| ((x.x / half[0]).powi(2) + ((x.y - y) / half[1]).powi(2)).sqrt();
    // Vertebrae of 30 mm with discs of 9 mm between them, and an arch behind.
    let is_disc = (x.z + 60.0).rem_euclid(39.0) > 30.0;
    let vertebra = ellipse([24.0, 18.0], 42.0);
    let spine = ellipse([9.0, 16.0], 72.0);
    match () {
        () if ellipse([114.0, 86.0], 0.0) > 1.0 => -1000,
        () if ellipse([106.0, 78.0], 0.0) > 1.0 => -100,
        () if vertebra < 1.0 && is_disc => 90,
        () if vertebra < 0.84 => 220,
        () if vertebra < 1.0 || (spine < 1.0 && !is_disc) => 700,
        () if label(x) > 0 => 45,
        // Gas in the bowel.
        () if (x - Vec3::new(-52.0, -30.0, 60.0)).norm() < 17.0 => -900,
        () => 40,
    }
}

/// A file of NIfTI-1, compressed: voxels in this type, placed in RAS.
fn nifti<const N: usize>(code: i16, value: impl Fn(&Vec3) -> [u8; N]) -> io::Result<Vec<u8>> {
    let mut header = vec![0; 352];
    let mut put = |at: usize, data: &[u8]| header[at..at + data.len()].copy_from_slice(data);
    put(0, &348_i32.to_le_bytes());
    let [nx, ny, nz] = SIZE.map(|n| n as i16);
    (0..).zip([3, nx, ny, nz, 1, 1, 1, 1]).for_each(|(k, n)| put(40 + 2 * k, &n.to_le_bytes()));
    put(70, &code.to_le_bytes());
    put(72, &(8 * N as i16).to_le_bytes());
    (0..).zip([1.0, SIDES_MM[0], SIDES_MM[1], SIDES_MM[2]]).for_each(|(k, side)| {
        put(76 + 4 * k, &(side as f32).to_le_bytes());
    });
    put(108, &352_f32.to_le_bytes());
    put(112, &1_f32.to_le_bytes());
    put(123, &[2]);
    put(254, &1_i16.to_le_bytes());
    // Left and posterior change their signs.
    for (row, sign) in [-1.0, -1.0, 1.0].into_iter().enumerate() {
        put(280 + 20 * row, &((sign * SIDES_MM[row]) as f32).to_le_bytes());
        put(292 + 16 * row, &((sign * ORIGIN_MM[row]) as f32).to_le_bytes());
    }
    put(344, b"n+1\0");
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&header)?;
    for z in 0..SIZE[2] {
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let at = [x, y, z];
                encoder
                    .write_all(&value(&Vec3::from_fn(|k, _| ORIGIN_MM[k] + at[k] as f64 * SIDES_MM[k])))?;
            }
        }
    }
    encoder.finish()
}

/// Writes both files into a folder.
///
/// # Errors
/// Where they cannot be written.
pub fn write(folder: &Path) -> io::Result<()> {
    std::fs::write(folder.join(CT), nifti(4, |x| hu(x).to_le_bytes())?)?;
    std::fs::write(folder.join(LABELS), nifti(2, |x| [label(x)])?)
}
