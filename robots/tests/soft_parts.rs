//! Files of soft parts: shapes, what is attached, materials, and what is said of mistakes.

mod common;

use common::{GRAVITY, Scene};
use foible_robots::{JointSolver, RobotBuilder, RobotError};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A fixed block of 0.2 m, and a small one beside it.
const LINKS: &str = r#"<robot name="blocks">
  <link name="world"/>
  <link name="block"><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <link name="side"><collision><geometry><box size="0.05 0.05 0.05"/></geometry></collision></link>
  <joint name="a" type="fixed"><origin xyz="0 0 1"/><parent link="world"/><child link="block"/></joint>
  <joint name="b" type="fixed"><origin xyz="0.5 0 1"/><parent link="world"/><child link="side"/></joint>
</robot>"#;

fn part(shape: &str, pose: &str, attach: &str) -> String {
    format!(
        "[[part]]\nname = \"soft\"\nlink = \"block\"\nshape.{shape}\npose.xyz = {pose}\n\
        material = {{ young = 1.0e5, poisson = 0.3, density = 500.0, mass_damping = 5.0 }}\nattach.{attach}\n"
    )
}

fn with(parts: &str) -> RobotBuilder {
    RobotBuilder::urdf_text(LINKS, "models").soft_parts_text(parts, "models")
}

fn scene(parts: &str) -> Scene {
    Scene::new(with(parts), JointSolver::Multibody)
}

fn error(parts: &str) -> String {
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let made = with(parts).insert(&mut physics, &mut deformables);
    assert!(physics.bodies.is_empty() && deformables.bodies.is_empty());
    made.expect_err(parts).to_string()
}

#[test]
fn what_hangs_on_an_empty_root_is_where_its_joint_has_it() {
    // Rapier's loader alone puts both blocks at the origin.
    let turn =
        Pose::from_parts(Vector::new(1.0, 2.0, 3.0), Rotation::from_rotation_z(std::f32::consts::FRAC_PI_2));
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let robot = RobotBuilder::urdf_text(LINKS, "models").pose(turn).insert(&mut physics, &mut deformables);
    let robot = robot.unwrap();
    for (link, at) in [("block", [0.0, 0.0, 1.0]), ("side", [0.5, 0.0, 1.0])] {
        let place = physics.bodies[robot.link(link).unwrap().body].translation();
        assert!((place - turn * Vector::from_array(at)).length() < 1.0e-6, "{link}: {place:?}");
        assert!(physics.bodies[robot.link(link).unwrap().body].is_fixed());
    }
}

#[test]
fn every_shape_has_its_volume_and_hangs_by_its_weight() {
    let pi = std::f64::consts::PI;
    for (shape, volume, half) in [
        ("cuboid = { size = [0.1, 0.08, 0.06], cells = [4, 4, 4] }", 0.1 * 0.08 * 0.06, 0.03),
        ("ball = { radius = 0.04, cell = 0.01 }", 4.0 / 3.0 * pi * 0.04f64.powi(3), 0.04),
        ("capsule = { radius = 0.03, length = 0.06, cell = 0.01 }", pi * 0.03 * 0.03 * (0.06 + 0.04), 0.06),
        ("cylinder = { radius = 0.03, length = 0.1, cell = 0.01 }", pi * 0.03 * 0.03 * 0.1, 0.05),
        ("mesh = { file = \"meshes/box.obj\", scale = 0.5, cell = 0.03 }", 0.001, 0.05),
    ] {
        // Below the block, touching it; a ball dips 2 mm into it to have more than a point to hang by.
        let into = if shape.starts_with("ba") || shape.starts_with("ca") { 0.002 } else { 0.0 };
        let pose = format!("[0.0, 0.0, {}]", -0.1 - half + into);
        let attach = "plane = { point = [0.0, 0.0, -0.1], normal = [0.0, 0.0, 1.0], within = 0.003 }";
        let mut scene = scene(&part(shape, &pose, attach));
        let body = &scene.deformables.bodies[scene.robot.part("soft").unwrap().body];
        let off = body.volume() / volume - 1.0;
        assert!(off.abs() < 0.03, "{shape}: volume off by {off}");
        let weight = body.mass() as f32 * GRAVITY;
        scene.wait(3.0);
        let force = scene.force_on("soft");
        println!("{shape}: volume off by {off}, held by {force:?} N, weight {weight} N");
        assert!((force.z / weight - 1.0).abs() < 0.01, "{shape}: {force:?} N of {weight} N");
    }
}

#[test]
fn a_box_a_plane_and_what_is_nearest_choose_the_same_face() {
    let cuboid = "cuboid = { size = [0.1, 0.08, 0.06], cells = [4, 3, 2] }";
    let ways = [
        "plane = { point = [0.0, 0.0, -0.1], normal = [0.0, 0.0, -2.0], within = 1.0e-4 }",
        "inside = { center = [0.0, 0.0, -0.1], size = [0.2, 0.2, 1.0e-3] }",
        "nearest = { within = 1.0e-4 }",
    ];
    let forces = ways.map(|attach| {
        let mut scene = scene(&part(cuboid, "[0.0, 0.0, -0.13]", attach));
        scene.wait(0.5);
        scene.force_on("soft")
    });
    // The same vertices, in the same order: the same bits.
    assert_eq!(forces[0], forces[1]);
    assert_eq!(forces[0], forces[2]);
}

#[test]
fn a_part_touches_all_links_but_its_own_and_those_it_ignores() {
    // It dips into both links by a centimetre: what touches it pushes it out.
    let cuboid = "cuboid = { size = [0.41, 0.04, 0.04], cells = [12, 2, 2] }";
    let attach = "inside = { center = [0.0, 0.0, 0.0], size = [0.2, 0.2, 0.2] }";
    let text = part(cuboid, "[0.29, 0.0, 0.0]", attach);
    let touched = |text: &str, link: &str| {
        let mut scene = scene(text);
        let collider = scene.robot.link(link).unwrap().colliders[0];
        let mut touched = false;
        for _ in 0..10 {
            scene.step();
            touched |= scene.deformables.contacts_with(collider).next().is_some();
        }
        touched
    };
    assert!(touched(&text, "side"));
    assert!(!touched(&text, "block"));
    let ignoring = format!("{text}ignore = [\"side\"]\n");
    assert!(!touched(&ignoring, "side"));
}

#[test]
fn other_hooks_go_beside_the_robot_s() {
    struct Apart;
    impl PhysicsHooks for Apart {}
    impl DeformableHooks for Apart {
        fn filter_deformable_contact_pair(&self, _: &DeformablePairFilterContext<'_>) -> bool {
            false
        }
    }
    let cuboid = "cuboid = { size = [0.41, 0.04, 0.04], cells = [12, 2, 2] }";
    let attach = "inside = { center = [0.0, 0.0, 0.0], size = [0.2, 0.2, 0.2] }";
    let mut scene = scene(&part(cuboid, "[0.29, 0.0, 0.0]", attach));
    let hooks = scene.robot.hooks().beside(&Apart);
    scene.deformables.step_with_events(&mut scene.physics, &hooks, &());
    assert!(scene.deformables.contacts().is_empty());
    drop(hooks);
    scene.step();
    assert!(!scene.deformables.contacts().is_empty());
}

/// What is put for what into a good file, and what the error says of it.
const MISTAKES: [[&str; 3]; 12] = [
    [
        "link = \"block\"",
        "link = \"rock\"",
        "<soft parts>:3: soft part `soft`: link is `rock`, but must be the name of a link",
    ],
    [
        "cells = [4, 3, 2]",
        "cells = [400, 300, 200]",
        "<soft parts>:4: soft part `soft`: cells is [400, 300, 200], but must be of at most",
    ],
    [
        "cells = [4, 3, 2]",
        "sells = [4, 3, 2]",
        "<soft parts>:4: unknown field `sells`, expected `size` or `cells`",
    ],
    [
        "0.08",
        "-0.08",
        "<soft parts>:4: soft part `soft`: size is [0.1, -0.08, 0.06], but must be from 1e-6 to 1e6",
    ],
    [
        "-0.13]",
        "nan]",
        "<soft parts>:5: soft part `soft`: xyz is [0.0, 0.0, NaN], but must be three numbers up to 1e6",
    ],
    ["poisson = 0.3", "poisson = 0.5", "<soft parts>:6: soft part `soft`: material: Poisson's ratio is 0.5"],
    [
        "poisson = 0.3,",
        "",
        "<soft parts>:6: soft part `soft`: poisson is missing, but must be there beside young",
    ],
    [
        "young = 1.0e5",
        "shore_a = 30.0, young = 1.0e5",
        "<soft parts>:6: soft part `soft`: material is not told, or told twice",
    ],
    ["young = 1.0e5, poisson", "preset = \"jelly\", poisson", "<soft parts>:6: unknown variant `jelly`"],
    [
        "nearest = { within = 1.0e-4 }",
        "inside = { center = [9.0, 0.0, 0.0], size = [0.1, 0.1, 0.1] }",
        "<soft parts>:7: soft part `soft`: no vertex of its surface is inside the box",
    ],
    [
        "name = \"soft\"",
        "name = \"\"",
        "<soft parts>:2: soft part ``: name is ``, but must be a name that no other part has",
    ],
    ["[[part]]", "[[pat]]", "<soft parts>:1: unknown field `pat`"],
];

#[test]
fn mistakes_are_named_with_line_key_and_value() {
    let cuboid = "cuboid = { size = [0.1, 0.08, 0.06], cells = [4, 3, 2] }";
    let nearest = "nearest = { within = 1.0e-4 }";
    let good = part(cuboid, "[0.0, 0.0, -0.13]", nearest);
    for [from, to, expected] in MISTAKES {
        let error = error(&good.replace(from, to));
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
    assert!(error(&format!("{good}\n{good}")).contains("<soft parts>:10: soft part `soft`: name is `soft`"));
    let there = with(&good).soft_parts("models/nowhere.toml");
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let missing = there.insert(&mut physics, &mut deformables).unwrap_err();
    assert!(matches!(missing, RobotError::File { .. }), "{missing}");
}

#[test]
fn mistakes_in_urdf_files_are_named_with_line_and_value() {
    let arm = std::fs::read_to_string("models/arm.urdf").unwrap();
    for (from, to, expected) in [
        (
            "child link=\"rod\"",
            "child link=\"rot\"",
            "<urdf>:34: joint `lift`: child is `rot`, but must be the name of a link",
        ),
        ("child link=\"rod\"", "child link=\"hand\"", "is `hand`, but must be the child of one joint only"),
        ("parent link=\"column\"", "parent link=\"hand\"", "but must be no descendant of its child"),
        (
            "mass value=\"0.8\"",
            "mass value=\"-0.8\"",
            "<urdf>:14: mass: value is -0.8, but must be zero or positive",
        ),
        (
            "mass value=\"0.8\"",
            "mass value=\"0,8\"",
            "<urdf>:14: mass: value is 0,8, but must be numbers below 1e15",
        ),
        ("radius=\"0.015\"", "radius=\"0\"", "<urdf>:15: cylinder: radius is 0, but must be positive"),
        (
            "lower=\"-0.3\" upper=\"0.1\"",
            "lower=\"0.3\" upper=\"0.1\"",
            "<urdf>:36: limit: lower is 0.3, but must be at most upper",
        ),
        ("<robot name", "<robots name", "<urdf>:"),
    ] {
        let text = arm.replacen(from, to, 1);
        assert_ne!(text, arm);
        let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
        let made = RobotBuilder::urdf_text(text, "models").insert(&mut physics, &mut deformables);
        let error = made.expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
}

#[test]
fn a_massless_moving_link_is_refused_and_a_massless_fixed_one_is_not() {
    let text = |kind: &str| {
        format!(
            "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/>\
            <inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\
            <link name=\"b\"><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>\
            <joint name=\"j\" type=\"{kind}\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>"
        )
    };
    let make = |kind: &str, solver| {
        let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
        let builder = RobotBuilder::urdf_text(text(kind), "models").joint_solver(solver).fixed_base(true);
        let robot = builder.insert(&mut physics, &mut deformables)?;
        (0..10).for_each(|_| robot.step(&mut physics, &mut deformables));
        assert!(physics.bodies.iter().all(|(_, body)| body.translation().is_finite()));
        Ok::<(), RobotError>(())
    };
    assert!(make("fixed", JointSolver::Multibody).is_ok());
    for (kind, solver) in [("continuous", JointSolver::Multibody), ("fixed", JointSolver::Impulse)] {
        let error = make(kind, solver).unwrap_err().to_string();
        assert!(error.contains("link `b`: mass is 0, but must be positive, as the link moves"), "{error}");
    }
}
