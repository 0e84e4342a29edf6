//! Wires thinner than a pixel: even along their length, of one piece, and the same in picture, arrays and mask.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_viewer::{Backend, DevicePart, DeviceView, Material, PathLengths, Renderer, ViewSpec};

/// Radius of a wire of 0.014 inch, mm.
const RADIUS_MM: f64 = 0.178;

/// A straight wire in the picture's plane, tilted by so much from the rows, in a field of 380 mm.
fn scene(size: u32, tilt_deg: f64, material: Material) -> (ViewSpec, DeviceView) {
    let mut view = spec(Backend::Cpu, size, 380.0 / f64::from(size));
    view.xray.energy_kev = None;
    view.xray.tissue_mm = 150.0;
    let along = Vec3::new(tilt_deg.to_radians().cos(), 0.0, tilt_deg.to_radians().sin());
    let wire = device(9, RADIUS_MM, |w| Vec3::new(0.07, 0.0, 0.11) + along * (160.0 * (w - 0.5)));
    (view, DeviceView { material: Some(material), ..wire })
}

/// Sums across the wire, line by line, of what `of` says of a pixel, for the lines well within its length.
fn across(size: usize, tilt_deg: f64, of: impl Fn(usize) -> f64) -> Vec<f64> {
    let run = if tilt_deg > 45.0 { tilt_deg.to_radians().sin() } else { tilt_deg.to_radians().cos() };
    let half = (size as f64 * 0.3 * 0.8 * run) as usize;
    let lines = size / 2 - half..size / 2 + half;
    let pixel = |line: usize, k: usize| if tilt_deg > 45.0 { line * size + k } else { k * size + line };
    lines.map(|line| (0..size).map(|k| of(pixel(line, k))).sum()).collect()
}

/// Largest deviation from the mean, in parts of it.
fn beat(sums: &[f64]) -> f64 {
    let mean = sums.iter().sum::<f64>() / sums.len() as f64;
    sums.iter().map(|sum| (sum / mean - 1.0).abs()).fold(0.0, f64::max)
}

/// The same from a straight line through the values: what is nearer to the source is drawn larger.
fn beat_about_line(sums: &[f64]) -> f64 {
    let middle = (sums.len() - 1) as f64 / 2.0;
    let offsets = || (0..sums.len()).map(|k| k as f64 - middle);
    let slope =
        offsets().zip(sums).map(|(x, sum)| x * sum).sum::<f64>() / offsets().map(|x| x * x).sum::<f64>();
    let mean = sums.iter().sum::<f64>() / sums.len() as f64;
    let level: Vec<f64> = offsets().zip(sums).map(|(x, sum)| sum / (mean + slope * x)).collect();
    beat(&level)
}

/// Pieces of a mask, neighbours being those on the four sides.
fn pieces(mask: &[u32], width: u32) -> usize {
    let mut open: std::collections::BTreeSet<u32> = mask.iter().copied().collect();
    let mut count = 0;
    while let Some(first) = open.pop_first() {
        count += 1;
        let mut next = vec![first];
        while let Some(at) = next.pop() {
            next.extend(
                [at + 1, at.wrapping_sub(1), at + width, at.wrapping_sub(width)]
                    .into_iter()
                    .filter(|n| open.remove(n)),
            );
        }
    }
    count
}

#[test]
fn a_wire_of_fourteen_thousandths_is_even_and_whole_at_any_angle_and_arrays_are_the_picture() {
    for (size, bound) in [(512, 0.05), (256, 0.10)] {
        for material in [Material::Steel316L, Material::Platinum] {
            let mut worst = (0.0, 0.0);
            for tilt_deg in
                [0.0, 0.3, 1.0, 4.0, 11.0, 22.5, 31.0, 44.0, 45.0, 46.0, 60.0, 75.0, 88.7, 89.7, 90.0]
            {
                let (view, wire) = scene(size, tilt_deg, material);
                let mut renderer = Renderer::new(&view, &sphere(90.0, 24, Vec3::zeros())).unwrap();
                let bare = renderer.transmission_at(&[], 0.0).unwrap();
                let left = renderer.transmission_at(std::slice::from_ref(&wire), 0.0).unwrap();
                let shadow = |i: usize| 1.0 - f64::from(left[i] / bare[i]);
                let of_signal = beat(&across(size as usize, tilt_deg, shadow));
                let paths = renderer.path_lengths(std::slice::from_ref(&wire)).unwrap();
                let raw = beat(&across(size as usize, tilt_deg, |i| f64::from(paths.devices_mm[0].1[i])));
                worst = if of_signal > worst.0 { (of_signal, tilt_deg) } else { worst };
                assert!(
                    of_signal <= bound && raw <= bound,
                    "{size} {material} {tilt_deg}: {of_signal} {raw}"
                );
                let mask = &renderer.labels(std::slice::from_ref(&wire), &[]).unwrap().devices[0].mask;
                assert_eq!(pieces(mask.pixels(), size), 1, "{size} {tilt_deg}");
                // A shadow of a hundred thousandth is what single precision tells.
                let agree = |i: usize| match paths.devices_mm[0].1[i] {
                    0.0 => shadow(i).abs() < 1e-5,
                    length => length < 1e-4 || shadow(i) > 1e-5,
                };
                assert!((0..left.len()).all(agree), "{size} {tilt_deg}: arrays show what the picture shows");
            }
            eprintln!("{size} {material}: at most {:.3} off at {} degrees", worst.0, worst.1);
        }
    }
}

/// The beat of shadow and arrays along a straight device, wherever the C-arm sees it, in the lines across the middle
/// 90 % of it that are in the picture.
fn beats_along(renderer: &Renderer, from_to: [Vec3; 2], left: [&[f32]; 2], paths: &PathLengths) -> [f64; 2] {
    let size = renderer.c_arm().unwrap().size_px()[0] as usize;
    let [from, to] = from_to.map(|end| renderer.c_arm().unwrap().project(&end));
    let axis = usize::from((to[1] - from[1]).abs() > (to[0] - from[0]).abs());
    let at = |part: f64| (from[axis] + part * (to[axis] - from[axis])).clamp(2.0, size as f64 - 2.0);
    let (low, high) = (at(0.05).min(at(0.95)), at(0.05).max(at(0.95)));
    let pixel = |line: usize, k: usize| if axis == 1 { line * size + k } else { k * size + line };
    let sums = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (low as usize..high as usize).map(|line| (0..size).map(|k| of(pixel(line, k))).sum()).collect()
    };
    let all_mm = |i: usize| paths.devices_mm.iter().map(|map| f64::from(map.1[i])).sum();
    [beat_about_line(&sums(&|i| 1.0 - f64::from(left[0][i] / left[1][i]))), beat_about_line(&sums(&all_mm))]
}

/// What is looked at: C-arm (primary, secondary, rotation, magnification), side of the field, ends of the device.
type Sight = ([f64; 4], f64, [Vec3; 2]);

#[test]
fn wires_are_even_in_other_fields_poses_catheters_and_windings() {
    let whole = [Vec3::new(-60.0, 0.0, -21.0), Vec3::new(60.0, 0.0, 33.0)];
    let beyond = [Vec3::new(-60.0, 0.0, -20.0), Vec3::new(200.0, 0.0, 40.0)];
    let border = [Vec3::new(-60.0, 0.0, 92.4), Vec3::new(60.0, 0.0, 91.8)];
    let sights: [Sight; 7] = [
        ([0.0, 0.0, 0.0, 1.0], 200.0, whole),
        ([0.0, 0.0, 0.0, 1.0], 480.0, whole),
        ([-40.0, 0.0, 0.0, 1.0], 300.0, whole),
        ([35.0, 28.0, 0.0, 1.0], 300.0, whole),
        ([0.0, -20.0, 23.0, 1.7], 380.0, whole),
        ([0.0, 0.0, 0.0, 1.0], 300.0, beyond),
        ([0.0, 0.0, 0.0, 1.0], 273.0, border),
    ];
    let wound = DevicePart {
        from_tip_mm: Some([0.0, 1000.0]),
        material: Some(Material::Platinum),
        outer_radius_mm: Some(RADIUS_MM),
        inner_radius_mm: 0.12,
    };
    let shaft = DevicePart {
        from_tip_mm: Some([0.0, 1000.0]),
        material: Some(Material::PebaxBariumSulphate40),
        outer_radius_mm: Some(0.45),
        inner_radius_mm: 0.25,
    };
    for (size, bound) in [(512_u32, 0.05), (256, 0.10)] {
        for (number, ([primary_deg, secondary_deg, rotation_deg, magnification], field_mm, ends)) in
            (0..).zip(sights)
        {
            let (mut view, _) = scene(size, 0.0, Material::Steel316L);
            let arm = &mut view.c_arm;
            (arm.primary_deg, arm.secondary_deg) = (primary_deg, secondary_deg);
            (arm.rotation_deg, arm.magnification) = (rotation_deg, magnification);
            (arm.pixel_mm, arm.field_mm) = (None, Some(field_mm));
            let wire = device(9, RADIUS_MM, |w| ends[0] + (ends[1] - ends[0]) * w);
            let steel = DeviceView { material: Some(Material::Steel316L), ..wire.clone() };
            let coil = DeviceView { parts: vec![wound], ..wire };
            let outer = device(9, 0.45, |w| ends[0] + (ends[1] - ends[0]) * w);
            let catheter = DeviceView { parts: vec![shaft], ..outer };
            for devices in [vec![steel.clone()], vec![coil], vec![steel, catheter]] {
                let mut renderer = Renderer::new(&view, &sphere(90.0, 24, Vec3::zeros())).unwrap();
                let bare = renderer.transmission_at(&[], 0.0).unwrap();
                let left = renderer.transmission_at(&devices, 0.0).unwrap();
                let paths = renderer.path_lengths(&devices).unwrap();
                let beats = beats_along(&renderer, ends, [&left, &bare], &paths);
                assert!(beats.iter().all(|beat| *beat <= bound), "{size} {number}: {beats:?}");
                for label in renderer.labels(&devices, &[]).unwrap().devices {
                    assert_eq!(pieces(label.mask.pixels(), size), 1, "{size} {number}");
                }
            }
        }
    }
}

#[test]
fn the_twin_two_by_two_rays_a_pixel_beat() {
    let tilt_deg = 88.7;
    let (view, wire) = scene(512, tilt_deg, Material::Steel316L);
    let renderer = Renderer::new(&view, &sphere(90.0, 24, Vec3::zeros())).unwrap();
    let arm = renderer.c_arm().unwrap();
    let [from, to] = [wire.points[0].position_mm, wire.points[8].position_mm];
    let along = (to - from).normalize();
    let chord = |at: [f64; 2]| {
        let (source, direction) = arm.ray(at);
        let across = direction.cross(&along).normalize();
        let off = (source - from).dot(&across);
        2.0 * (RADIUS_MM * RADIUS_MM - off * off).max(0.0).sqrt()
    };
    // A pixel of 256² has the rays of four pixels of 512².
    let sums = across(256, tilt_deg, |i| {
        let [x, y] = [i % 256, i / 256].map(|k| 2.0 * k as f64 + 0.5);
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| chord([x + u, y + v])).iter().sum()
    });
    assert!(beat(&sums) > 0.5, "{}", beat(&sums));
}
