//! Newton's method allocates for its report and nothing per iteration.

use endowire_core::rod::{PLAIN, TWISTED};
use endowire_core::solve::{Newton, NewtonOptions};
use endowire_core::statics::{StaticCase, StaticProblem};
use std::path::Path;

/// Allocations and iterations of a solve of an example case with memory that one solve has warmed.
fn solve<const C: usize>(problem: &StaticProblem, max_iterations: usize) -> (u64, usize) {
    let mut newton = Newton::<C>::new(problem.elements.len());
    let mut last = (0, 0);
    for _ in 0..2 {
        let (mut state, mut supports) = (problem.initial.clone(), problem.supports.clone());
        let mut loads = problem.loads.clone();
        supports.begin(&state);
        let options = NewtonOptions { max_iterations, ..problem.options };
        let mut iterations = 0;
        let counted = allocation_counter::measure(|| {
            let report = newton.solve(&problem.elements, &mut supports, &mut loads, &mut state, &options);
            iterations = report.iterations;
        });
        last = (counted.count_total, iterations);
    }
    last
}

#[test]
fn nothing_is_allocated_per_iteration() {
    // A line search, the way out of a saddle point, a dead moment, a force that follows, two held ends, twist.
    for name in ["tip_force", "column", "end_moment", "follower", "pinned", "clamped_turned", "bend_45"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../assets/cases/{name}.toml"));
        let case = StaticCase::from_file(&path).expect("an example case is valid");
        let problem = StaticProblem::new(&case).expect("an example case is valid");
        let count = |limit| {
            if problem.twisted { solve::<TWISTED>(&problem, limit) } else { solve::<PLAIN>(&problem, limit) }
        };
        let (few, two) = count(2);
        let (many, all) = count(500);
        assert!(all > two, "{name}: {all} iterations");
        // The list of steps in the report.
        assert_eq!((few, many), (1, 1), "{name}: allocations of {two} and {all} iterations");
    }
}

#[test]
fn an_allocation_would_be_counted() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0.0; 10])));
    assert_eq!(counted.count_total, 1);
}
