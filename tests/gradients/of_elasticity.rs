//! Gradients over steps against central differences between whole runs.

use crate::differences::{ACTIVATION, LOADS, MATERIAL, PINS, Parameter, Run, Scene, state_error};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

/// What differences of the fourth order leave, and steps that are solved to 1e-12 of the forces.
const EXACT: f64 = 1e-5;

fn material() -> DeformableMaterial {
    DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0)
}

fn bar() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [4, 1, 1])
}

fn cantilever() -> DeformableBodyBuilder {
    bar().pinned(|x| x.x < -0.249)
}

#[test]
fn a_cantilevers_gradients_are_those_of_differences() {
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [8, 2, 2]);
    let scene = Scene::new(beam.pinned(|x| x.x < -0.249));
    let run = Run::of(material());
    let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain([&PINS]));
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn every_elasticity_and_element_has_gradients() {
    for elasticity in Elasticity::ALL {
        for smoothed in [false, true] {
            println!("{elasticity:?}, smoothed: {smoothed}");
            let builder = if smoothed { cantilever().smoothed() } else { cantilever() };
            let run = Run::of(material().elasticity(*elasticity));
            let error = state_error(&Scene::new(builder), &run, MATERIAL.iter().chain(&LOADS).chain([&PINS]));
            assert!(error < EXACT, "{elasticity:?}: {error:e}");
        }
    }
}

#[test]
fn a_free_body_in_flight_has_gradients_with_and_without_its_spin() {
    for keeps_spin in [false, true] {
        println!("keeps spin: {keeps_spin}");
        let mut scene = Scene::new(bar());
        scene.keeps_spin = keeps_spin;
        let error = state_error(&scene, &Run::of(material()), MATERIAL.iter().chain(&LOADS));
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn sheets_ropes_and_regions_have_gradients_too() {
    let points = |n: u32| -> Vec<[f64; 3]> {
        (0..n * n).map(|k| [f64::from(k % n) * 0.125, 0.0, f64::from(k / n) * 0.125]).collect()
    };
    let quad = |k: u32| [[k, k + 4, k + 1], [k + 1, k + 4, k + 5]];
    let faces: Vec<[u32; 3]> =
        (0..3).flat_map(|row| (0..3).map(move |c| 4 * row + c)).flat_map(quad).collect();
    let sheet = Structure::sheet(points(4), &faces, 0.01).unwrap();
    let rope: Vec<[f64; 3]> = (0..6).map(|k| [f64::from(k) * 0.125, 0.0, 0.0]).collect();
    let rope = Structure::rod(&rope, 0.02).unwrap();
    let models = [DeformableModel::from_structure(&sheet), DeformableModel::from_structure(&rope)];
    for model in models.map(Result::unwrap) {
        let scene = Scene::new(DeformableBodyBuilder::model(Arc::new(model)).pinned(|x| x.x < 0.001));
        let run = Run { push: 0.0625, ..Run::of(material()) };
        // No rope has a Poisson's ratio.
        let of = MATERIAL.iter().filter(|p| scene.is_sheet() || p.name != "Poisson's ratio");
        let error = state_error(&scene, &run, of.chain(&LOADS).chain([&PINS]));
        assert!(error < EXACT, "{error:e}");
    }
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let painted = DeformableModel::new(&mesh).painted(|[x, ..]| u32::from(x > 0.0));
    let mut scene = Scene::new(DeformableBodyBuilder::model(Arc::new(painted)).pinned(|x| x.x < -0.249));
    scene.regions = vec![(1, 5.0e4)];
    // Of the modulus of the first alone; all else is changed in both.
    let first = Parameter { of: |g, _| g.materials[0].youngs_modulus, ..MATERIAL[0] };
    let others = MATERIAL.iter().skip(1).chain(&LOADS).chain([&PINS, &first]);
    let error = state_error(&scene, &Run::of(material()), others);
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn a_muscle_has_the_gradient_of_its_activation() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let one_side = |p: [f64; 3]| if p[1] > 0.0 { [1.0, 0.0, 0.0] } else { [0.0; 3] };
    let model = DeformableModel::new(&mesh).with_fibres(one_side);
    let scene = Scene::new(DeformableBodyBuilder::model(Arc::new(model)).pinned(|x| x.x < -0.249));
    let run = Run { activation: 0.875, ..Run::of(material().fibre_modulus(1.0e5)) };
    let modulus = Parameter {
        name: "fibre modulus",
        by: 64.0,
        change: |run, d| run.material.fibre_modulus += d,
        of: |g, _| g.material().fibre_modulus,
    };
    let error = state_error(&scene, &run, MATERIAL.iter().chain([&ACTIVATION, &modulus]));
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn checkpoints_replay_to_the_same_bits() {
    let gradients = [None, Some(7)].map(|every| {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let beam = cantilever().material(material()).fidelity(Fidelity::Reference).can_sleep(false);
        let beam = world.insert(beam).unwrap();
        let push = |step: usize, _: &mut PhysicsWorld, world: &mut DeformableWorld| {
            let body = &mut world.bodies[beam];
            body.reset_forces();
            body.add_force(&[4], Vector::Z * (step as f32 * 0.1)).unwrap();
        };
        let mut tape = DeformableTape::new(&world, beam).unwrap();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        for step in 0..20 {
            push(step, &mut physics, &mut world);
            tape.step(&mut physics, &mut world).unwrap();
        }
        let mut loss = tape.loss();
        loss.add_position(19, 4, [1.0, 2.0, 3.0]).unwrap();
        loss.add_velocity(11, 4, [1.0, 2.0, 3.0]).unwrap();
        assert!(tape.len() == 20 && tape.backward(&loss).is_err() == every.is_some());
        if every.is_none() {
            return tape.backward(&loss).unwrap();
        }
        // What was done in the last steps, and in those before a checkpoint, has to be done again.
        for forgets in [19, 12, 2] {
            let part = |step: usize, physics: &mut PhysicsWorld, world: &mut DeformableWorld| {
                push(if step == forgets { 0 } else { step }, physics, world);
            };
            let error = tape.replay(&loss, part).unwrap_err().to_string();
            assert!(error.contains("`control`"), "{error}");
        }
        tape.replay_by(&loss, push, |physics, world| world.step_with_events(physics, &(), &())).unwrap()
    });
    assert_eq!(gradients[0], gradients[1]);
    assert!(gradients[0].steps.len() == 20 && gradients[0].material().youngs_modulus != 0.0);
}

/// A step that has no gradient counts as done by hand, with checkpoints too: none is replayed through it.
#[test]
fn checkpoints_go_around_steps_without_gradients() {
    let gradients = [None, Some(3), Some(4), Some(100)].map(|every| {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let beam = cantilever().material(material()).fidelity(Fidelity::Reference).can_sleep(false);
        let beam = world.insert(beam).unwrap();
        let fine = *world.bodies[beam].settings();
        let mut tape = DeformableTape::new(&world, beam).unwrap();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        for step in 0..14 {
            // The eighth step of the tape's comes after two that are not solved.
            if step == 8 || step == 9 {
                world.bodies[beam].set_settings(fine.tolerance(1e-2).max_iterations(1));
                assert!(tape.step(&mut physics, &mut world).is_err());
                world.bodies[beam].set_settings(fine);
            } else {
                tape.step(&mut physics, &mut world).unwrap();
            }
        }
        let mut loss = tape.loss();
        loss.add_position(11, 4, [1.0, 2.0, 3.0]).unwrap();
        assert_eq!(tape.len(), 12);
        if every.is_none() {
            tape.backward(&loss).unwrap()
        } else {
            tape.replay(&loss, |_, _, _| ()).unwrap()
        }
    });
    let [first, others @ ..] = &gradients;
    others.iter().for_each(|other| assert_eq!(first, other));
}

/// Without checkpoints nothing has to be replayed; with them from some step on the tape begins there. Both once had gradients of zero, or of the
/// wrong start. A step of a replay that has none is told by its number in the tape, once that since the checkpoint.
#[test]
fn replays_are_of_all_that_a_tape_holds() {
    let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
    let beam = cantilever().material(material()).fidelity(Fidelity::Reference).can_sleep(false);
    let beam = world.insert(beam).unwrap();
    let mut whole = DeformableTape::new(&world, beam).unwrap();
    (0..5).for_each(|_| whole.step(&mut physics, &mut world).unwrap());
    let with_loss = |tape: &DeformableTape| {
        let mut loss = tape.loss();
        loss.add_position(tape.len() - 1, 4, [1.0, 2.0, 3.0]).unwrap();
        loss
    };
    let loss = with_loss(&whole);
    let replayed = whole.replay(&loss, |_, _, _| ()).unwrap();
    assert!(replayed.steps.len() == 5 && replayed.material().youngs_modulus != 0.0);
    assert_eq!(replayed, whole.backward(&loss).unwrap());

    let mut checked = whole.checkpoint_every(4);
    assert!(checked.is_empty());
    let mut kept = DeformableTape::new(&world, beam).unwrap();
    for _ in 0..10 {
        checked.step(&mut physics, &mut world).unwrap();
        kept.record(&physics, &world).unwrap();
    }
    let loss = with_loss(&checked);
    let replayed = checked.replay(&loss, |_, _, _| ()).unwrap();
    assert_eq!(replayed, kept.backward(&with_loss(&kept)).unwrap());

    let unsolved = |step: usize, _: &mut PhysicsWorld, world: &mut DeformableWorld| {
        if step == 6 {
            let settings = world.bodies[beam].settings().tolerance(1e-2).max_iterations(1);
            world.bodies[beam].set_settings(settings);
        }
    };
    let error = checked.replay(&loss, unsolved).unwrap_err();
    assert!(
        matches!(error, DeformableBodyError::Body(foible3d::BodyError::NoGradient { step: 6, .. })),
        "{error:?}"
    );
}

/// A body may be taken away where a checkpoint is due: the steps that were recorded keep their gradient.
#[test]
fn what_is_removed_leaves_the_steps_before_it() {
    let gradients = [None, Some(3)].map(|every| {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let beam = cantilever().material(material()).fidelity(Fidelity::Reference).can_sleep(false);
        let beam = world.insert(beam).unwrap();
        let mut tape = DeformableTape::new(&world, beam).unwrap();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        (0..6).for_each(|_| tape.step(&mut physics, &mut world).unwrap());
        world.remove(beam).unwrap();
        assert!(tape.step(&mut physics, &mut world).is_err());
        let mut loss = tape.loss();
        loss.add_position(5, 4, [1.0, 2.0, 3.0]).unwrap();
        match every {
            None => tape.backward(&loss).unwrap(),
            Some(_) => tape.replay(&loss, |_, _, _| ()).unwrap(),
        }
    });
    assert_eq!(gradients[0], gradients[1]);
}

/// Positions of the tip of a cantilever over time, with the tape of them.
fn swing(modulus: f64) -> (DeformableTape, usize, Vec<f64>) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let beam = cantilever().material(material().youngs_modulus(modulus)).fidelity(Fidelity::Reference);
    let beam = world.insert(beam.can_sleep(false)).unwrap();
    let tip = world.bodies[beam].vertices_where(|x| x.x > 0.249)[0];
    let mut tape = DeformableTape::new(&world, beam).unwrap();
    let mut heights = Vec::new();
    for _ in 0..20 {
        tape.step(&mut physics, &mut world).unwrap();
        heights.push(world.bodies[beam].position(tip).unwrap()[1]);
    }
    (tape, tip, heights)
}

#[test]
fn youngs_modulus_is_found_from_a_trajectory() {
    let (_, _, seen) = swing(2.0e5);
    let mut modulus = 1.2e5_f64;
    for round in 0..8 {
        let (tape, tip, heights) = swing(modulus);
        // Gauss and Newton: each of the heights has a derivative of its own.
        let (mut along, mut curvature) = (0.0, 0.0);
        for (step, (height, seen)) in heights.iter().zip(&seen).enumerate() {
            let mut loss = tape.loss();
            loss.add_position(step, tip, [0.0, 1.0, 0.0]).unwrap();
            let slope = tape.backward(&loss).unwrap().material().youngs_modulus * modulus;
            along += slope * (height - seen);
            curvature += slope * slope;
        }
        // Of the logarithm, which keeps it positive.
        modulus *= (-along / curvature).clamp(-0.5, 0.5).exp();
        println!("{round}: {modulus} Pa");
    }
    assert!((modulus / 2.0e5 - 1.0).abs() < 1e-6, "{modulus}");
}
