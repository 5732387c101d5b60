//! What tests of cavities share.

use super::games::H;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A cube of 0.4 m with a hollow cube of 0.2 m in it.
pub fn hollow_cube() -> DeformableBodyBuilder {
    DeformableBodyBuilder::mesh(
        &TetMesh::cuboid([0.2; 3], [4; 3]).unwrap().without(|x| x.iter().all(|c| c.abs() < 0.1)).unwrap(),
    )
}

/// A world without gravity or floor.
pub fn weightless() -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = H;
    physics.gravity = Vector::ZERO;
    physics
}

/// So many steps.
pub fn steps(physics: &mut PhysicsWorld, world: &mut DeformableWorld, count: usize) {
    (0..count).for_each(|_| world.step(physics));
}
