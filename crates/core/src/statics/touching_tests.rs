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
        let told = case(rest).unwrap_err().to_string();
        assert!(told.contains(key), "{told}");
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
