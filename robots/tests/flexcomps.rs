//! Flexible bodies of MJCF files: each kind has MuJoCo's size, mass, place and pins.

mod common;

use common::Scene;
use foible_robots::{JointSolver, RobotBuilder, RobotError};
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn kinds() -> Scene {
    Scene::new(RobotBuilder::mjcf("models/kinds.xml"), JointSolver::Multibody)
}

fn body<'a>(scene: &'a Scene, name: &str) -> &'a DeformableBody {
    &scene.deformables.bodies[scene.robot.part(name).unwrap().body]
}

/// Least and largest coordinates.
fn extent(body: &DeformableBody) -> [[f64; 3]; 2] {
    let mut ends = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for x in (0..body.vertex_count()).map(|v| body.position(v).unwrap()) {
        for axis in 0..3 {
            ends[0][axis] = ends[0][axis].min(x[axis]);
            ends[1][axis] = ends[1][axis].max(x[axis]);
        }
    }
    ends
}

fn assert_extent(scene: &Scene, name: &str, least: [f64; 3], largest: [f64; 3]) {
    // Places are sums of a few of rapier's numbers of single precision, up to five metres.
    let is_near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 2.0e-6);
    let [low, high] = extent(body(scene, name));
    assert!(is_near(low, least) && is_near(high, largest), "{name}: {low:?} to {high:?}");
}

#[test]
fn sizes_masses_and_places_are_those_of_the_file() {
    let scene = kinds();
    for (name, mass, vertices) in [
        ("cube", 0.25, Some(27)),
        ("cloth", 0.1, Some(30)),
        ("disc", 0.05, Some(25)),
        ("square", 0.05, Some(16)),
        ("rope", 0.08, Some(11)),
        ("cylinder", 0.5, None),
        ("ellipsoid", 0.5, None),
        ("tetrahedron", 0.2, Some(4)),
        ("filled", 0.3, None),
        ("shell", 0.3, Some(98)),
    ] {
        let body = body(&scene, name);
        assert!((body.mass() / mass - 1.0).abs() < 1.0e-9, "{name}: {} kg", body.mass());
        assert!(vertices.is_none_or(|count| body.vertex_count() == count), "{name}: {}", body.vertex_count());
    }
    assert_eq!(scene.robot.parts().len(), 10);
    assert_extent(&scene, "cube", [4.95, -0.05, 1.1], [5.05, 0.05, 1.2]);
    // Turned by 90° about z.
    assert_extent(&scene, "cloth", [0.9, -0.125, 1.0], [1.1, 0.125, 1.0]);
    assert_extent(&scene, "disc", [1.9, -0.1, 1.0], [2.1, 0.1, 1.0]);
    // Half a diagonal of 0.15 m.
    let half = 0.15 * std::f64::consts::FRAC_1_SQRT_2;
    assert_extent(&scene, "square", [3.0 - half, -half, 1.0], [3.0 + half, half, 1.0]);
    // Along z of the world after 90° about y, and 0.2 m along that frame's z, the world's x.
    assert_extent(&scene, "rope", [0.2, 1.0, 0.4], [0.2, 1.0, 0.8]);
    assert_extent(&scene, "cylinder", [-0.06, 1.94, 0.52], [0.06, 2.06, 0.7]);
    assert_extent(&scene, "tetrahedron", [0.0, 3.0, 1.0], [0.1, 3.1, 1.2]);
    assert_extent(&scene, "filled", [0.9, 2.9, 0.9], [1.1, 3.1, 1.1]);
    assert_extent(&scene, "shell", [1.95, 2.95, 0.95], [2.05, 3.05, 1.05]);
    // Filled to second order in seven points across: within 4 %.
    let volume = std::f64::consts::PI * 0.06 * 0.06 * 0.18;
    assert!((body(&scene, "cylinder").volume() / volume - 1.0).abs() < 0.04);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.06 * 0.06 * 0.09;
    assert!((body(&scene, "ellipsoid").volume() / volume - 1.0).abs() < 0.04);
}

#[test]
fn pins_are_attached_to_the_body_around_them_or_pinned_in_the_world() {
    let mut scene = kinds();
    let pinned = |scene: &Scene, name: &str| body(scene, name).pinned().len();
    assert_eq!(["cloth", "disc", "square"].map(|name| pinned(&scene, name)), [2, 4, 4]);
    for name in ["cloth", "disc", "square"] {
        assert!(scene.robot.part(name).unwrap().link.is_none());
    }
    // The cloth's are the two corners at the grid's first row, which after the turn is at y from -0.125 to 0.125.
    let cloth = body(&scene, "cloth");
    let corners: Vec<[f64; 3]> = cloth.pinned().map(|v| cloth.position(v).unwrap()).collect();
    assert!(
        corners.iter().all(|x| (x[0] - 1.1).abs() < 1e-6 && (x[1].abs() - 0.125).abs() < 1e-6),
        "{corners:?}"
    );
    for (name, link) in [
        ("cube", "included"),
        ("rope", "posts"),
        ("cylinder", "wagon"),
        ("ellipsoid", "ball"),
        ("tetrahedron", "meshes"),
        ("filled", "meshes"),
        ("shell", "meshes"),
    ] {
        let part = scene.robot.part(name).unwrap();
        assert_eq!(part.link, Some(scene.robot.link(link).unwrap().body), "{name}");
        assert!(part.attachment.is_some(), "{name}");
    }
    // A soft cube that stands on what carries it: all of its weight.
    scene.wait(3.0);
    assert!(scene.is_finite());
    let force = scene.force_on("cube");
    println!("{force:?}");
    assert!((force.z / (0.25 * common::GRAVITY) - 1.0).abs() < 0.01, "{force:?}");
}

#[test]
fn what_is_left_out_or_taken_otherwise_is_listed_with_its_line() {
    let scene = kinds();
    let warnings: Vec<String> = scene.robot.warnings().iter().map(ToString::to_string).collect();
    for expected in [
        "kinds.xml:14: flexcomp `disc`: elastic2d=\"bend\" is taken as both",
        "kinds.xml:14: flexcomp `disc`: has no thickness: taken as twice its radius, 0.01 m",
        "kinds.xml:18: flexcomp `square`: edges are not kept at their lengths",
        "kinds.xml:27: edge: damping=\"0.1\" is not taken up",
        "kinds.xml:43: flexcomp `ellipsoid`: dof=\"radial\" is not taken up",
        "kinds.xml:64: skin `old`: is not taken up",
        "kinds.xml:66: actuator: `lean` is not taken up",
    ] {
        let there = warnings.iter().filter(|w| w.contains(expected)).count();
        assert_eq!(there, 1, "{expected}: {warnings:#?}");
    }
}

/// The error for a flexcomp with these attributes and children in a body.
fn error(attributes: &str, children: &str) -> RobotError {
    let text = format!(
        "<mujoco>\n<worldbody>\n<body name=\"b\">\n<geom size=\"0.1\"/>\n\
        <flexcomp {attributes}>{children}</flexcomp>\n</body>\n</worldbody>\n</mujoco>"
    );
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let made = RobotBuilder::mjcf_text(text, "models").insert(&mut physics, &mut deformables);
    assert!(physics.bodies.is_empty() && deformables.bodies.is_empty());
    made.expect_err(attributes)
}

#[test]
fn shapes_whose_files_are_missing_are_listed() {
    let text = "<mujoco>\n<asset><mesh name=\"m\" file=\"none.stl\"/></asset>\n<worldbody>\n\
        <body name=\"b\"><geom type=\"mesh\" mesh=\"m\"/><geom size=\"0.1\"/></body>\n</worldbody>\n</mujoco>";
    let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    let robot = RobotBuilder::mjcf_text(text, "models").insert(&mut physics, &mut deformables).unwrap();
    let warnings: Vec<String> = robot.warnings().iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["<mjcf>:4: body `b`: 1 of its shapes could not be made, and do not collide"]);
}

#[test]
fn errors_name_line_element_and_value() {
    let stiff = "<elasticity young=\"1e5\" poisson=\"0.3\"/>";
    let solid = "name=\"f\" dim=\"3\" count=\"3 3 3\"";
    for (attributes, children, expected) in [
        (
            "name=\"f\" type=\"blob\"",
            stiff,
            "<mjcf>:5: flexcomp `f`: type is blob, but must be a type of flexcomp",
        ),
        ("type=\"grid\"", stiff, "flexcomp: name is missing, but must be there"),
        (
            solid,
            "",
            "<mjcf>:5: flexcomp `f`: has no stiffness: give it an <elasticity> with young above zero",
        ),
        (solid, "<elasticity young=\"-1\"/>", "elasticity: young is -1, but must be zero or positive"),
        (
            solid,
            "<elasticity young=\"1e5\" poisson=\"0.5\"/>",
            "<mjcf>:5: soft part `f`: material: Poisson's ratio is 0.5, but must be in [0, 0.4999]",
        ),
        ("name=\"f\" count=\"3 3\"", stiff, "count is 3 3, but must be three whole numbers from one"),
        ("name=\"f\" dim=\"3\" count=\"999 999 999\"", stiff, "must be of at most 100000 cells"),
        ("name=\"f\" type=\"circle\" dim=\"1\"", stiff, "type circle is not offered"),
        ("name=\"f\" type=\"mesh\" dim=\"3\" file=\"none.obj\"", stiff, "none.obj"),
        ("name=\"f\" dim=\"3\" count=\"3 3 3\" mass=\"0\"", stiff, "mass is 0, but must be positive"),
    ] {
        let error = error(attributes, children).to_string();
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
    let pinned = |pin: &str| error(solid, &format!("{stiff}<pin {pin}/>")).to_string();
    assert!(pinned("id=\"27\"").contains("pin id is 27, but must be the number of a point"));
    assert!(pinned("gridrange=\"0 0 0 3 2 2\"").contains("pin gridrange is [0, 0, 0, 3, 2, 2]"));
    assert!(pinned("range=\"1\"").contains("must be pairs of numbers"));
}
