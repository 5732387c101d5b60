//! What tests of contact between deformable bodies share.

use super::MU;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A cuboid of half extents [m] and cells, 1e6 Pa, its centre at a place [m]; always awake.
pub fn soft(half: [f32; 3], cells: [usize; 3], at: Vector) -> DeformableBodyBuilder {
    let material = DeformableMaterial::new(1e6, 0.3).friction(MU);
    let builder = DeformableBodyBuilder::cuboid(half.into(), cells);
    builder.translation(at).material(material).can_sleep(false)
}

/// Speed of the fastest vertex of all bodies [m/s].
pub fn fastest(world: &DeformableWorld) -> f64 {
    world.bodies.iter().map(|(_, b)| b.max_speed()).fold(0.0, f64::max)
}

/// Least gap of the contacts between deformable bodies [m]; negative inside, at most 0.
pub fn deepest(world: &DeformableWorld) -> f64 {
    world.pair_contacts().iter().map(|c| c.gap).fold(0.0, f64::min)
}
