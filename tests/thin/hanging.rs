//! Spherical joints, ropes and springs that carry soft bodies, and that soft bodies carry.
//!
//! Tolerances of forces are those of `tests/common/joints.rs`: means over the last second of what stands still.
use crate::common::joints::{H, STATIC, STILL, is_near};
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const PLATE: f64 = 5.0;
const WEIGHT: f64 = 50.0;

fn rigid_box(physics: &mut PhysicsWorld, at: Vector, half: Vector, mass: f64) -> RigidBodyHandle {
    let volume = f64::from(8.0 * half.x * half.y * half.z);
    let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density((mass / volume) as f32);
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    physics.insert(body.linear_damping(0.5).angular_damping(0.5), shape.friction(MU as f32)).0
}

fn fastest(physics: &PhysicsWorld, world: &DeformableWorld) -> f64 {
    let rigid = physics.bodies.iter().map(|(_, b)| f64::from(b.linvel().length()));
    rigid.chain(world.bodies.iter().map(|(_, b)| b.max_speed())).fold(0.0, f64::max)
}

/// A weight on a joint under a plate that is glued below a soft block, which is pinned at its top.
struct Hanging {
    physics: PhysicsWorld,
    world: DeformableWorld,
    plate: RigidBodyHandle,
    weight: RigidBodyHandle,
    joint: ImpulseJointHandle,
    glue: DeformableAttachmentHandle,
}

impl Hanging {
    /// Anchors are the plate's centre and 0.2 m above the weight's, `apart` [m] from each other. The glue fills a gap of
    /// a centimetre between block and plate, so that no contact shares the load with it.
    fn new(joint: impl Into<GenericJoint>, apart: f32) -> Self {
        Self::glued_across(0.01, joint, apart)
    }

    fn glued_across(gap: f32, joint: impl Into<GenericJoint>, apart: f32) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = H;
        let plate = rigid_box(&mut physics, Vector::Y * (-0.25 - gap), Vector::new(0.2, 0.05, 0.2), PLATE);
        let weight = rigid_box(&mut physics, Vector::Y * (-0.45 - gap - apart), Vector::splat(0.1), WEIGHT);
        let joint = physics.impulse_joints.insert(plate, weight, joint, true);
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e6, 0.3).mass_damping(5.0);
        let block = world.insert(cube(material, 0.0).pinned(|x| x.y > 0.199)).unwrap();
        let lower = at_rest_where(&world.bodies[block], |x| x[1] < -0.199);
        let to = AttachTo::RigidBody(plate, *physics.bodies[plate].position());
        let glue = world.bodies.attach(block, &lower, to).unwrap();
        Self { physics, world, plate, weight, joint, glue }
    }

    /// Means over the last second: distance of the anchors, the joint's forces by axis, the glue's force upwards.
    fn rest(&mut self, steps: usize) -> (f64, [f64; 7], f64) {
        let (mut apart, mut forces, mut glue) = (0.0, [0.0; 7], 0.0);
        for step in 0..steps {
            self.world.step(&mut self.physics);
            if step + 60 < steps {
                continue;
            }
            let speed = fastest(&self.physics, &self.world);
            assert!(speed < STILL, "{speed:e} m/s");
            apart += f64::from(self.anchors_apart()) / 60.0;
            let joint = SolvedJoint::Impulse(self.joint);
            (0..7).for_each(|axis| forces[axis] += self.world.joint_force(joint, axis) / 60.0);
            glue += f64::from(self.world.bodies.attachment(self.glue).unwrap().force().y) / 60.0;
        }
        (apart, forces, glue)
    }

    fn anchors_apart(&self) -> f32 {
        let at =
            |b: RigidBodyHandle, y: f32| self.physics.bodies[b].position().transform_point(Vector::Y * y);
        (at(self.plate, 0.0) - at(self.weight, 0.2)).length()
    }

    fn check_glue(&self, glue: f64) {
        is_near("glue", glue.abs(), (PLATE + WEIGHT) * G, STATIC);
    }
}

#[test]
fn a_weight_hangs_from_a_soft_block_on_a_ball_joint() {
    let ball = SphericalJointBuilder::new().local_anchor2(Vector::Y * 0.2);
    let mut hanging = Hanging::new(ball, 0.0);
    let (apart, forces, glue) = hanging.rest(420);
    println!("{forces:?} N, {apart:e} m apart");
    is_near("joint", forces[1], WEIGHT * G, STATIC);
    // The plate turns with the block's asymmetry of meshing; its sine is what goes sideways.
    assert!(forces[0].hypot(forces[2]) < 1e-3 * WEIGHT * G, "{forces:?}");
    // A ball joint takes no moments, and there is no distance to it.
    assert_eq!(forces[3..], [0.0; 4]);
    // Places of 0.5 m in f32, in four substeps.
    assert!(apart < 5e-7, "{apart:e} m");
    hanging.check_glue(glue);
}

/// A face does not collide with what it is glued to, if the glue gives way by next to nothing: contacts of the same nodes
/// would be redundant, and trade the load with the glue without end. On springs it does, and nothing is left to touch.
#[test]
fn glue_without_a_gap_carries_what_hangs_on_it_too() {
    for compliance in [0.0, 1e-13, 1e-10, 1e-9, 1e-8, 1.1e-8, 1e-6, 1e-3] {
        let ball = SphericalJointBuilder::new().local_anchor2(Vector::Y * 0.2);
        let mut hanging = Hanging::glued_across(0.0, ball, 0.0);
        hanging.world.bodies.attachment_mut(hanging.glue).unwrap().set_compliance(compliance).unwrap();
        let plate = hanging.physics.bodies[hanging.plate].colliders()[0];
        for _ in 0..3 {
            let (_, _, glue) = hanging.rest(420);
            println!("compliance {compliance:e}");
            hanging.check_glue(glue);
            let carry = hanging.world.contacts_with(plate).map(|c| c.force.length()).fold(0.0, f32::max);
            assert_eq!(carry, 0.0);
        }
    }
}

/// A spring does not hold a face out of what it presses on: contact does.
#[test]
fn a_face_on_springs_does_not_sink_into_what_it_is_attached_to() {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = H;
    let ground = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    let (ground, floor) = physics.insert(ground, ColliderBuilder::cuboid(1.0, 0.5, 1.0).friction(MU as f32));
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e6, 0.3).mass_damping(5.0);
    let body = world.insert(cube(material, 0.2)).unwrap();
    let lower = at_rest_where(&world.bodies[body], |x| x[1] < -0.199);
    let pose = *physics.bodies[ground].position();
    let springs = world.bodies.attach(body, &lower, AttachTo::RigidBody(ground, pose)).unwrap();
    world.bodies.attachment_mut(springs).unwrap().set_compliance(1e-3).unwrap();
    (0..240).for_each(|_| world.step(&mut physics));
    let lowest = lower.iter().map(|&v| world.bodies[body].position(v).unwrap()[1]).fold(0.0, f64::min);
    let carried = f64::from(world.contact_force(body, floor).y);
    println!("{lowest:e} m, {carried} N");
    // Without contact: 64 kg on 49 springs of 1 kN/m sink by 13 mm.
    assert!(lowest > -1e-6, "{lowest:e} m");
    is_near("contact", carried, 64.0 * G, 1e-3);
}

#[test]
fn a_weight_hangs_from_a_soft_block_on_a_rope_as_long_as_it_is() {
    let rope = RopeJointBuilder::new(0.5).local_anchor2(Vector::Y * 0.2);
    let mut hanging = Hanging::new(rope, 0.5);
    let (apart, forces, glue) = hanging.rest(420);
    is_near("rope", forces[6], -WEIGHT * G, STATIC);
    assert_eq!(forces[..6], [0.0; 6]);
    assert!((apart - 0.5).abs() < 5e-7, "{apart} m");
    hanging.check_glue(glue);
}

#[test]
fn a_rope_that_is_not_taut_carries_nothing() {
    // Half a metre of slack: a fall of 0.32 s, of which it has 0.25 s.
    let rope = RopeJointBuilder::new(0.5).local_anchor2(Vector::Y * 0.2);
    let mut hanging = Hanging::new(rope, 0.1);
    for _ in 0..15 {
        hanging.world.step(&mut hanging.physics);
        let force = hanging.world.joint_force(SolvedJoint::Impulse(hanging.joint), 6);
        assert!(hanging.anchors_apart() > 0.45 || force == 0.0, "{force} N at {} m", hanging.anchors_apart());
    }
    // Rapier's semi-implicit free fall with its damping factor of 0.5/s: at least 0.9 of g t²/2.
    let fallen = f64::from(hanging.anchors_apart()) - 0.1;
    assert!(fallen > 0.9 * 0.5 * G * 0.25f64.powi(2), "{fallen} m");
}

#[test]
fn a_weight_hangs_from_a_soft_block_on_a_spring_by_weight_over_stiffness() {
    // By acceleration the spring is scaled by the reduced mass of plate and weight.
    let reduced = PLATE * WEIGHT / (PLATE + WEIGHT);
    for (model, per_mass) in [(MotorModel::ForceBased, 1.0), (MotorModel::AccelerationBased, reduced)] {
        let [stiffness, damping] = [10_000.0, 1000.0].map(|c: f64| (c / per_mass) as f32);
        let spring = SpringJointBuilder::new(0.3, stiffness, damping).spring_model(model);
        let mut hanging = Hanging::new(spring.local_anchor2(Vector::Y * 0.2), 0.3);
        let (apart, forces, glue) = hanging.rest(600);
        is_near("spring", forces[6], -WEIGHT * G, STATIC);
        // d/k·v of the sag of 0.05 m: 0.1 s · STILL.
        is_near("sag", apart - f64::from(0.3f32), WEIGHT * G / 10_000.0, STATIC + 2e-4);
        hanging.check_glue(glue);
    }
}

/// Three ropes or springs around a plate with a soft cube on it: by symmetry each has a third of the weight.
#[test]
fn a_plate_with_a_soft_cube_hangs_on_three_ropes_or_springs() {
    let around = [0.0f32, 1.0, 2.0].map(|k| {
        let angle = k * std::f32::consts::TAU / 3.0;
        Vector::new(angle.cos(), 0.0, angle.sin()) * 0.3
    });
    let rope: GenericJoint = RopeJointBuilder::new(1.0).into();
    let spring: GenericJoint = SpringJointBuilder::new(1.0, 10_000.0, 1000.0).into();
    for data in [rope, spring] {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = H;
        let ceiling = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::Y));
        let plate = rigid_box(&mut physics, Vector::ZERO, Vector::new(0.3, 0.02, 0.3), PLATE);
        let joints = around.map(|at| {
            let mut data = data;
            data.set_local_anchor1(at).set_local_anchor2(at);
            physics.impulse_joints.insert(ceiling, plate, data, true)
        });
        let mut world = DeformableWorld::new();
        world.insert(cube(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0), 0.22)).unwrap();
        let (mut forces, mut fast) = ([0.0; 3], 0.0f64);
        for step in 0..600 {
            world.step(&mut physics);
            if step >= 540 {
                fast = fast.max(fastest(&physics, &world));
                let force = |k: usize| -world.joint_force(SolvedJoint::Impulse(joints[k]), 6) / 60.0;
                (0..3).for_each(|k| forces[k] += force(k));
            }
        }
        println!("{forces:?} N, {fast:.1e} m/s");
        assert!(fast < STILL, "{fast:e} m/s");
        is_near("sum", forces.iter().sum(), (PLATE + 64.0) * G, STATIC);
        for force in forces {
            // The cells' diagonals are not symmetric: the cube's centre is off by up to its compression, 0.2 mm
            // of the arms of 0.15 m between a rope and the line of the other two.
            is_near("third", force, (PLATE + 64.0) * G / 3.0, 2e-3);
        }
    }
}

/// A box of 8 kg, with as heavy a soft cube attached over its upper side, across a gap \[m\], if it is to have one.
fn carrier(physics: &mut PhysicsWorld, at: Vector, gap: Option<f32>) -> (DeformableWorld, RigidBodyHandle) {
    physics.integration_parameters.dt = H;
    let shape = ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(1000.0);
    let body = RigidBodyBuilder::dynamic().translation(at).lock_rotations().can_sleep(false);
    let (carrier, _) = physics.insert(body, shape);
    let mut world = DeformableWorld::new();
    if let Some(gap) = gap {
        let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).can_sleep(false);
        let builder = builder.translation(at + Vector::Y * (0.2 + gap));
        let cube = world.insert(builder.material(DeformableMaterial::new(1e7, 0.3))).unwrap();
        let lower = at_rest_where(&world.bodies[cube], |x| x[1] < -0.099);
        let to = AttachTo::RigidBody(carrier, *physics.bodies[carrier].position());
        world.bodies.attach(cube, &lower, to).unwrap();
    }
    (world, carrier)
}

/// Implicit Euler of a mass on a spring: `v' = v + h(k x'/m − g)`, `x' = x + h v'` for the sag x of an elastic
/// load that follows as if it were rigid.
#[test]
fn a_spring_swings_a_soft_load_like_a_mass() {
    for (model, per_mass) in [(MotorModel::ForceBased, 1.0), (MotorModel::AccelerationBased, 8.0)] {
        const STIFFNESS: f64 = 800.0;
        let mut physics = PhysicsWorld::new();
        let (mut world, carrier) = carrier(&mut physics, Vector::ZERO, Some(0.0));
        let ceiling = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::Y));
        let spring = SpringJointBuilder::new(1.0, (STIFFNESS / per_mass) as f32, 0.0).spring_model(model);
        physics.impulse_joints.insert(ceiling, carrier, spring, true);
        let (h, mass) = (f64::from(H), 16.0);
        let (mut x, mut v, mut worst) = (0.0f64, 0.0f64, 0.0f64);
        for _ in 0..120 {
            v = (v - h * (G + STIFFNESS / mass * x)) / (1.0 + h * h * STIFFNESS / mass);
            x += h * v;
            world.step(&mut physics);
            worst = worst.max((f64::from(physics.bodies[carrier].translation().y) - x).abs());
        }
        println!("{model:?}: off by {worst:.1e} m");
        // Amplitude 0.2 m. The cube is a spring of 2e6 N/m with half of the mass at its end: it lowers the
        // frequency by a part of (m_c/2m)·k/k_c = 1e-4 at most, over 14 rad.
        assert!(worst < 0.2 * 14.0 * 1e-4, "{worst:e} m");
    }
}

/// A box on an arm of 1 m and a ball joint is let go level. Rows are linear: a step by the angle θ leaves rθ²/2 of its
/// arc, which the next step takes back. Returns the greatest part of that and the energy gained [J] at the most.
fn swing(gap: Option<f32>) -> (f32, f64) {
    let mut physics = PhysicsWorld::new();
    let (mut world, carrier) = carrier(&mut physics, Vector::X, gap);
    physics.bodies[carrier].lock_rotations(false, true);
    let hook = physics.insert_body(RigidBodyBuilder::fixed());
    let ball = SphericalJointBuilder::new().local_anchor2(-Vector::X);
    physics.impulse_joints.insert(hook, carrier, ball, true);
    let (mut worst, mut lowest) = (0.0f32, 0.0f32);
    let (mut start, mut gained) = (None, 0.0f64);
    for _ in 0..120 {
        let before = physics.bodies[carrier].angvel().length();
        world.step(&mut physics);
        let body = &physics.bodies[carrier];
        let omega = before.max(body.angvel().length());
        let apart = body.position().transform_point(-Vector::X).length();
        worst = worst.max(apart / (0.5 * (omega * H).powi(2)).max(1e-6));
        lowest = lowest.min(body.translation().y);
        let moving =
            0.5 * 8.0 * (body.linvel().length_squared() + 0.08 / 12.0 * body.angvel().length_squared());
        let rigid = f64::from(moving) + 8.0 * G * f64::from(body.translation().y);
        let energy = rigid + energy_of(&world);
        gained = gained.max(energy - *start.get_or_insert(energy));
    }
    println!("{gap:?}: {worst} of what rows leave of the arc, {gained} J gained, lowest {lowest} m");
    assert!(lowest < -0.9, "it swings: {lowest}");
    (worst, gained)
}

/// Places and velocities belong to times up to a step apart: m g v h of 16 kg at 4.4 m/s.
const TIMING: f64 = 16.0 * G * 4.4 / 60.0;

#[test]
fn a_ball_joint_keeps_its_length_while_a_soft_load_swings() {
    for gap in [None, Some(0.01)] {
        let (worst, gained) = swing(gap);
        // Quadratic terms of the swing's own acceleration are a tenth of it at the most.
        assert!(worst < 1.1, "{worst} of what the rows leave");
        assert!(gained < TIMING, "{gained} J");
    }
}

#[test]
fn a_swing_with_a_load_that_touches_what_it_is_attached_to_gains_no_energy() {
    let (_, gained) = swing(Some(0.0));
    assert!(gained < TIMING, "{gained} J");
}

/// No joint of rapier forbids two anchors to pass: it holds ropes to their greatest length only.
#[test]
fn a_slack_rope_lets_a_carrier_pass_its_anchor() {
    for soft in [false, true] {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let (mut world, carrier) = carrier(&mut physics, Vector::X * -0.305, soft.then_some(0.01));
        let hook = physics.insert_body(RigidBodyBuilder::fixed());
        physics.impulse_joints.insert(hook, carrier, RopeJointBuilder::new(1.0), true);
        physics.bodies[carrier].set_linvel(Vector::X, true);
        for (_, body) in world.bodies.iter_mut() {
            body.set_linvel(Vector::X).unwrap();
        }
        (0..60).for_each(|_| world.step(&mut physics));
        let x = f64::from(physics.bodies[carrier].translation().x);
        // A second at 1 m/s; f32 of 60 steps.
        assert!((x - 0.695).abs() < 1e-5, "soft load {soft}: at {x} m");
    }
}
