//! Contact between deformable bodies.

mod common;

use foible3d::prelude::*;
use rapier3d::prelude::*;

fn soft(half: [f64; 3], cells: [usize; 3], at: Vector) -> DeformableBodyBuilder {
    let mesh = TetMesh::cuboid(half, cells).unwrap();
    let material = DeformableMaterial::new(1e6, 0.3).friction(0.5);
    DeformableBodyBuilder::mesh(&mesh).translation(at).material(material).can_sleep(false)
}

fn floor(physics: &mut PhysicsWorld) -> ColliderHandle {
    let shape = ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), shape).1
}

#[test]
fn interface_of_two_cubes_carries_the_weight_of_the_upper() {
    // Equal lattices, one half the size, one turned and finer.
    let uppers = [
        soft([0.2; 3], [6; 3], Vector::Y * 0.6),
        soft([0.1; 3], [4; 3], Vector::new(0.013, 0.5, 0.031)),
        soft([0.15; 3], [7; 3], Vector::new(0.01, 0.55, -0.02)).rotation(Vector::Y * 0.4),
        // Wider than what it stands on.
        soft([0.3, 0.1, 0.3], [6, 2, 6], Vector::Y * 0.5).rotation(Vector::Y * 0.3),
    ];
    for (k, upper) in uppers.into_iter().enumerate() {
        let mut physics = PhysicsWorld::new();
        let floor = floor(&mut physics);
        let mut world = DeformableWorld::new();
        let lower = world.insert(soft([0.2; 3], [6; 3], Vector::Y * 0.2)).unwrap();
        let upper = world.insert(upper).unwrap();
        for _ in 0..240 {
            world.step(&mut physics);
        }
        let weight = world.bodies[upper].mass() * 9.81;
        let force = world.pair_force(upper, lower);
        let below = world.contact_force(lower, floor).y as f64;
        let all = weight + world.bodies[lower].mass() * 9.81;
        let speed = world.bodies.iter().map(|(_, b)| b.max_speed()).fold(0.0, f64::max);
        let deepest = world.pair_contacts().iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        println!(
            "{k}: {} contacts, force {:.3e} off, below {:.3e} off, {speed:.1e} m/s, deepest {deepest:.1e}, {} it {} newton {} fail, {:?} of {:?}",
            world.pair_contacts().len(), f64::from(force.y) / weight - 1.0, below / all - 1.0,
            world.counters().iterations, world.counters().newton_steps, world.counters().contact_failures,
            world.counters().contact_time, world.counters().total_time()
        );
        println!("   detect {:?}", world.counters().detection_time);
    }
}
