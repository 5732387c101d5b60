//! Fast bodies: nothing passes through anything.
mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

#[test]
fn a_cube_at_100_metres_a_second_does_not_pass_a_slab_of_a_centimetre() {
    for e in [1e5, 1e6, 1e8] {
        for (speed, turn) in [(20.0, 0.0), (100.0, 0.0), (100.0, 0.7)] {
            let mut physics = PhysicsWorld::new();
            let slab = RigidBodyBuilder::fixed().translation(Vector::Y * -0.005);
            physics.insert(slab, ColliderBuilder::cuboid(5.0, 0.005, 5.0).friction(MU as f32));
            let mut world = DeformableWorld::new();
            let body = cube(DeformableMaterial::new(e, 0.3), 1.3)
                .rotation(Vector::new(turn, 0.0, 0.3 * turn))
                .linvel(Vector::Y * -speed);
            let body = world.insert(body).unwrap();
            let mut deepest = f64::NEG_INFINITY;
            for _ in 0..120 {
                world.step(&mut physics);
                deepest = deepest.max(depth_below_floor(&world.bodies[body]));
            }
            let what = format!("E {e:e}, {speed} m/s, turned by {turn}");
            println!("{what}: {deepest:.1e} m deep at the deepest");
            assert!(world.bodies[body].is_enabled(), "{what}");
            assert!(world.bodies[body].center_of_mass()[1] > 0.0, "{what}: passed through");
        }
    }
}

#[test]
fn a_bullet_does_not_pass_a_soft_wall() {
    for speed in [10.0, 50.0, 100.0] {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let ball = RigidBodyBuilder::dynamic().translation(Vector::X * -1.0).linvel(Vector::X * speed);
        let shape = ColliderBuilder::ball(0.03).density(1000.0).friction(MU as f32);
        let (ball, _) = physics.insert(ball.ccd_enabled(true).can_sleep(false), shape);
        let mut world = DeformableWorld::new();
        let wall = DeformableBodyBuilder::cuboid(Vector::new(0.05, 0.3, 0.3), [2, 8, 8])
            .can_sleep(false)
            .material(DeformableMaterial::new(1e6, 0.3).friction(MU))
            .pinned(|x| x.y.abs() > 0.29 || x.z.abs() > 0.29);
        let wall = world.insert(wall).unwrap();
        for _ in 0..120 {
            world.step(&mut physics);
        }
        let x = physics.bodies[ball].translation().x;
        println!("{speed} m/s: ball at x = {x} m");
        assert!(world.bodies[wall].is_enabled() && x < 0.1, "{speed} m/s: at {x}");
    }
}
