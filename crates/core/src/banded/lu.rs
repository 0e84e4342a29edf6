//! Banded matrices that are not symmetric, and their LU factorisation with row interchanges.
//!
//! A wall that rubs in proportion to what presses on it has no potential, and the Newton matrix of both together is not
//! symmetric (`methods/kirchhoff/settle.rs`). The unknowns of a rod couple neighbouring nodes alone, so the matrix is a band
//! of C − 1 entries on either side of the diagonal, and elimination with partial pivoting fills C − 1 more on the right
//! (Golub and Van Loan, *Matrix Computations*, 4th ed., section 4.3.3; LAPACK's `dgbtrf`). Most of that stays empty: rows end with the
//! block after their own, and what elimination fills with that of the farthest pivot so far (`dgbtf2` keeps the same account of columns). Plain
//! loops will do, and faer has no band solver that keeps its memory.

use super::ldlt::FactorError;
use super::matrix::{BandMatrix, Shift};

/// A banded matrix of the width of a [`BandMatrix`] of blocks of `C / 2` rows, not symmetric, and its factors in its place.
#[derive(Debug, Clone, Default)]
pub struct BandLu<const C: usize> {
    /// Row i holds the columns from i − (C − 1) to i + 2 (C − 1).
    rows: Vec<f64>,
    /// The row that took the place of each.
    pivots: Vec<usize>,
}

impl<const C: usize> BandLu<C> {
    /// Entries on either side of the diagonal.
    const SIDE: usize = C - 1;
    /// Rows of a block.
    const BLOCK: usize = C / 2;
    /// Entries a row has room for.
    const STRIDE: usize = 3 * (C - 1) + 1;

    /// Takes memory for matrices of this dimension.
    pub(crate) fn reserve(&mut self, dimension: usize) {
        self.rows.reserve((dimension * Self::STRIDE).saturating_sub(self.rows.len()));
        self.pivots.reserve(dimension.saturating_sub(self.pivots.len()));
    }

    /// Number of rows.
    pub fn dimension(&self) -> usize {
        self.pivots.len()
    }

    /// Place of entry `(i, j)`.
    #[inline]
    fn at(i: usize, j: usize) -> usize {
        i * Self::STRIDE + (j + Self::SIDE - i)
    }

    /// The last unknown that unknown `i` is coupled with.
    #[inline]
    fn last(&self, i: usize) -> usize {
        ((i / Self::BLOCK + 2) * Self::BLOCK).min(self.dimension()) - 1
    }

    /// Sets this to a symmetric matrix plus `factor` times a shift.
    pub fn copy_from(&mut self, matrix: &BandMatrix<C>, shift: &Shift, factor: f64) {
        let n = matrix.dimension();
        self.rows.clear();
        self.rows.resize(n * Self::STRIDE, 0.0);
        self.pivots.clear();
        self.pivots.extend(0..n);
        for i in 0..n {
            for j in i..=self.last(i) {
                let value = matrix.get(i, j);
                self.rows[Self::at(i, j)] = value;
                self.rows[Self::at(j, i)] = value;
            }
            let next = i + C / 2;
            self.rows[Self::at(i, i)] += factor * shift.diagonal[i];
            if next < n {
                self.rows[Self::at(i, next)] += factor * shift.next[i];
                self.rows[Self::at(next, i)] += factor * shift.next[i];
            }
        }
    }

    /// Adds to entry `(i, j)` alone. Entries outside the blocks are ignored; only a caller that numbered its unknowns wrongly asks
    /// for them, which debug builds report.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let is_inside = (i / Self::BLOCK).abs_diff(j / Self::BLOCK) <= 1;
        debug_assert!(is_inside, "entry ({i}, {j}) lies outside the blocks");
        if is_inside && let Some(entry) = self.rows.get_mut(Self::at(i, j)) {
            *entry += value;
        }
    }

    /// Turns row `i` into that of the identity: the unknown is held.
    pub fn hold(&mut self, i: usize) {
        self.rows[i * Self::STRIDE..(i + 1) * Self::STRIDE].fill(0.0);
        self.rows[Self::at(i, i)] = 1.0;
    }

    /// Factors the matrix in its place.
    ///
    /// # Errors
    /// A column without a pivot that is a number other than zero.
    pub fn factor(&mut self) -> Result<(), FactorError> {
        // Rows worked on so far end here: as far as the farthest of those that have become pivots.
        let mut right = 0;
        for k in 0..self.dimension() {
            let below = self.last(k);
            let mut p = k;
            let mut largest = self.rows[Self::at(k, k)].abs();
            for i in k + 1..=below {
                let size = self.rows[Self::at(i, k)].abs();
                if size > largest || size.is_nan() {
                    (p, largest) = (i, size);
                }
            }
            if !largest.is_finite() {
                return Err(FactorError::NotFinite { row: k });
            }
            if largest == 0.0 {
                return Err(FactorError::ZeroPivot { row: k });
            }
            self.pivots[k] = p;
            right = right.max(self.last(p));
            if p != k {
                for j in k..=right {
                    self.rows.swap(Self::at(k, j), Self::at(p, j));
                }
            }
            let width = right - k;
            let (done, rest) = self.rows.split_at_mut((k + 1) * Self::STRIDE);
            let pivot_row = &done[Self::at(k, k)..=Self::at(k, k) + width];
            let inverse = 1.0 / pivot_row[0];
            for i in k + 1..=below {
                let begin = Self::at(i, k) - (k + 1) * Self::STRIDE;
                let row = &mut rest[begin..=begin + width];
                let l = row[0] * inverse;
                row[0] = l;
                if l != 0.0 {
                    row[1..].iter_mut().zip(&pivot_row[1..]).for_each(|(a, u)| *a -= l * u);
                }
            }
        }
        Ok(())
    }

    /// Replaces `b` by the solution of A x = b.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.dimension();
        for k in 0..n {
            b.swap(k, self.pivots[k]);
            let value = b[k];
            for i in k + 1..=(k + Self::SIDE).min(n - 1) {
                b[i] -= self.rows[Self::at(i, k)] * value;
            }
        }
        for k in (0..n).rev() {
            let right = (k + 2 * Self::SIDE).min(n - 1);
            let begin = Self::at(k, k);
            let row = &self.rows[begin..=begin + (right - k)];
            let known: f64 = row[1..].iter().zip(&b[k + 1..]).map(|(u, x)| u * x).sum();
            b[k] = (b[k] - known) / row[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A matrix whose unsymmetric part is large and some of whose diagonal entries are zero.
    fn matrix<const C: usize>(blocks: usize) -> (BandLu<C>, DMatrix<f64>) {
        let n = blocks * C / 2;
        let mut half = BandMatrix::<C>::zeros(n);
        let mut shift = Shift::default();
        shift.reset(n);
        let mut dense = DMatrix::zeros(n, n);
        let number = |i: usize, j: usize| (1.3 * i as f64 + 2.7 * j as f64 + (i * j) as f64).sin();
        for i in 0..n {
            for j in i..((i / (C / 2) + 2) * (C / 2)).min(n) {
                let value = if i == j && i % 3 == 0 { 0.0 } else { number(i, j) };
                half.add(i, j, value);
                dense[(i, j)] = value;
                dense[(j, i)] = value;
            }
            shift.diagonal[i] = 0.1 * (i % 3) as f64;
            dense[(i, i)] += 2.0 * shift.diagonal[i];
            if i + C / 2 < n {
                shift.next[i] = 0.01 * i as f64;
                dense[(i, i + C / 2)] += 2.0 * shift.next[i];
                dense[(i + C / 2, i)] += 2.0 * shift.next[i];
            }
        }
        let mut lu = BandLu::default();
        lu.reserve(n);
        lu.copy_from(&half, &shift, 2.0);
        for i in 0..n {
            for j in i.saturating_sub(C / 2)..(i + C / 2).min(n) {
                lu.add(i, j, 3.0 * number(j, i));
                dense[(i, j)] += 3.0 * number(j, i);
            }
        }
        lu.hold(4);
        dense.row_mut(4).fill(0.0);
        dense[(4, 4)] = 1.0;
        (lu, dense)
    }

    fn agrees_with_a_dense_solution<const C: usize>() {
        let (mut lu, dense) = matrix::<C>(7);
        let b = DVector::from_fn(dense.nrows(), |i, _| (0.7 * i as f64).cos());
        let mut x = b.as_slice().to_vec();
        lu.factor().unwrap();
        lu.solve(&mut x);
        let expected = dense.clone().lu().solve(&b).unwrap();
        let found = DVector::from_vec(x);
        assert!((&found - &expected).norm() < 1e-9 * expected.norm(), "{}", (found - expected).norm());
        // A symmetric solution would be another one.
        let other = dense.transpose().lu().solve(&b).unwrap();
        assert!((other - &expected).norm() > 0.1 * expected.norm());
    }

    #[test]
    fn solves_as_a_dense_matrix_does_for_both_widths() {
        agrees_with_a_dense_solution::<12>();
        agrees_with_a_dense_solution::<16>();
    }

    #[test]
    fn a_singular_matrix_and_one_that_is_no_number_are_told() {
        let mut shift = Shift::default();
        shift.reset(12);
        let mut lu = BandLu::<12>::default();
        lu.copy_from(&BandMatrix::zeros(12), &shift, 0.0);
        assert_eq!(lu.factor(), Err(FactorError::ZeroPivot { row: 0 }));
        lu.copy_from(&BandMatrix::zeros(12), &shift, 0.0);
        (0..12).for_each(|i| lu.add(i, i, if i == 5 { f64::NAN } else { 1.0 }));
        assert_eq!(lu.factor(), Err(FactorError::NotFinite { row: 5 }));
    }
}
