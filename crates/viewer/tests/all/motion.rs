//! A vessel that moves in front of a C-arm that stands.

use crate::common;

use common::*;
use endowire_core::Vec3;
use endowire_core::vessel::motion::{Around, MotionMode, VesselMotion, Waveform};
use endowire_core::vessel::{Displacement, SurfaceMesh};
use endowire_viewer::{Backend, CtSpec, DetectorSpec, FrameTime, Mode, Renderer, TorsoSpec, View, ViewSpec};

/// By so much all the time, of all of the vessel or of a part.
fn steady(displacement_mm: [f64; 3], within: Option<Around>) -> Displacement {
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
}

/// 5 mm along x, of the upper half alone.
fn displacement() -> Displacement {
    let within = Around { centre_mm: [0.0, 0.0, 60.0], radius_mm: 20.0, fade_mm: 30.0 };
    steady([5.0, 0.0, 0.0], Some(within))
}

fn vessel() -> SurfaceMesh {
    let profile: Vec<(f64, f64)> = std::iter::once((0.0, -50.0))
        .chain((0..=100).map(|k| (6.0, f64::from(k) - 50.0)))
        .chain([(0.0, 50.0)])
        .collect();
    revolved(&profile, 64, Vec3::zeros())
}

fn view(mode: Mode) -> ViewSpec {
    let mut view = spec(Backend::Cpu, 160, 0.8);
    view.views = vec![View::ThreeD, View::Fluoro];
    view.xray.energy_kev = None;
    view.xray.mode = mode;
    view.xray.contrast_fraction = 0.2;
    // The place of the C-arm is that of the vessel at rest, whatever its bounds are.
    view.c_arm.isocentre_mm = Some([0.0; 3]);
    view.detector = DetectorSpec { noise: false, lag: 0.0, ..DetectorSpec::default() };
    // Nor is there anything else that remembers the frame before.
    view.xray.brightness_s = 0.0;
    view
}

#[test]
fn the_beam_meets_the_vessel_where_it_is_and_back_at_rest_all_is_as_before() {
    let (moved, wall) = (displacement(), vessel());
    let mut elsewhere = wall.clone();
    elsewhere.vertices_mm.iter_mut().for_each(|v| *v = moved.place(v));
    let view = view(Mode::Fluoro);
    let mut renderer = Renderer::new(&view, &wall).unwrap();
    let at = |frame: u64| FrameTime { frame, time_s: 0.0 };
    let (rest, first) = (renderer.path_lengths(&[]).unwrap(), renderer.render_at(&[], at(0)).unwrap());
    renderer.move_vessel(Some(&moved)).unwrap();
    let now = renderer.path_lengths(&[]).unwrap();
    let there = Renderer::new(&view, &elsewhere).unwrap().path_lengths(&[]).unwrap();
    assert_eq!(now.lumen_mm, there.lumen_mm);
    // The twin: at rest they are others.
    let apart = now.lumen_mm.iter().zip(&rest.lumen_mm).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart > 5.0, "{apart}");
    let frames = renderer.render_at(&[], at(1)).unwrap();
    assert_ne!(frames.three_d, first.three_d);
    assert_ne!(frames.fluoro, first.fluoro);
    renderer.move_vessel(None).unwrap();
    assert_eq!(renderer.path_lengths(&[]).unwrap().lumen_mm, rest.lumen_mm);
    assert_eq!(renderer.render_at(&[], at(0)).unwrap(), first);
}

#[test]
fn a_subtraction_shows_by_how_much_the_vessel_is_elsewhere_than_in_its_mask() {
    let mut view = view(Mode::Dsa);
    view.xray.window = Some([-1.0, 1.0]);
    let mut renderer = Renderer::new(&view, &vessel()).unwrap();
    let off = |renderer: &mut Renderer, rows: std::ops::Range<u32>, frame: u64| {
        let image = renderer.render_at(&[], FrameTime { frame, time_s: 0.0 }).unwrap().fluoro.unwrap();
        let grey = |x: u32, y: u32| f64::from(image.pixel(x, y).unwrap()[0]);
        let background = grey(5, 5);
        let pixels = rows.flat_map(|y| (0..160).map(move |x| (x, y)));
        pixels.map(|(x, y)| (grey(x, y) - background).abs()).fold(0.0, f64::max)
    };
    assert!(off(&mut renderer, 20..140, 0) <= 2.0);
    renderer.move_vessel(Some(&displacement())).unwrap();
    // Half of it has stayed.
    let [upper, lower] = [off(&mut renderer, 20..60, 1), off(&mut renderer, 100..140, 2)];
    assert!(upper > 20.0 && lower <= 2.0, "{upper} {lower}");
    renderer.take_mask(&[]).unwrap();
    assert!(off(&mut renderer, 20..140, 3) <= 2.0);
}

#[test]
fn the_air_of_a_body_goes_with_its_vessel_and_bones_and_skin_stay() {
    let mut view = view(Mode::Fluoro);
    // The domes of the diaphragm lie in the middle of what moves.
    view.patient.torso = Some(TorsoSpec { diaphragm_mm: Some(60.0), ..TorsoSpec::default() });
    view.c_arm.isocentre_mm = Some([0.0, 0.0, 60.0]);
    let breath = steady([0.0, 0.0, -10.0], None);
    let mut renderer = Renderer::new(&view, &vessel()).unwrap();
    let rest = renderer.path_lengths(&[]).unwrap();
    let still = renderer.render_at(&[], FrameTime { frame: 0, time_s: 0.0 }).unwrap().fluoro.unwrap();
    renderer.move_vessel(Some(&breath)).unwrap();
    let now = renderer.path_lengths(&[]).unwrap();
    assert_eq!(now.bone_mm, rest.bone_mm);
    assert_eq!(now.body_mm, rest.body_mm);
    // Lungs come down: there is more air in the picture, and a diaphragm where none was.
    let air = |of: &[f32]| of.iter().map(|&mm| f64::from(mm)).sum::<f64>();
    assert!(air(&now.lung_mm) > 1.02 * air(&rest.lung_mm), "{} {}", air(&now.lung_mm), air(&rest.lung_mm));
    // By as much as 10 mm at the isocentre, but for the beam's spread over the depth of a dome.
    let lowest = |of: &[f32]| (0..160).rposition(|y| of[y * 160 + 30] > 5.0).unwrap() as f64;
    let c_arm = renderer.c_arm().unwrap();
    let [from, to] = [60.0, 50.0].map(|z| c_arm.project(&Vec3::new(0.0, 0.0, z))[1]);
    let shift = lowest(&now.lung_mm) - lowest(&rest.lung_mm);
    assert!((shift - (to - from)).abs() < 2.0, "{shift} {}", to - from);
    let moved = renderer.render_at(&[], FrameTime { frame: 0, time_s: 0.0 }).unwrap().fluoro.unwrap();
    assert_ne!(still, moved);
    // Its picture is that of the moved surfaces, whether they moved before or after the first frame.
    let mut fresh = Renderer::new(&view, &vessel()).unwrap();
    fresh.move_vessel(Some(&breath)).unwrap();
    assert_eq!(fresh.path_lengths(&[]).unwrap().lung_mm, now.lung_mm);
    renderer.move_vessel(None).unwrap();
    assert_eq!(renderer.path_lengths(&[]).unwrap().lung_mm, rest.lung_mm);
}

#[test]
fn a_body_breathes_in_live_pictures_by_as_much_as_it_is_told_and_rests_in_subtractions_and_when_held() {
    let renderer = |mode: Mode, breath_mm: f64| {
        let mut view = view(mode);
        view.patient.torso = Some(TorsoSpec {
            diaphragm_mm: Some(60.0),
            breath_mm: Some(breath_mm),
            beat_mm: Some(0.0),
            ..TorsoSpec::default()
        });
        view.c_arm.isocentre_mm = Some([0.0, 0.0, 60.0]);
        Renderer::new(&view, &vessel()).unwrap()
    };
    let picture = |renderer: &mut Renderer, time_s: f64| {
        renderer.render_at(&[], FrameTime { frame: 0, time_s }).unwrap().fluoro.unwrap()
    };
    // A breath of four seconds is in at two.
    let mut live = renderer(Mode::Fluoro, 10.0);
    let [rest, now] = [0.0, 2.0].map(|time_s| live.path_lengths_at(&[], time_s).unwrap());
    assert_eq!((&now.bone_mm, &now.body_mm), (&rest.bone_mm, &rest.body_mm));
    let lowest = |of: &[f32]| (0..160).rposition(|y| of[y * 160 + 30] > 5.0).unwrap() as f64;
    let c_arm = live.c_arm().unwrap();
    let [from, to] = [60.0, 50.0].map(|z| c_arm.project(&Vec3::new(0.0, 0.0, z))[1]);
    let shift = lowest(&now.lung_mm) - lowest(&rest.lung_mm);
    assert!((shift - (to - from)).abs() < 2.0, "{shift} {}", to - from);
    assert_ne!(picture(&mut live, 2.0), picture(&mut live, 0.0));
    assert_eq!(live.path_lengths_at(&[], 4.0).unwrap().lung_mm, rest.lung_mm);
    // Counter-checks.
    let mut held = renderer(Mode::Fluoro, 0.0);
    assert_eq!(held.path_lengths_at(&[], 2.0).unwrap().lung_mm, rest.lung_mm);
    let mut subtracted = renderer(Mode::Dsa, 10.0);
    assert_eq!(subtracted.path_lengths_at(&[], 2.0).unwrap().lung_mm, rest.lung_mm);
}

/// A NIfTI-1 file of 40³ voxels of 4 mm about the origin: a ball of water with a core of bone, in air.
fn ball_of_water(path: &std::path::Path) {
    let mut bytes = vec![0_u8; 352];
    let mut put = |at: usize, data: &[u8]| bytes[at..at + data.len()].copy_from_slice(data);
    put(0, &348_i32.to_le_bytes());
    [3_i16, 40, 40, 40, 1, 1, 1, 1].iter().enumerate().for_each(|(k, n)| put(40 + 2 * k, &n.to_le_bytes()));
    put(70, &16_i16.to_le_bytes());
    put(72, &32_i16.to_le_bytes());
    (0..4).for_each(|k| put(76 + 4 * k, &4_f32.to_le_bytes()));
    put(108, &352_f32.to_le_bytes());
    put(123, &[2]);
    put(254, &1_i16.to_le_bytes());
    for k in 0..3 {
        put(280 + 20 * k, &4_f32.to_le_bytes());
        put(292 + 16 * k, &(-78_f32).to_le_bytes());
    }
    put(344, b"n+1\0");
    let hu = |n: usize| {
        let at = [n % 40, n / 40 % 40, n / 1600].map(|k| 4.0 * k as f32 - 78.0);
        let radius = at.iter().map(|x| x * x).sum::<f32>().sqrt();
        if radius < 8.0 { 1790.0_f32 } else { -1000.0 * ((radius - 28.0) / 4.0 + 0.5).clamp(0.0, 1.0) }
    };
    bytes.extend((0..40 * 40 * 40).flat_map(|n| hu(n).to_le_bytes()));
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn the_tissue_of_a_tomogram_goes_with_its_vessel_and_bone_stays() {
    let file = std::env::temp_dir().join(format!("endowire-moving-{}.nii", std::process::id()));
    ball_of_water(&file);
    let mut view = view(Mode::Fluoro);
    view.patient.ct = Some(CtSpec { file: file.clone(), offset_mm: [0.0; 3] });
    let mut renderer = Renderer::new(&view, &vessel()).unwrap();
    let rest = renderer.path_lengths(&[]).unwrap();
    // Five millimetres to the left of the patient.
    let moved = steady([5.0, 0.0, 0.0], None);
    renderer.move_vessel(Some(&moved)).unwrap();
    let now = renderer.path_lengths(&[]).unwrap();
    assert_eq!(now.bone_mm, rest.bone_mm);
    // It is the picture at rest, shifted.
    let c_arm = renderer.c_arm().unwrap();
    let [from, to] = [0.0, 5.0].map(|x| c_arm.project(&Vec3::new(x, 0.0, 0.0))[0]);
    let row = 80 * 160;
    let middle = |of: &[f32]| {
        let line = &of[row..row + 160];
        line.iter().enumerate().map(|(x, mm)| x as f64 * f64::from(*mm)).sum::<f64>()
            / line.iter().map(|mm| f64::from(*mm)).sum::<f64>()
    };
    let shift = middle(&now.body_mm) - middle(&rest.body_mm);
    assert!((shift - (to - from)).abs() < 0.5, "{shift} {}", to - from);
    let mut fresh = Renderer::new(&view, &vessel()).unwrap();
    fresh.move_vessel(Some(&moved)).unwrap();
    assert_eq!(fresh.path_lengths(&[]).unwrap().body_mm, now.body_mm);
    renderer.move_vessel(None).unwrap();
    assert_eq!(renderer.path_lengths(&[]).unwrap().body_mm, rest.body_mm);
    std::fs::remove_file(&file).unwrap();
}
