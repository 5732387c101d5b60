//! Modes of vibration about a state: `K φ = ω² M φ` with the Hessian K there, by a block Krylov space of `M½ (K + σM)⁻¹ M½`
//! [Grimes et al. 1994], kept orthogonal as a whole. Blocks find what is there several times: the motions of a free body, the
//! two bendings of a square bar.

use super::factor::{FactorScratch, Symbolic};
use super::factor_values::Factor;
use super::system::{MatrixValues, TangentPlace, assemble_tangent, pattern_of};
use crate::body::DeformableBody;
use crate::error::BodyError;
use crate::fem::{Elements, SystemMatrix};
use crate::material::DeformableMaterial;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::f64::consts::TAU;

/// A mode of vibration of a body.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeformableMode {
    /// \[Hz\]; zero, but for rounding, of the rigid motions of a free body.
    pub frequency: f64,
    /// How each vertex moves, such that `Σ m |φ|² = 1 kg`: a mode of amplitude a \[m\] has the energy `½ ω² a² kg`.
    pub shape: Vec<[f64; 3]>,
}

/// Vectors of a block: as many as a free body has rigid motions, and two.
const BLOCK: usize = 8;
/// Shift σ over `E/(ρ l²)` of the stiffest region, l the size of the body: far below the lowest modes, and far above rounding.
/// At 1e-9 the rigid motions of a free body leave too few digits for the others, and the search does not end by itself.
const SHIFT: f64 = 1.0e-6;
/// Residual of a mode over its eigenvalue; a frequency is right to the square of it.
const TOLERANCE: f64 = 1.0e-7;
/// Blocks in the space at the most, beside four vectors for each mode wanted: what has not converged by then will not, for
/// rounding.
const LARGEST: usize = 24;
/// What is left of a vector that counts as nothing new.
const NOTHING: f64 = 1.0e-10;

impl DeformableBody {
    /// The lowest `count` modes of vibration about the present state, ascending, without damping: of a body at rest those of its
    /// shape, of one under load those that the load leaves it. Pinned vertices stand still; contacts and attachments are not seen.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20, 4, 4]);
    /// let bar = bar.material(DeformableMaterial::new(1.0e7, 0.0)).pinned(|x| x.x < -0.499).build()?;
    /// let modes = bar.modes(12)?;
    /// // The first along the bar: a quarter of a wave at the speed √(E/ρ).
    /// let is_along = |mode: &&DeformableMode| {
    ///     let [x, y, z] = [0, 1, 2].map(|k| mode.shape.iter().map(|v| v[k] * v[k]).sum::<f64>());
    ///     x > y + z
    /// };
    /// let along = modes.iter().find(is_along).unwrap();
    /// assert!((along.frequency / (100.0 / 4.0) - 1.0).abs() < 0.01);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::Unstable`] where the stiffness has a negative mode, as of what is about to buckle.
    pub fn modes(&self, count: usize) -> Result<Vec<DeformableMode>, BodyError> {
        let woven =
            |m: &DeformableMaterial| m.orthotropic.map_or(0.0, |s| s.warp_modulus.max(s.weft_modulus));
        let ladder = |m: &DeformableMaterial| m.youngs_modulus.max(m.fibre_modulus).max(woven(m)) / m.density;
        let stiffest = self.materials.iter().map(ladder).fold(0.0, f64::max);
        let shift = SHIFT * stiffest / (self.model.size * self.model.size);
        let operator = ShiftedInverse::new(self, shift)?;
        let count = count.min(operator.dimension());
        let found = if count == 0 { Vec::new() } else { lowest(&operator, count) };
        let mode = |(theta, z): (f64, DVector<f64>)| {
            // Pinned nodes have no root, and do not move.
            let node =
                |n: usize| [0, 1, 2].map(|c| z[3 * n + c] / operator.roots[3 * n].max(f64::MIN_POSITIVE));
            DeformableMode {
                frequency: (1.0 / theta - shift).max(0.0).sqrt() / TAU,
                shape: self.model.nodes_by_vertex().map(node).collect(),
            }
        };
        Ok(found.into_iter().map(mode).collect())
    }
}

/// `M½ (K + σM)⁻¹ M½`, without the pinned nodes.
struct ShiftedInverse {
    symbolic: Symbolic,
    factor: Factor,
    /// √m, three of each node; zero of pinned ones.
    roots: Vec<f64>,
    pins: usize,
}

impl ShiftedInverse {
    fn new(body: &DeformableBody, shift: f64) -> Result<Self, BodyError> {
        let bare = |m: &DeformableMaterial| m.stiffness_damping(0.0).mass_damping(0.0).maxwell_branches([]);
        let materials: Vec<DeformableMaterial> = body.materials.iter().map(bare).collect();
        let elements = Elements { materials: &materials, ..body.elements() };
        let pins: Vec<u32> = body.pins.iter().map(|pin| pin.node).collect();
        let symbolic = pattern_of(&body.model, SystemMatrix::RestStiffness).ok_or(BodyError::Unstable)?;
        let h = 1.0 / shift.sqrt();
        let place = TangentPlace { x: &body.state.x, projected: false, pins: &pins, h };
        let mut matrix = MatrixValues::default();
        assemble_tangent(&elements, &place, &symbolic, &mut matrix);
        let factor = symbolic.factorize(&matrix.values, &mut FactorScratch::default());
        let factor = factor.map_err(|_| BodyError::Unstable)?;
        let mut roots: Vec<f64> = body.masses.iter().flat_map(|m| [m.sqrt(); 3]).collect();
        pins.iter().for_each(|&pin| roots[3 * pin as usize..][..3].fill(0.0));
        Ok(Self { symbolic, factor, roots, pins: pins.len() })
    }

    /// Number of unknowns.
    fn dimension(&self) -> usize {
        self.roots.len() - 3 * self.pins
    }

    fn apply(&self, vectors: &[DVector<f64>], scratch: &mut FactorScratch) -> Vec<DVector<f64>> {
        let weighted = |v: &DVector<f64>| v.iter().zip(&self.roots).map(|(v, r)| v * r).collect::<Vec<_>>();
        let mut columns: Vec<f64> = vectors.iter().flat_map(weighted).collect();
        self.symbolic.solve_batch(&self.factor, &mut columns, scratch);
        let columns = columns.chunks_exact(self.roots.len());
        columns.map(|column| DVector::from_vec(weighted(&DVector::from_column_slice(column)))).collect()
    }
}

/// The largest eigenvalues of the operator with their unit vectors, descending.
fn lowest(operator: &ShiftedInverse, count: usize) -> Vec<(f64, DVector<f64>)> {
    let mut scratch = FactorScratch::default();
    let mut block = first_block(&operator.roots);
    let (mut space, mut images): (Vec<DVector<f64>>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
    loop {
        let fresh = orthonormal(block, &space);
        let is_all = fresh.is_empty();
        block = operator.apply(&fresh, &mut scratch);
        space.extend(fresh);
        images.extend(block.iter().cloned());
        let projected = DMatrix::from_fn(space.len(), space.len(), |i, j| {
            0.5 * (space[i].dot(&images[j]) + space[j].dot(&images[i]))
        });
        let SymmetricEigen { eigenvalues, eigenvectors } = projected.symmetric_eigen();
        let mut order: Vec<usize> = (0..space.len()).collect();
        order.sort_by(|a, b| eigenvalues[*b].total_cmp(&eigenvalues[*a]));
        let sum = |list: &[DVector<f64>], k: usize| {
            let mut sum = DVector::zeros(operator.roots.len());
            list.iter().enumerate().for_each(|(i, v)| sum.axpy(eigenvectors[(i, k)], v, 1.0));
            sum
        };
        let is_right = |k: &usize| {
            let theta = eigenvalues[*k];
            (sum(&images, *k) - sum(&space, *k) * theta).norm() <= TOLERANCE * theta
        };
        let wanted = order.iter().take(count);
        let is_large = space.len() >= LARGEST * BLOCK + 4 * count;
        if is_all || space.len() >= count && (is_large || wanted.clone().all(is_right)) {
            return wanted.map(|k| (eigenvalues[*k], sum(&space, *k))).collect();
        }
    }
}

/// Vectors without a pattern that a mode could be orthogonal to.
fn first_block(roots: &[f64]) -> Vec<DVector<f64>> {
    let mut state = 1_u64;
    let mut random = |root: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if root > 0.0 { (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5 } else { 0.0 }
    };
    (0..BLOCK).map(|_| DVector::from_iterator(roots.len(), roots.iter().map(|root| random(*root)))).collect()
}

/// What is new in a block beside a space, as unit vectors orthogonal to it and to one another.
fn orthonormal(block: Vec<DVector<f64>>, space: &[DVector<f64>]) -> Vec<DVector<f64>> {
    let mut fresh: Vec<DVector<f64>> = Vec::new();
    for mut vector in block {
        let before = vector.norm();
        // Once leaves what rounding makes of a vector that is nearly in the space.
        for _ in 0..2 {
            for other in space.iter().chain(&fresh) {
                let along = other.dot(&vector);
                vector.axpy(-along, other, 1.0);
            }
        }
        let left = vector.norm();
        if left > NOTHING * before {
            fresh.push(vector / left);
        }
    }
    fresh
}
