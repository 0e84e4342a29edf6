//! Fluoroscopy, subtraction, roadmap and hold as sequences show them.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_core::vessel::{CentrelineNode, CentrelineTree};
use endowire_viewer::{
    Backend, CArmSpec, DetectorSpec, DevicePart, DeviceView, FrameTime, Image, InjectionSpec, Material, Mode,
    Renderer, TorsoSpec, ViewSpec,
};

/// A straight vessel along z with its centre line, blood rising; contrast medium from 1 s to 2 s.
fn scene(folder: &std::path::Path, mode: Mode) -> (ViewSpec, endowire_core::vessel::SurfaceMesh) {
    let node =
        |z: f64, parent| CentrelineNode { position_mm: Vec3::new(0.0, 0.0, z), radius_mm: 6.0, parent };
    let tree = CentrelineTree::new(vec![node(-50.0, None), node(0.0, Some(0)), node(50.0, Some(1))]).unwrap();
    let path = folder.join("tree.csv");
    tree.write(&path, "a straight vessel").unwrap();
    let mut view = spec(Backend::Cpu, 160, 0.8);
    view.xray.energy_kev = None;
    view.xray.mode = mode;
    view.detector = DetectorSpec { seed: 3, lag: 0.0, ..DetectorSpec::default() };
    view.flow.tree = Some(path);
    view.flow.inlet_mm = Some([0.0, 0.0, -50.0]);
    view.flow.inflow_ml_per_s = 20.0;
    view.flow.pulsatility = 0.0;
    view.injection =
        vec![InjectionSpec { start_s: 1.0, duration_s: 1.0, rate_ml_per_s: 8.0, at_mm: None, at_tip: false }];
    (view, cylinder(6.0, 50.0, 64, Vec3::zeros()))
}

fn wire() -> DeviceView {
    device(9, 0.45, |w| Vec3::new(2.0, 0.0, 60.0 * w - 48.0))
}

fn folder(name: &str) -> std::path::PathBuf {
    let path = std::env::temp_dir().join(format!("endowire-modes-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Mean grey value over a rectangle of pixels.
fn grey(image: &Image, x: std::ops::Range<u32>, y: std::ops::Range<u32>) -> f64 {
    let pixels = x.flat_map(|x| y.clone().map(move |y| (x, y)));
    let values: Vec<f64> = pixels.map(|(x, y)| f64::from(image.pixel(x, y).unwrap()[0])).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn at(frame: u64, time_s: f64) -> FrameTime {
    FrameTime { frame, time_s }
}

#[test]
fn subtracting_an_unchanged_scene_leaves_noise_around_zero() {
    let folder = folder("zero");
    let (mut view, wall) = scene(&folder, Mode::Dsa);
    view.xray.window = Some([-0.5, 0.5]);
    view.bits = 16;
    let wires = [wire()];
    let mean = |view: &ViewSpec, then: &[DeviceView], now: &[DeviceView]| {
        let mut renderer = Renderer::new(view, &wall).unwrap();
        renderer.take_mask(then).unwrap();
        let mut sum = 0.0;
        for k in 0..8 {
            let image = renderer.render_at(now, at(k, 0.0)).unwrap().fluoro.unwrap();
            let words = image.data().chunks_exact(2).map(|b| f64::from(u16::from_be_bytes([b[0], b[1]])));
            sum += words.map(|v| 0.5 - v / 65_535.0).sum::<f64>() / 8.0;
        }
        sum / f64::from(160 * 160)
    };
    // Noise of 1500 nGy is about 0.6 % a pixel: the mean of 25,600 pixels over the frames is known to 2e-5 beside the mask's own
    // noise, and the logarithm of noisy signals adds half their relative variance.
    let unchanged = mean(&view, &wires, &wires);
    assert!(unchanged.abs() < 2e-4, "{unchanged}");
    // The twin: a wire that was not there when the mask was taken.
    let changed = mean(&view, &[], &wires);
    assert!(changed > 1e-3, "{changed}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn contrast_medium_fills_the_vessel_from_the_inlet_and_washes_out() {
    let folder = folder("bolus");
    let (view, wall) = scene(&folder, Mode::Dsa);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    // 50 ml/s… 11.3 ml of vessel at 28 ml/s: 0.4 s from end to end. The inlet is at the foot, low on the screen.
    let low_and_high = |renderer: &mut Renderer, frame, time| {
        let image = renderer.render_at(&[], at(frame, time)).unwrap().fluoro.unwrap();
        let outside = grey(&image, 10..20, 40..120);
        [grey(&image, 76..84, 118..128), grey(&image, 76..84, 32..42)].map(|v| outside - v)
    };
    let [low, high] = low_and_high(&mut renderer, 0, 0.5);
    assert!(low.abs() < 3.0 && high.abs() < 3.0, "before: {low} {high}");
    let [low, high] = low_and_high(&mut renderer, 1, 1.15);
    assert!(low > 30.0 && high < 0.5 * low, "arriving: {low} {high}");
    let [low, high] = low_and_high(&mut renderer, 2, 1.8);
    assert!(low > 40.0 && high > 40.0, "filled: {low} {high}");
    let [low, high] = low_and_high(&mut renderer, 3, 2.25);
    assert!(low < 0.5 * high, "washing out: {low} {high}");
    let [low, high] = low_and_high(&mut renderer, 4, 4.0);
    assert!(low.abs() < 3.0 && high.abs() < 3.0, "after: {low} {high}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn medium_from_a_tip_goes_where_the_tip_was_whichever_frames_were_drawn() {
    let folder = folder("tip");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.injection[0].at_tip = true;
    // A tip that is pushed on while it injects.
    let tip_mm = |time_s: f64| Vec3::new(1.0, 0.0, -45.0 + 40.0 * (time_s - 1.0).clamp(0.0, 1.0));
    let wire = |time_s: f64| {
        let bore = DevicePart { inner_radius_mm: 0.3, ..DevicePart::default() };
        let line = |w: f64| tip_mm(time_s) - Vec3::z() * (10.0 * (1.0 - w));
        DeviceView { parts: vec![bore], ..device(9, 0.45, line) }
    };
    let steps = (0..=40).map(|k| 0.8 + 0.025 * f64::from(k));
    let end_s = 1.8;
    let filled =
        |renderer: &mut Renderer| renderer.path_lengths_at(&[wire(end_s)], end_s).unwrap().contrast_mm;
    let mut often = Renderer::new(&view, &wall).unwrap();
    for (k, time_s) in (0..).zip(steps.clone()) {
        often.render_at(&[wire(time_s)], at(k, time_s)).unwrap();
    }
    let drawn = filled(&mut often);
    let mut reported = Renderer::new(&view, &wall).unwrap();
    for time_s in steps.clone() {
        reported.follow_tip(time_s, tip_mm(time_s)).unwrap();
    }
    assert_eq!(filled(&mut reported), drawn);
    // Seen from another place and back.
    let place = endowire_viewer::CArmSpec { primary_deg: 20.0, ..view.c_arm.clone() };
    often.turn_c_arm(&place).unwrap();
    often.turn_c_arm(&view.c_arm).unwrap();
    assert_eq!(filled(&mut often), drawn);
    // Another run in the same room: its tip was there all the time.
    often.follow_tip(-1e3, tip_mm(end_s)).unwrap();
    let mut rests = Renderer::new(&view, &wall).unwrap();
    let rested = filled(&mut rests);
    assert_eq!(filled(&mut often), rested);
    // The twin: that is another picture.
    let apart = rested.iter().zip(&drawn).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart > 0.5, "{apart} mm");
    // Nothing comes through a wire without a bore.
    let solid = DeviceView { parts: vec![], ..wire(end_s) };
    let mut without = Renderer::new(&view, &wall).unwrap();
    let nothing = without.path_lengths_at(&[solid], end_s).unwrap().contrast_mm;
    assert!(nothing.iter().all(|mm| *mm == 0.0));
    assert!(often.follow_tip(f64::NAN, Vec3::zeros()).is_err());
    assert!(often.follow_tip(0.0, Vec3::repeat(f64::INFINITY)).is_err());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn bones_vanish_from_a_subtraction_of_one_energy_and_scatter_brings_them_back() {
    let folder = folder("bones");
    let (mut view, wall) = scene(&folder, Mode::Dsa);
    view.size_px = [96, 96];
    view.bits = 16;
    view.detector = DetectorSpec::ideal();
    view.xray.window = Some([-0.5, 1.5]);
    // Values along the filled vessel, in the body and in air.
    let values = |torso: Option<TorsoSpec>, energy: Option<f64>, scatter: f64| -> Vec<f64> {
        let mut view = view.clone();
        view.patient.torso = torso;
        view.xray.tissue_mm = 0.0;
        view.xray.energy_kev = energy;
        view.detector.scatter_fraction = scatter;
        let mut renderer = Renderer::new(&view, &wall).unwrap();
        let image = renderer.render_at(&[], at(0, 1.9)).unwrap().fluoro.unwrap();
        let value = |x, y| {
            let level = image.pixel(x, y).unwrap();
            1.5 - 2.0 * f64::from(u16::from_be_bytes([level[0], level[1]])) / 65_535.0
        };
        (45..51).flat_map(|x| (10..80).map(move |y| (x, y))).map(|(x, y)| value(x, y)).collect()
    };
    // Spine and ribs change the opacity of the vessel by so much of it.
    let left = |energy: Option<f64>, scatter: f64| {
        let [body, air] = [Some(TorsoSpec::default()), None].map(|torso| values(torso, energy, scatter));
        let ratios: Vec<f64> = body.iter().zip(&air).map(|(body, air)| body / air).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        (ratios.iter().map(|r| (r / mean - 1.0).powi(2)).sum::<f64>() / ratios.len() as f64).sqrt()
    };
    let [alone, hardened, scattered] =
        [(Some(60.0), 0.0), (None, 0.0), (Some(60.0), 0.3)].map(|(e, s)| left(e, s));
    eprintln!(
        "bones left of the opacity: {alone:.4} by one energy, {hardened:.4} by the spectrum, {scattered:.4} by scatter"
    );
    assert!(alone < 1e-3, "{alone}");
    assert!(hardened > 2.0 * alone && scattered > 5.0 * alone, "{alone} {hardened} {scattered}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn any_number_of_threads_draws_the_same_bits() {
    let folder = folder("threads");
    let (mut view, wall) = scene(&folder, Mode::Dsa);
    view.patient.torso = Some(TorsoSpec::default());
    view.detector.electronic_ngy = 1.0;
    view.bits = 16;
    let drawn = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut renderer = Renderer::new(&view, &wall).unwrap();
            let frames = [0.0, 1.5].map(|time| renderer.render_at(&[wire()], at(0, time)).unwrap());
            (frames, renderer.path_lengths_at(&[wire()], 1.5).unwrap())
        })
    };
    let one = drawn(1);
    assert!([2, 3, 8].into_iter().all(|threads| drawn(threads) == one));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_roadmap_has_white_vessels_and_a_dark_device() {
    let folder = folder("roadmap");
    let (view, wall) = scene(&folder, Mode::Roadmap);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let image = renderer.render_at(&[wire()], at(0, 0.0)).unwrap().fluoro.unwrap();
    let outside = grey(&image, 10..40, 40..120);
    let vessel = grey(&image, 72..78, 40..120);
    assert!(vessel > outside + 40.0, "{vessel} {outside}");
    let [u, _] = renderer.c_arm().unwrap().project(&Vec3::new(2.0, 0.0, -10.0));
    let wire = grey(&image, u as u32..u as u32 + 1, 90..120);
    assert!(wire < vessel - 25.0, "{wire} {vessel}");
    // Without an injection there is no map.
    let mut bare = view.clone();
    bare.injection.clear();
    let error = Renderer::new(&bare, &wall).unwrap().render(&[]).unwrap_err().to_string();
    assert!(error.contains("injection"), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn more_dose_is_less_noise_and_the_hold_is_calmer_than_its_frames() {
    let folder = folder("dose");
    let noise = |image: &Image| {
        let mean = grey(image, 5..45, 20..140);
        let squares = (5..45).flat_map(|x| (20..140).map(move |y| (x, y)));
        let sum: f64 = squares.map(|(x, y)| (f64::from(image.pixel(x, y).unwrap()[0]) - mean).powi(2)).sum();
        (sum / 4800.0).sqrt()
    };
    let deviation = |mode: Mode| {
        let (mut view, wall) = scene(&folder, mode);
        view.injection.clear();
        view.xray.window = Some([4.0, 5.5]);
        view.xray.tissue_mm = 200.0;
        let mut renderer = Renderer::new(&view, &wall).unwrap();
        let mut last = None;
        for k in 0..12 {
            last = renderer.render_at(&[], at(k, 0.0)).unwrap().fluoro;
        }
        (noise(&last.unwrap()), noise(&renderer.last_image_hold().unwrap()))
    };
    let (fluoro, hold) = deviation(Mode::Fluoro);
    let (cine, _) = deviation(Mode::Cine);
    // Ten times the dose: a third of the noise, beside the steps of eight bits and the background's shading.
    assert!(cine < 0.5 * fluoro && hold < 0.7 * fluoro, "fluoro {fluoro}, hold {hold}, cine {cine}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_same_seed_is_the_same_frame_whatever_came_before() {
    let folder = folder("seed");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    // Nothing remembers the frame before.
    (view.detector.lag, view.xray.brightness_s) = (0.0, 0.0);
    let draw = |view: &ViewSpec, frames: &[u64]| {
        let mut renderer = Renderer::new(view, &wall).unwrap();
        let mut last = None;
        for &k in frames {
            last = renderer.render_at(&[wire()], at(k, 1.5)).unwrap().fluoro;
        }
        last.unwrap()
    };
    assert_eq!(draw(&view, &[7]), draw(&view, &[1, 2, 7]));
    assert_ne!(draw(&view, &[7]), draw(&view, &[8]));
    let mut other = view.clone();
    other.detector.seed = 4;
    assert_ne!(draw(&view, &[7]), draw(&other, &[7]));
    // On an adapter the lengths differ in the seventh digit, the noise does not.
    if let Some(mut gpu) = on_gpu(&view, &wall) {
        let a = draw(&view, &[7]);
        let b = gpu.render_at(&[wire()], at(7, 1.5)).unwrap().fluoro.unwrap();
        let off = a.data().iter().zip(b.data()).filter(|(a, b)| a.abs_diff(**b) > 2).count();
        assert!(off * 500 < a.data().len(), "{off} pixels differ by more than two levels");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn an_injection_without_a_centre_line_and_a_missing_tomogram_are_refused_by_key() {
    let folder = folder("refused");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.flow.tree = None;
    let error = Renderer::new(&view, &wall).unwrap_err().to_string();
    assert!(error.contains("view.flow.tree"), "{error}");
    view.flow.tree = Some(folder.join("nothing.csv"));
    let error = Renderer::new(&view, &wall).unwrap_err().to_string();
    assert!(error.contains("view.flow.tree") && error.contains("nothing.csv"), "{error}");
    view.injection.clear();
    view.patient.ct = Some(endowire_viewer::CtSpec { file: folder.join("nothing.nii"), offset_mm: [0.0; 3] });
    let error = Renderer::new(&view, &wall).unwrap_err().to_string();
    assert!(error.contains("view.patient.ct.file"), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn path_lengths_know_the_contrast_medium_of_a_moment_and_add_up() {
    let folder = folder("raw");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.xray.energy_kev = Some(60.0);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let before = renderer.path_lengths(&[wire()]).unwrap();
    assert!(before.contrast_mm.is_empty());
    let paths = renderer.path_lengths_at(&[wire()], 1.9).unwrap();
    let injected: f32 = paths.contrast_mm.iter().sum();
    assert!(injected > 100.0, "{injected}");
    let line: Vec<f64> = renderer.transmission(&paths).unwrap().iter().map(|t| -f64::from(*t).ln()).collect();
    let mu = |material: Material| material.attenuation_per_mm(60.0).unwrap();
    let sum = |i: usize| {
        let devices: f64 = paths.devices_mm.iter().map(|(m, map)| mu(*m) * f64::from(map[i])).sum();
        let inside: f64 = paths.devices_mm.iter().map(|map| f64::from(map.1[i])).sum();
        let [body, lumen, contrast] =
            [paths.body_mm[i], paths.lumen_mm[i], paths.contrast_mm[i]].map(f64::from);
        mu(Material::SoftTissue) * (body - lumen).max(0.0)
            + mu(Material::Blood) * (lumen - inside - contrast)
            + mu(Material::Contrast370) * contrast
            + devices
    };
    for (i, line) in line.iter().enumerate() {
        assert!((line - sum(i)).abs() < 1e-5 * sum(i).max(1.0), "{i}: {line} {}", sum(i));
    }
    // The twin: without the medium the sum is another.
    let without = renderer.transmission(&before).unwrap();
    let most = without.iter().zip(&line).map(|(t, line)| line + f64::from(*t).ln()).fold(0.0, f64::max);
    assert!(most > 0.05, "{most}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn contrast_medium_is_not_saturated_in_live_pictures() {
    let folder = folder("saturated");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.detector = DetectorSpec::ideal();
    let black = |view: &ViewSpec| {
        let mut renderer = Renderer::new(view, &wall).unwrap();
        let image = renderer.render_at(&[], at(0, 1.9)).unwrap().fluoro.unwrap();
        let vessel = (74..86).flat_map(|x| (20..140).map(move |y| (x, y)));
        vessel.filter(|&(x, y)| image.pixel(x, y).unwrap()[0] == 0).count()
    };
    let left_alone = black(&view);
    assert!(left_alone < 12 * 120 / 10, "{left_alone}");
    // The twin: a window as wide as one for this slab alone, 0.12 below and 0.4 above what it attenuates.
    view.xray.harmonised = 0.0;
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let paths = renderer.path_lengths(&[]).unwrap();
    let slab = -f64::from(renderer.transmission(&paths).unwrap()[0]).ln();
    view.xray.window = Some([slab - 0.12, slab + 0.4]);
    assert!(black(&view) > 12 * 120 / 2, "{}", black(&view));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn labels_say_where_the_device_is_in_the_frame() {
    let folder = folder("labels");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.c_arm.collimation_mm = Some([128.0, 60.0]);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let places = [Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 0.0, 45.0)];
    let labels = renderer.labels(&[wire()], &places).unwrap();
    let tip = renderer.c_arm().unwrap().project(&Vec3::new(2.0, 0.0, 12.0));
    let label = &labels.devices[0];
    let off = |a: [f64; 2], b: [f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    assert!(off(label.tip_px.unwrap(), tip) < 1e-9 && label.tip_visible);
    assert!(labels.contacts[0].visible && !labels.contacts[1].visible, "the blades hide the second");
    // The mask is the wire: its columns are within the wire's width of the centre line.
    let marked: Vec<usize> = (0..labels.mask.data().len()).filter(|&i| labels.mask.data()[i] == 1).collect();
    assert!(marked.len() > 50);
    for i in marked {
        let pixel = pixel_centre(i, 160);
        let nearest = label.centre_line_px.windows(2).map(|p| {
            let w = ((pixel[1] - p[0][1]) / (p[1][1] - p[0][1])).clamp(0.0, 1.0);
            off(pixel, [p[0][0] + w * (p[1][0] - p[0][0]), p[0][1] + w * (p[1][1] - p[0][1])])
        });
        assert!(nearest.fold(f64::MAX, f64::min) < 1.8, "{pixel:?}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_subtraction_that_turns_is_even_though_the_detector_remembers_the_angle_before() {
    let folder = folder("turn");
    let (mut view, wall) = scene(&folder, Mode::Dsa);
    view.patient.torso = Some(TorsoSpec::default());
    view.c_arm.pixel_mm = Some(1.6);
    view.detector = DetectorSpec { lag: 0.3, ..DetectorSpec::ideal() };
    view.xray.window = Some([-0.5, 0.5]);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let mut spread = |turn_deg: Option<f64>| {
        if let Some(turn_deg) = turn_deg {
            renderer.turn_c_arm(&view.c_arm.turned(turn_deg)).unwrap();
        }
        let image = renderer.render_at(&[wire()], at(0, 0.0)).unwrap().fluoro.unwrap();
        let [low, high] =
            [image.data().iter().min(), image.data().iter().max()].map(|v| i32::from(*v.unwrap()));
        high - low
    };
    let turning = [None, Some(10.0), Some(20.0)].map(&mut spread);
    assert!(turning.iter().all(|levels| *levels <= 1), "{turning:?}");
    // The twin: an arm that stops, whose mask is one of an arm that turned.
    let stopped = spread(None);
    assert!(stopped > 10, "{stopped}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_view_that_changes_is_one_that_is_new() {
    let folder = folder("change");
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.patient.torso = Some(TorsoSpec::default());
    view.c_arm.pixel_mm = Some(1.6);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let mut beside = renderer.beside(&view).unwrap();
    let frame = |renderer: &mut Renderer| renderer.render_at(&[wire()], at(3, 0.9)).unwrap().fluoro.unwrap();
    let mut before = frame(&mut renderer);
    let medium = view.injection.clone();
    let changes: [&dyn Fn(&mut ViewSpec); 10] = [
        &|view| view.c_arm.collimation_mm = Some([60.0, 80.0]),
        &|view| view.xray.mode = Mode::Dsa,
        &|view| view.injection.push(InjectionSpec { start_s: 0.5, ..medium[0].clone() }),
        &|view| view.xray.mode = Mode::Roadmap,
        &|view| {
            view.c_arm.primary_deg += 20.0;
            view.xray.mode = Mode::Cine;
        },
        &|view| view.injection.clear(),
        &|view| view.flow.inflow_ml_per_s *= 2.0,
        &|view| view.injection.clone_from(&medium),
        &|view| view.patient.torso = None,
        &|view| view.size_px = [96, 64],
    ];
    for (number, change) in changes.iter().enumerate() {
        change(&mut view);
        renderer.change(&view).unwrap();
        beside = beside.beside(&view).unwrap();
        let now = frame(&mut renderer);
        let new = Renderer::new(&view, &wall).and_then(|mut new| new.prepare().map(|()| new));
        assert!(now == frame(&mut new.unwrap()), "change {number}");
        assert!(now == frame(&mut beside), "beside {number}");
        // The twin: without the change it was another picture, but for a flow that carries nothing, and for medium that
        // has not come yet.
        assert!(now != before || number == 6 || number == 7, "change {number} shows nothing");
        before = now;
    }
    // What cannot be drawn changes nothing.
    let bad = ViewSpec { frames_per_s: -1.0, ..view.clone() };
    assert!(renderer.change(&bad).is_err());
    assert!(renderer.spec() == &view && frame(&mut renderer).width() == 96);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_blades_close_is_black_in_every_mode_and_what_they_leave_is_not() {
    let folder = folder("blades");
    let opening = [48.0, 64.0];
    for mode in [Mode::Fluoro, Mode::Cine, Mode::Dsa, Mode::Roadmap] {
        let (mut view, wall) = scene(&folder, mode);
        view.patient.torso = Some(TorsoSpec::default());
        view.detector = DetectorSpec::ideal();
        let frame = |view: &ViewSpec| {
            let mut renderer = Renderer::new(view, &wall).unwrap();
            let image = renderer.render_at(&[wire()], at(0, 1.9)).unwrap().fluoro.unwrap();
            (image, renderer.last_image_hold().unwrap())
        };
        view.c_arm.collimation_mm = Some(opening);
        let (closed, hold) = frame(&view);
        // Half widths in pixels, with the blades' own pixel left out.
        let [across, down] = opening.map(|mm| (mm / 0.8 / 2.0) as i32);
        let mut open = vec![];
        for (x, y) in (0..160).flat_map(|x| (0..160).map(move |y| (x, y))) {
            let [from_x, from_y] = [x, y].map(|i: u32| (2 * i as i32 + 1 - 160).abs() / 2);
            let of = |image: &Image| image.pixel(x, y).unwrap()[0];
            if from_x < across - 1 && from_y < down - 1 {
                open.push(of(&closed));
            } else if from_x > across + 1 || from_y > down + 1 {
                assert_eq!([of(&closed), of(&hold)], [0; 2], "{mode:?} {x} {y}");
            }
        }
        assert!(open.iter().filter(|grey| **grey > 5).count() * 2 > open.len(), "{mode:?}");
        // The noise of a detector behind blades is not shown either.
        view.detector = DetectorSpec { lag: 0.0, ..DetectorSpec::default() };
        let (noisy, _) = frame(&view);
        let corner = (0..20).flat_map(|x| (0..20).map(move |y| (x, y)));
        assert!(corner.into_iter().all(|(x, y)| noisy.pixel(x, y).unwrap()[0] == 0), "{mode:?}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn medium_and_blades_brighten_a_live_picture_over_some_frames() {
    let folder = folder("brightness");
    // Grey of a corner that medium does not reach, and of what blades leave, at some times.
    let greys = |constant_s: f64, mode: Mode, per_s: u32| {
        let (mut view, wall) = scene(&folder, mode);
        view.detector = DetectorSpec::ideal();
        view.xray.brightness_s = constant_s;
        view.injection[0].rate_ml_per_s = 20.0;
        view.injection[0].duration_s = 10.0;
        view.frames_per_s = f64::from(per_s);
        let mut renderer = Renderer::new(&view, &wall).unwrap();
        let frame = |k: u32| (0.5 + f64::from(k) / f64::from(per_s), u64::from(k));
        let drawn = (0..=4 * per_s).map(frame).map(|(time_s, number)| {
            let image = renderer.render_at(&[], at(number, time_s)).unwrap().fluoro.unwrap();
            grey(&image, 10..20, 40..120)
        });
        drawn.collect::<Vec<f64>>()
    };
    let live = greys(0.3, Mode::Fluoro, 15);
    let [before, after] = [live[0], live[live.len() - 1]];
    assert!(after > before + 3.0, "{before} {after}");
    // Over some frames, and by as much at another rate.
    assert!(live.windows(2).all(|pair| pair[1] - pair[0] < 0.4 * (after - before)), "{live:?}");
    let slower = greys(0.3, Mode::Fluoro, 5);
    assert!((slower[slower.len() - 1] - after).abs() < 1.5, "{after} {slower:?}");
    // The twins: exposure that is held, and a subtraction, which needs that of its mask.
    for held in [greys(0.0, Mode::Fluoro, 15), greys(0.3, Mode::Dsa, 15)] {
        assert!((held[held.len() - 1] - held[0]).abs() < 1.0, "{held:?}");
    }

    // Blades that leave the denser middle of a body: dark at first, then as if they had always been there.
    let (mut view, wall) = scene(&folder, Mode::Fluoro);
    view.detector = DetectorSpec::ideal();
    view.xray.brightness_s = 0.3;
    view.patient.torso = Some(TorsoSpec { breath_mm: Some(0.0), beat_mm: Some(0.0), ..TorsoSpec::default() });
    view.c_arm.pixel_mm = Some(2.4);
    let narrow = ViewSpec {
        c_arm: CArmSpec { collimation_mm: Some([60.0, 120.0]), ..view.c_arm.clone() },
        ..view.clone()
    };
    let mean = |renderer: &mut Renderer, k: u32| {
        let frame = at(u64::from(k), f64::from(k) / 15.0 - 5.0);
        grey(&renderer.render_at(&[], frame).unwrap().fluoro.unwrap(), 75..85, 70..90)
    };
    let settled = mean(&mut Renderer::new(&narrow, &wall).unwrap(), 0);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    mean(&mut renderer, 0);
    renderer.turn_c_arm(&narrow.c_arm).unwrap();
    let closing: Vec<f64> = (1..=30).map(|k| mean(&mut renderer, k)).collect();
    assert!(closing[0] < settled - 5.0, "{settled} {closing:?}");
    assert!(closing.windows(2).all(|pair| pair[1] >= pair[0]), "{closing:?}");
    assert!((closing[29] - settled).abs() < 1.0, "{settled} {closing:?}");
    // A view that goes on from the brightness of another is as one that has moved there.
    let mut other = Renderer::new(&view, &wall).unwrap();
    mean(&mut other, 0);
    let state = other.brightness().unwrap();
    other.change(&narrow).unwrap();
    other.brighten(state).unwrap();
    assert_eq!(mean(&mut other, 1), closing[0]);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_body_beside_a_vessel_that_moves_has_no_motion_of_its_own() {
    let of = |moves: bool, breath_mm: Option<f64>, beat_mm: Option<f64>| {
        let mut view = ViewSpec::default();
        view.patient.vessel_moves = moves;
        view.patient.torso = Some(TorsoSpec { breath_mm, beat_mm, ..TorsoSpec::default() });
        view.validate().map_err(|error| error.to_string())
    };
    for (key, breath_mm, beat_mm) in [("breath_mm = 9", Some(9.0), None), ("beat_mm = 3", None, Some(3.0))] {
        let error = of(true, breath_mm, beat_mm).unwrap_err();
        assert!(error.contains(key) && error.contains("[[vessel.motion]]"), "{error}");
        // The twins: a vessel that rests, and a body that does.
        assert!(of(false, breath_mm, beat_mm).is_ok());
    }
    assert!(of(true, None, None).is_ok() && of(true, Some(0.0), Some(0.0)).is_ok());
}
