//! The block factorisation against faer.

use super::*;

/// `y = A x`.
fn multiply<const C: usize>(a: &BandMatrix<C>, x: &[f64], y: &mut [f64]) {
    for (i, sum) in y.iter_mut().enumerate() {
        *sum = (0..x.len()).map(|j| a.get(i, j) * x[j]).sum();
    }
}

/// A small deterministic generator: tests need variety, not quality.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
}

/// A random quasi-definite band: dominant positive and negative diagonal entries, spread over `decades`.
fn random<const C: usize>(n: usize, seed: u64, decades: f64) -> BandMatrix<C> {
    let mut s = seed;
    let scale: Vec<f64> = (0..n).map(|_| 10f64.powf(0.5 * decades * noise(&mut s))).collect();
    let mut a = BandMatrix::zeros(n);
    for i in 0..n {
        let sign = if noise(&mut s) > 0.4 { -1.0 } else { 1.0 };
        a.add(i, i, sign * (1.0 + C as f64) * scale[i] * scale[i]);
        for j in i + 1..n.min(i / (C / 2) * (C / 2) + C) {
            a.add(i, j, noise(&mut s) * scale[i] * scale[j]);
        }
    }
    a
}

fn dense<const C: usize>(a: &BandMatrix<C>) -> faer::Mat<f64> {
    faer::Mat::from_fn(a.dimension(), a.dimension(), |i, j| a.get(i, j))
}

fn against_faer<const C: usize>(n: usize, seed: u64, decades: f64) -> (f64, bool) {
    use faer::linalg::solvers::Solve;
    let a = random::<C>(n, seed, decades);
    let mut s = seed ^ 7;
    let b: Vec<f64> = (0..n).map(|_| noise(&mut s)).collect();
    let mut x = b.clone();
    let mut factor = Factor::new(n);
    let inertia = factor.factor_solve(&a, &mut x).unwrap();
    let mut again = b.clone();
    factor.solve(&mut again);
    let full = dense(&a);
    let reference = full.partial_piv_lu().solve(faer::Mat::from_fn(n, 1, |i, _| b[i]));
    let eigen = full.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
    let negative = eigen.iter().filter(|v| **v < 0.0).count();
    let worst = (0..n)
        .map(|i| (x[i] - reference[(i, 0)]).abs() / reference[(i, 0)].abs().max(1e-12))
        .fold(0.0, f64::max);
    let repeat = (0..n).map(|i| (x[i] - again[i]).abs() / x[i].abs().max(1e-300)).fold(0.0, f64::max);
    assert!(repeat < 1e-12, "separate and fused solve differ by {repeat:e}");
    (worst, inertia.negative == negative && inertia.positive == n - negative)
}

#[test]
fn solution_and_inertia_agree_with_faer() {
    for seed in 1..20 {
        for blocks in [1, 2, 3, 10, 17] {
            let (error, inertia) = against_faer::<12>(6 * blocks, seed, 0.0);
            assert!(error < 1e-9 && inertia, "width 12, {blocks} blocks, seed {seed}: {error:e}");
            let (error, inertia) = against_faer::<16>(8 * blocks, seed + 100, 0.0);
            assert!(error < 1e-9 && inertia, "width 16, {blocks} blocks, seed {seed}: {error:e}");
            let (error, inertia) = against_faer::<20>(10 * blocks, seed + 200, 0.0);
            assert!(error < 1e-9 && inertia, "width 20, {blocks} blocks, seed {seed}: {error:e}");
            let (error, inertia) = against_faer::<24>(12 * blocks, seed + 300, 0.0);
            assert!(error < 1e-9 && inertia, "width 24, {blocks} blocks, seed {seed}: {error:e}");
        }
    }
}

#[test]
fn badly_scaled_rows_cost_no_accuracy() {
    // Eight decades between unknowns: faer's eigenvalues lose the small ones, so only solutions are compared.
    for seed in 1..20 {
        let n = 84;
        let a = random::<12>(n, seed, 8.0);
        let mut s = seed;
        let x: Vec<f64> = (0..n).map(|_| noise(&mut s)).collect();
        let mut b = vec![0.0; n];
        multiply(&a, &x, &mut b);
        let mut factor = Factor::new(n);
        let mut y = b.clone();
        factor.factor_solve(&a, &mut y).unwrap();
        let mut back = vec![0.0; n];
        multiply(&a, &y, &mut back);
        for i in 0..n {
            let size: f64 = (0..n).map(|j| (a.get(i, j) * y[j]).abs()).sum();
            assert!((back[i] - b[i]).abs() <= 1e-13 * size, "row {i}: {:e}", (back[i] - b[i]) / size);
        }
    }
}

#[test]
fn zero_and_nan_pivots_are_named_and_do_not_spread() {
    let mut a = random::<12>(30, 3, 0.0);
    a.add(7, 7, f64::NAN);
    let mut factor = Factor::new(30);
    assert_eq!(factor.factor(&a), Err(FactorError::NotFinite { row: 7 }));
    let mut zero = BandMatrix::<12>::zeros(6);
    zero.add(0, 0, 1.0);
    let mut factor = Factor::new(6);
    assert_eq!(factor.factor(&zero), Err(FactorError::ZeroPivot { row: 1 }));
}

#[test]
fn a_held_unknown_stays_put() {
    let mut a = random::<12>(24, 5, 0.0);
    a.hold(9);
    let mut b = vec![1.0; 24];
    b[9] = 0.0;
    let mut factor = Factor::new(24);
    factor.factor_solve(&a, &mut b).unwrap();
    assert_eq!(b[9], 0.0);
    assert!(b[8] != 0.0);
}

#[test]
fn a_shift_while_factoring_is_that_of_the_matrix() {
    let mut a = random::<16>(40, 11, 0.0);
    let mut shift = Shift::default();
    shift.reset(40);
    for i in 0..40 {
        shift.diagonal[i] = 0.1 * i as f64;
        shift.next[i] = if i < 32 { -0.05 * i as f64 } else { 0.0 };
    }
    let (mut x, mut y) = (vec![1.0; 40], vec![1.0; 40]);
    let (mut factor, mut other) = (Factor::new(40), Factor::new(40));
    let first = factor.factor_solve_shifted(&a, &shift, 0.3, &mut x).unwrap();
    assert_eq!(other.factor_shifted(&a, &shift, 0.3), Ok(first));
    a.add_shift(&shift, 0.3);
    assert!((a.get(9, 17) - random::<16>(40, 11, 0.0).get(9, 17) + 0.3 * 0.45).abs() < 1e-15);
    assert_eq!(other.factor_solve(&a, &mut y), Ok(first));
    assert_eq!(x, y);
}

#[test]
fn a_wrong_entry_is_seen_by_the_comparison() {
    // Counter-check of the comparison with faer: after changing one entry the residual must be large.
    let mut a = random::<12>(42, 9, 0.0);
    let mut x = vec![1.0; 42];
    let mut factor = Factor::new(42);
    factor.factor_solve(&a, &mut x).unwrap();
    a.add(20, 23, 1e-3);
    let mut back = vec![0.0; 42];
    multiply(&a, &x, &mut back);
    assert!(back.iter().any(|v| (v - 1.0).abs() > 1e-7));
}
