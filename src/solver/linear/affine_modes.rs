//! The affine motions of a body and how it yields to them: a coarse space of `A⁻¹`.
//!
//! With G the nodal values of `1, x, y, z` in each of three directions, zero at pinned nodes, `G (GᵀAG)⁻¹ Gᵀ` is what
//! affine motions account for of `A⁻¹`; what is left is positive semidefinite (Galerkin's projection).

use super::factor::Symbolic;
use super::lattice_modes::LatticeModes;
use crate::fem::DeformableModel;
use crate::math::Vec3;
use crate::math::lanes::Lane;
use nalgebra::{DMatrix, SMatrix};
use std::sync::OnceLock;

/// Four functions in three directions.
pub(crate) const MODES: usize = 12;

/// Modes in the frame of the matrix, each scaled to half a joule at a displacement of one.
#[derive(Clone, Debug)]
pub(crate) struct AffineModes {
    centre: Vec3,
    /// One over the size of the body [1/m].
    inverse_size: f64,
    pinned: Vec<u32>,
    /// What each mode has of each function and direction.
    scaled: [[Lane; MODES / 4]; MODES],
}

/// What `A⁻¹` is about, without a solve.
#[derive(Clone, Debug)]
pub(crate) struct CoarseInverse {
    /// Per node: as [`UpperTriangle::local_compliance`](super::gauss_seidel::UpperTriangle::local_compliance).
    pub local: Vec<f64>,
    pub modes: Option<AffineModes>,
    /// Of large bodies, once something touches them.
    lattice: OnceLock<Option<LatticeModes>>,
}

impl CoarseInverse {
    pub fn new(model: &DeformableModel, pins: &[u32], symbolic: &Symbolic, values: &[f64]) -> Self {
        Self {
            local: symbolic.upper(values).local_compliance(symbolic.d, pins),
            modes: Some(AffineModes::new(model, pins, symbolic, values)),
            lattice: OnceLock::new(),
        }
    }

    /// Of what is no matrix.
    pub fn without_modes(local: Vec<f64>) -> Self {
        Self { local, modes: None, lattice: OnceLock::new() }
    }

    pub fn lattice(&self) -> Option<&LatticeModes> {
        self.lattice.get()?.as_ref()
    }

    pub fn lattice_bytes(&self) -> usize {
        self.lattice().map_or(0, LatticeModes::bytes)
    }

    /// Makes it, if it has not been tried yet.
    pub fn make_lattice(&self, make: impl FnOnce() -> Option<LatticeModes>) {
        self.lattice.get_or_init(make);
    }

    /// Without modes: of what falls short of the inverse, of its affine part most of all, or seldom goes without columns.
    pub fn local(pins: &[u32], symbolic: &Symbolic, values: &[f64]) -> Self {
        Self::without_modes(symbolic.upper(values).local_compliance(symbolic.d, pins))
    }

    /// As [`Self::local`], in the memory of another.
    pub fn set_local(&mut self, pins: &[u32], symbolic: &Symbolic, values: &[f64]) {
        symbolic.upper(values).set_local_compliance(&mut self.local, symbolic.d, pins);
        (self.modes, self.lattice) = (None, OnceLock::new());
    }
}

/// Eigenvalues below this part of the largest belong to functions that vanish on the body, as across a sheet. Rigid
/// motions of a body of 1e9 Pa at 1/10 s have 1e-9.
const VANISHES: f64 = 1.0e-13;

impl AffineModes {
    /// Of a matrix with these values.
    pub fn new(model: &DeformableModel, pins: &[u32], symbolic: &Symbolic, values: &[f64]) -> Self {
        let n = model.rest.len();
        let centre = model.rest.iter().sum::<Vec3>() / n as f64;
        let size = model.rest.iter().map(|x| (x - centre).amax()).fold(0.0, f64::max);
        let mut pinned = pins.to_vec();
        pinned.sort_unstable();
        let scaled = [[Lane::default(); MODES / 4]; MODES];
        let mut modes = Self { centre, inverse_size: 1.0 / size, pinned, scaled };
        let functions: Vec<[f64; 4]> = (0..n).map(|i| modes.functions(&model.rest, i)).collect();
        modes.scale(&projected(symbolic, values, &functions));
        modes
    }

    /// `scaled scaledᵀ` becomes the pseudoinverse of a matrix.
    fn scale(&mut self, matrix: &SMatrix<f64, MODES, MODES>) {
        let scale: [f64; MODES] =
            std::array::from_fn(|k| if matrix[(k, k)] > 0.0 { 1.0 / matrix[(k, k)].sqrt() } else { 0.0 });
        let balanced = DMatrix::from_fn(MODES, MODES, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let eigen = balanced.symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        for k in 0..MODES {
            let value = eigen.eigenvalues[k];
            let root = if value > VANISHES * largest { 1.0 / value.sqrt() } else { 0.0 };
            for i in 0..MODES {
                self.scaled[i][k / 4].0[k % 4] = scale[i] * eigen.eigenvectors[(i, k)] * root;
            }
        }
    }

    fn functions(&self, rest: &[Vec3], node: usize) -> [f64; 4] {
        if self.pinned.binary_search(&(node as u32)).is_ok() {
            return [0.0; 4];
        }
        let x = (rest[node] - self.centre) * self.inverse_size;
        [1.0, x.x, x.y, x.z]
    }

    /// What a unit of each mode moves these nodes by along their `directions`, in the frame of the matrix, summed.
    pub fn row(&self, rest: &[Vec3], nodes: impl Iterator<Item = (usize, Vec3)>) -> [Lane; MODES / 4] {
        let mut by_function = [0.0; MODES];
        for (node, direction) in nodes {
            let functions = self.functions(rest, node);
            for (sums, d) in by_function.chunks_exact_mut(4).zip(direction.iter()) {
                sums.iter_mut().zip(functions).for_each(|(sum, f)| *sum += d * f);
            }
        }
        let mut row = [Lane::default(); MODES / 4];
        for (scaled, weight) in self.scaled.iter().zip(by_function) {
            row.iter_mut().zip(scaled).for_each(|(row, s)| *row += *s * weight);
        }
        row
    }
}

/// `GᵀAG`, by direction and function.
fn projected(symbolic: &Symbolic, values: &[f64], functions: &[[f64; 4]]) -> SMatrix<f64, MODES, MODES> {
    let mut sum = SMatrix::<f64, MODES, MODES>::zeros();
    let (d, rows) = (symbolic.d, symbolic.rows());
    for (j, column) in symbolic.column_starts().windows(2).enumerate() {
        let (fj, cj) = (&functions[j / d], j % d);
        for k in column[0]..column[1] {
            let i = rows[k];
            let (fi, ci) = (&functions[i / d], i % d);
            for a in 0..4 {
                for b in 0..4 {
                    let value = values[k] * fi[a] * fj[b];
                    sum[(4 * ci + a, 4 * cj + b)] += value;
                    if i != j {
                        sum[(4 * cj + b, 4 * ci + a)] += value;
                    }
                }
            }
        }
    }
    // The same for every direction.
    if d == 1 {
        let block = sum.fixed_view::<4, 4>(0, 0).into_owned();
        (1..3).for_each(|c| sum.fixed_view_mut::<4, 4>(4 * c, 4 * c).copy_from(&block));
    }
    sum
}
