//! Motions of a large body that are trilinear in the cells of a lattice around it, and how it yields to them: a coarse space of
//! `A⁻¹` with more in it than the affine ones.
//!
//! With P the values of the lattice's functions at the nodes, zero at pinned ones, `P (PᵀAP)⁻¹ Pᵀ` is what they account for of
//! `A⁻¹`; what is left is positive semidefinite (Galerkin's projection). Two levels of an additive Schwarz method
//! [Toselli & Widlund 2005], without the solves on the fine one.

use super::factor::{DenseScratch, Symbolic, invert};
use crate::fem::DeformableModel;
use crate::math::Vec3;

/// Numbers of a factor from which on a body has a lattice: 2.4 MB, some 4000 tetrahedra. Below, a coarse problem takes as long as several products: the
/// worst steps of a cube of 3072 that falls on hills 12, 19 and 41 → 16, 26 and 49 ms with one.
const LATTICE_FROM: usize = 300_000;
/// Points of the lattice over the cube root of the numbers of the factor: it takes 2 to 25 % of the time of the factorization.
const POINTS: f64 = 1.5;
/// Edges of the mesh in one of its cells, at the least.
const EDGES: f64 = 2.0;
/// Part of the diagonal that is added to it: functions which are one on the nodes have no inverse otherwise. Rigid motions of a body of 1e9 Pa at
/// 1/10 s have 1e-9 of the largest eigenvalue.
const LIFT: f64 = 1.0e-13;

/// Weights below this are rounding: of a node on a face of the lattice.
const VANISHES: f64 = 1.0e-9;

/// Points of a lattice that a place is between, and its weights.
pub(crate) type Stencil = [(usize, f64); 8];

/// A lattice around a body, in the frame of its matrix.
#[derive(Clone, Debug)]
pub(crate) struct LatticeModes {
    lowest: Vec3,
    /// Cells per metre, by axes.
    density: Vec3,
    cells: [usize; 3],
    pinned: Vec<u32>,
    /// `(PᵀAP)⁻¹` by columns, three unknowns a point [m/N].
    compliance: Vec<f64>,
}

impl LatticeModes {
    /// Of a matrix with these values, if it is large enough and can be inverted.
    pub fn new(
        model: &DeformableModel,
        pins: &[u32],
        symbolic: &Symbolic,
        values: impl FnOnce() -> Vec<f64>,
    ) -> Option<Self> {
        if symbolic.factor_len() < LATTICE_FROM || !model.is_solid() {
            return None;
        }
        let start = (model.rest[0], model.rest[0]);
        let (lowest, highest) = model.rest.iter().fold(start, |(low, high), x| (low.inf(x), high.sup(x)));
        let most = POINTS * (symbolic.factor_len() as f64).cbrt();
        let cells = cells_of(&(highest - lowest), EDGES * model.surface.mean_edge, most)?;
        Self::of_cells([lowest, highest], cells, &model.rest, pins, (symbolic, &values()))
    }

    /// Between two corners.
    fn of_cells(
        [lowest, highest]: [Vec3; 2],
        cells: [usize; 3],
        rest: &[Vec3],
        pins: &[u32],
        (symbolic, values): (&Symbolic, &[f64]),
    ) -> Option<Self> {
        let density = (highest - lowest).zip_map(&Vec3::from(cells.map(|n| n as f64)), |side, n| n / side);
        let mut pinned = pins.to_vec();
        pinned.sort_unstable();
        let mut lattice = Self { lowest, density, cells, pinned, compliance: Vec::new() };
        lattice.compliance = lattice.projected(rest, symbolic, values);
        lattice.invert().then_some(lattice)
    }

    /// Points of the lattice.
    pub fn len(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.compliance[..])
    }

    /// The functions at a node.
    pub fn stencil(&self, rest: &[Vec3], node: usize) -> Stencil {
        if self.pinned.binary_search(&(node as u32)).is_ok() {
            return [(0, 0.0); 8];
        }
        let place = (rest[node] - self.lowest).component_mul(&self.density);
        let cell: [usize; 3] = std::array::from_fn(|k| (place[k].max(0.0) as usize).min(self.cells[k] - 1));
        std::array::from_fn(|corner| {
            let (mut point, mut weight) = (0, 1.0);
            for k in 0..3 {
                let (side, part) = (corner >> k & 1, place[k] - cell[k] as f64);
                point = point * (self.cells[k] + 1) + cell[k] + side;
                weight *= if side == 1 { part } else { 1.0 - part };
            }
            (point, if weight > VANISHES { weight } else { 0.0 })
        })
    }

    /// Sets `out` to what points have of the compliance, three unknowns each, by columns.
    pub fn compliance_of(&self, points: &[usize], out: &mut Vec<f64>) {
        let n = 3 * self.len();
        out.clear();
        for column in points.iter().flat_map(|&point| 3 * point..3 * point + 3) {
            let column = &self.compliance[n * column..][..n];
            out.extend(points.iter().flat_map(|&point| &column[3 * point..3 * point + 3]));
        }
    }

    /// `PᵀAP`, by columns: that of the upper triangle with half of the diagonal, and its transpose.
    fn projected(&self, rest: &[Vec3], symbolic: &Symbolic, values: &[f64]) -> Vec<f64> {
        let (n, d) = (3 * self.len(), symbolic.d);
        let stencils: Vec<Stencil> = (0..rest.len()).map(|i| self.stencil(rest, i)).collect();
        let (mut half, mut image) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut touched, mut is_touched) = (Vec::new(), vec![false; n]);
        for (j, column) in symbolic.column_starts().windows(2).enumerate() {
            for k in column[0]..column[1] {
                let i = symbolic.rows()[k];
                let value = if i == j { 0.5 * values[k] } else { values[k] };
                for (point, weight) in stencils[i / d].iter().filter(|(_, w)| *w != 0.0) {
                    let at = 3 * point + i % d;
                    if !std::mem::replace(&mut is_touched[at], true) {
                        touched.push(at);
                    }
                    image[at] += value * weight;
                }
            }
            for (point, weight) in stencils[j / d].iter().filter(|(_, w)| *w != 0.0) {
                let into = &mut half[n * (3 * point + j % d)..][..n];
                touched.iter().for_each(|&at| into[at] += weight * image[at]);
            }
            touched.drain(..).for_each(|at| (image[at], is_touched[at]) = (0.0, false));
        }
        let whole = |at: usize| half[at] + half[at % n * n + at / n];
        // With one unknown a node, the same for every direction.
        let entry = |at: usize| match (d, at % n % 3, at / n % 3) {
            (1, r, c) if r != c => 0.0,
            (1, ..) => whole(at / n / 3 * 3 * n + at % n / 3 * 3),
            _ => whole(at),
        };
        (0..n * n).map(entry).collect()
    }

    /// Inverts what [`Self::compliance`] holds; `false` where rounding has left nothing definite.
    fn invert(&mut self) -> bool {
        let n = 3 * self.len();
        let diagonal = |k: usize| self.compliance[(n + 1) * k];
        // A point without nodes has nothing to do with the others.
        let scale: Vec<f64> =
            (0..n).map(|k| if diagonal(k) > 0.0 { 1.0 / diagonal(k).sqrt() } else { 0.0 }).collect();
        let balance = |values: &mut [f64]| {
            for (column, c) in values.chunks_exact_mut(n).zip(&scale) {
                column.iter_mut().zip(&scale).for_each(|(v, r)| *v *= r * c);
            }
        };
        balance(&mut self.compliance);
        self.compliance.iter_mut().step_by(n + 1).for_each(|v| *v = v.max(1.0) + LIFT);
        let is_definite = invert(&mut self.compliance, n, &mut DenseScratch::default()).is_ok();
        balance(&mut self.compliance);
        is_definite
    }
}

/// Cells along each side: as many as leave no more than `most` points, none shorter than `shortest`.
fn cells_of(sides: &Vec3, shortest: f64, most: f64) -> Option<[usize; 3]> {
    let longest = sides.amax();
    let along = |side: f64, count: usize| ((side / longest * count as f64).round() as usize).max(1);
    let cells = |count: usize| [0, 1, 2].map(|k| along(sides[k], count));
    let fits = |count: &usize| {
        longest / *count as f64 >= shortest
            && cells(*count).iter().map(|n| n + 1).product::<usize>() as f64 <= most
    };
    (sides.min() > 0.0).then_some(())?;
    (2..).take_while(fits).last().map(cells)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::SystemMatrix;
    use crate::material::DeformableMaterial;
    use crate::mesh::TetMesh;
    use crate::solver::linear::{assemble, pattern_of};
    use nalgebra::{DMatrix, DVector};

    /// A as a matrix, and the lattice's functions, three unknowns a node.
    fn dense(symbolic: &Symbolic, values: &[f64], nodes: usize) -> DMatrix<f64> {
        let (d, mut A) = (symbolic.d, DMatrix::zeros(3 * nodes, 3 * nodes));
        for (j, column) in symbolic.column_starts().windows(2).enumerate() {
            for k in column[0]..column[1] {
                let i = symbolic.rows()[k];
                for c in 0..3 / d {
                    let at = |unknown: usize| 3 * (unknown / d) + c * usize::from(d == 1) + unknown % d;
                    (A[(at(i), at(j))], A[(at(j), at(i))]) = (values[k], values[k]);
                }
            }
        }
        A
    }

    /// What it says of `A⁻¹` is what is least in energy among its functions, so that no force finds it to yield more than `A⁻¹` does.
    #[test]
    fn yields_as_its_functions_do_and_no_more_than_the_body() {
        let model = DeformableModel::new(&TetMesh::cuboid([0.3, 0.2, 0.2], [6, 4, 4]).unwrap());
        let material = [DeformableMaterial::new(1e6, 0.3)];
        let nodes = model.rest.len();
        let corners = [Vec3::new(-0.3, -0.2, -0.2), Vec3::new(0.3, 0.2, 0.2)];
        for system in [SystemMatrix::RestStiffness, SystemMatrix::Laplacian] {
            for pins in [&[][..], &[0, 7, 30]] {
                let symbolic = pattern_of(&model, system).unwrap();
                let values = assemble(&model, &material, pins, system, 1.0 / 60.0, &symbolic);
                let of = (&symbolic, &values[..]);
                let lattice = LatticeModes::of_cells(corners, [3, 2, 1], &model.rest, pins, of).unwrap();
                let n = 3 * lattice.len();
                let mut P = DMatrix::zeros(3 * nodes, n);
                for i in 0..nodes {
                    for (point, weight) in lattice.stencil(&model.rest, i) {
                        (0..3).for_each(|c| P[(3 * i + c, 3 * point + c)] += weight);
                    }
                }
                let (A, C) =
                    (dense(&symbolic, &values, nodes), DMatrix::from_column_slice(n, n, &lattice.compliance));
                let off = (P.transpose() * &A * &P * &C - DMatrix::identity(n, n)).amax();
                assert!(off < 1e-8, "{system:?}, {} pins: {off:e}", pins.len());
                let factor = A.cholesky().unwrap();
                for seed in 0..20 {
                    let number = |k: usize| ((k * 7919 + 31 * seed + 13) % 101) as f64 / 50.0 - 1.0;
                    let mut force = DVector::from_fn(3 * nodes, |k, _| number(k));
                    pins.iter().for_each(|&p| force.rows_mut(3 * p as usize, 3).fill(0.0));
                    let along = P.transpose() * &force;
                    let [part, whole] = [along.dot(&(&C * &along)), force.dot(&factor.solve(&force))];
                    assert!(part > 0.0 && part < whole, "{system:?}: {part:e} of {whole:e}");
                }
            }
        }
    }
}
