//! Stiffness of a body's elements at a state, block by block, as Newton's method wants it.

use super::flat_bends::is_flat_bend;
use super::model::Elements;
use super::solid_elements::SolidElement;
use super::thin_elements::{length_energy, membrane};
use crate::energy::membrane::MembraneMode;
use crate::energy::{ElementEnergy, Mode, modes, with_energy};
use crate::material::DeformableMaterial;
use crate::math::{Mat3, Vec3};

/// Calls `add(i, j, K)` with the blocks `K = −∂fᵢ/∂xⱼ` [N/m], i ≥ j, of every element at positions `x`. With
/// `projected` without the modes of negative stiffness: positive semi-definite then. `sides` is memory.
pub(crate) fn add_tangents(
    elements: &Elements<'_>,
    x: &[Vec3],
    projected: bool,
    stiffening: impl Fn(&DeformableMaterial) -> f64,
    sides: &mut Vec<Vec3>,
    mut add: impl FnMut(usize, usize, &Mat3),
) {
    let Elements { model, materials, activations } = elements;
    let kept = |stiffness: f64| if projected { stiffness.max(0.0) } else { stiffness };
    model.for_each_energy(materials, |law, element| {
        let (material, lame) = (law.material, law.lame);
        let SolidElement { nodes, gradients, volume, .. } = *element;
        let F = element.deformation_gradient(x);
        let modes: [Mode; 9] = with_energy!(material, lame, energy => modes(&F, |s| energy.principal(s)));
        sides.clear();
        sides.extend(modes.iter().flat_map(|m| gradients.iter().map(|g| m.shape * g)));
        let scale = volume * stiffening(material);
        add_products(nodes, &modes.map(|m| kept(m.stiffness) * scale), sides, &mut add);
    });
    for triangle in &model.triangles {
        let material = &materials[triangle.region as usize];
        let modes: [MembraneMode; 6] = membrane(material).modes(&triangle.deformation_gradient(x));
        sides.clear();
        sides.extend(modes.iter().flat_map(|m| triangle.gradients.map(|g| m.shape * g)));
        let scale = triangle.volume * stiffening(material);
        let weights = modes.map(|m| kept(m.stiffness) * scale);
        add_products(&triangle.nodes, &weights, sides, &mut add);
    }
    for stencil in model.stencils.iter().filter(|stencil| !is_flat_bend(stencil)) {
        let stiffening = stencil.mean(|region| stiffening(&materials[region as usize]));
        let mut K = length_energy(&stencil, materials, activations).tangent(&stencil.vector(x)) * stiffening;
        if projected {
            K = semidefinite(&K);
        }
        for (i, a) in stencil.terms() {
            for (j, b) in stencil.terms().filter(|(j, _)| *j <= i) {
                add(i, j, &(K * (a * b)));
            }
        }
    }
    model.flat_bends().add_blocks(materials, stiffening, add);
}

/// The blocks `Σ_k w_k u_k,a u_k,bᵀ` of an element with the modes' sides u, mode by mode.
pub(super) fn add_products(
    nodes: &[u32],
    weights: &[f64],
    sides: &[Vec3],
    add: &mut impl FnMut(usize, usize, &Mat3),
) {
    for (a, &i) in nodes.iter().enumerate() {
        for (b, &j) in nodes.iter().enumerate().filter(|(_, j)| **j <= i) {
            let mut block = Mat3::zeros();
            for (weight, sides) in weights.iter().zip(sides.chunks_exact(nodes.len())) {
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
    use super::super::model::DeformableModel;
    use super::*;
    use crate::energy::Elasticity;
    use crate::fem::StiffnessDamping;
    use crate::fem::elastic_forces::{Evaluation, add_forces};
    use crate::mesh::{Structure, TetMesh};
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// A block with a skin, a rope and muscles, and a network: every kind of element.
    fn models() -> Vec<DeformableModel> {
        let block = TetMesh::cuboid([0.1; 3], [1, 1, 2]).unwrap();
        let faces = [[0, 1, 2]];
        let mixed = Structure::solid(&block).with_sheet(&faces, 0.01).unwrap();
        let mixed = mixed.rod_from(0, &[[-0.2, 0.1, 0.0], [-0.3, 0.1, 0.1]], 0.01).unwrap();
        let mixed = mixed.with_spring([0, 3], 1e-3).unwrap();
        // An arch of four triangles.
        let arch: Vec<[f64; 3]> =
            [-0.2, 0.0, 0.2].iter().flat_map(|&z| [-0.2, 0.1].map(|x: f64| [x, x * x + z * z, z])).collect();
        let shell = Structure::sheet(arch, &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]], 0.01);
        // Flat, of triangles that differ, over half of it in another region.
        let plane: Vec<[f64; 3]> = (0..9)
            .map(|k| {
                [0.2 * f64::from(k % 3) - 0.15, 0.0, 0.03 * f64::from(k * k % 5) + 0.1 * f64::from(k / 3)]
            })
            .collect();
        let faces: Vec<[u32; 3]> =
            [0, 1, 3, 4].into_iter().flat_map(|k| [[k, k + 3, k + 1], [k + 1, k + 3, k + 4]]).collect();
        let flat = Structure::sheet(plane, &faces, 0.02);
        let whole = [
            DeformableModel::from_structure(&flat.unwrap()).unwrap(),
            DeformableModel::new(&block).smoothed(),
            DeformableModel::from_structure(&mixed).unwrap().with_fibres(|_| [1.0, 0.5, 0.0]),
            DeformableModel::from_structure(&shell.unwrap()).unwrap(),
        ];
        let in_regions = whole.clone().map(|model| model.painted(|[x, _, z]| u32::from(x + z > 0.0)));
        whole.into_iter().chain(in_regions).collect()
    }

    fn forces(elements: &Elements<'_>, x: &[Vec3]) -> Vec<Vec3> {
        let mut f = vec![Vec3::zeros(); x.len()];
        let (damping, frame) = (StiffnessDamping::default(), Mat3::identity());
        let at = Evaluation { damping: &damping, x, frame: &frame, limit: f64::INFINITY };
        add_forces(elements, &at, &mut f);
        f
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20))]
        #[test]
        fn tangents_are_the_derivative_of_the_forces_and_projected_ones_have_no_negative_part(
            shakes in proptest::collection::vec(-0.02..0.02f64, 60), kind in 0usize..4,
        ) {
            for model in models() {
                let material = DeformableMaterial::new(1e3, 0.3).fibre_modulus(500.0).elasticity(Elasticity::ALL[kind]);
                let materials = [material, material.youngs_modulus(2e2).poisson_ratio(0.1)];
                let materials = &materials[..model.regions().len()];
                let elements = Elements { model: &model, materials, activations: &[0.8, 1.3] };
                let x: Vec<Vec3> = model.rest.iter().enumerate().map(|(i, X)| {
                    X + Vec3::from_fn(|c, _| shakes[(3 * i + c) % shakes.len()])
                }).collect();
                let n = 3 * x.len();
                let (mut K, mut projected) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
                for (out, project) in [(&mut K, false), (&mut projected, true)] {
                    add_tangents(&elements, &x, project, |_| 1.0, &mut Vec::new(), |i, j, block| {
                        let mut part = out.view_mut((3 * i, 3 * j), (3, 3));
                        part += block;
                        if i != j {
                            let mut part = out.view_mut((3 * j, 3 * i), (3, 3));
                            part += block.transpose();
                        }
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
