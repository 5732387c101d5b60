//! Signals: by name, within ranges and rates.

use crate::common::cavities::hollow_cube;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f64 = 1.0 / 60.0;

fn world() -> (PhysicsWorld, DeformableWorld) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = H as f32;
    (physics, DeformableWorld::new())
}

#[test]
fn every_kind_of_signal_leads_what_it_drives() {
    let (mut physics, mut deformables) = world();
    let chamber = hollow_cube().can_sleep(false);
    let chamber = deformables.insert(chamber.translation(Vector::X * -3.0)).unwrap();
    let muscle = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2]).can_sleep(false);
    let muscle = deformables.insert(muscle.translation(Vector::X * 3.0)).unwrap();
    let points = [CablePoint::Vertex(muscle, 0), CablePoint::World(Vector::new(3.0, 1.0, 0.0))];
    let cable = deformables.bodies.insert_cable(DeformableCableBuilder::new(points).length(2.0)).unwrap();
    let ball = || ColliderBuilder::ball(0.1).density(1.0);
    let (base, _) = physics.insert(RigidBodyBuilder::fixed().translation(Vector::Z * 5.0), ball());
    let (arm, _) =
        physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Z * 5.0).can_sleep(false), ball());
    let hinge = RevoluteJointBuilder::new(Vector::Z);
    let hinge = physics.impulse_joints.insert(base, arm, hinge, true);
    let (root, _) = physics.insert(RigidBodyBuilder::fixed().translation(Vector::Z * -5.0), ball());
    let (link, _) =
        physics.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0, -5.0)), ball());
    let slide = RevoluteJointBuilder::new(Vector::Z).local_anchor2(-Vector::Y);
    physics.multibody_joints.insert(root, link, slide, true).unwrap();
    let axis = JointMotorAxis { axis: JointAxis::AngX, stiffness: 1.0e3, damping: 1.0e2 };
    let signals = &mut deformables.actuators;
    let mut add = |name: &str, actuator, range, rate, start| {
        signals.insert(name, actuator, range, rate, start).unwrap();
    };
    add("air", Actuator::CavityPressure(chamber, 0), [0.0, 1000.0], 2000.0, 0.0);
    add("pull", Actuator::CableTension(cable), [0.0, 5.0], f64::INFINITY, 0.0);
    add("muscle", Actuator::Activation(muscle), [0.5, 1.0], 0.1, 1.0);
    add("own", Actuator::RegionActivation(muscle, 0), [0.5, 1.0], 0.2, 1.0);
    add("hinge", Actuator::JointPosition(hinge, axis), [-1.0, 1.0], 1.0, 0.0);
    add("link", Actuator::LinkPosition(link, axis), [-1.0, 1.0], 1.0, 0.0);
    for (name, value) in
        [("air", 800.0), ("pull", 2.0), ("muscle", 0.0), ("own", 0.0), ("hinge", 9.0), ("link", -0.5)]
    {
        deformables.actuators.command(name, value).unwrap();
    }
    for step in 1..=15 {
        deformables.step(&mut physics);
        let value = |name: &str| deformables.actuators.get(name).unwrap().value();
        let t = f64::from(step) * f64::from(H as f32);
        assert!((value("air") - (2000.0 * t).min(800.0)).abs() < 1e-9);
        assert_eq!(deformables.bodies[chamber].cavity_pressure(0).unwrap(), value("air"));
        assert_eq!(value("pull"), 2.0);
        assert!((deformables.bodies.cable(cable).unwrap().tension() - 2.0).abs() < 1e-9);
        assert!((deformables.bodies[muscle].activation() - (1.0 - 0.1 * t).max(0.5)).abs() < 1e-12);
        assert!((deformables.bodies[muscle].region_activation(0) - (1.0 - 0.2 * t).max(0.5)).abs() < 1e-12);
    }
    (0..240).for_each(|_| deformables.step(&mut physics));
    let angle = |body: RigidBodyHandle| physics.bodies[body].rotation().to_scaled_axis().z;
    println!("hinge {}, link {}", angle(arm), angle(link));
    // Commands beyond the range end at it.
    assert!((angle(arm) - 1.0).abs() < 0.01 && (angle(link) + 0.5).abs() < 0.01);
    assert!(deformables.actuators.iter().all(|(_, signal)| !signal.is_missing()));
}

#[test]
fn what_is_gone_is_told_and_what_cannot_be_is_refused() {
    let (mut physics, mut deformables) = world();
    let muscle = deformables.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2])).unwrap();
    let signals = &mut deformables.actuators;
    let activation = Actuator::Activation(muscle);
    signals.insert("m", activation, [0.5, 1.0], 1.0, 1.0).unwrap();
    let refusals = [
        (signals.insert("m", activation, [0.5, 1.0], 1.0, 1.0), "already"),
        (signals.insert("n", activation, [1.0, 0.5], 1.0, 1.0), "range"),
        (signals.insert("n", activation, [0.0, f64::NAN], 1.0, 0.0), "range"),
        (signals.insert("n", activation, [0.5, 1.0], 0.0, 1.0), "rate"),
        (signals.insert("n", activation, [0.5, 1.0], f64::NAN, 1.0), "rate"),
        (signals.insert("n", activation, [0.5, 1.0], 1.0, 2.0), "start"),
        (signals.insert("n", activation, [-0.1, 1.0], 1.0, 1.0), "within 0 and 10, is -0.1"),
        (signals.insert("n", activation, [0.5, 10.5], 1.0, 1.0), "within 0 and 10, is 10.5"),
        (signals.command("other", 1.0), "no signal \"other\""),
        (signals.command("m", f64::NAN), "command"),
    ];
    for (refusal, what) in refusals {
        let error = refusal.unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    deformables.remove(muscle).unwrap();
    deformables.actuators.command("m", 0.7).unwrap();
    deformables.step(&mut physics);
    assert!(deformables.actuators.get("m").unwrap().is_missing());
    assert!(deformables.actuators.remove("m").is_some());
}

#[test]
fn a_signal_that_rests_wakes_nobody() {
    let (mut physics, mut deformables) = world();
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2]);
    let body = deformables.insert(body).unwrap();
    deformables.actuators.insert("m", Actuator::Activation(body), [0.5, 1.0], 1.0, 1.0).unwrap();
    (0..120).for_each(|_| deformables.step(&mut physics));
    assert!(deformables.bodies[body].is_sleeping());
    deformables.actuators.command("m", 0.9).unwrap();
    deformables.step(&mut physics);
    assert!(!deformables.bodies[body].is_sleeping());
}
