//! Sparse matrices by their entries, and their products to both sides.

/// A matrix: row, column and value of each entry; those at the same place add up.
#[derive(Debug, Clone, Default)]
pub(super) struct Sparse {
    entries: Vec<(u32, u32, f64)>,
}

/// A row: its columns and values.
pub(super) type Row = Vec<(usize, f64)>;

impl Sparse {
    /// Adds an entry.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        if value != 0.0 {
            self.entries.push((row as u32, column as u32, value));
        }
    }

    /// Adds so many times a row.
    pub(super) fn add_row(&mut self, row: usize, values: &[(usize, f64)], times: f64) {
        values.iter().for_each(|(column, value)| self.add(row, *column, value * times));
    }

    /// Adds the product with a vector.
    pub(super) fn add_times(&self, vector: &[f64], to: &mut [f64]) {
        for (row, column, value) in &self.entries {
            to[*row as usize] += value * vector[*column as usize];
        }
    }

    /// Adds the product of the transpose with a vector.
    pub(super) fn add_transposed_times(&self, vector: &[f64], to: &mut [f64]) {
        for (row, column, value) in &self.entries {
            to[*column as usize] += value * vector[*row as usize];
        }
    }

    /// A row.
    pub(super) fn row(&self, row: usize) -> Row {
        let of = self.entries.iter().filter(|(own, ..)| *own as usize == row);
        of.map(|(_, column, value)| (*column as usize, *value)).collect()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}
