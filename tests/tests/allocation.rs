//! Newton's method and the steps of an insertion allocate nothing.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties, WallRegion};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::statics::{StaticCase, StaticProblem};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use std::path::Path;

/// Allocations and iterations of a solve of an example case.
fn solve(problem: &StaticProblem) -> (u64, usize) {
    let mut solved = None;
    let counted = allocation_counter::measure(|| solved = problem.solve_state().ok());
    (
        counted.count_total,
        problem.solution(&solved.expect("an example case has a torsion stiffness")).iterations,
    )
}

#[test]
fn nothing_is_allocated_per_iteration() {
    // A line search, the way out of a saddle point, a dead moment, a force that follows, two held ends, twist.
    for name in ["tip_force", "column", "end_moment", "follower", "pinned", "clamped_turned", "bend_45"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../assets/cases/{name}.toml"));
        let case = StaticCase::from_file(&path).expect("an example case is valid");
        let mut problem = StaticProblem::new(&case).expect("an example case is valid");
        // What a solve sets up is allocated once, whatever it takes.
        let allocations = [2, 500].map(|most| {
            problem.limit_iterations(most);
            solve(&problem)
        });
        let [(few, two), (many, all)] = allocations;
        assert!(all > two, "{name}: {all} iterations");
        assert_eq!(few, many, "{name}: allocations of {two} and {all} iterations");
    }
}

#[test]
fn nothing_is_allocated_in_a_step_of_an_insertion() {
    for (friction, shaped, regions) in
        [(0.0, false, false), (0.1, false, false), (0.0, true, false), (0.0, false, true)]
    {
        let made =
            GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
        let mut tip = Section::straight(20.0, 0.445, 5.0);
        if shaped {
            tip.rest_curvature_per_mm = [0.02, 0.0];
        }
        let wire = Device::new(vec![tip, Section::straight(380.0, 0.445, 10.0)]).unwrap();
        let patch = WallRegion {
            centre_mm: Some([41.0, 0.0, 146.0]),
            radius_mm: Some(10.0),
            modulus_n_per_mm2: Some(30.0),
            friction: Some(0.1),
            ..WallRegion::default()
        };
        let region = if regions { vec![patch] } else { Vec::new() };
        let properties = WallProperties { friction, region, ..Default::default() };
        let method = KirchhoffOptions::default();
        let mut simulation = Simulation::builder(made.wall, wire, sheath)
            .properties(properties)
            .method(&method)
            .build()
            .unwrap();
        for _ in 0..75 {
            simulation.step(Command::advance(2.0)).unwrap();
        }
        let mut iterations = 0;
        let counted = allocation_counter::measure(|| {
            for k in 0..40 {
                let rotate_rad = if k % 4 == 0 { 0.05 } else { 0.0 };
                let advance_mm = if k % 5 == 4 { -0.7 } else { 0.6 };
                iterations += simulation
                    .step(Command { advance_mm, rotate_rad, ..Command::default() })
                    .unwrap()
                    .iterations;
            }
        });
        assert!(iterations > 80, "{iterations}");
        assert_eq!(counted.count_total, 0, "friction {friction}, shaped {shaped}, regions {regions}");
    }
}

#[test]
fn an_allocation_would_be_counted() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0.0; 10])));
    assert_eq!(counted.count_total, 1);
}
