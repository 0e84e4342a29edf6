//! What frames show, and what is refused.

use crate::common;

use common::*;
use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Vec3};
use endowire_viewer::{Backend, DeviceView, Material, Renderer, View, ViewSpec};

#[test]
fn the_drawn_tip_is_where_project_says() {
    // A ball-like tip: a device as short as it is wide. Its spot's centroid in −ln T is its projected centre.
    let wall = sphere(60.0, 24, Vec3::zeros());
    let mut spec = spec(Backend::Cpu, 400, 0.3);
    spec.c_arm.primary_deg = 20.0;
    spec.c_arm.secondary_deg = -10.0;
    spec.xray.tissue_mm = 0.0;
    spec.xray.window = Some([-1.0, 6.0]);
    for tip in [Vec3::new(10.3, -20.2, 14.9), Vec3::new(-25.0, 12.0, -31.0), Vec3::new(0.21, 0.1, 0.33)] {
        let spot = device(3, 0.6, |w| tip + Vec3::new(0.0, 0.0, 1.2 * (w - 0.5)));
        for mut renderer in engines(&spec, &wall) {
            let bare = renderer.render(&[]).unwrap().fluoro.unwrap();
            let with = renderer.render(std::slice::from_ref(&spot)).unwrap().fluoro.unwrap();
            let (mut sum, mut at) = (0.0, [0.0; 2]);
            for (i, (bare, with)) in bare.data().iter().zip(with.data()).enumerate() {
                let darker = f64::from(*bare) - f64::from(*with);
                let pixel = pixel_centre(i, 400);
                sum += darker;
                at = [at[0] + darker * pixel[0], at[1] + darker * pixel[1]];
            }
            let [u, v] = renderer.c_arm().unwrap().project(&tip);
            let off = ((at[0] / sum - u).powi(2) + (at[1] / sum - v).powi(2)).sqrt();
            assert!(sum > 100.0 && off < 0.1, "{}: {off} pixel", renderer.backend());
            // The twin: half a pixel of confusion about centres would be seen.
            let off = ((at[0] / sum - u - 0.5).powi(2) + (at[1] / sum - v).powi(2)).sqrt();
            assert!(off > 0.1);
        }
    }
}

#[test]
fn transmission_follows_beer_lambert_with_nested_materials() {
    let wall = sphere(10.0, 80, Vec3::zeros());
    let wire = DeviceView {
        material: Some(Material::Nitinol),
        ..device(5, 0.5, |w| Vec3::new(0.0, 0.0, 10.0 * (w - 0.5)))
    };
    let mut spec = spec(Backend::Cpu, 65, 0.2);
    spec.xray.contrast_fraction = 0.25;
    for mut renderer in engines(&spec, &wall) {
        let paths = renderer.path_lengths(std::slice::from_ref(&wire)).unwrap();
        let transmission = renderer.transmission(&paths).unwrap();
        let centre = paths.index(32, 32);
        // Table values at 60 keV in 1/cm; lengths in cm.
        let lumen = 0.75 * 0.217 + 0.25 * 3.01;
        let p = 0.203 * (20.0 - 2.0) + lumen * (2.0 - 0.1) + 7.62 * 0.1;
        let seen = -f64::from(transmission[centre]).ln();
        assert!((seen / p - 1.0).abs() < 2e-3, "{}: {seen}, not {p}", renderer.backend());

        // The picture shows the same: white at the lower, black at the upper end of the window.
        let mut flat = spec.clone();
        flat.xray.window = Some([p - 1.0, p + 1.0]);
        for mut renderer in engines(&flat, &wall) {
            let image = renderer.render(std::slice::from_ref(&wire)).unwrap().fluoro.unwrap();
            let grey = f64::from(image.pixel(32, 32).unwrap()[0]);
            assert!((grey - 127.5).abs() < 3.0, "{}: {grey}", renderer.backend());
        }
    }
}

#[test]
fn contrast_darkens_the_vessel_and_blood_barely_does() {
    let step = |fraction: f64| {
        let mut spec = spec(Backend::Cpu, 101, 0.5);
        spec.xray.contrast_fraction = fraction;
        let image = Renderer::new(&spec, &sphere(8.0, 40, Vec3::zeros()))
            .unwrap()
            .render(&[])
            .unwrap()
            .fluoro
            .unwrap();
        f64::from(image.pixel(3, 3).unwrap()[0]) - f64::from(image.pixel(50, 50).unwrap()[0])
    };
    assert!(step(0.0) > 3.0 && step(0.0) < 30.0, "{}", step(0.0));
    assert!(step(0.2) > 60.0, "{}", step(0.2));
}

#[test]
fn only_what_is_asked_for_is_built_and_drawn() {
    let wall = sphere(10.0, 12, Vec3::zeros());
    for views in [vec![], vec![View::ThreeD], vec![View::Fluoro], vec![View::ThreeD, View::Fluoro]] {
        let spec = ViewSpec { views: views.clone(), size_px: [40, 30], ..ViewSpec::default() };
        let mut renderer = Renderer::new(&spec, &wall).unwrap();
        let frames = renderer.render(&[]).unwrap();
        assert_eq!(frames.three_d.is_some(), views.contains(&View::ThreeD));
        assert_eq!(frames.fluoro.is_some(), views.contains(&View::Fluoro));
        assert_eq!(renderer.path_lengths(&[]).is_ok(), views.contains(&View::Fluoro));
    }
    // Nothing wanted: not even the wall is looked at.
    assert!(Renderer::new(&ViewSpec::default(), &SurfaceMesh::default()).is_ok());
}

#[test]
fn a_thin_wire_stays_visible_in_a_large_3d_scene() {
    let wall = cylinder(12.0, 200.0, 48, Vec3::zeros());
    let wire = device(40, 0.1, |w| Vec3::new(0.0, 0.0, 300.0 * w - 150.0));
    let spec = ViewSpec { views: vec![View::ThreeD], size_px: [300, 300], ..ViewSpec::default() };
    for mut renderer in engines(&spec, &wall) {
        let bare = renderer.render(&[]).unwrap().three_d.unwrap();
        let with = renderer.render(std::slice::from_ref(&wire)).unwrap().three_d.unwrap();
        for y in (60..240).step_by(7) {
            let darker = (0..300)
                .filter(|&x| bare.pixel(x, y).unwrap()[0].saturating_sub(with.pixel(x, y).unwrap()[0]) > 60);
            let count = darker.count();
            assert!((1..=5).contains(&count), "{}: {count} pixels in row {y}", renderer.backend());
        }
    }
}

#[test]
fn the_wall_hides_nothing_and_covers_what_is_behind_it() {
    // A device inside is seen through one sheet, one behind the vessel through two.
    let wall = sphere(10.0, 48, Vec3::zeros());
    let mut spec = ViewSpec { views: vec![View::ThreeD], size_px: [200, 200], ..ViewSpec::default() };
    spec.camera.azimuth_deg = Some(0.0);
    for mut renderer in engines(&spec, &wall) {
        let mut red_at = |y: f64| {
            let rod = device(3, 1.0, |w| Vec3::new(4.0 * (w - 0.5), y, 0.0));
            i32::from(renderer.render(&[rod]).unwrap().three_d.unwrap().pixel(100, 100).unwrap()[0])
        };
        let [before, inside, behind] = [red_at(-12.0), red_at(0.0), red_at(12.0)];
        assert!(before < inside - 8 && inside < behind - 8, "{before} {inside} {behind}");
    }
}

#[test]
fn walls_without_an_inside_are_refused_where_contrast_medium_is_in_them() {
    let plain = spec(Backend::Cpu, 32, 1.0);
    let mut spec = plain.clone();
    spec.xray.contrast_fraction = 0.5;
    let good = sphere(5.0, 8, Vec3::zeros());
    let mut open = good.clone();
    open.triangles.pop();
    let mut flipped = good.clone();
    flipped.triangles[5].swap(0, 1);
    let mut broken = good.clone();
    broken.triangles[0][0] = 10_000;
    let mut poisoned = good.clone();
    poisoned.vertices_mm[3].y = f64::NAN;
    let three_d = ViewSpec { views: vec![View::ThreeD], ..spec.clone() };
    assert!(Renderer::new(&three_d, &open).is_ok(), "the 3D view needs no inside");
    for mesh in [&open, &flipped, &inverted(&good)] {
        assert!(Renderer::new(&plain, mesh).is_ok(), "without contrast medium nothing shows the inside");
    }
    for (mesh, word) in [
        (open, "open"),
        (flipped, "wound"),
        (inverted(&good), "inside out"),
        (broken, "does not exist"),
        (poisoned, "not finite"),
        (SurfaceMesh::default(), "no triangles"),
    ] {
        match Renderer::new(&spec, &mesh) {
            Err(Error::Mesh(text)) => assert!(text.contains(word), "{text}"),
            other => panic!("{word}: {other:?}"),
        }
    }
    // The same surface with every triangle's corners repeated is closed all the same.
    let soup = SurfaceMesh {
        vertices_mm: (0..good.triangles.len()).flat_map(|i| good.corners(i)).collect(),
        triangles: (0..good.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    };
    assert!(Renderer::new(&spec, &soup).is_ok());
}

#[test]
fn a_device_throws_its_shadow_where_it_is_between_source_and_detector() {
    let wall = sphere(5.0, 8, Vec3::zeros());
    for mut renderer in engines(&spec(Backend::Cpu, 32, 1.0), &wall) {
        let bare = renderer.render(&[]).unwrap();
        let behind = device(2, 0.5, |w| Vec3::new(0.0, 1000.0 + w, 0.0));
        assert_eq!(renderer.render(&[behind]).unwrap(), bare);
        // From the isocentre through the source: what is in front of it is drawn.
        let through = device(200, 0.5, |w| Vec3::new(8.0 * (1.0 - w), 1500.0 * w, 0.0));
        assert_ne!(renderer.render(&[through]).unwrap(), bare);
    }
}

#[test]
fn devices_that_are_not_finite_are_refused_by_name() {
    let wall = sphere(5.0, 8, Vec3::zeros());
    for mut renderer in engines(&spec(Backend::Cpu, 32, 1.0), &wall) {
        let mut bad = device(2, 0.5, |w| Vec3::x() * w);
        bad.points[1].position_mm.z = f64::NAN;
        let error = renderer.render(&[bad]).unwrap_err().to_string();
        assert!(error.contains("device.points[1]"), "{error}");
        assert!(renderer.render(&[]).is_ok(), "a refused device spoils nothing");
    }
}

#[test]
fn the_c_arm_is_in_a_3d_view_without_fluoroscopy_too() {
    let wall = sphere(30.0, 16, Vec3::zeros());
    let spec = |views: Vec<View>, c_arm: bool| {
        let mut spec = ViewSpec { views, size_px: [200, 200], backend: Backend::Cpu, ..ViewSpec::default() };
        spec.camera.c_arm = c_arm;
        spec
    };
    let frame = |spec: &ViewSpec| Renderer::new(spec, &wall).unwrap().render(&[]).unwrap();
    let alone = frame(&spec(vec![View::ThreeD], true));
    let both = frame(&spec(vec![View::ThreeD, View::Fluoro], true));
    assert!(alone.fluoro.is_none() && alone.three_d == both.three_d);
    assert!(alone.three_d != frame(&spec(vec![View::ThreeD], false)).three_d, "the twin");
}
