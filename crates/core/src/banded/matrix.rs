//! Symmetric block tridiagonal matrices, and shifts that are added to them.

/// A symmetric matrix of blocks of `C / 2` rows, each coupled with the next.
///
/// A row of the upper triangle holds `C` numbers: the columns of its own block and of the next. Those left of the
/// diagonal are zero.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BandMatrix<const C: usize> {
    pub(super) rows: Vec<[f64; C]>,
}

impl<const C: usize> BandMatrix<C> {
    /// Rows of a block.
    const BLOCK: usize = C / 2;

    /// The zero matrix; `dimension` is a multiple of `C / 2`.
    pub(crate) fn zeros(dimension: usize) -> Self {
        debug_assert!(dimension.is_multiple_of(Self::BLOCK), "{dimension} rows are no whole blocks");
        Self { rows: vec![[0.0; C]; dimension] }
    }

    /// Number of rows.
    pub(crate) fn dimension(&self) -> usize {
        self.rows.len()
    }

    /// Row `i` of the upper triangle: the columns of its own block and of the next.
    pub(crate) fn row(&self, i: usize) -> &[f64; C] {
        &self.rows[i]
    }

    /// Changes the dimension without releasing memory; entries are undefined afterwards.
    pub(crate) fn resize(&mut self, dimension: usize) {
        self.rows.resize(dimension, [0.0; C]);
    }

    /// Adds `value` to entry `(i, j)` and, by symmetry, `(j, i)`. Entries outside the blocks are ignored; they are an
    /// error of the caller's numbering, which debug builds report.
    #[inline]
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        let column = j - i / Self::BLOCK * Self::BLOCK;
        debug_assert!(column < C && j < self.rows.len(), "entry ({i}, {j}) lies outside the blocks");
        if let Some(entry) = self.rows.get_mut(i).and_then(|row| row.get_mut(column)) {
            *entry += value;
        }
    }

    /// Entry `(i, j)`; zero outside the blocks.
    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        let column = j - i / Self::BLOCK * Self::BLOCK;
        self.rows.get(i).and_then(|row| row.get(column)).copied().unwrap_or(0.0)
    }

    /// Begins a matrix that is assembled with [`Self::lay_blocks`]: clears the first block and the last two.
    pub(crate) fn begin_blocks(&mut self) {
        let last = self.rows.len() - 2 * Self::BLOCK;
        self.rows[..Self::BLOCK].fill([0.0; C]);
        self.rows[last..].fill([0.0; C]);
    }

    /// Adds the upper triangle of two blocks, the first beginning at row `at`; called node by node, each with the
    /// next. Adds to the first block and overwrites the second block and the coupling of both.
    #[inline(always)]
    pub(crate) fn lay_blocks(&mut self, at: usize, entry: impl Fn(usize, usize) -> f64) {
        let targets = &mut self.rows[at..at + C];
        let (first, second) = targets.split_at_mut(Self::BLOCK);
        unrolled!(i in 0..Self::BLOCK, {
            for j in i..Self::BLOCK {
                first[i][j] += entry(i, j);
                second[i][j] = entry(Self::BLOCK + i, Self::BLOCK + j);
            }
            for j in Self::BLOCK..C {
                first[i][j] = entry(i, j);
            }
        });
    }

    /// Adds the upper triangle of the rows of two blocks, the first of which begins at row `at`.
    pub(crate) fn add_blocks(&mut self, at: usize, rows: &[[f64; C]; C]) {
        let (first, second) = self.rows[at..at + C].split_at_mut(Self::BLOCK);
        for (target, row) in first.iter_mut().zip(rows) {
            target.iter_mut().zip(row).for_each(|(t, r)| *t += r);
        }
        for (target, row) in second.iter_mut().zip(&rows[Self::BLOCK..]) {
            target.iter_mut().zip(&row[Self::BLOCK..]).for_each(|(t, r)| *t += r);
        }
    }

    /// Turns row and column `i` into those of the identity: the unknown is held.
    pub(crate) fn hold(&mut self, i: usize) {
        let begin = i / Self::BLOCK * Self::BLOCK;
        for k in begin.saturating_sub(Self::BLOCK)..i {
            self.rows[k][i - k / Self::BLOCK * Self::BLOCK] = 0.0;
        }
        self.rows[i] = [0.0; C];
        self.rows[i][i - begin] = 1.0;
    }

    /// Adds `factor` times a shift.
    #[cfg(test)]
    pub(crate) fn add_shift(&mut self, shift: &Shift, factor: f64) {
        for (i, row) in self.rows.iter_mut().enumerate() {
            shift.add_to(i, factor, row);
        }
    }
}

/// A matrix that is added to another before it is factored: a diagonal, and one entry per row in the same column of
/// the next block.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shift {
    /// Entries of the diagonal.
    pub diagonal: Vec<f64>,
    /// Entries between a row and the same row of the next block.
    pub next: Vec<f64>,
}

impl Shift {
    /// Resets to the zero shift of this dimension; keeps the memory.
    pub(crate) fn reset(&mut self, dimension: usize) {
        for list in [&mut self.diagonal, &mut self.next] {
            list.clear();
            list.resize(dimension, 0.0);
        }
    }

    /// Adds `factor` times row `i` of the shift to that row of a matrix.
    #[inline(always)]
    pub(crate) fn add_to<const C: usize>(&self, i: usize, factor: f64, row: &mut [f64; C]) {
        let own = i % (C / 2);
        row[own] += factor * self.diagonal[i];
        row[C / 2 + own] += factor * self.next[i];
    }
}
