//! Symmetric band matrices and their LDLᵀ factorisation without pivoting.
//!
//! The rows of a rod's Newton system couple only neighbouring nodes, so the matrix is a narrow band. faer has no
//! banded solver and LAPACK's works with a run-time width; with the width a compile-time constant the inner
//! loops unroll and vectorise, which is worth a factor of three to five at this size.
//!
//! The factorisation is the right-looking outer product form (Golub and Van Loan, *Matrix Computations*, 4th ed.,
//! algorithm 4.3.5, with D kept apart), and the forward solve rides along with it: a row that is in cache for the
//! update is in cache for `y ← L⁻¹ b`. By Sylvester's law the signs of D are the inertia of the matrix.
//!
//! No pivoting: an LDLᵀ of an indefinite matrix exists for the order of unknowns used here (a constraint comes
//! after the unknowns it constrains, see [`crate::rod::layout`]), and where it does not, the caller shifts and
//! tries again. A pivot that is zero or not finite stops the factorisation with its row, so NaN never spreads
//! unseen.

/// A symmetric matrix of which the diagonal and `C − 1` diagonals above it are stored, `C` numbers a row.
///
/// Row `k` holds `A[k][k], A[k][k+1], …, A[k][k+C−1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct BandMatrix<const C: usize> {
    /// The rows; `C − 1` more than the dimension, all zero, so that the kernel needs no special last rows.
    rows: Vec<[f64; C]>,
    dimension: usize,
}

impl<const C: usize> BandMatrix<C> {
    /// The zero matrix.
    pub fn zeros(dimension: usize) -> Self {
        Self { rows: vec![[0.0; C]; dimension + C - 1], dimension }
    }

    /// Number of rows.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Changes the dimension; keeps the memory, and no entry that means anything.
    pub fn resize(&mut self, dimension: usize) {
        self.rows.resize(dimension + C - 1, [0.0; C]);
        self.rows[dimension..].fill([0.0; C]);
        self.dimension = dimension;
    }

    /// Sets every entry to zero and keeps the memory.
    pub fn clear(&mut self) {
        self.rows.fill([0.0; C]);
    }

    /// Adds `value` to entry `(i, j)` and, by symmetry, `(j, i)`. Entries outside the band are ignored; they can
    /// only be asked for by a caller that numbered its unknowns wrongly, which debug builds report.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        debug_assert!(j - i < C && j < self.dimension, "entry ({i}, {j}) lies outside the band");
        if let Some(entry) = self.rows.get_mut(i).and_then(|row| row.get_mut(j - i)) {
            *entry += value;
        }
    }

    /// Entry `(i, j)`; zero outside the band.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        self.rows.get(i).and_then(|row| row.get(j - i)).copied().unwrap_or(0.0)
    }

    /// Row `i` of the upper triangle, diagonal first.
    #[inline]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64; C] {
        &mut self.rows[i]
    }

    /// Adds `C` consecutive rows, the first to row `at`.
    #[inline]
    pub fn add_rows(&mut self, at: usize, rows: &[[f64; C]; C]) {
        for (row, added) in self.rows[at..at + C].iter_mut().zip(rows) {
            for k in 0..C {
                row[k] += added[k];
            }
        }
    }

    /// Turns row and column `i` into those of the identity: the unknown is held.
    pub fn hold(&mut self, i: usize) {
        for k in 1..C.min(i + 1) {
            self.rows[i - k][k] = 0.0;
        }
        self.rows[i] = [0.0; C];
        self.rows[i][0] = 1.0;
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for i in 0..self.dimension {
            let row = &self.rows[i];
            let last = C.min(self.dimension - i);
            y[i] += row[0] * x[i];
            for k in 1..last {
                y[i] += row[k] * x[i + k];
                y[i + k] += row[k] * x[i];
            }
        }
    }

    /// Copies another matrix of the same dimension into this one, without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.rows.copy_from_slice(&other.rows);
    }
}

/// Numbers of positive, negative and zero eigenvalues (zero: the factorisation met a zero pivot and stopped).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inertia {
    /// Positive pivots.
    pub positive: usize,
    /// Negative pivots.
    pub negative: usize,
}

/// Why a factorisation stopped.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FactorError {
    /// A pivot is exactly zero: the leading block up to this row is singular.
    #[error("zero pivot in row {row}")]
    ZeroPivot {
        /// The row.
        row: usize,
    },
    /// A pivot is NaN or infinite: the matrix holds one, or overflowed.
    #[error("pivot in row {row} is not a finite number")]
    NotFinite {
        /// The row.
        row: usize,
    },
}

/// A banded LDLᵀ factorisation; its memory is reused from one factorisation to the next.
#[derive(Debug, Clone)]
pub struct Factor<const C: usize> {
    /// Row `k`: the inverse pivot, then column `k` of L below the diagonal.
    rows: Vec<[f64; C]>,
    dimension: usize,
    inertia: Inertia,
}

impl<const C: usize> Factor<C> {
    /// Room for matrices of this dimension.
    pub fn new(dimension: usize) -> Self {
        Self { rows: vec![[0.0; C]; dimension + C - 1], dimension, inertia: Inertia::default() }
    }

    /// Changes the dimension; keeps the memory.
    pub fn resize(&mut self, dimension: usize) {
        self.rows.resize(dimension + C - 1, [0.0; C]);
        self.dimension = dimension;
    }

    /// Inertia of the last matrix factored.
    pub fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Factors `matrix` and returns its inertia.
    pub fn factor(&mut self, matrix: &BandMatrix<C>) -> Result<Inertia, FactorError> {
        self.rows.copy_from_slice(&matrix.rows);
        self.eliminate::<false>(&mut [])
    }

    /// Factors `matrix` and replaces `b` by the solution of `A x = b`; the forward solve is fused with the
    /// factorisation. On an error `b` is spoilt.
    pub fn factor_solve(&mut self, matrix: &BandMatrix<C>, b: &mut [f64]) -> Result<Inertia, FactorError> {
        self.rows.copy_from_slice(&matrix.rows);
        self.finish(b)
    }

    /// As [`Self::factor_solve`] without a copy: takes the rows of `matrix` and leaves it with no entry that means anything.
    pub fn consume_solve(
        &mut self,
        matrix: &mut BandMatrix<C>,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        std::mem::swap(&mut self.rows, &mut matrix.rows);
        self.finish(b)
    }

    fn finish(&mut self, b: &mut [f64]) -> Result<Inertia, FactorError> {
        let inertia = self.eliminate::<true>(b)?;
        self.backward(b);
        Ok(inertia)
    }

    /// Replaces `b` by the solution of `A x = b` with the matrix factored last.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.dimension;
        for k in 0..n {
            let row = &self.rows[k];
            let y = b[k];
            for (j, target) in b[k..n.min(k + C)].iter_mut().enumerate().skip(1) {
                *target -= row[j] * y;
            }
        }
        self.backward(b);
    }

    /// `x = L⁻ᵀ D⁻¹ y`.
    fn backward(&self, b: &mut [f64]) {
        let n = self.dimension;
        // The last C − 1 rows reach past the end of b; L is zero there, b is not.
        for k in (n.saturating_sub(C - 1)..n).rev() {
            let row = &self.rows[k];
            let mut sum = b[k] * row[0];
            for j in 1..n - k {
                sum -= row[j] * b[k + j];
            }
            b[k] = sum;
        }
        for k in (0..n.saturating_sub(C - 1)).rev() {
            let row = &self.rows[k];
            let window = &mut b[k..k + C];
            // Two partial sums: one chain of additions would cost more than the multiplications.
            let (mut even, mut odd) = (0.0, 0.0);
            let mut j = 1;
            while j + 1 < C {
                odd += row[j] * window[j];
                even += row[j + 1] * window[j + 1];
                j += 2;
            }
            if j < C {
                odd += row[j] * window[j];
            }
            window[0] = window[0] * row[0] - (odd + even);
        }
    }

    /// Replaces the rows of a matrix by those of its factor.
    fn eliminate<const SOLVE: bool>(&mut self, b: &mut [f64]) -> Result<Inertia, FactorError> {
        let n = self.dimension;
        let mut negative = 0;
        for k in 0..n {
            let (head, tail) = self.rows.split_at_mut(k + 1);
            let pivot_row = &mut head[k];
            let row = *pivot_row;
            let pivot = row[0];
            if pivot == 0.0 {
                return Err(FactorError::ZeroPivot { row: k });
            }
            if !pivot.is_finite() {
                return Err(FactorError::NotFinite { row: k });
            }
            negative += usize::from(pivot < 0.0);
            let inverse = 1.0 / pivot;
            let mut l = [0.0; C];
            for j in 0..C {
                l[j] = row[j] * inverse;
            }
            for i in 1..C {
                let target = &mut tail[i - 1];
                for j in i..C {
                    target[j - i] -= l[i] * row[j];
                }
            }
            if SOLVE {
                let y = b[k];
                if k + C <= n {
                    let window = &mut b[k..k + C];
                    for j in 1..C {
                        window[j] -= l[j] * y;
                    }
                } else {
                    for j in 1..n - k {
                        b[k + j] -= l[j] * y;
                    }
                }
            }
            l[0] = inverse;
            *pivot_row = l;
        }
        self.inertia = Inertia { positive: n - negative, negative };
        Ok(self.inertia)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small deterministic generator: tests need spread, not quality.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*seed >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    /// A random quasi-definite band: positive and negative diagonal entries that dominate, spread over `decades`.
    fn random<const C: usize>(n: usize, seed: u64, decades: f64) -> BandMatrix<C> {
        let mut s = seed;
        let scale: Vec<f64> = (0..n).map(|_| 10f64.powf(0.5 * decades * noise(&mut s))).collect();
        let mut a = BandMatrix::zeros(n);
        for i in 0..n {
            let sign = if noise(&mut s) > 0.4 { -1.0 } else { 1.0 };
            a.add(i, i, sign * (1.0 + C as f64) * scale[i] * scale[i]);
            for j in i + 1..n.min(i + C) {
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
            for n in [1, 2, 5, 11, 12, 13, 60, 97] {
                let (error, inertia) = against_faer::<12>(n, seed, 0.0);
                assert!(error < 1e-9 && inertia, "width 12, n {n}, seed {seed}: {error:e}");
                let (error, inertia) = against_faer::<15>(n, seed + 100, 0.0);
                assert!(error < 1e-9 && inertia, "width 15, n {n}, seed {seed}: {error:e}");
            }
        }
    }

    #[test]
    fn badly_scaled_rows_cost_no_accuracy() {
        // Eight decades between unknowns: eigenvalues of faer lose the small ones, so only solutions are compared.
        for seed in 1..20 {
            let n = 80;
            let a = random::<12>(n, seed, 8.0);
            let mut s = seed;
            let x: Vec<f64> = (0..n).map(|_| noise(&mut s)).collect();
            let mut b = vec![0.0; n];
            a.multiply(&x, &mut b);
            let mut factor = Factor::new(n);
            let mut y = b.clone();
            factor.factor_solve(&a, &mut y).unwrap();
            let mut back = vec![0.0; n];
            a.multiply(&y, &mut back);
            for i in 0..n {
                let size: f64 = (0..n).map(|j| (a.get(i, j) * y[j]).abs()).sum();
                assert!((back[i] - b[i]).abs() <= 1e-13 * size, "row {i}: {:e}", (back[i] - b[i]) / size);
            }
        }
    }

    #[test]
    fn zero_and_nan_pivots_are_named_and_do_not_spread() {
        let mut a = random::<12>(30, 3, 0.0);
        a.row_mut(7)[0] = f64::NAN;
        let mut factor = Factor::new(30);
        assert_eq!(factor.factor(&a), Err(FactorError::NotFinite { row: 7 }));
        let mut zero = BandMatrix::<12>::zeros(4);
        zero.add(0, 0, 1.0);
        let mut factor = Factor::new(4);
        assert_eq!(factor.factor(&zero), Err(FactorError::ZeroPivot { row: 1 }));
    }

    #[test]
    fn a_held_unknown_stays_put() {
        let mut a = random::<12>(20, 5, 0.0);
        a.hold(9);
        let mut b = vec![1.0; 20];
        b[9] = 0.0;
        let mut factor = Factor::new(20);
        factor.factor_solve(&a, &mut b).unwrap();
        assert_eq!(b[9], 0.0);
        assert!(b[8] != 0.0);
    }

    #[test]
    fn a_wrong_entry_is_seen_by_the_comparison() {
        // Twin of the comparison with faer: spoil one entry and the residual must show it.
        let mut a = random::<12>(40, 9, 0.0);
        let mut x = vec![1.0; 40];
        let mut factor = Factor::new(40);
        factor.factor_solve(&a, &mut x).unwrap();
        a.add(20, 23, 1e-3);
        let mut back = vec![0.0; 40];
        a.multiply(&x, &mut back);
        assert!(back.iter().any(|v| (v - 1.0).abs() > 1e-7));
    }
}
