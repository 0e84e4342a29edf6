//! The arch of an aorta with a catheter in it, in every mode of the fluoroscopic view and in 3D, written as PNG files.
//!
//! `cargo run -p endowire-viewer --example frames -- [FOLDER] [auto|gpu|cpu]`

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use endowire_viewer::{
    Angiogram, Animation, Backend, CArmSpec, DevicePart, DevicePoint, DeviceView, FrameTime, InjectionSpec,
    Material, Mode, Pace, Renderer, TorsoSpec, View, ViewSpec,
};

/// A catheter up the descending aorta, its tip in the arch, and a wire that sticks out of it.
fn devices() -> [DeviceView; 2] {
    let at = |s: f64| {
        // Up along the aorta, leaning on its wall, then over the arch.
        let bend = (s - 195.0).max(0.0) / 26.0;
        let up = if bend > 0.0 { 195.0 + 24.0 * bend.min(1.2).sin() } else { s };
        let over = 26.0 * (1.0 - bend.min(1.2).cos());
        let sway = 6.0 * (s / 45.0).sin() * (1.0 - (s / 240.0).powi(2)).max(0.0);
        Vec3::new(4.0 + sway - 0.62 * over, 4.0 - 0.78 * over, up)
    };
    let line = |reach: f64, radius_mm: f64| DeviceView {
        points: (0..=120)
            .map(|i| {
                let s = reach * f64::from(i) / 120.0;
                DevicePoint { position_mm: at(s), tangent: at(s + 1e-4) - at(s - 1e-4), radius_mm }
            })
            .collect(),
        ..DeviceView::default()
    };
    // 5 F: a shaft filled with barium sulphate, a tungsten-filled tip, a platinum band behind it.
    let shaft = DevicePart {
        from_tip_mm: Some([3.0, 1000.0]),
        material: Some(Material::PebaxBariumSulphate40),
        inner_radius_mm: 0.55,
        ..DevicePart::default()
    };
    let tip = DevicePart {
        from_tip_mm: Some([0.0, 3.0]),
        material: Some(Material::PolyurethaneTungsten60),
        ..shaft
    };
    let band = DevicePart {
        from_tip_mm: Some([20.0, 21.2]),
        material: Some(Material::Platinum),
        outer_radius_mm: Some(0.9),
        inner_radius_mm: 0.84,
    };
    let catheter = DeviceView { parts: vec![shaft, tip, band], ..line(200.0, 0.84) };
    // A 0.035 inch nitinol wire.
    let wire = DeviceView { material: Some(Material::Nitinol), ..line(222.0, 0.445) };
    [catheter, wire]
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder: PathBuf = arguments.next().map_or_else(std::env::temp_dir, Into::into);
    let backend = match arguments.next().as_deref() {
        Some("gpu") => Backend::Gpu,
        Some("cpu") => Backend::Cpu,
        _ => Backend::Auto,
    };
    let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
    let surface = SurfaceMesh::read(&vessels.join("aortic_arch.stl"), 1.0)?;
    let wall = Wall::from_surface(&surface)?.closed_mesh();

    let mut spec =
        ViewSpec { size_px: [512, 512], views: vec![View::Fluoro], backend, ..ViewSpec::default() };
    spec.c_arm = CArmSpec { pose: Some("LAO 40".parse()?), field_mm: Some(380.0), ..CArmSpec::default() };
    spec.patient.torso = Some(TorsoSpec::default());
    // Contrast medium into the ascending aorta, where the blood comes in.
    spec.flow.tree = Some(vessels.join("aortic_arch.csv"));
    spec.flow.inlet_mm = Some([-38.4, -54.8, 136.0]);
    spec.injection = vec![InjectionSpec {
        start_s: 0.2,
        duration_s: 1.2,
        rate_ml_per_s: 20.0,
        at_mm: None,
        at_tip: false,
    }];

    let devices = devices();
    for (name, mode, time_s) in [
        ("fluoro", Mode::Fluoro, 0.0),
        ("cine", Mode::Cine, 1.2),
        ("dsa", Mode::Dsa, 1.2),
        ("roadmap", Mode::Roadmap, 0.0),
    ] {
        spec.xray.mode = mode;
        let start = Instant::now();
        let mut renderer = Renderer::new(&spec, &wall)?;
        let prepared = start.elapsed();
        let start = Instant::now();
        let frames = renderer.render_at(&devices, FrameTime { frame: 1, time_s })?;
        println!(
            "{name}: {} prepared in {prepared:.1?}, first frame {:.1?}",
            renderer.backend(),
            start.elapsed()
        );
        if let Some(image) = frames.fluoro {
            image.write_png(folder.join(format!("{name}.png")))?;
        }
    }

    // Three seconds of subtraction angiography, as an animation and as DICOM.
    spec.xray.mode = Mode::Dsa;
    spec.size_px = [256, 256];
    spec.bits = 16;
    let mut renderer = Renderer::new(&spec, &wall)?;
    let (mut series, mut read, mut mask) = (Vec::new(), Vec::new(), None);
    for frame in 0..45 {
        series.extend(renderer.render_at(&devices, FrameTime { frame, time_s: frame as f64 / 15.0 })?.fluoro);
        if let Some([taken, frame]) = renderer.unsubtracted() {
            read.push(frame);
            mask = mask.or(Some(taken));
        }
    }
    if let (Some(first), Some(c_arm), Some(exposure)) =
        (series.first(), renderer.c_arm(), renderer.exposure())
    {
        let mut animation =
            Animation::new(folder.join("angiogram.png"), first, series.len() as u32, Pace::even(15.0))?;
        series.iter().try_for_each(|frame| animation.push(frame))?;
        animation.finish()?;
        let angiogram = Angiogram {
            c_arm,
            turn_deg: 0.0,
            exposure,
            pace: Pace::even(15.0),
            mode: Mode::Dsa,
            mask: mask.as_ref(),
            contrast: true,
            description: "aortic arch",
        };
        angiogram.write(folder.join("angiogram.dcm"), &read)?;
    }

    let spec = ViewSpec { size_px: [640, 640], views: vec![View::ThreeD], bits: 8, ..spec };
    if let Some(image) = Renderer::new(&spec, &wall)?.render(&devices)?.three_d {
        image.write_png(folder.join("3d.png"))?;
    }
    println!("written to {}", folder.display());
    Ok(())
}
