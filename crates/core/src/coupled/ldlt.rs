//! The LDLᵀ factorisation of a band with couplings, without pivoting.
//!
//! Whole nodes are eliminated in an order that keeps the factor sparse ([`super::structure`]). The unknowns of a node
//! stay together and in their order, and the rows of end supports come last. So a multiplier is eliminated after the
//! node at the end of its element, whose own unknowns it constrains: with the augmentation of [`crate::rod::assembly`]
//! their block is positive definite in any order of nodes, and the multiplier's pivot is negative. By Sylvester's law
//! the signs of D are the inertia, as in the band ([`crate::banded::ldlt`]).
//!
//! The factorisation is left-looking (Golub and Van Loan, *Matrix Computations*, 4th ed., section 4.2.9): a column is
//! the matrix's, less what the columns before it contribute. So a column whose entries are those of the last matrix,
//! and which depends on none that has changed, is kept: where a few contacts open or close, that is most of them. The
//! bits are those of a factorisation from the beginning.
//!
//! Blocks have 6 to 12 rows, a compile-time number, as in the band: the supernodes of coils are barely larger, and a
//! general sparse factorisation of such small ones takes four times as long (decision 18).

use pulp::{Arch, Simd, WithSimd};

use super::Couplings;
use super::structure::{Source, Structure};
use crate::banded::{BandMatrix, FactorError, Inertia, Shift};

/// A factorisation; its memory is reused, and its structure as long as the couplings are the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct CoupledFactor {
    structure: Structure,
    /// Number of each of the structure's couplings in the matrix that is factored.
    numbers: Vec<usize>,
    /// The matrix factored last, by the structure's blocks.
    matrix: Vec<f64>,
    /// Blocks on the diagonal: below it those of L, on it D.
    own: Vec<f64>,
    /// Blocks of L below the diagonal.
    below: Vec<f64>,
    /// Negative pivots of each column.
    negative: Vec<usize>,
    /// Columns that are factored; those after them are not, since a pivot was zero.
    factored: usize,
    /// Whether each column has changed, or depends on one that has.
    changed: Vec<bool>,
    /// Block of each row in the column that is computed.
    places: Vec<usize>,
    inertia: Inertia,
}

impl CoupledFactor {
    /// Inertia of the last matrix factored.
    pub(crate) fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Factors a matrix with `factor` times `shift`, and returns its inertia.
    pub(crate) fn factor_shifted<const C: usize>(
        &mut self,
        matrix: &BandMatrix<C>,
        couplings: &Couplings<C>,
        shift: &Shift,
        factor: f64,
    ) -> Result<Inertia, FactorError> {
        let columns = matrix.dimension() / (C / 2);
        if !(self.structure.columns() == columns && self.numbers_in(couplings)) {
            self.renew::<C>(columns, couplings.nodes())?;
            self.numbers_in(couplings);
        }
        Arch::new().dispatch(Eliminate { factor: self, matrix, couplings, shift: (shift, factor) })
    }

    /// Replaces `b` by the solution of `A x = b` with the matrix factored last; does nothing without one.
    pub(crate) fn solve<const C: usize>(&self, b: &mut [f64]) {
        Arch::new().dispatch(Solve::<C> { factor: self, b });
    }

    /// Finds the number of each coupling of the structure in a matrix; returns whether that has these and no others.
    fn numbers_in<const C: usize>(&mut self, couplings: &Couplings<C>) -> bool {
        let nodes = &self.structure.nodes;
        self.numbers.clear();
        self.numbers.extend(nodes.iter().map_while(|nodes| couplings.number(nodes)));
        self.numbers.len() == nodes.len() && nodes.len() == couplings.nodes().len()
    }

    /// Begins with another structure.
    fn renew<const C: usize>(
        &mut self,
        columns: usize,
        couplings: &[(usize, usize)],
    ) -> Result<(), FactorError> {
        self.structure = Structure::default();
        self.structure = Structure::new(columns, couplings)?;
        let size = (C / 2) * (C / 2);
        self.matrix.clear();
        self.matrix.resize(self.structure.blocks.len() * size, 0.0);
        self.own.clear();
        self.own.resize(columns * size, 0.0);
        self.below.clear();
        self.below.resize(self.structure.rows.len() * size, 0.0);
        self.negative.clear();
        self.negative.resize(columns, 0);
        self.places.clear();
        self.places.resize(columns, 0);
        self.factored = 0;
        Ok(())
    }

    /// Takes the entries of a matrix with `factor` times `shift`, and marks the columns in which they are others than
    /// before, with all that depend on them.
    #[inline(always)]
    fn take<const C: usize, const B: usize>(
        &mut self,
        matrix: &BandMatrix<C>,
        couplings: &Couplings<C>,
        (shift, factor): (&Shift, f64),
    ) {
        let Self { structure, numbers, changed, .. } = self;
        changed.clear();
        changed.extend((0..structure.columns()).map(|column| column >= self.factored));
        let (kept, _) = self.matrix.as_chunks_mut::<B>();
        let (kept, _) = kept.as_chunks_mut::<B>();
        for (block, kept) in structure.blocks.iter().zip(kept) {
            let mut entries = [[0.0; B]; B];
            match block.source {
                Source::Own(node) => {
                    for (r, entry) in entries.iter_mut().enumerate() {
                        // The upper triangle is the matrix's own.
                        let mut row = *matrix.row(node * B + r);
                        shift.add_to(node * B + r, factor, &mut row);
                        entry.copy_from_slice(&row[..B]);
                    }
                }
                Source::Next(node, is_later) => {
                    for r in 0..B {
                        let mut row = *matrix.row(node * B + r);
                        shift.add_to(node * B + r, factor, &mut row);
                        for c in 0..B {
                            let (i, j) = if is_later { (c, r) } else { (r, c) };
                            entries[i][j] = row[B + c];
                        }
                    }
                }
                Source::Coupling(number, is_later) => {
                    let values = couplings.entries(numbers[number]);
                    for r in 0..B {
                        for c in 0..B {
                            let (i, j) = if is_later { (c, r) } else { (r, c) };
                            entries[i][j] = values[r * B + c];
                        }
                    }
                }
            }
            if *kept != entries {
                *kept = entries;
                changed[block.column] = true;
            }
        }
        for column in 0..structure.columns() {
            if let Some(parent) = structure.parent(column).filter(|_| changed[column]) {
                changed[parent] = true;
            }
        }
    }

    /// Computes the columns that have changed.
    #[inline(always)]
    fn eliminate<const B: usize>(&mut self) -> Result<Inertia, FactorError> {
        let Self { structure, matrix, own, below, places, changed, negative, .. } = self;
        let (matrix, _) = matrix.as_chunks::<B>();
        let (matrix, _) = matrix.as_chunks::<B>();
        let (own, _) = own.as_chunks_mut::<B>();
        let (own, _) = own.as_chunks_mut::<B>();
        let (below, _) = below.as_chunks_mut::<B>();
        let (below, _) = below.as_chunks_mut::<B>();
        let columns = structure.columns();
        let mut taken = 0;
        for column in 0..columns {
            let first = taken;
            while structure.blocks.get(taken).is_some_and(|block| block.column == column) {
                taken += 1;
            }
            if !changed[column] {
                continue;
            }
            self.factored = column;
            let range = structure.below(column);
            let (before, rest) = below.split_at_mut(range.start);
            let blocks = &mut rest[..range.len()];
            blocks.fill([[0.0; B]; B]);
            for (place, row) in structure.rows[range].iter().enumerate() {
                places[*row] = place;
            }
            let mut diagonal = [[0.0; B]; B];
            for (block, entries) in structure.blocks[first..taken].iter().zip(&matrix[first..taken]) {
                match block.below {
                    Some(at) => blocks[at - structure.starts[column]] = *entries,
                    None => diagonal = transposed(entries),
                }
            }
            for (earlier, at) in structure.updates(column) {
                let mut by = transposed(&before[*at]);
                for (r, row) in by.iter_mut().enumerate() {
                    row.iter_mut().for_each(|entry| *entry *= own[*earlier][r][r]);
                }
                subtract_product(&mut diagonal, &before[*at], &by);
                let end = structure.starts[earlier + 1];
                for (row, block) in structure.rows[at + 1..end].iter().zip(&before[at + 1..end]) {
                    subtract_product(&mut blocks[places[*row]], block, &by);
                }
            }
            negative[column] = factor_block(&mut diagonal).map_err(|(r, is_zero)| {
                let row = structure.order[column] * B + r;
                if is_zero { FactorError::ZeroPivot { row } } else { FactorError::NotFinite { row } }
            })?;
            own[column] = diagonal;
            for block in blocks {
                divide(block, &diagonal);
            }
        }
        self.factored = columns;
        let negative = negative.iter().sum();
        self.inertia = Inertia { positive: columns * B - negative, negative };
        Ok(self.inertia)
    }

    #[inline(always)]
    fn solve_blocks<const B: usize>(&self, b: &mut [f64]) {
        let structure = &self.structure;
        let (b, _) = b.as_chunks_mut::<B>();
        let (own, _) = self.own.as_chunks::<B>();
        let (own, _) = own.as_chunks::<B>();
        let (below, _) = self.below.as_chunks::<B>();
        let (below, _) = below.as_chunks::<B>();
        for (column, own) in own.iter().enumerate() {
            let x = &mut b[structure.order[column]];
            for r in 0..B {
                for c in 0..r {
                    x[r] -= own[r][c] * x[c];
                }
            }
            let x = *x;
            let range = structure.below(column);
            for (row, block) in structure.rows[range.clone()].iter().zip(&below[range]) {
                let y = &mut b[structure.order[*row]];
                for (y, row) in y.iter_mut().zip(block) {
                    *y -= dot(row, &x);
                }
            }
        }
        for (column, own) in own.iter().enumerate().rev() {
            let node = structure.order[column];
            let mut x: [f64; B] = std::array::from_fn(|r| b[node][r] / own[r][r]);
            let range = structure.below(column);
            for (row, block) in structure.rows[range.clone()].iter().zip(&below[range]) {
                let y = &b[structure.order[*row]];
                for (row, y) in block.iter().zip(y) {
                    for c in 0..B {
                        x[c] -= row[c] * y;
                    }
                }
            }
            for r in (0..B).rev() {
                for c in 0..r {
                    x[c] -= own[r][c] * x[r];
                }
            }
            b[node] = x;
        }
    }
}

/// The transpose of a block.
#[inline(always)]
fn transposed<const B: usize>(block: &[[f64; B]; B]) -> [[f64; B]; B] {
    std::array::from_fn(|r| std::array::from_fn(|c| block[c][r]))
}

/// Subtracts the product of two blocks from a block.
#[inline(always)]
fn subtract_product<const B: usize>(from: &mut [[f64; B]; B], left: &[[f64; B]; B], right: &[[f64; B]; B]) {
    for (from, left) in from.iter_mut().zip(left) {
        let mut sum = *from;
        for (factor, row) in left.iter().zip(right) {
            for c in 0..B {
                sum[c] -= factor * row[c];
            }
        }
        *from = sum;
    }
}

/// The product of two rows.
#[inline(always)]
fn dot<const B: usize>(a: &[f64; B], b: &[f64; B]) -> f64 {
    // Two partial sums: the latency of one chain of additions would exceed the cost of the multiplications.
    let (mut even, mut odd) = (0.0, 0.0);
    for j in 0..B / 2 {
        even += a[2 * j] * b[2 * j];
        odd += a[2 * j + 1] * b[2 * j + 1];
    }
    even + odd
}

/// Replaces the lower triangle of a block on the diagonal by L, with D on the diagonal, and returns the number of
/// negative pivots; or the row of a pivot that is zero, or not finite, and which it is.
#[inline(always)]
fn factor_block<const B: usize>(block: &mut [[f64; B]; B]) -> Result<usize, (usize, bool)> {
    let mut negative = 0;
    for r in 0..B {
        let pivot = block[r][r];
        if pivot == 0.0 || !pivot.is_finite() {
            return Err((r, pivot == 0.0));
        }
        negative += usize::from(pivot < 0.0);
        let inverse = 1.0 / pivot;
        for i in r + 1..B {
            let factor = block[i][r] * inverse;
            for j in r + 1..=i {
                block[i][j] -= factor * block[j][r];
            }
        }
        for row in &mut block[r + 1..] {
            row[r] *= inverse;
        }
    }
    Ok(negative)
}

/// Divides a block by the transpose of a factored one on the diagonal.
#[inline(always)]
fn divide<const B: usize>(block: &mut [[f64; B]; B], own: &[[f64; B]; B]) {
    for row in block {
        for c in 0..B {
            for i in c + 1..B {
                row[i] -= row[c] * own[i][c];
            }
        }
        for c in 0..B {
            row[c] /= own[c][c];
        }
    }
}

/// A factorisation, dispatched to the processor's instruction set.
struct Eliminate<'a, const C: usize> {
    factor: &'a mut CoupledFactor,
    matrix: &'a BandMatrix<C>,
    couplings: &'a Couplings<C>,
    shift: (&'a Shift, f64),
}

impl<const C: usize> Eliminate<'_, C> {
    #[inline(always)]
    fn by<const B: usize>(self) -> Result<Inertia, FactorError> {
        self.factor.take::<C, B>(self.matrix, self.couplings, self.shift);
        self.factor.eliminate::<B>()
    }
}

impl<const C: usize> WithSimd for Eliminate<'_, C> {
    type Output = Result<Inertia, FactorError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        const { assert!(C >= 12 && C <= 24 && C.is_multiple_of(4), "a node has 6, 8, 10 or 12 unknowns") }
        match C {
            12 => self.by::<6>(),
            16 => self.by::<8>(),
            20 => self.by::<10>(),
            _ => self.by::<12>(),
        }
    }
}

/// A solution with existing factors, dispatched in the same way.
struct Solve<'a, const C: usize> {
    factor: &'a CoupledFactor,
    b: &'a mut [f64],
}

impl<const C: usize> WithSimd for Solve<'_, C> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { factor, b } = self;
        match C {
            12 => factor.solve_blocks::<6>(b),
            16 => factor.solve_blocks::<8>(b),
            20 => factor.solve_blocks::<10>(b),
            _ => factor.solve_blocks::<12>(b),
        }
    }
}
