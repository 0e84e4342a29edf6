//! Shapes with known path lengths, and comparisons.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::{
    Backend, CArmSpec, DetectorSpec, DevicePoint, DeviceView, InjectionSpec, Mode, Renderer, View, ViewSpec,
    XRaySpec,
};

/// A surface of revolution about z through the given (radius, height) profile from the bottom pole to the top
/// pole.
pub(crate) fn revolved(profile: &[(f64, f64)], sides: u32, centre: Vec3) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let inner = &profile[1..profile.len() - 1];
    for &(r, z) in inner {
        for k in 0..sides {
            let (s, c) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            mesh.vertices_mm.push(centre + Vec3::new(r * c, r * s, z));
        }
    }
    let next = |k: u32| (k + 1) % sides;
    for ring in 0..inner.len() as u32 - 1 {
        for k in 0..sides {
            let [a, b] = [ring * sides + k, ring * sides + next(k)];
            mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    let top_ring = (inner.len() as u32 - 1) * sides;
    let bottom = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.push(centre + Vec3::z() * profile[0].1);
    mesh.vertices_mm.push(centre + Vec3::z() * profile[profile.len() - 1].1);
    for k in 0..sides {
        mesh.triangles.push([bottom, next(k), k]);
        mesh.triangles.push([bottom + 1, top_ring + k, top_ring + next(k)]);
    }
    mesh
}

pub(crate) fn sphere(radius: f64, rings: u32, centre: Vec3) -> SurfaceMesh {
    let profile: Vec<(f64, f64)> = (0..=rings)
        .map(|i| {
            let (s, c) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
            (radius * s, -radius * c)
        })
        .collect();
    revolved(&profile, 2 * rings, centre)
}

/// A cylinder about z.
pub(crate) fn cylinder(radius: f64, half_height: f64, sides: u32, centre: Vec3) -> SurfaceMesh {
    let profile = [(0.0, -half_height), (radius, -half_height), (radius, half_height), (0.0, half_height)];
    revolved(&profile, sides, centre)
}

/// The two meshes as one.
pub(crate) fn joined(a: &SurfaceMesh, b: &SurfaceMesh) -> SurfaceMesh {
    let offset = a.vertices_mm.len() as u32;
    let mut both = a.clone();
    both.vertices_mm.extend(&b.vertices_mm);
    both.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + offset)));
    both
}

/// The mesh with its inside out: a hole in what surrounds it.
pub(crate) fn inverted(mesh: &SurfaceMesh) -> SurfaceMesh {
    let mut mesh = mesh.clone();
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// A device along points with tangents by central differences of `at` over 0 to 1.
pub(crate) fn device(points: usize, radius_mm: f64, at: impl Fn(f64) -> Vec3) -> DeviceView {
    let points = (0..points)
        .map(|i| {
            let w = i as f64 / (points - 1) as f64;
            DevicePoint { position_mm: at(w), tangent: at(w + 1e-6) - at(w - 1e-6), radius_mm }
        })
        .collect();
    DeviceView { points, ..DeviceView::default() }
}

/// A fluoroscopic view with the isocentre at the origin, at 60 keV on an ideal detector, with an exposure that is
/// held.
pub(crate) fn spec(backend: Backend, size: u32, pixel_mm: f64) -> ViewSpec {
    ViewSpec {
        size_px: [size, size],
        views: vec![View::Fluoro],
        backend,
        xray: XRaySpec { energy_kev: Some(60.0), harmonised: 0.0, brightness_s: 0.0, ..XRaySpec::default() },
        detector: DetectorSpec::ideal(),
        c_arm: CArmSpec { pixel_mm: Some(pixel_mm), isocentre_mm: Some([0.0; 3]), ..CArmSpec::default() },
        ..ViewSpec::default()
    }
}

/// A renderer on an adapter. Without one: a failure where ENDOWIRE_REQUIRE_GPU=1 asks for it, else `None` and
/// a message.
pub(crate) fn on_gpu(spec: &ViewSpec, wall: &SurfaceMesh) -> Option<Renderer> {
    let spec = ViewSpec { backend: Backend::Gpu, ..spec.clone() };
    match Renderer::new(&spec, wall) {
        Ok(renderer) => Some(renderer),
        Err(error) => {
            let required = std::env::var("ENDOWIRE_REQUIRE_GPU").is_ok_and(|v| v == "1");
            assert!(!required, "ENDOWIRE_REQUIRE_GPU=1, but: {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// The renderers to test: the CPU, and an adapter if there is one.
pub(crate) fn engines(spec: &ViewSpec, wall: &SurfaceMesh) -> Vec<Renderer> {
    let cpu = ViewSpec { backend: Backend::Cpu, ..spec.clone() };
    let mut all = vec![Renderer::new(&cpu, wall).expect("a valid scene")];
    all.extend(on_gpu(spec, wall));
    all
}

/// Length of a line (unit direction) inside a sphere.
pub(crate) fn sphere_chord(radius: f64, centre: Vec3, (origin, direction): (Vec3, Vec3)) -> f64 {
    let d2 = (centre - origin).cross(&direction).norm_squared();
    2.0 * (radius * radius - d2).max(0.0).sqrt()
}

/// Length of a line (unit direction) inside an infinite cylinder about z through the origin.
pub(crate) fn cylinder_chord(radius: f64, (origin, direction): (Vec3, Vec3)) -> f64 {
    let [o, d] = [origin, direction].map(|v| v.xy());
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - radius * radius);
    2.0 * (b * b - a * c).max(0.0).sqrt() / a
}

/// Mean of the absolute differences.
pub(crate) fn mean_difference(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64
}

/// The pixel centre of a row-by-row index.
pub(crate) fn pixel_centre(index: usize, width: u32) -> [f64; 2] {
    let width = width as usize;
    [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5]
}

/// The folder of the vessels that come with the project.
pub(crate) fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels")
}

/// The surface of one of them, closed.
pub(crate) fn wall(vessel: &str) -> SurfaceMesh {
    let surface = SurfaceMesh::read(&assets().join(format!("{vessel}.stl")), 1.0).unwrap();
    Wall::from_surface(&surface).unwrap().closed_mesh()
}

/// Contrast medium that comes in at an end of the vessel.
pub(crate) fn with_injection(mut view: ViewSpec, vessel: &str, inlet_mm: [f64; 3], mode: Mode) -> ViewSpec {
    view.xray.mode = mode;
    view.flow.tree = Some(assets().join(format!("{vessel}.csv")));
    view.flow.inlet_mm = Some(inlet_mm);
    view.injection = vec![InjectionSpec {
        start_s: 0.0,
        duration_s: 1.5,
        rate_ml_per_s: 20.0,
        at_mm: None,
        at_tip: false,
    }];
    view
}
