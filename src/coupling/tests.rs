//! What is read of rapier's sets: masses, motions, constraints of joints, keys of constraints.

use super::joint_constraints::{JointEnds, JointName, joint_constraints};
use super::neighbourhood::{RigidNeighbourhood, WalkContext};
use super::parts::{PhysicsParts, StepContext};
use super::scene::RapierScene;
use crate::body::{ConstraintKey, JointAxis as Axis, JointRole};
use crate::contact::{Candidates, Constraint, Endpoint, Law, ProxyId};
use crate::math::{Mat3, Pose64, Vec3, from_real, rotation_from_vector, rotation_vector};
use crate::solver::{RigidProxies, RigidProxy, Twist};
use proptest::prelude::*;
use rapier3d::prelude::{
    ColliderBuilder, FixedJointBuilder, GenericJoint, JointAxis, MotorModel, PhysicsWorld, Pose,
    PrismaticJointBuilder, RevoluteJointBuilder, RigidBodyBuilder, RigidBodyHandle, RopeJointBuilder,
    Rotation, SharedShape, SphericalJointBuilder, SpringJointBuilder, Vector,
};

const H: f64 = 1.0 / 60.0;
/// Of `f32`, relative, after some tens of operations.
const SINGLE: f64 = 2e-6;

fn vector() -> impl Strategy<Value = Vec3> {
    [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(Vec3::from)
}

fn real(v: &Vec3) -> Vector {
    crate::math::to_real(v)
}

/// A box of 2 × 4 × 6 dm and 48 kg off its body's origin.
fn insert_box(physics: &mut PhysicsWorld, body: RigidBodyBuilder) -> RigidBodyHandle {
    let shape =
        ColliderBuilder::cuboid(0.1, 0.2, 0.3).translation(Vector::new(0.3, 0.0, 0.1)).density(1000.0);
    physics.insert(body, shape).0
}

fn context<'a>(parts: &'a PhysicsParts<'_>) -> StepContext<'a> {
    StepContext { sets: parts.sets(), gravity: from_real(parts.gravity), h: H, substeps: 4, hooks: &() }
}

fn read(physics: &mut PhysicsWorld, body: RigidBodyHandle) -> RigidProxy {
    let parts = PhysicsParts::from(physics);
    let mut scene = RapierScene::default();
    let id = scene.body_proxy(&context(&parts), body).unwrap();
    *scene.proxies.get(id)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Before rapier's first step too, in which its own are zero.
    #[test]
    fn masses_are_those_of_the_colliders_at_the_bodys_pose(at in vector(), turn in vector(), steps in 0..2u8) {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let pose = Pose::from_parts(real(&at), Rotation::from_scaled_axis(real(&turn)));
        let body = insert_box(&mut physics, RigidBodyBuilder::dynamic().pose(pose));
        (0..steps).for_each(|_| physics.step());
        let RigidProxy::Rigid { com, inv_mass, inv_inertia, steady_inv_inertia, .. } = read(&mut physics, body) else {
            return Err(TestCaseError::fail("a dynamic body yields"));
        };
        let R = Pose64::from_real(&pose).rotation;
        let squares = Vec3::new(0.2f64.powi(2), 0.4f64.powi(2), 0.6f64.powi(2));
        let inertia = Vec3::repeat(squares.sum()) - squares;
        let expected = R * Mat3::from_diagonal(&inertia.map(|i| 12.0 / (48.0 * i))) * R.transpose();
        prop_assert!((com - (at + R * Vec3::new(0.3, 0.0, 0.1))).norm() < 2.0 * SINGLE);
        prop_assert!((inv_mass * 48.0 - Vec3::repeat(1.0)).amax() < SINGLE);
        prop_assert!((inv_inertia - expected).amax() < SINGLE * expected.amax(), "{} {}", inv_inertia, expected);
        // Its rotation is rounded to 2⁻¹⁴ of quaternions: by half of that in each of four, twice that in angles.
        prop_assert!((steady_inv_inertia - expected).amax() < 4.0 * 2f64.powi(-14) * expected.amax());
    }

    #[test]
    fn locked_axes_have_no_inverse_masses(turn in vector(), axes in 0..8u8, angular in 0..8u8) {
        let free = |mask: u8, k: usize| mask >> k & 1 == 1;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let builder = RigidBodyBuilder::dynamic()
            .rotation(real(&turn))
            .enabled_translations(free(axes, 0), free(axes, 1), free(axes, 2))
            .enabled_rotations(free(angular, 0), free(angular, 1), free(angular, 2));
        let body = insert_box(&mut physics, builder);
        let RigidProxy::Rigid { inv_mass, inv_inertia, steady_inv_inertia, .. } = read(&mut physics, body) else {
            return Err(TestCaseError::fail("a dynamic body yields"));
        };
        for k in 0..3 {
            prop_assert_eq!(inv_mass[k] > 0.0, free(axes, k));
            for j in 0..3 {
                if !(free(angular, k) && free(angular, j)) {
                    prop_assert_eq!([inv_inertia[(k, j)], steady_inv_inertia[(k, j)]], [0.0; 2]);
                }
            }
            prop_assert_eq!(inv_inertia[(k, k)] > 0.0, free(angular, k));
        }
        // Rapier moves the body by the same, once it has stepped.
        physics.step();
        physics.bodies[body].apply_torque_impulse(Vector::new(1.0, 2.0, -3.0), true);
        physics.bodies[body].apply_impulse(Vector::new(1.0, 2.0, -3.0), true);
        let by_rapier = (physics.bodies[body].linvel(), physics.bodies[body].angvel());
        let kick = Vec3::new(1.0, 2.0, -3.0);
        prop_assert!((from_real(by_rapier.0) - inv_mass.component_mul(&kick)).amax() < SINGLE);
        prop_assert!((from_real(by_rapier.1) - inv_inertia * kick).amax() < SINGLE * 4.0);
    }

    /// A screw about the centre of mass, as rapier moves it, whichever way it is told.
    #[test]
    fn kinematic_obstacles_go_where_rapier_takes_them(
        at in vector(), turn in vector(), linvel in vector(), angvel in vector(), by_velocity in any::<bool>(),
    ) {
        let mut physics = PhysicsWorld::new();
        let pose = Pose::from_parts(real(&at), Rotation::from_scaled_axis(real(&turn)));
        let next = Pose::from_parts(
            real(&(at + linvel * H)),
            Rotation::from_scaled_axis(real(&(angvel * H))) * Rotation::from_scaled_axis(real(&turn)),
        );
        let builder = if by_velocity {
            RigidBodyBuilder::kinematic_velocity_based().linvel(real(&linvel)).angvel(real(&angvel))
        } else {
            RigidBodyBuilder::kinematic_position_based()
        };
        let body = insert_box(&mut physics, builder.pose(pose));
        // A first step, from which bodies know their colliders.
        if by_velocity {
            physics.step();
        } else {
            physics.bodies[body].set_next_kinematic_position(next);
        }
        let mut scene = RapierScene::default();
        scene.read(&context(&PhysicsParts::from(&mut physics)));
        let obstacle = &scene.obstacles[0];
        let offset = Pose64::from_real(&Pose::from_translation(Vector::new(0.3, 0.0, 0.1)));
        let start = Pose64::from_real(physics.bodies[body].position());
        let com = from_real(physics.bodies[body].center_of_mass());
        physics.step();
        let end = Pose64::from_real(physics.bodies[body].position());
        for corner in [Vec3::zeros(), Vec3::new(0.1, 0.2, 0.3), Vec3::new(-0.1, 0.2, -0.3)] {
            let p = start.compose(&offset).transform(&corner);
            let moved = obstacle.displacement(&p, &obstacle.start.inverse_transform(&p));
            let by_rapier = end.compose(&offset).transform(&corner) - p;
            // Places of up to 2 m in f32; and rapier turns in substeps.
            prop_assert!((moved - by_rapier).norm() < 2.0 * SINGLE, "{} {}", moved, by_rapier);
            if by_velocity {
                let screw = com + linvel * H + rotation_from_vector(&(angvel * H)) * (p - com) - p;
                prop_assert!((moved - screw).norm() < 2.0 * SINGLE, "{} {}", moved, screw);
            }
        }
    }
}

/// Two bodies that yield, their centres of mass off their origins.
fn yielding(poses: &[Pose64; 2]) -> RigidProxies {
    let mut proxies = RigidProxies::default();
    for (pose, arm) in poses.iter().zip([Vec3::new(0.1, -0.2, 0.3), Vec3::new(-0.3, 0.1, 0.2)]) {
        let inertia = Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 3.0));
        proxies.push(RigidProxy::Rigid {
            com: pose.transform(&arm),
            inv_mass: Vec3::repeat(0.5),
            inv_inertia: inertia,
            steady_inv_inertia: inertia,
            twist: Twist::default(),
            free: Twist::default(),
        });
    }
    proxies
}

fn constraints_of(joint: &GenericJoint, poses: [Pose64; 2], proxies: &RigidProxies) -> Vec<Constraint> {
    let name = JointName::Multibody(RigidBodyHandle::from_raw_parts(7, 0));
    let ends = JointEnds { name, coordinates: None, proxies: [ProxyId(0), ProxyId(1)], poses };
    let mut constraints = Vec::new();
    joint_constraints(joint, &ends, proxies, H, &mut constraints);
    constraints
}

/// A pose after a small motion about a centre of mass.
fn moved(pose: &Pose64, com: &Vec3, shift: &Vec3, turn: &Vec3) -> Pose64 {
    let turn = rotation_from_vector(turn);
    Pose64 { rotation: turn * pose.rotation, translation: com + shift + turn * (pose.translation - com) }
}

/// A joint with its frames off the bodies' origins, of each kind.
fn joints() -> Vec<GenericJoint> {
    let frame = |k: f32| {
        let turn = Rotation::from_scaled_axis(Vector::new(0.3 * k, -0.7, 0.2));
        Pose::from_parts(Vector::new(0.2, 0.1 * k, -0.3), turn)
    };
    let mut all: Vec<GenericJoint> = vec![
        FixedJointBuilder::new().into(),
        RevoluteJointBuilder::new(Vector::X).limits([-1.0, 1.0]).into(),
        PrismaticJointBuilder::new(Vector::X).limits([-1.0, 1.0]).into(),
        SphericalJointBuilder::new().into(),
        RopeJointBuilder::new(2.0).into(),
    ];
    for joint in &mut all {
        joint.set_local_frame1(frame(1.0)).set_local_frame2(frame(-2.0));
    }
    all
}

/// The second body's pose at which frame 2 is at a place and a turn within frame 1.
fn placed(joint: &GenericJoint, first: &Pose64, within: &Pose64) -> Pose64 {
    let frame2 = Pose64::from_real(&joint.local_frame2);
    let inverse = Pose64 {
        rotation: frame2.rotation.transpose(),
        translation: -(frame2.rotation.tr_mul(&frame2.translation)),
    };
    first.compose(&Pose64::from_real(&joint.local_frame1)).compose(within).compose(&inverse)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Turns and their vectors, next to none too: joints that are closed are there.
    #[test]
    fn small_turns_have_their_rotation_vectors(turn in vector(), w in vector(), decades in 0..12i32) {
        let w = w * 10f64.powi(-decades);
        let frame = rotation_from_vector(&turn);
        let turned = rotation_from_vector(&w) * frame;
        let found = rotation_vector(&(turned * frame.transpose()));
        // Some roundings of the matrices' entries of size 1.
        prop_assert!((found - w).norm() < 2e-15, "{} against {}", found, w);
    }

    /// Locks have no gap where the joint is closed, anywhere along its free axes; and each gap changes with the motion
    /// of both bodies as its constraint says.
    #[test]
    fn rows_of_a_closed_joint_are_its_gaps_and_their_derivatives(
        at in vector(), turn in vector(), free in vector(), shifts in [vector(), vector()], turns in [vector(), vector()],
    ) {
        let first = Pose64 { rotation: rotation_from_vector(&(turn * 2.0)), translation: at };
        for (kind, joint) in joints().iter().enumerate() {
            let none = Vec3::zeros();
            let (shift, angle) = match kind {
                1 => (none, Vec3::x() * free.x),
                2 => (Vec3::x() * free.x, none),
                3 => (none, free),
                4 => (free * 0.5 + Vec3::repeat(1.0), free),
                _ => (none, none),
            };
            let within = Pose64 { rotation: rotation_from_vector(&angle), translation: shift };
            let poses = [first, placed(joint, &first, &within)];
            let proxies = yielding(&poses);
            let constraints = constraints_of(joint, poses, &proxies);
            // Locks by kind, and the limits: a rope has an upper one only.
            prop_assert_eq!(constraints.len(), [6, 7, 7, 3, 1][kind]);
            for constraint in constraints.iter().filter(|constraint| matches!(constraint.law, Law::Bounded { .. })) {
                // Some tens of roundings of lengths of 2 m and turns.
                prop_assert!(constraint.gap.abs() < 1e-14, "kind {kind}: {constraint:?}");
            }
            let t = 2e-4;
            let after = |sign: f64| {
                let coms = [0, 1].map(|k| proxies.list[k].com());
                let ends = [0, 1].map(|k| {
                    moved(&poses[k], &coms[k], &(shifts[k] * (sign * t)), &(turns[k] * (sign * t)))
                });
                constraints_of(joint, ends, &proxies)
            };
            for ((constraint, plus), minus) in constraints.iter().zip(after(1.0)).zip(after(-1.0)) {
                prop_assert_eq!((plus.key, minus.key), (constraint.key, constraint.key));
                let velocity = |endpoint: &Endpoint| {
                    let k = endpoint.proxy().map_or(0, |p| p.0 as usize);
                    match endpoint {
                        Endpoint::Rigid { point, .. } => {
                            shifts[k] + turns[k].cross(&(point - proxies.list[k].com()))
                        }
                        _ => turns[k],
                    }
                };
                let slope = constraint.frame[0].dot(&(velocity(&constraint.endpoints[0]) - velocity(&constraint.endpoints[1])));
                let difference = (plus.gap - minus.gap) / (2.0 * t);
                // t²/6 times a third derivative of up to v³/d², 8 m/s at 0.9 m.
                prop_assert!((slope - difference).abs() < 1e-4, "kind {kind}: {slope} {difference} {constraint:?}");
            }
        }
    }

    /// The force of a motor's constraint, left to itself, is −k(q − q*) + d q̇*, of its model's mass.
    #[test]
    fn a_motors_constraint_has_the_force_of_its_formula(
        at in vector(), turn in vector(), q in -1.0..1.0f64, target in -1.0..1.0f32, speed in -1.0..1.0f32,
        by_force in any::<bool>(),
    ) {
        let first = Pose64 { rotation: rotation_from_vector(&turn), translation: at };
        let (model, axis) = (MotorModel::ForceBased, JointAxis::LinX);
        let model = if by_force { model } else { MotorModel::AccelerationBased };
        let mut joint: GenericJoint = PrismaticJointBuilder::new(Vector::X).into();
        joint.set_motor_model(axis, model).set_motor(axis, target, speed, 300.0, 20.0);
        let within = Pose64 { rotation: Mat3::identity(), translation: Vec3::x() * q };
        let poses = [first, placed(&joint, &first, &within)];
        let mut proxies = yielding(&poses);
        // 4 kg each, which do not turn.
        for proxy in &mut proxies.list {
            if let RigidProxy::Rigid { inv_mass, inv_inertia, .. } = proxy {
                (*inv_mass, *inv_inertia) = (Vec3::repeat(0.25), Mat3::zeros());
            }
        }
        let constraints = constraints_of(&joint, poses, &proxies);
        let motor = constraints.iter().find(|constraint| {
            matches!(constraint.key, ConstraintKey::MultibodyJoint(Axis { role: JointRole::Motor, .. }))
        });
        prop_assert!(motor.is_some());
        let Some(constraint) = motor else { return Ok(()) };
        // By acceleration it is that of the reduced mass.
        let mass = if by_force { 1.0 } else { 2.0 };
        let expected = (-300.0 * (q - f64::from(target)) + 20.0 * f64::from(speed)) * mass;
        let force = -constraint.gap / constraint.compliance;
        prop_assert!((force - expected).abs() < 1e-10, "{force} {expected}");
        prop_assert!((constraint.compliance * (300.0 + 20.0 / H) * mass - 1.0).abs() < 1e-12);
        // The spring's joint is the same along its distance.
        let spring: GenericJoint = SpringJointBuilder::new(target.abs(), 300.0, 20.0).spring_model(model).into();
        let shift = Pose64 { rotation: poses[0].rotation, translation: at + poses[0].rotation.column(1) * (q + 1.5) };
        let constraints = constraints_of(&spring, [poses[0], shift], &proxies);
        prop_assert_eq!(constraints.len(), 1);
        let force = -constraints[0].gap / constraints[0].compliance;
        let expected = -300.0 * (q + 1.5 - f64::from(target.abs())) * mass;
        prop_assert!((force - expected).abs() < 1e-10, "{force} {expected}");
    }
}

/// Places along x where parts of compounds stand.
fn compound(places: &[f32], half: f32) -> ColliderBuilder {
    let part = |x: &f32| (Pose::from_translation(Vector::X * *x), SharedShape::cuboid(half, 0.1, half));
    ColliderBuilder::compound(places.iter().map(part).collect())
}

/// Keys of the constraints where two compounds of many parts meet, of which two pairs do.
fn keys_of_speculative(first: &[f32], second: &[f32]) -> Vec<ConstraintKey> {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let lower = RigidBodyBuilder::dynamic();
    let (lower, _) = physics.insert(lower, compound(first, 0.1));
    // 2 cm above it, and 5 cm a step towards it.
    let upper = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.22).linvel(Vector::Y * -3.0);
    physics.insert(upper, compound(second, 0.08));
    let (mut scene, mut candidates) = (RapierScene::default(), Candidates::default());
    let parts = PhysicsParts::from(&mut physics);
    let context = context(&parts);
    scene.read(&context);
    candidates.update(&scene.obstacles);
    let touched = scene.body_proxy(&context, lower);
    let (scene, candidates) = (&mut scene, &candidates);
    let mut around = WalkContext { scene, candidates, context, limit: 8 };
    let mut neighbourhood = RigidNeighbourhood::default();
    neighbourhood.walk(&mut around, touched.into_iter());
    neighbourhood.constraints.iter().map(|constraint| constraint.key).collect()
}

/// 32 parts far from everything but where they are told to stand.
fn parts_at(places: &[(usize, f32)], away: f32) -> Vec<f32> {
    let mut all: Vec<f32> = (0..32u8).map(|k| away + f32::from(k)).collect();
    places.iter().for_each(|&(part, x)| all[part] = x);
    all
}

#[test]
fn points_of_parts_that_meet_have_keys_of_their_own() {
    // Parts (0, 30) and (1, 0).
    let keys = keys_of_speculative(
        &parts_at(&[(0, 0.0), (1, 10.0)], 100.0),
        &parts_at(&[(30, 0.0), (0, 10.0)], -100.0),
    );
    assert!(keys.len() >= 8, "at least four corners each: {keys:?}");
    assert!(keys.windows(2).all(|pair| pair[0] < pair[1]), "{keys:?}");
}

#[test]
fn points_of_the_thirty_second_part_have_keys_of_their_own() {
    let keys = keys_of_speculative(
        &parts_at(&[(0, 0.0), (1, 10.0)], 100.0),
        &parts_at(&[(31, 0.0), (0, 10.0)], -100.0),
    );
    assert!(keys.len() >= 8, "at least four corners each: {keys:?}");
    assert!(keys.windows(2).all(|pair| pair[0] < pair[1]), "{keys:?}");
}
