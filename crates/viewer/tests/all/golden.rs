//! Frames against stored ones: drawn by the plain Rust path, which needs no driver and is pinned nearly to the bit, and by wgpu,
//! pinned as pictures: the stored ones are Mesa's software rasteriser's, whose last bits change with its version.
//!
//! `ENDOWIRE_BLESS=1 cargo test -p endowire-viewer --test all golden::` stores them anew; look at them before committing.

use crate::common;

use std::io::BufReader;
use std::path::{Path, PathBuf};

use common::*;
use endowire_core::Vec3;
use endowire_viewer::{
    Backend, ContactView, DevicePart, DeviceView, ExposureSpec, FrameTime, Image, Material, Mode, Renderer,
    TorsoSpec, View, ViewSpec,
};

/// Grey levels that mathematical libraries may differ by, and the share of pixels that may differ by more.
const LEVELS: u8 = 2;
const SHARE: f64 = 2e-3;

fn view(mode: Mode) -> ViewSpec {
    let mut view = ViewSpec {
        size_px: [200, 200],
        views: vec![View::Fluoro, View::ThreeD],
        backend: Backend::Cpu,
        ..ViewSpec::default()
    };
    view.c_arm.pose = Some("LAO 40".parse().unwrap());
    // At rest at any time.
    view.patient.torso = Some(TorsoSpec { breath_mm: Some(0.0), beat_mm: Some(0.0), ..TorsoSpec::default() });
    with_injection(view, "aortic_arch", [-38.4, -54.8, 136.0], mode)
}

fn catheter() -> DeviceView {
    let mut wire = device(20, 0.9, |w| Vec3::new(1.0, 2.0, 5.0 + 170.0 * w));
    wire.parts = vec![
        DevicePart {
            from_tip_mm: Some([2.0, 1000.0]),
            material: Some(Material::PebaxBariumSulphate40),
            inner_radius_mm: 0.6,
            ..DevicePart::default()
        },
        DevicePart {
            from_tip_mm: Some([0.0, 2.0]),
            material: Some(Material::Platinum),
            inner_radius_mm: 0.6,
            ..DevicePart::default()
        },
    ];
    wire
}

fn draw(mut renderer: Renderer, device: DeviceView) -> [Image; 2] {
    renderer.show_contacts(&[ContactView { position_mm: Vec3::new(1.0, 2.0, 90.0), force_n: Vec3::x() }]);
    let frames = renderer.render_at(&[device], FrameTime { frame: 3, time_s: 1.6 }).unwrap();
    [frames.fluoro.unwrap(), frames.three_d.unwrap()]
}

/// Share of the bytes that differ by more than [`LEVELS`].
fn differing(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > LEVELS).count() as f64 / a.len() as f64
}

fn stored(path: &Path) -> Vec<u8> {
    let file = std::fs::File::open(path)
        .unwrap_or_else(|e| panic!("{}: {e}; store it with ENDOWIRE_BLESS=1", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut data).unwrap();
    data
}

/// Stores the pictures if ENDOWIRE_BLESS=1.
fn bless(pictures: &[(String, Image)]) {
    if std::env::var("ENDOWIRE_BLESS").is_ok_and(|v| v == "1") {
        std::fs::create_dir_all(folder()).unwrap();
        for (name, image) in pictures {
            image.write_png(folder().join(name)).unwrap();
        }
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

/// A guidewire so much aside.
fn wire(lateral_mm: f64) -> DeviceView {
    device(20, 0.45, |w| Vec3::new(1.0 + lateral_mm, 2.0, 5.0 + 170.0 * w))
}

fn moved(lateral_mm: f64) -> DeviceView {
    let mut moved = catheter();
    moved.points.iter_mut().for_each(|p| p.position_mm.x += lateral_mm);
    moved
}

#[test]
fn frames_are_the_stored_ones_and_a_wire_a_millimetre_lateral_is_not() {
    let mut pictures = Vec::new();
    for (name, mode) in
        [("fluoro", Mode::Fluoro), ("cine", Mode::Cine), ("dsa", Mode::Dsa), ("roadmap", Mode::Roadmap)]
    {
        let [fluoro, three_d] = draw(Renderer::new(&view(mode), &wall("aortic_arch")).unwrap(), catheter());
        pictures.push((format!("{name}.png"), fluoro));
        if mode == Mode::Fluoro {
            pictures.push(("three_d.png".to_owned(), three_d));
        }
    }
    bless(&pictures);
    for (name, image) in &pictures {
        let share = differing(image.data(), &stored(&folder().join(name)));
        assert!(share <= SHARE, "{name}: {share} of the bytes differ");
    }
    // The twin.
    let [image, _] = draw(Renderer::new(&view(Mode::Fluoro), &wall("aortic_arch")).unwrap(), moved(1.0));
    assert!(differing(image.data(), pictures[0].1.data()) > SHARE, "the comparison must be able to fail");
}

/// What each picture of a sequence shows, and what its twin leaves out: the run before the hold, the motion within the pulse, exposure
/// control, the turn.
fn of_sequences(twin: bool) -> Vec<(String, Image)> {
    let mut pictures = Vec::new();
    let mut add = |name: &str, image: Image| pictures.push((format!("{name}.png"), image));
    let frame = |renderer: &mut Renderer, lateral_mm: f64, frame: u64| {
        let moment = FrameTime { frame, time_s: 1.6 };
        renderer.render_at(&[wire(lateral_mm)], moment).unwrap().fluoro.unwrap()
    };

    // Near, and without contrast medium: what moves is seen.
    let near = || {
        let mut near = view(Mode::Fluoro);
        near.injection.clear();
        (near.c_arm.field_mm, near.c_arm.isocentre_mm) = (Some(110.0), Some([1.0, 2.0, 150.0]));
        Renderer::new(&near, &wall("aortic_arch")).unwrap()
    };
    // A wire that goes 6 mm aside from frame to frame: where it was fades.
    let mut held = near();
    for k in 0..6 {
        let lateral_mm = if twin { 0.0 } else { 6.0 * (k as f64 - 5.0) };
        frame(&mut held, lateral_mm, k);
    }
    add("hold", held.last_image_hold().unwrap());

    // 2 mm aside while the beam is on: wide and faint.
    let last = if twin { 1 } else { 8 };
    let pulse: Vec<_> = (0..last).map(|k| vec![wire(2.0 * f64::from(k) / 8.0)]).collect();
    let moment = FrameTime { frame: 3, time_s: 1.6 };
    add("pulse", near().render_pulse(&[wire(0.0)], &pulse, moment).unwrap().fluoro.unwrap());

    // A thick patient: more voltage, less contrast.
    let mut thick = view(Mode::Fluoro);
    thick.patient.torso = Some(TorsoSpec {
        width_mm: 480.0,
        depth_mm: 450.0,
        breath_mm: Some(0.0),
        beat_mm: Some(0.0),
        ..TorsoSpec::default()
    });
    (thick.xray.pulse_ms, thick.exposure) = (8.0, (!twin).then(ExposureSpec::default));
    add("exposure", frame(&mut Renderer::new(&thick, &wall("aortic_arch")).unwrap(), 0.0, 3));

    // The fourth frame of a turn of 10° each, with what the detector holds of the third.
    let mut turning = Renderer::new(&view(Mode::Fluoro), &wall("aortic_arch")).unwrap();
    let start = turning.spec().c_arm.clone();
    let mut shown = None;
    for k in 0..4 {
        turning.turn_c_arm(&start.turned(if twin { 0.0 } else { -10.0 * k as f64 })).unwrap();
        shown = Some(frame(&mut turning, 0.0, k));
    }
    add("turn", shown.unwrap());
    pictures
}

#[test]
fn pictures_of_sequences_are_the_stored_ones_and_without_what_makes_them_are_not() {
    let pictures = of_sequences(false);
    bless(&pictures);
    for ((name, image), (_, twin)) in pictures.iter().zip(of_sequences(true)) {
        let reference = stored(&folder().join(name));
        let share = differing(image.data(), &reference);
        assert!(share <= SHARE, "{name}: {share} of the bytes differ");
        let share = differing(twin.data(), &reference);
        assert!(share > SHARE, "{name}: its twin must differ, and {share} of the bytes do");
    }
}

/// What pictures of different drivers may differ by: grey levels in the mean, and levels that all but a share of the bytes stay
/// within.
struct Tolerance {
    mean: f64,
    levels: u8,
    share: f64,
}

/// Adapters give path lengths, which agree to the seventh digit; the rest of the picture is plain Rust.
const FLUORO: Tolerance = Tolerance { mean: 0.02, levels: 2, share: 1e-3 };
/// Silhouettes fall on other samples with other drivers, areas do not.
const THREE_D: Tolerance = Tolerance { mean: 0.15, levels: 6, share: 5e-3 };

impl Tolerance {
    /// What `a` and `b` differ by, and whether that is too much.
    fn compare(&self, a: &[u8], b: &[u8]) -> (String, bool) {
        assert_eq!(a.len(), b.len());
        let mut off: Vec<u8> = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).collect();
        off.sort_unstable();
        let mean = off.iter().map(|&v| f64::from(v)).sum::<f64>() / off.len() as f64;
        let levels = off[((off.len() - 1) as f64 * (1.0 - self.share)) as usize];
        let said = format!("{mean:.3} levels in the mean, {levels} for all but {} of the bytes", self.share);
        (said, mean > self.mean || levels > self.levels)
    }
}

#[test]
fn frames_of_the_adapter_are_the_stored_pictures_and_a_shifted_wire_is_not() {
    let Some(renderer) = on_gpu(&view(Mode::Fluoro), &wall("aortic_arch")) else { return };
    assert!(!renderer.backend().contains("CPU reference"), "{}", renderer.backend());
    let name = renderer.backend().to_owned();
    let [fluoro, three_d] = draw(renderer, catheter());
    let of_mode = |mode, device| {
        let [image, _] = draw(on_gpu(&view(mode), &wall("aortic_arch")).unwrap(), device);
        image
    };
    const OTHERS: [Mode; 3] = [Mode::Dsa, Mode::Cine, Mode::Roadmap];
    let [dsa, cine, roadmap] = OTHERS.map(|mode| of_mode(mode, catheter()));
    let pictures =
        [("fluoro", fluoro), ("three_d", three_d), ("dsa", dsa), ("cine", cine), ("roadmap", roadmap)];
    let pictures = pictures.map(|(name, image)| (format!("wgpu_{name}.png"), image));
    bless(&pictures);
    let references = [0, 1, 2, 3, 4].map(|i| stored(&folder().join(&pictures[i].0)));
    let tolerances = [FLUORO, THREE_D, FLUORO, FLUORO, FLUORO];
    for (((file, image), reference), tolerance) in pictures.iter().zip(&references).zip(&tolerances) {
        let (said, differ) = tolerance.compare(image.data(), reference);
        eprintln!("{name}: {file}: {said}");
        assert!(!differ, "{name}: {file}: {said}");
        // A twin: a picture a column aside.
        let mut shifted = image.data().to_vec();
        shifted.rotate_right(image.data().len() / (200 * 200));
        let (said, differ) = tolerance.compare(&shifted, reference);
        assert!(differ, "{file} a column aside: {said}");
    }
    // Another: a wire a millimetre aside, half a pixel.
    let Some(renderer) = on_gpu(&view(Mode::Fluoro), &wall("aortic_arch")) else { return };
    let [fluoro, three_d] = draw(renderer, moved(1.0));
    // A subtraction has the wire in its mask too, and shows nothing of it.
    let others = OTHERS.map(|mode| (mode != Mode::Dsa).then(|| of_mode(mode, moved(1.0))));
    let lateral = [Some(fluoro), Some(three_d)].into_iter().chain(others);
    for ((image, reference), tolerance) in lateral.zip(&references).zip(&tolerances) {
        let Some(image) = image else { continue };
        let (said, differ) = tolerance.compare(image.data(), reference);
        eprintln!("aside: {said}");
        assert!(differ, "{said}");
    }
}
