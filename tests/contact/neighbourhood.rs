//! Soft bodies between rigid ones that rest on one another, hang on joints, or are parts of arms.
use crate::common::*;
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
        // Between the two boxes: all of it, of which rapier's own contacts show next to nothing.
        let between: f64 = world.rigid_contacts().iter().map(|c| f64::from(c.force.y.abs())).sum();
        assert!((between / (10.0 * ratio * G) - 1.0).abs() < 1e-4, "1:{ratio}: {between} N between them");
        println!("1:{ratio}: speed {speed:.1e} m/s, gap {gap:.1e} m, force/weight {carried:.6}");
        assert!(speed < 1e-5, "1:{ratio}: {speed:e} m/s");
        // Rapier's f32 places, of half a metre: some ten roundings of 3e-8 m.
        assert!(f64::from(gap).abs() < 1e-6, "1:{ratio}: {gap:e} m");
        assert!((carried - 1.0).abs() < 1e-5, "1:{ratio}: {carried}");
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
    // An f32 of 1 cm is rounded to 1e-9 m.
    assert!(height.abs() < 1e-8, "{height:e} m");
    assert!(speed < 1e-6, "{speed:e} m/s");
}

#[test]
fn a_tower_of_soft_and_rigid_boxes_stands_still() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let (mut soft, mut rigid) = (Vec::new(), Vec::new());
    for k in 0..10 {
        let y = 0.2 + 0.4 * k as f32;
        if k % 2 == 0 {
            let material = DeformableMaterial::new(1e7, 0.3);
            soft.push(world.insert(cube(material, y)).unwrap());
        } else {
            rigid.push(rigid_box(&mut physics, Vector::Y * y, Vector::splat(0.2), 64.0));
        }
    }
    let start: Vec<Vector> = rigid.iter().map(|b| physics.bodies[*b].translation()).collect();
    for _ in 0..1800 {
        world.step(&mut physics);
    }
    let mut drift = 0.0f32;
    for (b, from) in rigid.iter().zip(&start) {
        let moved = physics.bodies[*b].translation() - from;
        drift = drift.max(moved.x.hypot(moved.z));
    }
    println!("tower: drift {drift:.1e} m");
    // A creep of 3e-7 m/s over 30 s.
    assert!(f64::from(drift) < 1e-5, "{drift:e} m");
    for (k, body) in soft.iter().enumerate() {
        let below = if k == 0 { floor } else { physics.bodies[rigid[k - 1]].colliders()[0] };
        // The soft box itself and everything above it.
        let above = (10 - 2 * k) as f64 * 64.0 * G;
        let carried = f64::from(world.contact_force(*body, below).y) / above;
        assert!((carried - 1.0).abs() < 1e-4, "interface {k}: {carried}");
    }
}

#[test]
fn a_hinged_lid_presses_on_a_cube_with_its_moment() {
    // A lid of 1 m hinged at x = −0.5 rests on a soft cube at x = 0.2: the cube carries
    // m g·(0.5 / 0.7) if the hinge carries the rest.
    let (mut physics, _) = world_with_floor(H);
    let lid = rigid_box(&mut physics, Vector::new(0.0, 0.42, 0.0), Vector::new(0.5, 0.02, 0.1), 20.0);
    let post = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::new(-0.5, 0.42, 0.0)));
    let hinge = RevoluteJointBuilder::new(Vector::Z)
        .local_anchor1(Vector::ZERO)
        .local_anchor2(Vector::new(-0.5, 0.0, 0.0));
    physics.impulse_joints.insert(post, lid, hinge, true);
    let mut world = DeformableWorld::new();
    let small = DeformableBodyBuilder::cuboid(Vector::new(0.05, 0.2, 0.05), [2, 6, 2])
        .can_sleep(false)
        .translation(Vector::new(0.2, 0.2, 0.0))
        .material(DeformableMaterial::new(1e6, 0.3).friction(MU));
    let body = world.insert(small).unwrap();
    let speed = settle(&mut physics, &mut world, &[lid], 300);
    let lid_collider = physics.bodies[lid].colliders()[0];
    let force = -f64::from(world.contact_force(body, lid_collider).y);
    // The lid sinks by a little: where the force acts on it, measured.
    let moment: f64 = world
        .contacts_with(lid_collider)
        .map(|c| {
            f64::from(-c.force.y) * (f64::from(c.point.x) + 0.5)
                + f64::from(c.force.x) * (f64::from(c.point.y) - 0.42)
        })
        .sum();
    println!("hinged lid: {force} N, moment {moment} N m of {}, speed {speed:.1e}", 20.0 * G * 0.5);
    assert!((moment / (20.0 * G * 0.5) - 1.0).abs() < 2e-4, "{moment} N m");
    let hinge_gap = physics.bodies[lid].position().transform_point(Vector::new(-0.5, 0.0, 0.0))
        - Vector::new(-0.5, 0.42, 0.0);
    assert!(hinge_gap.length() < 1e-4 && speed < 1e-3, "{hinge_gap} {speed:e}");
}

#[test]
fn a_motor_presses_with_its_greatest_force() {
    // A piston on a prismatic joint pushes a soft cube against a wall with a limited motor.
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let wall = RigidBodyBuilder::fixed().translation(Vector::X * 0.7);
    let (_, wall) = physics.insert(wall, ColliderBuilder::cuboid(0.5, 1.0, 1.0).friction(MU as f32));
    let base = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::X * -1.0));
    let piston = rigid_box(&mut physics, Vector::X * -0.31, Vector::splat(0.1), 2.0);
    let slide = PrismaticJointBuilder::new(Vector::X)
        .motor_model(MotorModel::ForceBased)
        .motor_velocity(0.5, 1e4)
        .motor_max_force(200.0);
    let joint = physics.impulse_joints.insert(base, piston, slide, true);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.0)).unwrap();
    let speed = settle(&mut physics, &mut world, &[piston], 240);
    let force = -f64::from(world.contact_force(body, wall).x);
    println!("motor: {force} N on the wall, {speed:.1e} m/s");
    assert!((force / 200.0 - 1.0).abs() < 1e-3, "{force} N");
    let motor = world.joint_force(SolvedJoint::Impulse(joint), 0);
    assert!((motor / 200.0 - 1.0).abs() < 1e-3, "{motor} N");
    assert!(speed < 1e-3);
    // The user's motor is as it was.
    let motor = physics.impulse_joints.get(joint).unwrap();
    assert_eq!(motor.data.motor_axes, JointAxesMask::LIN_X);
}

/// A bar hinged at one end to a fixed base, about z, as a multibody.
fn hinged_link(physics: &mut PhysicsWorld, half: f32, mass: f64) -> (RigidBodyHandle, MultibodyJointHandle) {
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let bar = rigid_box(physics, Vector::X * half, Vector::new(half, 0.05, 0.2), mass);
    let joint = RevoluteJointBuilder::new(Vector::Z).local_anchor2(Vector::X * -half);
    let joint = physics.multibody_joints.insert(base, bar, joint, true).unwrap();
    (bar, joint)
}

#[test]
fn a_cube_dropped_on_a_free_link_turns_it_like_a_rigid_one() {
    // Without gravity, thrown on the end of the bar. Both stay on it: the angular momentum about the
    // hinge is what the cube brought, shared by the two bodies.
    let spin = |soft: bool| {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let (bar, _) = hinged_link(&mut physics, 0.5, 20.0);
        let mut world = DeformableWorld::new();
        // Rapier computes the multibody's matrices in its first step.
        world.step(&mut physics);
        let at = Vector::new(0.8, 0.17, 0.0);
        let mut cube = None;
        if soft {
            let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3])
                .can_sleep(false)
                .translation(at)
                .linvel(Vector::Y * -2.0)
                .material(DeformableMaterial::new(1e6, 0.3).friction(MU));
            cube = Some(world.insert(builder).unwrap());
        } else {
            let body = rigid_box(&mut physics, at, Vector::splat(0.1), 8.0);
            physics.bodies[body].set_linvel(Vector::Y * -2.0, true);
        }
        for _ in 0..12 {
            world.step(&mut physics);
        }
        if let Some(cube) = cube {
            assert!(world.bodies[cube].is_enabled());
        }
        f64::from(physics.bodies[bar].angvel().z)
    };
    let (soft, rigid) = (spin(true), spin(false));
    println!("link: {soft} rad/s under a soft cube, {rigid} rad/s under a rigid one");
    assert!((soft / rigid - 1.0).abs() < 0.02, "{soft} {rigid}");
}

#[test]
fn an_arm_presses_a_pad_with_its_motors_torque() {
    // A motor of limited torque turns the arm down on a soft pad on the floor, without gravity.
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.75);
    let (_, floor) = physics.insert(floor, ColliderBuilder::cuboid(2.0, 0.5, 2.0).friction(MU as f32));
    let (bar, joint) = hinged_link(&mut physics, 0.5, 5.0);
    let (multibody, link) = physics.multibody_joints.get_mut(joint).unwrap();
    let motor = &mut multibody.link_mut(link).unwrap().joint.data;
    motor.set_motor_model(JointAxis::AngX, MotorModel::ForceBased);
    motor.set_motor_velocity(JointAxis::AngX, -1.0, 1e4);
    motor.set_motor_max_force(JointAxis::AngX, 30.0);
    let mut world = DeformableWorld::new();
    let pad = DeformableBodyBuilder::cuboid(Vector::new(0.05, 0.1, 0.05), [2, 4, 2])
        .can_sleep(false)
        .translation(Vector::new(0.8, -0.151, 0.0))
        .material(DeformableMaterial::new(1e6, 0.3).friction(MU));
    let pad = world.insert(pad).unwrap();
    let speed = settle(&mut physics, &mut world, &[bar], 300);
    let on_bar = physics.bodies[bar].colliders()[0];
    let torque: f64 = world
        .contacts_with(on_bar)
        .map(|c| f64::from(c.point.x) * f64::from(-c.force.y) - f64::from(c.point.y) * f64::from(-c.force.x))
        .sum();
    let on_floor = f64::from(world.contact_force(pad, floor).y);
    println!("arm: {torque} N m of 30 on the pad, {on_floor} N on the floor, {speed:.1e} m/s");
    assert!((torque.abs() / 30.0 - 1.0).abs() < 1e-2, "{torque} N m");
    // The joint's torque is the lever arm times the contact force.
    let motor = world.joint_force(SolvedJoint::Multibody(bar), 3);
    assert!((motor + torque).abs() < 1e-2 * torque.abs(), "{motor} N m against {torque} N m");
    assert!((on_floor / (torque.abs() / 0.8) - 1.0).abs() < 0.05, "{on_floor} N");
    assert!(speed < 1e-3, "{speed:e}");
}

/// A box with a soft cube attached to its upper side, thrown onto the floor.
fn throw_with_a_cube(
    groups: InteractionGroups,
    restitution: f32,
) -> (PhysicsWorld, DeformableWorld, RigidBodyHandle) {
    let (mut physics, _) = world_with_floor(H);
    let shape =
        ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(4000.0).friction(MU as f32).collision_groups(groups);
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5).can_sleep(false);
    let (load, _) = physics.insert(body, shape.restitution(restitution));
    let mut world = DeformableWorld::new();
    let soft = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).translation(Vector::Y * 0.7);
    let soft = soft.material(DeformableMaterial::new(1e6, 0.3).friction(MU).mass_damping(1.0));
    let soft = soft.can_sleep(false).collision_groups(groups);
    let soft = world.insert(soft).unwrap();
    let lower = at_rest_where(&world.bodies[soft], |x| x[1] < -0.099);
    world.bodies.attach(soft, &lower, AttachTo::RigidBody(load, *physics.bodies[load].position())).unwrap();
    (physics, world, load)
}

/// Stopped by rapier's own solver, such a box turns at 0.4 rad/s and is pushed up at 0.08 m/s in the steps after.
#[test]
fn a_box_that_carries_a_soft_body_lands_flat_and_without_a_kick() {
    let (mut physics, mut world, load) = throw_with_a_cube(InteractionGroups::all(), 0.0);
    let (mut up, mut turn, mut carried) = (0.0f32, 0.0f32, 0.0f32);
    for _ in 0..180 {
        world.step(&mut physics);
        up = up.max(physics.bodies[load].linvel().y);
        turn = turn.max(physics.bodies[load].angvel().length());
        carried = world.rigid_contacts().iter().map(|c| c.force.y.abs()).sum();
    }
    println!("lands at most {up:.1e} m/s upwards, turning at {turn:.1e} rad/s");
    assert!(up < 1e-3 && turn < 1e-3, "{up:e} m/s, {turn:e} rad/s");
    let weight = (32.0 + 8.0) * G as f32;
    assert!((carried / weight - 1.0).abs() < 1e-3, "{carried} of {weight} N");
    assert!((physics.bodies[load].translation().y - 0.1).abs() < 1e-5);
}

/// What rapier lets through is let through, and bounces as it was told.
#[test]
fn boxes_that_carry_a_soft_body_meet_what_rapier_lets_them_meet() {
    let (mut physics, mut world, load) = throw_with_a_cube(InteractionGroups::none(), 0.0);
    (0..60).for_each(|_| world.step(&mut physics));
    assert!(physics.bodies[load].translation().y < -1.0, "{}", physics.bodies[load].translation());
    let (mut physics, mut world, load) = throw_with_a_cube(InteractionGroups::all(), 1.0);
    let fastest = (0..30)
        .map(|_| {
            world.step(&mut physics);
            physics.bodies[load].linvel().y
        })
        .fold(0.0, f32::max);
    println!("bounces at {fastest} m/s");
    // From 0.4 m at 2.8 m/s; half of that is the floor's restitution.
    assert!(fastest > 1.0, "{fastest} m/s");
}
