//! The elastic part of the constant matrix [Bouaziz et al. 2014; Liu et al. 2017]: block by block, for the matrix that
//! is put together, and as what it does to a vector, for the one that is not. Sheets, rods and springs
//! are in it as a multiple of I that is about as stiff as they are along their lengths, without their strain limits.

use super::elements::ElementBlock;
use super::gradients::{deformation_gradient, scatter_forces};
use super::model::Elements;
use super::smoothing::SmoothingDomains;
use super::solid_elements::SolidElement;
use super::thin_elements::{length_energy, membrane};
use crate::energy::{ElementEnergy, Lame, with_energy};
use crate::material::DeformableMaterial;
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::{Mat3, Vec3, vectorized};
use nalgebra::Vector2;
use std::ops::Range;

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
    weight_of(material, material.lame())
}

fn weight_of(material: &DeformableMaterial, lame: Lame) -> f64 {
    with_energy!(material, lame, energy => energy.laplacian_weight())
}

/// Calls `add(i, j, K)` with the blocks of every element [N/m], times what `stiffening` says of its material.
pub(crate) fn add_blocks(
    elements: &Elements<'_>,
    system: SystemMatrix,
    stiffening: impl Fn(&DeformableMaterial) -> f64,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    elements.model.for_each_energy(elements.materials, |law, element| {
        let Lame { mu, lambda } = law.lame;
        let SolidElement { nodes, gradients, volume, .. } = *element;
        let (weight, stiffening) = (weight_of(law.material, law.lame), stiffening(law.material));
        for (&i, a) in nodes.iter().zip(gradients) {
            for (&j, b) in nodes.iter().zip(gradients) {
                let block = match system {
                    SystemMatrix::Laplacian => Mat3::from_diagonal_element(weight * a.dot(b)),
                    SystemMatrix::RestStiffness => {
                        let shape = (Mat3::from_diagonal_element(a.dot(b)) + b * a.transpose()) * mu;
                        shape + a * b.transpose() * lambda
                    }
                };
                add(i as usize, j as usize, &(block * volume * stiffening));
            }
        }
    });
    add_thin_bounds(elements, stiffening, |i, j, k| add(i, j, &Mat3::from_diagonal_element(k)));
}

fn add_thin_bounds(
    elements: &Elements<'_>,
    stiffening: impl Fn(&DeformableMaterial) -> f64,
    mut add: impl FnMut(usize, usize, f64),
) {
    let Elements { model, materials, activations } = elements;
    for triangle in &model.triangles {
        let material = &materials[triangle.region as usize];
        let stiffening = stiffening(material);
        let [warp, weft] = membrane(material).laplacian_weights().map(|weight| weight * stiffening);
        let product = |a: &Vector2<f64>, b: &Vector2<f64>| match warp == weft {
            true => warp * triangle.volume * a.dot(b),
            false => triangle.volume * (warp * a.x * b.x + weft * a.y * b.y),
        };
        for (&i, a) in triangle.nodes.iter().zip(&triangle.gradients) {
            for (&j, b) in triangle.nodes.iter().zip(&triangle.gradients) {
                add(i as usize, j as usize, product(a, b));
            }
        }
    }
    for stencil in model.stencils.iter() {
        let stiffening = stencil.mean(|region| stiffening(&materials[region as usize]));
        let weight = length_energy(&stencil, materials, activations).weight * stiffening;
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms() {
                add(i, j, weight * a * b);
            }
        }
    }
}

/// Subtracts the elastic part of the matrix times `v` from `out`.
pub(crate) fn subtract_product(
    elements: &Elements<'_>,
    system: SystemMatrix,
    stiffening: impl Fn(&DeformableMaterial) -> f64,
    v: &[Vec3],
    out: &mut [Vec3],
) {
    let Elements { model, materials, .. } = elements;
    for (region, material) in model.regions.iter().zip(*materials) {
        let stiffening = stiffening(material);
        let law = |material: &DeformableMaterial, lame: Lame| match system {
            SystemMatrix::Laplacian => Stress::Laplacian(weight_of(material, lame) * stiffening),
            SystemMatrix::RestStiffness => {
                Stress::Lame(Lame { mu: lame.mu * stiffening, lambda: lame.lambda * stiffening })
            }
        };
        if !model.is_smoothed() {
            let blocks = &model.blocks[region.blocks.clone()];
            subtract_tetrahedra(blocks, law(material, material.lame()), v, out);
            continue;
        }
        let [shape, volume] = material.lame().split();
        subtract_domains(&model.domains, region.domains.clone(), law(material, shape), v, out);
        if volume.lambda > 0.0 {
            let law = law(&material.without_limits(), volume);
            subtract_domains(&model.volume_domains, region.patches.clone(), law, v, out);
        }
    }
    add_thin_bounds(elements, stiffening, |i, j, k| out[i] -= v[j] * k);
}

/// Stress of a gradient.
#[derive(Clone, Copy)]
enum Stress {
    Laplacian(f64),
    Lame(Lame),
}

impl Stress {
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
fn subtract_tetrahedra[](blocks: &[ElementBlock], law: Stress, v: &[Vec3], out: &mut [Vec3]) {
    for block in blocks {
        scatter_forces(block, &law.stress(&deformation_gradient(block, v)), out);
    }
}
}

vectorized! {
fn subtract_domains[](
    domains: &SmoothingDomains,
    blocks: Range<usize>,
    law: Stress,
    v: &[Vec3],
    out: &mut [Vec3],
) {
    for block in blocks {
        let G = domains.deformation_gradient(block, v);
        domains.scatter_forces(block, &law.stress(&G), out);
    }
}
}
