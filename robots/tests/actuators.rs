//! Actuators of MJCF files: what a control makes a joint do, with a soft load on it.

mod common;

use common::Scene;
use foible_robots::{JointSolver, Robot, RobotBuilder};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A slide of 1 kg upward with a soft block of 0.5 kg on it, and an actuator.
fn lift(actuator: &str, joint: &str, solver: JointSolver) -> Scene {
    let text = format!(
        r#"<mujoco><worldbody><body name="base"><geom type="box" size="0.02 0.02 0.02" mass="1"/>
        <body name="table" pos="0 0 0.2"><joint name="lift" type="slide" axis="0 0 1" {joint}/>
        <geom type="box" size="0.1 0.1 0.01" mass="1"/></body></body></worldbody><actuator>{actuator}</actuator></mujoco>"#
    );
    let mut scene = Scene::new(RobotBuilder::mjcf_text(text, ".").fixed_base(true), solver);
    // What falls with it, no drag holds.
    let material =
        DeformableMaterial::new(2.0e5, 0.3).density(0.5 / 8.0 / 0.05f64.powi(3)).stiffness_damping(2.0e-3);
    let block =
        DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2; 3]).material(material).can_sleep(false);
    scene.deformables.insert(block.translation(Vector::Z * 0.2601)).unwrap();
    scene
}

fn run(scene: &mut Scene, steps: usize) -> f32 {
    for _ in 0..steps {
        scene.robot.step(&mut scene.physics, &mut scene.deformables);
    }
    scene.robot.joint_position(&scene.physics, "lift").unwrap()
}

const WEIGHT: f32 = 1.5 * common::GRAVITY;

#[test]
fn a_position_sags_by_the_weight_over_its_gain_and_the_gears_square() {
    for (gear, solver) in
        [(1.0, JointSolver::Multibody), (2.0, JointSolver::Multibody), (2.0, JointSolver::Impulse)]
    {
        let text = format!(
            "<position joint='lift' name='lift' kp='500' kv='60' gear='{gear}' ctrlrange='-0.3 0.3'/>"
        );
        let mut scene = lift(&text, "", solver);
        assert_eq!(scene.robot.actuators()[0].range, Some([-0.3, 0.3]));
        assert_eq!(scene.robot.set_control(&mut scene.physics, "lift", 0.9).unwrap(), 0.3);
        scene.robot.set_control(&mut scene.physics, "lift", 0.2).unwrap();
        let found = run(&mut scene, 600);
        // kp (u − gear q) gear = weight.
        let expected = (0.2 - WEIGHT / (500.0 * gear)) / gear;
        assert!((found - expected).abs() < 2.0e-4, "{gear} {solver:?}: {found} {expected}");
    }
}

#[test]
fn a_motor_that_bears_the_weight_holds_and_a_tenth_more_lifts() {
    for damped in [false, true] {
        let joint = if damped { "damping='5'" } else { "" };
        let mut scene = lift("<motor joint='lift' name='up' gear='2'/>", joint, JointSolver::Multibody);
        scene.robot.set_control(&mut scene.physics, "up", 0.5 * WEIGHT).unwrap();
        let before = run(&mut scene, 119);
        let held = run(&mut scene, 1);
        let speed = (held - before) * common::RATE;
        println!("{damped}: {held} m, {speed} m/s");
        assert!(speed.abs() < 1.0e-4, "{damped}: {speed}");
        scene.robot.set_control(&mut scene.physics, "up", 0.55 * WEIGHT).unwrap();
        let risen = run(&mut scene, 120) - held;
        // a t²/2 of a tenth of g, or what 5 N s/m leaves of it: with τ = m/d = 0.3 s, v∞ (t − τ (1 − e^(−t/τ))).
        let expected = if damped {
            0.1 * WEIGHT / 5.0 * (1.0 - 0.3 * (1.0 - (-1.0f32 / 0.3).exp()))
        } else {
            0.05 * common::GRAVITY
        };
        assert!((risen / expected - 1.0).abs() < 0.05, "{damped}: {risen} {expected}");
    }
}

#[test]
fn a_velocity_lags_by_the_weight_over_its_gain_and_general_ones_are_both() {
    for text in [
        "<velocity joint='lift' name='go' kv='200'/>",
        "<general joint='lift' name='go' gainprm='200' biastype='affine' biasprm='0 0 -200'/>",
    ] {
        let mut scene = lift(text, "", JointSolver::Multibody);
        scene.robot.set_control(&mut scene.physics, "go", 0.2).unwrap();
        let before = run(&mut scene, 120);
        let speed = run(&mut scene, 120) - before;
        let expected = 0.2 - WEIGHT / 200.0;
        assert!((speed - expected).abs() < 2.0e-3, "{text}: {speed} {expected}");
    }
    let text = "<general joint='lift' name='at' gainprm='800' biastype='affine' biasprm='10 -800 -80'/>";
    let mut scene = lift(text, "", JointSolver::Multibody);
    scene.robot.set_control(&mut scene.physics, "at", 0.1).unwrap();
    let found = run(&mut scene, 600);
    let expected = 0.1 + (10.0 - WEIGHT) / 800.0;
    assert!((found - expected).abs() < 2.0e-4, "{found} {expected}");
}

#[test]
fn no_more_than_the_range_of_force_is_given() {
    let text = "<position joint='lift' name='lift' kp='5000' kv='100' forcerange='-10 10'/>";
    let mut scene = lift(text, "range='-0.1 0.5'", JointSolver::Multibody);
    scene.robot.set_control(&mut scene.physics, "lift", 0.2).unwrap();
    // 10 N of 14.7: it sinks to its stop.
    let found = run(&mut scene, 600);
    assert!((found + 0.1).abs() < 2.0e-3, "{found}");
}

#[test]
fn a_velocity_with_a_range_of_force_goes_as_fast_as_it_is_told() {
    // Four times the weight: soon there.
    let text = "<velocity joint='lift' name='go' kv='2000' forcerange='-60 60'/>";
    let mut scene = lift(text, "range='-1 5'", JointSolver::Multibody);
    scene.robot.set_control(&mut scene.physics, "go", 0.5).unwrap();
    let before = run(&mut scene, 120);
    let speed = run(&mut scene, 120) - before;
    assert!((speed - (0.5 - WEIGHT / 2000.0)).abs() < 2.0e-3, "{speed}");
}

#[test]
fn a_motor_on_a_damped_joint_with_limits_and_without_a_load_is_as_strong_as_told() {
    // A hinge of 0.1 kg m² about y, damped, that touches nothing: rapier's motor alone.
    for solver in [JointSolver::Multibody, JointSolver::Impulse] {
        let text = r#"<mujoco><compiler angle="radian"/><worldbody><body name="base"><geom type="box" size="0.02 0.02 0.02" mass="1"/>
          <body name="wheel" pos="0 0 0.5"><joint name="turn" type="hinge" axis="0 1 0" damping="0.5" range="-3 3"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></body></worldbody>
          <actuator><motor joint="turn" name="turn" gear="2"/></actuator></mujoco>"#;
        let mut scene = Scene::new(RobotBuilder::mjcf_text(text, ".").fixed_base(true), solver);
        scene.physics.gravity = Vector::ZERO;
        scene.robot.set_control(&mut scene.physics, "turn", 0.25).unwrap();
        for _ in 0..60 {
            scene.robot.step(&mut scene.physics, &mut scene.deformables);
        }
        // 0.5 N m against 0.5 N m s: v = 1 − e^(−t/τ), τ = 0.2 s.
        let found = scene.robot.joint_position(&scene.physics, "turn").unwrap();
        let expected = 0.5 - 0.2 * (1.0 - (-0.5f32 / 0.2).exp());
        assert!((found / expected - 1.0).abs() < 0.03, "{solver:?}: {found} {expected}");
    }
}

#[test]
fn references_ranges_and_what_is_no_number() {
    // The position is that of the file, with its reference.
    let text = "<position joint='lift' name='lift' kp='1000' kv='80'/>";
    let mut scene = lift(text, "ref='0.3'", JointSolver::Multibody);
    scene.robot.set_control(&mut scene.physics, "lift", 0.35).unwrap();
    let found = run(&mut scene, 600);
    assert!((found - (0.05 - WEIGHT / 1000.0)).abs() < 2.0e-4, "{found}");
    // Limits that are switched off, and one that pulls one way only.
    let text = "<motor joint='lift' name='up' ctrlrange='-1 1' ctrllimited='false' forcerange='0 20'/>";
    let mut scene = lift(text, "range='-0.1 0.5'", JointSolver::Multibody);
    assert_eq!(scene.robot.set_control(&mut scene.physics, "up", -50.0).unwrap(), -50.0);
    assert!((run(&mut scene, 240) + 0.1).abs() < 2.0e-3, "it lies on its stop, and is not drawn there");
    for bad in ["forcerange='nan nan'", "gear='inf'", "ctrlrange='a b'"] {
        let text = format!("<motor joint='lift' name='up' {bad}/>");
        let text = format!(
            "<mujoco><worldbody><body><joint name='lift'/><geom size='1' mass='1'/></body></worldbody><actuator>{text}</actuator></mujoco>"
        );
        let read =
            RobotBuilder::mjcf_text(text, ".").insert(&mut PhysicsWorld::new(), &mut DeformableWorld::new());
        assert!(read.is_err(), "{bad}");
    }
    let scene = lift("<position joint='lift' name='p' kp='5' dampratio='1'/>", "", JointSolver::Multibody);
    assert!(
        scene.robot.warnings().iter().any(|w| w.to_string().contains("dampratio")),
        "{:?}",
        scene.robot.warnings()
    );
}

#[test]
fn what_is_wrong_is_said() {
    let scene = lift("<motor joint='lift' name='up'/><motor name='none'/>", "", JointSolver::Multibody);
    let warned = scene.robot.warnings().iter().any(|w| w.to_string().contains("`none` is not taken up"));
    assert!(warned, "{:?}", scene.robot.warnings());
    let mut scene = scene;
    let set = |robot: &Robot, physics: &mut PhysicsWorld, name: &str, u: f32| {
        robot.set_control(physics, name, u).unwrap_err().to_string()
    };
    let unknown = set(&scene.robot, &mut scene.physics, "down", 1.0);
    assert!(unknown.contains("no actuator `down`; there are up"), "{unknown}");
    let wrong = set(&scene.robot, &mut scene.physics, "up", f32::NAN);
    assert!(wrong.contains("control is NaN, but must be finite"), "{wrong}");
}
