//! Gradients over steps of bodies in the wind, against differences between whole runs.

use crate::differences::{
    FRICTION, LAUNCH, LOADS, MATERIAL, PINS, Parameter, Run, Scene, errors_of_state_and_force, state_error,
};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// What differences of the fourth order leave, and steps that are solved to 1e-12 of the forces.
const EXACT: f64 = 1e-5;
/// The same in contact.
const IN_CONTACT: f64 = 1e-3;

const WIND: [Parameter; 6] = [
    Parameter {
        name: "air along x",
        by: 0.03125,
        change: |run, d| run.wind.as_mut().unwrap().velocity.x += d as f32,
        of: |g, _| g.wind().velocity[0],
    },
    Parameter {
        name: "air along y",
        by: 0.03125,
        change: |run, d| run.wind.as_mut().unwrap().velocity.y += d as f32,
        of: |g, _| g.wind().velocity[1],
    },
    Parameter {
        name: "air along z",
        by: 0.03125,
        change: |run, d| run.wind.as_mut().unwrap().velocity.z += d as f32,
        of: |g, _| g.wind().velocity[2],
    },
    Parameter {
        name: "density of the air",
        by: 0.015625,
        change: |run, d| run.wind.as_mut().unwrap().density += d,
        of: |g, _| g.wind().density,
    },
    Parameter {
        name: "drag",
        by: 0.015625,
        change: |run, d| run.wind.as_mut().unwrap().drag += d,
        of: |g, _| g.wind().drag,
    },
    Parameter {
        name: "friction of the air",
        by: 0.015625,
        change: |run, d| run.wind.as_mut().unwrap().friction += d,
        of: |g, _| g.wind().friction,
    },
];

/// Oblique, of numbers that single precision holds.
const AIR: Vector = Vector::new(3.5, 0.75, 2.5);

/// With its friction coefficient.
fn air(velocity: Vector, density: f64, friction: f64) -> Option<DeformableWind> {
    Some(DeformableWind { velocity, density, drag: 1.25, friction })
}

fn flag(thickness: f32) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cloth([0.25, 0.125], [4, 3], thickness)
}

fn cube() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3])
}

fn error(scene: &Scene, run: &Run, others: &[&Parameter]) -> f64 {
    let all = WIND.iter().chain(&LOADS).chain(&MATERIAL).chain(others.iter().copied());
    state_error(scene, run, all)
}

#[test]
fn flags_that_are_held_have_gradients() {
    let mut scene = Scene::new(flag(1.0 / 128.0).pinned(|x| x.x < -0.2499));
    scene.stride = 0.125;
    let material = DeformableMaterial::new(1.0e5, 0.3).density(250.0).mass_damping(0.5);
    let run = Run { wind: air(AIR, 1.25, 0.25), push: 0.0078125, ..Run::of(material) };
    let error = error(&scene, &run, &[&PINS]);
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn light_flags_whose_nodes_take_the_speed_of_the_air_have_gradients() {
    let mut scene = Scene::new(flag(1.0 / 1024.0).pinned(|x| x.x < -0.2499));
    // A wider one goes over places where a plate is as much pushed as rubbed.
    scene.stride = 0.00390625;
    let material = DeformableMaterial::new(1.0e5, 0.3).density(25.0).mass_damping(0.5);
    let run = Run { wind: air(AIR, 4.0, 0.25), push: 0.0078125, ..Run::of(material) };
    // All of them do: of what the air weighs they know nothing.
    let out = scene.run(&run);
    let of_density = out.tape.backward(&out.seeds).unwrap().wind().density;
    assert!(of_density.abs() < 1e-12, "{of_density:e}");
    let felt = WIND.iter().filter(|parameter| parameter.name != "density of the air");
    let error = state_error(&scene, &run, felt.chain(&LOADS[..2]).chain(&MATERIAL).chain([&PINS]));
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn what_flies_has_gradients_with_its_spin_kept_too() {
    for keeps_spin in [false, true] {
        for (builder, density) in [(flag(1.0 / 64.0), 125.0), (cube(), 125.0)] {
            let mut scene = Scene::new(builder);
            (scene.keeps_spin, scene.stride, scene.steps) = (keeps_spin, 0.125, 12);
            let material = DeformableMaterial::new(1.0e5, 0.3).density(density).mass_damping(0.5);
            let wind = air(AIR, 1.25, 0.25);
            let run = Run { wind, push: 0.0078125, ..Run::of(material) };
            let error = error(&scene, &run, &[&LAUNCH]);
            assert!(error < EXACT, "{keeps_spin}: {error:e}");
        }
    }
}

#[test]
fn ropes_have_gradients() {
    let points: Vec<[f64; 3]> = (0..7).map(|k| [0.1 * f64::from(k), 0.02 * f64::from(k * k), 0.0]).collect();
    let rope = Structure::rod(&points, 0.015625).unwrap();
    // The lighter one takes the speed of the air in its first step.
    for (pinned, density, of_air) in [(2, 250.0, 1.25), (0, 250.0, 1.25), (2, 12.5, 32.0)] {
        let is_held = move |x: Vector| pinned > 0 && x.x < 0.15;
        let mut scene = Scene::new(DeformableBodyBuilder::structure(&rope).pinned(is_held));
        (scene.keeps_spin, scene.stride, scene.steps) = (pinned == 0, 0.03125, 12);
        let material = DeformableMaterial::new(1.0e5, 0.3).density(density).mass_damping(0.5);
        let run = Run { wind: air(AIR, of_air, 0.0), push: 0.0078125, ..Run::of(material) };
        // They have no friction of the air, and nothing that Poisson's ratio says.
        let materials = MATERIAL.iter().filter(|parameter| parameter.name != "Poisson's ratio");
        let all = WIND[..5].iter().chain(&LOADS).chain(materials);
        let error = state_error(&scene, &run, all);
        assert!(error < EXACT, "{pinned} {density}: {error:e}");
    }
}

#[test]
fn what_stands_or_slides_in_the_wind_has_gradients() {
    let block = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.125, 0.125), [2, 1, 1]);
    for (friction, launch, look, stride) in [(1.0, 0.0, 7, 8.0), (0.25, 4.0, 25, 16.0)] {
        let scene = Scene { floor: Some(-0.125), stride, look, ..Scene::new(block.clone()) };
        let material = DeformableMaterial::new(5.0e4, 0.3).mass_damping(1.0).friction(0.0);
        let wind = air(2.0 * AIR, 1.25, 1.25);
        let run = Run { friction, launch: [launch, 0.0], throw: 0.0, wind, ..Run::of(material) };
        let slides = [&FRICTION].into_iter().filter(|_| launch > 0.0);
        let felt = WIND.iter().chain(&MATERIAL).chain(slides);
        let errors = errors_of_state_and_force(&scene, &run, &|_| true, felt);
        assert!(errors.iter().all(|error| *error < IN_CONTACT), "{friction}: {errors:?}");
    }
}

/// The height of the free corner of a flag after twelve steps, from the seventh on in another wind, and the gradient, by checkpoints too.
fn gust(speed: f32, every: Option<usize>) -> (f64, DeformableGradient) {
    let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
    let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
    let material = DeformableMaterial::new(1.0e5, 0.3).density(250.0);
    let builder = flag(1.0 / 128.0).pinned(|x| x.x < -0.2499).material(material).can_sleep(false);
    let handle = world.insert(builder.settings(settings)).unwrap();
    let mut tape = DeformableTape::new(&world, handle).unwrap();
    if let Some(every) = every {
        tape = tape.checkpoint_every(every);
    }
    let blow = |step: usize, _: &mut PhysicsWorld, world: &mut DeformableWorld| {
        let velocity = Vector::new(1.0, if step < 6 { 4.0 } else { speed }, 0.5);
        // None blows in the first of them.
        let wind = (step > 0).then(|| DeformableWind::new(velocity));
        world.bodies[handle].set_wind(wind).unwrap();
    };
    for step in 0..12 {
        blow(step, &mut physics, &mut world);
        tape.step(&mut physics, &mut world).unwrap();
    }
    let mut loss = tape.loss();
    let body = &world.bodies[handle];
    let corner = body.vertex_count() - 1;
    loss.add_position(11, corner, [0.0, 1.0, 0.0]).unwrap();
    let gradient =
        if every.is_some() { tape.replay(&loss, blow).unwrap() } else { tape.backward(&loss).unwrap() };
    (body.position(corner).unwrap()[1], gradient)
}

#[test]
fn winds_that_are_set_anew_have_gradients_step_by_step() {
    let by = 0.125;
    let (_, gradient) = gust(-3.0, None);
    let at = |d: f32| gust(-3.0 + d * by, None).0;
    let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * f64::from(by));
    let ours: f64 = gradient.steps[6..].iter().map(|step| step.wind.velocity[1]).sum();
    println!("{ours:e} against {slope:e}");
    assert!((ours / slope - 1.0).abs() < EXACT, "{ours} against {slope}");
    assert_eq!(gradient, gust(-3.0, Some(5)).1);
    assert_eq!(gradient.steps[0].wind, WindGradient::default());
    assert!(gradient.steps[1].wind.velocity[1] != 0.0);
}

#[test]
fn coefficients_below_zero_count_as_zero_backward_too() {
    let scene = Scene::new(flag(1.0 / 128.0).pinned(|x| x.x < -0.2499));
    let of = |change: fn(&mut DeformableWind)| {
        let mut run = Run { wind: air(AIR, 1.25, 0.25), ..Run::of(DeformableMaterial::new(1.0e5, 0.3)) };
        change(run.wind.as_mut().unwrap());
        let out = scene.run(&run);
        out.tape.backward(&out.seeds).unwrap().wind()
    };
    let (none, negative) = (of(|wind| wind.drag = 0.0), of(|wind| wind.drag = -2.0));
    assert!(none.drag != 0.0 && negative.drag == 0.0);
    assert!(none.friction != 0.0 && negative.friction == none.friction);
    assert!(none.density != 0.0 && negative.density == none.density);
    // No air at all.
    let vacuum = of(|wind| wind.density = -1.0);
    assert_eq!([vacuum.density, vacuum.drag, vacuum.friction], [0.0; 3]);
}
