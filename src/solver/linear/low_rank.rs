//! What single directions resist that no element does: the volume of a closed room with gas in it.
//!
//! With stiffnesses k along directions g, `(P⁻¹ + Σ k g gᵀ)⁻¹ = P − Σ u uᵀ/(1/k + gᵀu)` [Sherman & Morrison 1950], one after the
//! other, `u` the response to g with those before it taken off.

use crate::math::{Mat3, Vec3};

/// Responses to take off.
#[derive(Default)]
pub(crate) struct LowRank {
    /// u \[m per unit of g\] and `1/(1/k + gᵀu)`.
    taken: Vec<(Vec<Vec3>, f64)>,
    spare: Vec<Vec<Vec3>>,
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl LowRank {
    pub fn is_empty(&self) -> bool {
        self.taken.is_empty()
    }

    pub fn clear(&mut self) {
        self.spare.extend(self.taken.drain(..).map(|(u, _)| u));
    }

    /// Memory for the next response.
    pub fn room(&mut self, nodes: usize) -> Vec<Vec3> {
        let mut room = self.spare.pop().unwrap_or_default();
        room.clear();
        room.resize(nodes, Vec3::zeros());
        room
    }

    /// Adds the direction `g` with a stiffness, given the response `u` to it so far.
    pub fn push(&mut self, g: &[Vec3], u: Vec<Vec3>, stiffness: f64) {
        let share = 1.0 / (1.0 / stiffness + dot(g, &u));
        // What is stiff against nothing, or not a number, changes nothing.
        if share.is_finite() && share > 0.0 {
            self.taken.push((u, share));
        } else {
            self.spare.push(u);
        }
    }

    /// Takes off the response to forces what they meet.
    pub fn take_off(&self, forces: &[Vec3], out: &mut [Vec3]) {
        for (u, share) in &self.taken {
            let by = dot(u, forces) * share;
            out.iter_mut().zip(u).for_each(|(out, u)| *out -= u * by);
        }
    }

    /// What is taken off the block between two nodes [m/N].
    pub fn compliance(&self, i: usize, j: usize) -> Mat3 {
        let of = |(u, share): &(Vec<Vec3>, f64)| u[i] * (u[j] * *share).transpose();
        self.taken.iter().map(of).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_left_is_the_inverse_of_the_sum(
            numbers in proptest::collection::vec(-1.0..1.0f64, 81 + 18), stiffness in proptest::collection::vec(0.1..1e6f64, 2),
        ) {
            let root = DMatrix::from_fn(9, 9, |r, c| numbers[9 * r + c]);
            let A = &root * root.transpose() + DMatrix::identity(9, 9);
            let inverse = A.clone().try_inverse().unwrap();
            let nodes = |v: &DVector<f64>| -> Vec<Vec3> { v.as_slice().chunks(3).map(Vec3::from_column_slice).collect() };
            let mut low_rank = LowRank::default();
            let mut sum = A;
            for (k, stiffness) in stiffness.iter().enumerate() {
                let g = DVector::from_column_slice(&numbers[81 + 9 * k..81 + 9 * k + 9]);
                let mut u = nodes(&(&inverse * &g));
                low_rank.take_off(&nodes(&g), &mut u);
                low_rank.push(&nodes(&g), u, *stiffness);
                sum += &g * g.transpose() * *stiffness;
            }
            let wanted = sum.try_inverse().unwrap();
            for c in 0..9 {
                let push = DVector::from_fn(9, |r, _| f64::from(r == c));
                let mut out = nodes(&(&inverse * &push));
                low_rank.take_off(&nodes(&push), &mut out);
                for r in 0..9 {
                    prop_assert!((out[r / 3][r % 3] - wanted[(r, c)]).abs() < 1e-9);
                    let block = inverse[(r, c)] - low_rank.compliance(r / 3, c / 3)[(r % 3, c % 3)];
                    prop_assert!((block - wanted[(r, c)]).abs() < 1e-9);
                }
            }
        }
    }
}
