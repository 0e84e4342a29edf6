//! Li et al. 2011 against exact values of its own quadratic energy.
//!
//! Cantilever along +x, L = 1, EI = 1, dead tip load a in +y. Minimising ½∫|t′|² − a y(1) with t(0) = (1, 0) gives
//! t_y = a(s − s²/2) exactly, so w = a/3 and the "inextensible" rod grows to ∫√(1 + t_y²) ds.

use endowire_core::Vec3;
use endowire_core::methods::li2011::{Chain, banded, dense};

fn cantilever(load: f64, elements: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut chain = Chain::uniform(Vec3::zeros(), Vec3::x(), 1.0, elements, 1.0);
    chain.forces_n[elements - 1] = Vec3::new(0.0, load, 0.0);
    let (mut x, mut t) = (Vec::new(), Vec::new());
    banded::solve(&chain, &mut banded::Workspace::default(), &mut x, &mut t);
    let (mut x_dense, mut t_dense) = (Vec::new(), Vec::new());
    dense::solve(&chain, &mut x_dense, &mut t_dense);
    for (a, b) in x.iter().zip(&x_dense) {
        assert!((a - b).norm() < 1e-9, "dense and banded differ by {:e}", (a - b).norm());
    }
    (x, t)
}

fn deflection(load: f64, elements: usize) -> f64 {
    cantilever(load, elements).0[elements - 1].y
}

/// Length of the polygon of nodes: the arc length up to O(h²).
fn length(x: &[Vec3]) -> f64 {
    let mut previous = Vec3::zeros();
    x.iter().map(|x| (x - std::mem::replace(&mut previous, *x)).norm()).sum()
}

#[test]
fn deflection_and_growth_are_those_of_the_quadratic_energy() {
    // Load, exact deflection of the inextensible rod (Bisshopp and Drucker 1945; a = 0.5 from the quoted +2.79 %),
    // overshoot in percent, length.
    let cases = [
        (1.0, 0.301720773800, 10.48, 1.06379),
        (5.0, 0.713791523612, 133.0, 2.00114),
        (10.0, 0.810609024880, 311.0, 3.53906),
    ];
    for (load, exact_rod, overshoot_percent, grown) in cases {
        let (x, _) = cantilever(load, 400);
        let w = x[399].y;
        assert!((w - load / 3.0).abs() < 1e-5 * load, "a = {load}: w = {w}");
        assert!((100.0 * (w / exact_rod - 1.0) - overshoot_percent).abs() < 0.5, "a = {load}: overshoot");
        assert!((length(&x) - grown).abs() < 2e-5 * grown, "a = {load}: length {}", length(&x));
    }
    assert!((deflection(0.5, 400) - 0.166667).abs() < 2e-6);
    assert!((length(&cantilever(0.5, 400).0) - 1.01647).abs() < 1e-5);
}

#[test]
fn the_error_falls_at_second_order() {
    let error = |n| (deflection(1.0, n) - 1.0 / 3.0).abs();
    let order = (error(20) / error(40)).log2();
    assert!((order - 2.0).abs() < 0.01, "order {order}");
}
