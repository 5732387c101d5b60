//! Scenes of rapier's joints under soft loads, and how they are measured.
//!
//! Forces are means over the last second. Over that second the mean force on what stands still differs from
//! statics by its change of momentum, which is 2 m v at the most: of the weight m g it is a part of 2v/g. All
//! scenes assert v < [`STILL`], so the tolerance [`STATIC`] is twice 2·1e-4/9.81, and the rounding of what is
//! read in `f32`.
use super::MU;
use foible3d::prelude::*;
use rapier3d::prelude::*;

pub const H: f32 = 1.0 / 60.0;
/// Speed of what stands still [m/s].
pub const STILL: f64 = 1e-4;
/// Relative tolerance of forces against statics.
pub const STATIC: f64 = 5e-5;

pub fn rigid_box(physics: &mut PhysicsWorld, at: Vector, half: Vector, mass: f64) -> RigidBodyHandle {
    let volume = f64::from(8.0 * half.x * half.y * half.z);
    let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density((mass / volume) as f32);
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    physics.insert(body, shape.friction(MU as f32)).0
}

/// A soft cube of 0.2 m and 8 kg.
pub fn small_cube(at: Vector) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3])
        .can_sleep(false)
        .translation(at)
        .material(DeformableMaterial::new(1e6, 0.3).friction(MU).mass_damping(1.0))
}

/// Steps, and gives the means over the last second of what is read, once all bodies stand still.
pub fn rest<const N: usize>(
    physics: &mut PhysicsWorld,
    world: &mut DeformableWorld,
    steps: usize,
    read: impl Fn(&PhysicsWorld, &DeformableWorld) -> [f64; N],
) -> [f64; N] {
    let (mut sum, mut fastest) = ([0.0; N], 0.0f64);
    for step in 0..steps {
        world.step(physics);
        if step + 60 >= steps {
            let now = read(physics, world);
            (0..N).for_each(|k| sum[k] += now[k] / 60.0);
            let rigid = physics.bodies.iter().map(|(_, b)| f64::from(b.linvel().length()));
            let soft = world.bodies.iter().map(|(_, b)| b.max_speed());
            fastest = rigid.chain(soft).fold(fastest, f64::max);
        }
    }
    println!("means {sum:?}, at most {fastest:.1e} m/s");
    assert!(fastest < STILL, "{fastest:e} m/s");
    sum
}

pub fn is_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    println!("{what}: {found} against {expected}, off by {:.1e}", found / expected - 1.0);
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found} against {expected}");
}
