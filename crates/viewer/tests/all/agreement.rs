//! The adapter against the CPU reference.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_viewer::{Backend, DeviceView, Image, Renderer, View, ViewSpec};

/// A bent scene with everything in it: a lumpy closed wall seen obliquely, and two devices.
fn scene() -> (ViewSpec, endowire_core::vessel::SurfaceMesh, Vec<DeviceView>) {
    let profile: Vec<(f64, f64)> = (0..=160)
        .map(|i| {
            let w = f64::from(i) / 160.0;
            ((std::f64::consts::PI * w).sin().powf(0.3) * (14.0 + 4.0 * (20.0 * w).sin()), 120.0 * w - 60.0)
        })
        .collect();
    let mut wall = revolved(&profile, 96, Vec3::zeros());
    for v in &mut wall.vertices_mm {
        v.x += 0.006 * v.z * v.z;
        v.y += 8.0 * (0.05 * v.z).sin();
    }
    let at = |w: f64| {
        let z = 100.0 * w - 50.0;
        Vec3::new(0.006 * z * z + 3.0 * (0.3 * z).sin(), 8.0 * (0.05 * z).sin(), z)
    };
    let devices = vec![device(120, 0.45, at), device(60, 1.0, |w| at(0.6 * w) + Vec3::x() * 2.5)];
    let mut spec = spec(Backend::Cpu, 384, 0.5);
    spec.views = vec![View::ThreeD, View::Fluoro];
    spec.c_arm.primary_deg = 27.0;
    spec.c_arm.secondary_deg = 14.0;
    (spec, wall, devices)
}

/// Mean absolute difference of two pictures in grey levels.
fn levels(a: &Image, b: &Image) -> f64 {
    assert_eq!((a.width(), a.height(), a.format()), (b.width(), b.height(), b.format()));
    let sum: u64 = a.data().iter().zip(b.data()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.data().len() as f64
}

#[test]
fn path_lengths_agree_to_a_micrometre_in_the_mean_and_a_shift_of_a_tenth_of_a_millimetre_does_not() {
    let (spec, wall, devices) = scene();
    let Some(mut gpu) = on_gpu(&spec, &wall) else { return };
    let mut cpu = Renderer::new(&spec, &wall).unwrap();
    let [a, b] = [&mut cpu, &mut gpu].map(|r| r.path_lengths(&devices).unwrap());
    let lumen = mean_difference(&a.lumen_mm, &b.lumen_mm);
    let device = mean_difference(&a.devices_mm[0].1, &b.devices_mm[0].1);
    eprintln!("{}: mean difference: lumen {lumen:.2e} mm, devices {device:.2e} mm", gpu.backend());
    assert!(!gpu.backend().contains("CPU reference"), "the CPU has taken over: {}", gpu.backend());
    assert!(lumen <= 1e-3, "lumen: {lumen}");
    assert!(device <= 1e-4, "devices: {device}");

    let mut shifted = wall.clone();
    shifted.vertices_mm.iter_mut().for_each(|v| v.x += 0.1);
    let c = Renderer::new(&spec, &shifted).unwrap().path_lengths(&devices).unwrap();
    assert!(mean_difference(&c.lumen_mm, &b.lumen_mm) > 1e-3, "the comparison must be able to fail");
}

#[test]
fn what_the_adapter_transmits_is_off_by_its_path_lengths_and_nothing_else() {
    let (mut spec, wall, devices) = scene();
    // The whole spectrum, and contrast medium: what errors of length matter most for.
    spec.xray.energy_kev = None;
    spec.xray.contrast_fraction = 0.3;
    let Some(mut gpu) = on_gpu(&spec, &wall) else { return };
    let mut cpu = Renderer::new(&spec, &wall).unwrap();
    let logarithm = |renderer: &mut Renderer, devices: &[DeviceView]| -> Vec<f32> {
        let paths = renderer.path_lengths(devices).unwrap();
        renderer.transmission(&paths).unwrap().into_iter().map(f32::ln).collect()
    };
    let [a, b] = [&mut cpu, &mut gpu].map(|r| logarithm(r, &devices));
    let mean = mean_difference(&a, &b);
    let mut off: Vec<f32> = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).collect();
    off.sort_by(f32::total_cmp);
    let most = off[off.len() - 1 - off.len() / 1000];
    eprintln!("{}: transmission off by {mean:.1e} in the mean, {most:.1e} in a thousandth", gpu.backend());
    assert!(mean <= 1e-6 && most <= 1e-4, "{mean} {most}");
    // The twin: a wall a micrometre aside is more.
    let mut shifted = wall.clone();
    shifted.vertices_mm.iter_mut().for_each(|v| v.x += 1e-3);
    let shifted = logarithm(&mut Renderer::new(&spec, &shifted).unwrap(), &devices);
    assert!(mean_difference(&shifted, &b) > 1e-6);
}

#[test]
fn devices_seen_end_on_agree_too() {
    let wall = sphere(40.0, 24, Vec3::zeros());
    let spec = spec(Backend::Cpu, 200, 0.1);
    let Some(mut gpu) = on_gpu(&spec, &wall) else { return };
    let mut cpu = Renderer::new(&spec, &wall).unwrap();
    // Along the beam, almost along it, a taper pointing at the source, and a loop that passes through the direction.
    let straight = device(9, 0.8, |w| Vec3::new(2.0, 40.0 * (w - 0.5), -2.0));
    let slanted = device(9, 0.5, |w| Vec3::new(-3.0 + 0.4 * w, 40.0 * (w - 0.5), 2.0));
    let mut taper = device(9, 1.0, |w| Vec3::new(0.1, 30.0 * (w - 0.5), 0.2));
    (0..9).for_each(|i| taper.points[i].radius_mm = 0.1 + 0.1 * i as f64);
    let turn = device(40, 0.3, |w| {
        let (s, c) = (std::f64::consts::TAU * w).sin_cos();
        Vec3::new(5.0 * c, 5.0 * s, 3.0 * w)
    });
    for (name, device) in [("straight", straight), ("slanted", slanted), ("taper", taper), ("turn", turn)] {
        let [a, b] =
            [&mut cpu, &mut gpu].map(|r| r.path_lengths(std::slice::from_ref(&device)).unwrap().devices_mm);
        let difference = mean_difference(&a[0].1, &b[0].1);
        let longest = a[0].1.iter().copied().fold(0.0, f32::max);
        eprintln!("{name}: mean difference {difference:.1e} mm, longest path {longest:.2} mm");
        assert!(longest > 1.0 && difference <= 1e-3, "{name}: {difference}");
    }
}

#[test]
fn frames_look_alike_and_a_frame_without_the_device_does_not() {
    let (spec, wall, devices) = scene();
    let Some(mut gpu) = on_gpu(&spec, &wall) else { return };
    let mut cpu = Renderer::new(&spec, &wall).unwrap();
    let [a, b] = [&mut cpu, &mut gpu].map(|r| r.render(&devices).unwrap());
    assert!(!gpu.backend().contains("CPU reference"), "the CPU has taken over: {}", gpu.backend());
    let bare = cpu.render(&[]).unwrap();
    let [a, b, bare] = [a, b, bare].map(|frames| [frames.three_d.unwrap(), frames.fluoro.unwrap()]);
    for (view, bound) in [(0, 1.0), (1, 0.1)] {
        let difference = levels(&a[view], &b[view]);
        eprintln!("view {view}: {difference:.3} levels");
        assert!(difference < bound, "view {view}: {difference}");
        assert!(levels(&bare[view], &b[view]) > bound, "the comparison must be able to fail");
    }
}

#[test]
fn repeated_frames_are_equal_and_leave_nothing_behind() {
    let (spec, wall, devices) = scene();
    for mut renderer in engines(&spec, &wall) {
        let empty = renderer.render(&[]).unwrap();
        let first = renderer.render(&devices).unwrap();
        assert_ne!(first, empty);
        assert_eq!(renderer.render(&devices).unwrap(), first);
        assert_eq!(renderer.render(&[]).unwrap(), empty);
    }
}
