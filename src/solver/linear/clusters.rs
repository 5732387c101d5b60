//! Rotations that the Laplacian resists and should not, given back cluster by cluster.
//!
//! The Laplacian holds the projections of all elements still, so what turns or bends meets their full
//! stiffness. Let the projections of every cluster c turn along, by θ_c, and eliminate θ: with
//! `Y_c,i = Σ_{e∈c} w V g_e,i` and the rotation Q_c of the cluster, B has the columns `e_a × Q_c Y_c,i`, T is
//! `2 Σ_{e∈c} w V`, and
//! `A_eff⁻¹ = A⁻¹ + A⁻¹B (T − BᵀA⁻¹B)⁻¹ BᵀA⁻¹`.
//! With `Z_c = A⁻¹Y_c` made once, only rotations are left to be done in a step.

use super::factor::{BATCH, FactorScratch, Symbolic};
use super::factor_values::Factor;
use crate::fem::DeformableModel;
use crate::math::polar::polar_rotation;
use crate::math::{Mat3, Vec3, skew};
use nalgebra::{DMatrix, DVector};

/// The constant part, kept with a factor.
pub(crate) struct Clusters {
    /// Per cluster, per node; without the pinned ones.
    Y: Vec<Vec<Vec3>>,
    /// With them, as where a cluster is does not turn it.
    moments: Vec<Vec<Vec3>>,
    Z: Vec<Vec<Vec3>>,
    /// `Σ_i Y_c,i Z_d,iᵀ`, by columns of clusters.
    products: Vec<Mat3>,
    /// `2 Σ w V` \[Pa m³\].
    T: Vec<f64>,
}

/// What turns with the body.
#[derive(Default)]
pub(crate) struct TurnedClusters {
    frames: Vec<Mat3>,
    /// `(T − BᵀA⁻¹B)⁻¹`.
    inverse: DMatrix<f64>,
    sums: DVector<f64>,
}

impl Clusters {
    /// Slices of about equal numbers of elements along the body, which are in that order; `weights` \[Pa\] are those of
    /// the regions in the Laplacian.
    pub fn new(
        model: &DeformableModel,
        count: usize,
        weights: &[f64],
        pins: &[u32],
        symbolic: &Symbolic,
        factor: &Factor,
        scratch: &mut FactorScratch,
    ) -> Self {
        let n = model.rest.len();
        // By where they are: domains are not in the order of the sweep.
        let mut places = Vec::new();
        model.for_each_solid(|_, nodes, _, _| {
            places.push(nodes.iter().map(|&n| n as usize).sum::<usize>() / nodes.len());
        });
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&e| places[e]);
        let count = count.min(order.len()).max(1);
        let mut cluster = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, &e)| cluster[e] = k * count / order.len());
        let (mut Y, mut T) = (vec![vec![Vec3::zeros(); n]; count], vec![0.0; count]);
        let mut clusters = cluster.into_iter();
        model.for_each_solid(|region, nodes, gradients, volume| {
            let Some(c) = clusters.next() else { return };
            let weight = weights[region];
            T[c] += 2.0 * weight * volume;
            nodes.iter().zip(gradients).for_each(|(&n, g)| Y[c][n as usize] += g * (weight * volume));
        });
        let moments = Y.clone();
        // Pinned nodes are no unknowns.
        Y.iter_mut().for_each(|y| pins.iter().for_each(|&p| y[p as usize] = Vec3::zeros()));
        let mut columns: Vec<f64> = Vec::new();
        for y in &Y {
            (0..3).for_each(|c| columns.extend(y.iter().map(|v| v[c])));
        }
        for batch in columns.chunks_mut(n * BATCH) {
            symbolic.solve_batch(factor, batch, scratch);
        }
        let column = |c: usize, axis: usize| &columns[n * (3 * c + axis)..][..n];
        let Z: Vec<Vec<Vec3>> = (0..count)
            .map(|c| (0..n).map(|i| Vec3::from_fn(|axis, _| column(c, axis)[i])).collect())
            .collect();
        let product = |c: usize, d: usize| {
            Y[c].iter().zip(&Z[d]).fold(Mat3::zeros(), |sum, (y, z)| sum + y * z.transpose())
        };
        let products = (0..count * count).map(|k| product(k % count, k / count)).collect();
        Self { Y, moments, Z, products, T }
    }

    pub fn bytes(&self) -> usize {
        (2 * self.Y.len() + self.Z.len()) * self.Y.first().map_or(0, |y| size_of_val(&y[..]))
    }
}

impl TurnedClusters {
    /// Turns the clusters to where they are at `x`; false where that leaves no definite matrix.
    pub fn turn(&mut self, clusters: &Clusters, x: &[Vec3]) -> bool {
        let count = clusters.Y.len();
        self.frames.clear();
        for y in &clusters.moments {
            let moment = x.iter().zip(y).fold(Mat3::zeros(), |sum, (x, y)| sum + x * y.transpose());
            self.frames.push(polar_rotation(&moment));
        }
        let mut matrix = DMatrix::zeros(3 * count, 3 * count);
        for d in 0..count {
            for c in 0..count {
                let M = self.frames[c] * clusters.products[d * count + c] * self.frames[d].transpose();
                // Σ (e_a × p)·(e_b × q) = δ_ab tr M − M_ba.
                let block = M.transpose() - Mat3::from_diagonal_element(M.trace());
                matrix.fixed_view_mut::<3, 3>(3 * c, 3 * d).copy_from(&block);
            }
            for a in 0..3 {
                matrix[(3 * d + a, 3 * d + a)] += clusters.T[d];
            }
        }
        let matrix = (&matrix + matrix.transpose()) * 0.5;
        let inverse = matrix.cholesky().map(|c| c.inverse());
        self.inverse = inverse.unwrap_or_default();
        self.inverse.nrows() > 0
    }

    fn jacobian_column(&self, clusters: &Clusters, c: usize, node: usize) -> Vec3 {
        self.frames[c] * clusters.Z[c][node]
    }

    /// Adds to `out = A⁻¹r` what turning along adds.
    pub fn add(&mut self, clusters: &Clusters, r: &[Vec3], out: &mut [Vec3]) {
        let count = self.frames.len();
        let mut sums = std::mem::take(&mut self.sums);
        sums.resize_vertically_mut(3 * count, 0.0);
        for (c, (frame, z)) in self.frames.iter().zip(&clusters.Z).enumerate() {
            let turned = z.iter().zip(r).fold(Vec3::zeros(), |sum, (z, r)| sum + z.cross(&frame.tr_mul(r)));
            sums.fixed_rows_mut::<3>(3 * c).copy_from(&(frame * turned));
        }
        let turns = &self.inverse * &sums;
        for (c, (frame, z)) in self.frames.iter().zip(&clusters.Z).enumerate() {
            let turn: Vec3 = turns.fixed_rows::<3>(3 * c).into();
            let spin = skew(&turn) * frame;
            out.iter_mut().zip(z).for_each(|(out, z)| *out += spin * z);
        }
        self.sums = sums;
    }

    /// What it adds to the block of `A⁻¹` between two nodes [m/N].
    pub fn compliance(&self, clusters: &Clusters, i: usize, j: usize) -> Mat3 {
        let count = self.frames.len();
        let mut block = Mat3::zeros();
        for d in 0..count {
            let from = skew(&self.jacobian_column(clusters, d, j));
            for c in 0..count {
                let inverse: Mat3 = self.inverse.fixed_view::<3, 3>(3 * c, 3 * d).into();
                block -= skew(&self.jacobian_column(clusters, c, i)) * inverse * from;
            }
        }
        block
    }
}
