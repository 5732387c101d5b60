//! What the matrix of a step is put together with.

use crate::fem::SystemMatrix;
use crate::material::DeformableMaterial;

/// Unknowns per node.
pub(crate) fn dimension(system: SystemMatrix) -> usize {
    match system {
        SystemMatrix::RestStiffness => 3,
        SystemMatrix::Laplacian => 1,
    }
}

/// Factor of stiffness damping on the elastic part of the matrix, 1 + β/h.
pub(crate) fn stiffening(material: &DeformableMaterial, h: f64) -> f64 {
    1.0 + material.stiffness_damping / h
}

/// Inertia per volume in the matrix, (1 + αh) ρ/h² [N/m per m³].
pub(crate) fn inertia(material: &DeformableMaterial, h: f64) -> f64 {
    material.density * (1.0 + material.mass_damping * h) / (h * h)
}
