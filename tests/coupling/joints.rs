//! Limits and motors of rapier's slides under soft loads, by the measures of `tests/common/joints.rs`.
use crate::common::joints::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const TABLE: f64 = 20.0;
const LOAD: f64 = 64.0;

/// A table of 20 kg on a vertical slide over a fixed base, with the soft cube of 64 kg on it.
struct Lift {
    physics: PhysicsWorld,
    world: DeformableWorld,
    table: RigidBodyHandle,
    joint: ImpulseJointHandle,
}

impl Lift {
    fn new(joint: impl Into<GenericJoint>, base_first: bool) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = H;
        let base = physics.insert_body(RigidBodyBuilder::fixed());
        let table = rigid_box(&mut physics, Vector::ZERO, Vector::new(0.25, 0.05, 0.25), TABLE);
        let [first, second] = if base_first { [base, table] } else { [table, base] };
        let joint = physics.impulse_joints.insert(first, second, joint, true);
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e6, 0.3).mass_damping(1.0);
        world.insert(cube(material, 0.25)).unwrap();
        Self { physics, world, table, joint }
    }

    /// Height of the table and force of the joint's free axis on its second body.
    fn rest(&mut self, steps: usize) -> [f64; 2] {
        let (table, joint) = (self.table, SolvedJoint::Impulse(self.joint));
        rest(&mut self.physics, &mut self.world, steps, |physics, world| {
            [f64::from(physics.bodies[table].translation().y), world.joint_force(joint, 0)]
        })
    }
}

#[test]
fn a_slide_at_its_limit_carries_the_weight_of_what_lies_on_it() {
    let weight = (TABLE + LOAD) * G;
    // The second body's place in the first one's frame: the table over the base, or the base under the table.
    let lower = PrismaticJointBuilder::new(Vector::Y).limits([0.0, 1.0]);
    let [height, force] = Lift::new(lower, true).rest(300);
    is_near("lower limit", force, weight, STATIC);
    // Numbers of 0.4 m in f32: the limit is a row without compliance.
    assert!(height.abs() < 1e-6, "{height:e} m");
    let upper = PrismaticJointBuilder::new(Vector::Y).limits([-1.0, 0.0]);
    let [height, force] = Lift::new(upper, false).rest(300);
    is_near("upper limit", force, -weight, STATIC);
    assert!(height.abs() < 1e-6, "{height:e} m");
}

/// Stiffness and damping per kilogram of the table, so that both models are the same spring.
const SPRING: [f32; 2] = [1000.0, 100.0];

/// The factor that the model of a motor puts on its coefficients, for a base that does not yield.
fn models() -> [(MotorModel, f64); 2] {
    [(MotorModel::ForceBased, 1.0), (MotorModel::AccelerationBased, TABLE)]
}

#[test]
fn a_position_motor_sags_under_a_soft_load_by_weight_over_stiffness() {
    for (model, per_mass) in models() {
        let [stiffness, damping] = SPRING.map(|c| c * (TABLE / per_mass) as f32);
        for (base_first, target) in [(true, 0.1), (false, -0.1)] {
            let slide = PrismaticJointBuilder::new(Vector::Y).motor_model(model);
            let slide = slide.motor_position(target, stiffness, damping);
            let [height, force] = Lift::new(slide, base_first).rest(600);
            let [weight, k] = [(TABLE + LOAD) * G, f64::from(stiffness) * per_mass];
            is_near("force", force * f64::from(target.signum()), weight, STATIC);
            // The damper's part over the last second: d·Δq is at most d/k·v of the sag of 0.04 m, 2.5e-4.
            is_near("sag", 0.1 - height, weight / k, STATIC + 2.5e-4);
        }
    }
}

/// The same scene with a rigid cube, by rapier alone.
#[test]
fn a_motor_sags_under_a_soft_load_as_under_a_rigid_one() {
    for (model, per_mass) in models() {
        let [stiffness, damping] = SPRING.map(|c| c * (TABLE / per_mass) as f32);
        let slide = PrismaticJointBuilder::new(Vector::Y).motor_model(model);
        let slide = slide.motor_position(0.1, stiffness, damping).build();
        let [soft, _] = Lift::new(slide, true).rest(600);
        let mut twin = Lift::new(slide, true);
        twin.world = DeformableWorld::new();
        rigid_box(&mut twin.physics, Vector::Y * 0.25, Vector::splat(0.2), LOAD);
        let [rigid, _] = twin.rest(600);
        // Rapier's own impulses are in f32 and converge over steps; its contacts do not change the weight.
        is_near("sag", 0.1 - soft, 0.1 - rigid, 1e-3);
    }
}

#[test]
fn a_velocity_motor_stalls_on_a_soft_body_with_its_damping_times_the_speed() {
    const PISTON: f64 = 2.0;
    for (model, per_mass) in [(MotorModel::ForceBased, 1.0), (MotorModel::AccelerationBased, PISTON)] {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let wall = RigidBodyBuilder::fixed().translation(Vector::X * 0.7);
        let (_, wall) = physics.insert(wall, ColliderBuilder::cuboid(0.5, 1.0, 1.0).friction(MU as f32));
        let base = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::X * -1.0));
        let piston = rigid_box(&mut physics, Vector::X * -0.301, Vector::splat(0.1), PISTON);
        let damping = (400.0 / per_mass) as f32;
        let slide = PrismaticJointBuilder::new(Vector::X).motor_model(model).motor_velocity(0.5, damping);
        let joint = physics.impulse_joints.insert(base, piston, slide, true);
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e6, 0.3).mass_damping(5.0);
        let body = world.insert(cube(material, 0.0)).unwrap();
        let [on_wall, motor] = rest(&mut physics, &mut world, 420, |_, world| {
            let motor = world.joint_force(SolvedJoint::Impulse(joint), 0);
            [-f64::from(world.contact_force(body, wall).x), motor]
        });
        // 66 kg of momentum at STILL over a second are 1.3e-2 N of 200; d·v is 4e-2 N: 2.7e-4.
        is_near("on the wall", on_wall, 200.0, 3e-4);
        is_near("motor", motor, 200.0, 3e-4);
    }
}

/// Two free plates, drawn together by a slide's motor, squeeze a soft cube: per acceleration the motor scales with
/// the reduced mass of the two.
#[test]
fn an_acceleration_motor_between_two_free_bodies_scales_with_their_reduced_mass() {
    const MASSES: [f64; 2] = [4.0, 12.0];
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let plate = Vector::new(0.05, 0.2, 0.2);
    let left = rigid_box(&mut physics, Vector::X * -0.25, plate, MASSES[0]);
    let right = rigid_box(&mut physics, Vector::X * 0.25, plate, MASSES[1]);
    let slide = PrismaticJointBuilder::new(Vector::X).motor_position(0.4, 500.0, 50.0);
    let joint = physics.impulse_joints.insert(left, right, slide, true);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e6, 0.3).mass_damping(5.0);
    let body = world.insert(cube(material, 0.0)).unwrap();
    let on_right = physics.bodies[right].colliders()[0];
    let [squeeze, motor, apart] = rest(&mut physics, &mut world, 600, |physics, world| {
        let x = |b: RigidBodyHandle| f64::from(physics.bodies[b].translation().x);
        let squeeze = -f64::from(world.contact_force(body, on_right).x);
        [squeeze, -world.joint_force(SolvedJoint::Impulse(joint), 0), x(right) - x(left)]
    });
    let reduced = MASSES[0] * MASSES[1] / (MASSES[0] + MASSES[1]);
    let expected = 500.0 * reduced * (apart - 0.4);
    // About 150 N: 12 kg at STILL over a second are 2.4e-3 N, the damper's 2·150·1e-4 N are 3e-2 N.
    is_near("motor", motor, expected, 2.5e-4);
    is_near("squeeze", squeeze, expected, 2.5e-4);
}
