//! Renderer with failing adapters.

use super::*;
use crate::engine::ThreeDEngine;
use crate::spec::View;

/// An adapter that fails in every frame.
struct Broken;

fn lost<T>() -> Result<T> {
    Err(Error::Computation("the device was lost".into()))
}

impl PathEngine for Broken {
    fn mesh(&mut self, _: &CArm, _: &SurfaceMesh) -> Result<Vec<f32>> {
        lost()
    }
}

impl ThreeDEngine for Broken {
    fn frame(&mut self, _: &Solids) -> Result<Image> {
        lost()
    }
}

#[test]
fn a_lost_adapter_hands_over_to_the_cpu_and_says_so() {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let spec = ViewSpec {
        views: vec![View::ThreeD, View::Fluoro],
        size_px: [32, 32],
        backend: Backend::Cpu,
        ..ViewSpec::default()
    };
    let mut whole = Renderer::new(&spec, &wall).unwrap();
    let point = |x: f64| crate::DevicePoint {
        position_mm: Vec3::new(x, 5.0, 5.0),
        tangent: Vec3::x(),
        radius_mm: 0.4,
    };
    let wire = [DeviceView { points: vec![point(1.0), point(20.0)], ..DeviceView::default() }];
    let broken = || {
        let mut renderer = Renderer::new(&spec, &wall).unwrap();
        renderer.engines = Engines {
            paths: Some(Box::new(Broken)),
            three_d: Some(Box::new(Broken)),
            #[cfg(feature = "gpu")]
            later: None,
            name: "adapter".into(),
            process: std::process::id(),
        };
        renderer
    };
    let mut renderer = Renderer { is_cpu: false, ..broken() };
    let first = whole.render(&wire).unwrap();
    assert_eq!(renderer.render(&wire).unwrap(), first);
    assert_eq!(renderer.backend(), "CPU reference (adapter failed: the device was lost)");
    assert_eq!(renderer.path_lengths(&wire).unwrap(), whole.path_lengths(&wire).unwrap());
    // Engines created by the parent of a forked process are not used at all.
    let mut renderer = Renderer { is_cpu: false, ..broken() };
    renderer.engines.process += 1;
    assert_eq!(renderer.render(&wire).unwrap(), first);
    assert_eq!(renderer.backend(), "CPU reference (adapter failed: it does not outlive a fork)");
    // Counter-check: without a fallback, the failure is reported.
    assert!(broken().render(&wire).is_err());
}
