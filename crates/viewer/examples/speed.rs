//! What frames cost in CPU time, and how exact they are: spheres of about 20,000 and 100,000 triangles at 512² and 1024², and a
//! wire that moves over a still anatomy through the whole detector chain.
//!
//! `cargo run --profile dist -p endowire-viewer --example speed [FOLDER FOR THE SPHERES AS STL]`

mod clock;

use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::time::Instant;

use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use endowire_viewer::{
    Backend, CArmSpec, DevicePoint, DeviceView, FrameTime, InjectionSpec, Renderer, TorsoSpec, View,
    ViewSpec, XRaySpec,
};

use clock::{cpu_ms, mean_ms};

const RADIUS_MM: f64 = 30.0;
const FRAMES: u32 = 60;

/// A sphere of latitudes and longitudes.
fn sphere(rings: u32) -> SurfaceMesh {
    let sides = 2 * rings;
    let mut mesh = SurfaceMesh { vertices_mm: vec![Vec3::z() * -RADIUS_MM], triangles: vec![] };
    for i in 1..rings {
        let (s, c) = (PI * f64::from(i) / f64::from(rings)).sin_cos();
        for k in 0..sides {
            let (v, u) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            mesh.vertices_mm.push(Vec3::new(s * u, s * v, -c) * RADIUS_MM);
        }
    }
    mesh.vertices_mm.push(Vec3::z() * RADIUS_MM);
    let top = mesh.vertices_mm.len() as u32 - 1;
    let at = |i: u32, k: u32| 1 + (i - 1) * sides + k % sides;
    for k in 0..sides {
        mesh.triangles.push([0, at(1, k + 1), at(1, k)]);
        mesh.triangles.push([top, at(rings - 1, k), at(rings - 1, k + 1)]);
        for i in 1..rings - 1 {
            let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn spec(side: u32) -> ViewSpec {
    ViewSpec {
        size_px: [side, side],
        views: vec![View::Fluoro],
        backend: Backend::Cpu,
        xray: XRaySpec { tissue_mm: 0.0, ..XRaySpec::default() },
        c_arm: CArmSpec {
            pixel_mm: Some(0.25 * 512.0 / f64::from(side)),
            isocentre_mm: Some([0.0; 3]),
            sid_mm: 1000.0,
            sod_mm: 750.0,
            ..CArmSpec::default()
        },
        ..ViewSpec::default()
    }
}

/// What a first picture of the arch costs: set-up, what stays for a pose, the picture itself.
fn first_picture() -> Result<()> {
    let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
    let wall = Wall::from_surface(&SurfaceMesh::read(&vessels.join("aortic_arch.stl"), 1.0)?)?;
    let slab = ViewSpec { size_px: [512; 2], c_arm: CArmSpec::default(), ..spec(512) };
    let mut body = slab.clone();
    body.patient.torso = Some(TorsoSpec::default());
    body.xray.contrast_fraction = 0.05;
    let mut injected = body.clone();
    injected.flow.tree = Some(vessels.join("aortic_arch.csv"));
    injected.injection = vec![InjectionSpec {
        start_s: 0.0,
        duration_s: 1.0,
        rate_ml_per_s: 20.0,
        at_mm: None,
        at_tip: false,
    }];
    for (name, spec) in [("a slab", slab), ("a body", body), ("a body, contrast medium that flows", injected)]
    {
        let start = Instant::now();
        let mut times = [cpu_ms(start), 0.0, 0.0, 0.0];
        let mut renderer = Renderer::of_wall(&spec, &wall)?;
        times[1] = cpu_ms(start);
        renderer.prepare()?;
        times[2] = cpu_ms(start);
        renderer.render_at(&[], FrameTime { frame: 0, time_s: 0.5 })?;
        times[3] = cpu_ms(start);
        let [set_up, pose, picture] = [0, 1, 2].map(|k| times[k + 1] - times[k]);
        println!(
            "first picture of the arch in {name}, 512²: {set_up:.0} ms CPU of set-up, {pose:.0} for the pose, {picture:.0} for itself"
        );
    }
    Ok(())
}

fn main() -> Result<()> {
    first_picture()?;
    let folder = std::env::args().nth(1).map(std::path::PathBuf::from);
    for rings in [71, 158] {
        let mesh = sphere(rings);
        if let Some(folder) = &folder {
            mesh.write(&folder.join(format!("sphere_{}.stl", mesh.triangles.len())))?;
        }
        for side in [512, 1024] {
            let mut renderer = Renderer::new(&spec(side), &mesh)?;
            let lengths = renderer.path_lengths(&[])?.lumen_mm;
            let Some(arm) = renderer.c_arm().cloned() else { continue };
            let error: f64 = lengths
                .iter()
                .enumerate()
                .map(|(i, &length)| {
                    let pixel = [i as u32 % side, i as u32 / side].map(|n| f64::from(n) + 0.5);
                    let (origin, direction) = arm.ray(pixel);
                    let off = origin.cross(&direction).norm_squared();
                    (f64::from(length) - 2.0 * (RADIUS_MM * RADIUS_MM - off).max(0.0).sqrt()).abs()
                })
                .sum();
            // Another place of the C-arm each time: what stays is computed once.
            let ms = mean_ms(FRAMES, |k| {
                let place = CArmSpec { primary_deg: f64::from(k), ..spec(side).c_arm };
                renderer.turn_c_arm(&place)?;
                renderer.path_lengths(&[]).map(drop)
            })?;
            let whole_ms =
                mean_ms(FRAMES, |_| Renderer::new(&spec(side), &mesh)?.path_lengths(&[]).map(drop))?;
            println!(
                "sphere, {} triangles, {side}²: {ms:.2} ms CPU a frame, {whole_ms:.2} with its set-up, mean error {:.1e} mm",
                mesh.triangles.len(),
                error / lengths.len() as f64
            );
        }
    }
    let wire = |k: u32| {
        let at = |w: f64| {
            Vec3::new(8.0 * (6.0 * w + 0.1 * f64::from(k)).sin(), 3.0 * (4.0 * w).cos(), 58.0 * w - 29.0)
        };
        let points = (0..=60)
            .map(|i| {
                let w = f64::from(i) / 60.0;
                DevicePoint { position_mm: at(w), tangent: at(w + 1e-5) - at(w - 1e-5), radius_mm: 0.445 }
            })
            .collect();
        DeviceView { points, ..DeviceView::default() }
    };
    for energy_bins in [None, Some(8)] {
        let mut moving = spec(512);
        moving.patient.torso = Some(TorsoSpec::default());
        moving.xray.energy_bins = energy_bins;
        let start = Instant::now();
        let before = cpu_ms(start);
        let mut renderer = Renderer::new(&moving, &sphere(71))?;
        let pose_ms = cpu_ms(start) - before;
        let ms = mean_ms(FRAMES, |k| {
            let moment = FrameTime { frame: u64::from(k), time_s: 0.0 };
            renderer.render_at(&[wire(k)], moment).map(drop)
        })?;
        println!(
            "a moving wire over a trunk, 512², {}, scatter, noise, blur, lag, display: {ms:.2} ms CPU a frame, \
             {pose_ms:.0} ms before the first",
            energy_bins.map_or("the whole spectrum".to_owned(), |n| format!("{n} energies"))
        );
    }
    Ok(())
}
