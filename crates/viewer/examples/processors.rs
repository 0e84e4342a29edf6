//! Pictures a second by the graphics processor and by this one: a wire that moves in the arch of an aorta, with a still C-arm and with one that turns, by
//! fluoroscopy and in 3D, with no body, a generated one and a tomogram.
//!
//! `RAYON_NUM_THREADS=1 cargo run --release -p endowire-viewer --example processors [SIDE IN PIXELS]...`

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use endowire_viewer::{
    Backend, CArmSpec, CtSpec, DevicePoint, DeviceView, FrameTime, Renderer, TorsoSpec, View, ViewSpec,
};

/// What a rate is measured over.
const LEAST_S: f64 = 0.5;

fn wire(k: u64) -> [DeviceView; 1] {
    let at = |w: f64| Vec3::new(1.0 + 3.0 * (9.0 * w + 0.1 * k as f64).sin(), 2.0, 5.0 + 170.0 * w);
    let point = |i: u32| {
        let w = f64::from(i) / 60.0;
        DevicePoint { position_mm: at(w), tangent: at(w + 1e-5) - at(w - 1e-5), radius_mm: 0.445 }
    };
    [DeviceView { points: (0..=60).map(point).collect(), ..DeviceView::default() }]
}

/// A tomogram of an elliptic body of water about the aorta, with a spine: voxels of 3 mm.
fn tomogram() -> Vec<u8> {
    const SIDE: i16 = 128;
    let mut bytes = vec![0_u8; 352];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &348_i32.to_le_bytes());
    for (k, n) in [3, SIDE, SIDE, SIDE, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * k, &n.to_le_bytes());
    }
    put(70, &4_i16.to_le_bytes());
    put(72, &16_i16.to_le_bytes());
    (0..4).for_each(|k| put(76 + 4 * k, &[1.0_f32, 3.0, 3.0, 3.0][k].to_le_bytes()));
    put(108, &352_f32.to_le_bytes());
    put(112, &1_f32.to_le_bytes());
    put(254, &1_i16.to_le_bytes());
    // Axes of NIfTI run to the right and to the front.
    for (row, line) in
        [[-3.0, 0.0, 0.0, 192.0], [0.0, -3.0, 0.0, 192.0], [0.0, 0.0, 3.0, -60.0]].iter().enumerate()
    {
        (0..4).for_each(|k| put(280 + 16 * row + 4 * k, &(line[k] as f32).to_le_bytes()));
    }
    put(344, b"n+1\0");
    let axis = |i: i16| 3.0 * f64::from(i) - 192.0;
    for _ in 0..SIDE {
        for j in 0..SIDE {
            for i in 0..SIDE {
                let (x, y) = (axis(i), axis(j));
                let is_spine = (x / 20.0).powi(2) + ((y - 60.0) / 20.0).powi(2) < 1.0;
                let is_body = (x / 170.0).powi(2) + (y / 110.0).powi(2) < 1.0;
                let units: i16 = if is_spine {
                    700
                } else if is_body {
                    40
                } else {
                    -1000
                };
                bytes.extend(units.to_le_bytes());
            }
        }
    }
    bytes
}

/// How often a second a job is done.
fn rate(mut job: impl FnMut(u64) -> Result<()>) -> Result<f64> {
    job(0)?;
    let begun = Instant::now();
    let mut done = 0;
    while begun.elapsed().as_secs_f64() < LEAST_S {
        done += 1;
        job(done)?;
    }
    Ok(done as f64 / begun.elapsed().as_secs_f64())
}

/// Rates with a still C-arm, or camera, and with one that turns.
fn rates(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<[f64; 2]> {
    let mut renderer = Renderer::new(spec, wall)?;
    let still = rate(|k| renderer.render_at(&wire(k), FrameTime { frame: k, time_s: 0.0 }).map(drop))?;
    let turning = rate(|k| {
        let mut turned = spec.clone();
        turned.c_arm = spec.c_arm.turned(0.5 * k as f64 % 40.0);
        turned.camera.turn_deg = 0.5 * k as f64 % 40.0;
        renderer.change(&turned)?;
        renderer.render_at(&wire(k), FrameTime { frame: k, time_s: 0.0 }).map(drop)
    })?;
    Ok([still, turning])
}

fn main() -> std::result::Result<(), Box<dyn Error>> {
    let sides: Vec<u32> = std::env::args().skip(1).filter_map(|text| text.parse().ok()).collect();
    let sides = if sides.is_empty() { vec![128, 384, 512, 1024] } else { sides };
    let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
    let surface = SurfaceMesh::read(&vessels.join("aortic_arch.stl"), 1.0)?;
    let wall = Wall::from_surface(&surface)?.closed_mesh();
    let file = std::env::temp_dir().join(format!("endowire_{}.nii", std::process::id()));
    std::fs::write(&file, tomogram())?;
    println!(
        "| view | side | still: processor | graphics | turning: processor | graphics |\n|---|---|---|---|---|---|"
    );
    let mut opened = None;
    for (view, body) in
        [(View::Fluoro, ""), (View::Fluoro, "body"), (View::Fluoro, "tomogram"), (View::ThreeD, "")]
    {
        for side in &sides {
            let c_arm = CArmSpec { pose: Some("LAO 40".parse()?), ..CArmSpec::default() };
            let mut spec = ViewSpec { size_px: [*side; 2], views: vec![view], c_arm, ..ViewSpec::default() };
            match body {
                "body" => spec.patient.torso = Some(TorsoSpec::default()),
                "tomogram" => spec.patient.ct = Some(CtSpec { file: file.clone(), offset_mm: [0.0; 3] }),
                _ => {}
            }
            spec.backend = Backend::Cpu;
            let processor = rates(&spec, &wall)?;
            spec.backend = Backend::Gpu;
            let begun = Instant::now();
            let name = Renderer::new(&spec, &wall)?.backend().to_owned();
            opened.get_or_insert((name, begun.elapsed()));
            let graphics = rates(&spec, &wall)?;
            let what = if view == View::ThreeD { "3D" } else { "fluoroscopy" };
            println!(
                "| {what} {body} | {side} | {:.0} | {:.0} | {:.1} | {:.1} |",
                processor[0], graphics[0], processor[1], graphics[1]
            );
        }
    }
    std::fs::remove_file(&file)?;
    if let Some((name, taken)) = opened {
        println!("graphics: {name}, opened in {taken:.0?}");
    }
    Ok(())
}
