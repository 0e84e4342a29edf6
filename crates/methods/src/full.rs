//! Full matrices for the paper's own solve: products and an LU factorisation by blocks, whose work is nalgebra's matrix product.
//!
//! A library that has more of this takes 90 s of processor time to build, for one method.

use nalgebra::DMatrix;

/// Columns that go together: their part of a product fits the processor's second cache.
const BLOCK: usize = 48;

/// `a b` where everything above the diagonal of `b` is zero.
pub(crate) fn times_lower(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let n = b.nrows();
    let mut product = DMatrix::zeros(a.nrows(), n);
    for first in (0..n).step_by(BLOCK) {
        let (width, rest) = (BLOCK.min(n - first), n - first);
        product.columns_mut(first, width).gemm(
            1.0,
            &a.columns(first, rest),
            &b.view((first, first), (rest, width)),
            0.0,
        );
    }
    product
}

/// `a = P L U` with rows interchanged for the largest pivot of each column.
pub(crate) struct Factors {
    /// L below the diagonal, whose own are ones, and U.
    lu: DMatrix<f64>,
    /// The row that came to each place, in order.
    interchanges: Vec<usize>,
}

impl Factors {
    /// Of a square matrix. Where it is singular, what is solved with it is not finite.
    pub(crate) fn of(mut lu: DMatrix<f64>) -> Self {
        let n = lu.nrows();
        let mut interchanges = Vec::with_capacity(n);
        for first in (0..n).step_by(BLOCK) {
            let end = n.min(first + BLOCK);
            eliminate(&mut lu, first, end, &mut interchanges);
            if end == n {
                break;
            }
            solve_upper_rows(&mut lu, first, end);
            let left = lu.view((end, first), (n - end, end - first)).into_owned();
            let upper = lu.view((first, end), (end - first, n - end)).into_owned();
            lu.view_mut((end, end), (n - end, n - end)).gemm(-1.0, &left, &upper, 1.0);
        }
        Self { lu, interchanges }
    }

    /// `a⁻¹ b` for a column.
    pub(crate) fn solve(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.lu.nrows();
        let mut x = b.clone();
        for (row, &other) in self.interchanges.iter().enumerate() {
            x.swap_rows(row, other);
        }
        for k in 0..n {
            let known = x[k];
            take_away(&mut x.as_mut_slice()[k + 1..], known, &self.lu.as_slice()[k * n + k + 1..(k + 1) * n]);
        }
        for k in (0..n).rev() {
            x[k] /= self.lu[(k, k)];
            let known = x[k];
            take_away(&mut x.as_mut_slice()[..k], known, &self.lu.as_slice()[k * n..k * n + k]);
        }
        x
    }
}

/// Eliminates below the diagonal of some columns, in these alone; rows are interchanged in all.
fn eliminate(lu: &mut DMatrix<f64>, first: usize, end: usize, interchanges: &mut Vec<usize>) {
    let n = lu.nrows();
    for k in first..end {
        let pivot =
            (k + 1..n).fold(k, |best, row| if lu[(row, k)].abs() > lu[(best, k)].abs() { row } else { best });
        interchanges.push(pivot);
        lu.swap_rows(k, pivot);
        let inverse = 1.0 / lu[(k, k)];
        // Columns lie one after the other.
        let (columns, later) = lu.as_mut_slice().split_at_mut((k + 1) * n);
        let column = &mut columns[k * n + k + 1..];
        column.iter_mut().for_each(|entry| *entry *= inverse);
        for other in later.chunks_exact_mut(n).take(end - k - 1) {
            let factor = other[k];
            take_away(&mut other[k + 1..], factor, column);
        }
    }
}

/// The rows of U that belong to eliminated columns, to the right of them.
fn solve_upper_rows(lu: &mut DMatrix<f64>, first: usize, end: usize) {
    let n = lu.nrows();
    let (columns, later) = lu.as_mut_slice().split_at_mut(end * n);
    for other in later.chunks_exact_mut(n) {
        for k in first..end {
            let factor = other[k];
            take_away(&mut other[k + 1..end], factor, &columns[k * n + k + 1..k * n + end]);
        }
    }
}

/// `y −= factor x`.
fn take_away(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spread, not quality; of either sign, so that rows are interchanged.
    fn noise(n: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, columns, |i, j| (12.9898 * (i + 1) as f64 + 78.233 * (j * j + 1) as f64).sin())
    }

    #[test]
    fn solutions_are_those_of_nalgebra_for_sizes_about_the_blocks() {
        for n in [1, 2, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 5, 150] {
            let (a, b) = (noise(n, n) + DMatrix::identity(n, n) * 0.1, noise(n, 1));
            let factors = Factors::of(a.clone());
            assert!(n < 3 || factors.interchanges.iter().enumerate().any(|(row, &other)| row != other));
            let (x, expected) = (factors.solve(&b), a.clone().lu().solve(&b).unwrap());
            let residual = (&a * &x - &b).amax() / (a.amax() * x.amax() * n as f64);
            assert!(residual < 1e-14, "{n}: {residual:e}");
            assert!((&x - &expected).amax() < 1e-7 * expected.amax(), "{n}");
        }
    }

    #[test]
    fn a_singular_matrix_leaves_nothing_finite_and_a_wrong_entry_is_seen() {
        let mut a = noise(60, 60);
        let b = noise(60, 1);
        let x = Factors::of(a.clone()).solve(&b);
        a[(40, 3)] += 1e-3;
        assert!((&a * &x - &b).amax() > 1e-9);
        a.column_mut(7).fill(0.0);
        assert!(Factors::of(a).solve(&b).iter().any(|v| !v.is_finite()));
    }

    #[test]
    fn products_with_a_lower_triangle_are_whole_products() {
        for n in [1, BLOCK, 130] {
            let (a, b) = (noise(n, n), noise(n, n).lower_triangle());
            assert!((times_lower(&a, &b) - &a * &b).amax() < 1e-12, "{n}");
        }
    }
}
