//! Gradients over steps in contact, sticking and sliding, against central differences between whole runs.

use crate::differences::{
    FRICTION, LAUNCH, LOADS, MATERIAL, Parameter, Run, Scene, errors_of_state_and_force,
};
use foible3d::prelude::*;
use foible3d::{BodyError, DeformableBodyError};
use rapier3d::prelude::*;

/// Contact forces are solved to 1e-12 of the largest; slips enter through the shifts of the last solve.
const EXACT: f64 = 1e-3;

fn block() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.125, 0.125), [4, 2, 2])
}

fn on_a_floor(height: f32) -> Scene {
    Scene { floor: Some(height), stride: 8.0, ..Scene::new(block()) }
}

fn run(friction: f64, launch: f64) -> Run {
    let material = DeformableMaterial::new(5.0e4, 0.3).mass_damping(1.0).friction(0.0);
    Run { friction, launch: [launch, 0.0], throw: 0.0, ..Run::of(material) }
}

/// Of state and of contact force; some parameters the latter does not feel.
fn errors(scene: &Scene, run: &Run, with_friction: bool, unfelt: &[&str]) -> [f64; 2] {
    let by_friction = [&FRICTION].into_iter().filter(|_| with_friction);
    // What does not slide does not know of what lies across.
    let loads = MATERIAL.iter().chain(&LOADS).chain([&LAUNCH]).chain(by_friction);
    errors_of_state_and_force(scene, run, &|parameter: &Parameter| !unfelt.contains(&parameter.name), loads)
}

#[test]
fn what_lies_on_a_floor_and_sticks_has_gradients() {
    let errors = errors(&on_a_floor(-0.125), &run(1.0, 0.0), false, &[]);
    assert!(errors.iter().all(|error| *error < EXACT), "{errors:?}");
}

#[test]
fn what_slides_has_gradients() {
    let scene = Scene { stride: 16.0, look: 25, ..on_a_floor(-0.125) };
    // A shift of one vertex by a millimetre changes the force by 1e-3 N of 300: what the contact solve leaves is as much.
    let errors = errors(&scene, &run(0.25, 4.0), true, &["initial position"]);
    assert!(errors.iter().all(|error| *error < EXACT), "{errors:?}");
}

#[test]
fn what_lies_without_friction_has_gradients() {
    // What moves it along the floor gives it no force.
    let errors = errors(&on_a_floor(-0.125), &run(0.0, 1.0), false, &["force", "launch"]);
    assert!(errors.iter().all(|error| *error < EXACT), "{errors:?}");
}

#[test]
fn what_lands_has_gradients() {
    for friction in [0.0, 2.0] {
        println!("friction {friction}");
        let scene = Scene { stride: 0.25, look: 11, ..on_a_floor(-0.25) };
        let unfelt: &[&str] = if friction == 0.0 { &["force", "launch"] } else { &[] };
        let errors = errors(&scene, &run(friction, 0.0), false, unfelt);
        assert!(errors.iter().all(|error| *error < EXACT), "{friction}: {errors:?}");
    }
}

/// Contacts that open by less than μ times their slip took turns with themselves: a step ended with one that carried 2 mm off the floor.
#[test]
fn what_lands_aslant_has_gradients() {
    let scene = Scene { stride: 0.125, look: 6, steps: 12, ..on_a_floor(-0.15) };
    let run = Run { launch: [1.0, -1.5], ..run(0.25, 0.0) };
    let errors = errors(&scene, &run, true, &["initial position"]);
    assert!(errors.iter().all(|error| *error < EXACT), "{errors:?}");
}

/// What the first step of a scene that has no gradient says.
fn refusal(build: impl Fn(DeformableBodyBuilder) -> DeformableBodyBuilder) -> &'static str {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let builder = block().fidelity(Fidelity::Reference).can_sleep(false);
    let handle = world.insert(build(builder)).unwrap();
    let mut tape = DeformableTape::new(&world, handle).unwrap();
    match tape.step(&mut physics, &mut world) {
        Err(DeformableBodyError::Body(BodyError::NoGradient { step: 0, what })) => what,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_has_no_gradient_is_refused_with_the_reason() {
    let pinned = |builder: DeformableBodyBuilder| builder.pinned(|x| x.x < -0.24);
    assert!(refusal(|b| b.tune(|s| s.integrator = Integrator::Bdf2)).contains("implicit Euler"));
    let rough = |b| pinned(b).tune(|s| (s.tolerance, s.max_iterations) = (1e-2, 1));
    assert!(refusal(rough).contains("not solved"));
    assert!(refusal(|b| b.body_type(RigidBodyType::KinematicVelocityBased)).contains("dynamic"));
}

#[test]
fn contact_with_a_rigid_body_that_yields_is_refused() {
    let mut physics = PhysicsWorld::new();
    physics.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -1.125),
        ColliderBuilder::cuboid(5.0, 1.0, 5.0),
    );
    physics.insert(
        RigidBodyBuilder::dynamic().translation(Vector::Y * 0.25),
        ColliderBuilder::cuboid(0.1, 0.125, 0.1),
    );
    let mut world = DeformableWorld::new();
    let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-10).max_iterations(60);
    let handle = world.insert(block().settings(settings).can_sleep(false)).unwrap();
    let mut tape = DeformableTape::new(&world, handle).unwrap();
    let results: Vec<_> = (0..5).map(|_| tape.step(&mut physics, &mut world)).collect();
    let refused = results.into_iter().find_map(Result::err).expect("a box lies on the block");
    assert!(refused.to_string().contains("yield"), "{refused}");
}
