//! Limits and motors of rapier's joints under soft loads.
//!
//! Forces are means over the last second. Over that second the mean force on what stands still differs from
//! statics by its change of momentum, which is 2 m v at the most: of the weight m g it is a part of 2v/g. All
//! scenes assert v < [`STILL`], so the tolerance [`STATIC`] is twice 2·1e-4/9.81, and the rounding of what is
//! read in `f32`.
mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;
/// Speed of what stands still [m/s].
const STILL: f64 = 1e-4;
/// Relative tolerance of forces against statics.
const STATIC: f64 = 5e-5;

fn rigid_box(physics: &mut PhysicsWorld, at: Vector, half: Vector, mass: f64) -> RigidBodyHandle {
    let volume = f64::from(8.0 * half.x * half.y * half.z);
    let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density((mass / volume) as f32);
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    physics.insert(body, shape.friction(MU as f32)).0
}

/// A soft cube of 0.2 m and 8 kg.
fn small_cube(at: Vector) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3])
        .can_sleep(false)
        .translation(at)
        .material(DeformableMaterial::new(1e6, 0.3).friction(MU).mass_damping(1.0))
}

/// Steps, and gives the means over the last second of what is read, once all bodies stand still.
fn rest<const N: usize>(
    physics: &mut PhysicsWorld,
    world: &mut DeformableWorld,
    steps: usize,
    read: impl Fn(&PhysicsWorld, &DeformableWorld) -> [f64; N],
) -> [f64; N] {
    let (mut sum, mut fastest) = ([0.0; N], 0.0f64);
    for step in 0..steps {
        world.step(physics);
        if step + 60 >= steps {
            let now = read(physics, world);
            (0..N).for_each(|k| sum[k] += now[k] / 60.0);
            let rigid = physics.bodies.iter().map(|(_, b)| f64::from(b.linvel().length()));
            let soft = world.bodies.iter().map(|(_, b)| b.max_speed());
            fastest = rigid.chain(soft).fold(fastest, f64::max);
        }
    }
    println!("means {sum:?}, at most {fastest:.1e} m/s");
    assert!(fastest < STILL, "{fastest:e} m/s");
    sum
}

fn is_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    println!("{what}: {found} against {expected}, off by {:.1e}", found / expected - 1.0);
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found} against {expected}");
}

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

const BAR: f64 = 10.0;
const CUBE: f64 = 8.0;

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
    for (soft, model) in [false, true].into_iter().flat_map(|soft| models().map(|(model, _)| (soft, model))) {
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
