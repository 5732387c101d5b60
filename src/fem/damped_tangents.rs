//! Second derivatives of stiffness damping and Maxwell branches, of solids: what gradients over steps need of them. Those of what is thin
//! are in [`super::damped_thin`].
//!
//! With the stretch S at the start of the step the density is, per β/h, `μ(‖F‖² + ‖S‖²) − 2μ N(FS) + λ/2 (N(F) − tr S)²`, with the
//! sum N of the (signed) principal stretches: that of F and that of FS are isotropic, and have the modes of such energies
//! [Smith et al. 2019].

use super::damped_thin;
use super::model::Elements;
use super::solid_elements::{Law, SolidElement};
use super::stiffness_damping::StiffnessDamping;
use super::stretches::Stretches;
use super::tangents::add_products;
use crate::energy::{Mode, Principal, modes};
use crate::material::MAX_BRANCHES;
use crate::math::polar::signed_svd;
use crate::math::{Mat3, Vec3};

/// A solid element that is damped.
struct Damped<'a> {
    element: &'a SolidElement<'a>,
    region: usize,
    is_patch: bool,
    mu: f64,
    lambda: f64,
    /// Its volume, times β/h and what branches add \[m³\].
    weight: f64,
    stretch: Mat3,
    F: Mat3,
}

/// Sum of a principal stretch over another, of inverted elements, below which they count as cancelled.
const CANCELLED: f64 = 1.0e-9;

/// Calls `add(i, j, K)` with the blocks `K = −∂fᵢ/∂xⱼ` [N/m], i ≥ j, of damping at positions `x`. `sides` is memory.
pub(crate) fn add_damping_tangents(
    elements: &Elements<'_>,
    damping: &StiffnessDamping,
    x: &[Vec3],
    sides: &mut Vec<Vec3>,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    for_each_damped(elements, damping, x, |damped| {
        let SolidElement { nodes, gradients, .. } = *damped.element;
        let mut add_modes = |modes: &[Mode; 9], before: &Mat3| {
            sides.clear();
            sides.extend(modes.iter().flat_map(|m| gradients.iter().map(move |g| m.shape * (before * g))));
            add_products(nodes, &modes.map(|m| m.stiffness * damped.weight), sides, &mut add);
        };
        add_modes(&damped.modes_of_gradient(), &Mat3::identity());
        add_modes(&damped.modes_of_stretched(), &damped.stretch);
    });
    damped_thin::add_tangents(elements, damping, x, sides, add);
}

/// What a step of `h` \[s\] sets out from.
#[derive(Clone, Copy)]
pub(crate) struct DampedStep<'a> {
    pub elements: &'a Elements<'a>,
    pub damping: &'a StiffnessDamping,
    pub h: f64,
    pub x_start: &'a [Vec3],
    pub x_end: &'a [Vec3],
}

impl DampedStep<'_> {
    /// Adds what the start changes of the virtual work of damping along `z`: of positions, `z·∂f/∂xₙ`, and of each damper's stretch.
    pub fn add_by_start(&self, z: &[Vec3], of_start: &mut [Vec3], of_dampers: &mut [Stretches]) {
        let materials = self.elements.materials;
        for_each_damped(self.elements, self.damping, self.x_end, |damped| {
            let SolidElement { nodes, gradients, place, .. } = *damped.element;
            let of_stretch = damped.work_by_stretch(&damped.element.deformation_gradient(z));
            let material = &materials[damped.region];
            let whole = self.damping.ratios[damped.region];
            for (damper, branch) in of_dampers.iter_mut().zip(&material.maxwell_branches) {
                damper.add(damped.is_patch, place, &(of_stretch * (branch.resistance(self.h) / whole)));
            }
            let own = material.stiffness_damping / self.h / whole;
            if own != 0.0 {
                let F = damped.element.deformation_gradient(self.x_start);
                let of_gradient = of_deformation(&F, &(of_stretch * own));
                nodes.iter().zip(gradients).for_each(|(n, g)| of_start[*n as usize] += of_gradient * g);
            }
        });
        self.add_by_start_of_thin(z, of_start, of_dampers);
    }

    /// Goes through how the dampers give way, `D′ = (τ D + h S′)/(τ + h)`: what is with respect to D′ becomes that with respect to D; adds what is of
    /// the end and of the times.
    pub fn give_way_back(
        &self,
        of_dampers: &mut [Stretches],
        of_end: &mut [Vec3],
        of_times: &mut [[f64; MAX_BRANCHES]],
    ) {
        let (Elements { model, materials, .. }, h) = (self.elements, self.h);
        let dampers = self.damping.dampers();
        // Patches of a material that keeps no volume have dampers, too.
        let all: Vec<_> = materials.iter().map(|material| material.poisson_ratio(0.25)).collect();
        model.for_each_energy(&all, |law, element| {
            let Law { region, is_patch, .. } = *law;
            let [block, lane] = element.place;
            let F = element.deformation_gradient(self.x_end);
            let (U, _, V) = signed_svd(&F);
            let S = V * U.transpose() * F;
            let mut of_stretch = Mat3::zeros();
            for (k, of) in of_dampers.iter_mut().enumerate() {
                let time = materials[region].maxwell_branches[k].time;
                let (Some(of_damper), Some(damper)) =
                    (of.block(is_patch, block), dampers[k].block(is_patch, block))
                else {
                    continue;
                };
                let (of_damper, damper) = (of_damper.lane(lane), damper.lane(lane));
                of_stretch += of_damper * (h / (time + h));
                of_times[region][k] += of_damper.dot(&(damper - S)) * (h / (time + h).powi(2));
                of.add(is_patch, element.place, &(of_damper * (-h / (time + h))));
            }
            let of_gradient = of_deformation(&F, &of_stretch);
            let ends = element.nodes.iter().zip(element.gradients);
            ends.for_each(|(n, g)| of_end[*n as usize] += of_gradient * g);
        });
        self.give_way_back_of_thin(of_dampers, of_end, of_times);
    }
}

fn for_each_damped(
    elements: &Elements<'_>,
    damping: &StiffnessDamping,
    x: &[Vec3],
    mut with: impl FnMut(&Damped<'_>),
) {
    elements.model.for_each_energy(elements.materials, |law, element| {
        let Law { lame, region, is_patch, .. } = *law;
        let block = damping.stretches.block(is_patch, element.place[0]);
        let (Some(ratio), Some(block)) = (damping.ratios.get(region).filter(|ratio| **ratio != 0.0), block)
        else {
            return;
        };
        with(&Damped {
            element,
            region,
            is_patch,
            mu: lame.mu,
            lambda: lame.lambda,
            weight: element.volume * ratio,
            stretch: block.lane(element.place[1]),
            F: element.deformation_gradient(x),
        });
    });
}

impl Damped<'_> {
    /// The Hessian over F of `μ‖F‖² + λ/2 (N(F) − tr S)²`.
    fn modes_of_gradient(&self) -> [Mode; 9] {
        let (mu, lambda, trace) = (self.mu, self.lambda, self.stretch.trace());
        modes(&self.F, |sigma| Principal {
            density: 0.0,
            gradient: sigma * (2.0 * mu) + Vec3::repeat(lambda * (sigma.sum() - trace)),
            hessian: Mat3::from_diagonal_element(2.0 * mu) + Mat3::repeat(lambda),
        })
    }

    /// The Hessian over FS of `−2μ N(FS)`.
    fn modes_of_stretched(&self) -> [Mode; 9] {
        self.modes_of_sum(-2.0 * self.mu)
    }

    /// The Hessian over FS of `N(FS)` times a factor.
    fn modes_of_sum(&self, factor: f64) -> [Mode; 9] {
        let gradient = Vec3::repeat(factor);
        modes(&(self.F * self.stretch), |_| Principal { density: 0.0, gradient, hessian: Mat3::zeros() })
    }

    /// What the (symmetric) stretch S changes of the virtual work of damping forces, `−∂²E/∂S∂F : dF`.
    fn work_by_stretch(&self, dF: &Mat3) -> Mat3 {
        let (U, _, V) = signed_svd(&(self.F * self.stretch));
        let turned = U * V.transpose();
        let moved = dF * self.stretch;
        let modes = self.modes_of_sum(1.0);
        let turning =
            modes.iter().fold(Mat3::zeros(), |sum, m| sum + m.shape * (m.stiffness * m.shape.dot(&moved)));
        let shape = dF.tr_mul(&turned) + self.F.tr_mul(&turning);
        let (U, _, V) = signed_svd(&self.F);
        let volume = self.lambda * (U * V.transpose()).dot(dF);
        ((shape + shape.transpose()) * self.mu + Mat3::from_diagonal_element(volume)) * self.weight
    }
}

/// What is with respect to the stretch S of a deformation gradient F, symmetric, with respect to that: by `FᵀF = S²`.
fn of_deformation(F: &Mat3, of_stretch: &Mat3) -> Mat3 {
    let (U, s, V) = signed_svd(F);
    let within = V.tr_mul(&(of_stretch * V));
    let size = s.amax();
    let scaled = Mat3::from_fn(|i, j| {
        let sum = s[i] + s[j];
        if sum.abs() > CANCELLED * size { 2.0 * s[i] * within[(i, j)] / sum } else { 0.0 }
    });
    U * scaled * V.transpose()
}

#[cfg(test)]
mod tests {
    use super::super::elastic_forces::{Evaluation, add_forces};
    use super::super::model::DeformableModel;
    use super::super::tangents::add_tangents;
    use super::*;
    use crate::energy::Elasticity;
    use crate::material::DeformableMaterial;
    use crate::mesh::{Structure, TetMesh};
    use proptest::prelude::*;

    /// Forces at `x` with damping from `x_start`, at steps of 1 s.
    fn forces(elements: &Elements<'_>, x: &[Vec3], x_start: &[Vec3]) -> Vec<Vec3> {
        let mut damping = StiffnessDamping::default();
        damping.begin(elements, 1.0, x_start, None);
        let mut f = vec![Vec3::zeros(); x.len()];
        let at = Evaluation { damping: &damping, x, frame: &Mat3::identity(), limit: f64::INFINITY };
        add_forces(elements, &at, &mut f);
        f
    }

    /// A block with a bent skin, a rope and a spring, in two regions.
    fn with_thin_parts(block: &TetMesh) -> DeformableModel {
        let skinned = Structure::solid(block).with_sheet(&[[0, 1, 2], [1, 2, 5], [1, 5, 6]], 0.01).unwrap();
        let roped = skinned.rod_from(0, &[[-0.2, 0.1, 0.0], [-0.3, 0.1, 0.1]], 0.01).unwrap();
        let sprung = roped.with_spring([0, 3], 1e-3).unwrap();
        DeformableModel::from_structure(&sprung).unwrap().painted(|[_, _, z]| u32::from(z > 0.0))
    }

    fn shaken(rest: &[Vec3], shakes: &[f64]) -> Vec<Vec3> {
        let shake = |i: usize, c: usize| shakes[(3 * i + c) % shakes.len()];
        rest.iter().enumerate().map(|(i, X)| X + Vec3::from_fn(|c, _| shake(i, c))).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(30))]
        #[test]
        fn damping_has_the_derivatives_of_its_forces(
            shakes in proptest::collection::vec(-0.015..0.015f64, 61),
            before in proptest::collection::vec(-0.015..0.015f64, 59),
            beta in 0.1..2.0f64,
        ) {
            let block = TetMesh::cuboid([0.1; 3], [1, 1, 2]).unwrap();
            let in_two = DeformableModel::new(&block).painted(|[_, _, z]| u32::from(z > 0.0));
            for model in [in_two.clone(), in_two.smoothed(), with_thin_parts(&block)] {
                let material = DeformableMaterial::new(1e3, 0.3).elasticity(Elasticity::ALL[0]);
                // Of the second region the energy is the same without damping; ν = 0 has no patches.
                let materials = [material.stiffness_damping(beta), material.poisson_ratio(0.0)];
                let elements = Elements { model: &model, materials: &materials, activations: &[1.0, 1.0] };
                let (x, x_start) = (shaken(&model.rest, &shakes), shaken(&model.rest, &before));
                let z = shaken(&vec![Vec3::zeros(); x.len()], &before);
                let (n, mut product) = (x.len(), vec![Vec3::zeros(); x.len()]);
                let mut add = |i: usize, j: usize, block: &Mat3| {
                    product[i] += block * z[j];
                    if i != j {
                        product[j] += block.tr_mul(&z[i]);
                    }
                };
                let mut damping = StiffnessDamping::default();
                damping.begin(&elements, 1.0, &x_start, None);
                add_tangents(&elements, &x, false, |_| 1.0, &mut Vec::new(), &mut add);
                add_damping_tangents(&elements, &damping, &x, &mut Vec::new(), &mut add);
                let mut by_start = vec![Vec3::zeros(); n];
                let step = DampedStep { elements: &elements, damping: &damping, h: 1.0, x_start: &x_start, x_end: &x };
                step.add_by_start(&z, &mut by_start, &mut []);
                let eps = 1e-6;
                let along = |x: &[Vec3], k: f64| -> Vec<Vec3> { x.iter().zip(&z).map(|(x, z)| x + z * (k * eps)).collect() };
                let slope = |[ahead, behind]: [Vec<Vec3>; 2]| -> Vec<Vec3> {
                    ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * eps)).collect()
                };
                let of_x = slope([1.0, -1.0].map(|k| forces(&elements, &along(&x, k), &x_start)));
                let size = product.iter().map(|p| p.amax()).fold(0.0, f64::max);
                for (product, slope) in product.iter().zip(&of_x) {
                    prop_assert!((product + slope).amax() < 1e-5 * size, "{product} {slope}");
                }
                // Symmetric by what the start is moved along: any direction will do.
                let of_start = slope([1.0, -1.0].map(|k| forces(&elements, &x, &along(&x_start, k))));
                let work = |f: &[Vec3]| f.iter().zip(&z).map(|(f, z)| f.dot(z)).sum::<f64>();
                let (ours, theirs) = (work(&by_start), work(&of_start));
                prop_assert!((ours - theirs).abs() < 1e-5 * size * z.iter().map(|z| z.amax()).sum::<f64>(), "{ours} {theirs}");
            }
        }
    }
}
