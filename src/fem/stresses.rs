//! Stress, strain and energy of each element: what the forces are made of, kept apart.
//!
//! Cauchy stress `σ = P Fᵀ / det F`. A tetrahedron of a smoothed body has the mean of those around its edges, of shape, and that
//! of its patch, of volume: together they are worth what the domains are, `Σ V_e σ_e = Σ V_d σ_d`.

use super::elements::TriangleElement;
use super::model::DeformableModel;
use super::regions::Region;
use super::thin_elements::{length_energy, membrane};
use crate::energy::stencil::StencilKind;
use crate::energy::{ElementEnergy, Lame, with_energy};
use crate::material::DeformableMaterial;
use crate::math::lanes::{LANES, LaneMat3};
use crate::math::{Mat3, Vec3};
use std::collections::HashMap;

/// Of one tetrahedron.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ElementState {
    /// Deformation gradient.
    pub F: Mat3,
    /// Cauchy stress \[Pa\].
    pub stress: Mat3,
    /// Elastic energy \[J\].
    pub energy: f64,
    /// Volume at rest \[m³\].
    pub volume: f64,
}

/// Of each tetrahedron, in the order of the model's.
pub(crate) fn element_states(
    model: &DeformableModel,
    materials: &[DeformableMaterial],
    x: &[Vec3],
) -> Vec<ElementState> {
    if !model.is_solid() {
        return Vec::new();
    }
    let mut states: Vec<ElementState> = model.tetrahedra.iter().map(|tet| at_rest(model, tet, x)).collect();
    for (region, material) in model.regions.iter().zip(materials) {
        let own = &mut states[region.tetrahedra.clone()];
        if model.is_smoothed() {
            add_domains(model, region, material, own);
        } else {
            let gradients: Vec<Mat3> = own.iter().map(|state| state.F).collect();
            for (state, (density, stress)) in
                own.iter_mut().zip(responses(material, material.lame(), &gradients))
            {
                (state.energy, state.stress) = (density * state.volume, stress);
            }
        }
    }
    states
}

/// Cauchy stress \[Pa\] in the middle plane of each triangle, in the order of the model's: force per area of the section as it is
/// across at rest, `P Fᵀ` over the ratio of areas.
pub(crate) fn sheet_stresses(
    model: &DeformableModel,
    materials: &[DeformableMaterial],
    x: &[Vec3],
) -> Vec<Mat3> {
    let stress = |triangle: &TriangleElement| {
        let F = triangle.deformation_gradient(x);
        let P = membrane(&materials[triangle.region as usize]).evaluate(&F).stress;
        let stress = P * F.transpose() / F.column(0).cross(&F.column(1)).norm().max(FLATTEST);
        (stress + stress.transpose()) * 0.5
    };
    model.triangles.iter().map(stress).collect()
}

/// Of each segment of the rods its tension \[N\], in the order of the model's; and the moments \[N·m\] at the nodes where they bend.
pub(crate) fn section_forces(
    model: &DeformableModel,
    materials: &[DeformableMaterial],
    x: &[Vec3],
) -> (Vec<f64>, Vec<(u32, Vec3)>) {
    let (mut tensions, mut moments) = (Vec::new(), Vec::new());
    for stencil in model.stencils.iter() {
        let b = stencil.vector(x);
        let pull = length_energy(&stencil, materials, &[]).response(&b).1;
        match stencil.kind {
            // Over the length at rest, as energy has it: the pull is along b.
            StencilKind::Stretch => tensions.push(pull.dot(&b) / b.norm().max(f64::MIN_POSITIVE)),
            StencilKind::RodBending => {
                let [before, at, after] = [0, 1, 2].map(|k| x[stencil.nodes[k] as usize]);
                let along = ((at - before).normalize() + (after - at).normalize()).normalize();
                moments.push((stencil.nodes[1], along.cross(&pull)));
            }
            _ => {}
        }
    }
    // Those of springs come after those of rods.
    tensions.truncate(model.rod_segments().count());
    (tensions, moments)
}

/// What the domains of a region contribute to its tetrahedra.
fn add_domains(
    model: &DeformableModel,
    region: &Region,
    material: &DeformableMaterial,
    states: &mut [ElementState],
) {
    let [shape, volume] = material.lame().split();
    let mut names = HashMap::new();
    let mut name = |a: u32, b: u32| {
        let next = names.len();
        *names.entry([a.min(b), a.max(b)]).or_insert(next)
    };
    const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let tetrahedra = &model.tetrahedra[region.tetrahedra.clone()];
    let edges: Vec<_> = tetrahedra.iter().map(|t| EDGES.map(|[i, j]| name(t[i], t[j]))).collect();
    add_smoothed(material, shape, &edges, states);
    let own = model.patches_of(region).into_iter().map(|patch| [patch as usize]);
    add_smoothed(&material.without_limits(), volume, &own.collect::<Vec<_>>(), states);
}

fn at_rest(model: &DeformableModel, tet: &[u32; 4], x: &[Vec3]) -> ElementState {
    let edges = |points: &[Vec3]| {
        let [a, b, c, d] = tet.map(|n| points[n as usize]);
        Mat3::from_columns(&[b - a, c - a, d - a])
    };
    let before = edges(&model.rest);
    // A valid mesh has no flat elements.
    let F = edges(x) * before.try_inverse().unwrap_or_else(Mat3::identity);
    ElementState { F, volume: before.determinant() / 6.0, ..ElementState::default() }
}

/// Adds what domains contribute, each the mean of the tetrahedra that name it.
fn add_smoothed<const N: usize>(
    material: &DeformableMaterial,
    lame: Lame,
    names: &[[usize; N]],
    states: &mut [ElementState],
) {
    let count = names.iter().flatten().max().map_or(0, |last| last + 1);
    let mut means = vec![(Mat3::zeros(), 0.0); count];
    for (own, state) in names.iter().zip(&*states) {
        for name in own {
            means[*name].0 += state.F * state.volume;
            means[*name].1 += state.volume;
        }
    }
    let gradients: Vec<Mat3> = means.iter().map(|(sum, volume)| sum / *volume).collect();
    let responses = responses(material, lame, &gradients);
    for (own, state) in names.iter().zip(states) {
        for name in own {
            let (density, stress) = responses[*name];
            state.energy += density * state.volume / N as f64;
            state.stress += stress / N as f64;
        }
    }
}

/// Least volume ratio by which a stress is divided: what is flatter or inverted has no stress that means something.
const FLATTEST: f64 = 1.0e-3;

/// Energy densities [J/m³] and Cauchy stresses \[Pa\].
fn responses(material: &DeformableMaterial, lame: Lame, gradients: &[Mat3]) -> Vec<(f64, Mat3)> {
    with_energy!(material, lame, energy => respond(energy, gradients))
}

fn respond(energy: impl ElementEnergy, gradients: &[Mat3]) -> Vec<(f64, Mat3)> {
    let mut out = Vec::with_capacity(gradients.len());
    for block in gradients.chunks(LANES) {
        let mut F = LaneMat3::default();
        (0..LANES).for_each(|i| F.set_lane(i, &block[i.min(block.len() - 1)]));
        let response = energy.evaluate(&F);
        out.extend(block.iter().enumerate().map(|(i, F)| {
            let stress = response.stress.lane(i) * F.transpose() / F.determinant().max(FLATTEST);
            // Symmetric but for roundings.
            (response.density.0[i], (stress + stress.transpose()) * 0.5)
        }));
    }
    out
}
