//! Gradients over steps of several deformable bodies that touch one another, against central differences between whole runs.

use crate::differences::{nearest, slopes, strict, weight};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// What a run depends on: name, value, and how much it is changed by.
#[derive(Clone, Copy, Debug)]
struct Run {
    values: [f64; 10],
}

const NAMES: [&str; 10] = [
    "lower modulus",
    "upper modulus",
    "upper density",
    "gravity",
    "friction",
    "launch along x",
    "launch along y",
    "place of a lower vertex",
    "place of an upper vertex",
    "lead of the pins",
];
const BY: [f64; 10] =
    [64.0, 64.0, 1.0, 1.0 / 128.0, 1.0 / 512.0, 1.0 / 128.0, 1.0 / 128.0, 5e-5, 5e-5, 1.0 / 128.0];

/// Bodies above one another, the lower pinned.
struct Scene {
    lower: DeformableBodyBuilder,
    upper: DeformableBodyBuilder,
    pins: fn(Vector) -> bool,
    steps: usize,
    /// The step whose forces are looked at.
    look: usize,
    stride: f64,
}

struct Outcome {
    loss: f64,
    tape: DeformableTape,
    losses: Vec<DeformableLoss>,
    handles: [DeformableBodyHandle; 2],
    /// The vertices that are shifted at first.
    shifted: [usize; 2],
    force: [f64; 3],
    h: f64,
}

impl Scene {
    fn new(lower: DeformableBodyBuilder, upper: DeformableBodyBuilder) -> Self {
        Self { lower, upper, pins: |x| x.y < -0.249, steps: 12, look: 7, stride: 1.0 / 32.0 }
    }

    fn run(&self, run: &Run) -> Outcome {
        let [lower_modulus, upper_modulus, density, gravity, friction, along, down, low, up, lead] =
            run.values;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::Y * gravity as f32;
        let mut world = DeformableWorld::new();
        let settings = strict();
        let material = |modulus: f64, density: f64| {
            DeformableMaterial::new(modulus, 0.3).density(density).mass_damping(1.0).friction(friction)
        };
        let mut insert = |builder: &DeformableBodyBuilder, material: DeformableMaterial| {
            world.insert(builder.clone().material(material).can_sleep(false).settings(settings)).unwrap()
        };
        let lower = insert(&self.lower.clone().pinned(self.pins), material(lower_modulus, 1000.0));
        let upper = insert(&self.upper, material(upper_modulus, density));
        let mut shift = |handle: DeformableBodyHandle, place: [f64; 3], by: f64| {
            let body = &mut world.bodies[handle];
            let vertex = nearest(body, place);
            let [x, y, z] = body.position(vertex).unwrap();
            body.set_position(vertex, [x + by, y + 0.5 * by, z - by]).unwrap();
            vertex
        };
        let shifted = [shift(lower, [0.05, 0.0, 0.02], low), shift(upper, [0.03, 0.0, 0.04], up)];
        world.bodies[upper].set_linvel(Vector::new(along as f32, down as f32, 0.0)).unwrap();
        for vertex in world.bodies[lower].pinned().collect::<Vec<_>>() {
            world.bodies[lower].set_pin_velocity(vertex, Vector::X * lead as f32).unwrap();
        }
        let handles = [lower, upper];
        let mut tape = DeformableTape::of_bodies(&world, &handles).unwrap();
        let mut states = Vec::new();
        for step in 0..self.steps {
            tape.step(&mut physics, &mut world).unwrap();
            if step + 1 == self.steps || step + 1 == self.steps / 2 {
                for (place, handle) in handles.into_iter().enumerate() {
                    let body = &world.bodies[handle];
                    let at = |v: usize| (body.position(v).unwrap(), body.velocity(v).unwrap());
                    states.push((step, place, (0..body.vertex_count()).map(at).collect::<Vec<_>>()));
                }
            }
        }
        let (mut loss, mut losses) = (0.0, tape.losses());
        for (step, place, states) in states {
            for (vertex, (x, v)) in states.into_iter().enumerate() {
                let a = [0, 1, 2].map(|k| weight(3 * vertex + k + place));
                let b = [0, 1, 2].map(|k| 0.02 * weight(5 * vertex + k + place));
                loss += (0..3).map(|k| a[k] * x[k] + 0.5 * x[k] * x[k] + b[k] * v[k]).sum::<f64>();
                losses[place].add_position(step, vertex, [0, 1, 2].map(|k| a[k] + x[k])).unwrap();
                losses[place].add_velocity(step, vertex, b).unwrap();
            }
        }
        let force = tape.body_force(self.look, upper, lower);
        let h = f64::from(physics.integration_parameters.dt);
        Outcome { loss, tape, losses, handles, shifted, force, h }
    }
}

/// The derivative with respect to a value of a run.
fn derivative(out: &Outcome, gradients: &[DeformableGradient], which: usize) -> f64 {
    let [lower, upper] = gradients else { panic!("two bodies") };
    let shift = |k: usize| {
        let [x, y, z] = gradients[k].initial_positions[out.shifted[k]];
        x + 0.5 * y - z
    };
    let launch = |k: usize| upper.initial_velocities.iter().map(|v| v[k]).sum::<f64>();
    match which {
        0 => lower.material().youngs_modulus,
        1 => upper.material().youngs_modulus,
        2 => upper.material().density,
        3 => lower.gravity()[1] + upper.gravity()[1],
        4 => lower.friction + upper.friction,
        5 => launch(0),
        6 => launch(1),
        7 => shift(0),
        8 => shift(1),
        // Led at a velocity, pins have gone by (k + 1) h of it at the end of step k.
        _ => {
            let of = |(k, step): (usize, &StepGradient)| {
                (k + 1) as f64 * out.h * step.pin_targets.iter().map(|t| t[0]).sum::<f64>()
            };
            lower.steps.iter().enumerate().map(of).sum()
        }
    }
}

/// The largest relative error against differences of the fourth order, of the state, and of the force between the two.
fn errors(scene: &Scene, run: &Run, which: &[usize]) -> [f64; 2] {
    let out = scene.run(run);
    let across = [0.25, 1.0, -0.5];
    let along = |force: [f64; 3]| (0..3).map(|k| across[k] * force[k]).sum::<f64>();
    let mut of_force = out.tape.losses();
    of_force[1].add_body_force(scene.look, out.handles[0], across).unwrap();
    let gradients = [&out.losses, &of_force].map(|losses| out.tape.backward_all(losses).unwrap());
    let mut largest = [0.0_f64; 2];
    for &which in which {
        let by = BY[which] * scene.stride;
        let at = |d: f64| {
            let mut changed = *run;
            changed.values[which] += d;
            let out = scene.run(&changed);
            [out.loss, along(out.force)]
        };
        let slopes = slopes(by, at);
        for (k, (what, slope)) in ["state", "force"].into_iter().zip(slopes).enumerate() {
            let ours = derivative(&out, &gradients[k], which);
            let error = (ours / slope - 1.0).abs();
            println!("  {} of {what}: {ours:.9e} against {slope:.9e}, {error:.1e}", NAMES[which]);
            largest[k] = if error.is_nan() { f64::INFINITY } else { largest[k].max(error) };
        }
    }
    println!("  worst {largest:?}");
    largest
}

fn block(half: f32, cells: usize, y: f32) -> DeformableBodyBuilder {
    let cube = DeformableBodyBuilder::cuboid(Vector::new(half, 0.125, half), [cells, 2, cells]);
    cube.translation(Vector::Y * y)
}

/// Turned, so that no node is on an edge of what it lies on.
fn upper(y: f32) -> DeformableBodyBuilder {
    block(0.11, 2, 0.0).rotation(Vector::Y * 0.3).translation(Vector::new(0.021, y, -0.011))
}

fn run(friction: f64, along: f64, down: f64) -> Run {
    Run { values: [5.0e4, 3.0e4, 800.0, -9.75, friction, along, down, 1e-3, 1e-3, 0.0] }
}

const ALL: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];
const WITHOUT_FRICTION: [usize; 9] = [0, 1, 2, 3, 5, 6, 7, 8, 9];

#[test]
fn what_sticks_to_another_has_gradients() {
    let scene = Scene::new(block(0.2, 3, -0.125), upper(0.1255));
    let errors = errors(&scene, &run(1.0, 0.0625, -0.25), &WITHOUT_FRICTION);
    assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
}

#[test]
fn what_slides_on_another_has_gradients() {
    let scene = Scene::new(block(0.3, 3, -0.125), upper(0.1255));
    let errors = errors(&scene, &run(0.2, 1.0, -0.25), &ALL);
    assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
}

#[test]
fn what_slips_without_friction_has_gradients() {
    let scene = Scene::new(block(0.3, 3, -0.125), upper(0.1255));
    let errors = errors(&scene, &run(0.0, 0.125, -0.25), &WITHOUT_FRICTION);
    assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
}

#[test]
fn what_lands_on_another_has_gradients() {
    let scene = Scene { look: 10, ..Scene::new(block(0.2, 3, -0.125), upper(0.175)) };
    let errors = errors(&scene, &run(1.0, 0.0, 0.0), &WITHOUT_FRICTION);
    assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
}

/// A bar with a ridge along x, turned about y by an angle.
fn ridge(y: f32, turned: f32) -> DeformableBodyBuilder {
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.1, 0.1), [5, 2, 2]);
    let turn = Rotation::from_rotation_y(turned) * Rotation::from_rotation_x(std::f32::consts::FRAC_PI_4);
    bar.pose(Pose::from_parts(Vector::new(0.013, y, 0.007), turn))
}

#[test]
fn ridges_across_one_another_have_gradients() {
    let deep = 0.1 * std::f32::consts::SQRT_2;
    for (friction, along) in [(1.0, 0.0625), (0.25, 0.5)] {
        // Before the edge's end comes to the other: contacts say the same twice there.
        let scene = Scene {
            pins: |x| x.y < -0.2,
            steps: 7,
            look: 6,
            ..Scene::new(ridge(-deep, 0.0), ridge(deep + 5e-4, 1.3))
        };
        let which: &[usize] = if friction < 1.0 { &ALL } else { &WITHOUT_FRICTION };
        let errors = errors(&scene, &run(friction, along, -0.25), which);
        assert!(errors.iter().all(|error| *error < 1e-3), "{friction}: {errors:?}");
    }
}

#[test]
fn a_cloth_on_a_block_has_gradients() {
    let cloth = DeformableBodyBuilder::cloth([0.15, 0.15], [4, 4], 0.01).rotation(Vector::Y * 0.3);
    let cloth = cloth.translation(Vector::new(0.021, 0.0065, -0.011));
    let scene = Scene::new(block(0.3, 3, -0.125), cloth);
    let errors = errors(&scene, &run(0.25, 0.25, -0.5), &ALL);
    assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
}

/// Two pads that rise with this speed [m/s] while they close on a ball, with this friction; pads first.
fn pads_and_ball(rise: f64, friction: f64) -> (DeformableWorld, [DeformableBodyHandle; 3]) {
    let mut world = DeformableWorld::new();
    let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-11).max_iterations(400);
    let settings = settings.contact_tolerance(1e-10).keeps_spin(false);
    let mut insert = |builder: DeformableBodyBuilder| {
        let material = DeformableMaterial::new(1.0e5, 0.3).friction(friction);
        world.insert(builder.material(material).can_sleep(false).settings(settings)).unwrap()
    };
    let pad = |side: f32| {
        let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.06, 0.06), [1, 3, 3]);
        let pad = pad.rotation(Vector::X * 0.3).translation(Vector::X * side * 0.0605);
        pad.pinned(move |x| x.x * side > 0.08)
    };
    let ball = DeformableBodyBuilder::filled(&Ball::new(0.04), 0.02);
    let ball = ball.translation(Vector::new(0.0, 0.003, 0.002));
    let bodies = [insert(pad(-1.0)), insert(pad(1.0)), insert(ball)];
    for (pad, inwards) in [(bodies[0], 0.03125), (bodies[1], -0.03125)] {
        let body = &mut world.bodies[pad];
        for vertex in body.pinned().collect::<Vec<_>>() {
            body.set_pin_velocity(vertex, Vector::new(inwards, rise as f32, 0.0)).unwrap();
        }
    }
    (world, bodies)
}

/// Height \[m\] of a ball that pads lift, and its derivatives with respect to their speed and to the friction.
fn lift(rise: f64, friction: f64) -> (f64, [f64; 2]) {
    let (mut world, bodies) = pads_and_ball(rise, friction);
    let mut physics = PhysicsWorld::new();
    let mut tape = DeformableTape::of_bodies(&world, &bodies).unwrap();
    let steps = 12;
    (0..steps).for_each(|_| tape.step(&mut physics, &mut world).unwrap());
    let body = &world.bodies[bodies[2]];
    let (mut losses, count) = (tape.losses(), body.vertex_count());
    (0..count).for_each(|v| losses[2].add_position(steps - 1, v, [0.0, 1.0 / count as f64, 0.0]).unwrap());
    let height = (0..count).map(|v| body.position(v).unwrap()[1]).sum::<f64>() / count as f64;
    let gradients = tape.backward_all(&losses).unwrap();
    let h = f64::from(physics.integration_parameters.dt);
    // Pins have gone by (k + 1) h of their velocity at the end of step k.
    let of_step = |(k, step): (usize, &StepGradient)| {
        (k + 1) as f64 * h * step.pin_targets.iter().map(|t| t[1]).sum::<f64>()
    };
    let of_rise = gradients[..2].iter().flat_map(|pad| pad.steps.iter().enumerate().map(of_step)).sum();
    (height, [of_rise, gradients.iter().map(|gradient| gradient.friction).sum()])
}

#[test]
fn a_ball_that_pads_lift_has_gradients() {
    let (height, [of_rise, of_friction]) = lift(0.25, 1.0);
    // It falls by 0.2 m without them.
    assert!(height > 0.0, "{height}");
    let (d, e) = (1.0 / 4096.0, 1.0 / 8192.0);
    let by_rise = (lift(0.25 + d, 1.0).0 - lift(0.25 - d, 1.0).0) / (2.0 * d);
    let by_friction = (lift(0.25, 1.0 + e).0 - lift(0.25, 1.0 - e).0) / (2.0 * e);
    println!("{of_rise:.9e} against {by_rise:.9e}, {of_friction:.9e} against {by_friction:.9e}");
    assert!((of_rise / by_rise - 1.0).abs() < 1e-3, "{of_rise} against {by_rise}");
    assert!((of_friction / by_friction - 1.0).abs() < 1e-3, "{of_friction} against {by_friction}");
}

#[test]
fn what_has_no_gradient_is_refused() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let lower =
        world.insert(block(0.2, 2, -0.125).fidelity(Fidelity::Reference).pinned(|x| x.y < -0.2)).unwrap();
    let upper = world.insert(upper(0.1255).fidelity(Fidelity::Reference)).unwrap();
    let twice = DeformableTape::of_bodies(&world, &[lower, upper, lower]).unwrap_err().to_string();
    assert!(twice.contains("twice"), "{twice}");
    let none = DeformableTape::of_bodies(&world, &[]).unwrap_err().to_string();
    assert!(none.contains("no body"), "{none}");
    let mut alone = DeformableTape::new(&world, upper).unwrap();
    let mut both = DeformableTape::of_bodies(&world, &[lower, upper]).unwrap();
    let results: Vec<_> = (0..4)
        .map(|_| {
            world.step(&mut physics);
            both.record(&physics, &world).unwrap();
            alone.record(&physics, &world)
        })
        .collect();
    let refused = results.into_iter().find_map(Result::err).expect("they touch").to_string();
    assert!(refused.contains("not on the tape"), "{refused}");
    let one = both.backward(&both.loss()).unwrap_err().to_string();
    assert!(one.contains("backward_all"), "{one}");
    let swapped: Vec<_> = both.losses().into_iter().rev().collect();
    assert!(both.backward_all(&swapped).unwrap_err().to_string().contains("another body"));
    let turned = DeformableTape::of_bodies(&world, &[upper, lower]).unwrap();
    assert!(
        DeformableTape::of_bodies(&world, &[lower, upper]).unwrap().backward_all(&turned.losses()).is_err()
    );
    let own = both.loss().add_body_force(0, lower, [1.0; 3]).unwrap_err().to_string();
    assert!(own.contains("another body"), "{own}");
}

/// From checkpoints the gradients have the same bits, and forces between bodies are equal and opposite.
#[test]
fn checkpoints_of_several_bodies_replay_to_the_same_bits() {
    let gradients = [None, Some(4)].map(|every| {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let strict = |builder: DeformableBodyBuilder| {
            builder.fidelity(Fidelity::Reference).can_sleep(false).tune(|s| s.keeps_spin = false)
        };
        let lower = world.insert(strict(block(0.2, 2, -0.125)).pinned(|x| x.y < -0.2)).unwrap();
        let upper = world.insert(strict(upper(0.1255))).unwrap();
        let mut tape = DeformableTape::of_bodies(&world, &[lower, upper]).unwrap();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        (0..10).for_each(|_| tape.step(&mut physics, &mut world).unwrap());
        let mut losses = tape.losses();
        losses[1].add_position(9, 3, [1.0, 2.0, 3.0]).unwrap();
        losses[0].add_velocity(5, 7, [0.5, 0.0, 1.0]).unwrap();
        let force = tape.body_force(9, upper, lower);
        assert!(force[1] > 0.0);
        assert_eq!(force.map(|f| -f), tape.body_force(9, lower, upper));
        match every {
            None => tape.backward_all(&losses).unwrap(),
            Some(_) => {
                let step = |physics: &mut PhysicsWorld, world: &mut DeformableWorld| world.step(physics);
                tape.replay_all(&losses, |_, _, _| {}, step).unwrap()
            }
        }
    });
    assert_eq!(gradients[0], gradients[1]);
}
