//! Solves for one right-hand side, by a factor or by what stands in for one.

use super::factor::{FactorScratch, Symbolic};
use super::factor_values::Factor;
use super::gauss_seidel::UpperTriangle;
use crate::math::lanes::Lane;

impl Symbolic {
    /// Place of each node in the order of elimination.
    pub fn places(&self) -> &[usize] {
        &self.places
    }

    /// Solves `A x = b` in place for the three numbers of every node, in the order of elimination; with one
    /// unknown per node these are three right-hand sides.
    pub fn solve(&self, factor: &Factor, x: &mut [Lane], scratch: &mut FactorScratch) {
        match factor {
            Factor::Double(values) => self.supernodes.solve(values, x),
            Factor::Single(values) => self.supernodes.solve(values, x),
            Factor::Changed(change) => {
                let mut given = std::mem::take(&mut scratch.given);
                given.clear();
                given.extend_from_slice(x);
                self.solve(&change.base, x, scratch);
                change.correct(&given, x);
                scratch.given = given;
            }
            _ => {
                let mut own = std::mem::take(&mut scratch.ordered);
                // Axes of one right-hand side, and right-hand sides.
                for axes in [0, 1, 2].chunks(self.d) {
                    own.clear();
                    own.extend(
                        self.places
                            .iter()
                            .flat_map(|&place| axes.iter().map(move |&c| (place, c)))
                            .map(|(place, c)| x[place].0[c]),
                    );
                    self.solve_without(factor, &mut own, scratch);
                    for (&place, own) in self.places.iter().zip(own.chunks_exact(self.d)) {
                        axes.iter().zip(own).for_each(|(&c, v)| x[place].0[c] = *v);
                    }
                }
                scratch.ordered = own;
            }
        }
    }

    /// Without a factor, in the unknowns' own order.
    pub(super) fn solve_without(&self, factor: &Factor, x: &mut [f64], scratch: &mut FactorScratch) {
        match factor {
            Factor::Double(_) | Factor::Single(_) | Factor::Changed(_) => {}
            Factor::Jacobi(inverse) => x.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d),
            Factor::GaussSeidel(values) => self.upper(values).sweep(x),
            Factor::Iterative(operator) => operator.solve(x, &mut scratch.conjugate),
        }
    }

    /// The matrix of these values.
    pub fn upper<'a>(&'a self, values: &'a [f64]) -> UpperTriangle<'a> {
        UpperTriangle { starts: self.column_starts(), rows: self.rows(), values }
    }
}
