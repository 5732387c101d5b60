//! Joints that follow others: by a URDF's `<mimic>`, and by an MJCF's `<equality>`.

mod common;

use common::{FINGER, Scene};
use foible_robots::{JointSolver, RobotBuilder};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// The arm with a right finger that follows the left one.
fn follower(mimic: &str) -> String {
    let text = std::fs::read_to_string("models/arm.urdf").unwrap();
    let right = text.find("<joint name=\"right\"").unwrap();
    let end = right + text[right..].find("</joint>").unwrap();
    format!("{}{mimic}{}", &text[..end], &text[end..])
}

/// The arm without gravity, and a box between its pads.
fn gripper(mimic: &str, solver: JointSolver) -> (Scene, ColliderHandle) {
    let builder = RobotBuilder::urdf_text(follower(mimic), "models").soft_parts("models/arm.soft.toml");
    let mut scene = Scene::new(builder, solver);
    scene.physics.gravity = Vector::ZERO;
    let at = RigidBodyBuilder::dynamic().translation(Vector::new(0.4, 0.0, 0.125));
    let (_, held) =
        scene.physics.insert(at, ColliderBuilder::cuboid(0.012, 0.02, 0.012).density(2000.0).friction(0.8));
    for joint in ["swing", "lift", "wrist"] {
        scene.robot.set_motor_position(&mut scene.physics, joint, 0.0, 1.0e5, 5.0e3).unwrap();
    }
    let [stiffness, damping] = FINGER;
    scene.robot.set_motor_position(&mut scene.physics, "left", 0.026, stiffness, damping).unwrap();
    (scene, held)
}

#[test]
fn a_finger_that_follows_presses_as_hard_as_the_one_that_is_driven() {
    let (mut scene, held) = gripper("<mimic joint=\"left\"/>", JointSolver::Multibody);
    for _ in 0..240 {
        scene.robot.step(&mut scene.physics, &mut scene.deformables);
    }
    let force = |part: &str| {
        let body = scene.robot.part(part).unwrap().body;
        scene.deformables.contact_force(body, held).y.abs()
    };
    let [left, right] = ["left pad", "right pad"].map(force);
    let at = |joint: &str| scene.robot.joint_position(&scene.physics, joint).unwrap();
    let motor = FINGER[0] * (0.026 - at("left"));
    println!(
        "pads {left:.4} and {right:.4} N, motor {motor:.4} N, fingers at {:.6} and {:.6} m",
        at("left"),
        at("right")
    );
    assert!(motor > 4.0, "{motor}");
    // The motor's work is that of both pads, and the box rests.
    assert!((left / right - 1.0).abs() < 0.01, "{left} {right}");
    assert!(((left + right) / motor - 1.0).abs() < 0.02, "{left} {right} {motor}");
    assert!((at("left") - at("right")).abs() < 2.0e-5, "{} {}", at("left"), at("right"));
}

const JAWS: &str = r#"<mujoco><worldbody><body name="base"><geom type="box" size="0.05 0.05 0.01" mass="1"/>
  <body name="left" pos="-0.06 0 0.06"><joint name="left" type="slide" axis="1 0 0"/><geom type="box" size="0.005 0.04 0.04" mass="0.1"/></body>
  <body name="right" pos="0.06 0 0.06"><joint name="right" type="slide" axis="-1 0 0"/><geom type="box" size="0.005 0.04 0.04" mass="0.1"/></body>
</body></worldbody><equality><joint joint1="right" joint2="left" polycoef="0 1 0 0 0"/></equality></mujoco>"#;

#[test]
fn jaws_of_an_equality_press_alike() {
    let builder = RobotBuilder::mjcf_text(JAWS, ".").fixed_base(true);
    let mut scene = Scene::new(builder, JointSolver::Multibody);
    scene.physics.gravity = Vector::ZERO;
    let material = DeformableMaterial::new(2.0e5, 0.3).mass_damping(5.0).friction(0.8);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.03), [3; 3]).material(material);
    let cube = scene.deformables.insert(cube.translation(Vector::Z * 0.06).can_sleep(false)).unwrap();
    scene.robot.set_motor_position(&mut scene.physics, "left", 0.03, 1.0e3, 20.0).unwrap();
    for _ in 0..360 {
        scene.robot.step(&mut scene.physics, &mut scene.deformables);
    }
    let force = |link: &str| {
        let shape = scene.robot.link(link).unwrap().colliders[0];
        scene.deformables.contact_force(cube, shape).x.abs()
    };
    let [left, right] = ["left", "right"].map(force);
    let motor = 1.0e3 * (0.03 - scene.robot.joint_position(&scene.physics, "left").unwrap());
    println!("{left:.4} and {right:.4} N, motor {motor:.4} N");
    assert!(motor > 2.0 && (left / right - 1.0).abs() < 0.01, "{left} {right} {motor}");
    assert!(((left + right) / motor - 1.0).abs() < 0.02, "{left} {right} {motor}");
}

#[test]
fn ratio_and_offset_are_kept_to() {
    let (mut scene, _) =
        gripper("<mimic joint=\"left\" multiplier=\"-0.5\" offset=\"0.01\"/>", JointSolver::Multibody);
    for _ in 0..240 {
        scene.robot.step(&mut scene.physics, &mut scene.deformables);
    }
    let at = |joint: &str| scene.robot.joint_position(&scene.physics, joint).unwrap();
    let expected = 0.01 - 0.5 * at("left");
    assert!((at("right") - expected).abs() < 5.0e-5, "{} {expected}", at("right"));
}

#[test]
fn what_cannot_follow_is_said() {
    for (mimic, says) in [
        ("<mimic joint=\"elbow\"/>", "`elbow`"),
        ("<mimic joint=\"right\"/>", "`right`"),
        ("<mimic joint=\"anchor\"/>", "`anchor`"),
        ("<mimic joint=\"left\" multiplier=\"fast\"/>", "multiplier"),
    ] {
        let builder = RobotBuilder::urdf_text(follower(mimic), "models");
        let error = builder.insert(&mut PhysicsWorld::new(), &mut DeformableWorld::new()).unwrap_err();
        assert!(error.to_string().contains(says), "{error}");
    }
    let (scene, _) = gripper("<mimic joint=\"left\"/>", JointSolver::Impulse);
    let warned =
        scene.robot.warnings().iter().any(|warning| warning.to_string().contains("<mimic> of `left`"));
    assert!(warned, "{:?}", scene.robot.warnings());
}
