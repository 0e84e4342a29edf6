//! What is remembered of a part, and how forces depend on it: sparse with sums along the rod as intermediates, in both directions.

use super::super::tail::TWIST;
use super::sparse::Sparse;

/// Numbers of a force and a moment about the device.
pub(super) const WRENCH: usize = 4;

/// Where the numbers are that are remembered of a state with so many rows and instruments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Memory {
    pub(super) rows: usize,
    pub(super) instruments: usize,
}

impl Memory {
    /// Of a number of a tail's twist.
    pub(super) fn twist(self, instrument: usize, number: usize) -> usize {
        self.rows + TWIST * instrument + number
    }

    /// Of the force across at the mouth.
    pub(super) fn across(self) -> usize {
        self.rows + TWIST * self.instruments
    }

    pub(super) fn len(self) -> usize {
        self.across() + 1
    }
}

/// Derivatives of forces in what is remembered, with sums along the rod before and the slid one as intermediates.
#[derive(Debug, Clone, Default)]
pub(super) struct Chain {
    pub(super) memory: usize,
    /// Numbers of elements before and after.
    pub(super) elements: [usize; 2],
    /// dψ of each element before and of each slid one, in what is remembered.
    pub(super) turns: Sparse,
    /// Of the forces, in what is remembered and the sums.
    pub(super) rows: Sparse,
}

impl Chain {
    /// Adds the change of the forces with what is remembered.
    pub(super) fn add_times(&self, memory: &[f64], to: &mut [f64]) {
        let [before, after] = self.elements;
        let mut turns = vec![0.0; before + after];
        self.turns.add_times(memory, &mut turns);
        let mut all = memory.to_vec();
        for part in [&turns[..before], &turns[before..]] {
            let mut sum = 0.0;
            all.push(sum);
            for turn in part {
                sum += turn;
                all.push(sum);
            }
        }
        self.rows.add_times(&all, to);
    }

    /// Adds the product of the transpose: of the forces' weights to those of what is remembered.
    pub(super) fn add_transposed_times(&self, weights: &[f64], to: &mut [f64]) {
        let [before, after] = self.elements;
        let mut all = vec![0.0; self.memory + before + after + 2];
        self.rows.add_transposed_times(weights, &mut all);
        let mut turns = Vec::with_capacity(before + after);
        let mut from = self.memory;
        for count in [before, after] {
            let sums = &all[from + 1..from + 1 + count];
            let mut ahead: Vec<f64> = sums
                .iter()
                .rev()
                .scan(0.0, |sum, weight| {
                    *sum += weight;
                    Some(*sum)
                })
                .collect();
            ahead.reverse();
            turns.extend(ahead);
            from += count + 1;
        }
        to.iter_mut().zip(&all).for_each(|(to, own)| *to += own);
        self.turns.add_transposed_times(&turns, to);
    }

    /// Adds the derivative of a force in a number that is remembered.
    pub(super) fn add_force(&mut self, row: usize, column: usize, value: f64) {
        self.rows.add(row, column, value);
    }
}
