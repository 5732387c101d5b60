//! Scenes and oracles shared by the tests.
#![allow(dead_code)]

pub mod bones;
pub mod cables;
pub mod cavities;
pub mod games;
pub mod joints;
pub mod newton;
pub mod rods;
pub mod soft_bodies;
pub mod thin;

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Gravity of rapier's default world, widened from its `f32` [m/s²].
pub const G: f64 = 9.81f32 as f64;
/// Coefficient of friction of all scenes, on both sides.
pub const MU: f64 = 0.5;

/// A rapier world with a fixed floor whose top is y = 0.
pub fn world_with_floor(dt: f32) -> (PhysicsWorld, ColliderHandle) {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    let body = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    let collider = ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(MU as f32).restitution(0.0);
    let (_, floor) = physics.insert(body, collider);
    (physics, floor)
}

/// The cube of the tests: 0.4 m, 6 × 6 × 6 cells, 64 kg, its centre at `y` [m]; always awake.
pub fn cube(material: DeformableMaterial, y: f32) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6])
        .translation(Vector::Y * y)
        .material(material.friction(MU))
        .can_sleep(false)
}

/// A gutter along x that opens by `angle` \[rad\] from the line y = z = 0, its walls in `parts` strips along it.
pub fn gutter(angle: f64, parts: usize) -> ColliderBuilder {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let (s, c) = ((0.5 * angle).sin() as f32, (0.5 * angle).cos() as f32);
    for k in 0..=parts {
        let x = 6.0 * k as f32 / parts as f32 - 3.0;
        points.extend([Vector::new(x, c, -s), Vector::new(x, 0.0, 0.0), Vector::new(x, c, s)]);
    }
    for k in 0..parts as u32 {
        for i in [3 * k, 3 * k + 1] {
            faces.extend([[i, i + 1, i + 3], [i + 1, i + 4, i + 3]]);
        }
    }
    ColliderBuilder::trimesh(points, faces).unwrap().friction(0.1)
}

/// Vertices of a body whose rest position satisfies a condition.
pub fn at_rest_where(body: &DeformableBody, condition: impl Fn([f64; 3]) -> bool) -> Vec<usize> {
    (0..body.vertex_count()).filter(|&v| condition(body.model().rest_position(v))).collect()
}

/// Mean position of some vertices [m].
pub fn mean_position(body: &DeformableBody, vertices: &[usize]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &v in vertices {
        let p = body.position(v).unwrap();
        (0..3).for_each(|k| sum[k] += p[k] / vertices.len() as f64);
    }
    sum
}

/// Depth of the deepest vertex below the plane y = 0 [m].
pub fn depth_below_floor(body: &DeformableBody) -> f64 {
    let heights = (0..body.vertex_count()).map(|v| body.position(v).unwrap()[1]);
    -heights.fold(f64::INFINITY, f64::min)
}

/// Kinetic, elastic and gravity energy [J].
pub fn total_energy(body: &DeformableBody) -> f64 {
    body.kinetic_energy() + body.elastic_energy() + body.mass() * G * body.center_of_mass()[1]
}

/// That of all bodies of a world [J].
pub fn energy_of(world: &DeformableWorld) -> f64 {
    world.bodies.iter().map(|(_, body)| total_energy(body)).sum()
}

/// Solved until only rounding is left.
pub fn converged() -> SolverSettings {
    SolverSettings::default().max_iterations(300).tolerance(1e-9)
}
