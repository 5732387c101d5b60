//! The elastic part of the constant matrix [Bouaziz et al. 2014; Liu et al. 2017]: block by block, for the matrix that
//! is put together, and as what it does to a vector, for the one that is not. Sheets, rods and springs
//! are in it as a multiple of I that is about as stiff as they are along their lengths, without their strain limits.

use super::gradients::{scatter_solid, solid_blocks, solid_gradient};
use super::model::{DeformableModel, Elements};
use super::thin_elements::{length_energy, membrane};
use crate::energy::{ElementEnergy, Lame, with_energy};
use crate::material::DeformableMaterial;
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::{Mat3, Vec3, vectorized};

/// The constant matrix of the global step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SystemMatrix {
    /// `M/h² + K₀` with the linear stiffness K₀ of the rest shape, 3n×3n, applied in rotating
    /// [`Frames`](crate::Frames). The default: stiff bodies are right at one
    /// iteration, bending ones at five to ten.
    #[default]
    RestStiffness,
    /// `M/h² + Σ w V GᵀG`, the n×n matrix of classical Projective Dynamics [Bouaziz et al. 2014].
    /// A ninth of the factor, but resists rotation: stiff bodies turn and bend too slowly unless
    /// iterated. For previews and very large bodies.
    Laplacian,
}

/// Weight of the Laplacian of a material's solids \[Pa\].
pub(crate) fn laplacian_weight(material: &DeformableMaterial) -> f64 {
    with_energy!(material, energy => energy.laplacian_weight())
}

/// Calls `add(i, j, K)` with the blocks of every element [N/m].
pub(crate) fn add_blocks(
    elements: &Elements<'_>,
    system: SystemMatrix,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    let Lame { mu, lambda } = elements.material.lame();
    let weight = laplacian_weight(elements.material);
    let block = |a: &Vec3, b: &Vec3| match system {
        SystemMatrix::Laplacian => Mat3::from_diagonal_element(weight * a.dot(b)),
        SystemMatrix::RestStiffness => {
            (Mat3::from_diagonal_element(a.dot(b)) + b * a.transpose()) * mu + a * b.transpose() * lambda
        }
    };
    elements.model.for_each_solid(|nodes, gradients, volume| {
        for (&i, a) in nodes.iter().zip(gradients) {
            for (&j, b) in nodes.iter().zip(gradients) {
                add(i as usize, j as usize, &(block(a, b) * volume));
            }
        }
    });
    add_thin_bounds(elements, |i, j, k| add(i, j, &Mat3::from_diagonal_element(k)));
}

fn add_thin_bounds(elements: &Elements<'_>, mut add: impl FnMut(usize, usize, f64)) {
    let Elements { model, material, activation } = elements;
    let weight = membrane(material).laplacian_weight();
    for triangle in &model.triangles {
        for (&i, a) in triangle.nodes.iter().zip(&triangle.gradients) {
            for (&j, b) in triangle.nodes.iter().zip(&triangle.gradients) {
                add(i as usize, j as usize, weight * triangle.volume * a.dot(b));
            }
        }
    }
    for stencil in &model.stencils {
        let weight = length_energy(stencil, material, *activation).weight;
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms() {
                add(i, j, weight * a * b);
            }
        }
    }
}

/// Subtracts the elastic part of the matrix times `v` from `out`.
pub(crate) fn subtract_product(elements: &Elements<'_>, system: SystemMatrix, v: &[Vec3], out: &mut [Vec3]) {
    let weight = laplacian_weight(elements.material);
    let laplacian = (system == SystemMatrix::Laplacian).then_some(weight);
    subtract_solid_product(elements.model, elements.material.lame(), laplacian, v, out);
    add_thin_bounds(elements, |i, j, k| out[i] -= v[j] * k);
}

vectorized! {
fn subtract_solid_product[](
    model: &DeformableModel,
    lame: Lame,
    laplacian: Option<f64>,
    v: &[Vec3],
    out: &mut [Vec3],
) {
    for block in 0..solid_blocks(model) {
        let G = solid_gradient(model, block, v);
        let stress = match laplacian {
            Some(weight) => G.scaled(Lane::splat(weight)),
            None => {
                let pressure = (G.at(0, 0) + G.at(1, 1) + G.at(2, 2)) * lame.lambda;
                let mut stress = LaneMat3::default();
                for c in 0..3 {
                    for r in 0..3 {
                        stress.0[3 * c + r] = (G.at(r, c) + G.at(c, r)) * lame.mu;
                    }
                    stress.0[4 * c] += pressure;
                }
                stress
            }
        };
        scatter_solid(model, block, &stress, out);
    }
}
}
