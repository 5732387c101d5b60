//! Gradients over steps of bodies with something in their cavities, against differences between whole runs.

use crate::differences::{
    FRICTION, LOADS, MATERIAL, Outcome, PINS, Parameter, Run, Scene, Sought, errors_of_state_and, state_error,
};
use foible3d::prelude::*;

/// What differences of the fourth order leave, and steps that are solved to 1e-12 of the forces; in contact more.
const EXACT: f64 = 1e-5;
const IN_CONTACT: f64 = 1e-4;

/// A finger with one chamber along it.
fn finger() -> TetMesh {
    let mesh = TetMesh::cuboid([0.25, 0.09375, 0.09375], [6, 3, 3]).unwrap();
    mesh.without(|[x, y, z]| x.abs() < 0.16 && y.abs() < 0.03 && z.abs() < 0.03).unwrap()
}

fn material() -> DeformableMaterial {
    DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0).friction(0.0)
}

/// The gauge of whatever fills it, of which a pascal more is this much more pressure in a step.
const GAUGE: Parameter = Parameter {
    name: "gauge",
    by: 4.0,
    change: |run, d| match &mut run.filling {
        Some(CavityFilling::Pressure { gauge } | CavityFilling::Gas { gauge, .. }) => *gauge += d,
        Some(CavityFilling::Liquid { volume, .. }) => *volume += d * 1.0e-9,
        _ => unreachable!(),
    },
    of: |g, out| by_step(g, out),
};

fn by_step(gradient: &DeformableGradient, out: &Outcome) -> f64 {
    let per = |volume: f64| match out.filling.unwrap() {
        CavityFilling::Gas { volume: at, exponent, .. } => (at / volume).powf(exponent),
        CavityFilling::Liquid { volume: full, bulk_modulus } => {
            bulk_modulus * volume / (full * full) * 1.0e-9
        }
        _ => 1.0,
    };
    gradient.steps.iter().zip(&out.volumes).map(|(step, volume)| step.pressures[0] * per(*volume)).sum()
}

fn fillings() -> [CavityFilling; 4] {
    let volume = DeformableModel::new(&finger()).cavities().next().unwrap().volume;
    [
        CavityFilling::Pressure { gauge: 8.0e3 },
        CavityFilling::Pressure { gauge: -4.0e3 },
        CavityFilling::Gas { gauge: 8.0e3, ambient: 101_325.0, volume, exponent: 1.4 },
        CavityFilling::Liquid { volume: 1.03 * volume, bulk_modulus: 2.0e6 },
    ]
}

#[test]
fn fingers_with_air_suction_gas_and_liquid_have_gradients() {
    for filling in fillings() {
        println!("{filling:?}");
        let scene = Scene::new(DeformableBodyBuilder::mesh(&finger()).pinned(|x| x.x < -0.249));
        let run = Run { filling: Some(filling), ..Run::of(material()) };
        let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain([&PINS, &GAUGE]));
        assert!(error < EXACT, "{filling:?}: {error:e}");
    }
}

/// What is free is turned by nothing that its own walls do.
#[test]
fn a_balloon_in_flight_has_gradients() {
    let corners = vec![[0.0; 3], [0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.25]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let sheet = Structure::sheet(corners, &faces, 0.01).unwrap();
    let volume = 0.25_f64.powi(3) / 6.0;
    for filling in [
        CavityFilling::Pressure { gauge: 2.0e3 },
        CavityFilling::Gas { gauge: 2.0e3, ambient: 101_325.0, volume, exponent: 1.0 },
    ] {
        println!("{filling:?}");
        let mut scene = Scene::new(DeformableBodyBuilder::structure(&sheet));
        scene.keeps_spin = true;
        let run = Run { filling: Some(filling), push: 0.0625, ..Run::of(material()) };
        let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain([&GAUGE]));
        assert!(error < EXACT, "{filling:?}: {error:e}");
    }
}

/// A finger that is blown up against a floor: sticking and sliding, where it goes and what it presses with.
#[test]
fn a_finger_pressed_on_a_floor_has_gradients() {
    let [air, suction, gas, liquid] = fillings();
    // Without friction, sliding, sticking.
    let each = [0.0, 0.0625, 1.0].into_iter().flat_map(|friction| [(air, friction), (gas, friction)]);
    for (filling, friction) in each.chain([(suction, 0.0625), (liquid, 0.0625)]) {
        println!("{filling:?}, friction {friction}");
        let mut scene = Scene::new(DeformableBodyBuilder::mesh(&finger()).pinned(|x| x.x < -0.249));
        scene.floor = Some(-0.09375);
        scene.stride = 0.25;
        scene.steps = 8;
        let run = Run { filling: Some(filling), friction, throw: 0.0, place: 0.0, ..Run::of(material()) };
        let slides = [&FRICTION];
        let friction_too = slides.into_iter().filter(|_| friction == 0.0625);
        let parameters = MATERIAL[..2].iter().chain([&GAUGE, &LOADS[0]]).chain(friction_too);
        let look = scene.look;
        let force = |out: &Outcome| out.contact_force[1];
        let seeds = |out: &Outcome| {
            let mut loss = out.tape.loss();
            loss.add_contact_force(look, out.floor.unwrap(), [0.0, 1.0, 0.0]).unwrap();
            loss
        };
        let of_force =
            Sought { loss: &force, seeds: &seeds, feels: &|parameter| parameter.name != FRICTION.name };
        let errors = errors_of_state_and(&scene, &run, of_force, parameters);
        assert!(errors.iter().all(|error| *error < IN_CONTACT), "{filling:?}: {errors:?}");
    }
}
