//! Blocks of a symmetric matrix that couple nodes which are not neighbours.

use rustc_hash::FxHashMap;

/// Blocks of `C / 2` rows and columns beside a [`BandMatrix`](crate::banded::BandMatrix) of the same unknowns: each
/// couples a node with one at least two nodes later.
#[derive(Debug, Clone, Default)]
pub(crate) struct Couplings<const C: usize> {
    /// Nodes (i, j), i < j, of each block, in the order of insertion.
    nodes: Vec<(usize, usize)>,
    /// Entries, block by block and row by row; rows are those of the earlier node.
    values: Vec<f64>,
    /// Index of the block of two nodes.
    numbers: FxHashMap<(usize, usize), usize>,
}

impl<const C: usize> Couplings<C> {
    /// Rows of a block.
    const BLOCK: usize = C / 2;

    /// Whether only neighbouring nodes are coupled.
    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Removes all blocks; keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.nodes.clear();
        self.values.clear();
        self.numbers.clear();
    }

    /// Adds the derivatives in `N` unknowns of each of two nodes, rows of the first and columns of the second, where
    /// `first` is the number of the first of these unknowns in its node. The nodes are not neighbours.
    pub(crate) fn add_block<const N: usize>(
        &mut self,
        (one, other): (usize, usize),
        first: usize,
        values: &[[f64; N]; N],
    ) {
        debug_assert!(one.abs_diff(other) > 1, "nodes {one} and {other} are coupled in the band");
        let block = Self::BLOCK;
        let nodes = (one.min(other), one.max(other));
        let next = self.nodes.len();
        let number = *self.numbers.entry(nodes).or_insert(next);
        if number == next {
            self.nodes.push(nodes);
            self.values.resize((next + 1) * block * block, 0.0);
        }
        let entries = &mut self.values[number * block * block..(number + 1) * block * block];
        for (a, row) in values.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                let (row, column) = if one < other { (a, b) } else { (b, a) };
                entries[(first + row) * block + first + column] += value;
            }
        }
    }

    /// Entry `(i, j)`; zero outside the blocks.
    #[cfg(test)]
    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        let block = Self::BLOCK;
        let number = self.numbers.get(&(i / block, j / block));
        number.map_or(0.0, |number| self.values[number * block * block + i % block * block + j % block])
    }

    /// Clears row and column `i`: the unknown is held.
    pub(crate) fn hold(&mut self, i: usize) {
        let block = Self::BLOCK;
        let (node, own) = (i / block, i % block);
        for (number, nodes) in self.nodes.iter().enumerate() {
            let entries = &mut self.values[number * block * block..(number + 1) * block * block];
            if nodes.0 == node {
                entries[own * block..(own + 1) * block].fill(0.0);
            } else if nodes.1 == node {
                entries.iter_mut().skip(own).step_by(block).for_each(|entry| *entry = 0.0);
            }
        }
    }

    /// Nodes (i, j), i < j, of each block.
    pub(super) fn nodes(&self) -> &[(usize, usize)] {
        &self.nodes
    }

    /// Number of the block of two nodes, the earlier one first.
    pub(super) fn number(&self, nodes: &(usize, usize)) -> Option<usize> {
        self.numbers.get(nodes).copied()
    }

    /// Entries of a block, row by row.
    pub(super) fn entries(&self, number: usize) -> &[f64] {
        &self.values[number * Self::BLOCK * Self::BLOCK..(number + 1) * Self::BLOCK * Self::BLOCK]
    }
}
