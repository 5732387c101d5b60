//! Soft bodies on the links of multibodies whose joints have damping and springs of rapier's.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Where a lever of 50 g on a spring of 2 N m/rad comes to rest with a soft cube of 100 g at its end, its joint damped \[rad\]; and where
/// statics says.
fn angle(damping: f32, dt: f32, steps: usize) -> [f32; 2] {
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    physics.integration_parameters.dt = dt;
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let lever = ColliderBuilder::cuboid(0.04, 0.01, 0.01).translation(Vector::X * 0.04).mass(0.05);
    let (lever, _) = physics.insert(RigidBodyBuilder::dynamic().can_sleep(false), lever);
    let joint = RevoluteJointBuilder::new(Vector::NEG_Z).contacts_enabled(false);
    let joint = physics.multibody_joints.insert(base, lever, joint, true).unwrap();
    let (multibody, id) = physics.multibody_joints.get_mut(joint).unwrap();
    multibody.damping_mut().fill(damping);
    multibody.link_mut(id).unwrap().joint.set_spring(JointAxis::AngX as usize, 2.0, 0.0);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.01), [2, 2, 2])
        .translation(Vector::X * 0.09)
        .can_sleep(false)
        .material(DeformableMaterial::new(5.0e6, 0.3).density(0.1 / 8.0e-6).stiffness_damping(1.0e-3));
    let cube = deformables.insert(cube).unwrap();
    let face = deformables.bodies[cube].vertices_where(|x| x.x < 0.0801);
    let pose = *physics.bodies[lever].position();
    deformables.bodies.attach(cube, &face, AttachTo::RigidBody(lever, pose)).unwrap();
    (0..steps).for_each(|_| deformables.step(&mut physics));
    let rotation = physics.bodies[lever].rotation();
    let moment = (0.05 * 0.04 + 0.1 * 0.09) * 9.81f32;
    [2.0 * rotation.z.atan2(rotation.w), (0..50).fold(0.0f32, |a, _| moment * a.cos() / 2.0)]
}

#[test]
fn a_damped_joint_on_a_spring_bears_the_whole_weight() {
    // Kicked at the start of a step, a light lever is back at its highest at the end of it: off by what a step's spring does.
    for (dt, steps, within) in [(1.0e-3, 4000, 5.0e-3), (1.0 / 240.0, 1500, 0.05), (1.0 / 120.0, 1000, 0.11)]
    {
        for damping in [0.005, 0.05, 0.5] {
            let [found, expected] = angle(damping, dt, steps);
            println!("damping {damping}, dt {dt}: {found} rad of {}", -expected);
            assert!((found.abs() / expected - 1.0).abs() < within, "{found} {expected}");
        }
    }
}

#[test]
fn a_damped_slide_falls_with_a_soft_load_as_with_a_rigid_one() {
    // m v' = m g − d v of both together.
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let slide = ColliderBuilder::cuboid(0.1, 0.01, 0.1).mass(1.0).friction(0.9);
    let (slide, _) = physics.insert(RigidBodyBuilder::dynamic().can_sleep(false), slide);
    let joint = PrismaticJointBuilder::new(Vector::Y).contacts_enabled(false);
    let joint = physics.multibody_joints.insert(base, slide, joint, true).unwrap();
    physics.multibody_joints.get_mut(joint).unwrap().0.damping_mut().fill(20.0);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [3, 3, 3]).translation(Vector::Y * 0.0601);
    let cube = cube.material(DeformableMaterial::new(1.0e6, 0.3).stiffness_damping(1.0e-3).friction(0.9));
    deformables.insert(cube.can_sleep(false)).unwrap();
    let (rate, mut y) = (20.0 / 2.0, 0.0);
    for step in 0..120 {
        deformables.step(&mut physics);
        let t = f64::from(step + 1) / 60.0;
        y = -9.81 / rate * (t - (1.0 - f64::exp(-rate * t)) / rate);
        if step > 60 {
            let found = f64::from(physics.bodies[slide].translation().y);
            assert!((found - y).abs() < 0.01 * y.abs(), "step {step}: {found} {y}");
        }
    }
    println!("at {} of {y} m", physics.bodies[slide].translation().y);
}

/// Two jaws on a base, of which the second follows the first by a ratio, and a soft cube between them; no gravity. What both
/// press with, and the first's motor \[N\] or \[N m\].
fn jaws(turning: bool, ratio: f32) -> [f64; 3] {
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    physics.gravity = Vector::ZERO;
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let mut jaw = |side: f32| {
        let (at, anchor) = (Vector::X * 0.11 * side, Vector::NEG_Y * 0.4);
        let shape = ColliderBuilder::cuboid(0.01, 0.05, 0.05).mass(0.1).friction(1.0);
        let (jaw, collider) =
            physics.insert(RigidBodyBuilder::dynamic().translation(at).can_sleep(false), shape);
        let joint: GenericJoint = match turning {
            true => {
                RevoluteJointBuilder::new(Vector::Z).local_anchor1(at + anchor).local_anchor2(anchor).into()
            }
            false => PrismaticJointBuilder::new(Vector::X).local_anchor1(at).into(),
        };
        (physics.multibody_joints.insert(base, jaw, joint, true).unwrap(), collider)
    };
    let ((first, left), (second, right)) = (jaw(-1.0), jaw(1.0));
    let axis = if turning { JointAxis::AngX } else { JointAxis::LinX };
    let (_, link2) = physics.multibody_joints.get(second).unwrap();
    let (multibody, link1) = physics.multibody_joints.get_mut(first).unwrap();
    let axes = axis as usize;
    let coupling = MultibodyDofCoupling {
        link1,
        dof1: 0,
        axis1: axes,
        link2,
        dof2: 0,
        axis2: axes,
        coeff: ratio,
        offset: 0.0,
    };
    multibody.add_dof_coupling(coupling);
    // Turned about z, what is above the axis goes to the left: closing is negative.
    let (sign, target) = if turning { (-1.0, 0.08) } else { (1.0, 0.03) };
    let joint = &mut multibody.link_mut(link1).unwrap().joint.data;
    joint.set_motor_position(axis, sign * target, 1000.0, 20.0);
    joint.set_motor_model(axis, MotorModel::ForceBased);
    let material =
        DeformableMaterial::new(2.0e5, 0.3).mass_damping(2.0).stiffness_damping(2.0e-3).friction(1.0);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.09), [4; 3]).material(material).can_sleep(false);
    deformables.insert(cube).unwrap();
    (0..400).for_each(|_| deformables.step(&mut physics));
    let (multibody, _) = physics.multibody_joints.get(first).unwrap();
    let q = multibody.link(link1).unwrap().joint.coords()[axes];
    // About the axes of the jaws, or along their way.
    let force = |jaw: ColliderHandle, side: f32| {
        let moment = |c: &DeformableContact| {
            let arm = c.point - Vector::new(0.11 * side, -0.4, 0.0);
            f64::from(if turning { arm.x * c.force.y - arm.y * c.force.x } else { c.force.x })
        };
        deformables.contacts_with(jaw).map(moment).sum::<f64>().abs()
    };
    [force(left, -1.0), force(right, 1.0), 1000.0 * f64::from(target - sign * q)]
}

#[test]
fn a_jaw_that_follows_presses_as_hard_as_the_one_that_is_driven() {
    for turning in [false, true] {
        let [left, right, motor] = jaws(turning, -1.0);
        // The motor bears both, which are alike.
        println!("turning {turning}: {left:.4} and {right:.4}, motor {motor:.4}");
        assert!(motor > 4.0 && (left / right - 1.0).abs() < 0.02, "{left} {right} {motor}");
        assert!(((left + right) / motor - 1.0).abs() < 0.02, "{left} {right} {motor}");
    }
}
