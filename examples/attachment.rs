//! A box hangs on a strap, and a soft block on a cable below the box: `cargo run --release --example attachment`.

use foible3d::prelude::*;
use rapier3d::prelude::*;

const G: f64 = 9.81;

fn main() -> Result<(), DeformableBodyError> {
    let mut physics = PhysicsWorld::new();
    let mut deformables = DeformableWorld::new();
    let nothing = InteractionGroups::none();

    // A box of 8 kg, its top at the height of zero.
    let body = RigidBodyBuilder::dynamic().translation(Vector::NEG_Y * 0.1).can_sleep(false);
    let (load, _) = physics.insert(body, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(1000.0));

    // A strap of rubber, 4 cm × 1 cm × 50 cm, pinned at its upper end and attached to the box at its lower.
    let rubber = DeformableMaterial::new(5.0e6, 0.3).density(1100.0).mass_damping(5.0);
    let strap = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.25, 0.005), [2, 25, 1])
        .translation(Vector::Y * 0.25)
        .material(rubber)
        .collision_groups(nothing)
        .pinned(|x| x.y > 0.499);
    let strap = deformables.insert(strap)?;
    let lower_end = deformables.bodies[strap].vertices_where(|x| x.y < 0.001);
    let to_box = AttachTo::RigidBody(load, *physics.bodies[load].position());
    let strap_end = deformables.bodies.attach(strap, &lower_end, to_box)?;

    // A block below the box, on a cable of 30 cm from the middle of its top: slack at first.
    let block = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2])
        .translation(Vector::NEG_Y * 0.26)
        .material(DeformableMaterial::new(1.0e6, 0.3).mass_damping(2.0))
        .can_sleep(false);
    let block = deformables.insert(block)?;
    let top = deformables.bodies[block].vertices_where(|x| x.y > -0.2101 && x.x.abs().max(x.z.abs()) < 0.01);
    let to_box = AttachTo::RigidBody(load, *physics.bodies[load].position());
    let cable = deformables.bodies.attach(block, &top, to_box)?;
    if let Some(cable) = deformables.bodies.attachment_mut(cable) {
        cable.set_length(0.3)?;
    }

    let force = |world: &DeformableWorld, of| world.bodies.attachment(of).map_or(0.0, |a| a.force().y);
    for step in 1..=600 {
        deformables.step(&mut physics);
        if [6, 60, 600].contains(&step) {
            let [strap_end, cable] = [-force(&deformables, strap_end), force(&deformables, cable)];
            println!(
                "{:>4.1} s: the strap is pulled down by {strap_end:.3} N, the block up by {cable:.3} N",
                step as f32 / 60.0
            );
        }
    }

    let block_weight = deformables.bodies[block].mass() * G;
    let weight = f64::from(physics.bodies[load].mass()) * G + block_weight;
    println!("box and block weigh {weight:.3} N, the block {block_weight:.3} N");
    // F L/(E A), and half of the strap's own weight.
    let own = 0.5 * deformables.bodies[strap].mass() * G;
    let expected = (weight + own) * 0.5 / (5.0e6 * 0.04 * 0.01);
    let stretch = -0.1 - f64::from(physics.bodies[load].translation().y);
    println!("the strap has stretched by {:.2} mm; as a bar by {:.2} mm", stretch * 1e3, expected * 1e3);
    assert!((f64::from(force(&deformables, strap_end)) / -weight - 1.0).abs() < 1.0e-2);
    assert!((f64::from(force(&deformables, cable)) / block_weight - 1.0).abs() < 1.0e-2);
    Ok(())
}
