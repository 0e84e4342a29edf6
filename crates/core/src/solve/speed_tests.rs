//! The speed bars of the rod, least of many runs. Timing: run by hand, alone, with `--release -- --ignored --nocapture`.

use std::time::Instant;

use super::{Newton, NewtonOptions};
use crate::Vec3;
use crate::banded::{Factor, Shift};
use crate::rod::{Assembly, ElementData, Frame, Layout, Material, PLAIN, RodState, Supports, TWISTED};
use crate::statics::Loads;

/// `n` equal elements of EI = 1 in all; pre-curved if `twisted`.
fn elements(n: usize, twisted: bool) -> Vec<ElementData> {
    let material = Material {
        bending: [1.0; 3],
        torsion: [0.77; 3],
        rest_curvature: [[if twisted { 1.0 } else { 0.0 }, 0.0]; 3],
        ..Material::NONE
    };
    vec![ElementData::of(1.0 / n as f64, material); n]
}

/// The elements, bent and twisted evenly.
fn bent(n: usize, twisted: bool) -> (Vec<ElementData>, RodState) {
    let elements = elements(n, twisted);
    let mut frames = vec![Frame::new(Vec3::x(), Some(Vec3::y()))];
    for i in 0..n {
        frames.push(frames[i].transported(1.5 / n as f64, 0.4 / n as f64));
    }
    let state = RodState::from_frames(&elements, Vec3::zeros(), frames);
    (elements, state)
}

/// The start is clamped.
fn clamp() -> Supports {
    Supports { start_tangent: true, start_angles: [true; 3], ..Supports::default() }
}

/// PL²/EI = 10 across the end.
fn tip_load(n: usize) -> Loads {
    Loads { forces: vec![(n, Vec3::new(0.0, -10.0, 0.0))], ..Loads::default() }
}

/// Shifts what was assembled.
fn make_regular<const C: usize>(elements: &[ElementData], newton: &mut Newton<C>) {
    let mut shift = Shift::default();
    Assembly::<C>::unit_shift(elements, &clamp().held::<C>(), &mut shift);
    newton.assembly.matrix.add_shift(&shift, 50.0);
}

/// Seconds of (assembly, factor and solve) for `n` elements.
fn measure<const C: usize>(n: usize, rounds: usize) -> (f64, f64) {
    let (elements, state) = bent(n, Layout::<C>::ANGLES > 0);
    let supports = clamp();
    let mut loads = tip_load(n);
    let mut newton = Newton::<C>::new(n);
    let mut factor = Factor::new(Layout::<C>::dimension(n));
    let mut b = vec![0.0; Layout::<C>::dimension(n)];
    let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..rounds {
        let clock = Instant::now();
        newton.assemble(&elements, &supports, &mut loads, &state);
        first = first.min(clock.elapsed().as_secs_f64());
        make_regular(&elements, &mut newton);
        b.copy_from_slice(&newton.assembly.residual);
        let clock = Instant::now();
        factor
            .factor_solve(&newton.assembly.matrix, &mut b)
            .expect("a positive shift makes the matrix regular");
        second = second.min(clock.elapsed().as_secs_f64());
    }
    (first, second)
}

/// Seconds an iteration of a whole solve: the cantilever under PL²/EI = 10 from straight, everything included.
fn whole<const C: usize>(n: usize, rounds: usize) -> f64 {
    let elements = elements(n, Layout::<C>::ANGLES > 0);
    let start = RodState::straight(&elements, Vec3::zeros(), Frame::new(Vec3::x(), Some(Vec3::y())));
    let mut newton = Newton::<C>::new(n);
    let mut best = f64::INFINITY;
    for _ in 0..rounds {
        let mut state = start.clone();
        let mut supports = clamp();
        let mut loads = tip_load(n);
        let clock = Instant::now();
        let report =
            newton.solve(&elements, &mut supports, &mut loads, &mut state, &NewtonOptions::default());
        best = best.min(clock.elapsed().as_secs_f64() / report.iterations as f64);
        assert!(report.converged);
    }
    best
}

#[test]
#[ignore = "timing"]
fn an_iteration_costs_a_few_factorisations_and_is_linear_in_the_elements() {
    type Parts = fn(usize, usize) -> (f64, f64);
    type Whole = fn(usize, usize) -> f64;
    for (name, bar, at, all) in [
        ("plain", 6.0, measure::<PLAIN> as Parts, whole::<PLAIN> as Whole),
        ("twisted", 8.0, measure::<TWISTED>, whole::<TWISTED>),
    ] {
        let (assembly, factor) = at(300, 3000);
        let ratio = (assembly + factor) / factor;
        println!(
            "{name}, 300 elements: assembly {:.1} µs, factor and solve {:.1} µs, iteration / factor and solve {ratio:.2}",
            1e6 * assembly,
            1e6 * factor
        );
        assert!(ratio <= bar, "{name}: {ratio}");
        let iteration = all(300, 300);
        println!(
            "{name}, 300 elements: a whole solve takes {:.1} µs an iteration, {:.2} times factor and solve",
            1e6 * iteration,
            iteration / factor
        );
        let (a, b) = at(10_000, 60);
        let exponent = ((a + b) / (assembly + factor)).ln() / (10_000f64 / 300.0).ln();
        println!("{name}, 10000 elements: {:.2} ms, exponent {exponent:.3}", 1e3 * (a + b));
        assert!(exponent <= 1.1, "{name}: {exponent}");
    }
}
