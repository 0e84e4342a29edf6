//! Path lengths at 512 × 512 against exact ones: the mean errors that the viewer promises.

use crate::common;

use std::f64::consts::{PI, TAU};

use common::*;
use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use endowire_viewer::{Backend, DevicePart, DeviceView, Material, Renderer};

/// Largest mean error over all pixels of the frame, mm.
const MEAN_BOUND_MM: f64 = 5e-4;

/// Mean absolute error over all pixels.
fn mean_error(renderer: &Renderer, lengths: &[f32], exact: impl Fn((Vec3, Vec3)) -> f64) -> f64 {
    let arm = renderer.c_arm().unwrap();
    let error = |(i, &length): (usize, &f32)| {
        (f64::from(length) - exact(arm.ray(pixel_centre(i, arm.size_px()[0])))).abs()
    };
    lengths.iter().enumerate().map(error).sum::<f64>() / lengths.len() as f64
}

/// A torus about z.
fn torus(large: f64, small: f64, n: [u32; 2]) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for i in 0..n[0] {
        let (s, c) = (TAU * f64::from(i) / f64::from(n[0])).sin_cos();
        for k in 0..n[1] {
            let (v, u) = (TAU * f64::from(k) / f64::from(n[1])).sin_cos();
            let r = large + small * u;
            mesh.vertices_mm.push(Vec3::new(r * c, r * s, small * v));
        }
    }
    let at = |i: u32, k: u32| i % n[0] * n[1] + k % n[1];
    for i in 0..n[0] {
        for k in 0..n[1] {
            let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Length inside a torus about z: crossings of the implicit surface, found by steps and bisection.
fn torus_chord(large: f64, small: f64, (origin, direction): (Vec3, Vec3)) -> f64 {
    let inside = |t: f64| {
        let p = origin + direction * t;
        let r = p.xy().norm() - large;
        small * small - r * r - p.z * p.z
    };
    // The ray nearest to the centre, and a stretch that holds the whole torus.
    let middle = -origin.dot(&direction);
    let reach = large + small + 1.0;
    let off = (origin + direction * middle).norm();
    if off > reach {
        return 0.0;
    }
    let steps = 600;
    let at = |k: i32| middle - reach + 2.0 * reach * f64::from(k) / f64::from(steps);
    let mut length = 0.0;
    for k in 0..steps {
        let (mut a, mut b) = (at(k), at(k + 1));
        let (fa, fb) = (inside(a), inside(b));
        if fa > 0.0 && fb > 0.0 {
            length += b - a;
        } else if (fa > 0.0) != (fb > 0.0) {
            let [start, end] = [a, b];
            for _ in 0..40 {
                let m = (a + b) / 2.0;
                if (inside(m) > 0.0) == (fa > 0.0) { a = m } else { b = m }
            }
            length += if fa > 0.0 { a - start } else { end - a };
        }
    }
    length
}

#[test]
fn sphere_cylinder_and_torus_are_right_to_half_a_micrometre_in_the_mean() {
    let mut view = spec(Backend::Cpu, 512, 0.16);
    view.c_arm.primary_deg = 30.0;
    view.c_arm.secondary_deg = 20.0;
    let sphere_at = Vec3::new(2.0, -3.0, 1.0);
    type Exact = Box<dyn Fn((Vec3, Vec3)) -> f64>;
    let cases: [(&str, SurfaceMesh, Exact, Exact); 3] = [
        (
            "sphere",
            sphere(20.0, 420, sphere_at),
            Box::new(move |ray| sphere_chord(20.0, sphere_at, ray)),
            Box::new(move |ray| sphere_chord(20.002, sphere_at, ray)),
        ),
        (
            "cylinder",
            cylinder(10.0, 200.0, 2400, Vec3::zeros()),
            Box::new(|ray| cylinder_chord(10.0, ray)),
            Box::new(|ray| cylinder_chord(10.002, ray)),
        ),
        (
            "torus",
            torus(14.0, 5.0, [900, 420]),
            Box::new(|ray| torus_chord(14.0, 5.0, ray)),
            Box::new(|ray| torus_chord(14.0, 5.003, ray)),
        ),
    ];
    for (name, mesh, exact, off) in cases {
        let mut renderer = Renderer::new(&view, &mesh).unwrap();
        let lumen = renderer.path_lengths(&[]).unwrap().lumen_mm;
        let error = mean_error(&renderer, &lumen, exact);
        eprintln!("{name}: {} triangles, mean error {error:.1e} mm", mesh.triangles.len());
        assert!(error <= MEAN_BOUND_MM, "{name}: {error}");
        let twin = mean_error(&renderer, &lumen, off);
        assert!(twin > MEAN_BOUND_MM, "{name}: two micrometres more of radius would pass: {twin}");
    }
}

/// A catheter of one material with a bore.
fn tube(points: usize, outer: f64, inner: f64, at: impl Fn(f64) -> Vec3) -> DeviceView {
    let part = DevicePart { inner_radius_mm: inner, ..DevicePart::default() };
    DeviceView { parts: vec![part], ..device(points, outer, at) }
}

#[test]
fn a_hollow_tube_is_its_outside_less_its_bore() {
    let (outer, inner) = (0.9, 0.6);
    let mut view = spec(Backend::Cpu, 512, 0.02);
    view.c_arm.primary_deg = -40.0;
    view.c_arm.secondary_deg = 12.0;
    let catheter = tube(9, outer, inner, |w| Vec3::new(0.0, 0.0, 60.0 * (w - 0.5)));
    for mut renderer in engines(&view, &sphere(40.0, 24, Vec3::zeros())) {
        let maps = renderer.path_lengths(std::slice::from_ref(&catheter)).unwrap().devices_mm;
        let exact = |ray| cylinder_chord(outer, ray) - cylinder_chord(inner, ray);
        let error = mean_error(&renderer, &maps[0].1, exact);
        eprintln!("{}: hollow tube, mean error {error:.1e} mm", renderer.backend());
        assert!(error <= MEAN_BOUND_MM, "{}: {error}", renderer.backend());
        let solid = mean_error(&renderer, &maps[0].1, |ray| cylinder_chord(outer, ray));
        assert!(solid > 0.1, "a solid rod would pass: {solid}");
    }
}

#[test]
fn in_a_bend_of_five_millimetres_walls_and_bore_are_right_within_half_a_percent_of_the_diameter() {
    let (bend, outer, inner) = (5.0, 0.7, 0.45);
    let at = |w: f64| {
        let a = PI * (w - 0.5);
        Vec3::new(bend * a.cos() - 3.0, 0.0, bend * a.sin())
    };
    let catheter = tube(9, outer, inner, at);
    for mut renderer in engines(&spec(Backend::Cpu, 900, 0.02), &sphere(30.0, 40, Vec3::zeros())) {
        let paths = renderer.path_lengths(std::slice::from_ref(&catheter)).unwrap();
        let arm = renderer.c_arm().unwrap();
        for k in 1..100 {
            let [u, v] = arm.project(&at(f64::from(k) / 100.0));
            let (x, y) = (u as u32, v as u32);
            let (_, direction) = arm.ray([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            let expected = 2.0 * (outer - inner) / direction.y.abs();
            let error = f64::from(paths.devices_mm[0].1[paths.index(x, y)]) - expected;
            assert!(error.abs() <= 0.005 * 2.0 * outer, "{}: {k}: {error}", renderer.backend());
        }
    }
}

#[test]
fn marker_bands_and_tips_lie_where_their_arc_lengths_say() {
    let mut wire = device(12, 0.45, |w| Vec3::new(0.0, 0.0, 60.0 * (w - 0.5)));
    wire.parts = vec![
        DevicePart {
            from_tip_mm: Some([10.0, 100.0]),
            material: Some(Material::Nitinol),
            ..DevicePart::default()
        },
        DevicePart {
            from_tip_mm: Some([0.0, 10.0]),
            material: Some(Material::Platinum),
            ..DevicePart::default()
        },
        DevicePart {
            from_tip_mm: Some([20.0, 21.5]),
            material: Some(Material::Tungsten),
            outer_radius_mm: Some(0.6),
            inner_radius_mm: 0.45,
        },
    ];
    for mut renderer in engines(&spec(Backend::Cpu, 700, 0.15), &sphere(40.0, 24, Vec3::zeros())) {
        let paths = renderer.path_lengths(std::slice::from_ref(&wire)).unwrap();
        let arm = renderer.c_arm().unwrap().clone();
        let along = |material: Material, from_tip: f64| {
            let map = &paths.devices_mm.iter().find(|m| m.0 == material).unwrap().1;
            let [u, v] = arm.project(&Vec3::new(0.0, 0.0, 30.0 - from_tip));
            f64::from(map[paths.index(u as u32, v as u32)])
        };
        let name = renderer.backend();
        for (material, there, not_there) in [
            (Material::Platinum, [0.3, 9.8], [10.2, 30.0]),
            (Material::Nitinol, [10.2, 50.0], [9.8, 0.3]),
            (Material::Tungsten, [20.2, 21.3], [19.7, 21.8]),
        ] {
            for s in there {
                let expected = if material == Material::Tungsten { 0.3 } else { 0.9 };
                assert!(
                    (along(material, s) - expected).abs() < 0.02,
                    "{name}: {material} at {s}: {}",
                    along(material, s)
                );
            }
            for s in not_there {
                assert_eq!(along(material, s), 0.0, "{name}: {material} at {s}");
            }
        }
    }
}
