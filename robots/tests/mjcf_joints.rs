//! Springs, damping, friction and armature of MJCF's joints bear soft parts.

mod common;

use common::{GRAVITY, Scene};
use foible_robots::{JointSolver, RobotBuilder, RobotJointHandle};

/// A lever of 0.1 m along x on a hinge about y, with a soft block of 0.1 kg at its end.
fn lever(joint: &str) -> String {
    format!(
        "<mujoco><compiler angle='radian'/><worldbody><body name='lever' pos='0 0 1'>\n\
        <joint name='hinge' type='hinge' axis='0 1 0' {joint}/>\n\
        <geom type='box' size='0.04 0.01 0.01' pos='0.04 0 0' mass='0.05'/>\n\
        <flexcomp name='end' type='grid' dim='3' count='3 3 3' spacing='0.01 0.01 0.01' pos='0.09 0 0' mass='0.1'>\n\
        <elasticity young='5e6' poisson='0.3' damping='0.001'/><pin gridrange='0 0 0 0 2 2'/></flexcomp>\n\
        </body></worldbody></mujoco>"
    )
}

fn scene(joint: &str, solver: JointSolver) -> Scene {
    Scene::new(RobotBuilder::mjcf_text(lever(joint), "models"), solver)
}

#[test]
fn a_spring_gives_way_by_the_moment_of_lever_and_soft_end() {
    let mut scene = scene("stiffness='2' damping='0.05'", JointSolver::Multibody);
    scene.wait(8.0);
    let angle = scene.robot.joint_position(&scene.physics, "hinge").unwrap();
    // k θ = (m l + M L) g cos θ, by iteration.
    let moment = (0.05 * 0.04 + 0.1 * 0.09) * GRAVITY;
    let expected = (0..50).fold(0.0f32, |angle, _| moment * angle.cos() / 2.0);
    println!("{angle} rad, expected {expected} rad");
    assert!((angle / expected - 1.0).abs() < 0.01, "{angle} rad of {expected} rad");
    let force = scene.force_on("end");
    assert!((force.z / (0.1 * GRAVITY) - 1.0).abs() < 0.01, "{force:?}");
}

#[test]
fn dry_friction_bears_a_soft_end_up_to_its_bound() {
    let moment = (0.05 * 0.04 + 0.1 * 0.09) * GRAVITY;
    for (part, holds) in [(1.1, true), (0.9, false)] {
        let joint = format!("frictionloss='{}'", part * moment);
        let mut scene = scene(&joint, JointSolver::Multibody);
        scene.wait(1.0);
        let angle = scene.robot.joint_position(&scene.physics, "hinge").unwrap();
        println!("{part}: {angle} rad");
        assert_eq!(angle.abs() < 1.0e-3, holds, "{part}: {angle} rad");
    }
}

/// Angle of the lever after a tenth of a second, and what the pendulum's equation says.
fn fallen(armature: f32) -> (f32, f32) {
    let mut scene = scene(&format!("armature='{armature}'"), JointSolver::Multibody);
    let steps = 12;
    (0..steps).for_each(|_| scene.step());
    let angle = scene.robot.joint_position(&scene.physics, "hinge").unwrap();
    // About the hinge: a box of 0.08 by 0.02 m, and a cube of 0.02 m.
    let lever = 0.05 * ((0.08f32.powi(2) + 0.02f32.powi(2)) / 12.0 + 0.04f32.powi(2));
    let end = 0.1 * (0.02f32.powi(2) / 6.0 + 0.09f32.powi(2));
    let moment = (0.05 * 0.04 + 0.1 * 0.09) * GRAVITY;
    let step = 1.0 / common::RATE;
    let (mut expected, mut speed) = (0.0f32, 0.0);
    for _ in 0..steps {
        speed += moment * expected.cos() / (lever + end + armature) * step;
        expected += speed * step;
    }
    (angle, expected)
}

#[test]
fn a_lever_with_a_soft_end_falls_as_a_pendulum_from_the_first_step_on() {
    for armature in [0.0, 2.0e-3] {
        let (angle, expected) = fallen(armature);
        println!("armature {armature}: {angle} rad, expected {expected} rad");
        // The end is soft and of lumped masses: 1.5 % and 0.2 % were measured.
        assert!((angle / expected - 1.0).abs() < 0.03, "armature {armature}: {angle} rad of {expected} rad");
    }
}

#[test]
fn a_floating_base_keeps_its_spin() {
    let text = "<mujoco><worldbody><body name='base' pos='0 0 1'><freejoint/><geom type='box' size='0.05 0.05 0.05' mass='1'/>\n\
        <body name='arm' pos='0 0 0.06'><joint name='hinge' axis='0 0 1'/>\n\
        <geom type='sphere' size='0.01' mass='0.01' contype='0' conaffinity='0'/></body></body></worldbody></mujoco>";
    let mut scene = Scene::new(RobotBuilder::mjcf_text(text, "models"), JointSolver::Multibody);
    scene.physics.gravity = rapier3d::prelude::Vector::ZERO;
    let base = scene.robot.link("base").unwrap().body;
    let RobotJointHandle::Multibody(joint) = scene.robot.joint("hinge").unwrap().handle else { panic!() };
    let (multibody, _) = scene.physics.multibody_joints.get_mut(joint).unwrap();
    // Along x, y, z, about x, y, z.
    multibody.generalized_velocity_mut()[5] = 1.0;
    scene.wait(1.0);
    let spin = scene.physics.bodies[base].angvel().z;
    println!("{spin} rad/s");
    assert!((spin - 1.0).abs() < 1.0e-3, "{spin} rad/s");
}
