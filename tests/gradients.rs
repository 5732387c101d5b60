//! Gradients over steps against central differences between whole runs.

#[path = "common/differences.rs"]
mod differences;

use differences::{ACTIVATION, LOADS, MATERIAL, PINS, Parameter, Run, Scene, state_error};
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
