//! Stiffness of a body's elements, block by block: at a state, as Newton's method wants it, or its bound in the
//! constant matrix.

use super::elastic::Elements;
use super::patches::deformation_gradient;
use super::thin::keeper;
use crate::energy::membrane::{Membrane, MembraneMode};
use crate::energy::{ElementEnergy, Mode, modes, with_energy};
use crate::math::lanes::LANES;
use crate::math::{Mat3, Vec3};

/// Calls `add(i, j, K)` with the blocks `K = −∂fᵢ/∂xⱼ` [N/m] of every element at positions `x`; of smoothed
/// bodies as if the volume were smoothed over edges as the shape is, which couples fewer nodes. With
/// `projected` without the modes of negative stiffness: positive semi-definite then.
pub(crate) fn add_tangents(
    elements: &Elements<'_>,
    x: &[Vec3],
    projected: bool,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    let Elements { model, material, activation } = elements;
    let kept = |stiffness: f64| if projected { stiffness.max(0.0) } else { stiffness };
    for (corners, volume) in model.patches.iter() {
        let F = deformation_gradient(&corners, x);
        let modes: [Mode; 9] = with_energy!(material, energy => modes(&F, |s| energy.principal(s)));
        for (i, a) in &corners {
            for (j, b) in &corners {
                let mut block = Mat3::zeros();
                for mode in &modes {
                    let weight = kept(mode.stiffness) * volume;
                    block += (mode.shape * a) * (mode.shape * b * weight).transpose();
                }
                add(*i as usize, *j as usize, &block);
            }
        }
    }
    let solid = if model.is_smoothed() { 0 } else { LANES * model.blocks.len() };
    for (e, tet) in model.tetrahedra.iter().enumerate().take(solid) {
        let block = &model.blocks[e / LANES];
        let gradients = block.shape_gradients(e % LANES);
        let volume = block.volumes.0[e % LANES];
        let mut F = Mat3::zeros();
        tet.iter().zip(&gradients).for_each(|(&n, g)| F += x[n as usize] * g.transpose());
        let modes: [Mode; 9] = with_energy!(material, energy => modes(&F, |s| energy.principal(s)));
        let sides = modes.map(|m| (kept(m.stiffness) * volume, gradients.map(|g| m.shape * g)));
        add_products(tet, &sides, &mut add);
    }
    let sheet = Membrane::new(material);
    for triangle in &model.triangles {
        let modes: [MembraneMode; 6] = sheet.modes(&triangle.deformation_gradient(x));
        let sides =
            modes.map(|m| (kept(m.stiffness) * triangle.volume, triangle.gradients.map(|g| m.shape * g)));
        add_products(&triangle.nodes, &sides, &mut add);
    }
    for stencil in &model.stencils {
        let mut K = keeper(stencil, material, *activation).tangent(&stencil.vector(x));
        if projected {
            K = semidefinite(&K);
        }
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms() {
                add(i, j, &(K * (a * b)));
            }
        }
    }
}

/// As [`add_tangents`], of the thin elements only and as the multiple of I that bounds them in the constant
/// matrix [Bouaziz et al. 2014].
pub(crate) fn add_thin_bounds(elements: &Elements<'_>, mut add: impl FnMut(usize, usize, f64)) {
    let Elements { model, material, activation } = elements;
    let weight = Membrane::new(material).laplacian_weight();
    for triangle in &model.triangles {
        for (&i, a) in triangle.nodes.iter().zip(&triangle.gradients) {
            for (&j, b) in triangle.nodes.iter().zip(&triangle.gradients) {
                add(i as usize, j as usize, weight * triangle.volume * a.dot(b));
            }
        }
    }
    for stencil in &model.stencils {
        let weight = keeper(stencil, material, *activation).weight;
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms() {
                add(i, j, weight * a * b);
            }
        }
    }
}

/// Adds the blocks on the diagonal of the elastic part of the constant matrix: of the rest stiffness, or of the
/// Laplacian.
pub(crate) fn add_diagonal(elements: &Elements<'_>, is_laplacian: bool, diagonal: &mut [Mat3]) {
    let Elements { model, material, .. } = elements;
    let lame = material.lame();
    let weight = with_energy!(material, energy => energy.laplacian_weight());
    let mut add = |n: u32, g: &Vec3, volume: f64| {
        let along = g * g.transpose();
        let block = match is_laplacian {
            true => Mat3::from_diagonal_element(weight * g.norm_squared()),
            false => (Mat3::from_diagonal_element(g.norm_squared()) + along) * lame.mu + along * lame.lambda,
        };
        diagonal[n as usize] += block * volume;
    };
    for (corners, volume) in model.patches.iter() {
        corners.iter().for_each(|(n, g)| add(*n, g, volume));
    }
    let solid = if model.is_smoothed() { 0 } else { LANES * model.blocks.len() };
    for (e, tet) in model.tetrahedra.iter().enumerate().take(solid) {
        let block = &model.blocks[e / LANES];
        let gradients = block.shape_gradients(e % LANES);
        tet.iter().zip(&gradients).for_each(|(n, g)| add(*n, g, block.volumes.0[e % LANES]));
    }
    add_thin_bounds(elements, |i, j, k| {
        if i == j {
            diagonal[i] += Mat3::from_diagonal_element(k);
        }
    });
}

/// The blocks `Σ_k w_k u_k,a u_k,bᵀ` of an element with the modes' sides u.
fn add_products<const N: usize, const M: usize>(
    nodes: &[u32; N],
    modes: &[(f64, [Vec3; N]); M],
    add: &mut impl FnMut(usize, usize, &Mat3),
) {
    for (a, &i) in nodes.iter().enumerate() {
        for (b, &j) in nodes.iter().enumerate() {
            let mut block = Mat3::zeros();
            for (weight, sides) in modes {
                block += sides[a] * (sides[b] * *weight).transpose();
            }
            add(i as usize, j as usize, &block);
        }
    }
}

fn semidefinite(K: &Mat3) -> Mat3 {
    let eigen = K.symmetric_eigen();
    if eigen.eigenvalues.min() >= 0.0 {
        return *K;
    }
    let V = eigen.eigenvectors;
    V * Mat3::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0))) * V.transpose()
}

#[cfg(test)]
mod tests {
    use super::super::elastic::{StiffnessDamping, add_forces};
    use super::super::model::DeformableModel;
    use super::*;
    use crate::energy::Elasticity;
    use crate::material::DeformableMaterial;
    use crate::mesh::{Structure, TetMesh};
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// A block with a skin, a rope and muscles, and a network: every kind of element.
    fn models() -> [DeformableModel; 3] {
        let block = TetMesh::cuboid([0.1; 3], [1, 1, 2]).unwrap();
        let faces = [[0, 1, 2]];
        let mixed = Structure::solid(&block).with_sheet(&faces, 0.01).unwrap();
        let mixed = mixed.rod_from(0, &[[-0.2, 0.1, 0.0], [-0.3, 0.1, 0.1]], 0.01).unwrap();
        let mixed = mixed.with_spring([0, 3], 1e-3).unwrap();
        // An arch of four triangles.
        let arch: Vec<[f64; 3]> =
            [-0.2, 0.0, 0.2].iter().flat_map(|&z| [-0.2, 0.1].map(|x: f64| [x, x * x + z * z, z])).collect();
        let shell = Structure::sheet(arch, &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]], 0.01);
        [
            DeformableModel::new(&block).smoothed(),
            DeformableModel::from_structure(&mixed).unwrap().with_fibres(|_| [1.0, 0.5, 0.0]),
            DeformableModel::from_structure(&shell.unwrap()).unwrap(),
        ]
    }

    fn forces(elements: &Elements<'_>, x: &[Vec3]) -> Vec<Vec3> {
        let mut f = vec![Vec3::zeros(); x.len()];
        add_forces(elements, &StiffnessDamping::default(), x, &Mat3::identity(), f64::INFINITY, &mut f);
        f
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20))]
        #[test]
        fn tangents_are_the_derivative_of_the_forces_and_projected_ones_have_no_negative_part(
            shakes in proptest::collection::vec(-0.02..0.02f64, 60), kind in 0usize..4,
        ) {
            for model in models() {
                let nu = if model.is_smoothed() { 0.0 } else { 0.3 };
                let material = DeformableMaterial::new(1e3, nu).fibre_modulus(500.0).elasticity(Elasticity::ALL[kind]);
                let elements = Elements { model: &model, material: &material, activation: 0.8 };
                let x: Vec<Vec3> = model.rest.iter().enumerate().map(|(i, X)| {
                    X + Vec3::from_fn(|c, _| shakes[(3 * i + c) % shakes.len()])
                }).collect();
                let n = 3 * x.len();
                let (mut K, mut projected) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
                for (out, project) in [(&mut K, false), (&mut projected, true)] {
                    add_tangents(&elements, &x, project, |i, j, block| {
                        let mut part = out.view_mut((3 * i, 3 * j), (3, 3));
                        part += block;
                    });
                }
                let eps = 1e-6;
                for k in (0..n).step_by(4) {
                    let moved = |t: f64| {
                        let mut y = x.clone();
                        y[k / 3][k % 3] += t;
                        forces(&elements, &y)
                    };
                    let (ahead, behind) = (moved(eps), moved(-eps));
                    for i in 0..n {
                        let slope = -(ahead[i / 3][i % 3] - behind[i / 3][i % 3]) / (2.0 * eps);
                        // Central differences: 1e-12 · third derivative (1e3 Pa · 0.1 m² / (0.1 m)³ = 1e5, more
                        // where elements are nearly flat).
                        prop_assert!((slope - K[(i, k)]).abs() < 2e-5 * K.amax(), "{i} {k}: {slope} {}", K[(i, k)]);
                    }
                }
                let least = projected.symmetric_eigen().eigenvalues.min();
                prop_assert!(least > -1e-9 * K.amax(), "{least}");
            }
        }
    }
}
