//! The elastic part of the constant matrix [Bouaziz et al. 2014; Liu et al. 2017]: block by block, for the matrix that
//! is put together, and as what it does to a vector, for the one that is not. Sheets, rods and springs
//! are in it as a multiple of I that is about as stiff as they are along their lengths, without their strain limits.

use super::gradients::{deformation_gradient, scatter_forces};
use super::model::{DeformableModel, Elements};
use super::smoothing::SmoothingDomains;
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

/// Of elements with these of Lamé's constants. Strain limits go with the shape.
fn weight_of(material: &DeformableMaterial, lame: Lame) -> f64 {
    let bare = DeformableMaterial { strain_limits: None, ..*material };
    let material = if lame.mu > 0.0 { material } else { &bare };
    with_energy!(material, lame, energy => energy.laplacian_weight())
}

/// Calls `add(i, j, K)` with the blocks of every element [N/m].
pub(crate) fn add_blocks(
    elements: &Elements<'_>,
    system: SystemMatrix,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    let material = elements.material;
    elements.model.for_each_energy(material.lame(), |lame, nodes, gradients, volume| {
        let Lame { mu, lambda } = lame;
        let weight = weight_of(material, lame);
        for (&i, a) in nodes.iter().zip(gradients) {
            for (&j, b) in nodes.iter().zip(gradients) {
                let block = match system {
                    SystemMatrix::Laplacian => Mat3::from_diagonal_element(weight * a.dot(b)),
                    SystemMatrix::RestStiffness => {
                        let shape = (Mat3::from_diagonal_element(a.dot(b)) + b * a.transpose()) * mu;
                        shape + a * b.transpose() * lambda
                    }
                };
                add(i as usize, j as usize, &(block * volume));
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
    let Elements { model, material, .. } = elements;
    let law = |lame: Lame| match system {
        SystemMatrix::Laplacian => Law::Laplacian(weight_of(material, lame)),
        SystemMatrix::RestStiffness => Law::Lame(lame),
    };
    if model.is_smoothed() {
        let [shape, volume] = material.lame().split();
        subtract_domains(&model.domains, law(shape), v, out);
        if volume.lambda > 0.0 {
            subtract_domains(&model.volume_domains, law(volume), v, out);
        }
    } else {
        subtract_tetrahedra(model, law(material.lame()), v, out);
    }
    add_thin_bounds(elements, |i, j, k| out[i] -= v[j] * k);
}

/// Stress of a gradient.
#[derive(Clone, Copy)]
enum Law {
    Laplacian(f64),
    Lame(Lame),
}

impl Law {
    #[inline(always)]
    fn stress(self, G: &LaneMat3) -> LaneMat3 {
        let lame = match self {
            Self::Laplacian(weight) => return G.scaled(Lane::splat(weight)),
            Self::Lame(lame) => lame,
        };
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
}

vectorized! {
fn subtract_tetrahedra[](model: &DeformableModel, law: Law, v: &[Vec3], out: &mut [Vec3]) {
    for block in &model.blocks {
        scatter_forces(block, &law.stress(&deformation_gradient(block, v)), out);
    }
}
}

vectorized! {
fn subtract_domains[](domains: &SmoothingDomains, law: Law, v: &[Vec3], out: &mut [Vec3]) {
    for block in 0..domains.block_count() {
        let G = domains.deformation_gradient(block, v);
        domains.scatter_forces(block, &law.stress(&G), out);
    }
}
}
