//! The rod: one element, assembly, factorisation and whole solves against the number of elements. The whole solve is the
//! cantilever PL²/EI = 10 from straight in one step; its tip error is printed beside the time.
#![allow(missing_docs, reason = "the macros of criterion expand to undocumented items")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use endowire_core::Vec3;
use endowire_core::banded::{BandMatrix, Factor};
use endowire_core::rod::element::ElementSystem;
use endowire_core::rod::{Frame, Layout, PLAIN, RodState, TWISTED};
use endowire_core::rod::{element_energy, element_system};
use endowire_core::solve::{Newton, NewtonOptions};
use endowire_tests::bent_rod::{bent, clamp, elements, system, tip_load};
use std::hint::black_box;

const SIZES: [usize; 6] = [8, 32, 128, 300, 512, 1024];

fn element(c: &mut Criterion) {
    let (elements, state) = bent(4, true);
    let s = state.element::<TWISTED>(1);
    let mut group = c.benchmark_group("element");
    group.bench_function("energy", |b| b.iter(|| element_energy::<PLAIN>(&elements[1], black_box(&s))));
    group.bench_function("energy twisted", |b| {
        b.iter(|| element_energy::<TWISTED>(&elements[1], black_box(&s)));
    });
    let mut plain = ElementSystem::<PLAIN>::zeros();
    group.bench_function("system", |b| {
        b.iter(|| element_system::<_, true>(&elements[1], black_box(&s), 1.0, &mut plain));
    });
    let mut full = ElementSystem::<TWISTED>::zeros();
    group.bench_function("system twisted", |b| {
        b.iter(|| element_system::<_, true>(&elements[1], black_box(&s), 1.0, &mut full));
    });
    group.finish();
}

fn assembly<const C: usize>(c: &mut Criterion, name: &str) {
    let mut group = c.benchmark_group(format!("assembly{name}"));
    for n in SIZES {
        let (elements, state, mut newton) = system::<C>(n);
        let mut loads = tip_load(n);
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| newton.assemble(&elements, &clamp(), &mut loads, black_box(&state)));
        });
    }
    group.finish();
    let mut group = c.benchmark_group(format!("factor and solve{name}"));
    for n in SIZES {
        let (_, _, newton) = system::<C>(n);
        let matrix: &BandMatrix<C> = &newton.assembly.matrix;
        let mut factor = Factor::new(matrix.dimension());
        let mut b0 = vec![0.0; matrix.dimension()];
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| {
                b0.copy_from_slice(&newton.assembly.residual);
                factor.factor_solve(black_box(matrix), &mut b0)
            });
        });
    }
    group.finish();
}

fn solve<const C: usize>(c: &mut Criterion, name: &str) {
    let mut group = c.benchmark_group(format!("newton iteration{name}"));
    for n in SIZES {
        let elements = elements(n, Layout::<C>::ANGLES > 0);
        let frame = Frame::new(Vec3::x(), Some(Vec3::y()));
        let start = RodState::straight(&elements, Vec3::zeros(), frame);
        let mut newton = Newton::<C>::new(n);
        let mut state = start.clone();
        let options = NewtonOptions::default();
        let report = newton.solve(&elements, &mut clamp(), &mut tip_load(n), &mut state, &options);
        if Layout::<C>::ANGLES == 0 {
            let error = (state.positions[n] - Vec3::new(1.0 - 0.554995597754, -0.810609024880, 0.0)).norm();
            println!("{n} elements: tip error {error:.1e}, {} iterations", report.iterations);
        }
        // Time of a whole solve over its iterations.
        let count = report.iterations as u32;
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter_custom(|rounds| {
                let mut sum = std::time::Duration::ZERO;
                for _ in 0..rounds {
                    state.copy_from(&start);
                    let clock = std::time::Instant::now();
                    black_box(newton.solve(&elements, &mut clamp(), &mut tip_load(n), &mut state, &options));
                    sum += clock.elapsed();
                }
                sum / count
            });
        });
    }
    group.finish();
}

fn all(c: &mut Criterion) {
    element(c);
    assembly::<PLAIN>(c, "");
    assembly::<TWISTED>(c, ", twisted");
    solve::<PLAIN>(c, "");
    solve::<TWISTED>(c, ", twisted");
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_millis(600));
    targets = all
}
criterion_main!(benches);
