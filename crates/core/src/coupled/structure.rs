//! The structure of the factor of a band with couplings, block by block, and where the matrix's entries go in it.
//!
//! Whole nodes are eliminated in an order that keeps the factor sparse, found by faer (approximate minimum degree: P.
//! R. Amestoy, T. A. Davis, I. S. Duff, SIAM J. Matrix Anal. Appl. 17 (1996)). A column of the factor has the rows of
//! the matrix's column, and those of each column whose first row it is (T. A. Davis, *Direct Methods for Sparse Linear
//! Systems*, 2006, section 4.4).

use crate::banded::FactorError;

/// A block of the matrix's lower triangle in the order of elimination.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Place of its column in the order.
    pub(super) column: usize,
    /// Number of the factor's block below the diagonal; `None` on the diagonal.
    pub(super) below: Option<usize>,
    pub(super) source: Source,
}

/// Source of the entries of a block.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// The band's diagonal block of a node.
    Own(usize),
    /// The band's block of a node and the next; if `true`, its rows are those of the next.
    Next(usize, bool),
    /// A coupling of the structure; if `true`, its rows are those of the later node.
    Coupling(usize, bool),
}

/// The structure of a factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Structure {
    /// The couplings for which it was found, in ascending order.
    pub(super) nodes: Vec<(usize, usize)>,
    /// Node at each place of the elimination.
    pub(super) order: Vec<usize>,
    /// Blocks of the matrix, column by column.
    pub(super) blocks: Vec<Block>,
    /// First block below the diagonal of each column; one more at the end.
    pub(super) starts: Vec<usize>,
    /// Row of each block below the diagonal; ascending in a column.
    pub(super) rows: Vec<usize>,
    /// First of the updates of each column; one more at the end.
    update_starts: Vec<usize>,
    /// Earlier columns that a column depends on, each with the number of its block in the column's row.
    updates: Vec<(usize, usize)>,
}

impl Structure {
    /// The structure for so many nodes and these couplings.
    pub(super) fn new(nodes: usize, couplings: &[(usize, usize)]) -> Result<Self, FactorError> {
        let order = order(nodes, couplings)?;
        let mut places = vec![0; nodes];
        for (place, node) in order.iter().enumerate() {
            places[*node] = place;
        }
        let mut sorted = couplings.to_vec();
        sorted.sort_unstable();
        let mut structure = Self { nodes: sorted, order, ..Self::default() };
        structure.find_rows(&places);
        structure.find_updates();
        structure.find_blocks(&places);
        Ok(structure)
    }

    /// Columns of the factor.
    pub(super) fn columns(&self) -> usize {
        self.order.len()
    }

    /// The blocks below the diagonal of a column.
    pub(super) fn below(&self, column: usize) -> std::ops::Range<usize> {
        self.starts[column]..self.starts[column + 1]
    }

    /// Earlier columns that a column depends on, each with the number of its block in the column's row.
    pub(super) fn updates(&self, column: usize) -> &[(usize, usize)] {
        &self.updates[self.update_starts[column]..self.update_starts[column + 1]]
    }

    /// The column that first depends on a column.
    pub(super) fn parent(&self, column: usize) -> Option<usize> {
        self.rows[self.below(column)].first().copied()
    }

    /// Finds the rows of each column.
    fn find_rows(&mut self, places: &[usize]) {
        let columns = places.len();
        let mut own: Vec<Vec<usize>> = vec![Vec::new(); columns];
        let pairs = (1..columns).map(|node| (node - 1, node)).chain(self.nodes.iter().copied());
        for (i, j) in pairs {
            let (p, q) = (places[i].min(places[j]), places[i].max(places[j]));
            own[p].push(q);
        }
        self.starts.push(0);
        for column in 0..columns {
            let mut rows = std::mem::take(&mut own[column]);
            rows.sort_unstable();
            rows.dedup();
            if let Some((parent, others)) = rows.split_first() {
                own[*parent].extend_from_slice(others);
            }
            self.rows.append(&mut rows);
            self.starts.push(self.rows.len());
        }
    }

    /// Finds what each column depends on.
    fn find_updates(&mut self) {
        let columns = self.columns();
        self.update_starts = vec![0; columns + 1];
        self.rows.iter().for_each(|row| self.update_starts[row + 1] += 1);
        for column in 0..columns {
            self.update_starts[column + 1] += self.update_starts[column];
        }
        let mut next = self.update_starts.clone();
        self.updates = vec![(0, 0); self.rows.len()];
        for column in 0..columns {
            for at in self.below(column) {
                let row = self.rows[at];
                self.updates[next[row]] = (column, at);
                next[row] += 1;
            }
        }
    }

    /// Finds where the blocks of the matrix go.
    fn find_blocks(&mut self, places: &[usize]) {
        let block = |i: usize, j: usize, source: fn(usize, bool) -> Source, of: usize| {
            // Rows of the source are those of the earlier node i.
            let (p, q) = (places[i], places[j]);
            let (column, row) = (p.min(q), p.max(q));
            let below = self.below(column);
            let at = self.rows[below.clone()].binary_search(&row).map_or(below.end, |at| below.start + at);
            Block { column, below: Some(at), source: source(of, q > p) }
        };
        let mut blocks: Vec<Block> = Vec::new();
        for node in 0..places.len() {
            blocks.push(Block { column: places[node], below: None, source: Source::Own(node) });
            if node + 1 < places.len() {
                blocks.push(block(node, node + 1, Source::Next, node));
            }
        }
        blocks.extend(self.nodes.iter().enumerate().map(|(k, (i, j))| block(*i, *j, Source::Coupling, k)));
        blocks.sort_unstable_by_key(|b| (b.column, b.below));
        self.blocks = blocks;
    }
}

/// The order of the nodes: right, with more fill. Methods that ask for self-contact are refused before.
#[cfg(not(feature = "self-contact"))]
fn order(count: usize, _: &[(usize, usize)]) -> Result<Vec<usize>, FactorError> {
    Ok((0..count).collect())
}

/// An order in which to eliminate nodes; the last one, that of end supports, stays last.
#[cfg(feature = "self-contact")]
fn order(count: usize, couplings: &[(usize, usize)]) -> Result<Vec<usize>, FactorError> {
    use faer::dyn_stack::{MemBuffer, MemStack};
    use faer::sparse::SymbolicSparseColMatRef;
    use faer::sparse::linalg::amd;

    let nodes = count - 1;
    let mut edges: Vec<(usize, usize)> = couplings.to_vec();
    edges.extend((1..nodes).map(|j| (j - 1, j)));
    edges.sort_unstable_by_key(|(i, j)| (*j, *i));
    let rows: Vec<usize> = edges.iter().map(|(i, _)| *i).collect();
    let starts: Vec<usize> = (0..=nodes).map(|j| edges.partition_point(|edge| edge.1 < j)).collect();
    let graph = SymbolicSparseColMatRef::new_checked(nodes, nodes, &starts, None, &rows);
    let (mut order, mut places) = (vec![0; nodes], vec![0; nodes]);
    let memory = MemBuffer::try_new(amd::order_scratch::<usize>(nodes, rows.len()));
    let mut memory = memory.map_err(|_| FactorError::NotFinite { row: 0 })?;
    let stack = MemStack::new(&mut memory);
    amd::order(&mut order, &mut places, graph, amd::Control::default(), stack)
        .map_err(|_| FactorError::ZeroPivot { row: 0 })?;
    order.push(nodes);
    Ok(order)
}
