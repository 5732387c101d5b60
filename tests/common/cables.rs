//! Cables of the tests.

use foible3d::prelude::*;
use rapier3d::prelude::*;

pub fn world(gravity: Vector) -> (PhysicsWorld, DeformableWorld) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = gravity;
    physics.integration_parameters.dt = 1.0 / 60.0;
    (physics, DeformableWorld::new())
}

pub fn steps(physics: &mut PhysicsWorld, deformables: &mut DeformableWorld, count: usize) {
    (0..count).for_each(|_| deformables.step(physics));
}

/// A finger along x from 0 to `length`, held at x = 0, `2 half` thick, with a tendon `offset` below its axis that is drawn at the base.
pub fn finger(
    deformables: &mut DeformableWorld,
    young: f64,
    [length, half, offset]: [f32; 3],
    cells: [usize; 3],
    cable: impl FnOnce(DeformableCableBuilder) -> DeformableCableBuilder,
) -> (DeformableBodyHandle, DeformableCableHandle) {
    let body = DeformableBodyBuilder::cuboid(Vector::new(0.5 * length, half, half), cells)
        .translation(Vector::X * 0.5 * length)
        .material(DeformableMaterial::new(young, 0.0).density(1000.0).mass_damping(20.0))
        .smoothed()
        .can_sleep(false);
    let body = deformables.insert(body).unwrap();
    let base = deformables.bodies[body].vertices_where(|x| x.x < 1e-6);
    base.iter().for_each(|v| deformables.bodies[body].pin(*v).unwrap());
    let guides = 12;
    let at = |k: usize| {
        let x = length * (k as f32 / guides as f32).clamp(1.0e-5, 1.0 - 1.0e-5);
        CablePoint::Inside(body, Vector::new(x, -offset, 0.0))
    };
    let tendon = cable(DeformableCableBuilder::new((0..=guides).rev().map(at)));
    (body, deformables.bodies.insert_cable(tendon).unwrap())
}
