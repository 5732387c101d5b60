//! Gradients of solids with stiffness damping, against central differences between whole runs.

use crate::differences::{DAMPING, FRICTION, LAUNCH, LOADS, MATERIAL, PINS, Parameter, Run, Scene};
use crate::differences::{errors_of_state_and_force, state_error};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

/// What differences of the fourth order leave; in contact, slips enter through the shifts of the last solve.
const EXACT: f64 = 1e-5;
const IN_CONTACT: f64 = 1e-3;

/// At steps of 1/60 s damping resists with 0.6 of the stiffness.
const BETA: f64 = 0.01;

fn damped() -> DeformableMaterial {
    DeformableMaterial::new(1.0e5, 0.3).mass_damping(1.0).stiffness_damping(BETA)
}

fn bar() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [4, 1, 1])
}

#[test]
fn damped_cantilevers_have_gradients_by_every_elasticity_and_element() {
    for elasticity in Elasticity::ALL {
        for smoothed in [false, true] {
            println!("{elasticity:?}, smoothed: {smoothed}");
            let cantilever = bar().pinned(|x| x.x < -0.249);
            let scene = Scene::new(if smoothed { cantilever.smoothed() } else { cantilever });
            let run = Run::of(damped().elasticity(*elasticity));
            let of = MATERIAL.iter().chain(&LOADS).chain([&PINS, &DAMPING]);
            let error = state_error(&scene, &run, of);
            assert!(error < EXACT, "{elasticity:?}: {error:e}");
        }
    }
}

/// The faster a body turns, the more its damping has to know of its turn: spinning costs nothing.
#[test]
fn what_is_damped_and_flies_has_gradients() {
    for keeps_spin in [false, true] {
        println!("keeps spin: {keeps_spin}");
        let scene = Scene { keeps_spin, ..Scene::new(bar()) };
        let error = state_error(&scene, &Run::of(damped()), MATERIAL.iter().chain(&LOADS).chain([&DAMPING]));
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn one_region_may_be_damped_more_than_another() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let painted = DeformableModel::new(&mesh).painted(|[x, ..]| u32::from(x > 0.0));
    let mut scene = Scene::new(DeformableBodyBuilder::model(Arc::new(painted)).pinned(|x| x.x < -0.249));
    scene.regions = vec![(1, 5.0e4)];
    let first = Parameter { of: |g, _| g.materials[0].youngs_modulus, ..MATERIAL[0] };
    let damping = Parameter { of: |g, _| g.materials[0].stiffness_damping, ..DAMPING };
    for (ours, other) in [(BETA, 0.0), (BETA, 3.0 * BETA)] {
        println!("{ours} and {other} s");
        scene.beta = Some(other);
        let others = MATERIAL.iter().skip(1).chain(&LOADS).chain([&PINS, &first, &damping]);
        let error = state_error(&scene, &Run::of(damped().stiffness_damping(ours)), others);
        assert!(error < EXACT, "{error:e}");
    }
}

/// What is thin and not damped is no hindrance.
#[test]
fn a_damped_block_may_have_a_skin_without_damping() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let skin = [[0, 1, 5]];
    let skinned = Structure::solid(&mesh).with_sheet(&skin, 0.001).unwrap();
    let model = DeformableModel::from_structure(&skinned).unwrap().painted(|[x, ..]| u32::from(x < -0.1));
    let mut scene = Scene::new(DeformableBodyBuilder::model(Arc::new(model)).pinned(|x| x.x < -0.249));
    (scene.regions, scene.beta) = (vec![(1, 1.0e5)], Some(0.0));
    let error = state_error(&scene, &Run::of(damped()), LOADS.iter().chain([&PINS]));
    assert!(error < EXACT, "{error:e}");
}

/// Of the state, and of the force of the floor.
fn errors_on_a_floor([friction, launch, stride]: [f64; 3], look: usize) -> [f64; 2] {
    let block = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.125, 0.125), [4, 2, 2]);
    let scene = Scene { floor: Some(-0.125), stride, look, ..Scene::new(block) };
    let material = damped().youngs_modulus(5.0e4).friction(0.0);
    let run = Run { friction, launch: [launch, 0.0], throw: 0.0, ..Run::of(material) };
    let slides = [&FRICTION].into_iter().filter(|_| launch > 0.0);
    let all = MATERIAL.iter().chain(&LOADS).chain([&LAUNCH, &DAMPING]).chain(slides);
    // The force hardly knows of where one vertex began.
    errors_of_state_and_force(&scene, &run, &|parameter| parameter.name != "initial position", all)
}

#[test]
fn what_is_damped_and_sticks_to_a_floor_or_slides_has_gradients() {
    // With larger differences what sticks begins to slide.
    for (case, look) in [([1.0, 0.0, 8.0], 15), ([0.25, 4.0, 16.0], 25)] {
        let errors = errors_on_a_floor(case, look);
        assert!(errors.iter().all(|error| *error < IN_CONTACT), "{errors:?}");
    }
}
