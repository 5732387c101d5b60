//! What resists the change of stretch over a step: stiffness damping, from the stretch at its start, and Maxwell branches, from what
//! their dampers have given way.
//!
//! Damping adds `β/h·V·(μ‖F − R′S_n‖² + λ/2·(tr(RᵀF) − tr S_n)²)` with the stretch `S_n = R_nᵀF_n` at the start of the step and
//! R′ = polar(F S_n), so that spinning costs nothing. A branch of ratio r and time τ is a spring of r times the stiffness, from the
//! stretch D of its damper, which goes by `Ḋ = (S − D)/τ`. At the end of an implicit step that is `S − D = (S − D_n)/(1 + h/τ)`:
//! the same energy, with `r/(1 + h/τ)` in the place of β/h and D_n in that of S_n. All of them together are one such energy, but
//! for a constant, with the sum of the factors and the mean of the stretches by them.

use super::model::{DeformableModel, Elements};
use super::stretches::Stretches;
use crate::energy::Lame;
use crate::material::{DeformableMaterial, MAX_BRANCHES};
use crate::math::Vec3;
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;

/// The stretches of dampers, of each branch that a material of the body has; empty before the first step.
pub(crate) type Dampers = Vec<Stretches>;

/// What resists over one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct StiffnessDamping {
    /// Of each region, β/h and what its branches add.
    pub(super) ratios: Vec<f64>,
    /// What is measured from; empty where nothing resists.
    pub(super) stretches: Stretches,
    /// Those of the dampers at the start of the step.
    dampers: Dampers,
    parts: Vec<f64>,
    other: Stretches,
}

impl StiffnessDamping {
    /// Takes over the dampers of a body, at their rest shape where it has none yet.
    pub fn take_dampers(&mut self, elements: &Elements<'_>, dampers: &Dampers) {
        let count = elements.materials.iter().map(DeformableMaterial::branch_count).max().unwrap_or(0);
        self.dampers.clone_from(dampers);
        self.dampers.truncate(count);
        while self.dampers.len() < count {
            let mut at_rest = Stretches::default();
            at_rest.set(elements.model, &elements.model.rest);
            self.dampers.push(at_rest);
        }
    }

    /// Takes the stretches at `x`, or what they and those `before` amount to in a step of the second order; `h` \[s\].
    pub fn begin(&mut self, elements: &Elements<'_>, h: f64, x: &[Vec3], before: Option<&[Vec3]>) {
        let Elements { model, materials, .. } = elements;
        self.ratios.clear();
        self.ratios.extend(materials.iter().map(|material| material.stiffness_damping / h));
        self.stretches.clear();
        if self.dampers.is_empty() && self.ratios.iter().all(|ratio| *ratio == 0.0) {
            return;
        }
        self.stretches.set(model, x);
        if let Some(before) = before {
            self.other.set(model, before);
            self.stretches.extrapolate(&self.other);
        }
        for (k, damper) in self.dampers.iter().enumerate() {
            self.parts.clear();
            self.parts.extend(materials.iter().map(|material| material.maxwell_branches[k].resistance(h)));
            self.ratios.iter_mut().zip(&self.parts).for_each(|(whole, part)| *whole += part);
            self.stretches.approach(model, damper, &self.parts, &self.ratios);
        }
    }

    /// Those of the dampers at the start of the step.
    pub fn dampers(&self) -> &Dampers {
        &self.dampers
    }

    /// Whether anything resists.
    pub fn resists(&self) -> bool {
        self.ratios.iter().any(|ratio| *ratio != 0.0)
    }

    /// Lets the dampers give way over a step of `h` \[s\] that has ended at `x`, in those of the body.
    pub fn end(&mut self, elements: &Elements<'_>, h: f64, x: &[Vec3], dampers: &mut Dampers) {
        dampers.clone_from(&self.dampers);
        if dampers.is_empty() {
            return;
        }
        let Elements { model, materials, .. } = elements;
        self.other.set(model, x);
        for (k, damper) in dampers.iter_mut().enumerate() {
            let times = materials.iter().map(|material| material.maxwell_branches[k].time + h);
            self.ratios.clear();
            self.ratios.extend(times);
            self.parts.clear();
            self.parts.resize(materials.len(), h);
            damper.approach(model, &self.other, &self.parts, &self.ratios);
        }
    }
}

/// Dampers that have given way to what positions `x` are: nothing is left in their branches.
pub(crate) fn relaxed(elements: &Elements<'_>, x: &[Vec3]) -> Dampers {
    let count = elements.materials.iter().map(DeformableMaterial::branch_count).max().unwrap_or(0);
    let mut stretches = Stretches::default();
    stretches.set(elements.model, x);
    vec![stretches; count]
}

/// The largest strain that branches hold at positions `x`, by the stiffness of each over the elastic one.
pub(crate) fn branch_strain(elements: &Elements<'_>, x: &[Vec3], dampers: &Dampers) -> f64 {
    if dampers.is_empty() {
        return 0.0;
    }
    let mut now = Stretches::default();
    now.set(elements.model, x);
    let ratio = |k: usize| elements.materials.iter().map(|m| m.maxwell_branches[k].ratio).fold(0.0, f64::max);
    let held = dampers.iter().enumerate().map(|(k, damper)| now.farthest(elements.model, damper) * ratio(k));
    held.fold(0.0, f64::max)
}

/// Whether a body of this model can have these.
pub(crate) fn are_dampers(dampers: &Dampers, model: &DeformableModel) -> bool {
    dampers.len() <= MAX_BRANCHES && dampers.iter().all(|stretches| stretches.fits(model))
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
