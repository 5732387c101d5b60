//! The quick start of the README: a crate falls on a soft pad: `cargo run --release --example hello`.

use foible3d::prelude::*;
use rapier3d::prelude::*;

fn main() -> Result<(), DeformableBodyError> {
    // Rapier's world, as ever: a floor and a crate of 4 kg.
    let mut physics = PhysicsWorld::new();
    let ground = RigidBodyBuilder::fixed().translation(Vector::NEG_Y * 0.1);
    let (_, floor) = physics.insert(ground, ColliderBuilder::cuboid(2.0, 0.1, 2.0));
    let crate_ = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
    let (crate_, _) = physics.insert(crate_, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(500.0));

    // Beside it the deformable bodies: a cube of silicone, Young's modulus in pascals.
    let mut deformables = DeformableWorld::new();
    let silicone = DeformableMaterial::new(1.0e5, 0.45).density(1_070.0).friction(0.8); // Pa, –, kg/m³, –
    let pad = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [4, 4, 4]).translation(Vector::Y * 0.2);
    let pad = deformables.insert(pad.material(silicone))?;

    for _ in 0..240 {
        deformables.step(&mut physics); // deformables, their reactions, then rapier
    }

    let body = &deformables.bodies[pad];
    let load: Vector = deformables.contacts_with(floor).map(|c| c.force).sum();
    let weight = (f64::from(physics.bodies[crate_].mass()) + body.mass()) * 9.81;
    println!("the floor carries {:.2} N; pad and crate weigh {weight:.2} N", load.y);
    // 4 kg on 0.04 m² at 1e5 Pa press it by 1 %, its own weight by half of 2 %.
    let top = physics.bodies[crate_].translation().y - 0.1;
    println!("the crate stands {top:.4} m high on a pad of 0.2 m, whose volume is {:.5} m³", body.volume());
    assert!((f64::from(load.y) / weight - 1.0).abs() < 1.0e-3, "what lies still weighs what it weighs");
    Ok(())
}
