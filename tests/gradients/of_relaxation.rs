//! Gradients of solids with Maxwell branches, against central differences between whole runs.

use crate::differences::{BRANCHES, DAMPING, FRICTION, LAUNCH, LOADS, MATERIAL, PINS, Parameter, Run, Scene};
use crate::differences::{errors_of_state_and_force, state_error};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

/// What differences of the fourth order leave; in contact, slips enter through the shifts of the last solve.
const EXACT: f64 = 1e-5;
const IN_CONTACT: f64 = 1e-3;

/// Times of three steps and of the whole run.
fn relaxing() -> DeformableMaterial {
    DeformableMaterial::new(1.0e5, 0.3).mass_damping(1.0).maxwell_branches([(0.8, 0.05), (0.5, 0.5)])
}

fn bar() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [4, 1, 1])
}

fn cantilever() -> DeformableBodyBuilder {
    bar().pinned(|x| x.x < -0.249)
}

#[test]
fn cantilevers_that_relax_have_gradients_by_every_elasticity_and_element() {
    for elasticity in Elasticity::ALL {
        for smoothed in [false, true] {
            println!("{elasticity:?}, smoothed: {smoothed}");
            let scene = Scene::new(if smoothed { cantilever().smoothed() } else { cantilever() });
            let run = Run::of(relaxing().elasticity(*elasticity));
            let of = MATERIAL.iter().chain(&LOADS).chain([&PINS]).chain(&BRANCHES);
            let error = state_error(&scene, &run, of);
            assert!(error < EXACT, "{elasticity:?}: {error:e}");
        }
    }
}

#[test]
fn what_relaxes_and_flies_has_gradients() {
    for keeps_spin in [false, true] {
        println!("keeps spin: {keeps_spin}");
        let scene = Scene { keeps_spin, ..Scene::new(bar()) };
        let error = state_error(&scene, &Run::of(relaxing()), MATERIAL.iter().chain(&LOADS).chain(&BRANCHES));
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn what_is_damped_besides_has_gradients() {
    let scene = Scene::new(cantilever());
    for material in
        [relaxing().stiffness_damping(0.01), relaxing().maxwell_branches([(0.0, 1.0), (0.5, 0.05)])]
    {
        let run = Run::of(material.stiffness_damping(0.01));
        let of = MATERIAL.iter().chain(&LOADS).chain([&PINS, &DAMPING]).chain(&BRANCHES[2..]);
        let error = state_error(&scene, &run, of);
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn regions_relax_each_by_their_own() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let painted = DeformableModel::new(&mesh).painted(|[x, ..]| u32::from(x > 0.0));
    for smoothed in [false, true] {
        let painted = if smoothed { painted.clone().smoothed() } else { painted.clone() };
        let mut scene = Scene::new(DeformableBodyBuilder::model(Arc::new(painted)).pinned(|x| x.x < -0.249));
        scene.regions = vec![(1, 5.0e4)];
        let first = Parameter { of: |g, _| g.materials[0].youngs_modulus, ..MATERIAL[0] };
        let of = MATERIAL.iter().skip(1).chain(&LOADS).chain([&PINS, &first]).chain(&BRANCHES);
        let error = state_error(&scene, &Run::of(relaxing()), of);
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn what_relaxes_and_sticks_to_a_floor_or_slides_has_gradients() {
    for ([friction, launch, stride], look) in [([1.0, 0.0, 8.0], 15), ([0.25, 4.0, 16.0], 25)] {
        let block = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.125, 0.125), [4, 2, 2]);
        let scene = Scene { floor: Some(-0.125), stride, look, ..Scene::new(block) };
        let material = relaxing().youngs_modulus(5.0e4).friction(0.0);
        let run = Run { friction, launch: [launch, 0.0], throw: 0.0, ..Run::of(material) };
        let slides = [&FRICTION].into_iter().filter(|_| launch > 0.0);
        let all = MATERIAL.iter().chain(&LOADS).chain([&LAUNCH]).chain(&BRANCHES[..2]).chain(slides);
        // The force hardly knows of where one vertex began.
        let feels = |parameter: &Parameter| parameter.name != "initial position";
        let errors = errors_of_state_and_force(&scene, &run, &feels, all);
        assert!(errors.iter().all(|error| *error < IN_CONTACT), "{errors:?}");
    }
}

/// The stretches of dampers go along with checkpoints, and materials may change between steps.
#[test]
fn checkpoints_and_branches_that_come_and_go_have_the_same_gradients() {
    let control = |step: usize, deformables: &mut DeformableWorld| {
        let (_, body) = deformables.bodies.iter_mut().next().unwrap();
        match step {
            // Of smoothed bodies, it keeps no volume.
            4 => body.set_material(relaxing().poisson_ratio(0.0)).unwrap(),
            8 => body.set_material(relaxing().maxwell_branches([(0.3, 0.1)])).unwrap(),
            _ => {}
        }
    };
    for builder in [cantilever(), cantilever().smoothed()] {
        compare_checkpoints(&builder, control);
    }
}

fn compare_checkpoints(builder: &DeformableBodyBuilder, control: fn(usize, &mut DeformableWorld)) {
    let run = |shift: f64, every: Option<usize>| {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(100);
        let handle = world.insert(builder.clone().settings(settings).can_sleep(false)).unwrap();
        let tip = (0..world.bodies[handle].vertex_count())
            .max_by(|a, b| {
                let x = |v: usize| world.bodies[handle].position(v).unwrap()[0];
                x(*a).total_cmp(&x(*b))
            })
            .unwrap();
        let [x, y, z] = world.bodies[handle].position(tip).unwrap();
        world.bodies[handle].set_position(tip, [x, y + shift, z]).unwrap();
        let mut tape = DeformableTape::new(&world, handle).unwrap();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        for step in 0..12 {
            control(step, &mut world);
            tape.step(&mut physics, &mut world).unwrap();
        }
        let mut loss = tape.loss();
        loss.add_position(11, tip, [0.0, 1.0, 0.5]).unwrap();
        let [_, y, z] = world.bodies[handle].position(tip).unwrap();
        let gradient = match every {
            Some(_) => tape.replay(&loss, |step, _, world| control(step, world)).unwrap(),
            None => tape.backward(&loss).unwrap(),
        };
        (y + 0.5 * z, gradient, tip)
    };
    let (_, whole, tip) = run(0.002, None);
    let slope = (run(0.002 + 1e-5, None).0 - run(0.002 - 1e-5, None).0) / 2e-5;
    let ours = whole.initial_positions[tip][1];
    println!("{ours} {slope}");
    assert!((ours - slope).abs() < 1e-5 * slope.abs(), "{ours} {slope}");
    let (_, replayed, _) = run(0.002, Some(3));
    assert_eq!(replayed.initial_positions, whole.initial_positions);
    assert_eq!(replayed.materials, whole.materials);
}
