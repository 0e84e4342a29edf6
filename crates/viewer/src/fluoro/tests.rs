//! Similar rays of a pixel.

use endowire_core::vessel::SurfaceMesh;

use super::*;
use crate::cpu;
use crate::spec::{TorsoSpec, View};

#[test]
fn mean_lengths_of_rays_that_are_alike_tell_their_mean_signal() {
    let wall = SurfaceMesh {
        vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let mut spec = ViewSpec { views: vec![View::Fluoro], size_px: [128, 128], ..ViewSpec::default() };
    spec.patient.torso = Some(TorsoSpec::default());
    spec.c_arm.field_mm = Some(100.0);
    let setup = Setup::new(&spec, &wall).unwrap();
    let scope = Fluoroscope::new(&setup, setup.c_arm.as_ref().unwrap(), None, &mut cpu::CpuPaths).unwrap();
    let (mut alike, mut worst, mut without) = (0, 0.0_f64, 0.0_f64);
    let room = &mut Room::default();
    for pixel in 0..128 * 128 {
        let (first, stride) = scope.first_ray(pixel);
        let rays = [first, first + 1, first + stride, first + stride + 1];
        let layers = rays.map(|ray| scope.layers(ray, [0.0; 2]));
        let Some((_, more)) = scope.alike(&layers) else { continue };
        alike += 1;
        let [every, mean] =
            [scope.of_rays(&layers, &mut Lanes::new())[0], scope.primary(pixel, [0.0; 2], room)[0]];
        worst = worst.max((f64::from(mean) / f64::from(every) - 1.0).abs());
        without = without.max((f64::from(mean / more) / f64::from(every) - 1.0).abs());
    }
    assert!(alike > 128 * 128 / 3, "{alike}");
    assert!(worst < 1e-5, "{worst}");
    assert!(without > 2e-5, "the twin: without the variance {without}");
}
