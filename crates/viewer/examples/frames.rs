//! Both views of a wire in a bent vessel, written as PNG files.
//!
//! `cargo run -p endowire-viewer --example frames -- [FOLDER] [auto|gpu|cpu]`

use std::f64::consts::TAU;
use std::time::Instant;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Result, Vec3};
use endowire_viewer::{Backend, DevicePoint, DeviceView, Material, Renderer, View, ViewSpec};

/// Centre line of the vessel at `w` from 0 to 1: up, over an arch, and down in front.
fn centre_line(w: f64) -> Vec3 {
    let a = std::f64::consts::PI * (1.25 * w - 0.1);
    Vec3::new(-45.0 * a.cos(), 18.0 * (2.0 * w).sin(), 60.0 * a.sin() - 20.0 * w)
}

fn direction(w: f64) -> Vec3 {
    (centre_line(w + 1e-5) - centre_line(w - 1e-5)).normalize()
}

/// A tube swept along the centre line, closed by flat caps, counter-clockwise seen from outside.
fn vessel(rings: u32, sides: u32) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let mut across = Vec3::y();
    for i in 0..=rings {
        let w = f64::from(i) / f64::from(rings);
        let t = direction(w);
        across = (across - t * across.dot(&t)).normalize();
        let other = t.cross(&across);
        let radius = 8.0 - 3.0 * w + 0.5 * (14.0 * w).sin();
        for k in 0..sides {
            let (s, c) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            mesh.vertices_mm.push(centre_line(w) + (across * c + other * s) * radius);
        }
    }
    for i in 0..rings {
        for k in 0..sides {
            let [a, b] = [i * sides + k, i * sides + (k + 1) % sides];
            mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    for (ring, end) in [(0, 0.0), (rings, 1.0)] {
        let hub = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.push(centre_line(end));
        for k in 0..sides {
            let [a, b] = [ring * sides + k, ring * sides + (k + 1) % sides];
            mesh.triangles.push(if ring == 0 { [hub, b, a] } else { [hub, a, b] });
        }
    }
    mesh
}

/// A wire inserted up to `reach` (0 to 1), swaying from wall to wall.
fn wire(reach: f64, radius_mm: f64, points: usize) -> DeviceView {
    let at = |w: f64| centre_line(w) + Vec3::new(0.0, 3.0, 1.5) * (9.0 * w).sin();
    let points = (0..points)
        .map(|i| {
            let w = reach * i as f64 / (points - 1) as f64;
            DevicePoint { position_mm: at(w), tangent: at(w + 1e-5) - at(w - 1e-5), radius_mm }
        })
        .collect();
    DeviceView { points, material: Some(Material::Nitinol), ..DeviceView::default() }
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map_or_else(std::env::temp_dir, Into::into);
    let backend = match arguments.next().as_deref() {
        Some("gpu") => Backend::Gpu,
        Some("cpu") => Backend::Cpu,
        _ => Backend::Auto,
    };
    let wall = vessel(200, 50);
    for (name, contrast_fraction) in [("blood", 0.0), ("contrast", 0.15)] {
        let mut spec = ViewSpec { views: vec![View::ThreeD, View::Fluoro], backend, ..ViewSpec::default() };
        spec.xray.contrast_fraction = contrast_fraction;
        let start = Instant::now();
        let mut renderer = Renderer::new(&spec, &wall)?;
        println!("{name}: {} prepared in {:.1?}", renderer.backend(), start.elapsed());
        let start = Instant::now();
        let frames = renderer.render(&[wire(0.8, 0.18, 300)])?;
        println!("  first frame in {:.1?}", start.elapsed());
        let start = Instant::now();
        for k in 0..10 {
            renderer.render(&[wire(0.7 + 0.01 * f64::from(k), 0.18, 300)])?;
        }
        println!("  then {:.1?} a frame of both views", start.elapsed() / 10);
        for (view, image) in [("3d", frames.three_d), ("fluoro", frames.fluoro)] {
            if let Some(image) = image {
                let path = folder.join(format!("{name}-{view}.png"));
                image.write_png(&path)?;
                println!("  {}", path.display());
            }
        }
    }
    Ok(())
}
