//! Written cases of rods that touch themselves.

use super::*;
use std::path::Path;

fn case(rest: &str) -> crate::Result<StaticCase> {
    let text = format!(
        "[rod]\nlength = 1.0\nelements = 8\nsection = [{{ until = 1.0, EI = 1.0 }}]\n[start]\ntype = \"clamped\"\n{rest}"
    );
    StaticCase::from_toml(&text, Path::new("case.toml"))
}

#[test]
fn surfaces_and_curves_that_cannot_be_are_refused_by_key() {
    for (rest, key) in [
        ("[self_contact]\nradius = 0.0", "self_contact.radius"),
        ("[self_contact]\nradius = 0.2", "self_contact.radius"),
        ("[self_contact]\nradius = 1e-9", "self_contact.radius"),
        ("[self_contact]\nradius = 0.01\nmodulus = -1.0", "self_contact.modulus"),
        ("[initial]\npoints = [[0.0, 0.0, 0.0]]", "initial.points"),
        ("[initial]\npoints = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]", "initial.points"),
    ] {
        let reported = case(rest).unwrap_err().to_string();
        assert!(reported.contains(key), "{reported}");
    }
    assert!(case("[self_contact]\nradius = 0.01").is_ok());
}

#[test]
fn a_rod_begins_along_the_curve_that_is_given() {
    // A quarter of a circle of radius 2/π.
    let points: Vec<[f64; 3]> = (0..=40)
        .map(|k| {
            let (sin, cos) = (f64::from(k) / 40.0 * std::f64::consts::FRAC_PI_2).sin_cos();
            [sin * 2.0 / std::f64::consts::PI, (1.0 - cos) * 2.0 / std::f64::consts::PI, 0.0]
        })
        .collect();
    let case = StaticCase { initial: Some(Initial { points, ..Initial::default() }), ..case("").unwrap() };
    let problem = StaticProblem::new(&case).unwrap();
    let tip = problem.initial.positions[8];
    let expected = crate::Vec3::new(1.0, 1.0, 0.0) * (2.0 / std::f64::consts::PI);
    assert!((tip - expected).norm() < 2e-3, "{tip}");
}

/// A rod of length 100 from the origin along x to a clamp at this place with this tangent.
fn between_clamps(
    place: [f64; 3],
    tangent: [f64; 3],
    elements: usize,
    radius: Option<f64>,
) -> StaticSolution {
    let rest = radius.map_or_else(String::new, |radius| format!("[self_contact]\nradius = {radius}\n"));
    let text = format!(
        "[rod]\nlength = 100.0\nelements = {elements}\nsection = [{{ until = 100.0, EI = 10.0, GJ = 7.7 }}]\n\
         [start]\ntype = \"clamped\"\n[end]\ntype = \"clamped\"\nposition = {place:?}\ntangent = {tangent:?}\n{rest}"
    );
    StaticCase::from_toml(&text, Path::new("case.toml")).unwrap().solve().unwrap()
}

#[test]
fn an_arch_whose_ends_are_near_does_not_begin_as_a_loop() {
    let x = [1.0, 0.0, 0.0];
    for elements in [60, 100] {
        for near in [40.0, 49.0] {
            let [through, touching] =
                [None, Some(0.5)].map(|radius| between_clamps([near, 0.0, 0.0], x, elements, radius));
            for found in [&through, &touching] {
                assert!(found.converged && found.stable, "{near}: {} {}", found.stop, found.negative_modes);
            }
            // It is as if nothing could touch: the way there is as free as the arch itself.
            assert!(touching.touching.is_empty());
            assert!((touching.energy.total / through.energy.total - 1.0).abs() < 1e-9, "{near}");
        }
    }
    // Off the axis, at nearly parallel tangents.
    let found = between_clamps([23.09, 1.6, 64.91], [0.993, -0.098, 0.069], 60, Some(0.4));
    assert!(found.converged && found.stable && found.touching.is_empty(), "{}", found.stop);
}

#[test]
fn a_loop_that_must_cross_itself_begins_beside_itself() {
    // The loop without a surface lies in a plane and passes through itself.
    for near in [12.0, 20.0, 30.0] {
        let [through, touching] =
            [None, Some(0.5)].map(|radius| between_clamps([near, 0.0, 0.0], [1.0, 0.0, 0.0], 60, radius));
        assert!(touching.converged && touching.stable, "{near}: {} {}", touching.stop, touching.residual);
        let more = touching.energy.total / through.energy.total - 1.0;
        assert!((0.0..0.05).contains(&more), "{near}: {more}");
    }
}

#[test]
fn what_does_not_converge_is_reported_what_sets_the_start() {
    let found =
        StaticSolution { converged: false, ..between_clamps([90.0, 0.0, 0.0], [1.0, 0.0, 0.0], 8, None) };
    assert!(found.failure().is_some_and(|reported| reported.contains("[initial] points")));
}
