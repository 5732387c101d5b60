//! What the matrix of a step is put together with.

use crate::fem::{DeformableModel, SystemMatrix};
use crate::material::DeformableMaterial;

/// Unknowns per node.
pub(crate) fn dimension(system: SystemMatrix) -> usize {
    match system {
        SystemMatrix::RestStiffness => 3,
        SystemMatrix::Laplacian => 1,
    }
}

/// Inertia of the nodes in the matrix, (1 + αh) m/h² [N/m].
pub(crate) fn node_inertia(model: &DeformableModel, materials: &[DeformableMaterial], h: f64) -> Vec<f64> {
    let mut inertia = vec![0.0; model.rest.len()];
    for_each_inertia(model, materials, h, |node, part| inertia[node] += part);
    inertia
}

/// Gives every node its parts of [`node_inertia`], material by material.
pub(crate) fn for_each_inertia(
    model: &DeformableModel,
    materials: &[DeformableMaterial],
    h: f64,
    add: impl FnMut(usize, f64),
) {
    let alpha = model.mass_damping(materials);
    model.for_each_weight(materials, |material| material.density * (1.0 + alpha * h) / (h * h), add);
}
