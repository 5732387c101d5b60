//! Which blocks the matrix of a coarse problem has: those of its bodies, and where two of them touch.

/// Blocks of the lower triangle of the coarse matrix and of its factor.
#[derive(Debug, Default)]
pub(crate) struct CoarsePattern {
    /// First row of each body, and their number.
    pub rows: Vec<usize>,
    /// Pairs (row, column), column by column.
    pub filled: Vec<(usize, usize)>,
    /// First of each column.
    columns: Vec<usize>,
}

impl CoarsePattern {
    /// Takes the pattern of [`Self::filled`] in, of bodies with so many modes.
    pub fn index(&mut self, sizes: impl Iterator<Item = usize>) {
        self.rows.clear();
        self.rows.push(0);
        for size in sizes {
            self.rows.push(self.rows[self.rows.len() - 1] + size);
        }
        self.columns.clear();
        self.columns.extend((0..self.filled.len()).filter(|&k| self.filled[k].0 == self.filled[k].1));
        self.columns.push(self.filled.len());
    }

    /// Place of a block in the pattern.
    #[inline(always)]
    pub fn block_of(&self, row: usize, column: usize) -> usize {
        let range = self.columns[column]..self.columns[column + 1];
        let rows = &self.filled[range.clone()];
        range.start + rows.partition_point(|(i, _)| *i < row)
    }
}
