//! Gradients over steps of rods that are held against roll, against differences between whole runs.

use crate::differences::{LOADS, MATERIAL, PINS, Parameter, Run, Scene, state_error};
use foible3d::prelude::*;

/// What differences of the fourth order leave, and steps that are solved to 1e-12 of the forces.
const EXACT: f64 = 1e-5;

const ROLL: Parameter = Parameter {
    name: "roll",
    by: 0.0078125,
    change: |run, d| *run.roll.as_mut().unwrap() += d,
    of: |g, _| g.steps.iter().map(|step| step.rolls[0]).sum(),
};

/// Once around, and a little further.
fn coil(k: u32) -> [f64; 3] {
    let angle = 0.7 * f64::from(k);
    [0.25 * angle.cos(), 0.25 * angle.sin(), 0.05 * angle]
}

#[test]
fn bent_rods_that_are_twisted_have_gradients() {
    let points: Vec<[f64; 3]> = (0..10).map(coil).collect();
    let open = Structure::rod(&points, 0.02).unwrap();
    let ring = Structure::ring(&points[..9], 0.02).unwrap();
    for (structure, pinned) in [(&open, 2), (&ring, 2), (&open, 0), (&ring, 0)] {
        for roll in [1.0, -8.0] {
            println!("{pinned} pinned, rolled by {roll} rad");
            let held: Vec<[f64; 3]> = points[4..4 + pinned].to_vec();
            let builder = DeformableBodyBuilder::structure(structure);
            let is_held =
                move |x: rapier3d::math::Vector| held.iter().any(|h| (h[2] - f64::from(x.z)).abs() < 1e-3);
            let mut scene = Scene::new(builder.pinned(is_held));
            (scene.keeps_spin, scene.stride) = (pinned == 0, 0.03125);
            let material = DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0);
            let run = Run { roll: Some(roll), push: 0.0625, ..Run::of(material) };
            let pins = [&PINS].into_iter().filter(|_| pinned > 0);
            let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain(pins).chain([&ROLL]));
            assert!(error < EXACT, "{pinned} {roll}: {error:e}");
        }
    }
}
