//! The speed bars of the rod, least of many runs. Timing: run by hand, alone, with `--release -- --ignored --nocapture`.

use endowire_core::Vec3;
use endowire_core::rod::{Assembly, ElementData, Frame, Layout, PLAIN, RodState, Supports, TWISTED};
use endowire_core::solve::{Factor, Newton};
use endowire_core::statics::Loads;
use std::time::Instant;

/// Seconds of (assembly, factor and solve) for `n` elements.
fn measure<const C: usize>(n: usize, rounds: usize) -> (f64, f64) {
    let data = ElementData {
        length: 1.0 / n as f64,
        bending: [1.0; 3],
        torsion: [0.77; 3],
        rest_curvature: [[if Layout::<C>::TWIST { 1.0 } else { 0.0 }, 0.0]; 3],
        rest_twist: [0.0; 3],
        flexibility: 0.0,
    };
    let elements = vec![data; n];
    let mut frames = vec![Frame::new(Vec3::x(), Some(Vec3::y()))];
    for i in 0..n {
        let last = frames[i];
        frames.push(last.transported(1.5 / n as f64, 0.4 / n as f64));
    }
    let state = RodState::from_frames(&elements, Vec3::zeros(), frames);
    let supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
    let mut loads = Loads { forces: vec![(n, Vec3::new(0.0, -10.0, 0.0))], ..Loads::default() };
    let mut newton = Newton::<C>::new(n);
    let mut factor = Factor::new(Layout::<C>::dimension(n));
    let mut b = vec![0.0; Layout::<C>::dimension(n)];
    let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..rounds {
        let clock = Instant::now();
        newton.assemble(&elements, &supports, &mut loads, &state);
        first = first.min(clock.elapsed().as_secs_f64());
        Assembly::add_shift(&mut newton.assembly.matrix, &elements, 50.0);
        supports.hold(&mut newton.assembly);
        b.copy_from_slice(&newton.assembly.residual);
        let clock = Instant::now();
        factor
            .factor_solve(&newton.assembly.matrix, &mut b)
            .expect("a positive shift makes the matrix regular");
        second = second.min(clock.elapsed().as_secs_f64());
    }
    (first, second)
}

#[test]
#[ignore = "timing"]
fn an_iteration_costs_a_few_factorisations_and_is_linear_in_the_elements() {
    for (name, bar, at) in [
        ("plain", 6.0, &measure::<PLAIN> as &dyn Fn(usize, usize) -> (f64, f64)),
        ("twisted", 8.0, &measure::<TWISTED>),
    ] {
        let (assembly, factor) = at(300, 3000);
        let ratio = (assembly + factor) / factor;
        println!(
            "{name}, 300 elements: assembly {:.1} µs, factor and solve {:.1} µs, iteration / factor and solve {ratio:.2}",
            1e6 * assembly,
            1e6 * factor
        );
        assert!(ratio <= bar, "{name}: {ratio}");
        let (a, b) = at(10_000, 60);
        let exponent = ((a + b) / (assembly + factor)).ln() / (10_000f64 / 300.0).ln();
        println!("{name}, 10000 elements: {:.2} ms, exponent {exponent:.3}", 1e3 * (a + b));
        assert!(exponent <= 1.1, "{name}: {exponent}");
    }
}
