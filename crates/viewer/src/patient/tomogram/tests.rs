//! Volumes traversed by rays, and read from files.

use endowire_core::vessel::motion::{Around, MotionMode, Waveform};
use endowire_core::vessel::{SurfaceMesh, VesselMotion};

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
        let [body, bone] = ball.project(&arm);
        let tissue: Vec<f32> = body.iter().zip(&bone).map(|(body, bone)| body - bone).collect();
        let middle = 32 * 64 + 32;
        assert!((bone[middle] - 20.0).abs() < 1.0, "{}", bone[middle]);
        assert!((tissue[middle] - 40.0).abs() < 1.5, "{}", tissue[middle]);
        // Beside the core there is only water: 2√(30² − off²).
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
fn a_volume_goes_with_its_vessel() {
    let ball = ball();
    let arm = arm(&CArmSpec { primary_deg: 25.0, ..CArmSpec::default() });
    let body = |displacement: &Displacement| ball.project_moved(&arm, displacement);
    let steady = |displacement_mm: [f64; 3], within: Option<Around>| {
        let mode = MotionMode {
            waveform: Waveform::Steady,
            period_s: None,
            phase: 0.0,
            displacement_mm,
            turn: None,
            still: None,
            within,
        };
        VesselMotion::new(&[mode]).unwrap().unwrap().at(0.0)
    };
    let apart = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Displaced by whole voxels it is the ball that starts there, except for the start of steps along rays.
    let there =
        Volume { origin_mm: ball.origin_mm + Vec3::new(0.0, 4.0, 6.0), voxels: ball.voxels.clone(), ..ball };
    let moved = body(&steady([0.0, 4.0, 6.0], None));
    let rest = ball.project(&arm)[0].clone();
    assert!(apart(&moved, &there.project(&arm)[0]) < 0.1, "{}", apart(&moved, &there.project(&arm)[0]));
    assert!(apart(&moved, &rest) > 5.0, "the twin: it has moved");
    // A field that fades, compared with the inverse at each position.
    let field =
        steady([1.0, 2.0, 7.0], Some(Around { centre_mm: [5.0, 0.0, 5.0], radius_mm: 10.0, fade_mm: 30.0 }));
    let warp = Warp::new(&ball, &field);
    let mut farthest: f64 = 0.0;
    for n in 0..500 {
        let x = Vec3::new(f64::from(n % 10), f64::from(n / 10 % 10), f64::from(n / 100)) * 7.0
            - Vec3::repeat(33.0);
        let at = ball.into * (x - ball.origin_mm);
        let found = warp.material([at.x as f32, at.y as f32, at.z as f32]).map(f64::from);
        let found = ball.origin_mm + Vec3::from(found) * 2.0;
        farthest = farthest.max((found - field.material(&x)).norm());
        assert!((found - field.material(&x)).norm() < 0.4, "{x} {found}");
    }
    assert!(farthest > 1e-3, "{farthest}");
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
        let volume = Volume::read(&spec, &SurfaceMesh::default()).unwrap();
        assert_eq!(volume.size, [2, 2, 2]);
        assert_eq!(volume.origin_mm, Vec3::new(1.0, 0.0, 0.0));
        // 2 · 400 − 1000 = −200 HU is 0.8 of tissue; the third index is slowest.
        assert!((volume.voxels[0][0] - 0.8).abs() < 1e-6 && (volume.voxels[4][0] - 1.0).abs() < 1e-6);
        assert!((volume.value([0.0, 0.0, 0.5])[0] - 0.9).abs() < 1e-6);
    }
    let mut contradicting = file(4, &short);
    contradicting[72] = 8;
    std::fs::write(&path, contradicting).unwrap();
    assert!(
        Volume::read(&spec, &SurfaceMesh::default())
            .unwrap_err()
            .to_string()
            .contains("bitpix = 8 of voxels that have 16")
    );
    std::fs::write(&path, &file(4, &short)[..200]).unwrap();
    assert!(Volume::read(&spec, &SurfaceMesh::default()).unwrap_err().to_string().contains("NIfTI"));
    let poisoned: Vec<u8> = (0..8).flat_map(|_| f32::NAN.to_le_bytes()).collect();
    std::fs::write(&path, file(16, &poisoned)).unwrap();
    assert!(Volume::read(&spec, &SurfaceMesh::default()).unwrap_err().to_string().contains("NaN"));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_slope_that_is_none_leaves_values_as_they_are_stored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nii");
    let spec = CtSpec { file: path.clone(), offset_mm: [0.0; 3] };
    let short: Vec<u8> = (0..8_i16).flat_map(|k| (25 * k - 200).to_le_bytes()).collect();
    for (slope, intercept, first) in
        [(f32::NAN, -1000.0, 0.8), (0.0, -1000.0, 0.8), (f32::INFINITY, f32::NAN, 0.8), (2.0, 0.0, 0.6)]
    {
        let mut bytes = file(4, &short);
        bytes[112..116].copy_from_slice(&slope.to_le_bytes());
        bytes[116..120].copy_from_slice(&intercept.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let volume = Volume::read(&spec, &SurfaceMesh::default()).unwrap();
        assert!((volume.voxels[0][0] - first).abs() < 1e-6, "{slope}: {}", volume.voxels[0][0]);
    }
    let mut bytes = file(4, &short);
    bytes[116..120].copy_from_slice(&f32::NAN.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let refused = Volume::read(&spec, &SurfaceMesh::default()).unwrap_err().to_string();
    assert!(refused.contains("scl_inter = NaN"), "{refused}");
}

#[test]
fn how_much_of_the_vessel_is_in_the_volume_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nii");
    let short: Vec<u8> = (0..8_i16).flat_map(|k| (400 + 25 * k).to_le_bytes()).collect();
    std::fs::write(&path, file(4, &short)).unwrap();
    let spec = CtSpec { file: path, offset_mm: [0.0; 3] };
    // Voxels of 10 mm from -15 to 5 in x and y, and from -5 to 15 in z.
    for (low, high, held) in [
        (Vec3::new(-10.0, -10.0, 0.0), Vec3::new(0.0, 0.0, 10.0), 1.0),
        // Half of four sides, and one end.
        (Vec3::new(-10.0, -10.0, 0.0), Vec3::new(0.0, 0.0, 30.0), 0.5),
    ] {
        let volume = Volume::read(&spec, &SurfaceMesh::cuboid(low, high, 1.0)).unwrap();
        assert!((volume.vessel_held() - held).abs() < 1e-9, "{}", volume.vessel_held());
    }
}

#[test]
fn a_missing_file_is_named_by_its_key() {
    let spec = CtSpec { file: "no-such.nii".into(), offset_mm: [0.0; 3] };
    let error = Volume::read(&spec, &SurfaceMesh::default()).unwrap_err().to_string();
    assert!(error.contains("view.patient.ct.file") && error.contains("no-such.nii"), "{error}");
}
