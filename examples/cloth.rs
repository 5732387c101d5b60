//! A table cloth falls over a ball and drapes: `cargo run --release --example cloth`.

use foible3d::prelude::*;
use rapier3d::prelude::*;

fn main() -> Result<(), DeformableBodyError> {
    let mut physics = PhysicsWorld::new();
    let (_, ball) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::ball(0.3).friction(0.8));

    // One square metre of cotton, half a millimetre thick: mass and bending follow from that. Air drags at it.
    let cotton = DeformableMaterial::new(1.0e6, 0.3).density(400.0).friction(0.8).mass_damping(2.0);
    let cloth = DeformableBodyBuilder::cloth([0.5, 0.5], [24, 24], 5.0e-4)
        .translation(Vector::Y * 0.32)
        .material(cotton)
        .self_contact(true);
    let mut deformables = DeformableWorld::new();
    let cloth = deformables.insert(cloth)?;
    let corners: Vec<usize> = deformables.bodies[cloth].vertices_where(|x| x.x.abs().min(x.z.abs()) > 0.499);

    for step in 1..=360 {
        deformables.step(&mut physics);
        if step % 60 == 0 {
            let body = &deformables.bodies[cloth];
            let height = |&v: &usize| body.position(v).map_or(f64::NAN, |p| p[1]);
            let lowest = corners.iter().map(height).fold(f64::INFINITY, f64::min);
            let speed = body.max_speed();
            println!(
                "{} s: the lowest corner is at {lowest:+.3} m, the fastest vertex has {speed:.3} m/s",
                step / 60
            );
        }
    }

    let body = &deformables.bodies[cloth];
    let carried = f64::from(deformables.contact_force(cloth, ball).y);
    let weight = body.mass() * 9.81;
    println!("the ball carries {carried:.3} N, the cloth weighs {weight:.3} N");
    let deepest = deformables.contacts().iter().map(|c| -c.gap).fold(0.0, f64::max);
    println!("in {} contacts, the deepest of {deepest:.0e} m", deformables.contacts().len());
    assert!((carried / weight - 1.0).abs() < 0.02, "it hangs on the ball alone");
    Ok(())
}
