//! The arm picks a box up with its soft pads, carries it and puts it down.

mod common;

use common::{RATE, Scene};
use foible_robots::JointSolver;
use rapier3d::prelude::*;

/// Half an edge of the box [m], and its mass [kg].
const HALF: f32 = 0.02;
const MASS: f32 = 0.2;
/// Way of the lift from where it was put in to where the pads are level with the box on the floor [m].
const DOWN: f32 = -0.105;
/// Way of each finger to where its pad touches [m].
const TOUCH: f32 = 0.023;

struct Outcome {
    /// Distance of the box from its target \[m\].
    missed: f32,
    /// Most that a pad's face moved along the box in a second, while the box was held \[m\].
    slip: f32,
    /// Height of the box while it was carried \[m\].
    height: f32,
}

fn pick_and_place(solver: JointSolver, swing: f32) -> Outcome {
    let mut scene = Scene::arm(solver);
    let object = scene.put(ColliderBuilder::cuboid(HALF, HALF, HALF), MASS, Vector::new(0.4, 0.0, HALF));
    scene.go(&[("lift", DOWN)], 1.0, |_| ());
    scene.go(&[("left", TOUCH + 0.003), ("right", TOUCH + 0.003)], 0.5, |_| ());
    scene.wait(0.3);
    let face = scene.pressed("left pad", object);
    assert!(face.len() > 4, "{face:?}");
    let mut marks: Vec<Vector> = Vec::new();
    let mut look = |scene: &Scene| marks.push(scene.mark("left pad", &face, object));
    scene.go(&[("lift", 0.0)], 1.0, &mut look);
    scene.go(&[("swing", swing), ("wrist", -swing)], 1.5, &mut look);
    let height = scene.place(object).z;
    scene.go(&[], 2.0, &mut look);
    scene.go(&[("lift", DOWN)], 1.0, |_| ());
    scene.go(&[("left", 0.0), ("right", 0.0)], 0.5, |_| ());
    scene.go(&[("lift", 0.0)], 1.0, |_| ());
    assert!(scene.is_finite());
    let second = RATE as usize;
    // Along the faces: across them the pads are pressed.
    let along = |way: Vector| Vector::new(way.x, 0.0, way.z).length();
    let slips = (second..marks.len()).map(|i| along(marks[i] - marks[i - second]));
    let target = Vector::new(0.4 * swing.cos(), 0.4 * swing.sin(), HALF);
    Outcome { missed: (scene.place(object) - target).length(), slip: slips.fold(0.0, f32::max), height }
}

#[test]
fn a_box_is_carried_to_its_target() {
    for solver in [JointSolver::Multibody, JointSolver::Impulse] {
        let out = pick_and_place(solver, 1.2);
        println!("{solver:?}: missed by {} m, slip {} m/s, height {} m", out.missed, out.slip, out.height);
        assert!(out.height > HALF + 0.09, "{solver:?}: {} m", out.height);
        assert!(out.missed < 2.0e-4, "{solver:?}: {} m", out.missed);
        assert!(out.slip < 3.0e-6, "{solver:?}: {} m/s", out.slip);
    }
}
