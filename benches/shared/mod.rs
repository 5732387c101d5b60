//! What the benchmarks share: rapier's own soft body on the same mesh, with the same masses.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// The middle one.
// Not every benchmark uses both.
#[allow(dead_code)]
pub fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of[of.len() / 2]
}

/// Rapier's soft body of a mesh at a pose: corotational, lumped masses of 1000 kg/m³, always awake.
// Not every benchmark uses both.
#[allow(dead_code)]
pub fn rapier_body(mesh: &TetMesh, pose: Pose, youngs_modulus: f64, poisson_ratio: f64) -> SoftBodyBuilder {
    let place = |v: &[f64; 3]| pose.transform_point(Vector::from(v.map(|c| c as f32)));
    let mut masses = vec![0.0f32; mesh.vertices().len()];
    for (tet, volume) in mesh.tetrahedra().iter().zip(mesh.volumes()) {
        tet.iter().for_each(|&v| masses[v as usize] += (1000.0 * volume / 4.0) as f32);
    }
    SoftBodyBuilder::new(mesh.vertices().iter().map(place).collect())
        .cells(mesh.tetrahedra().to_vec())
        .masses(masses)
        .cell_model(SoftBodyCellModel::Corotational)
        .material(SoftBodyMaterial {
            young_modulus: youngs_modulus as f32,
            poisson_ratio: poisson_ratio as f32,
            ..Default::default()
        })
        .can_sleep(false)
}
