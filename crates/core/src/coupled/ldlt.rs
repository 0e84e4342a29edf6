//! The LDLᵀ factorisation of a band with couplings, without pivoting.
//!
//! Whole nodes are eliminated in an order that keeps the factor sparse (approximate minimum degree: P. R. Amestoy, T.
//! A. Davis, I. S. Duff, SIAM J. Matrix Anal. Appl. 17 (1996)), supernode by supernode, both by faer. The unknowns of
//! a node stay together and in their order, and the rows of end supports come last. So a multiplier is eliminated
//! after the node at the end of its element, whose own unknowns it constrains: with the augmentation of
//! [`crate::rod::assembly`] their block is positive definite in any order of nodes, and the multiplier's pivot is
//! negative. By Sylvester's law the signs of D are the inertia, as in the band ([`crate::banded::ldlt`]).

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::{LdltError, LdltRegularization};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLdltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::Couplings;
use crate::banded::{BandMatrix, FactorError, Inertia, Shift};

/// A block of the lower triangle in the order of elimination, and the source of its entries.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Positions of its rows and of its columns in the order of elimination.
    row: usize,
    column: usize,
    source: Source,
}

/// Source of the entries of a block.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// The band's diagonal block of a node.
    Own(usize),
    /// The band's block of a node and the next; if `true`, its rows are those of the next.
    Next(usize, bool),
    /// A coupling of the structure; if `true`, its rows are those of the later node.
    Coupling(usize, bool),
}

/// A factorisation; its memory is reused, and its structure as long as the couplings are the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct CoupledFactor {
    /// The couplings for which the structure was computed, in ascending order.
    nodes: Vec<(usize, usize)>,
    /// Number of each of them in the matrix that is factored.
    numbers: Vec<usize>,
    dimension: usize,
    /// Node at each position of the elimination.
    order: Vec<usize>,
    blocks: Vec<Block>,
    /// The structure of the lower triangle in the order of elimination.
    structure: Option<SymbolicSparseColMat<usize>>,
    values: Vec<f64>,
    symbolic: Option<Arc<SymbolicCholesky<usize>>>,
    factor: Vec<f64>,
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
        let known = self.symbolic.is_some() && self.dimension == matrix.dimension();
        if !(known && self.numbers_in(couplings)) {
            self.symbolic = None;
            self.analyse::<C>(matrix.dimension(), couplings.nodes())?;
            self.numbers_in(couplings);
        }
        self.gather(matrix, couplings, shift, factor);
        let (Some(symbolic), Some(structure)) = (self.symbolic.clone(), &self.structure) else {
            return Err(FactorError::ZeroPivot { row: 0 });
        };
        let mut memory = memory(symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Spec::default()))?;
        let mut numbers = std::mem::take(&mut self.factor);
        let lower = SparseColMatRef::new(structure.as_ref(), &self.values);
        let found = symbolic.factorize_numeric_ldlt(
            &mut numbers,
            lower,
            Side::Lower,
            LdltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        );
        let found = found.map(|_| ());
        self.factor = numbers;
        if let Err(LdltError::ZeroPivot { index }) = found {
            return Err(FactorError::ZeroPivot { row: self.row_of::<C>(index) });
        }
        self.inertia = self.count::<C>(&symbolic)?;
        Ok(self.inertia)
    }

    /// Replaces `b` by the solution of `A x = b` with the matrix factored last; does nothing without one.
    pub(crate) fn solve<const C: usize>(&self, b: &mut [f64]) {
        let Some(symbolic) = &self.symbolic else { return };
        let block = C / 2;
        let mut x: Vec<f64> =
            self.order.iter().flat_map(|node| &b[node * block..(node + 1) * block]).copied().collect();
        let Ok(mut memory) = memory(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)) else { return };
        LdltRef::new(symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut x, self.dimension, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        for (node, x) in self.order.iter().zip(x.chunks_exact(block)) {
            b[node * block..(node + 1) * block].copy_from_slice(x);
        }
    }

    /// Row of the matrix that is eliminated at a position.
    fn row_of<const C: usize>(&self, place: usize) -> usize {
        self.order[place / (C / 2)] * (C / 2) + place % (C / 2)
    }

    /// Finds the number of each coupling of the structure in a matrix; returns whether that has these and no others.
    fn numbers_in<const C: usize>(&mut self, couplings: &Couplings<C>) -> bool {
        self.numbers.clear();
        self.numbers.extend(self.nodes.iter().map_while(|nodes| couplings.number(nodes)));
        self.numbers.len() == self.nodes.len() && self.nodes.len() == couplings.nodes().len()
    }

    /// Finds an order of elimination and the structure of the factor.
    fn analyse<const C: usize>(
        &mut self,
        dimension: usize,
        couplings: &[(usize, usize)],
    ) -> Result<(), FactorError> {
        let block = C / 2;
        self.dimension = dimension;
        self.nodes.clear();
        self.nodes.extend_from_slice(couplings);
        self.nodes.sort_unstable();
        self.order = order(dimension / block, couplings)?;
        let mut places = vec![0; self.order.len()];
        for (place, node) in self.order.iter().enumerate() {
            places[*node] = place;
        }
        let below = |i: usize, j: usize, source: fn(usize, bool) -> Source, of: usize| {
            // Rows of the source are those of the earlier node i.
            let (p, q) = (places[i], places[j]);
            Block { row: p.max(q), column: p.min(q), source: source(of, q > p) }
        };
        self.blocks.clear();
        for node in 0..self.order.len() {
            self.blocks.push(Block { row: places[node], column: places[node], source: Source::Own(node) });
            if node + 1 < self.order.len() {
                self.blocks.push(below(node, node + 1, Source::Next, node));
            }
        }
        for (number, (i, j)) in self.nodes.iter().enumerate() {
            self.blocks.push(below(*i, *j, Source::Coupling, number));
        }
        self.blocks.sort_unstable_by_key(|b| (b.column, b.row));
        let (starts, rows) = columns(&self.blocks, block, |c| c..block);
        self.structure = Some(SymbolicSparseColMat::new_checked(dimension, dimension, starts, None, rows));
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        // faer reads the structure from the upper triangle in the given order.
        let mut upper: Vec<Block> =
            self.blocks.iter().map(|b| Block { row: b.column, column: b.row, ..*b }).collect();
        upper.sort_unstable_by_key(|b| (b.column, b.row));
        let (starts, rows) = columns(&upper, block, |c| 0..c + 1);
        let structure = SymbolicSparseColMatRef::new_checked(dimension, dimension, &starts, None, &rows);
        let found = factorize_symbolic_cholesky(structure, Side::Upper, SymmetricOrdering::Identity, params);
        let symbolic = found.map_err(|_| FactorError::ZeroPivot { row: 0 })?;
        self.factor.clear();
        self.factor.resize(symbolic.len_val(), 0.0);
        self.symbolic = Some(Arc::new(symbolic));
        Ok(())
    }

    /// Writes the entries of a matrix with `factor` times `shift` into the structure.
    fn gather<const C: usize>(
        &mut self,
        matrix: &BandMatrix<C>,
        couplings: &Couplings<C>,
        shift: &Shift,
        factor: f64,
    ) {
        let block = C / 2;
        self.values.clear();
        for column in self.blocks.chunk_by(|a, b| a.column == b.column) {
            for c in 0..block {
                for b in column {
                    let begin = self.values.len();
                    let shifted = match b.source {
                        Source::Own(node) => {
                            let i = node * block + c;
                            self.values.extend_from_slice(&matrix.row(i)[c..block]);
                            Some((0, shift.diagonal[i]))
                        }
                        Source::Next(node, true) => {
                            let i = node * block + c;
                            self.values.extend_from_slice(&matrix.row(i)[block..]);
                            Some((c, shift.next[i]))
                        }
                        Source::Next(node, false) => {
                            let rows = (0..block).map(|r| matrix.row(node * block + r)[block + c]);
                            self.values.extend(rows);
                            Some((c, shift.next[node * block + c]))
                        }
                        Source::Coupling(number, true) => {
                            let row = c * block..(c + 1) * block;
                            self.values.extend_from_slice(&couplings.entries(self.numbers[number])[row]);
                            None
                        }
                        Source::Coupling(number, false) => {
                            let entries = couplings.entries(self.numbers[number]);
                            self.values.extend((0..block).map(|r| entries[r * block + c]));
                            None
                        }
                    };
                    if let Some((at, unit)) = shifted {
                        self.values[begin + at] += factor * unit;
                    }
                }
            }
        }
    }

    /// Counts the signs of D.
    fn count<const C: usize>(&self, symbolic: &SymbolicCholesky<usize>) -> Result<Inertia, FactorError> {
        let SymbolicCholeskyRaw::Supernodal(raw) = symbolic.raw() else {
            return Err(FactorError::ZeroPivot { row: 0 });
        };
        let factor = SupernodalLdltRef::new(raw, &self.factor);
        let mut inertia = Inertia::default();
        for supernode in (0..raw.n_supernodes()).map(|s| factor.supernode(s)) {
            let values = supernode.val();
            for c in 0..values.ncols() {
                let (row, pivot) = (self.row_of::<C>(supernode.start() + c), values[(c, c)]);
                if !pivot.is_finite() {
                    return Err(FactorError::NotFinite { row });
                }
                if pivot == 0.0 {
                    return Err(FactorError::ZeroPivot { row });
                }
                *(if pivot < 0.0 { &mut inertia.negative } else { &mut inertia.positive }) += 1;
            }
        }
        Ok(inertia)
    }
}

/// Column starts and row indices of the triangle of blocks with this number of rows, given column by column; `own`
/// are the rows of a column of a diagonal block.
fn columns(
    blocks: &[Block],
    size: usize,
    own: impl Fn(usize) -> std::ops::Range<usize>,
) -> (Vec<usize>, Vec<usize>) {
    let (mut starts, mut rows) = (Vec::new(), Vec::new());
    for column in blocks.chunk_by(|a, b| a.column == b.column) {
        for c in 0..size {
            starts.push(rows.len());
            for b in column {
                let inside = if b.row == b.column { own(c) } else { 0..size };
                rows.extend(inside.map(|r| b.row * size + r));
            }
        }
    }
    starts.push(rows.len());
    (starts, rows)
}

/// Workspace for faer.
fn memory(size: StackReq) -> Result<MemBuffer, FactorError> {
    MemBuffer::try_new(size).map_err(|_| FactorError::NotFinite { row: 0 })
}

/// An order in which to eliminate `blocks` nodes; the last one, that of end supports, stays last.
fn order(blocks: usize, couplings: &[(usize, usize)]) -> Result<Vec<usize>, FactorError> {
    let nodes = blocks - 1;
    let mut edges: Vec<(usize, usize)> = couplings.to_vec();
    edges.extend((1..nodes).map(|j| (j - 1, j)));
    edges.sort_unstable_by_key(|(i, j)| (*j, *i));
    let rows: Vec<usize> = edges.iter().map(|(i, _)| *i).collect();
    let starts: Vec<usize> = (0..=nodes).map(|j| edges.partition_point(|edge| edge.1 < j)).collect();
    let graph = SymbolicSparseColMatRef::new_checked(nodes, nodes, &starts, None, &rows);
    let (mut order, mut places) = (vec![0; nodes], vec![0; nodes]);
    let mut memory = memory(amd::order_scratch::<usize>(nodes, rows.len()))?;
    let stack = MemStack::new(&mut memory);
    amd::order(&mut order, &mut places, graph, amd::Control::default(), stack)
        .map_err(|_| FactorError::ZeroPivot { row: 0 })?;
    order.push(nodes);
    Ok(order)
}
