//! Limits and motors of rapier's hinges under soft loads, by the measures of `tests/common/joints.rs`.
use crate::common::joints::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const BAR: f64 = 10.0;
const CUBE: f64 = 8.0;
const MODELS: [MotorModel; 2] = [MotorModel::ForceBased, MotorModel::AccelerationBased];

/// A bar of 1 m and 10 kg, hinged about z at the origin and turned by `angle` [rad].
fn hinged_bar(
    physics: &mut PhysicsWorld,
    angle: f32,
    hinge: RevoluteJointBuilder,
) -> (RigidBodyHandle, ImpulseJointHandle) {
    physics.integration_parameters.dt = H;
    let post = physics.insert_body(RigidBodyBuilder::fixed());
    let along = Vector::new(angle.cos(), angle.sin(), 0.0);
    let bar = rigid_box(physics, along * 0.5, Vector::new(0.5, 0.05, 0.2), BAR);
    let pose = Pose::from_parts(along * 0.5, Rotation::from_rotation_z(angle));
    physics.bodies[bar].set_position(pose, true);
    let joint = physics.impulse_joints.insert(post, bar, hinge.local_anchor2(Vector::X * -0.5), true);
    (bar, joint)
}

/// How far the bar has turned about its hinge [rad], and its hinge's gap [m].
fn hinge_of(physics: &PhysicsWorld, bar: RigidBodyHandle) -> [f64; 2] {
    let pose = physics.bodies[bar].position();
    let along = pose.rotation * Vector::X;
    let gap = pose.transform_point(Vector::X * -0.5).length();
    [f64::from(along.y).atan2(f64::from(along.x)), f64::from(gap)]
}

/// Ties the cube to the bar where it is.
fn attach(
    world: &mut DeformableWorld,
    physics: &PhysicsWorld,
    builder: DeformableBodyBuilder,
    bar: RigidBodyHandle,
) {
    let cube = world.insert(builder).unwrap();
    let side = at_rest_where(&world.bodies[cube], |x| x[1] < -0.099);
    let pose = *physics.bodies[bar].position();
    world.bodies.attach(cube, &side, AttachTo::RigidBody(bar, pose)).unwrap();
}

/// Moment of the bar's and the only soft body's weights about the hinge [N m].
fn weights_moment(physics: &PhysicsWorld, world: &DeformableWorld, bar: RigidBodyHandle) -> f64 {
    let soft: f64 = world.bodies.iter().map(|(_, b)| b.mass() * b.center_of_mass()[0]).sum();
    -G * (BAR * f64::from(physics.bodies[bar].translation().x) + soft)
}

#[test]
fn a_hinge_at_its_limit_balances_the_moment_of_a_soft_load() {
    // Friction holds the cube on the level bar; the limit is level.
    let mut physics = PhysicsWorld::new();
    let hinge = RevoluteJointBuilder::new(Vector::Z).limits([0.0, 1.0]);
    let (bar, joint) = hinged_bar(&mut physics, 0.0, hinge);
    let mut world = DeformableWorld::new();
    world.insert(small_cube(Vector::new(0.8, 0.15, 0.0))).unwrap();
    let joint = SolvedJoint::Impulse(joint);
    let [limit, moment, vertical, angle, gap] = rest(&mut physics, &mut world, 300, |physics, world| {
        let [angle, gap] = hinge_of(physics, bar);
        // The joint's frame has its x along the world's z.
        let forces: f64 = (0..3).map(|axis| world.joint_force(joint, axis).powi(2)).sum::<f64>().sqrt();
        [world.joint_force(joint, 3), weights_moment(physics, world, bar), forces, angle, gap]
    });
    is_near("limit", limit, -moment, STATIC);
    is_near("hinge", vertical, (BAR + CUBE) * G, STATIC);
    // Turns and places of size 1 in f32, of a few substeps.
    assert!(angle.abs() < 1e-6 && gap < 1e-6, "{angle:e} rad, {gap:e} m");
}

/// The bar at an angle, with the cube attached to it, if it is to have it, or by rapier alone.
fn attached_bar(angle: f32, gravity: Vector, hinge: RevoluteJointBuilder, soft: bool) -> Attached {
    let mut physics = PhysicsWorld::new();
    physics.gravity = gravity;
    let (bar, joint) = hinged_bar(&mut physics, angle, hinge);
    let mut world = DeformableWorld::new();
    if soft {
        // A centimetre above the bar: no contact shares the load with the attachment.
        let at = physics.bodies[bar].position().transform_point(Vector::new(0.3, 0.16, 0.0));
        attach(&mut world, &physics, small_cube(at).rotation(Vector::Z * angle), bar);
    }
    Attached { physics, world, bar, joint: SolvedJoint::Impulse(joint) }
}

struct Attached {
    physics: PhysicsWorld,
    world: DeformableWorld,
    bar: RigidBodyHandle,
    joint: SolvedJoint,
}

/// A range that goes through half a turn is one range: rapier measures angles from its middle.
#[test]
fn a_hinge_with_limits_across_half_a_turn_rests_on_its_upper_limit() {
    for soft in [false, true] {
        let hinge = RevoluteJointBuilder::new(Vector::Z).limits([2.8, 3.4]);
        let Attached { mut physics, mut world, bar, joint } =
            attached_bar(3.3, Vector::Y * -9.81, hinge, soft);
        let [limit, moment, angle] = rest(&mut physics, &mut world, 300, |physics, world| {
            let [angle, _] = hinge_of(physics, bar);
            let limit = world.joint_force(joint, 3);
            [limit, weights_moment(physics, world, bar), angle.rem_euclid(std::f64::consts::TAU)]
        });
        // Rapier's limits give way a little.
        is_near("angle", angle, f64::from(3.4f32), 1e-3);
        if soft {
            // Where the limit is, rapier knows to two units of an f32 near 3.4, 2.4e-7 rad each: it turns the inertia
            // about the hinge back by that in every step.
            let inertia = BAR / 3.0 + CUBE * 0.8f64.powi(2);
            let rounding = 2.0 * 2.4e-7 * inertia / f64::from(H * H) / moment;
            is_near("limit", limit, -moment, STATIC + rounding);
        }
    }
}

/// As rapier does, a motor goes the shorter way round.
#[test]
fn a_hinge_is_driven_across_half_a_turn_with_a_soft_load() {
    for (soft, model) in [false, true].into_iter().flat_map(|soft| MODELS.map(|model| (soft, model))) {
        let hinge = RevoluteJointBuilder::new(Vector::Z).motor_model(model).motor_position(3.3, 400.0, 100.0);
        let Attached { mut physics, mut world, bar, .. } = attached_bar(3.0, Vector::ZERO, hinge, soft);
        let [angle] = rest(&mut physics, &mut world, 420, |physics, _| {
            [hinge_of(physics, bar)[0].rem_euclid(std::f64::consts::TAU)]
        });
        // d/k·v of a speed of STILL at half a metre: 0.25 s · 2e-4 rad/s.
        assert!((angle - 3.3).abs() < 5e-5, "{model:?}, soft load {soft}: {angle} rad");
    }
}

/// Rapier scales the motor of an impulse joint by the inertia about the centre of mass, whatever the lever.
#[test]
fn an_arm_with_a_position_motor_sags_by_moment_over_stiffness() {
    let inertia = BAR * (1.0f64.powi(2) + 0.1f64.powi(2)) / 12.0;
    for (model, per_mass) in [(MotorModel::ForceBased, 1.0), (MotorModel::AccelerationBased, inertia)] {
        let [stiffness, damping] = [2240.0, 280.0].map(|c: f64| (c / per_mass) as f32);
        let hinge = RevoluteJointBuilder::new(Vector::Z).motor_model(model);
        let hinge = hinge.motor_position(0.0, stiffness, damping);
        let mut physics = PhysicsWorld::new();
        let (bar, joint) = hinged_bar(&mut physics, 0.0, hinge);
        let mut world = DeformableWorld::new();
        world.insert(small_cube(Vector::new(0.8, 0.15, 0.0))).unwrap();
        let [motor, moment, angle, gap] = rest(&mut physics, &mut world, 600, |physics, world| {
            let [angle, gap] = hinge_of(physics, bar);
            let motor = world.joint_force(SolvedJoint::Impulse(joint), 3);
            [motor, weights_moment(physics, world, bar), angle, gap]
        });
        is_near("motor", motor, -moment, STATIC);
        // d/k·v of the sag of 0.05 rad: 0.125 s · 2e-4 rad/s.
        is_near("sag", angle, moment / 2240.0, STATIC + 5e-4);
        assert!(gap < 1e-6, "{gap:e} m");
    }
}

/// Turns of the bar about its hinge \[rad\] after a number of steps, counted from step to step.
fn turned(multibody: bool, soft: bool, hinge: RevoluteJointBuilder, spin: f32, steps: usize) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = H;
    let post = physics.insert_body(RigidBodyBuilder::fixed());
    let bar = rigid_box(&mut physics, Vector::X * 0.5, Vector::new(0.5, 0.05, 0.2), BAR);
    let joint = hinge.local_anchor2(Vector::X * -0.5);
    if multibody {
        physics.multibody_joints.insert(post, bar, joint, true);
    } else {
        physics.impulse_joints.insert(post, bar, joint, true);
    }
    // Rapier's multibodies take their velocities from their bodies once they have been stepped.
    physics.step();
    physics.bodies[bar].set_linvel(Vector::Y * 0.5 * spin, true);
    physics.bodies[bar].set_angvel(Vector::Z * spin, true);
    let mut world = DeformableWorld::new();
    if soft {
        let pose = *physics.bodies[bar].position();
        let at = pose.transform_point(Vector::new(0.3, 0.16, 0.0));
        let material = DeformableMaterial::new(1e6, 0.3);
        let cube = small_cube(at).rotation(pose.rotation.to_scaled_axis()).material(material);
        attach(&mut world, &physics, cube, bar);
        let omega = Vector::Z * spin;
        world.bodies.iter_mut().for_each(|(_, b)| b.set_vels(omega.cross(at), omega).unwrap());
    }
    let mut angle = hinge_of(&physics, bar)[0];
    for _ in 0..steps {
        world.step(&mut physics);
        let now = hinge_of(&physics, bar)[0];
        angle +=
            (now - angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    }
    angle
}

/// A multibody's coordinates count turns: its motor winds up to targets beyond one, and its limits may lie there.
#[test]
fn a_multibody_hinge_is_driven_over_more_than_a_turn_with_a_soft_load() {
    for (soft, target) in [(false, 4.0), (true, 4.0), (false, 10.0), (true, 10.0)] {
        let hinge = RevoluteJointBuilder::new(Vector::Z).motor_model(MotorModel::ForceBased);
        let angle = turned(true, soft, hinge.motor_position(target, 400.0, 100.0), 0.0, 420);
        // As impulse joints do; ω = √(k/I) and 7 s leave nothing of the way.
        assert!((angle - f64::from(target)).abs() < 1e-3, "soft load {soft}: {angle} of {target} rad");
    }
    for soft in [false, true] {
        let hinge = RevoluteJointBuilder::new(Vector::Z).limits([0.0, 7.0]);
        let angle = turned(true, soft, hinge, 3.0, 420);
        assert!((0.0..7.01).contains(&angle), "soft load {soft}: {angle} rad");
    }
}

/// As rapier's impulse joints, whose angles do not count turns: a range of a turn or more, or with one side, is no limit.
#[test]
fn a_range_of_a_full_turn_does_not_stop_a_hinge_with_a_soft_load() {
    let ranges = [[-std::f32::consts::PI, std::f32::consts::PI], [0.0, 7.0], [-f32::MAX, 1.0]];
    for (soft, range) in [false, true].into_iter().flat_map(|soft| ranges.map(|range| (soft, range))) {
        let hinge = RevoluteJointBuilder::new(Vector::Z).limits(range);
        let angle = turned(false, soft, hinge, 3.0, 240);
        println!("soft load {soft}, range {range:?}: {angle} rad");
        // 12 rad, but for the damping of implicit Euler.
        assert!(angle > 10.0, "soft load {soft}, range {range:?}: {angle} rad");
    }
}
