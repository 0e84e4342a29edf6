//! Contrast medium in the picture is that which was injected, and has no steps.

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::{
    Backend, CArmSpec, FlowSpec, FrameTime, Image, InjectionSpec, PathLengths, Renderer, TorsoSpec, View,
    ViewSpec,
};

fn vessel(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels").join(name)
}

fn wall(name: &str) -> Wall {
    let file = vessel(if name == "arch" { "aortic_arch.stl" } else { "hepatic.stl" });
    Wall::from_surface(&SurfaceMesh::read(&file, 1.0).unwrap()).unwrap()
}

/// From so far away that all depths are magnified alike.
fn far(view: ViewSpec) -> ViewSpec {
    let c_arm = CArmSpec { sid_mm: 5000.0, sod_mm: 4900.0, field_mm: Some(420.0), ..view.c_arm };
    ViewSpec { c_arm, size_px: [512, 512], ..view }
}

fn view(vessel_name: &str, inflow_ml_per_s: f64, pulsatility: f64, injection: InjectionSpec) -> ViewSpec {
    let flow = FlowSpec {
        tree: Some(vessel(&format!("{vessel_name}.csv"))),
        inlet_mm: (vessel_name == "aortic_arch").then_some([-38.4, -54.8, 136.0]),
        inflow_ml_per_s,
        pulsatility,
        tissue_mm: Some(20.0),
        tissue_s: 1000.0,
        ..FlowSpec::default()
    };
    ViewSpec {
        views: vec![View::Fluoro],
        backend: Backend::Cpu,
        size_px: [512, 512],
        flow,
        injection: vec![injection],
        ..ViewSpec::default()
    }
}

fn injection(rate_ml_per_s: f64, at_mm: Option<[f64; 3]>) -> InjectionSpec {
    InjectionSpec { start_s: 0.2, duration_s: 1.0, rate_ml_per_s, at_mm, at_tip: false }
}

fn seen_ml(renderer: &Renderer, paths: &PathLengths) -> f64 {
    let c_arm = renderer.c_arm().unwrap();
    let side_mm = c_arm.pixel_mm() * c_arm.sod_mm() / c_arm.sid_mm();
    paths.contrast_mm.iter().map(|mm| f64::from(*mm)).sum::<f64>() * side_mm * side_mm / 1000.0
}

fn scenes() -> Vec<(&'static str, ViewSpec)> {
    let mut all = vec![];
    for pulsatility in [0.0, 0.6] {
        all.push(("arch", view("aortic_arch", 80.0, pulsatility, injection(20.0, None))));
        let in_artery = Some([-22.0, -39.0, 55.5]);
        all.push(("liver", view("hepatic", 8.0, pulsatility, injection(2.0, in_artery))));
    }
    all
}

#[test]
fn iodine_in_the_picture_is_what_was_injected_from_the_first_frame_on() {
    for (name, view) in scenes() {
        let wall = wall(name);
        let rate = view.injection[0].rate_ml_per_s;
        let mut renderer = Renderer::of_wall(&far(view.clone()), &wall).unwrap();
        let mut before = f64::NAN;
        for k in 1..=12 {
            let time_s = 0.2 + f64::from(k) / 15.0;
            let paths = renderer.path_lengths_at(&[], time_s).unwrap();
            let injected = rate * (time_s - 0.2).min(1.0);
            let seen = seen_ml(&renderer, &paths);
            let ratio = seen / injected;
            let pulsatility = view.flow.pulsatility;
            assert!((ratio - 1.0).abs() < 0.02, "{name} {pulsatility} {time_s}: {ratio}");
            // The twin: what was there a frame before is not what was injected now.
            assert!(k == 1 || (before / injected - 1.0).abs() > 0.02, "{before} {injected}");
            before = seen;
        }
    }
}

#[test]
fn what_comes_out_at_the_end_of_a_vessel_is_downstream_of_it_only() {
    // The mouth of a sheath at the lower end of the descending aorta.
    let of = |at_mm: Option<[f64; 3]>| {
        let view = far(view("aortic_arch", 80.0, 0.6, injection(20.0, at_mm)));
        let mut renderer = Renderer::of_wall(&view, &wall("arch")).unwrap();
        let paths = renderer.path_lengths_at(&[], 1.0).unwrap();
        let arm = renderer.c_arm().unwrap();
        // The row of 50 mm above that end, three aortas wide.
        let row = arm.project(&Vec3::new(0.0, 0.0, 50.0))[1] as usize;
        let above = paths.contrast_mm[..row * paths.width as usize].iter().fold(0.0_f32, |m, mm| m.max(*mm));
        let below = paths.contrast_mm[row * paths.width as usize..].iter().fold(0.0_f32, |m, mm| m.max(*mm));
        [above, below]
    };
    let [above, below] = of(Some([0.0, 0.0, 2.0]));
    assert!(above < 1e-3 && below > 1.0, "{above} {below}");
    let [above, _] = of(None);
    assert!(above > 1.0, "the twin: from the inlet, {above}");
}

#[test]
fn neighbouring_pixels_of_a_lumen_differ_by_little() {
    for (name, view) in scenes() {
        let wall = wall(name);
        let mut renderer = Renderer::of_wall(&view, &wall).unwrap();
        let mut cut = 0.0_f32;
        for k in [1, 3, 6, 10, 15, 20, 30] {
            let time_s = 0.2 + f64::from(k) / 15.0;
            let paths = renderer.path_lengths_at(&[], time_s).unwrap();
            let (step, place) = largest_step(&paths);
            let pulsatility = view.flow.pulsatility;
            eprintln!("{name} {pulsatility} {time_s:.3} s: step {step:.3} at {place:?}");
            assert!(step <= 0.05, "{name} {pulsatility} {time_s}: {step} at {place:?}");
            let mut full = paths;
            let most = full.contrast_mm.iter().zip(&full.lumen_mm).map(|(c, l)| c / l.max(1.0));
            let half = 0.5 * most.fold(0.0, f32::max);
            full.contrast_mm.iter_mut().zip(&full.lumen_mm).for_each(|(c, l)| {
                *c = if *c > half * l { *l } else { 0.0 };
            });
            cut = cut.max(largest_step(&full).0);
        }
        // The twin: medium that fills whole or not at all.
        assert!(cut > 0.5, "{cut}");
    }
}

/// An open tube of radius 2 mm along z, from 0 to 40 mm.
fn tube() -> Wall {
    const SIDES: u32 = 48;
    let mut mesh = SurfaceMesh::default();
    for ring in 0..=20 {
        mesh.vertices_mm.extend((0..SIDES).map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(SIDES)).sin_cos();
            Vec3::new(2.0 * c, 2.0 * s, 2.0 * f64::from(ring))
        }));
    }
    for ring in 0..20 {
        for k in 0..SIDES {
            let corner = |ring: u32, k: u32| ring * SIDES + k % SIDES;
            let [a, b] = [corner(ring, k), corner(ring, k + 1)];
            let [d, c] = [corner(ring + 1, k), corner(ring + 1, k + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Wall::from_surface(&mesh).unwrap()
}

/// Medium that is everywhere fades beyond an end over more than a diameter, and where half of it is left the vessel is
/// nearly as wide as before: it neither looks cut nor ends like a sharpened pencil.
#[test]
fn medium_in_all_blood_fades_beyond_an_end_and_does_not_taper_to_a_point() {
    let mut view = far(ViewSpec { views: vec![View::Fluoro], backend: Backend::Cpu, ..ViewSpec::default() });
    view.xray.contrast_fraction = 0.2;
    (view.c_arm.field_mm, view.c_arm.isocentre_mm) = (Some(60.0), Some([0.0, 0.0, 30.0]));
    let mut renderer = Renderer::of_wall(&view, &tube()).unwrap();
    let paths = renderer.path_lengths(&[]).unwrap();
    let arm = renderer.c_arm().unwrap().clone();
    let width = paths.width as usize;
    let row = |z: f64| {
        let row = arm.project(&Vec3::new(0.0, 0.0, z))[1] as usize;
        &paths.contrast_mm[row * width..][..width]
    };
    let on_axis = |z: f64| row(z)[arm.project(&Vec3::new(0.0, 0.0, z))[0] as usize];
    let inside = on_axis(20.0);
    assert!((inside / (0.2 * 4.0) - 1.0).abs() < 0.01, "{inside}");
    let beyond: Vec<(f64, f32)> =
        (0..140).map(|k| 40.0 + 0.1 * f64::from(k)).map(|z| (z, on_axis(z) / inside)).collect();
    let least = beyond.windows(2).map(|pair| pair[1].1 - pair[0].1).fold(0.0, f32::min);
    assert!(beyond.windows(2).all(|pair| pair[1].1 <= pair[0].1 + 1e-3) && least > -0.12, "{least}");
    let at = |share: f32| beyond.iter().find(|(_, left)| *left < share).unwrap().0;
    assert!(at(0.1) - at(0.9) > 4.0 && at(0.001) < 53.0, "{} {} {}", at(0.9), at(0.1), at(0.001));
    let wide = |z: f64| row(z).iter().filter(|mm| **mm > 0.25 * inside).count() as f64;
    let ratio = wide(at(0.5)) / wide(20.0);
    assert!(ratio > 0.65, "{ratio}");
}

/// Largest difference of the fraction between neighbours over the largest fraction, away from the edges of what vessels cover there.
fn largest_step(paths: &PathLengths) -> (f32, [usize; 2]) {
    const NEAR: usize = 3;
    let (width, height) = (paths.width as usize, paths.height as usize);
    let lumen = |x: usize, y: usize| paths.lumen_mm[y * width + x];
    let even = |x: usize, y: usize| {
        let about = (x - NEAR..=x + NEAR).flat_map(|i| (y - NEAR..=y + NEAR).map(move |j| lumen(i, j)));
        let (low, high) = about.fold((f32::MAX, 0.0_f32), |(l, h), mm| (l.min(mm), h.max(mm)));
        low > 0.75 * high && low > 0.0
    };
    let fraction = |x: usize, y: usize| paths.contrast_mm[y * width + x] / lumen(x, y);
    let (mut largest, mut most, mut place) = (0.0_f32, 0.0_f32, [0; 2]);
    for y in NEAR..height - NEAR - 1 {
        for x in NEAR..width - NEAR - 1 {
            if !even(x, y) {
                continue;
            }
            most = most.max(fraction(x, y));
            for (i, j) in [(x + 1, y), (x, y + 1)] {
                let step = (fraction(x, y) - fraction(i, j)).abs();
                if even(i, j) && step > largest {
                    (largest, place) = (step, [x, y]);
                }
            }
        }
    }
    (largest / most, place)
}

#[test]
fn the_open_field_has_the_same_greys_whether_or_not_medium_will_come() {
    // Before the injection, with and without blades.
    let wall = wall("arch");
    let mut spec = view("aortic_arch", 80.0, 0.0, injection(20.0, None));
    spec.size_px = [96, 96];
    (spec.c_arm.field_mm, spec.detector.noise) = (Some(380.0), false);
    spec.patient.torso = Some(TorsoSpec::default());
    let drawn = |blades: bool, injected: bool| {
        let mut spec = spec.clone();
        spec.c_arm.collimation_mm = blades.then_some([150.0; 2]);
        if !injected {
            spec.injection.clear();
        }
        let mut renderer = Renderer::of_wall(&spec, &wall).unwrap();
        let moment = FrameTime { frame: 0, time_s: 0.0 };
        renderer.render_at(&[], moment).unwrap().fluoro.unwrap()
    };
    for blades in [false, true] {
        let [with, without] = [true, false].map(|injected| drawn(blades, injected));
        let middle = |image: &Image| {
            let at = |k: u32| image.pixel(48 + k % 30 - 15, 48 + k / 30 - 15).unwrap()[0];
            let mut greys: Vec<u8> = (0..900).map(at).collect();
            greys.sort_unstable();
            [45, 450, 855].map(|place| greys[place])
        };
        let (a, b) = (middle(&with), middle(&without));
        assert!(a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 3), "{blades}: {a:?} {b:?}");
        assert!(a[0] > 20 && a[2] < 250 && a[2] > a[0] + 40, "{blades}: a picture: {a:?}");
    }
}
