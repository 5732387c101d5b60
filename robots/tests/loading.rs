//! What is in the files is in the world: counts, names, masses, places, groups.

mod common;

use common::{GRAVITY, STIFF, Scene};
use foible_robots::{JointSolver, RobotBuilder, RobotError};
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn names<'a>(all: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    all.map(String::as_str).collect()
}

#[test]
fn the_arm_has_its_links_joints_and_pads() {
    let scene = Scene::arm(JointSolver::Multibody);
    let robot = &scene.robot;
    let links = ["column", "upper_arm", "rod", "hand", "left_finger", "right_finger"];
    assert_eq!(names(robot.links().iter().map(|l| &l.name)), links);
    // The joint of an empty root is none: what hung on it is fixed.
    let joints = ["swing", "lift", "wrist", "left", "right"];
    assert_eq!(names(robot.joints().iter().map(|j| &j.name)), joints);
    assert_eq!(names(robot.parts().iter().map(|p| &p.name)), ["left pad", "right pad"]);
    for (link, mass) in links.into_iter().zip([5.0, 2.0, 0.8, 0.5, 0.12, 0.12]) {
        let body = &scene.physics.bodies[robot.link(link).unwrap().body];
        assert!((body.mass() - mass).abs() < 1.0e-6, "{link}: {} kg", body.mass());
        assert_eq!(body.is_fixed(), link == "column");
    }
    for part in robot.parts() {
        let body = &scene.deformables.bodies[part.body];
        assert!((body.mass() / (1100.0 * 0.03 * 0.012 * 0.03) - 1.0).abs() < 1.0e-9);
    }
    let lift = robot.joint("lift").unwrap();
    assert_eq!((lift.limits, lift.effort), (Some([-0.3, 0.1]), Some(500.0)));
    let known = match robot.joint("elbow") {
        Err(RobotError::NoSuch { known, .. }) => known,
        other => panic!("{other:?}"),
    };
    assert_eq!(known, joints);
}

#[test]
fn the_hand_has_its_bodies_and_tips_and_says_what_is_different() {
    let scene = Scene::new(RobotBuilder::mjcf("models/hand.xml"), JointSolver::Multibody);
    let robot = &scene.robot;
    assert_eq!(names(robot.links().iter().map(|l| &l.name)), ["world", "palm", "first", "second", "thumb"]);
    for (link, mass) in [("palm", 0.6), ("first", 0.08), ("second", 0.08), ("thumb", 0.08)] {
        let body = &scene.physics.bodies[robot.link(link).unwrap().body];
        assert!((body.mass() - mass).abs() < 1.0e-6, "{link}: {} kg", body.mass());
    }
    for (tip, at) in [
        ("first_tip", [-0.025, 0.038, 0.1]),
        ("second_tip", [0.025, 0.038, 0.1]),
        ("thumb_tip", [0.0, -0.038, 0.1]),
    ] {
        let body = &scene.deformables.bodies[robot.part(tip).unwrap().body];
        assert!((body.mass() - 0.006).abs() < 1.0e-9, "{tip}: {} kg", body.mass());
        // Places come from rapier's single precision.
        let off = (0..3).map(|i| (body.center_of_mass()[i] - at[i]).abs()).fold(0.0, f64::max);
        assert!(off < 1.0e-7, "{tip}: {off} m");
        assert_eq!(body.material().youngs_modulus, 3.0e5);
    }
    let warnings: Vec<String> = robot.warnings().iter().map(ToString::to_string).collect();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("models/hand.xml:31: flexcomp `thumb_tip`: is filled"), "{warnings:?}");
}

#[test]
fn the_file_s_groups_stay_and_pinned_sides_are_the_same_for_grid_and_box() {
    let text = std::fs::read_to_string("models/hand.xml").unwrap();
    let text = text
        .replace("name=\"palm\" type=\"box\"", "name=\"palm\" contype=\"2\" conaffinity=\"4\" type=\"box\"");
    let scene = Scene::new(RobotBuilder::mjcf_text(text, "models"), JointSolver::Multibody);
    let palm = scene.robot.link("palm").unwrap().colliders[0];
    let groups = scene.physics.colliders[palm].collision_groups();
    assert_eq!((groups.memberships, groups.filter), (Group::from(6), Group::from(6)));
    let finger = scene.robot.link("first").unwrap().colliders[0];
    assert_eq!(scene.physics.colliders[finger].collision_groups().memberships, Group::from(1));
}

#[test]
fn links_carry_the_weight_of_their_soft_parts() {
    for solver in [JointSolver::Multibody, JointSolver::Impulse] {
        let mut scene = Scene::arm(solver);
        scene.wait(2.0);
        for part in ["left pad", "right pad"] {
            let body = scene.robot.part(part).unwrap().body;
            let weight = scene.deformables.bodies[body].mass() as f32 * GRAVITY;
            let force = scene.force_on(part);
            println!("{solver:?}, {part}: {force:?} N, weight {weight} N");
            assert!((force.z / weight - 1.0).abs() < 0.01, "{solver:?}: {force:?} N of {weight} N");
            assert!(force.x.hypot(force.y) < 0.01 * weight, "{solver:?}: {force:?} N");
        }
        // The lift sinks by what hangs below it over its stiffness; the pads are 1.5 % of that.
        let hanging = 0.8 + 0.5 + 2.0 * (0.12 + 1100.0 * 0.03 * 0.012 * 0.03);
        let sunk = -scene.robot.joint_position(&scene.physics, "lift").unwrap();
        let expected = hanging * GRAVITY / STIFF[0];
        println!("{solver:?}: sunk by {sunk} m, expected {expected} m");
        assert!((sunk / expected - 1.0).abs() < 0.01, "{solver:?}: {sunk} m of {expected} m");
    }
}

#[test]
fn a_soft_part_is_where_its_link_s_frame_says() {
    // The whole arm elsewhere and turned: the pads go along.
    let turn =
        Pose::from_parts(Vector::new(0.3, -0.2, 0.1), Rotation::from_scaled_axis(Vector::new(0.2, 0.3, 1.1)));
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let builder = RobotBuilder::urdf("models/arm.urdf").soft_parts("models/arm.soft.toml").pose(turn);
    let robot = builder.insert(&mut physics, &mut deformables).unwrap();
    let part = robot.part("right pad").unwrap();
    let link = physics.bodies[part.link.unwrap()].position();
    assert!((link.translation - (turn * Vector::new(0.4, -0.06, 0.2))).length() < 1.0e-6);
    let body = &deformables.bodies[part.body];
    for vertex in 0..body.vertex_count() {
        let rest = Vector::from_array(body.model().rest_position(vertex).map(|c| c as f32));
        let expected = *link * (rest + Vector::new(0.0, 0.011, -0.075));
        let at = Vector::from_array(body.position(vertex).unwrap().map(|c| c as f32));
        assert!((at - expected).length() < 1.0e-6, "vertex {vertex}: {at:?}, expected {expected:?}");
    }
}

#[test]
fn motors_keep_to_limits_and_say_what_is_wrong() {
    let mut scene = Scene::arm(JointSolver::Multibody);
    let (robot, physics) = (&scene.robot, &mut scene.physics);
    assert_eq!(robot.set_motor_position(physics, "lift", -7.0, 1.0e4, 1.0e3), Ok(-0.3));
    assert_eq!(robot.set_motor_position(physics, "lift", 7.0, 1.0e4, 1.0e3), Ok(0.1));
    let error = robot.set_motor_position(physics, "lift", f32::NAN, 1.0, 1.0).unwrap_err();
    assert_eq!(error.to_string(), "motor of joint `lift`: target is NaN, but must be finite");
    let error = robot.set_motor_velocity(physics, "lift", 1.0, -1.0).unwrap_err();
    assert!(error.to_string().contains("damping is -1"), "{error}");
    assert!(robot.set_motor_max_force(physics, "shoulder", 1.0).is_err());
    // At its upper limit it stays, whatever draws.
    scene.drive("lift", 0.1, [1.0e5, 5.0e3]);
    scene.robot.set_motor_velocity(&mut scene.physics, "lift", 1.0, 1.0e3).unwrap();
    scene.wait(1.0);
    let at = scene.robot.joint_position(&scene.physics, "lift").unwrap();
    assert!((at - 0.1).abs() < 2.0e-3, "{at} m");
}
