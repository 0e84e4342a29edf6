use super::*;
use crate::contact::surface::ContactMesh;
use crate::contact::{Distance, Nearness, WallProperties};
use crate::random::{splitmix64, unit};
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution, SurfaceMesh, Wall};

const RADIUS_MM: f64 = 0.65;
const BEND_MM: f64 = 15.0;

/// Axis of a tube that is straight up to 0 and bends from there.
fn axis(s: f64) -> Vec3 {
    let angle = s.max(0.0) / BEND_MM;
    Vec3::new(s.min(0.0) + BEND_MM * libm::sin(angle), BEND_MM * (1.0 - libm::cos(angle)), 0.0)
}

/// A mesh of a tube about that axis with this radius at each arc length, and edges of this length.
fn tube(edge_mm: f64, radius_mm: impl Fn(f64) -> f64) -> Wall {
    let rows = (0..60).map(|k| {
        let s = 0.5 * f64::from(k) - 10.0;
        CentrelineNode { position_mm: axis(s), radius_mm: radius_mm(s), parent: (k as usize).checked_sub(1) }
    });
    let tree = CentrelineTree::new(rows.collect()).unwrap();
    GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap().wall
}

fn felt(wall: &Wall, thickest_mm: f64) -> ContactMesh {
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    ContactMesh::new(wall, thickest_mm, &properties, &NoStore).unwrap()
}

fn at(mesh: &ContactMesh, x: &Vec3) -> Distance {
    let triangle = mesh.query.nearest(x, 5.0).unwrap().triangle;
    match mesh.nearness(x, triangle, f64::INFINITY) {
        Nearness::Within(distance) => distance,
        other => panic!("{other:?}"),
    }
}

/// A point off the axis at an arc length, in a direction.
fn beside(s: f64, off_mm: f64, angle: f64) -> Vec3 {
    let turn = s.max(0.0) / BEND_MM;
    let inwards = Vec3::new(-libm::sin(turn), libm::cos(turn), 0.0);
    axis(s) + (inwards * libm::cos(angle) + Vec3::z() * libm::sin(angle)) * off_mm
}

#[test]
fn a_tube_of_any_fineness_is_round_to_a_device_that_fills_it() {
    for edge in [0.15, 0.25, 0.4] {
        let wall = tube(edge * RADIUS_MM, |_| RADIUS_MM);
        for share in [0.75, 0.99] {
            let mesh = felt(&wall, share * RADIUS_MM);
            let (mut off_mm, mut slope, mut worst) = (0.0f64, 0.0f64, 0.0);
            for k in 0..400 {
                let [s, angle, part] = [0, 1, 2].map(|n| unit(splitmix64(7, 3 * k + n)));
                let off = (1.0 - share) * RADIUS_MM * (0.5 + 0.7 * part);
                // Where the bend begins there is no such axis: it is smooth.
                let s = if s < 0.5 { -6.0 + 8.0 * s } else { 2.0 + 20.0 * (s - 0.5) };
                let d = at(&mesh, &beside(s, off, std::f64::consts::TAU * angle));
                let there = (d.value_mm - (RADIUS_MM - off)).abs();
                if there > off_mm {
                    worst = s;
                }
                off_mm = off_mm.max((d.value_mm - (RADIUS_MM - off)).abs());
                slope = slope.max((d.gradient.norm() - 1.0).abs());
            }
            // The play is 0.16 and 0.0065 mm.
            let ranges: Vec<_> = mesh.narrow().unwrap().tubes.iter().map(|tube| &tube.ranges).collect();
            assert!(
                off_mm < 2e-5 && slope < 1e-4,
                "edges {edge}, filled {share}: {off_mm:.1e} {slope:.1e} at {worst}, ranges {ranges:?}"
            );
        }
    }
}

#[test]
fn derivatives_are_those_of_the_distance_where_a_tube_joins_the_mesh() {
    // Twice as wide at its ends.
    let wall = tube(0.2 * RADIUS_MM, |s| RADIUS_MM * (1.0 + ((s - 4.0) / 10.0) * ((s - 4.0) / 10.0)));
    let mesh = felt(&wall, 0.8 * RADIUS_MM);
    let narrow = mesh.narrow().unwrap();
    let mut joined = 0;
    for k in 0..600 {
        let [s, angle, part] = [0, 1, 2].map(|n| unit(splitmix64(8, 3 * k + n)));
        let x = beside(-6.0 + 22.0 * s, 0.1 + 0.3 * part, std::f64::consts::TAU * angle);
        let triangle = mesh.query.nearest(&x, 5.0).unwrap().triangle;
        let Some(within) = narrow.at(&x, triangle) else { continue };
        joined += u32::from(!within.is_whole());
        let d = at(&mesh, &x);
        let h = 1e-5;
        for axis in 0..3 {
            let by = Vec3::ith(axis, h);
            let value = |y: &Vec3| match mesh.nearness(y, triangle, f64::INFINITY) {
                Nearness::Within(d) => d,
                other => panic!("{other:?}"),
            };
            let (before, after) = (value(&(x - by)), value(&(x + by)));
            let slope = (after.value_mm - before.value_mm) / (2.0 * h);
            assert!((slope - d.gradient[axis]).abs() < 1e-6, "{x}: {slope} {}", d.gradient[axis]);
            let bend = (after.gradient - before.gradient) / (2.0 * h);
            assert!((bend - d.hessian.column(axis)).norm() < 0.02, "{x}: {bend} {}", d.hessian);
        }
        // The two barely differ there, or the joint would push along the vessel.
        assert!((d.gradient.norm() - 1.0).abs() < 0.02, "{x}: {}", d.gradient.norm());
    }
    assert!(joined > 30, "{joined}");
}

#[test]
fn wide_lumens_and_sections_that_are_not_round_are_felt_as_meshes() {
    let wall = tube(0.2 * RADIUS_MM, |_| RADIUS_MM);
    assert!(felt(&wall, RADIUS_MM / 1.8).narrow().is_none());
    assert!(felt(&wall, RADIUS_MM / 1.6).narrow().is_some());
    // Thicker than the lumen.
    assert!(felt(&wall, 1.01 * RADIUS_MM).narrow().is_none());
    let flattened = |part: f64| {
        let SurfaceMesh { vertices_mm, triangles } = wall.mesh().clone();
        let vertices_mm = vertices_mm.into_iter().map(|x| Vec3::new(x.x, x.y, x.z * part)).collect();
        Wall::from_surface(&SurfaceMesh { vertices_mm, triangles }).unwrap()
    };
    assert!(felt(&flattened(0.9), 0.8 * RADIUS_MM).narrow().is_none());
    assert!(felt(&flattened(0.98), 0.8 * RADIUS_MM).narrow().is_some());
}

#[test]
fn tubes_do_not_depend_on_the_number_of_threads_or_on_earlier_ones() {
    let wall = tube(0.3 * RADIUS_MM, |_| RADIUS_MM);
    let [one, other] = [(); 2].map(|()| felt(&wall, 0.9 * RADIUS_MM));
    for k in 0..100 {
        let x = beside(0.1 * f64::from(k) - 4.0, 0.05, f64::from(k));
        assert_eq!(at(&one, &x), at(&other, &x));
    }
}
