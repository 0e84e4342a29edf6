//! Static rods that touch themselves.

use super::*;
use std::f64::consts::{PI, TAU};

fn trefoil(elements: usize, radius: f64) -> StaticCase {
    let points: Vec<[f64; 3]> = (0..=600)
        .map(|i| {
            let a = TAU * f64::from(i) / 600.0;
            let r = 2.0 + 0.5 * (3.0 * a).cos();
            [r * (2.0 * a).cos(), r * (2.0 * a).sin(), 0.5 * (3.0 * a).sin()]
        })
        .collect();
    let tangent = [points[1][0] - points[0][0], points[1][1] - points[0][1], points[1][2] - points[0][2]];
    let text = format!(
        r#"
        [rod]
        length = 1.0
        elements = {elements}
        section = [{{ until = 1.0, EI = 1.0 }}]
        [start]
        type = "clamped"
        position = [0.0, 0.0, 0.0]
        tangent = {tangent:?}
        [end]
        type = "clamped"
        position = [0.0, 0.0, 0.0]
        tangent = {tangent:?}
        [self_contact]
        radius = {radius:e}
        [solver]
        max_iterations = 2000
        "#
    );
    let mut case = StaticCase::from_toml(&text, std::path::Path::new("trefoil")).unwrap();
    case.initial = Some(Initial { points, ..Initial::default() });
    case
}

#[test]
fn a_trefoil_is_nearly_a_double_circle() {
    let elements = std::env::var("N").map_or(96, |n| n.parse().unwrap());
    let radius = std::env::var("R").map_or(5e-3, |n| n.parse().unwrap());
    let problem = StaticProblem::new(&trefoil(elements, radius)).unwrap();
    let start = std::time::Instant::now();
    let solved = problem.solve_state().unwrap();
    println!("{:?}", start.elapsed());
    let solution = problem.solution(&solved);
    println!("{} {} {} {:e}", solution.iterations, solution.stop, solution.stable, solution.residual);
    println!("E L/B {} of {}", solution.energy.total, 8.0 * PI * PI);
    println!(
        "{} touching, deepest {:e}",
        solution.touching.len(),
        solution.touching.iter().map(|t| t.penetration).fold(0.0, f64::max) / radius
    );
    let total: f64 = solution.touching.iter().map(|t| t.force).sum();
    println!("force {total}");
    assert!(solution.converged);
}
