//! A5: expected results of the method of Li et al. 2011 on the cantilever of A1, including the error of its model.
//!
//! Minimising ½∫|t′|² − a y(1) with t(0) = (1, 0) gives t_y = a(s − s²/2) exactly, so w = a/3, and the length, which
//! should be constant, grows to ∫√(1 + t_y²) ds.

use super::{Row, at_end, observed_order, unit_rod};
use endowire_core::statics::LoadKind;
use endowire_core::{Result, Vec3};
use endowire_methods::li2011::{Chain, banded, dense};

/// Load, overshoot of the deflection over the exact rod in percent, length.
const ROWS: [[f64; 3]; 4] =
    [[0.5, 2.79, 1.01647], [1.0, 10.48, 1.06379], [5.0, 133.0, 2.00114], [10.0, 311.0, 3.53906]];

const ELEMENTS: usize = 2000;

/// Node positions from the banded solve.
fn nodes(load: f64, elements: usize) -> Vec<Vec3> {
    let (mut x, mut t) = (Vec::new(), Vec::new());
    banded::solve(&chain(load, elements), &mut banded::Workspace::default(), &mut x, &mut t);
    x
}

fn chain(load: f64, elements: usize) -> Chain {
    let mut chain = Chain::uniform(Vec3::zeros(), Vec3::x(), 1.0, elements, 1.0);
    chain.forces_n[elements - 1] = Vec3::new(0.0, load, 0.0);
    chain
}

/// Length of the polygon of nodes: the arc length up to O(h²).
fn length(x: &[Vec3]) -> f64 {
    let mut previous = Vec3::zeros();
    x.iter().map(|x| (x - std::mem::replace(&mut previous, *x)).norm()).sum()
}

pub(super) fn cantilever() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for [a, percent, grown] in ROWS {
        let x = nodes(a, ELEMENTS);
        let (w, exact) = (x[ELEMENTS - 1].y, a / 3.0);
        let order = observed_order(ELEMENTS, 1e-10, |n| Ok((nodes(a, n)[n - 1].y / exact - 1.0).abs()))?;
        let name = format!("A5 a={a}, {ELEMENTS} elements");
        rows.push(Row::relative(&name, "deflection", w, exact, 1e-6).order(order));
        // The lists give six digits of the length and three of the overshoot.
        rows.push(Row::relative(&name, "length", length(&x), grown, 1e-5));
        let mut rod = unit_rod(64);
        rod.load = vec![at_end(LoadKind::Force, [0.0, a, 0.0])];
        let overshoot = 100.0 * (w / rod.solve()?.checked()?.tip[1] - 1.0);
        rows.push(Row::relative(&name, "overshoot over the exact rod, %", overshoot, percent, 5e-3));
    }
    let (mut x, mut t) = (Vec::new(), Vec::new());
    dense::solve(&chain(10.0, 100), &mut x, &mut t);
    let apart = x.iter().zip(&nodes(10.0, 100)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    rows.push(Row::with_error("A5 a=10, 100 elements", "dense against banded", apart, 0.0, apart, 1e-9));
    Ok(rows)
}
