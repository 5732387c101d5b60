//! What MuJoCo writes of flexible bodies when it saves a model is read as the flexible bodies that it was.

mod common;

use common::Scene;
use foible_robots::{JointSolver, RobotBuilder, RobotError};
use foible3d::prelude::*;

fn scene(file: &str) -> Scene {
    Scene::new(RobotBuilder::mjcf(format!("models/{file}.xml")), JointSolver::Multibody)
}

fn places(body: &DeformableBody) -> Vec<[f64; 3]> {
    let mut places: Vec<[f64; 3]> = (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect();
    let key = |x: &[f64; 3]| x.map(|c| (c * 1e4).round() as i64);
    places.sort_by_key(key);
    places
}

#[test]
fn a_saved_model_has_the_bodies_of_its_source() {
    let (source, mut saved) = (scene("flexes"), scene("saved_flexes"));
    assert_eq!(saved.robot.links().len(), source.robot.links().len());
    for name in ["pad", "cloth", "cube", "rope"] {
        let of = |scene: &Scene| scene.robot.part(name).unwrap().body;
        let [a, b] = [&source.deformables.bodies[of(&source)], &saved.deformables.bodies[of(&saved)]];
        // Seven digits in the saved file.
        assert!((a.mass() / b.mass() - 1.0).abs() < 1e-5, "{name}: {} and {} kg", a.mass(), b.mass());
        assert_eq!(a.pinned().len(), b.pinned().len(), "{name}");
        let apart = places(a)
            .iter()
            .zip(places(b))
            .flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()))
            .fold(0.0, f64::max);
        assert!(a.vertex_count() == b.vertex_count() && apart < 2e-6, "{name}: {apart}");
        let [m, n] = [a.material(), b.material()];
        assert_eq!(
            (m.poisson_ratio, m.friction, m.stiffness_damping),
            (n.poisson_ratio, n.friction, n.stiffness_damping),
            "{name}"
        );
        assert!((m.youngs_modulus / n.youngs_modulus - 1.0).abs() < 1e-5, "{name}");
        let links = [&source, &saved].map(|scene| scene.robot.part(name).unwrap().link.is_some());
        assert_eq!(links, [name == "pad"; 2], "{name}");
    }
    saved.wait(2.0);
    assert!(saved.is_finite());
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let load = |deformable: &str| {
        let text = format!(
            "<mujoco>\n<worldbody>\n<body name=\"a\" pos=\"1 0 1\"><geom size=\"0.1\"/></body>\n\
             <body name=\"b\"><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>\
             <joint type=\"slide\"/><joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/></body>\n\
             </worldbody>\n<deformable>\n{deformable}\n</deformable>\n</mujoco>"
        );
        let (mut physics, mut deformables) = (rapier3d::prelude::PhysicsWorld::new(), DeformableWorld::new());
        RobotBuilder::mjcf_text(text, ".").insert(&mut physics, &mut deformables).err()
    };
    for (deformable, expected) in [
        ("<flex dim=\"1\"/>", "name"),
        ("<flex name=\"f\" dim=\"4\"/>", "dim"),
        ("<flex name=\"f\" dim=\"1\" body=\"a c\" element=\"0 1\"/>", "body is c"),
        ("<flex name=\"f\" dim=\"1\" body=\"a world b\" element=\"0 1 1 2\"/>", "several bodies"),
        ("<flex name=\"f\" dim=\"1\" body=\"a a\" element=\"0 1\"/>", "none of its vertices"),
        ("<flex name=\"f\" dim=\"1\" body=\"a b\" vertex=\"0 0\" element=\"0 1\"/>", "vertex"),
        (
            "<flex name=\"f\" dim=\"1\" body=\"a b\" element=\"1 0\"><edge stiffness=\"1\"/></flex>",
            "from each vertex to the next",
        ),
        ("<flex name=\"f\" dim=\"2\" body=\"a b\" element=\"0 1 7\"><elasticity young=\"1e5\"/></flex>", "7"),
        ("<flex name=\"f\" node=\"a\"/>", "nodes"),
    ] {
        let error = load(deformable).unwrap();
        let text = error.to_string();
        assert!(text.contains(expected) && text.contains(":7"), "{deformable}: {text}");
        assert!(!matches!(error, RobotError::Syntax { .. }), "{text}");
    }
}

#[test]
fn what_holds_a_vertex_otherwise_is_told() {
    let text = std::fs::read_to_string("models/saved_flexes.xml").unwrap();
    let exclude = "<contact><exclude body1=\"cloth_1\" body2=\"base\"/></contact></mujoco>";
    let text = text.replace("</mujoco>", exclude);
    let scene = Scene::new(RobotBuilder::mjcf_text(text, "models"), JointSolver::Multibody);
    let warnings: Vec<String> = scene.robot.warnings().iter().map(ToString::to_string).collect();
    assert!(warnings.iter().any(|warning| warning.contains("vertex `cloth_1`")), "{warnings:?}");
}
