//! Second derivatives of stiffness damping and Maxwell branches, of sheets and of what keeps a length: those of solids
//! ([`super::damped_tangents`]) with the two principal stretches of a triangle, or the one of a stencil.

use super::damped_tangents::DampedStep;
use super::elements::TriangleElement;
use super::model::Elements;
use super::stencils::Stencil;
use super::stiffness_damping::StiffnessDamping;
use super::stretches::Stretches;
use super::tangents::add_products;
use super::thin_elements::{length_energy, membrane};
use crate::energy::membrane::{MembraneMode, isotropic_modes, polar_factor, principal_axes};
use crate::energy::stencil::LengthEnergy;
use crate::material::{DeformableMaterial, MAX_BRANCHES};
use crate::math::{Mat2, Mat3, Mat3x2, Vec3};

/// A triangle that is damped.
struct DampedTriangle<'a> {
    element: &'a TriangleElement,
    place: usize,
    mu: f64,
    lambda: f64,
    /// Its volume, times β/h and what branches add \[m³\].
    weight: f64,
    stretch: Mat2,
    F: Mat3x2,
}

/// A stencil that is damped, its damper as an energy of its own.
struct DampedStencil<'a> {
    stencil: Stencil<'a>,
    place: usize,
    /// β/h and what branches add, in the mean of its regions.
    whole: f64,
    damper: LengthEnergy,
}

/// Calls `add(i, j, K)` with the blocks `K = −∂fᵢ/∂xⱼ` [N/m], i ≥ j, of damping at positions `x`. `sides` is memory.
pub(super) fn add_tangents(
    elements: &Elements<'_>,
    damping: &StiffnessDamping,
    x: &[Vec3],
    sides: &mut Vec<Vec3>,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    for_each_triangle(elements, damping, x, |damped| {
        let TriangleElement { nodes, gradients, .. } = damped.element;
        let mut add_modes = |modes: &[MembraneMode; 6], before: &Mat2| {
            sides.clear();
            sides.extend(modes.iter().flat_map(|m| gradients.map(|g| m.shape * (before * g))));
            add_products(nodes, &modes.map(|m| m.stiffness * damped.weight), sides, &mut add);
        };
        add_modes(&damped.modes_of_gradient(), &Mat2::identity());
        add_modes(&damped.modes_of_sum(-2.0 * damped.mu), &damped.stretch);
    });
    for_each_stencil(elements, damping, |DampedStencil { stencil, damper, .. }| {
        let K = damper.tangent(&stencil.vector(x));
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms().filter(|(j, _)| *j <= i) {
                add(i, j, &(K * (a * b)));
            }
        }
    });
}

impl DampedStep<'_> {
    /// As [`DampedStep::add_by_start`], of what is thin.
    pub(super) fn add_by_start_of_thin(
        &self,
        z: &[Vec3],
        of_start: &mut [Vec3],
        of_dampers: &mut [Stretches],
    ) {
        let Self { elements, damping, h, x_start, x_end } = *self;
        let materials = elements.materials;
        for_each_triangle(elements, damping, x_end, |damped| {
            let TriangleElement { nodes, gradients, region, .. } = damped.element;
            let of_stretch = damped.work_by_stretch(&damped.element.deformation_gradient(z));
            let (material, whole) = (&materials[*region as usize], damping.ratios[*region as usize]);
            for (damper, branch) in of_dampers.iter_mut().zip(&material.maxwell_branches) {
                damper.sheets[damped.place] += of_stretch * (branch.resistance(h) / whole);
            }
            let own = of_stretch * (material.stiffness_damping / h / whole);
            let of_gradient = of_deformation(&damped.element.deformation_gradient(x_start), &own);
            nodes.iter().zip(gradients).for_each(|(n, g)| of_start[*n as usize] += of_gradient * g);
        });
        for_each_stencil(elements, damping, |DampedStencil { stencil, place, whole, damper }| {
            let (b, moved) = (stencil.vector(x_end), stencil.vector(z));
            // Forces pull by w (|b| − L) b/|b|.
            let of_length = damper.weight * direction(&b).dot(&moved);
            let mean = |of: &dyn Fn(&DeformableMaterial) -> f64| {
                stencil.mean(|region| of(&materials[region as usize])) / whole
            };
            for (k, of_damper) in of_dampers.iter_mut().enumerate() {
                of_damper.lengths[place] += of_length * mean(&|m| m.maxwell_branches[k].resistance(h));
            }
            let own = of_length * mean(&|m| m.stiffness_damping / h);
            add_along(&stencil, &(direction(&stencil.vector(x_start)) * own), of_start);
        });
    }

    /// As [`DampedStep::give_way_back`], of what is thin.
    pub(super) fn give_way_back_of_thin(
        &self,
        of_dampers: &mut [Stretches],
        of_end: &mut [Vec3],
        of_times: &mut [[f64; MAX_BRANCHES]],
    ) {
        let (Elements { model, materials, .. }, h) = (self.elements, self.h);
        let dampers = self.damping.dampers();
        for (place, element) in model.triangles.iter().enumerate() {
            let region = element.region as usize;
            let F = element.deformation_gradient(self.x_end);
            let S = polar_factor(&F).tr_mul(&F);
            let mut of_stretch = Mat2::zeros();
            for (k, of) in of_dampers.iter_mut().enumerate() {
                let share = h / (materials[region].maxwell_branches[k].time + h);
                let of = &mut of.sheets[place];
                of_stretch += *of * share;
                of_times[region][k] += of.dot(&(dampers[k].sheets[place] - S)) * share * share / h;
                *of *= 1.0 - share;
            }
            let of_gradient = of_deformation(&F, &of_stretch);
            let ends = element.nodes.iter().zip(&element.gradients);
            ends.for_each(|(n, g)| of_end[*n as usize] += of_gradient * g);
        }
        for (place, stencil) in model.stencils.iter().enumerate() {
            let b = stencil.vector(self.x_end);
            let mut of_length = 0.0;
            for (k, of) in of_dampers.iter_mut().enumerate() {
                let time = stencil.mean(|region| materials[region as usize].maxwell_branches[k].time);
                let share = h / (time + h);
                let of = &mut of.lengths[place];
                of_length += *of * share;
                let of_time = *of * (dampers[k].lengths[place] - b.norm()) * share * share / h;
                stencil.regions.iter().for_each(|region| of_times[*region as usize][k] += 0.25 * of_time);
                *of *= 1.0 - share;
            }
            add_along(&stencil, &(direction(&b) * of_length), of_end);
        }
    }
}

/// Of what has no length none: it changes alike to both sides.
fn direction(b: &Vec3) -> Vec3 {
    b.try_normalize(0.0).unwrap_or_default()
}

fn add_along(stencil: &Stencil<'_>, of_vector: &Vec3, out: &mut [Vec3]) {
    stencil.terms().for_each(|(n, c)| out[n] += of_vector * c);
}

fn for_each_triangle(
    elements: &Elements<'_>,
    damping: &StiffnessDamping,
    x: &[Vec3],
    mut with: impl FnMut(&DampedTriangle<'_>),
) {
    for (place, element) in elements.model.triangles.iter().enumerate() {
        let region = element.region as usize;
        let moduli = membrane(&elements.materials[region]).moduli();
        let ratio = damping.ratios.get(region).copied().unwrap_or(0.0);
        if let (Some([mu, lambda]), Some(stretch)) = (moduli, damping.stretches.sheets.get(place))
            && ratio != 0.0
        {
            let (weight, F) = (element.volume * ratio, element.deformation_gradient(x));
            with(&DampedTriangle { element, place, mu, lambda, weight, stretch: *stretch, F });
        }
    }
}

fn for_each_stencil(
    elements: &Elements<'_>,
    damping: &StiffnessDamping,
    mut with: impl FnMut(DampedStencil<'_>),
) {
    let Elements { model, materials, activations } = elements;
    for ((place, stencil), &length) in model.stencils.iter().enumerate().zip(&damping.stretches.lengths) {
        let whole = stencil.mean(|region| damping.ratios[region as usize]);
        if whole != 0.0 {
            let weight = whole * length_energy(&stencil, materials, activations).weight;
            with(DampedStencil {
                stencil,
                place,
                whole,
                damper: LengthEnergy { length, weight, limits: None },
            });
        }
    }
}

impl DampedTriangle<'_> {
    /// The Hessian over F of `μ‖F‖² + λ/2 (N(F) − tr S)²`, N the sum of the principal stretches.
    fn modes_of_gradient(&self) -> [MembraneMode; 6] {
        let (mu, lambda, trace) = (self.mu, self.lambda, self.stretch.trace());
        let curvature = Mat2::from_diagonal_element(2.0 * mu) + Mat2::repeat(lambda);
        isotropic_modes(&self.F, |s| {
            (s.map(|own| 2.0 * mu * own + lambda * (s[0] + s[1] - trace)), curvature)
        })
    }

    /// The Hessian over FS of `N(FS)` times a factor.
    fn modes_of_sum(&self, factor: f64) -> [MembraneMode; 6] {
        isotropic_modes(&(self.F * self.stretch), |_| ([factor; 2], Mat2::zeros()))
    }

    /// What the (symmetric) stretch S changes of the virtual work of damping forces, `−∂²E/∂S∂F : dF`.
    fn work_by_stretch(&self, dF: &Mat3x2) -> Mat2 {
        let turned = polar_factor(&(self.F * self.stretch));
        let moved = dF * self.stretch;
        let modes = self.modes_of_sum(1.0);
        let turning =
            modes.iter().fold(Mat3x2::zeros(), |sum, m| sum + m.shape * (m.stiffness * m.shape.dot(&moved)));
        let shape = dF.tr_mul(&turned) + self.F.tr_mul(&turning);
        let volume = self.lambda * polar_factor(&self.F).dot(dF);
        ((shape + shape.transpose()) * self.mu + Mat2::from_diagonal_element(volume)) * self.weight
    }
}

/// What is with respect to the stretch S of a deformation gradient F, symmetric, with respect to that: by `FᵀF = S²`.
fn of_deformation(F: &Mat3x2, of_stretch: &Mat2) -> Mat3x2 {
    let (U, s, V) = principal_axes(F);
    let within = V.tr_mul(&(of_stretch * V));
    let sum = |i: usize, j: usize| (s[i] + s[j]).max(f64::MIN_POSITIVE);
    let scaled = Mat2::from_fn(|i, j| 2.0 * s[i] * within[(i, j)] / sum(i, j));
    (U[0] * scaled.row(0) + U[1] * scaled.row(1)) * V.transpose()
}
