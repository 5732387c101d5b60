//! Elements as compliant constraints, satisfied one after the other: extended position-based dynamics [Macklin et al. 2016],
//! with the compliance that the typed stiffness is.
//!
//! The constraint of an element is its strain; its multiplier S is the stress that it exerts in its own frame R, none at the start of
//! a step: first Piola–Kirchhoff `R S`. One look at an element finds where stress and multiplier agree, to first order and with the
//! others as they are: `ΔS + V H(ΔS K) = RᵀP(F) − S`, with `K = Σ w g gᵀ`, w the displacement of a node per force, and H the
//! stiffness against strain without its negative part; then `x ← x − w V R ΔS g`. With one scalar C of energy C²/2α in the place
//! of the strain that is `Δλ = (−C − αλ)/(α + ∇Cᵀ w ∇C)`, the update of the paper.
//!
//! As there, what an element has pushed stays as it was pushed when the element turns on within the step: sweeps end where all
//! agree, which is near the minimiser of the step, not at it.

use super::StiffnessDamping;
use super::model::Elements;
use super::solid_elements::{Law, SolidElement};
use super::stiffness_damping::damping_response;
use super::thin_elements::{length_energy, membrane};
use crate::energy::membrane::polar_factor;
use crate::energy::stencil::LengthEnergy;
use crate::energy::{ElementEnergy, modes, with_energy};
use crate::math::lanes::{LANES, Lane, LaneMat3};
use crate::math::polar::polar_rotation;
use crate::math::{Mat2, Mat3, Mat3x2, Vec3};
use nalgebra::{Const, DimMin, SMatrix, SVector};
use std::f64::consts::FRAC_1_SQRT_2;

/// Symmetric stresses \[Pa\] that the elements of a body exert, in their own frames and the order in which they are swept; of stencils forces \[N\]
/// times the unit of their coefficients: along their vector, or what they pull at one that wants to vanish.
#[derive(Clone, Debug, Default)]
pub(crate) struct ElementMultipliers {
    solids: Vec<SVector<f64, 6>>,
    triangles: Vec<SVector<f64, 3>>,
    stencils: Vec<Vec3>,
}

impl ElementMultipliers {
    /// None of them pulls.
    pub fn begin(&mut self, elements: &Elements<'_>) {
        let mut solids = 0;
        elements.model.for_each_energy(elements.materials, |_, _| solids += 1);
        self.solids.clear();
        self.solids.resize(solids, SVector::zeros());
        self.triangles.clear();
        self.triangles.resize(elements.model.triangles.len(), SVector::zeros());
        self.stencils.clear();
        self.stencils.resize(elements.model.stencils.len(), Vec3::zeros());
    }

    /// Looks at every element once; `w` is how far a force on a node moves it [m/N], zero of what is pinned.
    pub fn sweep(&mut self, elements: &Elements<'_>, damping: &StiffnessDamping, w: &[f64], x: &mut [Vec3]) {
        let mut solids = self.solids.iter_mut();
        elements.model.for_each_energy(elements.materials, |law, element| {
            if let Some(multiplier) = solids.next() {
                relax_solid(law, element, damping, w, x, multiplier);
            }
        });
        self.sweep_triangles(elements, damping, w, x);
        self.sweep_stencils(elements, damping, w, x);
    }

    /// Elastic energy \[J\] of strains that would exert them, by the stiffness at rest.
    pub fn energy(&self, elements: &Elements<'_>) -> f64 {
        let Elements { model, materials, activations } = elements;
        let (mut energy, mut solids) = (0.0, self.solids.iter());
        let mut compliance: Option<(usize, bool, SMatrix<f64, 6, 6>)> = None;
        model.for_each_energy(materials, |law, element| {
            let of =
                compliance.filter(|(region, is_patch, _)| (*region, *is_patch) == (law.region, law.is_patch));
            let (.., C) = of.unwrap_or_else(|| {
                let (material, lame) = (law.material, law.lame);
                let modes =
                    with_energy!(material, lame, energy => modes(&Mat3::identity(), |s| energy.principal(s)));
                let modes = modes.map(|mode| (mode.stiffness, mode.shape));
                (law.region, law.is_patch, inverse(&stiffness(&SOLID_STRAINS, &modes)))
            });
            compliance = Some((law.region, law.is_patch, C));
            energy += solids.next().map_or(0.0, |S| 0.5 * element.volume * (C * S).dot(S));
        });
        for (triangle, S) in model.triangles.iter().zip(&self.triangles) {
            let sheet = membrane(&materials[triangle.region as usize]);
            let modes = sheet.modes(&Mat3x2::identity()).map(|mode| (mode.stiffness, mode.shape));
            let strains = SHEET_STRAINS.map(|E| Mat3x2::identity() * E);
            energy += 0.5 * triangle.volume * (inverse(&stiffness(&strains, &modes)) * S).dot(S);
        }
        for (stencil, S) in model.stencils.iter().zip(&self.stencils) {
            let weight = length_energy(&stencil, materials, activations).weight;
            energy += if weight > 0.0 { 0.5 * S.norm_squared() / weight } else { 0.0 };
        }
        energy
    }

    /// Adds what they push the nodes with at positions `x` \[N\].
    pub fn add_forces(&self, elements: &Elements<'_>, x: &[Vec3], force: &mut [Vec3]) {
        let mut solids = self.solids.iter();
        elements.model.for_each_energy(elements.materials, |_, element| {
            let Some(S) = solids.next() else { return };
            let frame = polar_rotation(&deformation_gradient(element, x));
            let stress = SOLID_STRAINS.iter().zip(S.iter()).fold(Mat3::zeros(), |sum, (E, s)| sum + E * *s);
            for (&n, g) in element.nodes.iter().zip(element.gradients) {
                force[n as usize] -= frame * stress * g * element.volume;
            }
        });
        for (triangle, S) in elements.model.triangles.iter().zip(&self.triangles) {
            let frame = polar_factor(&triangle.deformation_gradient(x));
            let stress = SHEET_STRAINS.iter().zip(S.iter()).fold(Mat2::zeros(), |sum, (E, s)| sum + E * *s);
            for (&n, g) in triangle.nodes.iter().zip(&triangle.gradients) {
                force[n as usize] -= frame * stress * g * triangle.volume;
            }
        }
        for (stencil, S) in elements.model.stencils.iter().zip(&self.stencils) {
            let own = length_energy(&stencil, elements.materials, elements.activations);
            let pull = length_direction(&own, &stencil.vector(x)).map_or(*S, |direction| direction * S.x);
            stencil.terms().for_each(|(n, c)| force[n] -= pull * c);
        }
    }

    fn sweep_triangles(
        &mut self,
        elements: &Elements<'_>,
        damping: &StiffnessDamping,
        w: &[f64],
        x: &mut [Vec3],
    ) {
        for (k, (triangle, multiplier)) in
            elements.model.triangles.iter().zip(&mut self.triangles).enumerate()
        {
            let sheet = membrane(&elements.materials[triangle.region as usize]);
            let ratio = damping.ratios.get(triangle.region as usize).copied().unwrap_or(0.0);
            let F = triangle.deformation_gradient(x);
            if !F.iter().all(|c| c.is_finite()) {
                continue;
            }
            let mut stress = sheet.evaluate(&F).stress;
            if let Some(S) = damping.stretches.sheets.get(k) {
                stress += sheet.change_response(&F, S).1 * ratio;
            }
            let scale = triangle.volume * (1.0 + ratio);
            let modes = sheet.modes(&F).map(|mode| (mode.stiffness * scale, mode.shape));
            let K = response(&triangle.nodes, &triangle.gradients, w);
            let frame = polar_factor(&F);
            let push = relax(&stress, &frame, &SHEET_STRAINS, &modes, &K, multiplier);
            for (&n, g) in triangle.nodes.iter().zip(&triangle.gradients) {
                x[n as usize] -= push * g * (triangle.volume * w[n as usize]);
            }
        }
    }

    fn sweep_stencils(
        &mut self,
        elements: &Elements<'_>,
        damping: &StiffnessDamping,
        w: &[f64],
        x: &mut [Vec3],
    ) {
        let Elements { model, materials, activations } = elements;
        for (k, (stencil, multiplier)) in model.stencils.iter().zip(&mut self.stencils).enumerate() {
            let own = length_energy(&stencil, materials, activations);
            let b = stencil.vector(x);
            let (mut pull, mut tangent) = (own.response(&b).1, own.tangent(&b));
            if let Some(&length) = damping.stretches.lengths.get(k) {
                let weight = stencil.mean(|region| damping.ratios[region as usize]) * own.weight;
                let damper = LengthEnergy { length, weight, limits: None };
                pull += damper.response(&b).1;
                tangent += damper.tangent(&b);
            }
            let moved: f64 = stencil.terms().map(|(n, c)| c * c * w[n]).sum();
            let push = if let Some(direction) = length_direction(&own, &b) {
                let along = (tangent * direction).dot(&direction).max(0.0);
                let change = (pull.dot(&direction) - multiplier.x) / (1.0 + along * moved);
                multiplier.x += change;
                direction * change
            } else {
                // A vector that wants to vanish is resisted alike in all directions.
                let change = (pull - *multiplier) / (1.0 + tangent.trace() / 3.0 * moved);
                *multiplier += change;
                change
            };
            stencil.terms().for_each(|(n, c)| x[n] -= push * (c * w[n]));
        }
    }
}

fn relax_solid(
    law: &Law<'_>,
    element: &SolidElement<'_>,
    damping: &StiffnessDamping,
    w: &[f64],
    x: &mut [Vec3],
    multiplier: &mut SVector<f64, 6>,
) {
    let SolidElement { nodes, gradients, volume, place: [block, lane] } = *element;
    let F = deformation_gradient(element, x);
    if !F.iter().all(|c| c.is_finite()) {
        return;
    }
    let mut four = LaneMat3::default();
    (0..LANES).for_each(|i| four.set_lane(i, &F));
    let (material, lame) = (law.material, law.lame);
    let (mut response_of, modes) = with_energy!(material, lame, energy => {
        (energy.evaluate(&four), modes(&F, |s| energy.principal(s)))
    });
    let ratio = damping.ratios.get(law.region).copied().unwrap_or(0.0);
    let stretches = if law.is_patch { &damping.stretches.patches } else { &damping.stretches.solid };
    if let Some(stretch) = stretches.get(block) {
        let (_, stress) = damping_response(lame, stretch, &four, &response_of.rotation);
        response_of.stress = response_of.stress.plus_scaled(&stress, Lane::splat(ratio));
    }
    let scale = volume * (1.0 + ratio);
    let modes = modes.map(|mode| (mode.stiffness * scale, mode.shape));
    let K = response(nodes, gradients, w);
    let (stress, frame) = (response_of.stress.lane(lane), response_of.rotation.lane(lane));
    let push = relax(&stress, &frame, &SOLID_STRAINS, &modes, &K, multiplier);
    for (&n, g) in nodes.iter().zip(gradients) {
        x[n as usize] -= push * g * (volume * w[n as usize]);
    }
}

/// Stiffness of the modes against strains of these shapes, without its negative part.
fn stiffness<const C: usize, const M: usize, const N: usize>(
    shapes: &[SMatrix<f64, 3, C>; M],
    modes: &[(f64, SMatrix<f64, 3, C>); N],
) -> SMatrix<f64, M, M> {
    let mut H = SMatrix::<f64, M, M>::zeros();
    for (stiffness, mode) in modes.iter().filter(|(stiffness, _)| *stiffness > 0.0) {
        let along = SVector::<f64, M>::from_fn(|j, _| mode.dot(&shapes[j]));
        H += along * along.transpose() * *stiffness;
    }
    H
}

/// The inverse, as good as it gets where nothing resists.
fn inverse<const M: usize>(H: &SMatrix<f64, M, M>) -> SMatrix<f64, M, M> {
    let shifted = H + SMatrix::<f64, M, M>::identity() * (SOFTEST * H.trace());
    shifted.cholesky().map_or(SMatrix::zeros(), |factor| factor.inverse())
}

/// Along the vector of a stencil that keeps a length; none of one that wants to vanish, or that has no direction.
fn length_direction(own: &LengthEnergy, b: &Vec3) -> Option<Vec3> {
    let direction = b.normalize();
    (own.length > 0.0 && direction.iter().all(|c| c.is_finite())).then_some(direction)
}

fn deformation_gradient(element: &SolidElement<'_>, x: &[Vec3]) -> Mat3 {
    // Against one of the nodes: far from the origin, sums of gradients that cancel would not.
    let first = x[element.nodes[0] as usize];
    let edges = element.nodes.iter().zip(element.gradients);
    edges.fold(Mat3::zeros(), |F, (&n, g)| F + (x[n as usize] - first) * g.transpose())
}

/// `K = Σ w g gᵀ`.
fn response<const C: usize>(nodes: &[u32], gradients: &[SVector<f64, C>], w: &[f64]) -> SMatrix<f64, C, C> {
    nodes.iter().zip(gradients).fold(SMatrix::zeros(), |K, (&n, g)| K + g * g.transpose() * w[n as usize])
}

/// Part of a stiffness that counts as none: patches resist in one way of six.
const SOFTEST: f64 = 1.0e-9;

/// Orthonormal symmetric matrices.
const SOLID_STRAINS: [Mat3; 6] = [
    Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    Mat3::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
    Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    Mat3::new(0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2, 0.0, 0.0, 0.0, 0.0, 0.0),
    Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2, 0.0),
    Mat3::new(0.0, 0.0, FRAC_1_SQRT_2, 0.0, 0.0, 0.0, FRAC_1_SQRT_2, 0.0, 0.0),
];
const SHEET_STRAINS: [Mat2; 3] = [
    Mat2::new(1.0, 0.0, 0.0, 0.0),
    Mat2::new(0.0, 0.0, 0.0, 1.0),
    Mat2::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0),
];

/// Changes a multiplier, in the coordinates of the `strains`, towards the stress at the element's state; gives `R ΔS`. `modes` are
/// stiffnesses times V and shapes.
fn relax<const C: usize, const M: usize, const N: usize>(
    stress: &SMatrix<f64, 3, C>,
    frame: &SMatrix<f64, 3, C>,
    strains: &[SMatrix<f64, C, C>; M],
    modes: &[(f64, SMatrix<f64, 3, C>); N],
    K: &SMatrix<f64, C, C>,
    multiplier: &mut SVector<f64, M>,
) -> SMatrix<f64, 3, C>
where
    Const<M>: DimMin<Const<M>, Output = Const<M>>,
{
    let shapes = strains.map(|E| frame * E);
    let moved = shapes.map(|shape| shape * K);
    let H = stiffness(&shapes, modes);
    let G = SMatrix::<f64, M, M>::from_fn(|j, l| shapes[j].dot(&moved[l]));
    let residual = SVector::<f64, M>::from_fn(|j, _| shapes[j].dot(stress)) - *multiplier;
    // The identity and a product of two positive semi-definite matrices: no eigenvalue below one.
    let change = (SMatrix::identity() + H * G).lu().solve(&residual).unwrap_or_else(SVector::zeros);
    *multiplier += change;
    shapes.iter().zip(change.iter()).fold(SMatrix::zeros(), |sum, (shape, a)| sum + shape * *a)
}
