//! What holds deformable bodies fast, solved for in every product of the projected gradients.
//!
//! Forces change by `d`, of contacts `d_c`; those of what holds follow, `d_b = −W_bb⁻¹ (r_b + W_bc d_c)`, so that it goes on holding: static
//! condensation [Guyan 1965] without W. Left among the contacts, three vertices that carried 3.6 kg by a cloth of 200 g ended sixty products with
//! errors of a hundred times their forces.

use super::lists::ActiveContact;
use super::matrix_free::for_each_column;
use crate::contact::Endpoint;
use crate::solver::body_step::BodyProblem;
use crate::solver::cone::ConeOperator;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Rows that are solved for in an island, at the most, if a solid is held by one: twelve vertices. Each takes a product when the matrices change.
const MOST: usize = 36;
/// The same if sheets and ropes alone are held, whose products are cheap: sixty vertices. Of a cloth of 1e7 Pa that carries 3.6 kg at 13, 19 and
/// 27 vertices 97, 86 and 93 % of the steps are rejected at 36; at 120 they are 6, 3 and 0 %, and of 57 vertices 93 %.
const MOST_OF_THIN: usize = 180;
/// Numbers in their columns, at the most, 8 MB: all are read once or twice for a product.
const MOST_NUMBERS: usize = 1 << 20;
/// What a held row yields by, of its own compliance. The rows of vertices that a rigid body takes along are not independent of one another,
/// and what they are off by against that would be 1e5 times a force; each product leaves as much as this part of the other rows.
const YIELDS: f64 = 1.0e-5;

/// Rows of what holds, and how they move one another and the contacts.
#[derive(Default)]
pub(super) struct HeldRows {
    rows: Vec<usize>,
    /// Columns of W of these rows, one after the other.
    columns: Vec<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    is_made: bool,
}

impl HeldRows {
    /// Forgets them: the contacts have changed.
    pub fn clear(&mut self) {
        (self.factor, self.is_made) = (None, false);
    }

    /// W has changed, about the same contacts: until they are made anew they lead nearly where they should.
    pub fn outdate(&mut self) {
        self.is_made = false;
    }

    /// Whether what is held is sheets and ropes alone.
    pub fn is_of_thin(contacts: &[ActiveContact], bodies: &[BodyProblem]) -> bool {
        let held = contacts.iter().filter(|contact| contact.constraint.holds_deformable());
        let is_solid = |endpoint: &Endpoint| match endpoint {
            Endpoint::Soft { body, .. } => bodies[*body].model.is_solid(),
            _ => false,
        };
        !held.flat_map(|contact| contact.constraint.all_endpoints()).any(is_solid)
    }

    /// Rows that are solved for, at the most.
    pub fn most(is_of_thin: bool) -> usize {
        if is_of_thin { MOST_OF_THIN } else { MOST }
    }

    /// Makes their columns of W by as many products, if they are not more than `most` and not there yet; returns how many.
    pub fn make(
        &mut self,
        contacts: &[ActiveContact],
        [rows, most]: [usize; 2],
        operator: &mut impl ConeOperator,
    ) -> usize {
        if std::mem::replace(&mut self.is_made, true) {
            return 0;
        }
        self.rows.clear();
        let held = contacts.iter().filter(|contact| contact.constraint.holds_deformable());
        self.rows.extend(held.map(|contact| contact.first));
        let held = self.rows.len();
        if held == 0 || held > most || held * rows > MOST_NUMBERS {
            return 0;
        }
        self.columns.clear();
        let listed = self.rows.iter().map(|&row| ((), row));
        for_each_column(operator, rows, listed, |(), column| self.columns.extend_from_slice(column));
        let among = DMatrix::from_fn(held, held, |i, j| {
            let entry = self.columns[j * rows + self.rows[i]];
            if i == j { entry * (1.0 + YIELDS) } else { entry }
        });
        self.factor = among.cholesky();
        held
    }

    /// Lets the forces of what holds follow a change d of the others, with r the gaps before it; whether something holds.
    fn follow(&self, r: &[f64], d: &mut [f64]) -> bool {
        let Some(factor) = &self.factor else { return false };
        self.rows.iter().for_each(|&row| d[row] = 0.0);
        let column = |k: usize| &self.columns[k * d.len()..(k + 1) * d.len()];
        let moved = |k: usize| r[self.rows[k]] + column(k).iter().zip(&*d).map(|(w, d)| w * d).sum::<f64>();
        let gaps = DVector::from_fn(self.rows.len(), |k, _| moved(k));
        let forces = factor.solve(&gaps);
        if forces.iter().all(|force| force.is_finite()) {
            self.rows.iter().zip(forces.iter()).for_each(|(&row, force)| d[row] = -force);
        }
        true
    }
}

/// Products in which what holds is solved for.
pub(super) struct Holding<'a, O> {
    pub operator: O,
    pub held: &'a HeldRows,
}

impl<O: ConeOperator> ConeOperator for Holding<'_, O> {
    fn multiply(&mut self, v: &[f64], out: &mut Vec<f64>) {
        self.operator.multiply(v, out);
    }

    fn follow(&self, r: &[f64], d: &mut [f64]) -> bool {
        self.held.follow(r, d)
    }

    fn advance(&mut self, t: f64) {
        self.operator.advance(t);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{ConstraintKey, RodEnds};
    use crate::contact::{Constraint, Law};
    use crate::math::Vec3;
    use crate::solver::cone::{ConeMetric, ConeTolerance, GradientBudget, MetricContact, ProjectedGradient};
    use proptest::prelude::*;

    const PUSHES: Law = Law::Bounded { least: 0.0, most: f64::INFINITY };

    /// W as a matrix.
    struct Dense<'a>(&'a DMatrix<f64>);

    impl ConeOperator for Dense<'_> {
        fn multiply(&mut self, v: &[f64], out: &mut Vec<f64>) {
            out.clear();
            out.extend((self.0 * DVector::from_column_slice(v)).iter());
        }

        fn advance(&mut self, _: f64) {}
    }

    fn law_of(row: usize) -> Law {
        if row.is_multiple_of(3) { Law::BILATERAL } else { PUSHES }
    }

    /// A row of each: one that is held and two that only push, in turn.
    fn contacts(rows: usize) -> Vec<ActiveContact> {
        let soft = || Endpoint::Soft { body: 0, nodes: [0; 3], weights: [1.0, 0.0, 0.0] };
        let of = |row: usize| {
            let key = ConstraintKey::Twist(RodEnds { body: 0, rod: row as u32 });
            let mut constraint = Constraint::new([soft(), soft()], Vec3::x(), 0.0, key);
            constraint.law = law_of(row);
            ActiveContact { first: row, ..ActiveContact::new(constraint) }
        };
        (0..rows).map(of).collect()
    }

    fn made(W: &DMatrix<f64>) -> HeldRows {
        let (mut held, rows) = (HeldRows::default(), W.nrows());
        let mut operator = Dense(W);
        assert_eq!(held.make(&contacts(rows), [rows, MOST], &mut operator), rows.div_ceil(3));
        assert_eq!(held.make(&contacts(rows), [rows, MOST], &mut operator), 0, "made twice");
        held
    }

    /// Forces and gaps.
    fn solve(W: &DMatrix<f64>, b: &[f64], held: &HeldRows) -> (Vec<f64>, Vec<f64>) {
        let of = |row: usize| MetricContact {
            law: law_of(row),
            first: row,
            dimension: 1,
            D: W[(row, row)],
            sides: [None; 2],
        };
        let mut metric = ConeMetric::default();
        metric.contacts.extend((0..b.len()).map(of));
        metric.index_pattern();
        let (mut z, mut r) = (vec![0.0; b.len()], b.to_vec());
        let mut method = ProjectedGradient::default();
        method.begin();
        let tolerance = ConeTolerance { relative: 1e-9, floor: 1e-9 };
        let budget = GradientBudget { products: 20_000, goes_on: false };
        let mut operator = Holding { operator: Dense(W), held };
        method.solve(&metric, [&mut z, &mut r], tolerance, budget, &mut operator);
        (z, r)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Whatever the contacts' forces change by, what is held has no gap after it but what it yields by.
        #[test]
        fn what_holds_goes_on_holding(
            numbers in proptest::collection::vec(-1.0..1.0f64, 144), change in proptest::collection::vec(-1.0..1.0f64, 12),
            gaps in proptest::collection::vec(-1.0..1.0f64, 12),
        ) {
            let half = DMatrix::from_vec(12, 12, numbers);
            let W = &half * half.transpose() + DMatrix::identity(12, 12) * 1e-2;
            let mut d = change.clone();
            prop_assert!(!HeldRows::default().follow(&gaps, &mut d) && d == change, "nothing is made yet");
            prop_assert!(made(&W).follow(&gaps, &mut d));
            let after = DVector::from_vec(gaps) + &W * DVector::from_column_slice(&d);
            for row in 0..12 {
                let is_held = law_of(row) == Law::BILATERAL;
                let left = after[row] + YIELDS * W[(row, row)] * d[row];
                prop_assert!(!is_held || left.abs() < 1e-9, "{row}: {left}");
                prop_assert!(is_held || d[row] == change[row], "{row}");
            }
        }

        /// Two rows that are one, off by different gaps: none of both can be had, and no force is beyond what that is worth.
        #[test]
        fn rows_that_are_one_do_not_fight_without_end(
            numbers in proptest::collection::vec(-1.0..1.0f64, 144), off in -1e-6..1e-6f64,
        ) {
            let mut half = DMatrix::from_vec(12, 12, numbers);
            let first = half.row(0).clone_owned();
            half.set_row(3, &first);
            let mut W = &half * half.transpose() + DMatrix::identity(12, 12) * 1e-2;
            (W[(0, 3)], W[(3, 0)]) = (W[(0, 0)], W[(0, 0)]);
            W[(3, 3)] = W[(0, 0)];
            let (mut gaps, mut d) = ([0.0; 12], [0.0; 12]);
            gaps[3] = off;
            prop_assert!(made(&W).follow(&gaps, &mut d));
            let most = off.abs() / (YIELDS * W[(0, 0)]);
            prop_assert!(d.iter().all(|force| force.abs() <= most + 1e-12), "{d:?}, {most} N");
        }

        /// Solved with what holds beside, contacts come to the same forces.
        #[test]
        fn forces_are_those_without_it(
            numbers in proptest::collection::vec(-1.0..1.0f64, 144), gaps in proptest::collection::vec(-1.0..1.0f64, 12),
        ) {
            let half = DMatrix::from_vec(12, 12, numbers);
            let W = &half * half.transpose() + DMatrix::identity(12, 12);
            let [(with, r), (without, _)] = [made(&W), HeldRows::default()].map(|held| solve(&W, &gaps, &held));
            for row in 0..12 {
                prop_assert!((with[row] - without[row]).abs() < 1e-6, "{row}: {} {}", with[row], without[row]);
                let is_held = law_of(row) == Law::BILATERAL;
                let left = if is_held { r[row].abs() } else { -r[row].min(with[row]).min(0.0) };
                prop_assert!(left < 1e-6, "{row}: {left}");
            }
        }
    }
}
