//! Frames against stored ones, drawn by the plain Rust path, which is the pinned rasteriser: it needs no driver.
//!
//! `ENDOWIRE_BLESS=1 cargo test -p endowire-viewer --test golden` stores them anew; look at them before committing.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::io::BufReader;
use std::path::{Path, PathBuf};

use common::*;
use endowire_core::Vec3;
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::{
    Backend, ContactView, DevicePart, DeviceView, Image, InjectionSpec, Material, Mode, Moment, Renderer,
    TorsoSpec, View, ViewSpec,
};

/// Grey levels that mathematical libraries may differ by, and the share of pixels that may differ by more.
const LEVELS: u8 = 2;
const SHARE: f64 = 2e-3;

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels")
}

fn arch() -> SurfaceMesh {
    let surface = SurfaceMesh::read(&assets().join("aortic_arch.stl"), 1.0).unwrap();
    Wall::from_surface(&surface).unwrap().closed_mesh()
}

fn view(mode: Mode) -> ViewSpec {
    let mut view = ViewSpec {
        size_px: [200, 200],
        views: vec![View::Fluoro, View::ThreeD],
        backend: Backend::Cpu,
        ..ViewSpec::default()
    };
    view.c_arm.pose = Some("LAO 40".parse().unwrap());
    view.patient.torso = Some(TorsoSpec::default());
    view.xray.mode = mode;
    view.flow.tree = Some(assets().join("aortic_arch.csv"));
    view.flow.inlet_mm = Some([-38.4, -54.8, 136.0]);
    view.injection = vec![InjectionSpec { start_s: 0.0, duration_s: 1.5, rate_ml_per_s: 20.0, at_mm: None }];
    view
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

fn draw(mode: Mode) -> [Image; 2] {
    let mut renderer = Renderer::new(&view(mode), &arch()).unwrap();
    renderer.show_contacts(&[ContactView { position_mm: Vec3::new(1.0, 2.0, 90.0), force_n: Vec3::x() }]);
    let frames = renderer.render_at(&[catheter()], Moment { frame: 3, time_s: 1.6 }).unwrap();
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

#[test]
fn frames_are_the_stored_ones_and_a_wire_half_a_millimetre_aside_is_not() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let bless = std::env::var("ENDOWIRE_BLESS").is_ok_and(|v| v == "1");
    let mut pictures = Vec::new();
    for (name, mode) in
        [("fluoro", Mode::Fluoro), ("cine", Mode::Cine), ("dsa", Mode::Dsa), ("roadmap", Mode::Roadmap)]
    {
        let [fluoro, three_d] = draw(mode);
        pictures.push((name, fluoro));
        if mode == Mode::Fluoro {
            pictures.push(("three_d", three_d));
        }
    }
    if bless {
        std::fs::create_dir_all(&folder).unwrap();
        pictures
            .iter()
            .for_each(|(name, image)| image.write_png(folder.join(format!("{name}.png"))).unwrap());
    }
    for (name, image) in &pictures {
        let share = differing(image.data(), &stored(&folder.join(format!("{name}.png"))));
        assert!(share <= SHARE, "{name}: {share} of the bytes differ");
    }
    // The twin.
    let mut moved = catheter();
    moved.points.iter_mut().for_each(|p| p.position_mm.x += 1.0);
    let mut renderer = Renderer::new(&view(Mode::Fluoro), &arch()).unwrap();
    let image = renderer.render_at(&[moved], Moment { frame: 3, time_s: 1.6 }).unwrap().fluoro.unwrap();
    assert!(differing(image.data(), pictures[0].1.data()) > SHARE, "the comparison must be able to fail");
}
