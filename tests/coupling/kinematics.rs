//! Bodies that are fixed or led, and pins that move.

use crate::common::games::{H, cuboid, weightless};
use crate::common::{G, world_with_floor};
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

#[test]
fn a_fixed_body_carries_and_is_let_go_as_it_was() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let slab =
        cuboid(Vector::new(0.5, 0.05, 0.5), [5, 1, 5]).translation(Vector::Y * 0.5).pinned(|x| x.x < -0.49);
    let slab = world.insert(slab.body_type(RigidBodyType::Fixed)).unwrap();
    let soft =
        world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::new(0.2, 0.66, 0.0))).unwrap();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(-0.2, 0.66, 0.0)).can_sleep(false);
    let (rigid, _) = physics.insert(rigid, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(1000.0));
    assert_eq!(world.bodies[slab].pinned().len(), 12);
    let before = world.bodies[slab].state().clone();
    for _ in 0..180 {
        world.step(&mut physics);
    }
    let positions = |body: &DeformableBody| {
        (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect::<Vec<_>>()
    };
    let mut there = world.bodies[slab].clone();
    there.restore(before).unwrap();
    assert_eq!(positions(&world.bodies[slab]), positions(&there), "it has not moved by a bit");
    assert!((world.bodies[soft].center_of_mass()[1] - 0.65).abs() < 2e-3);
    assert!((physics.bodies[rigid].translation().y - 0.65).abs() < 1e-3);
    // Both weights, the slab's own is no one's.
    let force = world.bodies[slab].pin_force();
    let expected =
        (world.bodies[soft].mass() + f64::from(physics.bodies[rigid].mass()) + world.bodies[slab].mass()) * G;
    assert!((force[1] - expected).abs() < 1e-2 * expected, "{force:?} {expected}");
    world.bodies[slab].set_body_type(RigidBodyType::Dynamic);
    for _ in 0..60 {
        world.step(&mut physics);
    }
    let slab = &world.bodies[slab];
    assert_eq!(slab.pinned().len(), 12);
    assert!(slab.aabb().mins.y < 0.3, "its free end hangs down");
    let held = slab.pinned().map(|v| slab.position(v).unwrap()[0]).fold(f64::NEG_INFINITY, f64::max);
    assert!(held < -0.499);
}

#[test]
fn kinematic_bodies_carry_what_lies_on_them() {
    for by_velocity in [false, true] {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let kind = if by_velocity {
            RigidBodyType::KinematicVelocityBased
        } else {
            RigidBodyType::KinematicPositionBased
        };
        let lift =
            cuboid(Vector::new(0.5, 0.05, 0.5), [5, 1, 5]).translation(Vector::Y * 0.2).body_type(kind);
        let lift = world.insert(lift).unwrap();
        let load = cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::new(0.2, 0.355, 0.0));
        let load = world.insert(load).unwrap();
        let (speed, turn) = (0.3, 0.5);
        if by_velocity {
            world.bodies[lift].set_vels(Vector::Y * speed, Vector::Y * turn).unwrap();
        }
        let before = world.bodies[lift].elastic_energy();
        for step in 1..=120 {
            if !by_velocity {
                let t = step as f32 * H;
                let at = Pose::from_parts(
                    Vector::Y * (0.2 + speed * t),
                    Rotation::from_scaled_axis(Vector::Y * (turn * t)),
                );
                world.bodies[lift].set_next_kinematic_position(at).unwrap();
            }
            world.step(&mut physics);
        }
        let [x, y, z] = world.bodies[load].center_of_mass();
        println!("{kind:?}: {x} {y} {z}, {:?}", world.bodies[lift].pose());
        assert!((y - (0.95)).abs() < 5e-3, "{y}");
        // Carried round by one radian, on the same circle but for what it slips at the start.
        assert!((x.hypot(z) - 0.2).abs() < 5e-3 && ((-z).atan2(x) - 1.0).abs() < 0.05, "{x} {z}");
        let at = world.bodies[lift].pose();
        assert!((at.translation.y - 0.8).abs() < 1e-5 && world.bodies[lift].elastic_energy() < before + 1e-9);
        // What stands still is asleep, what moves is not.
        assert!(!world.bodies[lift].is_sleeping());
        world.bodies[lift].set_vels(Vector::ZERO, Vector::ZERO).unwrap();
        for _ in 0..120 {
            world.step(&mut physics);
        }
        assert!(world.bodies[lift].is_sleeping() && world.bodies[load].is_sleeping());
    }
}

#[test]
fn kinematic_bodies_follow_positions_vertex_by_vertex() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let body = cuboid(Vector::splat(0.2), [2; 3]).body_type(RigidBodyType::KinematicPositionBased);
    let body = world.insert(body).unwrap();
    let wider: Vec<Vector> = world.bodies[body].positions().map(|x| x * 1.5 + Vector::Z).collect();
    world.bodies[body].set_next_kinematic_positions(&wider).unwrap();
    world.step(&mut physics);
    let off = world.bodies[body].positions().zip(&wider).map(|(a, b)| (a - *b).length()).fold(0.0, f32::max);
    assert!(off < 1e-6, "{off}");
    let dynamic = world.insert(cuboid(Vector::splat(0.2), [2; 3])).unwrap();
    let dynamic = &mut world.bodies[dynamic];
    assert_eq!(dynamic.set_next_kinematic_positions(&wider), Err(BodyError::NotKinematic));
    let few = BodyError::WrongSize { vertices: 3, expected: 27 };
    assert_eq!(dynamic.set_next_kinematic_positions(&wider[..3]), Err(few));
}

#[test]
fn pins_move_on_with_their_velocity() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let bar = cuboid(Vector::new(0.3, 0.05, 0.05), [6, 1, 1]).pinned(|x| x.x > 0.29);
    let bar = world.insert(bar).unwrap();
    let held: Vec<usize> = world.bodies[bar].pinned().collect();
    held.iter().for_each(|&v| world.bodies[bar].set_pin_velocity(v, Vector::X * 0.005).unwrap());
    for _ in 0..240 {
        world.step(&mut physics);
    }
    let x = world.bodies[bar].position(held[0]).unwrap()[0];
    assert!((x - (0.3 + 0.005 * 240.0 * f64::from(H))).abs() < 1e-7, "{x}");
    assert!(!world.bodies[bar].is_sleeping(), "slower than the threshold, and led all the same");
    held.iter().for_each(|&v| world.bodies[bar].set_pin_velocity(v, Vector::ZERO).unwrap());
    for _ in 0..240 {
        world.step(&mut physics);
    }
    assert!(world.bodies[bar].is_sleeping());
    let free = (0..world.bodies[bar].vertex_count()).find(|v| !held.contains(v)).unwrap();
    let refused = world.bodies[bar].set_pin_velocity(free, Vector::X);
    assert_eq!(refused, Err(BodyError::NotPinned { vertex: free }));
}

#[test]
fn what_was_pinned_before_it_was_led_is_held_where_it_is_let_go() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let body = world.insert(cuboid(Vector::splat(0.1), [2; 3]).pinned(|x| x.y > 0.09)).unwrap();
    world.bodies[body].set_body_type(RigidBodyType::KinematicVelocityBased);
    world.bodies[body].set_linvel(Vector::X * 5.0).unwrap();
    (0..60).for_each(|_| world.step(&mut physics));
    world.bodies[body].set_linvel(Vector::ZERO).unwrap();
    world.step(&mut physics);
    world.bodies[body].set_body_type(RigidBodyType::Dynamic);
    world.step(&mut physics);
    assert!(
        world.bodies[body].max_speed() < 1e-6 && (world.bodies[body].center_of_mass()[0] - 5.0).abs() < 1e-5
    );
    assert_eq!(world.bodies[body].pinned().len(), 9);
}

#[test]
fn fixed_bodies_stay_whatever_is_asked_of_them() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let body = world
        .insert(cuboid(Vector::splat(0.1), [2; 3]).pinned(|x| x.y > 0.09).body_type(RigidBodyType::Fixed))
        .unwrap();
    let own = &mut world.bodies[body];
    let pinned: Vec<usize> = own.pinned().collect();
    own.set_pin_velocity(pinned[0], Vector::X).unwrap();
    own.set_velocity(3, Vector::X).unwrap();
    own.apply_impulse_at_point(Vector::X * 9.0, Vector::Y).unwrap();
    assert_eq!(own.max_speed(), 0.0);
    let before: Vec<Vector> = own.positions().collect();
    (0..20).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[body].positions().eq(before));
    // But for a vertex that is put elsewhere: it stays there.
    world.bodies[body].set_position(0, [1.0, 2.0, 3.0]).unwrap();
    world.step(&mut physics);
    assert_eq!(world.bodies[body].position(0).unwrap(), [1.0, 2.0, 3.0]);
    assert_eq!(world.bodies[body].max_speed(), 0.0);
}
