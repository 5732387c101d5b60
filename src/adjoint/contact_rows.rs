//! The laws of the contacts that bind, `F₂(x′, λ) = 0`, row by row, and their part of the adjoint.
//!
//! With `J` the directions of the forces and `u` the slip, a contact that carries has the rows
//! - `n·(x′ − xₙ) + gap = 0`,
//! - if it sticks `t·(x′ − xₙ) = 0` for both tangents (beside what its partner moves),
//! - if it slides `s (λ_t + μ λ_n û) = 0` with `û = u/|u|` and the constant `s = |u|/(μ λ_n)`, which makes metres of it.
//!
//! A cable that is held at a length has one row more (`src/adjoint/cables.rs`).
//!
//! A node that sticks with its one contact moves by nothing but its partner: it is taken out of the unknowns as a pinned one is.
//!
//! With `C = ∂F₂/∂x′` and `D = ∂F₂/∂λ` the adjoint is `H z = g + Cᵀq`, `(J H⁻¹ Cᵀ + Dᵀ) q = −g_λ − J H⁻¹ g`. Normals and weights are
//! those of the start of the step, and depend on it (`src/adjoint/pair_geometry.rs`, `collider_geometry.rs`). Nodes are those of all bodies in one
//! row, and after them two of each rigid body that yields: its linear motion, and its turn \[rad\].

use super::collider_geometry::OfPlaces;
use super::contact_record::{ContactRecord, Partner};
use super::record::NodeVectors;
use super::tangents::Tangents;
use crate::math::Vec3;
use nalgebra::{DMatrix, DVector};

/// Singular value over the largest one below which contacts say the same as others.
const REDUNDANT: f64 = 1.0e-11;
/// What a solve of the contacts may leave of its right-hand side.
const LEFT: f64 = 1.0e-8;
/// Product of the largest numbers of a matrix and of its solution over the largest of the right-hand side from which on the least of all solutions is taken: what
/// contacts that say the same add to one another cancels, but not in what follows from it. Two boxes on a block, 41 rows of which 13 say nothing new,
/// had 1e6 of it, and a derivative of -1503 in the place of -1.6e-7.
const GROWN: f64 = 1.0e5;

/// A row: what its force acts along, and what its law looks along.
struct Row {
    acts: NodeVectors,
    looks: NodeVectors,
    /// Derivative of the loss with respect to its force.
    of_force: f64,
    /// Derivative of the law with respect to the position at the start, along what it looks along.
    of_start: f64,
    /// Derivative of the law with respect to the coefficient of friction.
    of_friction: f64,
}

/// The rows of a step.
pub(super) struct ContactRows<'a> {
    contacts: Vec<(&'a ContactRecord, Vec3)>,
    rows: Vec<Row>,
    /// The first that is a cable's.
    cables_from: usize,
    /// D, by rows of the law and of the force.
    of_forces: DMatrix<f64>,
}

/// What the contacts add to the derivatives.
#[derive(Default)]
pub(super) struct ContactShare {
    /// `Cᵀq` by nodes, pinned ones too.
    pub of_end: Vec<Vec3>,
    pub of_start: Vec<Vec3>,
    /// Of where nodes would go without contact.
    pub of_targets: Vec<Vec3>,
    /// Of where rigid bodies begin: their centres of mass, and turns about these.
    pub of_rigid: Vec<[Vec3; 2]>,
    /// Of each contact's coefficient of friction.
    pub of_friction: Vec<(usize, Partner, f64)>,
    /// Of the lengths of cables.
    pub of_cables: Vec<f64>,
}

impl<'a> ContactRows<'a> {
    /// Of contacts, with what the loss says of the forces of each.
    pub fn new(contacts: Vec<(&'a ContactRecord, Vec3)>) -> Self {
        let count = contacts.iter().map(|(contact, _)| contact.dimension()).sum();
        let (mut rows, mut of_forces) = (Vec::with_capacity(count), DMatrix::zeros(count, count));
        for (contact, of_contact) in &contacts {
            let first = rows.len();
            let [normal, tangents @ ..] = contact.frame;
            let row = |direction: Vec3, of_start: f64| Row {
                acts: contact.laid(direction),
                looks: contact.laid(direction),
                of_force: of_contact.dot(&direction),
                of_start,
                of_friction: 0.0,
            };
            rows.push(row(normal, if contact.recovers { -1.0 } else { 0.0 }));
            for tangent in tangents.into_iter().take(contact.dimension() - 1) {
                let mut row = row(tangent, -1.0);
                if let Some(slip) = contact.slip {
                    let (length, pressed) = (slip.norm(), normal.dot(&contact.force));
                    let along = slip.dot(&tangent) / length;
                    let scale = length / (contact.friction * pressed);
                    row.looks = contact.laid(contact.looks_along(&tangent));
                    row.of_friction = scale * pressed * along;
                    of_forces[(rows.len(), first)] = scale * contact.friction * along;
                    of_forces[(rows.len(), rows.len())] = scale;
                }
                rows.push(row);
            }
        }
        Self { contacts, cables_from: rows.len(), rows, of_forces }
    }

    /// Adds that a cable, a newton of which acts so, is held at a length; with its stretch per tension [m/N].
    pub fn add_cable(&mut self, force: NodeVectors, compliance: f64, of_force: f64) {
        let place = self.rows.len();
        self.rows.push(Row { acts: force.clone(), looks: force, of_force, of_start: 0.0, of_friction: 0.0 });
        self.of_forces.resize_mut(place + 1, place + 1, 0.0);
        self.of_forces[(place, place)] = compliance;
    }

    /// Solves for z in place of `g`, zero at pinned nodes, where rigid bodies turn so in the step. `None` if it cannot be.
    pub fn solve(
        &self,
        tangents: &mut Tangents<'_>,
        (is_free, turns): (&[bool], &[Vec3]),
        g: &mut [Vec3],
    ) -> Option<ContactShare> {
        let (count, n) = (self.rows.len(), g.len());
        let mut share = ContactShare { of_end: vec![Vec3::zeros(); n], ..Default::default() };
        share.of_start = share.of_end.clone();
        share.of_targets = share.of_end.clone();
        share.of_rigid = vec![[Vec3::zeros(); 2]; turns.len()];
        if count == 0 {
            return solve_one(tangents, g).then_some(share);
        }
        // H⁻¹ Jᵀ.
        let mut columns = vec![0.0; 3 * n * count];
        for (row, column) in self.rows.iter().zip(columns.chunks_exact_mut(3 * n)) {
            for (node, acts) in row.acts.iter().filter(|(node, _)| is_free[*node]) {
                (0..3).for_each(|k| column[3 * node + k] += acts[k]);
            }
        }
        tangents.solve(&mut columns).then_some(())?;
        let columns: Vec<&[f64]> = columns.chunks_exact(3 * n).collect();
        let mut matrix = self.of_forces.transpose();
        let mut rhs = DVector::zeros(count);
        for (a, (row, column)) in self.rows.iter().zip(&columns).enumerate() {
            let at = |node: usize| Vec3::new(column[3 * node], column[3 * node + 1], column[3 * node + 2]);
            for (b, other) in self.rows.iter().enumerate() {
                let ends = other.looks.iter().filter(|(node, _)| is_free[*node]);
                matrix[(a, b)] += ends.map(|(node, looks)| looks.dot(&at(*node))).sum::<f64>();
            }
            rhs[a] = -row.of_force - g.iter().enumerate().map(|(node, g)| g.dot(&at(node))).sum::<f64>();
        }
        let q = solve_dense(matrix, &rhs)?;
        for (row, q) in self.rows.iter().zip(&q) {
            for (node, looks) in &row.looks {
                share.of_end[*node] += looks * *q;
                share.of_start[*node] += looks * (q * row.of_start);
            }
        }
        share.of_cables = q.iter().skip(self.cables_from).copied().collect();
        for ((g, c), _) in g.iter_mut().zip(&share.of_end).zip(is_free).filter(|(_, is_free)| **is_free) {
            *g += c;
        }
        solve_one(tangents, g).then_some(())?;
        self.add_by_contact((g, turns), q.as_slice(), &mut share);
        Some(share)
    }

    /// Adds what z and q say contact by contact: of friction, and of what normals and weights depend on.
    fn add_by_contact(&self, (z, turns): (&[Vec3], &[Vec3]), q: &[f64], share: &mut ContactShare) {
        let mut first = 0;
        for (contact, of_force) in &self.contacts {
            let own = first..first + contact.dimension();
            first = own.end;
            let of_friction =
                self.rows[own.clone()].iter().zip(&q[own.clone()]).map(|(row, q)| q * row.of_friction);
            share.of_friction.push((contact.body, contact.partner, of_friction.sum()));
            if let Some(geometry) = &contact.geometry {
                let by = (&mut share.of_start[..], &mut share.of_targets[..]);
                geometry.add_by_start(contact, (z, &q[own.clone()]), of_force, by);
            }
            if let Some(geometry) = &contact.on_collider {
                let mut of = OfPlaces::new(&mut share.of_start);
                let turn = contact.rigid.map_or(Vec3::zeros(), |at| turns[at.place]);
                geometry.add_by_start(contact, (z, &q[own]), (of_force, &turn), &mut of);
                if let (Some(at), OfPlaces { com, turn, .. }) = (contact.rigid, of) {
                    let [of_com, of_turn] = &mut share.of_rigid[at.place];
                    *of_com += com;
                    *of_turn += turn;
                }
            }
        }
    }
}

fn solve_one(tangents: &mut Tangents<'_>, g: &mut [Vec3]) -> bool {
    let mut column: Vec<f64> = g.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    let is_solved = tangents.solve(&mut column);
    g.iter_mut().zip(column.chunks_exact(3)).for_each(|(g, v)| *g = Vec3::new(v[0], v[1], v[2]));
    is_solved
}

/// By elimination, or, where contacts are as good as redundant, by the least solution of all.
fn solve_dense(matrix: DMatrix<f64>, rhs: &DVector<f64>) -> Option<DVector<f64>> {
    let left = |q: &DVector<f64>| (&matrix * q - rhs).amax();
    let is_small = |q: &DVector<f64>| matrix.amax() * q.amax() <= GROWN * rhs.amax();
    let by_elimination =
        matrix.clone().lu().solve(rhs).filter(|q| left(q) <= LEFT * rhs.amax() && is_small(q));
    by_elimination.or_else(|| {
        let svd = matrix.clone().svd(true, true);
        let q = svd.solve(rhs, REDUNDANT * svd.singular_values.max()).ok()?;
        (left(&q) <= LEFT * rhs.amax()).then_some(q)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that repeat others but for 1e-8, and right-hand sides that do but for 1e-10: elimination has forces of 1e4 and more that cancel.
    #[test]
    fn contacts_that_say_the_same_have_no_large_forces() {
        let weight = |k: usize| ((k * 7919 + 13) % 101) as f64 / 50.0 - 1.0;
        let whole = DMatrix::from_fn(6, 6, |i, j| if i == j { 1.0 } else { 0.1 * weight(6 * i + j) });
        let apart = |i: usize, j: usize| if i < 6 { 0.0 } else { 1e-8 * weight(i + 7 * j) };
        let rows = DMatrix::from_fn(12, 6, |i, j| whole[(i % 6, j)] + apart(i, j));
        let rhs =
            &rows * DVector::from_fn(6, |k, _| weight(k)) + DVector::from_fn(12, |k, _| 1e-10 * weight(k));
        let matrix = &rows * rows.transpose();
        let eliminated = matrix.clone().lu().solve(&rhs).unwrap();
        assert!(eliminated.amax() > 1e4, "{:e}", eliminated.amax());
        let found = solve_dense(matrix, &rhs).unwrap();
        assert!(found.amax() < 1e2, "{:e}", found.amax());
    }
}
