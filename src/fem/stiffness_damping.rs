//! Stiffness damping over a step: what it takes at the start, and what each element answers.
//!
//! It adds `β/h·V·(μ‖F − R′S_n‖² + λ/2·(tr(RᵀF) − tr S_n)²)` with the stretch
//! `S_n = R_nᵀF_n` at the start of the step and R′ = polar(F S_n), so that spinning costs nothing.

use super::gradients::{solid_blocks, solid_gradient, transpose_mul};
use super::model::{DeformableModel, Elements};
use super::thin_elements::ThinDamping;
use crate::energy::Lame;
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;
use crate::math::{Vec3, vectorized};

/// Stiffness damping over one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct StiffnessDamping {
    /// β/h of each region.
    pub(super) ratios: Vec<f64>,
    /// Stretch of each block at the start of the step; empty without damping.
    pub(super) stretches: Vec<LaneMat3>,
    /// Those of the patches of smoothed bodies.
    pub(super) patches: Vec<LaneMat3>,
    pub(super) thin: ThinDamping,
}

impl StiffnessDamping {
    /// Takes the stretches at `x`, or what they and those `before` amount to in a step of the second order; `h` \[s\].
    pub fn begin(&mut self, elements: &Elements<'_>, h: f64, x: &[Vec3], before: Option<&[Vec3]>) {
        let Elements { model, materials, .. } = elements;
        self.ratios.clear();
        self.ratios.extend(materials.iter().map(|material| material.stiffness_damping / h));
        let is_damped = self.ratios.iter().any(|ratio| *ratio > 0.0);
        let mut last = Vec::new();
        for (stretches, push) in [
            (&mut self.stretches, push_stretches as fn(&DeformableModel, &[Vec3], &mut Vec<LaneMat3>)),
            (&mut self.patches, push_patch_stretches),
        ] {
            stretches.clear();
            if is_damped {
                push(model, x, stretches);
                last.clear();
                before.iter().for_each(|before| push(model, before, &mut last));
                for (now, last) in stretches.iter_mut().zip(&last) {
                    *now = now.plus_scaled(&now.minus(last), Lane::splat(1.0 / 3.0));
                }
            }
        }
        self.thin.begin(&model.triangles, &model.stencils, is_damped, x, before);
    }
}

vectorized! {
fn push_stretches[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..solid_blocks(model) {
        stretches.push(stretch(&solid_gradient(model, block, x)));
    }
}
}

vectorized! {
fn push_patch_stretches[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..model.volume_domains.block_count() {
        stretches.push(stretch(&model.volume_domains.deformation_gradient(block, x)));
    }
}
}

#[inline(always)]
fn stretch(F: &LaneMat3) -> LaneMat3 {
    let S = transpose_mul(&polar_rotations(F), F);
    // Symmetric but for roundings.
    LaneMat3(std::array::from_fn(|k| (S.0[k] + S.at(k / 3, k % 3)) * 0.5))
}

/// Damping's energy density and stress, both per β/h.
#[inline(always)]
pub(super) fn damping_response(
    Lame { mu, lambda }: Lame,
    stretch: &LaneMat3,
    F: &LaneMat3,
    rotation: &LaneMat3,
) -> (Lane, LaneMat3) {
    // R' S_n with S_n symmetric.
    let turned = polar_rotations(&F.mul_transpose(stretch)).mul(stretch);
    let deviation = F.minus(&turned);
    let trace = rotation.dot(F) - (stretch.at(0, 0) + stretch.at(1, 1) + stretch.at(2, 2));
    let density = deviation.dot(&deviation) * mu + trace * trace * (0.5 * lambda);
    let stress = deviation.scaled(Lane::splat(2.0 * mu)).plus_scaled(rotation, trace * lambda);
    (density, stress)
}
