//! The rod: whole solves against the number of elements: the cantilever PL²/EI = 10 from straight in one step. Its tip
//! error is printed beside the time. One element, assembly and factorisation are timed by core's test
//! `an_iteration_costs_a_few_factorisations_and_is_linear_in_the_elements`.
#![allow(missing_docs, reason = "the macros of criterion expand to undocumented items")]

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use endowire_core::Vec3;
use endowire_core::statics::{StaticCase, StaticProblem};

const SIZES: [usize; 6] = [8, 32, 128, 300, 512, 1024];

/// The cantilever, which twists if it is pre-curved.
fn cantilever(elements: usize, is_curved: bool) -> StaticProblem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cases/tip_force.toml");
    let mut case = StaticCase::from_file(&path).expect("an example case is valid");
    case.rod.elements = elements;
    if is_curved {
        case.rod.section[0].rest_curvature = [1.0, 0.0];
        case.rod.section[0].gj = Some(0.77);
    }
    StaticProblem::new(&case).expect("an example case is valid")
}

fn solve(c: &mut Criterion, is_curved: bool) {
    let name = if is_curved { ", twisted" } else { "" };
    let mut group = c.benchmark_group(format!("newton iteration{name}"));
    for n in SIZES {
        let problem = cantilever(n, is_curved);
        let solved = problem.solve().expect("an example case has an equilibrium");
        if !is_curved {
            let error =
                (Vec3::from(solved.tip) - Vec3::new(1.0 - 0.554995597754, -0.810609024880, 0.0)).norm();
            println!("{n} elements: tip error {error:.1e}, {} iterations", solved.iterations);
        }
        // Time of a whole solve over its iterations.
        let count = solved.iterations as u32;
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter_custom(|rounds| {
                let mut sum = Duration::ZERO;
                for _ in 0..rounds {
                    let clock = Instant::now();
                    let _ = black_box(problem.solve_state());
                    sum += clock.elapsed();
                }
                sum / count
            });
        });
    }
    group.finish();
}

fn all(c: &mut Criterion) {
    solve(c, false);
    solve(c, true);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_millis(600));
    targets = all
}
criterion_main!(benches);
