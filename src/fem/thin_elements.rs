//! Sheets, rods, springs and fibres: their elements, made of a structure, and their energy and forces.

use super::elements::{Stencil, TriangleElement};
use super::model::Elements;
use crate::energy::membrane::{Membrane, polar_factor};
use crate::energy::stencil::{LengthEnergy, StencilKind};
use crate::material::DeformableMaterial;
use crate::math::{Mat2, Vec3};

/// Stiffness damping of thin elements over one step: how they were stretched at its start.
#[derive(Clone, Debug, Default)]
pub(crate) struct ThinDamping {
    stretches: Vec<Mat2>,
    lengths: Vec<f64>,
}

impl ThinDamping {
    /// At `x`, or what that and `before` amount to in a step of the second order.
    pub fn begin(
        &mut self,
        triangles: &[TriangleElement],
        stencils: &[Stencil],
        beta: f64,
        x: &[Vec3],
        before: Option<&[Vec3]>,
    ) {
        self.stretches.clear();
        self.lengths.clear();
        if beta > 0.0 {
            let stretch = |t: &TriangleElement, x: &[Vec3]| {
                let F = t.deformation_gradient(x);
                let S = polar_factor(&F).tr_mul(&F);
                (S + S.transpose()) * 0.5
            };
            self.stretches.extend(triangles.iter().map(|t| {
                let now = stretch(t, x);
                before.map_or(now, |before| now + (now - stretch(t, before)) / 3.0)
            }));
            self.lengths.extend(stencils.iter().map(|s| {
                let now = s.vector(x).norm();
                before.map_or(now, |before| now + (now - s.vector(before).norm()) / 3.0)
            }));
        }
    }
}

/// The energy of a material's sheets.
pub(super) fn membrane(material: &DeformableMaterial) -> Membrane {
    Membrane::new(material.lame(), material.strain_limits, material.limit_weight())
}

/// What the weight per modulus of a stencil is to be multiplied by \[Pa\].
fn modulus(kind: StencilKind, material: &DeformableMaterial) -> f64 {
    let nu = material.poisson_ratio;
    match kind {
        StencilKind::Stretch | StencilKind::RodBending => material.youngs_modulus,
        StencilKind::SheetBending => material.youngs_modulus / (1.0 - nu * nu),
        StencilKind::Fibre => material.fibre_modulus,
    }
}

/// What keeps the length of a stencil of a body.
pub(super) fn length_energy(
    stencil: &Stencil,
    material: &DeformableMaterial,
    activation: f64,
) -> LengthEnergy {
    let weight = stencil.weight * modulus(stencil.kind, material);
    let is_stretch = stencil.kind == StencilKind::Stretch;
    let limits = material
        .strain_limits
        .filter(|_| is_stretch)
        .map(|limits| (limits.map(|l| l * stencil.length), stencil.weight * material.limit_weight()));
    let length = if stencil.kind == StencilKind::Fibre { activation } else { stencil.length };
    LengthEnergy { length, weight, limits }
}

/// Adds the forces \[N\] of a body's thin elements at positions `x`; returns their energy \[J\]. `ratio` is β/h.
pub(super) fn add_forces(
    elements: &Elements<'_>,
    damping: &ThinDamping,
    ratio: f64,
    x: &[Vec3],
    force: &mut [Vec3],
) -> f64 {
    let Elements { model, material, activation } = elements;
    let sheet = membrane(material);
    let lame = material.lame();
    let mut energy = 0.0;
    for (k, triangle) in model.triangles.iter().enumerate() {
        let F = triangle.deformation_gradient(x);
        let response = sheet.evaluate(&F);
        let (mut density, mut stress) = (response.density, response.stress);
        if let Some(S) = damping.stretches.get(k) {
            // As of tetrahedra: towards the last stretch, turned as the triangle is now.
            let deviation = F - polar_factor(&(F * S)) * S;
            density += ratio * lame.mu * deviation.norm_squared();
            stress += deviation * (2.0 * ratio * lame.mu);
        }
        energy += triangle.volume * density;
        for (&n, g) in triangle.nodes.iter().zip(&triangle.gradients) {
            force[n as usize] -= stress * g * triangle.volume;
        }
    }
    for (k, stencil) in model.stencils.iter().enumerate() {
        let length_energy = length_energy(stencil, material, *activation);
        let b = stencil.vector(x);
        let (mut own, mut pull) = length_energy.response(&b);
        if let Some(&length) = damping.lengths.get(k) {
            let damper = LengthEnergy { length, weight: ratio * length_energy.weight, limits: None };
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
