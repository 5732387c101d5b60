//! Solves with the Hessian of a step where it has ended: its Cholesky factor, or, where it is not definite, GMRES with the factor of
//! what is left without its negative part [Saad & Schultz 1986]; and what filled cavities, held rods and taut cables resist, by single directions.

use super::directions::Directions;
use super::filled_rooms::{FilledRoom, filled_rooms};
use super::record::BodyRecord;
use crate::fem::{DeformableModel, Elements, StiffnessDamping, SystemMatrix, add_damping_tangents};
use crate::material::DeformableMaterial;
use crate::math::{Mat3, Vec3};
use crate::solver::linear::{
    Factor, FactorScratch, MatrixValues, Symbolic, TangentPlace, assemble_tangent, assemble_tangent_beside,
    pattern_of,
};

/// Residual of GMRES over its right-hand side, and its iterations at the most.
const TOLERANCE: f64 = 1.0e-12;
const ITERATIONS: usize = 200;

/// The Hessian of a step.
pub(super) struct Tangent {
    symbolic: Symbolic,
    scratch: FactorScratch,
    factor: Option<Factor>,
    /// Of a Hessian that is not definite.
    values: Option<Vec<f64>>,
    /// Its elastic blocks in the rows of pinned nodes.
    beside: Vec<(usize, usize, Mat3)>,
    pins: Vec<u32>,
    pub rooms: Vec<FilledRoom>,
    directions: Directions,
}

impl Tangent {
    pub fn new(model: &DeformableModel) -> Option<Self> {
        let symbolic = pattern_of(model, SystemMatrix::RestStiffness)?;
        let (scratch, directions) = (FactorScratch::default(), Directions::default());
        let (beside, pins, rooms) = (Vec::new(), Vec::new(), Vec::new());
        Some(Self { symbolic, scratch, factor: None, values: None, beside, pins, rooms, directions })
    }

    /// Makes it of a step where that has ended, with these nodes held; false if that cannot be.
    pub fn update(
        &mut self,
        model: &DeformableModel,
        record: &BodyRecord,
        damping: &StiffnessDamping,
        pins: &[u32],
    ) -> bool {
        let BodyRecord { h, x_end: x, materials, activations, twists, .. } = record;
        let (h, elements) = (*h, Elements { model, materials, activations });
        self.beside.clear();
        self.pins.clear();
        self.pins.extend_from_slice(pins);
        self.rooms = filled_rooms(model, &record.fillings, x);
        let of_rooms = self.rooms.iter().map(FilledRoom::direction);
        let of_twists = twists.iter().map(|twist| twist.direction(model, materials, x));
        let across = record.cables.iter().flat_map(|cable| cable.across(x.len()));
        self.directions.set(of_rooms.chain(of_twists).chain(across));
        let (symbolic, beside, rooms) = (&self.symbolic, &mut self.beside, &self.rooms);
        let mut sides = Vec::new();
        let others = |add: &mut dyn FnMut(usize, usize, &Mat3)| {
            if damping.resists() {
                add_damping_tangents(&elements, damping, x, &mut sides, &mut *add);
            }
            rooms.iter().for_each(|room| room.add_pressed(model, x, add));
            twists.iter().for_each(|twist| twist.add_twisted(model, materials, x, add));
        };
        let place = TangentPlace { x, projected: false, pins, h };
        let mut matrix = MatrixValues::default();
        // Of damping there is all of it, not its leading part.
        let bare = |material: &DeformableMaterial| material.stiffness_damping(0.0).maxwell_branches([]);
        let undamped: Vec<_> = materials.iter().map(bare).collect();
        let bare = Elements { materials: &undamped, ..elements };
        assemble_tangent_beside(&bare, &place, (symbolic, &mut matrix), others, |i, j, block| {
            beside.push((i, j, *block));
        });
        self.values = None;
        self.factor = symbolic.factorize(&matrix.values, &mut self.scratch).ok();
        if self.factor.is_none() {
            let mut projected = MatrixValues::default();
            let place = TangentPlace { projected: true, ..place };
            assemble_tangent(&elements, &place, symbolic, &mut projected);
            self.factor = symbolic.factorize(&projected.values, &mut self.scratch).ok();
            self.values = Some(matrix.values);
        }
        self.factor.is_some() && self.find_responses()
    }

    /// Finds how the directions answer to one another.
    fn find_responses(&mut self) -> bool {
        let mut responses = self.directions.pushes(&self.pins);
        let is_solved = self.solve_without_directions(&mut responses);
        self.directions.set_responses(responses);
        is_solved
    }

    /// Solves `H z = b` in place for columns of three numbers a node, zero at pinned ones; false if that fails.
    pub fn solve(&mut self, columns: &mut [f64]) -> bool {
        let is_solved = self.solve_without_directions(columns);
        let n = self.symbolic.column_starts().len() - 1;
        is_solved && columns.chunks_exact_mut(n).all(|column| self.directions.take_off(column))
    }

    fn solve_without_directions(&mut self, columns: &mut [f64]) -> bool {
        let Some(factor) = &self.factor else { return false };
        let Some(values) = &self.values else {
            self.symbolic.solve_batch(factor, columns, &mut self.scratch);
            return true;
        };
        let n = self.symbolic.column_starts().len() - 1;
        let scratch = &mut self.scratch;
        let symbolic = &self.symbolic;
        columns.chunks_exact_mut(n).all(|column| {
            let precondition = |v: &mut [f64]| symbolic.solve_batch(factor, v, scratch);
            gmres(column, |v| product(symbolic, values, v), precondition)
        })
    }

    /// Takes `K z` off what acts on pinned nodes.
    pub fn take_off_pinned(&self, z: &[Vec3], out: &mut [Vec3]) {
        self.beside.iter().for_each(|(i, j, block)| out[*i] -= block * z[*j]);
        self.directions.resist(z, |node| self.pins.binary_search(&(node as u32)).is_ok(), out);
    }

    /// Takes `K z`, z of pinned nodes, off what acts on free ones.
    pub fn take_off_free(&self, z: &[Vec3], is_free: &[bool], out: &mut [Vec3]) {
        let to_free = self.beside.iter().filter(|(i, j, _)| is_free[*j] && z[*i] != Vec3::zeros());
        to_free.for_each(|(i, j, block)| out[*j] -= block.tr_mul(&z[*i]));
        self.directions.resist(z, |node| is_free[node], out);
    }
}

/// The symmetric matrix of these values of its upper triangle, times v.
fn product(symbolic: &Symbolic, values: &[f64], v: &[f64]) -> Vec<f64> {
    let (starts, rows) = (symbolic.column_starts(), symbolic.rows());
    let mut out = vec![0.0; v.len()];
    for j in 0..v.len() {
        for k in starts[j]..starts[j + 1] {
            let i = rows[k];
            out[i] += values[k] * v[j];
            if i != j {
                out[j] += values[k] * v[i];
            }
        }
    }
    out
}

/// Solves `A x = b` in place, preconditioned from the left; false if it does not converge.
fn gmres(
    b: &mut [f64],
    product: impl Fn(&[f64]) -> Vec<f64>,
    mut precondition: impl FnMut(&mut [f64]),
) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    precondition(b);
    let size = dot(b, b).sqrt();
    if size == 0.0 {
        return true;
    }
    let mut basis = vec![b.iter().map(|v| v / size).collect::<Vec<f64>>()];
    // Columns of the triangle, the rotations that make it one, and the right-hand side under them.
    let (mut triangle, mut turns, mut rhs) = (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new(), vec![size]);
    for k in 0..ITERATIONS.min(b.len()) {
        let mut w = product(&basis[k]);
        precondition(&mut w);
        let mut column = vec![0.0; k + 1];
        // Once leaves what rounding makes of a vector that is nearly in the space.
        for _ in 0..2 {
            for (c, v) in column.iter_mut().zip(&basis) {
                let along = dot(v, &w);
                *c += along;
                w.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            }
        }
        let left = dot(&w, &w).sqrt();
        for (i, [c, s]) in turns.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let length = column[k].hypot(left);
        let [c, s] = [column[k] / length, left / length];
        column[k] = length;
        turns.push([c, s]);
        let last = rhs[k];
        rhs[k] = c * last;
        rhs.push(-s * last);
        triangle.push(column);
        if !(rhs[k + 1].abs() > TOLERANCE * size) || left == 0.0 {
            break;
        }
        basis.push(w.iter().map(|w| w / left).collect());
    }
    let mut y = vec![0.0; triangle.len()];
    for i in (0..y.len()).rev() {
        let known: f64 = (i + 1..y.len()).map(|j| triangle[j][i] * y[j]).sum();
        y[i] = (rhs[i] - known) / triangle[i][i];
    }
    b.fill(0.0);
    for (y, v) in y.iter().zip(&basis) {
        b.iter_mut().zip(v).for_each(|(b, v)| *b += y * v);
    }
    rhs[y.len()].abs() <= 1.0e2 * TOLERANCE * size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::Elasticity;
    use crate::material::DeformableMaterial;
    use crate::mesh::TetMesh;

    #[test]
    fn an_indefinite_hessian_is_solved_with_too() {
        let model = DeformableModel::new(&TetMesh::cuboid([0.3, 0.1, 0.1], [6, 2, 2]).unwrap());
        let material = DeformableMaterial::new(1e5, 0.3).elasticity(Elasticity::NeoHookean);
        let elements = Elements { model: &model, materials: &[material], activations: &[] };
        let pins: Vec<u32> =
            (0..model.rest.len() as u32).filter(|n| model.rest[*n as usize].x < -0.29).collect();
        for (squeeze, is_definite) in [(1.0, true), (0.6, false)] {
            // Squeezed along its length it would buckle.
            let x: Vec<Vec3> = model.rest.iter().map(|X| Vec3::new(X.x * squeeze, X.y, X.z)).collect();
            let mut tangent = Tangent::new(&model).unwrap();
            let record = BodyRecord::still(&x, &elements, 1.0);
            assert!(tangent.update(&model, &record, &StiffnessDamping::default(), &pins));
            assert_eq!(tangent.values.is_none(), is_definite);
            let symbolic = &tangent.symbolic;
            let mut matrix = MatrixValues::default();
            let place = TangentPlace { x: &x, projected: false, pins: &pins, h: 1.0 };
            assemble_tangent(&elements, &place, symbolic, &mut matrix);
            let mut b: Vec<f64> = (0..3 * x.len()).map(|k| ((k * 7919) % 101) as f64 - 50.0).collect();
            pins.iter().for_each(|pin| b[3 * *pin as usize..][..3].fill(0.0));
            let mut z = b.clone();
            assert!(tangent.solve(&mut z));
            let left = product(&tangent.symbolic, &matrix.values, &z);
            let error = left.iter().zip(&b).map(|(l, b)| (l - b).abs()).fold(0.0, f64::max);
            // Of 50 N; the preconditioned residual is below 1e-12, times the condition of 1e4.
            assert!(error < 1e-6, "{squeeze}: {error:e}");
        }
    }
}
