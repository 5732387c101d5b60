//! The constant matrix as what it does, element by element, without being put together: for conjugate gradients
//! on bodies whose factor would not fit, or would be made anew all the time.

use super::coefficients::{dimension, node_inertia};
use super::gauss_seidel::OVER_DIAGONAL;
use crate::fem::constant_matrix::{add_blocks, subtract_product};
use crate::fem::{DeformableModel, Elements, SystemMatrix};
use crate::material::DeformableMaterial;
use crate::math::{Mat3, Vec3, dot};
use std::sync::Arc;

/// `A v` for the matrix of [`super::system::assemble`].
#[derive(Debug)]
pub(crate) struct StiffnessOperator {
    model: Arc<DeformableModel>,
    materials: Vec<DeformableMaterial>,
    system: SystemMatrix,
    /// \[s\].
    h: f64,
    /// (1 + αh) m/h² per node [N/m]; one for pinned nodes.
    inertia: Vec<f64>,
    pins: Vec<u32>,
    /// Of the blocks on the diagonal.
    inverse_diagonal: Vec<Mat3>,
}

/// Memory for conjugate gradients.
#[derive(Default)]
pub(crate) struct ConjugateScratch {
    residual: Vec<Vec3>,
    direction: Vec<Vec3>,
    image: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    solution: Vec<Vec3>,
}

/// Where conjugate gradients stop: residual over right-hand side. Contacts want columns that agree with
/// what a step does.
const TOLERANCE: f64 = 1.0e-8;
/// Steps of conjugate gradients at the most.
const MAX_STEPS: usize = 1000;

impl StiffnessOperator {
    pub fn new(
        model: &Arc<DeformableModel>,
        materials: &[DeformableMaterial],
        pins: &[u32],
        system: SystemMatrix,
        h: f64,
    ) -> Self {
        let mut operator = Self {
            model: model.clone(),
            materials: materials.to_vec(),
            system,
            h,
            inertia: node_inertia(model, materials, h),
            pins: pins.to_vec(),
            inverse_diagonal: Vec::new(),
        };
        pins.iter().for_each(|&p| operator.inertia[p as usize] = 1.0);
        let mut diagonal = vec![Mat3::zeros(); model.rest.len()];
        add_blocks(
            &operator.elements(),
            system,
            |material| material.stiffening(h),
            |i, j, block| {
                if i == j {
                    diagonal[i] += block;
                }
            },
        );
        pins.iter().for_each(|&p| diagonal[p as usize] = Mat3::zeros());
        let invert = |(d, m): (&Mat3, &f64)| {
            let block = d + Mat3::from_diagonal_element(*m);
            block.try_inverse().unwrap_or_else(|| Mat3::from_diagonal_element(1.0 / m))
        };
        operator.inverse_diagonal = diagonal.iter().zip(&operator.inertia).map(invert).collect();
        operator
    }

    /// As that of a matrix that is put together.
    pub fn local_compliance(&self) -> Vec<f64> {
        let mean = |block: &Mat3| OVER_DIAGONAL * block.trace() / 3.0;
        let mut local: Vec<f64> = self.inverse_diagonal.iter().map(mean).collect();
        self.pins.iter().for_each(|&p| local[p as usize] = 0.0);
        local
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.inertia[..]) + size_of_val(&self.inverse_diagonal[..])
    }

    fn elements(&self) -> Elements<'_> {
        Elements { model: &self.model, materials: &self.materials, activations: &[] }
    }

    /// `out = A v`; v is zero at pinned nodes.
    fn multiply(&self, v: &[Vec3], out: &mut Vec<Vec3>) {
        out.clear();
        out.resize(v.len(), Vec3::zeros());
        let stiffening = |material: &DeformableMaterial| material.stiffening(self.h);
        subtract_product(&self.elements(), self.system, stiffening, v, out);
        self.pins.iter().for_each(|&p| out[p as usize] = Vec3::zeros());
        for ((out, v), m) in out.iter_mut().zip(v).zip(&self.inertia) {
            *out = v * *m - *out;
        }
    }

    /// `x ← A⁻¹ x` for the unknowns in the nodes' order, by conjugate gradients from zero with the blocks on the
    /// diagonal as preconditioner [Saad 2003, algorithm 9.1].
    pub fn solve(&self, x: &mut [f64], scratch: &mut ConjugateScratch) {
        let d = dimension(self.system);
        let ConjugateScratch { residual: r, direction: p, image: Ap, preconditioned: z, solution } = scratch;
        r.clear();
        r.extend(x.chunks_exact(d).map(|x| Vec3::from_fn(|c, _| x.get(c).copied().unwrap_or(0.0))));
        // Rows of the identity: what stands there is the answer.
        let held: Vec<Vec3> = self.pins.iter().map(|&p| std::mem::take(&mut r[p as usize])).collect();
        solution.clear();
        solution.resize(r.len(), Vec3::zeros());
        let precondition = |r: &[Vec3], z: &mut Vec<Vec3>| {
            z.clear();
            z.extend(r.iter().zip(&self.inverse_diagonal).map(|(r, inverse)| inverse * r));
        };
        precondition(r, z);
        p.clone_from(z);
        let wanted = TOLERANCE * dot(r, r).sqrt();
        let mut before = dot(r, z);
        for _ in 0..MAX_STEPS {
            if !(dot(r, r).sqrt() > wanted) {
                break;
            }
            self.multiply(p, Ap);
            let length = before / dot(p, Ap);
            for k in 0..r.len() {
                solution[k] += p[k] * length;
                r[k] -= Ap[k] * length;
            }
            precondition(r, z);
            let now = dot(r, z);
            let turn = now / before;
            before = now;
            p.iter_mut().zip(&*z).for_each(|(p, z)| *p = z + *p * turn);
        }
        self.pins.iter().zip(held).for_each(|(&p, held)| solution[p as usize] = held);
        for (x, s) in x.chunks_exact_mut(d).zip(&*solution) {
            x.copy_from_slice(&s.as_slice()[..d]);
        }
    }
}
