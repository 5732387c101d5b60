//! An arm with soft pads carries a box from one place to another: `cargo run --release --example pick_and_place`.

use foible_robots::{Robot, RobotBuilder, RobotError};
use foible3d::prelude::*;
use rapier3d::prelude::*;

const RATE: f32 = 120.0;
/// Stiffness and damping of the arm's motors, and of the fingers'.
const ARM: [f32; 2] = [1.0e5, 5.0e3];
const FINGER: [f32; 2] = [4.0e3, 1.0e2];

/// A movement: joints with their gains, from where to where.
type Way<'a> = &'a [(&'a str, [f32; 2], f32, f32)];

fn main() -> Result<(), RobotError> {
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    physics.gravity = Vector::NEG_Z * 9.81;
    physics.integration_parameters.dt = 1.0 / RATE;
    let ground = RigidBodyBuilder::fixed().translation(Vector::NEG_Z * 0.05);
    physics.insert(ground, ColliderBuilder::cuboid(1.0, 1.0, 0.05).friction(0.8));
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/models");
    let arm = RobotBuilder::urdf(format!("{folder}/arm.urdf")).soft_parts(format!("{folder}/arm.soft.toml"));
    let arm = arm.insert(&mut physics, &mut deformables)?;
    for (joint, gains) in [("swing", ARM), ("lift", ARM), ("wrist", ARM), ("left", FINGER), ("right", FINGER)]
    {
        arm.set_motor_position(&mut physics, joint, 0.0, gains[0], gains[1])?;
    }
    let load = RigidBodyBuilder::dynamic().translation(Vector::new(0.4, 0.0, 0.02)).can_sleep(false);
    let (load, _) = physics.insert(load, ColliderBuilder::cuboid(0.02, 0.02, 0.02).mass(0.2).friction(0.8));
    let ways: [(&str, f32, Way<'_>); 6] = [
        ("reaches down", 1.0, &[("lift", ARM, 0.0, -0.105)]),
        ("grips", 0.5, &[("left", FINGER, 0.0, 0.026), ("right", FINGER, 0.0, 0.026)]),
        ("lifts", 1.0, &[("lift", ARM, -0.105, 0.0)]),
        ("swings", 1.5, &[("swing", ARM, 0.0, 1.2), ("wrist", ARM, 0.0, -1.2)]),
        ("lowers", 1.0, &[("lift", ARM, 0.0, -0.105)]),
        ("lets go", 0.5, &[("left", FINGER, 0.026, 0.0), ("right", FINGER, 0.026, 0.0)]),
    ];
    for (what, seconds, way) in ways {
        go(&arm, &mut physics, &mut deformables, seconds, way)?;
        let part = arm.part("left pad")?;
        let force: Vector = deformables.contacts_of(part.body).map(|contact| contact.force).sum();
        let at = physics.bodies[load].translation();
        println!(
            "{what}: box at {:.4} {:.4} {:.4} m, left pad bears {:.2} N",
            at.x,
            at.y,
            at.z,
            force.length()
        );
    }
    let target = Vector::new(0.4 * 1.2f32.cos(), 0.4 * 1.2f32.sin(), 0.02);
    let missed = (physics.bodies[load].translation() - target).length();
    println!("off its target by {:.2} mm", missed * 1.0e3);
    Ok(())
}

/// Moves joints smoothly, all at once.
fn go(
    arm: &Robot,
    physics: &mut PhysicsWorld,
    deformables: &mut DeformableWorld,
    seconds: f32,
    way: Way<'_>,
) -> Result<(), RobotError> {
    let steps = (seconds * RATE) as usize;
    for step in 1..=steps {
        let t = step as f32 / steps as f32;
        let part = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        for (joint, [stiffness, damping], from, to) in way {
            arm.set_motor_position(physics, joint, from + (to - from) * part, *stiffness, *damping)?;
        }
        arm.step(physics, deformables);
    }
    Ok(())
}
