//! Stress, strain, energies and forces of elements against closed forms, and tractions against contact forces.

// Matrices keep their letters.
#![allow(non_snake_case)]

use foible3d::prelude::*;
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use rapier3d::prelude::*;

fn deform(body: &mut DeformableBody, map: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    for vertex in 0..body.vertex_count() {
        let at = map(body.model().rest_position(vertex).into());
        body.set_position(vertex, at.into()).unwrap();
    }
}

fn strain() -> impl Strategy<Value = Matrix3<f64>> {
    proptest::collection::vec(-0.02..0.02f64, 9).prop_map(|v| Matrix3::from_column_slice(&v))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The patch test: any affine motion gives every element the same stress, that of the material; turned with the body.
    #[test]
    fn affine_motions_have_the_stress_of_the_material_everywhere(
        dF in strain(), turn in proptest::collection::vec(-3.0..3.0f64, 3), kind in 0usize..4, smoothed in any::<bool>(),
        nu in 0.0..0.49f64,
    ) {
        let material = DeformableMaterial::new(1.0e6, nu).elasticity(Elasticity::ALL[kind]);
        let builder = DeformableBodyBuilder::filled(&Ball::new(0.2), 0.1).material(material);
        let mut body = if smoothed { builder.smoothed() } else { builder }.build().unwrap();
        let F = Matrix3::identity() + dF;
        let R = nalgebra::Rotation3::from_scaled_axis(Vector3::from_column_slice(&turn)).into_inner();
        deform(&mut body, |X| R * F * X + Vector3::new(3.0, 2.0, 1.0));
        // Linear elasticity, to the square of the strain.
        let e = (dF + dF.transpose()) * 0.5;
        let (mu, lambda) = (1.0e6 / (2.0 * (1.0 + nu)), 1.0e6 * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
        let expected = R * (e * 2.0 * mu + Matrix3::identity() * (lambda * e.trace())) * R.transpose();
        let all: Vec<Matrix3<f64>> = body.stresses().iter().map(|s| s.cauchy.into()).collect();
        for stress in &all {
            prop_assert!((stress - all[0]).amax() < 1e-9 * (mu + lambda), "uniform");
            prop_assert!((stress - expected).amax() < 20.0 * dF.norm_squared() * (mu + lambda), "{stress} {expected}");
        }
        let strain: Matrix3<f64> = body.strains()[0].into();
        prop_assert!((strain - (F.transpose() * F - Matrix3::identity()) * 0.5).amax() < 1e-9);
        let sum: f64 = body.element_energies().iter().sum();
        prop_assert!((sum / body.elastic_energy() - 1.0).abs() < 1e-9);
        let vertex: Matrix3<f64> = body.vertex_stresses()[0].cauchy.into();
        prop_assert!((vertex - all[0]).amax() < 1e-9 * (mu + lambda));
    }

    /// `Σ V σ = Σ f ⊗ x` over the vertices, whatever the motion: stress and forces tell the same.
    #[test]
    fn stresses_are_worth_the_forces(
        shake in proptest::collection::vec(-0.01..0.01f64, 3 * 125), kind in 0usize..4, smoothed in any::<bool>(),
    ) {
        let material = DeformableMaterial::new(1.0e6, 0.3).elasticity(Elasticity::ALL[kind]);
        let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [4; 3]).material(material);
        let mut body = if smoothed { builder.smoothed() } else { builder }.build().unwrap();
        for vertex in 0..125 {
            let own = Vector3::from_column_slice(&shake[3 * vertex..][..3]);
            let at = Vector3::from(body.model().rest_position(vertex)) + own;
            body.set_position(vertex, at.into()).unwrap();
        }
        // Means of domains have other volumes than their elements, in the second order: measured up to 2e-3 at strains of 0.2.
        let tolerance = if smoothed { 5e-3 } else { 1e-9 };
        let at = |v: u32| Vector3::from(body.position(v as usize).unwrap());
        let volume = |t: [u32; 4]| {
            let [a, b, c, d] = t.map(at);
            Matrix3::from_columns(&[b - a, c - a, d - a]).determinant() / 6.0
        };
        let stresses = body.stresses();
        let total: Matrix3<f64> = body.model().tetrahedra().zip(&stresses)
            .map(|(t, s)| Matrix3::from(s.cauchy) * volume(t)).sum();
        let size: f64 = body.model().tetrahedra().zip(&stresses)
            .map(|(t, s)| Matrix3::from(s.cauchy).amax() * volume(t)).sum();
        let virial: Matrix3<f64> = body.elastic_forces().iter().enumerate()
            .map(|(v, f)| -Vector3::from(*f) * at(v as u32).transpose()).sum();
        prop_assert!((total - virial).amax() < tolerance * size, "{total} {virial}");
    }
}

/// Von Mises, pressure, principal values and traction of a known stress.
#[test]
fn invariants_of_a_stress() {
    let bar = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).build().unwrap();
    let mut stress = bar.stresses()[0];
    assert!(stress.von_mises() < 1e-9);
    stress.cauchy = [[0.0, 3.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 6.0]];
    let ([a, b, c], [first, ..]) = stress.principal();
    assert!(
        (a - 6.0).abs() < 1e-12
            && (b - 3.0).abs() < 1e-12
            && (c + 3.0).abs() < 1e-12
            && first.z.abs() > 0.999
    );
    assert!((stress.pressure() + 2.0).abs() < 1e-12);
    let expected = (0.5f64 * ((6.0f64 - 3.0).powi(2) + 6.0f64.powi(2) + 9.0f64.powi(2))).sqrt();
    assert!((stress.von_mises() - expected).abs() < 1e-12);
    assert!((stress.traction(Vector::X) - Vector::Y * 3.0).length() < 1e-6);
}

/// Inner and outer radius of a thick ring, its height \[m\], and the pressure inside \[Pa\].
const RING: (f64, f64, f64, f64) = (0.1, 0.2, 0.04, 1.0e4);

/// Vertex `k` of two along the axis, `j` of those along the radius, at the `i`-th angle.
fn ring_vertex(around: usize, across: usize, [i, j, k]: [usize; 3]) -> usize {
    ((i % around) * (across + 1) + j) * 2 + k
}

/// Five tetrahedra in each cell, turned from cell to cell.
fn ring(around: usize, across: usize) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let (a, b, height, _) = RING;
    let (mut vertices, mut tetrahedra) = (Vec::new(), Vec::new());
    for i in 0..around {
        let angle = std::f64::consts::TAU * i as f64 / around as f64;
        for j in 0..=across {
            let r = a * (b / a).powf(j as f64 / across as f64);
            vertices.extend([0.0, height].map(|z| [r * angle.cos(), r * angle.sin(), z]));
        }
    }
    const CORNERS: [[usize; 3]; 8] =
        [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]];
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let cell = CORNERS.map(|[di, dj, dk]| ring_vertex(around, across, [i + di, j + dj, dk]) as u32);
        let five = if (i + j) % 2 == 0 {
            [[0, 1, 3, 4], [1, 2, 3, 6], [4, 6, 5, 1], [4, 7, 6, 3], [1, 3, 4, 6]]
        } else {
            [[0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6], [0, 2, 7, 5]]
        };
        tetrahedra.extend(five.map(|tet| tet.map(|corner| cell[corner])));
    }
    (vertices, tetrahedra)
}

/// The ring at rest under its pressure.
fn pressed_ring(around: usize, across: usize, smoothed: bool) -> (DeformableWorld, DeformableBodyHandle) {
    let (a, _, height, pressure) = RING;
    let (vertices, tetrahedra) = ring(around, across);
    let model = DeformableModel::new(&TetMesh::new(vertices, tetrahedra).unwrap());
    let model = if smoothed { model.smoothed() } else { model };
    let material = DeformableMaterial::new(1.0e8, 0.3).mass_damping(100.0);
    let tight = |s: &mut SolverSettings| (s.max_iterations, s.tolerance) = (200, 1e-9);
    let ring = DeformableBodyBuilder::model(std::sync::Arc::new(model)).material(material).gravity_scale(0.0);
    let mut world = DeformableWorld::new();
    let handle = world.insert(ring.tune(tight).can_sleep(false)).unwrap();
    // Each inner vertex carries the pressure on half of the sides beside it.
    let half = std::f64::consts::PI / around as f64;
    let share = pressure * 2.0 * a * half.sin() * height * half.cos() / 2.0;
    for i in 0..around {
        let angle = 2.0 * half * i as f64;
        let out = Vector::new(angle.cos() as f32, angle.sin() as f32, 0.0) * share as f32;
        let inner = [0, 1].map(|k| ring_vertex(around, across, [i, 0, k]));
        inner.iter().for_each(|vertex| world.bodies[handle].add_force(&[*vertex], out).unwrap());
    }
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 0.05;
    (0..60).for_each(|_| world.step(&mut physics));
    (world, handle)
}

/// Largest error of the hoop stress over the layers of cells, against Lamé's `p a²/(b² − a²) (1 + b²/r²)`.
fn hoop_error(around: usize, across: usize, smoothed: bool) -> f64 {
    let (a, b, _, pressure) = RING;
    let (world, handle) = pressed_ring(around, across, smoothed);
    let body = &world.bodies[handle];
    let mut layers = vec![(0.0, 0.0, 0.0); across];
    for (tet, stress) in body.model().tetrahedra().zip(body.stresses()) {
        let corners = tet.map(|v| Vector3::from(body.model().rest_position(v as usize)));
        let centre = corners.iter().sum::<Vector3<f64>>() / 4.0;
        let (r, around) = (centre.xy().norm(), Vector3::new(-centre.y, centre.x, 0.0).normalize());
        let layer = &mut layers[((r / a).ln() / (b / a).ln() * across as f64) as usize];
        let hoop = (Matrix3::from(stress.cauchy) * around).dot(&around);
        *layer = (layer.0 + hoop, layer.1 + r, layer.2 + 1.0);
    }
    let error = |(hoop, r, count): (f64, f64, f64)| {
        let (hoop, r) = (hoop / count, r / count);
        let expected = pressure * a * a / (b * b - a * a) * (1.0 + b * b / (r * r));
        (hoop / expected - 1.0).abs()
    };
    layers.into_iter().map(error).fold(0.0, f64::max)
}

#[test]
fn a_thick_ring_under_pressure_has_lames_stress() {
    for smoothed in [false, true] {
        let (coarse, fine) = (hoop_error(24, 3, smoothed), hoop_error(48, 6, smoothed));
        println!("smoothed {smoothed}: hoop stress {coarse:.4}, refined {fine:.4}");
        assert!(fine < 0.02 && fine < coarse, "{coarse} {fine}");
    }
}

/// Contact forces by vertex are the contact forces, and at rest what elasticity and weight leave.
#[test]
fn tractions_integrate_to_the_contact_forces() {
    let mut physics = PhysicsWorld::new();
    let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0);
    let ball =
        DeformableBodyBuilder::filled(&Ball::new(0.2), 0.08).material(material).translation(Vector::Y * 0.32);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).material(material);
    let ball = world.insert(ball.can_sleep(false)).unwrap();
    let cube = world.insert(cube.translation(Vector::Y * 0.65).can_sleep(false)).unwrap();
    for _ in 0..300 {
        world.step(&mut physics);
        for handle in [ball, cube] {
            let areas = world.bodies[handle].vertex_areas();
            let tractions = world.contact_tractions(handle).unwrap();
            let sum: Vector3<f64> = areas.iter().zip(&tractions).map(|(a, t)| Vector3::from(*t) * *a).sum();
            // Each force is f32, their sum is not.
            let exact = |force: Vector| Vector3::from(force.to_array().map(f64::from));
            let on_floor = world.contacts_of(handle).map(|c| exact(c.force)).sum::<Vector3<f64>>();
            let of_pair = |c: &DeformablePairContact| match handle {
                own if own == c.body1 => exact(c.force),
                _ => -exact(c.force),
            };
            let between = world.pair_contacts().iter().map(of_pair).sum::<Vector3<f64>>();
            let expected = on_floor + between;
            assert!((sum - expected).norm() < 1e-9 * (1.0 + expected.norm()), "{sum} {expected}");
        }
    }
    let carried = world.contact_force(ball, floor).y;
    let weight = 9.81 * (world.bodies[ball].mass() + world.bodies[cube].mass()) as f32;
    assert!((carried / weight - 1.0).abs() < 1e-3, "{carried} of {weight}");
    // Elastic forces carry what contacts bring, less each vertex's weight.
    let body = &world.bodies[cube];
    let elastic: f64 = body.elastic_forces().iter().map(|f| f[1]).sum();
    assert!(elastic.abs() < 1e-3 * f64::from(weight), "inner forces have no sum: {elastic}");
    assert!(world.contact_tractions(ball).unwrap().iter().any(|t| t[1] > 1000.0));
    // A cube stands on all of its face; the cap of a ball is less than its section.
    let mut flat = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).material(material);
    let cube = flat.insert(cube.translation(Vector::Y * 0.2)).unwrap();
    (0..60).for_each(|_| flat.step(&mut physics));
    let area = flat.contact_area(cube).unwrap();
    assert!((area / 0.04 - 1.0).abs() < 0.01, "{area} m²");
    let cap = world.contact_area(ball).unwrap();
    assert!(cap > 0.0 && cap < std::f64::consts::PI * 0.2 * 0.2, "{cap} m²");
}
