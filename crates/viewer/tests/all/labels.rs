//! Labels against what they stand for, computed anew.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_viewer::{Backend, DevicePart, DeviceView, Material, Renderer, SheathMouth, TorsoSpec};

/// Rays across a pixel of the rasterisation to compare with.
const RAYS: u32 = 8;

/// Shares of the pixels that `inside` says of rays, by 8 × 8 of them.
fn shares(renderer: &Renderer, inside: impl Fn((Vec3, Vec3)) -> bool) -> Vec<f64> {
    let arm = renderer.c_arm().unwrap();
    let [width, height] = arm.size_px();
    let pixel = |i: u32| {
        let met = (0..RAYS * RAYS).filter(|ray| {
            let within = |k: u32| (f64::from(k) + 0.5) / f64::from(RAYS);
            let at = [f64::from(i % width) + within(ray % RAYS), f64::from(i / width) + within(ray / RAYS)];
            inside(arm.ray(at))
        });
        met.count() as f64 / f64::from(RAYS * RAYS)
    };
    (0..width * height).map(pixel).collect()
}

fn intersection_over_union(shares: &[f64], mask: &[u8], is_in: impl Fn(f64) -> bool) -> f64 {
    let both = shares.iter().zip(mask).map(|(share, m)| (is_in(*share), *m != 0));
    let count = |of: fn((bool, bool)) -> bool| both.clone().filter(|&p| of(p)).count() as f64;
    count(|(a, b)| a && b) / count(|(a, b)| a || b)
}

#[test]
fn a_mask_is_what_a_device_covers_by_half() {
    for (pixel_mm, radius, turned_deg) in [(0.3, 0.45, 0.0), (0.3, 0.45, 17.0), (0.2, 0.9, 31.0)] {
        let wire = device(7, radius, |w| Vec3::new(0.0, 0.0, 160.0 * w - 80.0));
        let mut spec = spec(Backend::Cpu, 200, pixel_mm);
        spec.c_arm.secondary_deg = 20.0;
        spec.c_arm.rotation_deg = turned_deg;
        let mut renderer = Renderer::new(&spec, &cylinder(10.0, 85.0, 40, Vec3::zeros())).unwrap();
        let labels = renderer.labels(&[wire], &[]).unwrap();
        let shares = shares(&renderer, |ray| cylinder_chord(radius, ray) > 0.0);
        let half = intersection_over_union(&shares, labels.mask.data(), |share| share >= 0.5);
        assert!(half >= 0.97, "{radius} mm, {turned_deg} degrees: {half}");
        // The twin: all pixels that are touched are more.
        let touched = intersection_over_union(&shares, labels.mask.data(), |share| share > 0.0);
        assert!(touched < 0.97, "{touched}");
        assert_eq!(labels.devices[0].mask.image().data().iter().filter(|v| **v > 0).count(), {
            labels.mask.data().iter().filter(|v| **v > 0).count()
        });
    }
}

#[test]
fn a_bend_is_covered_as_its_path_lengths_say() {
    let at = |w: f64| {
        let a = 5.0 * w;
        Vec3::new(12.0 * a.cos(), 6.0 * a.sin(), 20.0 * w - 10.0)
    };
    let bend = device(30, 0.6, at);
    let coarse = spec(Backend::Cpu, 160, 0.4);
    let mut fine = coarse.clone();
    (fine.size_px, fine.c_arm.pixel_mm) = ([1280, 1280], Some(0.05));
    let wall = sphere(30.0, 40, Vec3::zeros());
    let labels = Renderer::new(&coarse, &wall).unwrap().labels(std::slice::from_ref(&bend), &[]).unwrap();
    let paths = Renderer::new(&fine, &wall).unwrap().path_lengths(&[bend]).unwrap();
    let share = |i: usize| {
        let (x, y) = (i % 160 * 8, i / 160 * 8);
        // The mean length of a fine pixel whose middle is on the edge.
        const ON_EDGE_MM: f32 = 0.095;
        let rays = (0..64).filter(|k| paths.devices_mm[0].1[(y + k / 8) * 1280 + x + k % 8] > ON_EDGE_MM);
        rays.count() as f64 / 64.0
    };
    let shares: Vec<f64> = (0..160 * 160).map(share).collect();
    let half = intersection_over_union(&shares, labels.mask.data(), |share| share >= 0.5);
    assert!(half >= 0.99, "{half}");
}

#[test]
fn the_vessel_has_a_mask_and_nothing_is_under_a_blade() {
    let wire = device(7, 0.45, |w| Vec3::new(0.0, 0.0, 100.0 * w - 50.0));
    let mut spec = spec(Backend::Cpu, 200, 0.3);
    let wall = cylinder(10.0, 60.0, 400, Vec3::zeros());
    let mut renderer = Renderer::new(&spec, &wall).unwrap();
    let vessel = renderer.labels(&[], &[]).unwrap().vessel.unwrap();
    let shares = shares(&renderer, |ray| cylinder_chord(10.0, ray) > 0.0);
    let half = intersection_over_union(&shares, vessel.image().data(), |share| share >= 0.5);
    assert!(half >= 0.97, "{half}");
    spec.c_arm.collimation_mm = Some([20.0, 30.0]);
    let mut renderer = Renderer::new(&spec, &wall).unwrap();
    let labels = renderer.labels(&[wire], &[]).unwrap();
    let opening = renderer.c_arm().unwrap().opening_px().unwrap();
    let open = |pixel: u32| {
        let off = |at: u32, k: usize| (f64::from(at) + 0.5 - 100.0).abs() <= opening[k] / 2.0;
        off(pixel % 200, 0) && off(pixel / 200, 1)
    };
    let masks = [&labels.devices[0].mask, labels.vessel.as_ref().unwrap()];
    assert!(masks.iter().all(|mask| !mask.pixels().is_empty()));
    assert!(masks.iter().flat_map(|mask| mask.pixels()).all(|&pixel| open(pixel)));
    // The twin: without blades there is something where they were.
    assert!(vessel.pixels().iter().any(|&pixel| !open(pixel)));
}

#[test]
fn every_part_and_instrument_has_its_own_mask_and_the_matrix_projects() {
    let part = |from_tip_mm, material, outer_radius_mm, inner_radius_mm| DevicePart {
        from_tip_mm,
        material: Some(material),
        outer_radius_mm,
        inner_radius_mm,
    };
    let line = |w: f64| Vec3::new(5.0 * w, 3.0, 60.0 * w - 30.0);
    let wire = device(9, 0.4, line);
    let mut catheter = device(9, 0.9, |w| line(0.6 * w));
    catheter.parts = vec![
        part(None, Material::PebaxBariumSulphate40, None, 0.5),
        part(Some([2.0, 6.0]), Material::Platinum, Some(1.0), 0.9),
    ];
    let mut spec = spec(Backend::Cpu, 200, 0.3);
    spec.c_arm.primary_deg = 40.0;
    spec.c_arm.secondary_deg = -15.0;
    let mut renderer = Renderer::new(&spec, &cylinder(10.0, 60.0, 40, Vec3::zeros())).unwrap();
    let labels = renderer.labels(&[wire, catheter, DeviceView::default()], &[line(0.3)]).unwrap();
    let [wire, catheter, nothing] = &labels.devices[..] else { panic!() };
    assert!(wire.parts.is_empty() && catheter.parts.len() == 2 && nothing.mask.pixels().is_empty());
    assert_eq!(catheter.parts[1].material, Material::Platinum);
    let [tube, ring] = [0, 1].map(|i| catheter.parts[i].mask.pixels());
    assert!(ring.len() > 20 && ring.len() < tube.len() / 5);
    assert!(wire.mask.pixels().iter().any(|p| tube.contains(p)), "the wire is in the catheter");
    assert!(wire.mask.pixels().iter().any(|p| !tube.contains(p)), "and goes on");
    let arm = renderer.c_arm().unwrap();
    for ((pixel, place), depth) in wire.centre_line_px.iter().zip(&wire.centre_line_mm).zip(&wire.depth_mm) {
        let [u, v, w] = labels
            .camera_matrix
            .map(|row| row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3]);
        assert!(
            (u / w - pixel[0]).abs() < 1e-9 && (v / w - pixel[1]).abs() < 1e-9 && (w - depth).abs() < 1e-9
        );
        assert_eq!(arm.project(&Vec3::from(*place)), *pixel);
    }
    assert_eq!(labels.contacts[0].position_mm, <[f64; 3]>::from(line(0.3)));
    assert_eq!(wire.tip_mm, Some(line(1.0).into()));
}

#[test]
fn a_device_comes_out_of_the_edge_of_the_picture_and_so_do_its_masks() {
    // A catheter from the middle of the picture upwards, with a band that ends before the mouth of its sheath.
    let part = |from_tip_mm, material| DevicePart {
        from_tip_mm: Some(from_tip_mm),
        material: Some(material),
        ..DevicePart::default()
    };
    let parts = vec![part([0.0, 200.0], Material::Steel316L), part([0.0, 5.0], Material::Platinum)];
    let bare = DeviceView { parts, ..device(9, 0.8, |w| Vec3::new(0.0, 0.0, 30.0 * w)) };
    let sheath = Some(SheathMouth { position_mm: Vec3::zeros(), direction: Vec3::z() });
    let sheathed = DeviceView { sheath, ..bare.clone() };
    for torso in [None, Some(TorsoSpec::default())] {
        let mut spec = spec(Backend::Cpu, 160, 1.0);
        (spec.patient.torso, spec.detector.noise) = (torso, false);
        let mut renderer = Renderer::new(&spec, &sphere(60.0, 20, Vec3::zeros())).unwrap();
        let mut drawn = |device: &DeviceView| {
            let labels = renderer.labels(std::slice::from_ref(device), &[]).unwrap();
            let picture = renderer.render(std::slice::from_ref(device)).unwrap().fluoro.unwrap();
            (labels.devices.into_iter().next().unwrap(), picture)
        };
        let ((with, with_shaft), (without, none)) = (drawn(&sheathed), drawn(&bare));
        let in_last_row =
            |mask: &endowire_viewer::Mask| mask.pixels().iter().any(|pixel| *pixel >= 159 * 160);
        assert!(
            in_last_row(&with.mask) && in_last_row(&with.parts[0].mask) && !in_last_row(&with.parts[1].mask)
        );
        assert!(!in_last_row(&without.mask), "the twin begins in mid-air");
        let last_row = |picture: &endowire_viewer::Image| picture.data()[159 * 160..].to_vec();
        assert_ne!(last_row(&with_shaft), last_row(&none));
        // What is simulated is labelled as before, and the rest says what it is.
        assert_eq!((&with.centre_line_mm, with.tip_px), (&without.centre_line_mm, without.tip_px));
        assert_eq!(with.parts[0].from_tip_mm, Some([0.0, 200.0]));
        assert!(without.shaft_px.is_empty() && with.shaft_px.last() == with.centre_line_px.first());
        assert_eq!(with.shaft_px[0][1], 160.0, "{:?}", with.shaft_px[0]);
    }
}
