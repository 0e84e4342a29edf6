//! The LDLᵀ factorisation of symmetric block tridiagonal matrices without pivoting.
//!
//! The rows of a rod's Newton system couple only neighbouring nodes, so with the unknowns of a node as one block the
//! matrix is block tridiagonal. faer has no such solver and LAPACK's band solver has a run-time width; with a
//! compile-time block size the inner loops unroll and vectorise, and a block's share of the band is processed at
//! once.
//!
//! The factorisation is the right-looking outer product form (Golub and Van Loan, *Matrix Computations*, 4th ed.,
//! section 4.1.2, block by block as in 4.5.1): the rows of a block are eliminated one after the other, then all are
//! subtracted from the next block at once. The forward solve is done in the same pass. All of it is also compiled for
//! AVX2, which [`pulp`] detects at run time; no operations are fused, so the bits do not depend on it. By Sylvester's
//! law the signs of D are the inertia of the matrix.
//!
//! No pivoting: an LDLᵀ of an indefinite matrix exists for the order of unknowns used here (a constraint comes after
//! the unknowns it constrains, see [`crate::rod::layout`]), and where it does not, the caller adds a shift and
//! retries. A pivot that is zero or not finite stops the factorisation and is reported with its row, so NaN never
//! spreads unnoticed.

use super::matrix::{BandMatrix, Shift};
use pulp::{Arch, Simd, WithSimd};

/// Numbers of positive, negative and zero eigenvalues (zero: the factorisation met a zero pivot and stopped).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Inertia {
    /// Positive pivots.
    pub positive: usize,
    /// Negative pivots.
    pub negative: usize,
}

/// Why a factorisation stopped.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum FactorError {
    /// A pivot is exactly zero: the leading block up to this row is singular.
    #[error("zero pivot in row {row}")]
    ZeroPivot {
        /// The row.
        row: usize,
    },
    /// A pivot is NaN or infinite: the matrix contains one, or overflowed.
    #[error("pivot in row {row} is not a finite number")]
    NotFinite {
        /// The row.
        row: usize,
    },
}

/// An LDLᵀ factorisation; its memory is reused.
#[derive(Debug, Clone)]
pub(crate) struct Factor<const C: usize> {
    /// Rows like those of the matrix: the inverse pivot on the diagonal, and right of it the column of L below the
    /// diagonal. One extra block of zeros, so that the kernel needs no special case for the last block.
    rows: Vec<[f64; C]>,
    dimension: usize,
    inertia: Inertia,
}

impl<const C: usize> Factor<C> {
    /// Allocates for matrices of this dimension.
    pub(crate) fn new(dimension: usize) -> Self {
        Self { rows: vec![[0.0; C]; dimension + C / 2], dimension, inertia: Inertia::default() }
    }

    /// Changes the dimension without releasing memory.
    pub(crate) fn resize(&mut self, dimension: usize) {
        self.rows.resize(dimension + C / 2, [0.0; C]);
        self.dimension = dimension;
    }

    /// Inertia of the last matrix factored.
    pub(crate) fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Factors `matrix` and returns its inertia.
    pub(crate) fn factor(&mut self, matrix: &BandMatrix<C>) -> Result<Inertia, FactorError> {
        self.eliminate::<false>(matrix, None, &mut [])
    }

    /// Factors `matrix` with `factor` times `shift` and returns its inertia.
    pub(crate) fn factor_shifted(
        &mut self,
        matrix: &BandMatrix<C>,
        shift: &Shift,
        factor: f64,
    ) -> Result<Inertia, FactorError> {
        self.eliminate::<false>(matrix, Some((shift, factor)), &mut [])
    }

    /// Factors `matrix` and replaces `b` by the solution of `A x = b`; the forward solve is fused with the
    /// factorisation. On an error `b` is overwritten with garbage.
    #[cfg(test)]
    pub(crate) fn factor_solve(
        &mut self,
        matrix: &BandMatrix<C>,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        let inertia = self.eliminate::<true>(matrix, None, b)?;
        Arch::new().dispatch(Solve::<C, false> { factor: self, b });
        Ok(inertia)
    }

    /// As [`Self::factor_solve`] with `factor` times `shift` added to the matrix.
    pub(crate) fn factor_solve_shifted(
        &mut self,
        matrix: &BandMatrix<C>,
        shift: &Shift,
        factor: f64,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        let inertia = self.eliminate::<true>(matrix, Some((shift, factor)), b)?;
        Arch::new().dispatch(Solve::<C, false> { factor: self, b });
        Ok(inertia)
    }

    /// Replaces `b` by the solution of `A x = b` with the matrix factored last.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        Arch::new().dispatch(Solve::<C, true> { factor: self, b });
    }

    /// `y = L⁻¹ b`.
    #[inline(always)]
    fn forward(&self, b: &mut [f64]) {
        let block = C / 2;
        let mut known = begun(b);
        for (k, rows) in self.rows[..self.dimension].chunks_exact(block).enumerate() {
            forward(rows, &mut b[k * block..], &mut known);
        }
    }

    /// `x = L⁻ᵀ D⁻¹ y`.
    #[inline(always)]
    fn backward(&self, b: &mut [f64]) {
        let block = C / 2;
        let mut known = [0.0; C];
        for (k, rows) in self.rows[..self.dimension].chunks_exact(block).enumerate().rev() {
            let now = &mut b[k * block..(k + 1) * block];
            // First the contribution of the next block, independently for each row; then the rows of this block, last
            // to first.
            let mut given = [0.0; C];
            for r in 0..block {
                // Two partial sums: the latency of one chain of additions would exceed the cost of the
                // multiplications.
                let (mut even, mut odd) = (0.0, 0.0);
                for j in 0..block / 2 {
                    even += rows[r][block + 2 * j] * known[2 * j];
                    odd += rows[r][block + 2 * j + 1] * known[2 * j + 1];
                }
                given[r] = now[r] * rows[r][r] - (even + odd);
            }
            for r in (0..block).rev() {
                let x = given[r];
                now[r] = x;
                known[r] = x;
                for i in 0..r {
                    given[i] -= rows[i][r] * x;
                }
            }
        }
    }

    /// Factors a matrix with a multiple of a shift into the rows, and replaces `b` by its forward solution.
    fn eliminate<const SOLVE: bool>(
        &mut self,
        matrix: &BandMatrix<C>,
        shift: Option<(&Shift, f64)>,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        Arch::new().dispatch(Eliminate::<C, SOLVE> { factor: self, matrix, shift, b })
    }

    #[inline(always)]
    fn eliminate_blocks<const B: usize, const SOLVE: bool>(
        &mut self,
        matrix: &BandMatrix<C>,
        shift: Option<(&Shift, f64)>,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        // Rows are processed in whole vectors: entries left of the start of a row are ignored. Short rows are
        // processed in halves, which all fit into registers.
        let whole: usize = const { if C >= 20 { 4 } else { 2 } };
        let n = self.dimension;
        let mut negative = 0;
        // What the previous block subtracts from the current one.
        let mut taken = [[0.0; B]; B];
        let mut known = begun(b);
        let (blocks, _) = self.rows[..n].as_chunks_mut::<B>();
        let (sources, _) = matrix.rows.as_chunks::<B>();
        for (k, (block, source)) in blocks.iter_mut().zip(sources).enumerate() {
            let begin = k * B;
            let mut rows = *source;
            if let Some((shift, factor)) = shift {
                for r in 0..B {
                    shift.add_to(begin + r, factor, &mut rows[r]);
                }
            }
            for r in 0..B {
                for j in 0..B {
                    rows[r][j] -= taken[r][j];
                }
            }
            unrolled!(r in 0..B, {
                let pivot = rows[r][r];
                if pivot == 0.0 {
                    return Err(FactorError::ZeroPivot { row: begin + r });
                }
                if !pivot.is_finite() {
                    return Err(FactorError::NotFinite { row: begin + r });
                }
                negative += usize::from(pivot < 0.0);
                let inverse = 1.0 / pivot;
                let mut l = [0.0; C];
                for j in (r + 1) / whole * whole..C {
                    l[j] = rows[r][j] * inverse;
                }
                unrolled!(i in 0..B, {
                    if i > r {
                        for j in i / whole * whole..C {
                            rows[i][j] -= l[i] * rows[r][j];
                        }
                    }
                });
                l[r] = inverse;
                block[r] = l;
            });
            unrolled!(i in 0..B, {
                let mut sum = [0.0; B];
                for r in 0..B {
                    for j in i / 2 * 2..B {
                        sum[j] += block[r][B + i] * rows[r][B + j];
                    }
                }
                taken[i] = sum;
            });
            if SOLVE {
                forward(block, &mut b[begin..], &mut known);
            }
        }
        self.inertia = Inertia { positive: n - negative, negative };
        Ok(self.inertia)
    }
}

/// A factorisation, dispatched to the processor's instruction set.
struct Eliminate<'a, const C: usize, const SOLVE: bool> {
    factor: &'a mut Factor<C>,
    matrix: &'a BandMatrix<C>,
    shift: Option<(&'a Shift, f64)>,
    b: &'a mut [f64],
}

impl<const C: usize, const SOLVE: bool> WithSimd for Eliminate<'_, C, SOLVE> {
    type Output = Result<Inertia, FactorError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        const { assert!(C >= 12 && C <= 24 && C.is_multiple_of(4), "a node has 6, 8, 10 or 12 unknowns") }
        let Self { factor, matrix, shift, b } = self;
        match C {
            12 => factor.eliminate_blocks::<6, SOLVE>(matrix, shift, b),
            16 => factor.eliminate_blocks::<8, SOLVE>(matrix, shift, b),
            20 => factor.eliminate_blocks::<10, SOLVE>(matrix, shift, b),
            _ => factor.eliminate_blocks::<12, SOLVE>(matrix, shift, b),
        }
    }
}

/// A solution with existing factors, dispatched in the same way; without its forward half if that was fused with the
/// factorisation. Within the elimination the backward half would take up registers.
struct Solve<'a, const C: usize, const FORWARD: bool> {
    factor: &'a Factor<C>,
    b: &'a mut [f64],
}

impl<const C: usize, const FORWARD: bool> WithSimd for Solve<'_, C, FORWARD> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { factor, b } = self;
        if FORWARD {
            factor.forward(b);
        }
        factor.backward(b);
    }
}

/// The rows with which a forward solve of `b` starts: see [`forward`].
#[inline(always)]
fn begun<const C: usize>(b: &[f64]) -> [f64; C] {
    let mut known = [0.0; C];
    if let Some(first) = b.get(..C / 2) {
        known[C / 2..].copy_from_slice(first);
    }
    known
}

/// The forward solve of one block: `b` begins with its rows. The second half of `known` holds their values after all
/// previous blocks, and on return those of the next block: passed in registers, not through memory.
#[inline(always)]
fn forward<const C: usize>(rows: &[[f64; C]], b: &mut [f64], known: &mut [f64; C]) {
    let block = C / 2;
    known.copy_within(block.., 0);
    let (now, next) = b.split_at_mut(block);
    if let Some(next) = next.get(..block) {
        known[block..].copy_from_slice(next);
    }
    unrolled!(r in 0..C / 2, {
        let y = known[r];
        for j in r + 1..C {
            known[j] -= rows[r][j] * y;
        }
    });
    now.copy_from_slice(&known[..block]);
}
