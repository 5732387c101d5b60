//! Soft bodies between rigid ones that rest on one another, hang on joints, or are parts of arms.
mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;

fn rigid_box(physics: &mut PhysicsWorld, at: Vector, half: Vector, mass: f64) -> RigidBodyHandle {
    let volume = f64::from(8.0 * half.x * half.y * half.z);
    let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density((mass / volume) as f32);
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    physics.insert(body, shape.friction(MU as f32)).0
}

/// Fastest of some bodies over the last second, in m/s.
fn settle(
    physics: &mut PhysicsWorld,
    world: &mut DeformableWorld,
    bodies: &[RigidBodyHandle],
    steps: usize,
) -> f64 {
    let mut fastest = 0.0f64;
    for step in 0..steps {
        world.step(physics);
        if step + 60 >= steps {
            for b in bodies {
                fastest = fastest.max(f64::from(physics.bodies[*b].linvel().length()));
            }
        }
    }
    fastest
}

#[test]
fn two_boxes_stand_on_a_cube_whatever_their_masses() {
    for ratio in [1.0, 10.0, 100.0, 1000.0] {
        let (mut physics, floor) = world_with_floor(H);
        let lower = rigid_box(&mut physics, Vector::Y * 0.5, Vector::splat(0.1), 10.0);
        let upper = rigid_box(&mut physics, Vector::Y * 0.7, Vector::splat(0.1), 10.0 * ratio);
        let load = 10.0 * (1.0 + ratio) * G;
        let mut world = DeformableWorld::new();
        // 5 % of strain under the lower box's face.
        let e = (load / (0.05 * 0.04)).max(1e5);
        let body = world.insert(cube(DeformableMaterial::new(e, 0.3), 0.2)).unwrap();
        let speed = settle(&mut physics, &mut world, &[lower, upper], 480);
        let gap = physics.bodies[upper].translation().y - physics.bodies[lower].translation().y - 0.2;
        let carried = f64::from(world.contact_force(body, floor).y) / (load + 64.0 * G);
        println!("1:{ratio}: speed {speed:.1e} m/s, gap {gap:.1e} m, force/weight {carried:.6}");
        assert!(speed < 1e-3, "1:{ratio}: {speed:e} m/s");
        assert!(f64::from(gap).abs() < 1e-4, "1:{ratio}: {gap:e} m");
        assert!((carried - 1.0).abs() < 1e-3, "1:{ratio}: {carried}");
    }
}

#[test]
fn a_light_plate_between_cube_and_floor_keeps_its_height() {
    let (mut physics, _) = world_with_floor(H);
    let plate = rigid_box(&mut physics, Vector::Y * 0.01, Vector::new(0.25, 0.01, 0.25), 0.064);
    let mut world = DeformableWorld::new();
    world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.22)).unwrap();
    let speed = settle(&mut physics, &mut world, &[plate], 300);
    let height = f64::from(physics.bodies[plate].translation().y) - 0.01;
    println!("plate: {height:.1e} m off, {speed:.1e} m/s");
    assert!(height.abs() < 1e-4, "{height:e} m");
    assert!(speed < 1e-3, "{speed:e} m/s");
}
