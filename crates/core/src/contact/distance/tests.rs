//! Tests of the smooth distance on a tube.

use super::*;
use crate::vessel::{GeneratedWall, Resolution, WallQuery, anatomy};

/// A tube of radius 4 mm about the z axis.
fn tube(edge_mm: f64) -> (SmoothWall, WallQuery) {
    let wall = GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(edge_mm))
        .unwrap()
        .wall;
    (SmoothWall::new(&wall, 4.0), WallQuery::new(&wall).unwrap())
}

fn at(wall: &(SmoothWall, WallQuery), x: &Vec3) -> Distance {
    wall.0.distance(x, wall.1.nearest(x, 10.0).unwrap().triangle).unwrap()
}

/// Points of all heights from the wall to near the axis.
fn points() -> impl Iterator<Item = Vec3> {
    (0..200).map(|i| {
        let (angle, r) = (2.399 * f64::from(i), 2.1 + 1.8 * (f64::from(i) * 0.37).sin());
        Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i))
    })
}

#[test]
fn derivatives_are_those_of_the_value() {
    let wall = tube(1.0);
    let h = 1e-5;
    for x in points() {
        let here = at(&wall, &x);
        for k in 0..3 {
            let e = Vec3::ith(k, h);
            let (plus, minus) = (at(&wall, &(x + e)), at(&wall, &(x - e)));
            assert!(((plus.value_mm - minus.value_mm) / (2.0 * h) - here.gradient[k]).abs() < 1e-8);
            let column = (plus.gradient - minus.gradient) / (2.0 * h);
            assert!((column - here.hessian.column(k)).norm() < 1e-5, "column {k}");
        }
    }
}

/// A position in the tube, at a height over the wall that may be negative.
fn from_inside(wall: &(SmoothWall, WallQuery), i: i32, height_mm: f64) -> (Vec3, Distance) {
    let angle = 2.399 * f64::from(i);
    let on = |r: f64| Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i));
    let triangle = wall.1.nearest(&on(3.8), 10.0).unwrap().triangle;
    let x = on(4.0 - height_mm);
    (x, wall.0.distance(&x, triangle).unwrap())
}

#[test]
fn behind_the_surface_the_distance_goes_on_as_in_front() {
    let wall = tube(1.0);
    for i in 0..200 {
        // Across the surface.
        let (x, front) = from_inside(&wall, i, 0.0);
        let n = front.gradient / front.gradient.norm();
        let x = x - n * front.value_mm;
        let triangle = wall.1.nearest(&x, 10.0).unwrap().triangle;
        let (front, back) =
            (wall.0.distance(&(x + n * 1e-6), triangle), wall.0.distance(&(x - n * 1e-6), triangle));
        let (front, back) = (front.unwrap(), back.unwrap());
        assert!(front.value_mm > 0.0 && back.value_mm < 0.0);
        assert!((front.value_mm - back.value_mm - 2e-6).abs() < 1e-8, "{front:?} {back:?}");
        assert!((front.gradient - back.gradient).norm() < 1e-5);
        // Deep behind it.
        for height in [-0.3, -2.0, -20.0] {
            let (x, here) = from_inside(&wall, i, height);
            assert!((here.value_mm - height).abs() < 2e-3 * (1.0 - height), "{height}: {here:?}");
            let (h, triangle) = (1e-5, wall.1.nearest(&x, 100.0).unwrap().triangle);
            let here = wall.0.distance(&x, triangle).unwrap();
            let at = |x: Vec3| wall.0.distance(&x, triangle).unwrap();
            for k in 0..3 {
                let (plus, minus) = (at(x + Vec3::ith(k, h)), at(x - Vec3::ith(k, h)));
                let slope = (plus.value_mm - minus.value_mm) / (2.0 * h);
                assert!((slope - here.gradient[k]).abs() < 1e-7, "{slope} {here:?}");
                let column = (plus.gradient - minus.gradient) / (2.0 * h);
                assert!((column - here.hessian.column(k)).norm() < 1e-5);
            }
        }
    }
}

#[test]
fn a_point_beyond_the_limit_is_reported_its_distance_alone() {
    let wall = tube(1.0);
    for x in points() {
        let triangle = wall.1.nearest(&x, 10.0).unwrap().triangle;
        let here = wall.0.distance(&x, triangle).unwrap();
        let within = |limit_mm: f64| wall.0.within(&x, triangle, limit_mm).unwrap().0;
        assert_eq!(within(here.value_mm), Nearness::Beyond(here.value_mm));
        assert_eq!(within(here.value_mm + 1e-9), Nearness::Within(here));
    }
}

/// Largest error of the distance from the wall of the tube at a height over its radius.
fn error(wall: &(SmoothWall, WallQuery), height: f64) -> f64 {
    let off = |i: i32| {
        let (angle, r) = (2.399 * f64::from(i), 4.0 * (1.0 - height));
        let x = Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 + 0.1 * f64::from(i));
        (at(wall, &x).value_mm - 4.0 * height).abs()
    };
    (0..200).map(off).fold(0.0, f64::max)
}

#[test]
fn a_tube_is_met_far_better_than_by_its_triangles() {
    let (coarse, fine) = (error(&tube(1.0), 0.1), error(&tube(0.5), 0.1));
    assert!(coarse / fine > 8.0, "{coarse:e} {fine:e}");
    // The flat triangles deviate by edge²/8R.
    assert!(fine < 0.5 * 0.5 / (8.0 * 4.0) / 60.0, "{fine:e}");
}

#[test]
fn a_device_that_nearly_fills_the_tube_is_met_as_well() {
    let wall = tube(0.5);
    let thin = error(&wall, 0.1);
    for height in [0.5, 0.7, 0.8] {
        let close = error(&wall, height);
        assert!(close < 1.1 * thin, "{height}: {close:e}, thin {thin:e}");
    }
    assert!(error(&wall, 0.9) < 2e-4 && error(&wall, 0.95) < 1e-3);
}

#[test]
fn the_value_does_not_depend_on_the_triangle_it_is_asked_from() {
    let (smooth, query) = tube(1.0);
    for x in points() {
        let here = smooth.distance(&x, query.nearest(&x, 10.0).unwrap().triangle).unwrap();
        let lateral = Vec3::new(-x.y, x.x, 1.2) * 0.06;
        let there = smooth.distance(&x, query.nearest(&(x + lateral), 10.0).unwrap().triangle).unwrap();
        assert_eq!(here.value_mm.to_bits() >> 8, there.value_mm.to_bits() >> 8);
    }
}
