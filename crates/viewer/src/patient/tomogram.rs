//! A computed tomogram as background: NIfTI in, lengths of tissue and bone out.
//!
//! Hounsfield units tell attenuation relative to water. Up to [`SOFT_HU`] a voxel is taken as soft tissue of less or more mass,
//! above as a mixture with cortical bone, so that one volume gives lengths in two materials whatever the spectrum. A ray is
//! marched in steps of half a voxel through the trilinear interpolation of its voxels.

use endowire_core::nalgebra::Matrix3;
use endowire_core::{Error, Result, Vec3};
use nifti::{
    InMemNiftiObject, NiftiHeader, NiftiObject, NiftiVolume, RandomAccessNiftiVolume, ReaderOptions,
};

use crate::c_arm::CArm;
use crate::spec::CtSpec;

/// Sides of a voxel that can be meant, mm: a unit mistake is easily a factor of a thousand, and rays march by half a side.
const VOXEL_MM: std::ops::RangeInclusive<f64> = 1e-3..=1e3;
/// Most voxels of a volume: 512 × 512 × 1024, two gigabytes of materials.
const MOST_VOXELS: u64 = 1 << 28;
/// Air: no tissue at all below this.
const AIR_HU: f32 = -950.0;
/// Bone begins.
const SOFT_HU: f32 = 120.0;
/// Solid cortical bone at 60 keV: (0.574/0.206 − 1) · 1000.
const CORTICAL_HU: f32 = 1790.0;
/// Part of the smallest voxel side that a ray advances at once.
const STEP: f64 = 0.5;

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

/// Refuses a volume that memory may not hold, and one whose header contradicts itself about the size of a voxel.
fn check_size(header: &NiftiHeader) -> std::result::Result<(), String> {
    let bits = header.data_type().map_or(header.bitpix, |kind| 8 * kind.size_of() as i16);
    if header.bitpix != bits {
        return Err(format!(
            "says bitpix = {} of voxels that have {bits} bits; mend its header",
            header.bitpix
        ));
    }
    let dims = usize::from(header.dim[0]).clamp(1, 7);
    let voxels = header.dim[1..=dims].iter().fold(1_u64, |product, n| product.saturating_mul(u64::from(*n)));
    if voxels <= MOST_VOXELS {
        return Ok(());
    }
    Err(format!(
        "has {voxels} voxels (dim = {:?}), at most {MOST_VOXELS} are read: crop it or make it coarser",
        &header.dim[1..=dims]
    ))
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
}

impl Volume {
    /// Reads a NIfTI file of Hounsfield units.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the key for a file that is not there, [`Error::Content`] for one that is no usable volume.
    pub(crate) fn read(spec: &CtSpec) -> Result<Self> {
        let path = &spec.file;
        std::fs::metadata(path)
            .map_err(|source| Error::parameter("view.patient.ct.file", path.display(), source.to_string()))?;
        let unreadable =
            |error: nifti::NiftiError| Error::content(path, format!("is no NIfTI volume: {error}"));
        // The header first: it says how much memory the volume asks for.
        check_size(&NiftiHeader::from_file(path).map_err(unreadable)?)
            .map_err(|why| Error::content(path, why))?;
        let object: InMemNiftiObject = ReaderOptions::new().read_file(path).map_err(unreadable)?;
        let header = object.header().clone();
        let volume = object.into_volume();
        let dim = volume.dim().to_vec();
        let bad = |reason: String| Error::content(path, reason);
        let [nx, ny, nz] = match dim.as_slice() {
            [x, y, z] | [x, y, z, 1] => [*x, *y, *z],
            other => return Err(bad(format!("a volume has three dimensions, not {other:?}"))),
        };
        if [nx, ny, nz].iter().any(|&n| n < 2) {
            return Err(bad(format!("{nx} × {ny} × {nz} voxels are no volume")));
        }
        let mut voxels = Vec::with_capacity(usize::from(nx) * usize::from(ny) * usize::from(nz));
        let extra: &[u16] = if dim.len() == 4 { &[0] } else { &[] };
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let place: Vec<u16> = [x, y, z].iter().chain(extra).copied().collect();
                    let hu = volume
                        .get_f32(&place)
                        .map_err(|e| bad(format!("voxel [{x}, {y}, {z}] cannot be read: {e}")))?;
                    if !hu.is_finite() {
                        return Err(bad(format!("voxel [{x}, {y}, {z}] is {hu}")));
                    }
                    voxels.push(materials(hu));
                }
            }
        }
        let (axes, origin) = placement(&header).map_err(bad)?;
        Self::new([nx, ny, nz].map(usize::from), axes, origin + Vec3::from(spec.offset_mm), voxels)
            .ok_or_else(|| Error::content(path, "its axes do not span space, or its voxels are no 0.001 to 1000 mm wide; mend its sform or pixdim"))
    }

    /// A volume with voxel (i, j, k) at `origin_mm` + `axes` · (i, j, k).
    fn new(size: [usize; 3], axes: Matrix3<f64>, origin_mm: Vec3, voxels: Vec<[f32; 2]>) -> Option<Self> {
        let smallest = axes.column_iter().map(|c| c.norm()).fold(f64::MAX, f64::min);
        let sides = axes.column_iter().map(|c| c.norm());
        if !sides.clone().all(|side| VOXEL_MM.contains(&side)) {
            return None;
        }
        let into = axes.try_inverse().filter(|m| m.iter().all(|x| x.is_finite()))?;
        Some(Self { size, into, origin_mm, step_mm: STEP * smallest, voxels })
    }

    /// Lengths in soft tissue and bone of the central ray of each pixel.
    pub(crate) fn project(&self, view: &CArm) -> [Vec<f32>; 2] {
        // Voxels are wider than rays: every fourth ray is marched, those between are interpolated.
        const EVERY: usize = 2;
        let [width, height] = view.size_px().map(|n| n as usize);
        let nodes = [width, height].map(|n| n.div_ceil(EVERY) + 1);
        let mut coarse = Vec::with_capacity(nodes[0] * nodes[1]);
        for j in 0..nodes[1] {
            for i in 0..nodes[0] {
                coarse.push(self.march(view, [(i * EVERY) as f64, (j * EVERY) as f64]));
            }
        }
        let at = |pixel: usize, k: usize| {
            let place = |n: usize| ((n as f32 + 0.5) / EVERY as f32, n / EVERY);
            let ((x, i), (y, j)) = (place(pixel % width), place(pixel / width));
            let (u, v) = (x - i as f32, y - j as f32);
            let row =
                |j: usize| coarse[j * nodes[0] + i][k] * (1.0 - u) + coarse[j * nodes[0] + i + 1][k] * u;
            row(j) * (1.0 - v) + row(j + 1) * v
        };
        [0, 1].map(|k| (0..width * height).map(|pixel| at(pixel, k)).collect())
    }

    /// Lengths along one ray.
    fn march(&self, view: &CArm, pixel: [f64; 2]) -> [f32; 2] {
        let (source, direction) = view.ray(pixel);
        let (start, slope) = (self.into * (source - self.origin_mm), self.into * direction);
        // Where the ray is between the middles of the outermost voxels, in millimetres.
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
        for n in 0..steps as usize {
            let at = start + slope * (near + (n as f64 + 0.5) * step);
            let value = self.value([at.x as f32, at.y as f32, at.z as f32]);
            sum = [sum[0] + value[0], sum[1] + value[1]];
        }
        sum.map(|s| s * step as f32)
    }

    /// Trilinear interpolation at voxel coordinates.
    fn value(&self, at: [f32; 3]) -> [f32; 2] {
        let place = |k: usize| {
            let x = at[k].clamp(0.0, (self.size[k] - 1) as f32);
            let i = (x as usize).min(self.size[k] - 2);
            (i, x - i as f32)
        };
        let [(i, u), (j, v), (k, w)] = [place(0), place(1), place(2)];
        let row = self.size[0];
        let slice = row * self.size[1];
        let first = k * slice + j * row + i;
        let mix = |a: [f32; 2], b: [f32; 2], t: f32| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
        let along = |at: usize| mix(self.voxels[at], self.voxels[at + 1], u);
        mix(
            mix(along(first), along(first + row), v),
            mix(along(first + slice), along(first + slice + row), v),
            w,
        )
    }
}

/// Axes and origin of voxel indices in LPS millimetres. NIfTI axes are RAS: left and posterior change sign.
fn placement(header: &NiftiHeader) -> std::result::Result<(Matrix3<f64>, Vec3), String> {
    let rows = if header.sform_code > 0 {
        [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from))
    } else {
        // Method 2 of the standard: a quaternion, or with no code the spacing alone.
        let spacing = [1, 2, 3].map(|k| f64::from(header.pixdim[k]));
        let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let [b, c, d] = if header.qform_code > 0 { [b, c, d] } else { [0.0; 3] };
        let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
        let rotation = [
            [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
            [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
            [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ];
        let flip = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let origin = match header.qform_code > 0 {
            true => [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from),
            false => [0.0; 3],
        };
        [0, 1, 2].map(|r| {
            let [x, y, z] = rotation[r];
            [x * spacing[0], y * spacing[1], z * spacing[2] * flip, origin[r]]
        })
    };
    if rows.iter().flatten().any(|x| !x.is_finite()) {
        return Err("its affine is not finite; mend its sform or qform".into());
    }
    // Spatial units in the lower three bits: metre, millimetre, micrometre; unknown is taken as millimetre.
    let unit = match header.xyzt_units & 7 {
        1 => 1000.0,
        3 => 1e-3,
        _ => 1.0,
    };
    let sign = [-unit, -unit, unit];
    let axes = Matrix3::from_fn(|r, c| sign[r] * rows[r][c]);
    Ok((axes, Vec3::from_fn(|r, _| sign[r] * rows[r][3])))
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::CArmSpec;

    fn arm(spec: &CArmSpec) -> CArm {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
        let spec = CArmSpec { pixel_mm: Some(1.0), isocentre_mm: Some([0.0; 3]), ..spec.clone() };
        CArm::new(&spec, [64, 64], &wall).unwrap()
    }

    /// A ball of water of radius 30 with a core of bone of radius 10, 2 mm voxels.
    fn ball() -> Volume {
        let n = 41;
        let mut voxels = Vec::new();
        for k in 0..n {
            for j in 0..n {
                for i in 0..n {
                    let r = Vec3::from([i, j, k].map(|x| 2.0 * f64::from(x) - 40.0)).norm();
                    // Voxels on a surface belong to both sides.
                    let within = |radius: f64| ((radius - r) / 2.0 + 0.5).clamp(0.0, 1.0) as f32;
                    let (bone, all) = (within(10.0), within(30.0));
                    voxels.push([all - bone, bone]);
                }
            }
        }
        let axes = Matrix3::from_diagonal_element(2.0);
        Volume::new([n as usize; 3], axes, Vec3::repeat(-40.0), voxels).unwrap()
    }

    #[test]
    fn rays_through_a_ball_are_as_long_as_its_chords() {
        let ball = ball();
        for spec in
            [CArmSpec::default(), CArmSpec { primary_deg: 40.0, secondary_deg: 25.0, ..CArmSpec::default() }]
        {
            let arm = arm(&spec);
            let [tissue, bone] = ball.project(&arm);
            let middle = 32 * 64 + 32;
            assert!((bone[middle] - 20.0).abs() < 1.0, "{}", bone[middle]);
            assert!((tissue[middle] - 40.0).abs() < 1.5, "{}", tissue[middle]);
            // Beside the core there is water only: 2√(30² − off²).
            let beside = 32 * 64 + 10;
            let (_, direction) = arm.ray([10.5, 32.5]);
            let off = (arm.isocentre_mm() - arm.source_mm()).cross(&direction).norm();
            assert!(off > 12.0 && off < 18.0, "{off}");
            let chord = 2.0 * (900.0 - off * off).sqrt();
            assert!((f64::from(tissue[beside]) - chord).abs() < 1.5, "{} {chord}", tissue[beside]);
            assert!(bone[beside] < 0.01);
        }
    }

    #[test]
    fn hounsfield_units_become_the_materials_that_attenuate_so() {
        assert_eq!(materials(-1000.0), [0.0, 0.0]);
        assert_eq!(materials(0.0), [1.0, 0.0]);
        assert_eq!(materials(CORTICAL_HU), [0.0, 1.0]);
        let [tissue, bone] = materials(600.0);
        // At 60 keV: 0.203/cm of tissue and 0.574/cm of bone against 0.206/cm · 1.6.
        assert!(((tissue * 0.203 + bone * 0.574) / (0.206 * 1.6) - 1.0).abs() < 0.03);
    }

    #[test]
    fn the_affine_is_read_in_patient_axes() {
        let header = NiftiHeader {
            sform_code: 1,
            srow_x: [-0.5, 0.0, 0.0, 100.0],
            srow_y: [0.0, 0.6, 0.0, -50.0],
            srow_z: [0.0, 0.0, 2.0, 7.0],
            xyzt_units: 2,
            ..NiftiHeader::default()
        };
        let (axes, origin) = placement(&header).unwrap();
        assert_eq!(origin, Vec3::new(-100.0, 50.0, 7.0));
        assert!(
            (axes[(0, 0)] - 0.5).abs() < 1e-6 && (axes[(1, 1)] + 0.6).abs() < 1e-6 && axes[(2, 2)] == 2.0
        );
    }

    /// A NIfTI-1 file of 2 × 2 × 2 voxels of 10 mm from (0, 0, 0) in RAS, with a slope of 2 and an intercept of −1000.
    fn file(data_type: i16, voxels: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0; 352];
        let mut put = |at: usize, data: &[u8]| bytes[at..at + data.len()].copy_from_slice(data);
        put(0, &348_i32.to_le_bytes());
        for (k, n) in [3_i16, 2, 2, 2, 1, 1, 1, 1].into_iter().enumerate() {
            put(40 + 2 * k, &n.to_le_bytes());
        }
        put(70, &data_type.to_le_bytes());
        put(72, &(voxels.len() as i16).to_le_bytes());
        (0..4).for_each(|k| put(76 + 4 * k, &10_f32.to_le_bytes()));
        put(108, &352_f32.to_le_bytes());
        put(112, &2_f32.to_le_bytes());
        put(116, &(-1000_f32).to_le_bytes());
        put(123, &[2]);
        put(254, &1_i16.to_le_bytes());
        (0..3).for_each(|k| put(280 + 20 * k, &10_f32.to_le_bytes()));
        put(344, b"n+1\0");
        bytes.extend(voxels);
        bytes
    }

    #[test]
    fn integers_and_floats_are_read_with_their_slope_and_what_is_no_volume_is_refused() {
        let path = std::env::temp_dir().join(format!("endowire-{}.nii", std::process::id()));
        let spec = CtSpec { file: path.clone(), offset_mm: [1.0, 0.0, 0.0] };
        let short: Vec<u8> = (0..8_i16).flat_map(|k| (400 + 25 * k).to_le_bytes()).collect();
        let float: Vec<u8> = (0..8_i16).flat_map(|k| f32::from(400 + 25 * k).to_le_bytes()).collect();
        for (data_type, voxels) in [(4, &short), (16, &float)] {
            std::fs::write(&path, file(data_type, voxels)).unwrap();
            let volume = Volume::read(&spec).unwrap();
            assert_eq!(volume.size, [2, 2, 2]);
            assert_eq!(volume.origin_mm, Vec3::new(1.0, 0.0, 0.0));
            // 2 · 400 − 1000 = −200 HU is 0.8 of tissue; the third index is slowest.
            assert!((volume.voxels[0][0] - 0.8).abs() < 1e-6 && (volume.voxels[4][0] - 1.0).abs() < 1e-6);
            assert!((volume.value([0.0, 0.0, 0.5])[0] - 0.9).abs() < 1e-6);
        }
        let mut contradicting = file(4, &short);
        contradicting[72] = 8;
        std::fs::write(&path, contradicting).unwrap();
        assert!(Volume::read(&spec).unwrap_err().to_string().contains("bitpix = 8 of voxels that have 16"));
        std::fs::write(&path, &file(4, &short)[..200]).unwrap();
        assert!(Volume::read(&spec).unwrap_err().to_string().contains("NIfTI"));
        let poisoned: Vec<u8> = (0..8).flat_map(|_| f32::NAN.to_le_bytes()).collect();
        std::fs::write(&path, file(16, &poisoned)).unwrap();
        assert!(Volume::read(&spec).unwrap_err().to_string().contains("NaN"));
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_missing_file_is_named_by_its_key() {
        let spec = CtSpec { file: "no-such.nii".into(), offset_mm: [0.0; 3] };
        let error = Volume::read(&spec).unwrap_err().to_string();
        assert!(error.contains("view.patient.ct.file") && error.contains("no-such.nii"), "{error}");
    }
}
