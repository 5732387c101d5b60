//! What the tests of what games do share: a step, small bodies, worlds without gravity, random numbers.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Step [s].
pub const H: f32 = 1.0 / 60.0;

/// A cube of eight cells.
pub fn cube(half: f32) -> DeformableBodyBuilder {
    let rubber = DeformableMaterial::new(1.0e5, 0.3).mass_damping(2.0).friction(0.6);
    DeformableBodyBuilder::cuboid(Vector::splat(half), [2; 3]).material(rubber)
}

/// A cuboid that is twice as stiff, and damped half as much.
pub fn cuboid(half: Vector, cells: [usize; 3]) -> DeformableBodyBuilder {
    let rubber = DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0).friction(0.5);
    DeformableBodyBuilder::cuboid(half, cells).material(rubber)
}

/// A world without gravity.
pub fn weightless() -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = H;
    physics
}

/// A small generator: tests take no dependency for it.
pub struct Random(pub u64);

impl Random {
    /// A whole number below n.
    pub fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) % u64::from(n)) as u32
    }

    /// From 0 to 1, in steps of 1e-4.
    pub fn unit(&mut self) -> f32 {
        self.below(10_000) as f32 / 10_000.0
    }
}
