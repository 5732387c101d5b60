//! Constraints along paths in the Delassus operator. Each has its column of W from one product: one solve of every body that
//! it runs through, wherever in it, so that it asks for no compliance columns.

use super::improve::Around;
use super::lists::{ActiveContact, MatrixPlace};
use super::matrix_free::{MatrixFree, for_each_column};
use super::system::ContactSystem;
use crate::body::{CablePart, CableRow, ConstraintKey};
use crate::contact::Law;
use crate::solver::body_step::BodyProblem;
use crate::solver::linear::BlockMatrix;

/// Solves in an iteration until bounds have followed the tensions, at the most; what is left is for the next iteration, or step. At
/// μθ = π/2 each leaves four fifths of it, and of that what moves a fifth again.
pub(super) const BOUND_ROUNDS: usize = 8;
/// Part of the largest tension by which bounds may lag.
const LAG: f64 = 1.0e-7;

impl ContactSystem {
    /// Brings the bounds of friction at the guides of cables to where the tensions are: to the greater on either side, so
    /// that each round leaves less of their error. Tells whether one was off.
    pub(super) fn follow_tensions(&mut self) -> bool {
        let mut is_off = false;
        // Rows of a cable, from its pull on, in the order of its guides.
        let mut first = 0;
        while first < self.active.len() {
            let cable = cable_of(&self.active[first]);
            let count = self.active[first..].iter().take_while(|c| cable_of(c) == cable).count();
            if cable.is_some() {
                is_off |= self.follow_cable(first..first + count);
            }
            first += count;
        }
        is_off
    }

    fn follow_cable(&mut self, rows: std::ops::Range<usize>) -> bool {
        // The pull acts on all of the cable, a guide on what is before it: from the first part on, less and less of them act.
        let own = &self.active[rows.clone()];
        let tightens = |c: &&ActiveContact| c.constraint.loss > 0.0 || is_pull(c);
        let mut before: f64 = own.iter().filter(tightens).map(|c| self.lambda[c.first]).sum();
        let largest: f64 = own.iter().map(|c| self.lambda[c.first].abs()).sum();
        let mut is_off = false;
        for place in rows {
            let ActiveContact { constraint, first, .. } = &mut self.active[place];
            if constraint.loss == 0.0 {
                continue;
            }
            let after = before - self.lambda[*first];
            let (least, most) = (-constraint.loss * after.max(0.0), constraint.loss * before.max(0.0));
            before = after;
            let law = Law::Bounded { least, most };
            let was = std::mem::replace(&mut constraint.law, law);
            if let Law::Bounded { least: a, most: b } = was {
                is_off |= (a - least).abs().max((b - most).abs()) > LAG * largest;
            }
            self.dense.problem.laws[place] = law;
            if let Some(contact) = self.free.metric.contacts.get_mut(place) {
                contact.law = law;
            }
        }
        is_off
    }

    /// Puts the columns of all constraints along paths into the W that was just made.
    pub(super) fn fill_path_columns(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) {
        let mut W = std::mem::take(&mut self.dense.problem.W);
        self.for_each_path(bodies, around, |active, path, column| {
            for contact in active {
                let rows = &column[contact.rows()];
                if let (Some(on), Some(at)) = (contact.in_matrix, active[path].in_matrix) {
                    rows.iter().enumerate().for_each(|(k, value)| set(&mut W, (on, k), at, *value));
                }
            }
        });
        self.dense.problem.W = W;
    }

    /// Gives constraints along paths their weight in the metric of the first-order solve: all that they give way by. They are
    /// left out of its modes.
    pub(super) fn measure_paths(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) {
        let mut metric = std::mem::take(&mut self.free.metric);
        self.for_each_path(bodies, around, |active, path, column| {
            metric.contacts[path].D = column[active[path].first].max(f64::MIN_POSITIVE.sqrt());
        });
        self.free.metric = metric;
    }

    /// Calls `f` with the contacts, the place of each constraint along a path, and its column of W.
    fn for_each_path(
        &mut self,
        bodies: &mut [BodyProblem],
        Around { factors, context, .. }: Around<'_>,
        mut f: impl FnMut(&[ActiveContact], usize, &[f64]),
    ) {
        if self.active.iter().all(|contact| contact.constraint.path.is_empty()) {
            return;
        }
        let (active, response) = (&self.active[..], &mut self.free.response);
        let paths = active.iter().enumerate().filter(|(_, c)| !c.constraint.path.is_empty());
        let columns = paths.map(|(place, path)| (place, path.first));
        let mut operator = MatrixFree { contacts: active, bodies, factors, context, response };
        for_each_column(&mut operator, self.lambda.len(), columns, |place, column| f(active, place, column));
    }
}

/// The cable that a contact is a row of.
fn cable_of(contact: &ActiveContact) -> Option<u64> {
    match contact.constraint.key {
        ConstraintKey::Cable(row) => Some(row.cable),
        _ => None,
    }
}

fn is_pull(contact: &ActiveContact) -> bool {
    matches!(contact.constraint.key, ConstraintKey::Cable(CableRow { part: CablePart::Pull, .. }))
}

/// Sets what a constraint along a path moves the `k`-th row of another by, on both sides of the diagonal where both are stored.
fn set(W: &mut BlockMatrix, (on, k): (MatrixPlace, usize), at: MatrixPlace, value: f64) {
    let rows = |group: usize| W.pattern().range(group).len();
    let (on_rows, at_rows) = (rows(on.group), rows(at.group));
    let (on_row, at_row) = (on.row + k, at.row);
    if let Some(block) = W.find(on.group, at.group) {
        W.block_mut(block)[at_row * on_rows + on_row] = value;
    }
    if let Some(block) = W.find(at.group, on.group) {
        W.block_mut(block)[on_row * at_rows + at_row] = value;
    }
}
