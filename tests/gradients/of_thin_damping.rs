//! Gradients of sheets, rods, springs and fibres with stiffness damping and Maxwell branches, against central differences between whole
//! runs.

use crate::differences::{
    ACTIVATION, BRANCHES, DAMPING, FRICTION, LAUNCH, LOADS, MATERIAL, PINS, Parameter, Run, Scene,
};
use crate::differences::{errors_of_state_and_force, state_error};
use foible3d::prelude::*;
use foible3d::{BodyError, DeformableBodyError};
use std::sync::Arc;

/// What differences of the fourth order leave; in contact, slips enter through the shifts of the last solve.
const EXACT: f64 = 1e-5;
const IN_CONTACT: f64 = 1e-3;

/// Part of the usual differences that curvatures near none bear, which a damper takes without their sign; f32 has it.
const FINE: f64 = 0.00390625;

fn bare() -> DeformableMaterial {
    DeformableMaterial::new(1.0e5, 0.3).mass_damping(1.0)
}

/// Damped, relaxing, and both, each with what it is differentiated with respect to besides all else.
fn materials() -> [(DeformableMaterial, Vec<Parameter>); 3] {
    let relaxing = bare().maxwell_branches([(0.8, 0.05)]);
    // Of so small a part of them nothing but rounding would be left.
    let [damping, ratio, time] =
        [DAMPING, BRANCHES[0], BRANCHES[1]].map(|p| Parameter { by: 10.0 * p.by, ..p });
    let both = vec![damping, ratio, time];
    [
        (bare().stiffness_damping(0.01), vec![damping]),
        (relaxing, vec![ratio, time]),
        (relaxing.stiffness_damping(0.005), both),
    ]
}

/// Three cells to a side, bent along x by this curvature [1/m].
fn sheet(curvature: f64) -> Structure {
    let at = |k: u32| {
        let x = f64::from(k % 4) * 0.125;
        [x, -0.5 * curvature * x * x, f64::from(k / 4) * 0.125]
    };
    let quad = |k: u32| [[k, k + 4, k + 1], [k + 1, k + 4, k + 5]];
    let faces: Vec<[u32; 3]> =
        (0..3).flat_map(|row| (0..3).map(move |c| 4 * row + c)).flat_map(quad).collect();
    Structure::sheet((0..16).map(at).collect(), &faces, 0.01).unwrap()
}

fn rope() -> Structure {
    let points: Vec<[f64; 3]> =
        (0..6u32).map(|k| [f64::from(k) * 0.125, 0.0, f64::from(k * k) * 0.004]).collect();
    Structure::rod(&points, 0.02).unwrap()
}

fn errors(builder: &DeformableBodyBuilder, run: Run, keeps_spin: bool, others: &[Parameter]) {
    for (material, own) in materials() {
        let scene = Scene { keeps_spin, stride: FINE, ..Scene::new(builder.clone()) };
        let of = MATERIAL.iter().filter(|p| scene.is_sheet() || p.name != "Poisson's ratio");
        let error = state_error(&scene, &Run { material, ..run }, of.chain(&LOADS).chain(&own).chain(others));
        assert!(error < EXACT, "{material:?}: {error:e}");
    }
}

#[test]
fn damped_sheets_have_gradients() {
    for curvature in [1.0, 0.0] {
        let held = DeformableBodyBuilder::structure(&sheet(curvature)).pinned(|x| x.x < 0.001);
        errors(&held, Run { push: 0.0625, ..Run::of(bare()) }, false, &[PINS]);
    }
}

#[test]
fn damped_sheets_and_ropes_that_fly_have_gradients() {
    for structure in [sheet(1.0), rope()] {
        for keeps_spin in [false, true] {
            let free = DeformableBodyBuilder::structure(&structure);
            errors(&free, Run { push: 0.0625, ..Run::of(bare()) }, keeps_spin, &[]);
        }
    }
}

#[test]
fn damped_ropes_have_gradients() {
    let held = DeformableBodyBuilder::structure(&rope()).pinned(|x| x.x < 0.001);
    errors(&held, Run { push: 0.0625, ..Run::of(bare()) }, false, &[PINS]);
}

#[test]
fn damped_muscles_have_gradients() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let one_side = |p: [f64; 3]| if p[1] > 0.0 { [1.0, 0.0, 0.0] } else { [0.0; 3] };
    let model = DeformableModel::new(&mesh).with_fibres(one_side);
    let builder = DeformableBodyBuilder::model(Arc::new(model)).pinned(|x| x.x < -0.249);
    let modulus = Parameter {
        name: "fibre modulus",
        by: 64.0,
        change: |run, d| run.material.fibre_modulus += d,
        of: |g, _| g.material().fibre_modulus,
    };
    for (material, own) in materials() {
        let run = Run { activation: 0.875, ..Run::of(material.fibre_modulus(1.0e5)) };
        let of = MATERIAL.iter().chain([&ACTIVATION, &modulus]).chain(&own);
        let error = state_error(&Scene::new(builder.clone()), &run, of);
        assert!(error < EXACT, "{error:e}");
    }
}

/// Springs of a network, rods that are held against roll, and sheets beyond their limits of strain.
#[test]
fn damped_networks_twisted_rods_and_stretched_sheets_have_gradients() {
    let mesh = TetMesh::cuboid([0.25, 0.0625, 0.0625], [4, 1, 1]).unwrap();
    let network =
        DeformableBodyBuilder::structure(&Structure::spring_network(&mesh)).pinned(|x| x.x < -0.249);
    let rod = DeformableBodyBuilder::structure(&rope()).pinned(|x| x.x < 0.001);
    let stretched = DeformableBodyBuilder::structure(&sheet(1.0)).pinned(|x| x.x < 0.001);
    for (material, own) in materials() {
        let limited = material.strain_limits(0.9, 1.02);
        let [gentle, hard] = [0.0625, 4.0].map(|push| Run { push, ..Run::of(material) });
        for (builder, run) in [
            (&network, gentle),
            (&rod, Run { roll: Some(1.0), ..gentle }),
            (&stretched, Run { material: limited, ..hard }),
        ] {
            let scene = Scene { stride: FINE, ..Scene::new(builder.clone()) };
            let moduli = MATERIAL.iter().filter(|p| p.name != "Poisson's ratio");
            let error = state_error(&scene, &run, moduli.chain(&LOADS).chain(&own).chain([&PINS]));
            assert!(error < EXACT, "{run:?}: {error:e}");
        }
    }
}

/// What bends is between two regions, of which each resists by its own.
#[test]
fn one_region_may_be_damped_more_than_another() {
    let structure = sheet(1.0).painted(|[x, ..]| u32::from(x > 0.2));
    for other in [0.0, 0.03] {
        let mut scene = Scene::new(DeformableBodyBuilder::structure(&structure).pinned(|x| x.x < 0.001));
        (scene.regions, scene.beta, scene.stride) = (vec![(1, 5.0e4)], Some(other), FINE);
        let run = Run { push: 0.0625, ..Run::of(bare().stiffness_damping(0.01)) };
        let first = Parameter { of: |g, _| g.materials[0].youngs_modulus, ..MATERIAL[0] };
        let damping = Parameter { of: |g, _| g.materials[0].stiffness_damping, by: 1e-4, ..DAMPING };
        let others = MATERIAL.iter().skip(1).chain(&LOADS).chain([&PINS, &first, &damping]);
        let error = state_error(&scene, &run, others);
        assert!(error < EXACT, "{error:e}");
    }
}

#[test]
fn damped_sheets_on_a_floor_have_gradients() {
    // With larger differences what sticks begins to slide.
    for (friction, launch, stride, look) in [(1.0, 0.0, 0.0625, 15), (0.25, 4.0, 1.0, 25)] {
        for (material, own) in materials() {
            let builder = DeformableBodyBuilder::structure(&sheet(1.0));
            let scene = Scene { floor: Some(-0.08), stride, look, ..Scene::new(builder) };
            let material = material.friction(0.0);
            let run = Run { friction, launch: [launch, 0.0], throw: 0.0, push: 0.0, ..Run::of(material) };
            let slides = [&FRICTION].into_iter().filter(|_| launch > 0.0);
            let all = own.iter().chain([&MATERIAL[0], &LOADS[0], &LAUNCH]).chain(slides);
            let of_force = |parameter: &Parameter| parameter.name == LOADS[0].name;
            let errors = errors_of_state_and_force(&scene, &run, &of_force, all);
            assert!(errors.iter().all(|error| *error < IN_CONTACT), "{errors:?}");
        }
    }
}

#[test]
fn damped_woven_sheets_are_refused_with_the_reason() {
    let woven = DeformableMaterial::orthotropic_sheet(1.0e5, 2.5e4, 0.4, 2.0e4);
    for material in [woven.stiffness_damping(0.01), woven.maxwell_branches([(0.8, 0.05)])] {
        let cloth = DeformableBodyBuilder::cloth([0.1, 0.1], [2, 2], 1e-3).warp(|_| [1.0, 0.0, 0.0]);
        let cloth = cloth.material(material).fidelity(Fidelity::Reference).can_sleep(false);
        let (mut physics, mut world) = (rapier3d::prelude::PhysicsWorld::new(), DeformableWorld::new());
        let handle = world.insert(cloth).unwrap();
        let mut tape = DeformableTape::new(&world, handle).unwrap();
        match tape.step(&mut physics, &mut world) {
            Err(DeformableBodyError::Body(BodyError::NoGradient { what, .. })) => {
                assert!(what.contains("woven"), "{what}");
            }
            other => panic!("{other:?}"),
        }
    }
}
