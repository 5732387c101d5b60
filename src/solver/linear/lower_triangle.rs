//! A symmetric matrix in the order of its elimination.

/// Pattern of the lower triangle by columns, with rows in any order, and where its numbers are in the upper triangle of the matrix in the
/// order of its user.
pub(super) struct LowerTriangle {
    pub starts: Vec<usize>,
    pub rows: Vec<usize>,
    pub sources: Vec<u32>,
}

impl LowerTriangle {
    /// Of the upper triangle with these columns and rows, of which each unknown is put at its place. `None` for 2³² numbers and more.
    pub fn new(upper_starts: &[usize], upper_rows: &[usize], places: &[usize]) -> Option<Self> {
        u32::try_from(upper_rows.len()).ok()?;
        let columns = upper_starts.windows(2).enumerate();
        let entries = columns.flat_map(|(j, own)| (own[0]..own[1]).map(move |k| (j, k))).map(|(j, k)| {
            let [a, b] = [places[j], places[upper_rows[k]]];
            (a.min(b), a.max(b), k as u32)
        });
        let mut starts = vec![0; upper_starts.len()];
        entries.clone().for_each(|(column, ..)| starts[column + 1] += 1);
        (1..starts.len()).for_each(|j| starts[j] += starts[j - 1]);
        let mut next = starts.clone();
        let (mut rows, mut sources) = (vec![0; upper_rows.len()], vec![0; upper_rows.len()]);
        for (column, row, source) in entries {
            (rows[next[column]], sources[next[column]]) = (row, source);
            next[column] += 1;
        }
        Some(Self { starts, rows, sources })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn it_is_the_matrix_with_rows_and_columns_put_at_their_places() {
        let (starts, rows, places) = ([0, 1, 3, 4, 7], [0, 0, 1, 2, 1, 2, 3], [2, 0, 3, 1]);
        let values: Vec<f64> = (0..7).map(|k| 1.5 + f64::from(k)).collect();
        let mut upper = DMatrix::zeros(4, 4);
        for j in 0..4 {
            (starts[j]..starts[j + 1]).for_each(|k| upper[(rows[k], j)] = values[k]);
        }
        let lower = LowerTriangle::new(&starts, &rows, &places).unwrap();
        let mut found = DMatrix::zeros(4, 4);
        for j in 0..4 {
            for k in lower.starts[j]..lower.starts[j + 1] {
                found[(lower.rows[k], j)] = values[lower.sources[k] as usize];
            }
        }
        for i in 0..4 {
            for j in 0..=i {
                let [a, b] = [i, j].map(|new| places.iter().position(|place| *place == new).unwrap());
                assert_eq!(found[(i, j)], upper[(a.min(b), a.max(b))], "{i} {j}");
                assert!(i == j || found[(j, i)] == 0.0);
            }
        }
    }
}
