//! The matrix of a Newton step of the contact problem, factored: `I + LᵀWL`, with `L Lᵀ` the
//! curvature of the contacts. By Woodbury's identity it gives `(1 + L Lᵀ W)⁻¹ b` [Castro et al. 2022].

use super::problem::{ConeProblem, dot, spatial};
use super::projection;
use crate::math::vectorized;
use crate::solver::linear::BlockFactor;

/// Curvatures of all contacts and the factor they lead to.
#[derive(Default)]
pub(crate) struct ConeHessian {
    /// Columns of L per contact: their rows are those of the contact.
    columns: Vec<[[f64; 3]; 3]>,
    offsets: Vec<usize>,
    factor: BlockFactor,
    /// First column of each block, and their number last.
    starts: Vec<usize>,
    /// What the factor was made of: the same bits, the same factor.
    factored: Option<Factored>,
    spare: Factored,
    product: Vec<f64>,
    reduced: Vec<f64>,
}

#[derive(Default)]
struct Factored {
    version: u64,
    columns: Vec<[[f64; 3]; 3]>,
    offsets: Vec<usize>,
}

impl ConeHessian {
    /// Takes the curvatures at the points u with regularisation R per contact.
    pub fn set_curvature(&mut self, problem: &ConeProblem, u: &[f64], R: &[f64]) {
        self.columns.clear();
        self.offsets.clear();
        self.offsets.push(0);
        let mut size = 0;
        for i in 0..problem.contacts() {
            let u = spatial(&u[problem.offsets[i]..problem.offsets[i + 1]]);
            let mut columns = [[0.0; 3]; 3];
            size += projection::curvature_columns(u, problem.laws[i], R[i], &mut columns);
            self.columns.push(columns);
            self.offsets.push(size);
        }
    }

    /// The columns of L of a contact.
    pub fn columns_of(&self, contact: usize) -> &[[f64; 3]] {
        let count = self.offsets[contact + 1] - self.offsets[contact];
        &self.columns[contact][..count]
    }

    /// Order of the matrix: 0 if nothing touches.
    pub fn order(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Factors the matrix, unless it is the one that was factored last; tells whether it had to, or
    /// `None` if that failed.
    pub fn factorize(&mut self, problem: &ConeProblem) -> Option<bool> {
        if self.order() == 0 {
            return Some(false);
        }
        if let Some(f) = &self.factored {
            let same = f.version == problem.version && f.offsets == self.offsets && f.columns == self.columns;
            if same {
                return Some(false);
            }
            self.spare = self.factored.take()?;
        }
        self.assemble(problem);
        self.factor.factorize().ok()?;
        let mut made = std::mem::take(&mut self.spare);
        made.version = problem.version;
        made.columns.clone_from(&self.columns);
        made.offsets.clone_from(&self.offsets);
        self.factored = Some(made);
        Some(true)
    }

    /// Turns `b` to `b − L(I + LᵀWL)⁻¹Lᵀ Wb`, given the product Wb.
    pub fn solve(&mut self, problem: &ConeProblem, b: &mut [f64], Wb: &[f64]) {
        let mut reduced = std::mem::take(&mut self.reduced);
        reduced.clear();
        for i in 0..problem.contacts() {
            let rows = spatial(&Wb[problem.offsets[i]..problem.offsets[i + 1]]);
            reduced.extend(self.columns_of(i).iter().map(|c| dot(c, &rows)));
        }
        self.factor.solve(&mut reduced);
        for i in 0..problem.contacts() {
            for (c, k) in self.columns_of(i).iter().zip(self.offsets[i]..) {
                let rows = problem.offsets[i]..problem.offsets[i + 1];
                b[rows].iter_mut().zip(c).for_each(|(b, c)| *b -= c * reduced[k]);
            }
        }
        self.reduced = reduced;
    }

    /// Appends to `out` the way from z to the solution of `z = LLᵀR u(z) + c`, given u at z, if z is `L y + c`: then
    /// `(I + LᵀWL) dy = LᵀR u − y`, and no product with W is needed. False where z is not.
    pub fn solve_within(
        &mut self,
        problem: &ConeProblem,
        u: &[f64],
        R: &[f64],
        z: &[f64],
        constant: impl Fn(usize) -> f64,
        out: &mut Vec<f64>,
    ) -> bool {
        let mut reduced = std::mem::take(&mut self.reduced);
        reduced.clear();
        let is_within = (0..problem.contacts()).all(|i| {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let (u, z) = (spatial(&u[rows.clone()]), spatial(&z[rows]));
            let mut left = [z[0] - constant(i), z[1], z[2]];
            for column in self.columns_of(i) {
                // The columns of a contact are orthogonal.
                let y = dot(column, &left) / dot(column, column);
                (0..3).for_each(|k| left[k] -= y * column[k]);
                reduced.push(R[i] * dot(column, &u) - y);
            }
            dot(&left, &left) <= (4.0 * f64::EPSILON).powi(2) * dot(&z, &z)
        });
        if is_within {
            if self.order() > 0 {
                self.factor.solve(&mut reduced);
            }
            for i in 0..problem.contacts() {
                let mut force = [0.0; 3];
                for (column, k) in self.columns_of(i).iter().zip(self.offsets[i]..) {
                    (0..3).for_each(|axis| force[axis] += column[axis] * reduced[k]);
                }
                out.extend_from_slice(&force[..problem.offsets[i + 1] - problem.offsets[i]]);
            }
        }
        self.reduced = reduced;
        is_within
    }

    fn assemble(&mut self, problem: &ConeProblem) {
        assemble(self, problem);
    }

    /// Block by block and column by column: first the product of W with a column of L, then that of its
    /// rows with the other columns.
    #[inline(always)]
    fn assemble_columns(&mut self, problem: &ConeProblem) {
        self.starts.clear();
        self.starts.extend(problem.groups.iter().map(|&contact| self.offsets[contact]));
        let matrix = self.factor.matrix();
        matrix.reset(&self.starts, &problem.filled);
        let mut product = std::mem::take(&mut self.product);
        let coupled = &problem.W.pattern().pairs;
        let mut known = 0;
        for (k, &(gi, gj)) in problem.filled.iter().enumerate() {
            // Both lists go column by column; what is not in the first is filled in by the factor.
            if coupled.get(known) != Some(&(gi, gj)) {
                continue;
            }
            let (W, entries) = (problem.W.block(known), matrix.block_mut(k));
            known += 1;
            let row_range = problem.W.pattern().range(gi);
            let (m, size) = (row_range.len(), self.starts[gi + 1] - self.starts[gi]);
            let first_row = problem.W.pattern().starts[gj];
            product.resize(m, 0.0);
            for j in problem.groups[gj]..problem.groups[gj + 1] {
                let count = self.offsets[j + 1] - self.offsets[j];
                let from = problem.offsets[j] - first_row;
                let W = |row: usize| &W[(from + row) * m..(from + row + 1) * m];
                for (c, column) in self.columns[j][..count].iter().enumerate() {
                    if problem.offsets[j + 1] - problem.offsets[j] == 3 {
                        let (x, y, z) = (W(0), W(1), W(2));
                        for (i, p) in product.iter_mut().enumerate() {
                            *p = column[0] * x[i] + column[1] * y[i] + column[2] * z[i];
                        }
                    } else {
                        product.iter_mut().zip(W(0)).for_each(|(p, w)| *p = column[0] * w);
                    }
                    let at = self.offsets[j] + c - self.starts[gj];
                    let entries = &mut entries[at * size..(at + 1) * size];
                    for i in problem.groups[gi]..problem.groups[gi + 1] {
                        let rows =
                            problem.offsets[i] - row_range.start..problem.offsets[i + 1] - row_range.start;
                        let places = self.offsets[i] - self.starts[gi]..self.offsets[i + 1] - self.starts[gi];
                        match (&product[rows], &mut entries[places]) {
                            // Sticking: L is a multiple of the identity.
                            ([x, y, z], [a, b, c]) => {
                                let root = self.columns[i][0][0];
                                (*a, *b, *c) = (root * x, root * y, root * z);
                            }
                            (rows, entries) => {
                                let rows = spatial(rows);
                                let columns = self.columns[i].iter();
                                entries.iter_mut().zip(columns).for_each(|(e, c)| *e = dot(c, &rows));
                            }
                        }
                    }
                    if gi == gj {
                        entries[at] += 1.0;
                    }
                }
            }
        }
        self.product = product;
    }
}

vectorized! {
fn assemble[](hessian: &mut ConeHessian, problem: &ConeProblem) {
    hessian.assemble_columns(problem);
}
}
