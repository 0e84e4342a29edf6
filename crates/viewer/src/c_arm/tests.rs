use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::CArm;
use super::place::FILL;
use crate::spec::{CArmSpec, Shutter};

fn arm(primary_deg: f64, secondary_deg: f64) -> CArm {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
        triangles: vec![],
    };
    let spec = CArmSpec { primary_deg, secondary_deg, pixel_mm: Some(0.25), ..CArmSpec::default() };
    CArm::new(&spec, [600, 400], &wall).unwrap()
}

#[test]
fn at_zero_the_source_is_posterior_and_the_patients_left_is_right_on_screen() {
    let arm = arm(0.0, 0.0);
    assert!((arm.source_mm() - Vec3::new(0.0, 750.0, 0.0)).norm() < 1e-12);
    assert_eq!(arm.project(&Vec3::zeros()), [300.0, 200.0]);
    let [u, v] = arm.project(&Vec3::new(10.0, 0.0, 0.0));
    assert!((u - 300.0 - 10.0 * 1100.0 / 750.0 / 0.25).abs() < 1e-9 && (v - 200.0).abs() < 1e-9);
    let [u, v] = arm.project(&Vec3::new(0.0, 0.0, 10.0));
    assert!((u - 300.0).abs() < 1e-9 && v < 200.0 - 10.0, "the head is up: {v}");
}

#[test]
fn lao_moves_the_detector_to_the_left_and_cranial_to_the_head() {
    assert!((arm(90.0, 0.0).source_mm() - Vec3::new(-750.0, 0.0, 0.0)).norm() < 1e-9);
    let source = arm(0.0, 30.0).source_mm();
    assert!(source.z < -370.0 && source.y > 0.0, "detector to the head, source to the feet: {source}");
    // In LAO, anterior points move towards the patient's right, left on screen.
    let [u, _] = arm(30.0, 0.0).project(&Vec3::new(0.0, -20.0, 0.0));
    assert!(u < 300.0, "{u}");
    // In a cranial view, anterior points move down.
    let [_, v] = arm(0.0, 30.0).project(&Vec3::new(0.0, -20.0, 0.0));
    assert!(v > 200.0, "{v}");
}

#[test]
fn a_rotation_turns_the_picture_clockwise_and_magnification_enlarges_it() {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
        triangles: vec![],
    };
    let spec = CArmSpec {
        rotation_deg: 90.0,
        magnification: 2.0,
        field_mm: Some(150.0),
        collimation_mm: Some([30.0, 15.0]),
        ..CArmSpec::default()
    };
    let arm = CArm::new(&spec, [600, 400], &wall).unwrap();
    assert!((arm.pixel_mm() - 0.125).abs() < 1e-12);
    // The head, up before, is to the right.
    let [u, v] = arm.project(&Vec3::new(0.0, 0.0, 5.0));
    assert!(u > 350.0 && (v - 200.0).abs() < 1e-9, "{u} {v}");
    let point = Vec3::new(3.0, -4.0, 5.0);
    let (origin, direction) = arm.ray(arm.project(&point));
    assert!((point - origin).cross(&direction).norm() < 1e-10);
    assert_eq!(arm.opening_px().unwrap(), [240.0, 120.0]);
    assert!(arm.sees([300.0, 200.0]) && arm.sees([181.0, 141.0]) && !arm.sees([179.0, 200.0]));
    let at = |x: usize, y: usize| arm.openness(y * 600 + x);
    assert_eq!([at(300, 200), at(180, 200), at(179, 200), at(178, 200)], [1.0, 1.0, 0.0, 0.0]);
}

#[test]
fn blades_that_leave_no_pixel_open_are_refused_with_their_width() {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::new(-5.0, -4.0, -3.0), Vec3::new(5.0, 4.0, 3.0)],
        triangles: vec![],
    };
    let between = |width: f64| {
        let spec =
            CArmSpec { pixel_mm: Some(0.25), collimation_mm: Some([width, 20.0]), ..CArmSpec::default() };
        CArm::new(&spec, [64, 64], &wall)
    };
    let refused = between(0.1).unwrap_err().to_string();
    let told = "view.c_arm.collimation_mm = [0.1, 20]: leaves 0.40 pixels open at the detector, each 0.250 mm wide; leave at least 2 \
                open (0.50 mm)";
    assert!(refused.starts_with(told), "{refused}");
    // The twin: two pixels are open, and the two in the middle are wholly so.
    let arm = between(0.5).unwrap();
    assert_eq!([30, 31, 32, 33].map(|x| arm.openness(32 * 64 + x)), [0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn nearer_to_the_source_is_larger() {
    let arm = arm(0.0, 0.0);
    let at = |y| arm.project(&Vec3::new(10.0, y, 0.0))[0] - 300.0;
    assert!(at(30.0) > at(-30.0));
}

#[test]
fn axes_are_orthonormal_and_rays_invert_projection() {
    let arm = arm(-37.0, 22.0);
    for i in 0..3 {
        for j in 0..3 {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((arm.axes[i].dot(&arm.axes[j]) - expected).abs() < 1e-14);
        }
    }
    // Seen from the detector the picture is not mirrored: columns × (upwards) points to the viewer.
    assert!((arm.axes[0].cross(&-arm.axes[1]) - arm.axes[2]).norm() < 1e-14);
    let point = Vec3::new(12.0, -34.0, 25.0);
    let (origin, direction) = arm.ray(arm.project(&point));
    let off = (point - origin) - direction * (point - origin).dot(&direction);
    assert!(off.norm() < 1e-10, "{off}");
}

#[test]
fn left_alone_the_field_holds_the_vessel_and_is_the_same_from_every_side() {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
        triangles: vec![],
    };
    let mut widest = 0.0_f64;
    let mut pitches = Vec::new();
    for primary_deg in (-180..180).step_by(5) {
        for secondary_deg in (-90..=90).step_by(5) {
            let [primary_deg, secondary_deg] = [primary_deg, secondary_deg].map(f64::from);
            let spec = CArmSpec { primary_deg, secondary_deg, ..CArmSpec::default() };
            let arm = CArm::new(&spec, [800, 600], &wall).unwrap();
            pitches.push(arm.pixel_mm());
            for [u, v] in wall.vertices_mm.iter().map(|vertex| arm.project(vertex)) {
                widest = widest.max((u - 400.0).hypot(v - 300.0));
            }
        }
    }
    assert!(pitches.iter().all(|pitch| *pitch == pitches[0]));
    assert!(widest <= 300.0 * FILL && widest > 0.99 * 300.0 * FILL, "{widest}");
}

#[test]
fn a_vessel_beyond_the_source_or_the_detector_is_refused() {
    let far =
        SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::new(0.0, 2000.0, 0.0)], triangles: vec![] };
    let spec = CArmSpec { isocentre_mm: Some([0.0; 3]), ..CArmSpec::default() };
    let error = CArm::new(&spec, [64, 64], &far).unwrap_err().to_string();
    assert!(error.contains("between source and detector"), "{error}");
}

#[test]
fn an_octagon_leaves_its_area_open_and_a_rectangle_all() {
    let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(40.0)], triangles: vec![] };
    let open = |shutter: Shutter, collimation_mm: Option<[f64; 2]>| {
        let spec = CArmSpec { shutter, collimation_mm, pixel_mm: Some(0.5), ..CArmSpec::default() };
        let arm = CArm::new(&spec, [200, 200], &wall).unwrap();
        let sum = (0..200 * 200).map(|pixel| arm.openness(pixel)).sum::<f64>();
        let seen =
            (0..200 * 200).filter(|i| arm.sees([f64::from(i % 200) + 0.5, f64::from(i / 200) + 0.5])).count();
        assert!((sum - seen as f64).abs() < 0.005 * sum, "{sum} {seen}");
        sum
    };
    let side = 200.0_f64;
    // 2 (√2 − 1) of a square.
    let octagon = 2.0 * (std::f64::consts::SQRT_2 - 1.0);
    assert!((open(Shutter::Octagon, None) / (side * side * octagon) - 1.0).abs() < 1e-3);
    let half = open(Shutter::Octagon, Some([50.0, 50.0]));
    assert!((half / (100.0 * 100.0 * octagon) - 1.0).abs() < 5e-3, "{half}");
    assert_eq!(open(Shutter::Rectangle, None), side * side);
}
