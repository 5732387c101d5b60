//! Gradients over steps of bodies that cables run through, against differences between whole runs.

use crate::differences::{
    FRICTION, LENGTH, LOADS, MATERIAL, Outcome, PINS, Parameter, Pull, Route, Run, Scene, Sought, TENSION,
    errors_of_state_and, state_error,
};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// What differences of the fourth order leave, and steps that are solved to 1e-12 of the forces; in contact more,
/// where a softer body that counts for little changes what touches.
const EXACT: f64 = 1e-5;
const IN_CONTACT: f64 = 1e-3;

fn bar() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [6, 2, 2]).pinned(|x| x.x < -0.249)
}

fn material() -> DeformableMaterial {
    DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0).friction(0.0)
}

/// Along its upper side from the wall behind it: vertices, then places within.
fn along(handle: DeformableBodyHandle, body: &DeformableBody, _: &mut PhysicsWorld) -> Vec<CablePoint> {
    let top = |x: f32| {
        let is_there = |at: Vector| (at - Vector::new(x, 0.0625, 0.0)).length() < 1e-3;
        let vertex = body.vertices_where(is_there)[0];
        CablePoint::Vertex(handle, vertex)
    };
    let within = |x: f32| CablePoint::Inside(handle, Vector::new(x, 0.03, 0.01));
    let wall = CablePoint::World(Vector::new(-0.5, 0.125, 0.0));
    vec![within(0.22), top(0.0833333), within(-0.07), top(-0.0833333), wall]
}

/// From a hook that moves over its tip down to a fixed one.
fn across(
    handle: DeformableBodyHandle,
    body: &DeformableBody,
    physics: &mut PhysicsWorld,
) -> Vec<CablePoint> {
    let led = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::new(0.0625, 0.03125, -0.0625));
    let hook = physics.insert_body(led.translation(Vector::new(0.25, 0.5, 0.25)));
    let fixed = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::new(0.375, -0.25, 0.0)));
    let tip = body.vertices_where(|at| (at - Vector::new(0.25, 0.0625, 0.0)).length() < 1e-3)[0];
    vec![
        CablePoint::RigidBody(hook, Vector::ZERO),
        CablePoint::Vertex(handle, tip),
        CablePoint::RigidBody(fixed, Vector::ZERO),
    ]
}

#[test]
fn tensions_and_lengths_have_gradients() {
    let length = |route: Route| {
        let mut world = DeformableWorld::new();
        let mut physics = PhysicsWorld::new();
        let handle = world.insert(bar()).unwrap();
        let points = route(handle, &world.bodies[handle], &mut physics);
        let cable = world.bodies.insert_cable(DeformableCableBuilder::new(points)).unwrap();
        world.bodies.cable_length(cable, &physics.bodies)
    };
    for (route, parameter) in [(along as Route, "along"), (across, "across")] {
        let taut = length(route);
        let pulls = [
            (Pull::Tension(8.0), &TENSION),
            (Pull::Tension(0.5), &TENSION),
            (Pull::Length(taut - 0.01, 1.0e-3), &LENGTH),
            (Pull::Length(taut - 0.03, 0.0), &LENGTH),
        ];
        for (pull, of_pull) in pulls {
            println!("{parameter}, {pull:?}");
            let mut scene = Scene::new(bar());
            scene.route = Some(route);
            scene.stride = 0.125;
            let run = Run { pull: Some(pull), ..Run::of(material()) };
            let parameters = MATERIAL.iter().chain(&LOADS).chain([&PINS, of_pull]);
            if matches!(pull, Pull::Length(..)) {
                assert!(scene.run(&run).tension > 0.0, "{parameter}, {pull:?} is taut");
                let look = scene.look;
                let seeds = |out: &Outcome| {
                    let mut loss = out.tape.loss();
                    loss.add_tension(look, out.cable.unwrap(), 1.0).unwrap();
                    loss
                };
                let felt = [MATERIAL[0].name, PINS.name, of_pull.name];
                let feels = |parameter: &Parameter| felt.contains(&parameter.name);
                let of_tension = Sought { loss: &|out| out.tension, seeds: &seeds, feels: &feels };
                let errors = errors_of_state_and(&scene, &run, of_tension, parameters);
                assert!(errors.iter().all(|error| *error < EXACT), "{parameter}, {pull:?}: {errors:?}");
            } else {
                let error = state_error(&scene, &run, parameters);
                assert!(error < EXACT, "{parameter}, {pull:?}: {error:e}");
            }
        }
    }
}

/// A finger that a cable bends down on a floor: sticking and sliding, where it goes, what it presses with and how taut the cable is.
#[test]
fn fingers_that_cables_press_on_a_floor_have_gradients() {
    fn below(handle: DeformableBodyHandle, _: &DeformableBody, _: &mut PhysicsWorld) -> Vec<CablePoint> {
        let within = |x: f32| CablePoint::Inside(handle, Vector::new(x, -0.05, 0.01));
        vec![within(0.22), within(0.05), within(-0.1), CablePoint::World(Vector::new(-0.5, -0.0625, 0.0))]
    }
    // Without friction, sliding, sticking.
    for friction in [0.0, 0.0625, 1.0] {
        for (pull, of_pull) in [(Pull::Tension(8.0), &TENSION), (Pull::Length(0.715, 1.0e-3), &LENGTH)] {
            println!("friction {friction}, {pull:?}");
            let mut scene = Scene::new(bar());
            (scene.floor, scene.stride, scene.steps, scene.route) =
                (Some(-0.0625), 0.25, 8, Some(below as Route));
            let run = Run { pull: Some(pull), friction, throw: 0.0, place: 0.0, ..Run::of(material()) };
            let rubs = [&FRICTION].into_iter().filter(|_| friction == 0.0625);
            let parameters = MATERIAL[..2].iter().chain([of_pull, &LOADS[0]]).chain(rubs);
            let look = scene.look;
            let seeds = |out: &Outcome| {
                let mut loss = out.tape.loss();
                loss.add_contact_force(look, out.floor.unwrap(), [0.0, 1.0, 0.0]).unwrap();
                if matches!(pull, Pull::Length(..)) {
                    loss.add_tension(look, out.cable.unwrap(), 1.0).unwrap();
                }
                loss
            };
            let pressed = match pull {
                Pull::Tension(_) | Pull::AsItIs(_) => |out: &Outcome| out.contact_force[1],
                Pull::Length(..) => |out: &Outcome| out.contact_force[1] + out.tension,
            };
            let of_forces =
                Sought { loss: &pressed, seeds: &seeds, feels: &|parameter| parameter.name != FRICTION.name };
            let errors = errors_of_state_and(&scene, &run, of_forces, parameters);
            assert!(
                errors.iter().all(|error| *error < IN_CONTACT),
                "friction {friction}, {pull:?}: {errors:?}"
            );
        }
    }
}

/// A loss of the tension itself, and of a tension of one newton in a body that nothing holds.
#[test]
fn given_tensions_are_their_own_loss_and_free_bodies_have_gradients() {
    let mut scene = Scene::new(DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.0625, 0.0625), [6, 2, 2]));
    (scene.route, scene.steps) = (Some(along as Route), 12);
    let run = Run { pull: Some(Pull::Tension(1.0)), ..Run::of(material()) };
    let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain([&TENSION]));
    assert!(error < EXACT, "{error:e}");
    let out = scene.run(&run);
    let mut loss = out.tape.loss();
    loss.add_tension(5, out.cable.unwrap(), 2.0).unwrap();
    let gradient = out.tape.backward(&loss).unwrap();
    assert_eq!(gradient.cable(out.cable.unwrap()).tension, 2.0);
    assert_eq!(gradient.steps[5].cables[0].tension, 2.0);
    let mut of_another = out.tape.loss();
    of_another.add_tension(5, DeformableCableHandle::from_raw_parts(77), 1.0).unwrap();
    assert!(out.tape.backward(&of_another).is_err());
}

#[test]
fn what_has_no_gradient_says_why() {
    let refused = |change: fn(DeformableCableBuilder) -> DeformableCableBuilder, others: bool| {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let handle = world.insert(bar().fidelity(Fidelity::Reference).can_sleep(false)).unwrap();
        let mut points = along(handle, &world.bodies[handle], &mut physics);
        if others {
            let weight =
                RigidBodyBuilder::dynamic().translation(Vector::new(-0.5, 0.125, 0.0)).additional_mass(1.0);
            points.push(CablePoint::RigidBody(physics.insert_body(weight), Vector::ZERO));
        }
        world.bodies.insert_cable(change(DeformableCableBuilder::new(points))).unwrap();
        let mut tape = DeformableTape::new(&world, handle).unwrap();
        (0..3).find_map(|_| tape.step(&mut physics, &mut world).err()).unwrap().to_string()
    };
    for (why, error) in [
        ("rub", refused(|cable| cable.tension(1.0).friction(0.25), false)),
        ("yield", refused(|cable| cable.tension(1.0), true)),
        ("ran off", refused(|cable| cable.length(0.5).max_tension(2.0), false)),
        ("as far as a step allows", refused(|cable| cable.tension(1.0e6), false)),
    ] {
        assert!(error.contains(why), "{error}");
    }
}

/// As long as its way was at the first step: where vertices begin is how long it is.
#[test]
fn cables_that_are_as_long_as_they_are_have_gradients() {
    for (route, parameter) in [(along as Route, "along"), (across, "across")] {
        let mut scene = Scene::new(bar());
        // Small, as it goes slack and taut, which a difference must not cross; that leaves more noise.
        (scene.route, scene.stride) = (Some(route), 0.03125);
        let run = Run { pull: Some(Pull::AsItIs(1.0e-3)), push: -0.5, ..Run::of(material()) };
        println!("{parameter}");
        assert!(scene.run(&run).taut > 4, "{parameter} is taut");
        let error = state_error(&scene, &run, MATERIAL.iter().chain(&LOADS).chain([&PINS]));
        assert!(error < 10.0 * EXACT, "{parameter}: {error:e}");
    }
}
