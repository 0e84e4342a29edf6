//! The coupled factorisation against faer's dense solution and spectrum.

use super::*;
use crate::banded::{BandMatrix, Shift};
use crate::random::{splitmix64, unit};

/// A random band with couplings, with dominant positive and negative diagonal entries.
fn random<const C: usize>(nodes: usize, seed: u64) -> (BandMatrix<C>, Couplings<C>) {
    let block = C / 2;
    let n = nodes * block;
    let mut draw = {
        let mut index = 0;
        move || {
            index += 1;
            2.0 * unit(splitmix64(seed, index)) - 1.0
        }
    };
    let mut band = BandMatrix::zeros(n);
    let mut couplings = Couplings::default();
    let pairs: Vec<(usize, usize)> = (0..nodes)
        .flat_map(|i| (i + 2..nodes - 1).map(move |j| (i, j)))
        .filter(|(i, j)| (i, j) == (&0, &2) || draw() > 0.6)
        .collect();
    for i in 0..n {
        let sign = if draw() > 0.4 { -1.0 } else { 1.0 };
        band.add(i, i, sign * (2.0 * n as f64));
        for j in i + 1..n.min(i / block * block + C) {
            band.add(i, j, draw());
        }
    }
    for (i, j) in pairs {
        // The last unknowns of both nodes, in both orders of these.
        let values: [[f64; 6]; 6] = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
        let nodes = if j % 2 == 0 { (j, i) } else { (i, j) };
        couplings.add_block(nodes, block - 6, &values);
    }
    (band, couplings)
}

fn agrees<const C: usize>(nodes: usize, seed: u64) {
    use faer::linalg::solvers::Solve;
    let (band, mut couplings) = random::<C>(nodes, seed);
    let n = nodes * C / 2;
    couplings.hold(1);
    let mut shift = Shift::default();
    shift.reset(n);
    shift.diagonal.iter_mut().enumerate().for_each(|(i, d)| *d = 0.1 + i as f64 / n as f64);
    shift.next.iter_mut().take(n - C / 2).for_each(|d| *d = -0.05);
    let mut shifted = band.clone();
    shifted.add_shift(&shift, 3.0);
    let full = faer::Mat::from_fn(n, n, |i, j| shifted.get(i, j) + couplings.get(i, j));
    let mut factor = CoupledFactor::default();
    let inertia = factor.factor_shifted(&band, &couplings, &shift, 3.0).unwrap();
    let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let mut x = b.clone();
    factor.solve::<C>(&mut x);
    let reference = full.partial_piv_lu().solve(faer::Mat::from_fn(n, 1, |i, _| b[i]));
    let worst = (0..n).map(|i| (x[i] - reference[(i, 0)]).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-12 * n as f64, "{worst:e}");
    let eigen = full.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
    let negative = eigen.iter().filter(|v| **v < 0.0).count();
    assert_eq!((inertia.negative, inertia.positive), (negative, n - negative));
    // Counter-check: without its couplings the matrix is another one.
    let mut other = b;
    factor.factor_shifted(&band, &Couplings::default(), &shift, 3.0).unwrap();
    factor.solve::<C>(&mut other);
    let apart = (0..n).map(|i| (other[i] - reference[(i, 0)]).abs()).fold(0.0, f64::max);
    assert!(apart > 1e-6);
}

#[test]
fn solution_and_inertia_agree_with_faer() {
    for seed in 0..4 {
        agrees::<12>(9, seed);
        agrees::<16>(13, seed);
        agrees::<24>(5, seed);
    }
}

#[test]
fn columns_that_are_kept_have_the_bits_of_a_factorisation_from_the_beginning() {
    let mut shift = Shift::default();
    shift.reset(8 * 12);
    shift.diagonal.fill(0.1);
    let (band, couplings) = random::<16>(12, 7);
    let b: Vec<f64> = (0..band.dimension()).map(|i| (i as f64).cos()).collect();
    let solved = |factor: &mut CoupledFactor, band: &BandMatrix<16>, by: f64| {
        let inertia = factor.factor_shifted(band, &couplings, &shift, by).unwrap();
        let mut x = b.clone();
        factor.solve::<16>(&mut x);
        (inertia, x)
    };
    let mut kept = CoupledFactor::default();
    let first = solved(&mut kept, &band, 1.0);
    for node in 0..12 {
        let mut other = band.clone();
        other.add(8 * node + 2, 8 * node + 3, 0.5);
        let again = solved(&mut kept, &other, 1.0);
        assert_eq!(again, solved(&mut CoupledFactor::default(), &other, 1.0), "node {node}");
        assert_ne!(again.1, first.1, "node {node}");
        // A factorisation that ends early leaves nothing behind that is taken for a factor.
        let mut broken = band.clone();
        broken.add(8 * node, 8 * node, f64::NAN);
        assert!(kept.factor_shifted(&broken, &couplings, &shift, 1.0).is_err());
        assert_eq!(first, solved(&mut kept, &band, 1.0), "node {node}");
    }
    assert_ne!(first.1, solved(&mut kept, &band, 2.0).1);
}

#[test]
fn sparse_factors_report_what_is_not_finite() {
    let (mut band, couplings) = random::<12>(6, 3);
    let mut shift = Shift::default();
    shift.reset(36);
    band.add(7, 8, f64::NAN);
    let found = CoupledFactor::default().factor_shifted(&band, &couplings, &shift, 0.0);
    assert!(found.is_err(), "{found:?}");
}
