//! Sheets, rods, springs and fibres: their elements, made of a structure, and their energy and forces.

use super::elastic_forces::{Elastic, Evaluation};
use super::model::Elements;
use super::regions::Region;
use super::stencils::Stencil;
use super::stiffness_damping::StiffnessDamping;
use super::stretches::Stretches;
use crate::energy::membrane::Membrane;
use crate::energy::stencil::{LengthEnergy, StencilKind};
use crate::material::DeformableMaterial;
use crate::math::Vec3;

/// The energy of a material's sheets.
pub(super) fn membrane(material: &DeformableMaterial) -> Membrane {
    let limits = material.strain_limits;
    match &material.orthotropic {
        None => Membrane::new(material.lame(), limits, material.limit_weight()),
        Some(cloth) => Membrane::woven(cloth.plane_stress(), limits, cloth.limit_weight()),
    }
}

/// What the weight per modulus of a stencil is to be multiplied by \[Pa\]. What differs shares a moment, and each has its share of
/// the bend: they are as stiff as springs in a row.
fn modulus(stencil: &Stencil<'_>, materials: &[DeformableMaterial]) -> f64 {
    let of = |region: u32| modulus_of(stencil.kind, &materials[region as usize]);
    let [first, others @ ..] = stencil.regions;
    if others == [first; 3] {
        return of(first);
    }
    1.0 / stencil.mean(|region| 1.0 / of(region))
}

/// Of a plate `D/2·((1 + ν)/2·(κ₁₁ + κ₂₂)² + (1 − ν)/2·((κ₁₁ − κ₂₂)² + 4 κ₁₂²))` per area, `D = E t³/12(1 − ν²)`.
pub(super) fn modulus_of(kind: StencilKind, material: &DeformableMaterial) -> f64 {
    let nu = material.poisson_ratio;
    match kind {
        StencilKind::Stretch | StencilKind::RodBending => material.youngs_modulus,
        StencilKind::MeanCurvature => 0.5 * material.youngs_modulus / (1.0 - nu),
        StencilKind::SaddleCurvature => 0.5 * material.youngs_modulus / (1.0 + nu),
        StencilKind::Fibre => material.fibre_modulus,
    }
}

/// What keeps the length of a stencil of a body.
pub(super) fn length_energy(
    stencil: &Stencil<'_>,
    materials: &[DeformableMaterial],
    activations: &[f64],
) -> LengthEnergy {
    let weight = stencil.weight * modulus(stencil, materials);
    let material = &materials[stencil.regions[0] as usize];
    let is_stretch = stencil.kind == StencilKind::Stretch;
    let limits = material
        .strain_limits
        .filter(|_| is_stretch)
        .map(|limits| (limits.map(|l| l * stencil.length), stencil.weight * material.limit_weight()));
    let activation = || activations.get(stencil.regions[0] as usize).copied().unwrap_or(1.0);
    let length = if stencil.kind == StencilKind::Fibre { activation() } else { stencil.length };
    LengthEnergy { length, weight, limits }
}

/// Adds the forces \[N\] of a body's thin elements.
pub(super) fn add_forces(elements: &Elements<'_>, at: &Evaluation<'_>, force: &mut [Vec3]) -> Elastic {
    let Elements { model, materials, .. } = elements;
    let StiffnessDamping { stretches, ratios, .. } = at.damping;
    let mut elastic = Elastic { energy: 0.0, least_trace: 3.0, evaluated: 0 };
    for (k, (region, material)) in model.regions.iter().zip(*materials).enumerate() {
        let ratio = ratios.get(k).copied().unwrap_or(0.0);
        elastic.energy += add_triangles(region, elements, material, (stretches, ratio), at.x, force);
        elastic.evaluated += region.triangles.len();
        if elastic.energy > at.limit {
            return Elastic { energy: f64::INFINITY, ..elastic };
        }
    }
    elastic.energy += add_stencils(elements, (stretches, ratios), at.x, force);
    elastic.evaluated += model.stencils.len();
    elastic
}

/// Those of what keeps a length. `ratios` are β/h of the regions.
fn add_stencils(
    Elements { model, materials, activations }: &Elements<'_>,
    (damping, ratios): (&Stretches, &[f64]),
    x: &[Vec3],
    force: &mut [Vec3],
) -> f64 {
    let mut energy = 0.0;
    for (k, stencil) in model.stencils.iter().enumerate() {
        let length_energy = length_energy(&stencil, materials, activations);
        let b = stencil.vector(x);
        let (mut own, mut pull) = length_energy.response(&b);
        if let Some(&length) = damping.lengths.get(k) {
            let weight = stencil.mean(|region| ratios[region as usize]) * length_energy.weight;
            let damper = LengthEnergy { length, weight, limits: None };
            let (damped, drag) = damper.response(&b);
            (own, pull) = (own + damped, pull + drag);
        }
        energy += own;
        for (n, c) in stencil.terms() {
            force[n] -= pull * c;
        }
    }
    energy
}

/// Those of the triangles of a region.
fn add_triangles(
    region: &Region,
    elements: &Elements<'_>,
    material: &DeformableMaterial,
    (damping, ratio): (&Stretches, f64),
    x: &[Vec3],
    force: &mut [Vec3],
) -> f64 {
    let sheet = membrane(material);
    let mut energy = 0.0;
    for k in region.triangles.clone() {
        let triangle = &elements.model.triangles[k];
        let F = triangle.deformation_gradient(x);
        let response = sheet.evaluate(&F);
        let (mut density, mut stress) = (response.density, response.stress);
        if let Some(S) = damping.sheets.get(k) {
            // As of tetrahedra: towards the last stretch, turned as the triangle is now.
            let (extra, pull) = sheet.change_response(&F, S);
            density += ratio * extra;
            stress += pull * ratio;
        }
        energy += triangle.volume * density;
        for (&n, g) in triangle.nodes.iter().zip(&triangle.gradients) {
            force[n as usize] -= stress * g * triangle.volume;
        }
    }
    energy
}
