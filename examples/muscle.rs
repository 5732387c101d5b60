//! A muscle lifts a weight: fibres along a soft bar shorten as they are told: `cargo run --release --example muscle`.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut physics = PhysicsWorld::new();
    let body = RigidBodyBuilder::dynamic().translation(Vector::NEG_Y * 0.05).can_sleep(false);
    let (load, _) = physics.insert(body, ColliderBuilder::cuboid(0.05, 0.05, 0.05).density(1000.0));

    // 30 cm of muscle, 4 cm × 4 cm, with fibres from end to end.
    let (length, area) = (0.3, 0.04 * 0.04);
    let (modulus, fibre_modulus) = (5.0e4, 2.0e5);
    let mesh = TetMesh::cuboid([0.02, 0.15, 0.02], [2, 15, 2])?;
    let model = DeformableModel::new(&mesh).with_fibres(|_| [0.0, 1.0, 0.0]);
    let material = DeformableMaterial::new(modulus, 0.3).fibre_modulus(fibre_modulus).mass_damping(10.0);
    let muscle = DeformableBodyBuilder::model(Arc::new(model))
        .translation(Vector::Y * 0.15)
        .material(material)
        .collision_groups(InteractionGroups::none())
        .can_sleep(false)
        .pinned(|x| x.y > 0.299);
    let mut deformables = DeformableWorld::new();
    let muscle = deformables.insert(muscle)?;
    let lower_end = deformables.bodies[muscle].vertices_where(|x| x.y < 0.001);
    let to_load = AttachTo::RigidBody(load, *physics.bodies[load].position());
    deformables.bodies.attach(muscle, &lower_end, to_load)?;

    let weight = f64::from(physics.bodies[load].mass()) * 9.81;
    let own = 0.5 * deformables.bodies[muscle].mass() * 9.81;
    println!("weight {weight:.2} N");
    for activation in [1.0, 0.8, 0.6] {
        deformables.bodies[muscle].set_activation(activation)?;
        for _ in 0..240 {
            deformables.step(&mut physics);
        }
        // Along a bar whose sides are free: E (s − 1) + E_f (s − a) = F/A.
        let stress = (weight + own) / area;
        let expected = length * (stress + modulus + fibre_modulus * activation) / (modulus + fibre_modulus);
        let found = length - 0.05 - f64::from(physics.bodies[load].translation().y);
        println!(
            "fibres want {activation:.1} of their length: muscle of {found:.4} m, a bar would have {expected:.4} m"
        );
        assert!((found / expected - 1.0).abs() < 0.03);
    }
    Ok(())
}
