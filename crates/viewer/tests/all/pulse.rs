//! A pulse of X-rays while a device moves, and its exposure.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use endowire_viewer::{
    Backend, CArmSpec, DetectorSpec, DeviceView, ExposureSpec, FrameTime, Mode, Renderer, TorsoSpec, View,
    ViewSpec,
};

const WINDOW: [f64; 2] = [-2.0, 12.0];

/// Line integrals without noise and blur, in 16 bits.
fn view() -> ViewSpec {
    let mut view = spec(Backend::Cpu, 96, 0.4);
    view.xray.energy_kev = None;
    (view.xray.window, view.xray.harmonised) = (Some(WINDOW), 0.0);
    view.detector = DetectorSpec::ideal();
    view.bits = 16;
    view
}

fn wall() -> SurfaceMesh {
    cylinder(12.0, 30.0, 64, Vec3::zeros())
}

/// A steel wire across the picture, so much aside.
fn wire(lateral_mm: f64) -> DeviceView {
    device(9, 0.9, |w| Vec3::new(lateral_mm, 0.0, 40.0 * w - 20.0))
}

fn line_integrals(renderer: &mut Renderer, pulse: &[Vec<DeviceView>]) -> Vec<f64> {
    let frames = renderer.render_pulse(&[wire(0.0)], pulse, FrameTime::default()).unwrap();
    let image = frames.fluoro.unwrap();
    let words = image.data().chunks_exact(2).map(|b| f64::from(u16::from_be_bytes([b[0], b[1]])));
    words.map(|word| WINDOW[1] - (WINDOW[1] - WINDOW[0]) * word / 65_535.0).collect()
}

#[test]
fn a_pulse_is_the_mean_of_signals_and_not_that_of_line_integrals() {
    let mut renderer = Renderer::new(&view(), &wall()).unwrap();
    // Pixels of 0.4 mm at the detector are 0.27 mm at the wire: four of them in eight parts.
    let asides: Vec<f64> = (0..8).map(|k| 1.1 * (f64::from(k) + 0.5) / 8.0).collect();
    let pulse: Vec<_> = asides.iter().map(|lateral| vec![wire(*lateral)]).collect();
    let swept = line_integrals(&mut renderer, &pulse);
    let instants: Vec<_> =
        pulse.iter().map(|i| line_integrals(&mut renderer, std::slice::from_ref(i))).collect();
    let worst = |of: &dyn Fn(&[f64]) -> f64| {
        let at = |pixel: usize| instants.iter().map(|instant| instant[pixel]).collect::<Vec<f64>>();
        (0..swept.len()).map(|pixel| (of(&at(pixel)) - swept[pixel]).abs()).fold(0.0, f64::max)
    };
    let signals = worst(&|p| -(p.iter().map(|p| (-p).exp()).sum::<f64>() / p.len() as f64).ln());
    let steps = (WINDOW[1] - WINDOW[0]) / 65_535.0;
    assert!(signals < 1.01 * steps, "{signals}, and a step of 16 bits is {steps}");
    // The twin: line integrals averaged.
    let integrals = worst(&|p| p.iter().sum::<f64>() / p.len() as f64);
    assert!(integrals > 0.02, "{integrals}");
    eprintln!("mean of signals within {signals:.1e}, mean of line integrals off by {integrals:.2}");
    // Half a pixel from part to part is fine enough: eight times as many parts change little of what one instant in place of all does.
    let fine: Vec<_> = (0..64).map(|k| vec![wire(1.1 * (f64::from(k) + 0.5) / 64.0)]).collect();
    let fine = line_integrals(&mut renderer, &fine);
    let off = |picture: &[f64]| picture.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let still = line_integrals(&mut renderer, &[vec![wire(0.55)]]);
    eprintln!("eight parts are off by {:.3}, one by {:.3}", off(&swept), off(&still));
    assert!(off(&swept) < 0.1 * off(&still), "{} {}", off(&swept), off(&still));
}

/// Mean signal of the middle ninth over that which the dose stands for, by the line integrals of a picture.
#[test]
fn exposure_control_holds_the_dose_in_the_middle_of_phantoms_and_bodies() {
    let of = |tissue_mm: f64, torso: Option<TorsoSpec>, pose: &str| {
        let mut view =
            ViewSpec { views: vec![View::Fluoro], exposure: Some(ExposureSpec::default()), ..view() };
        view.size_px = [96, 96];
        view.c_arm =
            CArmSpec { pose: Some(pose.parse().unwrap()), field_mm: Some(250.0), ..CArmSpec::default() };
        (view.xray.mode, view.xray.pulse_ms, view.xray.tissue_mm) = (Mode::Cine, 8.0, tissue_mm);
        view.patient.torso = torso;
        let mut renderer = Renderer::new(&view, &wall()).unwrap();
        renderer.render(&[]).unwrap();
        let exposure = renderer.exposure().unwrap();
        let lengths = renderer.path_lengths(&[]).unwrap();
        let left = renderer.transmission(&lengths).unwrap();
        // What as much tissue lets through, in the same beam.
        let mut slab = lengths.clone();
        for map in [&mut slab.bone_mm, &mut slab.lung_mm, &mut slab.lumen_mm, &mut slab.contrast_mm] {
            map.iter_mut().for_each(|mm| *mm = 0.0);
        }
        slab.body_mm.iter_mut().for_each(|mm| *mm = exposure.tissue_mm as f32);
        let behind = f64::from(renderer.transmission(&slab).unwrap()[0]);
        let middle = (32..64).flat_map(|y| (32..64).map(move |x| y * 96 + x));
        let mean = middle.map(|i| f64::from(left[i])).sum::<f64>() / 1024.0;
        (exposure, exposure.dose_ngy * mean / behind)
    };
    for tissue_mm in [80.0, 200.0, 300.0] {
        let (exposure, ngy) = of(tissue_mm, None, "AP");
        eprintln!("{tissue_mm} mm: {ngy:.1} nGy, {exposure:?}");
        assert!((ngy / 300.0 - 1.0).abs() < 0.02, "{tissue_mm} mm: {ngy} nGy, {exposure:?}");
    }
    for pose in ["AP", "RAO 30", "LAO 60", "CRA 30"] {
        let (exposure, ngy) = of(0.0, Some(TorsoSpec::default()), pose);
        eprintln!("{pose}: {ngy:.1} nGy, {exposure:?}");
        assert!((ngy / 300.0 - 1.0).abs() < 0.05, "{pose}: {ngy} nGy, {exposure:?}");
    }
    // The twin: beyond the limits of the tube the dose falls, and this is reported.
    let (exposure, ngy) = of(450.0, None, "AP");
    assert!(exposure.dose_ngy < 200.0 && ngy < 200.0 && exposure.kvp == 125.0, "{exposure:?}");
}
