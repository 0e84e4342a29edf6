//! Path lengths against exact ones, on every engine.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_viewer::{Backend, DevicePart, Material, Renderer};

/// Share of the radius from the axis within which a path counts as away from the silhouette.
const INNER: f64 = 0.95;

/// Largest relative error where `exact` exceeds `least`, with the number of pixels compared.
fn worst(
    renderer: &Renderer,
    lengths: &[f32],
    least: f64,
    exact: impl Fn((Vec3, Vec3)) -> f64,
) -> (f64, usize) {
    let arm = renderer.c_arm().expect("a fluoroscopic view");
    let (mut worst, mut count) = (0.0_f64, 0);
    for (i, &length) in lengths.iter().enumerate() {
        let exact = exact(arm.ray(pixel_centre(i, arm.size_px()[0])));
        if exact > least {
            worst = worst.max((f64::from(length) / exact - 1.0).abs());
            count += 1;
        }
    }
    (worst, count)
}

#[test]
fn a_sphere_is_right_within_half_a_percent_and_a_wrong_radius_is_not() {
    let centre = Vec3::new(7.0, -12.0, 5.0);
    let radius = 20.0;
    let least = 2.0 * radius * (1.0 - INNER * INNER).sqrt();
    for mut renderer in engines(&spec(Backend::Cpu, 257, 0.3), &sphere(radius, 120, centre)) {
        let lumen = renderer.path_lengths(&[]).unwrap().lumen_mm;
        let (error, count) = worst(&renderer, &lumen, least, |ray| sphere_chord(radius, centre, ray));
        assert!(count > 20_000 && error < 5e-3, "{}: {error} over {count}", renderer.backend());
        let (error, _) = worst(&renderer, &lumen, least, |ray| sphere_chord(radius * 1.01, centre, ray));
        assert!(error > 5e-3, "the comparison must be able to fail");
    }
}

#[test]
fn a_cylinder_mesh_is_right_within_half_a_percent() {
    let radius = 10.0;
    let mut spec = spec(Backend::Cpu, 200, 0.2);
    spec.c_arm.primary_deg = 33.0;
    spec.c_arm.secondary_deg = -21.0;
    let least = 2.0 * radius * (1.0 - INNER * INNER).sqrt();
    // Long enough that no ray of the frame meets an end.
    for mut renderer in engines(&spec, &cylinder(radius, 60.0, 400, Vec3::zeros())) {
        let lumen = renderer.path_lengths(&[]).unwrap().lumen_mm;
        let (error, count) = worst(&renderer, &lumen, least, |ray| cylinder_chord(radius, ray));
        assert!(count > 20_000 && error < 5e-3, "{}: {error} over {count}", renderer.backend());
    }
}

#[test]
fn a_device_is_an_exact_cylinder() {
    let radius = 0.45;
    let wire = device(7, radius, |w| Vec3::new(0.0, 0.0, 100.0 * w - 50.0));
    let mut spec = spec(Backend::Cpu, 200, 0.02);
    spec.c_arm.primary_deg = -50.0;
    for mut renderer in engines(&spec, &cylinder(10.0, 60.0, 40, Vec3::zeros())) {
        let maps = renderer.path_lengths(std::slice::from_ref(&wire)).unwrap().devices_mm;
        assert_eq!(maps.len(), 1);
        let (error, count) = worst(&renderer, &maps[0].1, radius, |ray| cylinder_chord(radius, ray));
        assert!(count > 2_000 && error < 1e-3, "{}: {error} over {count}", renderer.backend());
    }
}

#[test]
fn a_wire_seen_along_its_axis_has_its_volume_in_pictures_of_any_size() {
    let (radius, long) = (0.178, 60.0);
    let volume = std::f64::consts::PI * radius * radius * long;
    let along = |off: Vec3, turn: f64| {
        let (s, c) = turn.sin_cos();
        device(31, radius, move |w| off + Vec3::new(0.0, c, s) * (long * (w - 0.5)))
    };
    let off = Vec3::new(0.37, 0.0, -0.21);
    // The wire, one that is oblique by 1.5 degrees, and a catheter.
    let mut hollow = along(off, 0.0);
    hollow.parts = vec![DevicePart {
        material: Some(Material::Steel316L),
        outer_radius_mm: Some(0.45),
        inner_radius_mm: 0.25,
        ..DevicePart::default()
    }];
    let tube = volume * (0.45f64.powi(2) - 0.25f64.powi(2)) / radius.powi(2);
    let cases = [(along(off, 0.0), volume), (along(off, 1.5f64.to_radians()), volume), (hollow, tube)];
    for size in [64, 128, 200, 300, 512, 1000, 2000] {
        let mut view = spec(Backend::Cpu, size, 120.0 / f64::from(size));
        (view.c_arm.sid_mm, view.c_arm.sod_mm) = (100_000.0, 99_000.0);
        for mut renderer in engines(&view, &sphere(40.0, 24, Vec3::zeros())) {
            let per_mm = {
                let arm = renderer.c_arm().unwrap();
                arm.project(&Vec3::x())[0] - arm.project(&Vec3::zeros())[0]
            };
            for (number, (device, volume)) in cases.iter().enumerate() {
                let paths = renderer.path_lengths(std::slice::from_ref(device)).unwrap();
                let sum = paths.devices_mm[0].1.iter().map(|length| f64::from(*length)).sum::<f64>();
                let ratio = sum / (per_mm * per_mm) / volume;
                assert!((ratio - 1.0).abs() < 0.01, "{}: {size} {number}: {ratio}", renderer.backend());
            }
        }
    }
}

#[test]
fn a_wire_seen_end_on_at_the_border_is_cut_there() {
    // Half of a wire that is as long as it is seen: what is beyond the border does not come back within it.
    let radius = 0.178;
    let mut view = spec(Backend::Cpu, 64, 1.0);
    (view.c_arm.sid_mm, view.c_arm.sod_mm) = (100_000.0, 99_000.0);
    for mut renderer in engines(&view, &sphere(20.0, 24, Vec3::zeros())) {
        let arm = renderer.c_arm().unwrap();
        let per_mm = arm.project(&Vec3::x())[0] - arm.project(&Vec3::zeros())[0];
        let border_mm = 32.0 / per_mm;
        let wire = device(9, radius, |w| Vec3::new(border_mm, 20.0 * (w - 0.5), 0.4));
        let paths = renderer.path_lengths(std::slice::from_ref(&wire)).unwrap();
        let sum = paths.devices_mm[0].1.iter().map(|length| f64::from(*length)).sum::<f64>();
        let half = sum / (per_mm * per_mm) / (std::f64::consts::PI * radius * radius * 20.0);
        assert!((half - 0.5).abs() < 0.05, "{}: {half}", renderer.backend());
    }
}

#[test]
fn in_a_bend_of_five_millimetres_the_path_at_the_axis_is_the_diameter() {
    let (bend, radius) = (5.0, 0.2);
    let at = |w: f64| {
        let a = std::f64::consts::PI * (w - 0.5);
        Vec3::new(bend * a.cos() - 3.0, 0.0, bend * a.sin())
    };
    let loops = device(9, radius, at);
    for mut renderer in engines(&spec(Backend::Cpu, 900, 0.02), &sphere(30.0, 40, Vec3::zeros())) {
        let paths = renderer.path_lengths(std::slice::from_ref(&loops)).unwrap();
        let arm = renderer.c_arm().unwrap();
        for k in 1..100 {
            // Pixels next to the axis: a pixel is 0.014 mm at the device.
            let [u, v] = arm.project(&at(f64::from(k) / 100.0));
            let (x, y) = (u as u32, v as u32);
            let (_, direction) = arm.ray([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            // The plane of the bend lies across the central ray; tilted rays run longer.
            let expected = 2.0 * radius / direction.y.abs();
            let length = f64::from(paths.devices_mm[0].1[paths.index(x, y)]);
            assert!((length / expected - 1.0).abs() < 5e-3, "{}: {k}: {length}", renderer.backend());
        }
    }
}

#[test]
fn rays_through_vertices_and_edges_and_along_faces_leave_no_seam() {
    // An odd number of pixels, an isocentre on the axis and few sides: many rays meet vertices or edges, and
    // faces are seen edge-on.
    for sides in [4, 6, 8] {
        let mesh = cylinder(10.0, 12.0, sides, Vec3::zeros());
        for mut renderer in engines(&spec(Backend::Cpu, 151, 0.25), &mesh) {
            let paths = renderer.path_lengths(&[]).unwrap();
            // A seam is a pixel unlike those around it: one missed face is off by the distance to the plane
            // of the isocentre.
            for y in 1..150 {
                for x in 1..150 {
                    let at = |x, y| paths.lumen_mm[paths.index(x, y)];
                    let around = [at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)];
                    let low = around.into_iter().fold(f32::MAX, f32::min);
                    let high = around.into_iter().fold(f32::MIN, f32::max);
                    let here = at(x, y);
                    let name = renderer.backend();
                    assert!(
                        here > low - 0.8 && here < high + 0.8,
                        "{name}: {sides} sides at {x}, {y}: {here}"
                    );
                    assert!((-1e-3..=24.0).contains(&here), "{name}: {here}");
                }
            }
        }
    }
}

#[test]
fn nested_and_separate_surfaces_add_up() {
    let [inner, outer] = [5.0, 9.0].map(|r| sphere(r, 60, Vec3::zeros()));
    let shell = joined(&outer, &inverted(&inner));
    let both = joined(&outer, &sphere(4.0, 60, Vec3::new(3.0, 30.0, 0.0)));
    for (mesh, exact) in [(shell, 8.0), (both, 18.0 + 2.0 * 7.0_f32.sqrt())] {
        for mut renderer in engines(&spec(Backend::Cpu, 65, 0.25), &mesh) {
            let paths = renderer.path_lengths(&[]).unwrap();
            let length = paths.lumen_mm[paths.index(32, 32)];
            assert!((length - exact).abs() < 0.03, "{}: {length}, not {exact}", renderer.backend());
        }
    }
}

#[test]
fn the_body_is_a_slab_across_the_beam() {
    let mut renderer = Renderer::new(&spec(Backend::Cpu, 101, 2.0), &sphere(5.0, 8, Vec3::zeros())).unwrap();
    let paths = renderer.path_lengths(&[]).unwrap();
    assert!((paths.body_mm[paths.index(50, 50)] - 200.0).abs() < 1e-4);
    let (_, corner) = renderer.c_arm().unwrap().ray([0.5, 0.5]);
    assert!((f64::from(paths.body_mm[0]) - 200.0 / corner.y.abs()).abs() < 1e-4);
}
