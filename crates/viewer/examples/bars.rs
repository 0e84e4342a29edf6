//! What a picture of 512 × 512 pixels costs beside what it may cost: a new pose of the C-arm, a device that moves, and a
//! coil of 1,000 mm that is wound up in a sac, in a generated body, by the processor alone.
//!
//! `cargo run --profile dist -p endowire-viewer --example bars [-- PART OF A NAME]`

mod clock;

use std::path::Path;
use std::process::ExitCode;

use clock::mean_ms;
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use endowire_viewer::{
    Backend, CArmSpec, DevicePart, DevicePoint, DeviceView, FrameTime, InjectionSpec, Material, Renderer,
    TorsoSpec, View, ViewSpec,
};

/// CPU time that a picture may cost, ms: a pose that is asked for, and frames that follow each other.
const NEW_POSE_MS: f64 = 1000.0;
const MOVING_DEVICE_MS: f64 = 20.0;
const LONG_COIL_MS: f64 = 100.0;
/// In its first breath the pictures are made that later breaths are mixed of.
const FIRST_BREATH_MS: f64 = 60.0;
/// Frames of a breath of four seconds, 15 a second.
const BREATH: u32 = 60;

/// The coil: its length, the radius of the sac, and the pitch of its course.
const COIL_MM: f64 = 1000.0;
const SAC_MM: f64 = 5.0;

/// Measures the time of a picture, ms.
type Measured = fn() -> Result<f64>;

fn main() -> Result<ExitCode> {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let mut held = true;
    let bars: [(&str, f64, Measured); 4] = [
        ("a new pose, body and medium that flows", NEW_POSE_MS, new_pose_ms),
        ("a device that moves in a body that breathes", MOVING_DEVICE_MS, || moving_device_ms(BREATH)),
        ("the same in its first breath", FIRST_BREATH_MS, || moving_device_ms(0)),
        ("a coil of 1,000 mm that moves", LONG_COIL_MS, long_coil_ms),
    ];
    for (name, bar_ms, measured) in bars.into_iter().filter(|bar| bar.0.contains(&wanted)) {
        let ms = measured()?;
        println!("{name}: {ms:.1} ms CPU a picture, of {bar_ms:.0}");
        held &= ms <= bar_ms;
    }
    Ok(if held { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn vessels() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels")
}

fn spec() -> ViewSpec {
    let mut spec = ViewSpec {
        size_px: [512; 2],
        views: vec![View::Fluoro],
        backend: Backend::Cpu,
        ..ViewSpec::default()
    };
    spec.patient.torso = Some(TorsoSpec::default());
    spec
}

/// The arch with medium that flows, from another side each time.
fn new_pose_ms() -> Result<f64> {
    let wall = Wall::from_surface(&SurfaceMesh::read(&vessels().join("aortic_arch.stl"), 1.0)?)?;
    let mut spec = spec();
    spec.flow.tree = Some(vessels().join("aortic_arch.csv"));
    spec.injection = vec![InjectionSpec {
        start_s: 0.0,
        duration_s: 1.0,
        rate_ml_per_s: 20.0,
        at_mm: None,
        at_tip: false,
    }];
    let mut renderer = Renderer::of_wall(&spec, &wall)?;
    mean_ms(8, |k| {
        renderer.turn_c_arm(&CArmSpec { primary_deg: 5.0 * f64::from(k), ..CArmSpec::default() })?;
        renderer.render_at(&[wire(k)], FrameTime { frame: u64::from(k), time_s: 0.5 }).map(drop)
    })
}

/// A wire that moves over the arch during a breath, after so many frames.
fn moving_device_ms(before: u32) -> Result<f64> {
    let wall = Wall::from_surface(&SurfaceMesh::read(&vessels().join("aortic_arch.stl"), 1.0)?)?;
    let mut renderer = Renderer::of_wall(&spec(), &wall)?;
    (0..before).try_for_each(|k| renderer.render(&[wire(k)]).map(drop))?;
    mean_ms(BREATH, |k| renderer.render(&[wire(k)]).map(drop))
}

/// A wire of 0.035 inch from the descending aorta up.
fn wire(k: u32) -> DeviceView {
    let at = |w: f64| {
        let wave = 6.0 * w + 0.1 * f64::from(k);
        Vec3::new(8.0 * libm::sin(wave), -20.0 + 3.0 * libm::cos(wave), 60.0 + 250.0 * w)
    };
    let points = (0..=100).map(|i| {
        let w = f64::from(i) / 100.0;
        DevicePoint { position_mm: at(w), tangent: at(w + 1e-5) - at(w - 1e-5), radius_mm: 0.445 }
    });
    DeviceView { points: points.collect(), ..DeviceView::default() }
}

/// A platinum coil of 0.0125 inch in loops about the middle of a sac, which turn from frame to frame, in a field of 70 mm.
fn long_coil_ms() -> Result<f64> {
    let wall = Wall::from_surface(&SurfaceMesh::read(&vessels().join("sidewall_aneurysm.stl"), 1.0)?)?;
    let mut spec = spec();
    spec.c_arm.field_mm = Some(70.0);
    spec.c_arm.isocentre_mm = Some([2.0, 6.0, 36.0]);
    let mut renderer = Renderer::of_wall(&spec, &wall)?;
    // After the first breath, whose cost is measured by itself.
    (0..BREATH).try_for_each(|_| renderer.render(&[]).map(drop))?;
    mean_ms(10, |k| renderer.render(&[coil(k)]).map(drop))
}

fn coil(k: u32) -> DeviceView {
    const RADIUS_MM: f64 = 0.159;
    let at = |s: f64| {
        // Loops whose plane turns slowly, larger and smaller by turns.
        let (loops, plane) = (s / SAC_MM, 0.07 * s + 0.1 * f64::from(k));
        let radius = SAC_MM * (0.75 + 0.2 * libm::sin(0.013 * s));
        let (u, v) = (radius * libm::cos(loops), radius * libm::sin(loops));
        Vec3::new(2.0 + u * libm::cos(plane), 6.0 + u * libm::sin(plane), 36.0 + v)
    };
    let points = (0..=2000).map(|i| {
        let s = COIL_MM * f64::from(i) / 2000.0;
        DevicePoint { position_mm: at(s), tangent: at(s + 1e-4) - at(s - 1e-4), radius_mm: RADIUS_MM }
    });
    let part = |material: Material, inner_radius_mm: f64| DevicePart {
        material: Some(material),
        inner_radius_mm,
        ..DevicePart::default()
    };
    DeviceView {
        points: points.collect(),
        parts: vec![part(Material::Blood, 0.0), part(Material::Platinum, RADIUS_MM - 0.0349)],
        ..DeviceView::default()
    }
}
