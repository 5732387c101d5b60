//! Gradients over steps of deformable bodies that touch rigid ones that yield, against central differences between whole runs. Rapier is in
//! `f32`: what is changed is changed by powers of two, by so much that its last places do not count.

use crate::differences::{slopes, weight};
use foible3d::prelude::*;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rapier3d::prelude::*;

/// What a run depends on.
#[derive(Clone, Copy, Debug)]
struct Run {
    values: [f64; 13],
}

const NAMES: [&str; 13] = [
    "modulus",
    "density",
    "density of the rigid body, over that",
    "gravity",
    "friction",
    "launch along x",
    "launch along y",
    "spin about z",
    "place along x",
    "place along y",
    "turn about z",
    "place of a vertex",
    "lead of the pins",
];
const BY: [f64; 13] = [
    512.0,
    8.0,
    1.0 / 64.0,
    1.0 / 16.0,
    1.0 / 128.0,
    1.0 / 64.0,
    1.0 / 64.0,
    1.0 / 16.0,
    1.0 / 1024.0,
    1.0 / 16384.0,
    1.0 / 1024.0,
    1.0 / 4096.0,
    1.0 / 64.0,
];

/// By how much `f32` lets forces be off in these scenes \[N\]; differences are off by that over what they are of.
const FORCES: f64 = 1e-4;
/// What is left beside that.
const EXACT: f64 = 1e-3;
/// Part of a derivative that rounding may be, or its differences say nothing.
const FELT: f64 = 0.02;

/// A pinned body below a rigid one.
struct Scene {
    soft: DeformableBodyBuilder,
    pins: fn(Vector) -> bool,
    shape: SharedShape,
    rigid: RigidBodyBuilder,
    /// Of the rigid one [kg/m³].
    density: f32,
    steps: usize,
    /// The step whose force is looked at.
    look: usize,
    stride: f64,
    /// As [`FORCES`], of the loss: more, the farther from the origin the rigid body is.
    rounding: f64,
}

struct Outcome {
    loss: f64,
    tape: DeformableTape,
    of_loss: DeformableLoss,
    collider: ColliderHandle,
    mass: f64,
    /// The vertex that is shifted at first.
    shifted: usize,
    force: [f64; 3],
    h: f64,
}

fn wide(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x.into(), v.y.into(), v.z.into())
}

/// A vector that a body turns.
fn turned(body: &RigidBody, vector: [f64; 3]) -> Vector3<f64> {
    let [x, y, z, w] = body.rotation().to_array().map(f64::from);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * Vector3::from(vector)
}

impl Scene {
    fn run(&self, run: &Run) -> Outcome {
        let [modulus, density, heaviness, gravity, friction, along, down, spin, x, y, turn, low, lead] =
            run.values;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::Y * gravity as f32;
        let mut world = DeformableWorld::new();
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
        let settings = settings.contact_tolerance(1e-12).keeps_spin(false);
        let material =
            DeformableMaterial::new(modulus, 0.3).density(density).mass_damping(1.0).friction(friction);
        let soft = self.soft.clone().pinned(self.pins).material(material).can_sleep(false).settings(settings);
        let soft = world.insert(soft).unwrap();
        let rigid = self.rigid.clone();
        let place = rigid.position.translation + Vector::new(x as f32, y as f32, 0.0);
        let rotation = Rotation::from_rotation_z(turn as f32) * rigid.position.rotation;
        let rigid = rigid
            .pose(Pose::from_parts(place, rotation))
            .linvel(Vector::new(along as f32, down as f32, 0.0))
            .angvel(Vector::new(0.0, 0.0, spin as f32))
            .can_sleep(false);
        let collider = ColliderBuilder::new(self.shape.clone())
            .density(self.density * heaviness as f32)
            .friction(friction as f32);
        let (rigid, collider) = physics.insert(rigid, collider);
        let body = &mut world.bodies[soft];
        let far = |v: &usize| {
            let x = body.position(*v).unwrap();
            (x[0] - 0.12).powi(2) + (x[1] + 0.125).powi(2) + (x[2] - 0.01).powi(2)
        };
        let shifted = (0..body.vertex_count()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
        let at = body.position(shifted).unwrap();
        body.set_position(shifted, [at[0] + low, at[1] - 0.5 * low, at[2] - low]).unwrap();
        for vertex in body.pinned().collect::<Vec<_>>() {
            body.set_pin_velocity(vertex, Vector::new(lead as f32, 0.0, 0.5 * lead as f32)).unwrap();
        }
        let tape = DeformableTape::new(&world, soft).unwrap();
        let mut tape = tape.with_rigid_bodies(&physics, &[rigid]).unwrap();
        let (mut loss, mut states) = (0.0, Vec::new());
        for step in 0..self.steps {
            tape.step(&mut physics, &mut world).unwrap();
            if step + 1 == self.steps || step + 1 == self.steps / 2 {
                let body = &world.bodies[soft];
                let at = |v: usize| (body.position(v).unwrap(), body.velocity(v).unwrap());
                let vertices: Vec<_> = (0..body.vertex_count()).map(at).collect();
                states.push((step, vertices, physics.bodies[rigid].clone()));
            }
        }
        let mut of_loss = tape.loss();
        for (step, vertices, rigid_body) in states {
            for (vertex, (x, v)) in vertices.into_iter().enumerate() {
                let a = [0, 1, 2].map(|k| 0.1 * weight(3 * vertex + k));
                let b = [0, 1, 2].map(|k| 0.002 * weight(5 * vertex + k));
                loss += (0..3).map(|k| a[k] * x[k] + 0.05 * x[k] * x[k] + b[k] * v[k]).sum::<f64>();
                of_loss.add_position(step, vertex, [0, 1, 2].map(|k| a[k] + 0.1 * x[k])).unwrap();
                of_loss.add_velocity(step, vertex, b).unwrap();
            }
            let [a, b, c] = [7, 20, 33].map(|first| Vector3::from_fn(|k, _| weight(first + k)));
            let (com, arm) = (wide(rigid_body.center_of_mass()), turned(&rigid_body, [0.5, -0.25, 1.0]));
            let (linvel, angvel) = (wide(rigid_body.linvel()), wide(rigid_body.angvel()));
            loss += a.dot(&com) + b.dot(&arm) + 0.1 * c.dot(&linvel) + 0.05 * a.dot(&angvel);
            of_loss.add_rigid_position(step, rigid, a.into()).unwrap();
            of_loss.add_rigid_rotation(step, rigid, arm.cross(&b).into()).unwrap();
            of_loss.add_rigid_linvel(step, rigid, (0.1 * c).into()).unwrap();
            of_loss.add_rigid_angvel(step, rigid, (0.05 * a).into()).unwrap();
        }
        let force = tape.contact_force(self.look, collider);
        let mass = f64::from(physics.bodies[rigid].mass()) / heaviness;
        let h = f64::from(physics.integration_parameters.dt);
        Outcome { loss, tape, of_loss, collider, mass, shifted, force, h }
    }
}

/// The derivative with respect to a value of a run.
fn derivative(out: &Outcome, of: &DeformableGradient, which: usize) -> f64 {
    let rigid = &of.rigid_bodies[0];
    match which {
        0 => of.material().youngs_modulus,
        1 => of.material().density,
        2 => rigid.mass * out.mass,
        3 => of.gravity()[1] + rigid.gravity()[1],
        4 => of.friction,
        5 => rigid.initial_linvel[0],
        6 => rigid.initial_linvel[1],
        7 => rigid.initial_angvel[2],
        8 => rigid.initial_position[0],
        9 => rigid.initial_position[1],
        10 => rigid.initial_rotation[2],
        11 => {
            let [x, y, z] = of.initial_positions[out.shifted];
            x - 0.5 * y - z
        }
        // Led at a velocity, pins have gone by (k + 1) h of it at the end of step k.
        _ => {
            let of_step = |(k, step): (usize, &StepGradient)| {
                (k + 1) as f64 * out.h * step.pin_targets.iter().map(|t| t[0] + 0.5 * t[2]).sum::<f64>()
            };
            of.steps.iter().enumerate().map(of_step).sum()
        }
    }
}

/// The largest relative errors against differences of the fourth order, of the state, and of the force on the rigid body; and of how many
/// derivatives. Others have a kink near by, which differences by twice as much cross: a contact that opens or closes.
fn errors(scene: &Scene, run: &Run, which: &[usize]) -> ([f64; 2], usize) {
    let out = scene.run(run);
    let across = [0.25, 1.0, -0.5];
    let along = |force: [f64; 3]| (0..3).map(|k| across[k] * force[k]).sum::<f64>();
    let mut of_force = out.tape.loss();
    of_force.add_contact_force(scene.look, out.collider, across).unwrap();
    let gradients = [&out.of_loss, &of_force].map(|loss| out.tape.backward(loss).unwrap());
    let (mut largest, mut count) = ([0.0_f64; 2], 0);
    for &which in which {
        let by = BY[which] * scene.stride;
        let at = |d: f64| {
            let mut changed = *run;
            changed.values[which] += d;
            let out = scene.run(&changed);
            [out.loss, along(out.force)]
        };
        let rounding = [scene.rounding / by, FORCES / by];
        let (near, far) = (slopes(by, at), slopes(2.0 * by, at));
        for (k, what) in ["state", "force"].into_iter().enumerate() {
            let (ours, slope, rounding) = (derivative(&out, &gradients[k], which), near[k], rounding[k]);
            let is_smooth = (far[k] - slope).abs() <= 0.25 * EXACT * slope.abs() + rounding;
            let is_felt = rounding <= FELT * slope.abs();
            let error = ((ours - slope).abs() - rounding).max(0.0) / slope.abs();
            let name = NAMES[which];
            let counts = is_smooth && is_felt;
            println!("  {name} of {what}: {ours:.9e} against {slope:.9e}, {error:.1e}, {counts}");
            if counts {
                count += 1;
                largest[k] = if error.is_nan() { f64::INFINITY } else { largest[k].max(error) };
            }
        }
    }
    println!("  worst {largest:?} of {count}");
    (largest, count)
}

fn run(friction: f64, along: f64, down: f64) -> Run {
    Run {
        values: [5.0e4, 1000.0, 1.0, -9.75, friction, along, down, 0.0625, 0.0, 0.0, 0.0, 1.0 / 1024.0, 0.0],
    }
}

fn block(half: f32, cells: usize) -> DeformableBodyBuilder {
    let cube = DeformableBodyBuilder::cuboid(Vector::new(half, 0.125, half), [cells, 2, cells]);
    cube.translation(Vector::Y * -0.125)
}

const ALL: [usize; 13] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];

const WITHOUT_FRICTION: [usize; 12] = [0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12];

/// Whether derivatives are those of differences, so many of them at least.
fn check(scene: &Scene, run: &Run, which: &[usize], least: usize) {
    let (errors, count) = errors(scene, run, which);
    assert!(errors.iter().all(|error| *error < EXACT), "{errors:?}");
    assert!(count >= least, "{count}");
}

fn plate() -> Scene {
    Scene {
        soft: block(0.125, 2),
        pins: |x| x.y < -0.249,
        shape: SharedShape::cuboid(0.25, 0.03125, 0.25),
        rigid: RigidBodyBuilder::dynamic().translation(Vector::new(0.01, 0.032, -0.005)),
        density: 512.0,
        steps: 12,
        look: 7,
        stride: 0.5,
        rounding: 6e-8,
    }
}

#[test]
fn a_plate_that_sticks_to_a_block_has_gradients() {
    check(&plate(), &run(1.0, 0.0625, -0.5), &WITHOUT_FRICTION, 18);
}

/// It may not turn about x, along which it lies beside the block's middle.
#[test]
fn a_plate_that_may_not_turn_about_an_axis_has_gradients() {
    let mut scene = plate();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(0.01, 0.032, -0.03));
    scene.rigid = rigid.enabled_rotations(false, true, true);
    let mut run = run(1.0, 0.0625, -0.5);
    // Pins that are led to neither side leave forces between sticking and sliding.
    run.values[12] = 0.0625;
    check(&scene, &run, &WITHOUT_FRICTION, 16);
}

#[test]
fn a_plate_that_slides_on_a_block_has_gradients() {
    check(&plate(), &run(0.25, 1.5, -0.5), &ALL, 11);
}

/// In the first steps nothing touches it.
#[test]
fn a_plate_that_falls_on_a_block_has_gradients() {
    let mut scene = plate();
    scene.rigid = scene.rigid.translation(Vector::new(0.01, 0.07, -0.005));
    check(&scene, &run(1.0, 0.0625, -0.5), &WITHOUT_FRICTION, 14);
}

/// Corners of the box stand on triangles of the block, and edges of that go across its edges and corners.
#[test]
fn a_box_on_a_block_has_gradients() {
    let on_block = |place: [f32; 2], turn: f32, cells: usize| {
        let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(place[0], 0.0632, place[1]));
        let (soft, shape) = (block(0.25, cells), SharedShape::cuboid(0.1, 0.0625, 0.07));
        Scene { soft, shape, rigid: rigid.rotation(Vector::Y * turn), stride: 0.25, ..plate() }
    };
    check(&on_block([0.02, -0.03], 0.1, 5), &run(1.0, 0.0, -0.5), &WITHOUT_FRICTION, 11);
    check(&on_block([0.01, 0.0], 0.2, 4), &run(0.25, 1.0, -0.5), &ALL, 9);
}

/// Four pyramids, on whose tips something round touches nothing but these.
fn on_tips(shape: SharedShape, turn: Vector, height: f32) -> Scene {
    let (mut vertices, mut tetrahedra) = (Vec::new(), Vec::new());
    for [x, z] in [[-0.15, -0.1], [0.12, -0.13], [0.14, 0.11], [-0.11, 0.14]] {
        let first = vertices.len() as u32;
        let base = [[0.08, 0.0], [-0.04, -0.08], [-0.05, 0.07]];
        vertices.extend(base.map(|[u, w]| [x + u, -0.25, z + w]));
        vertices.push([x, 0.0, z]);
        tetrahedra.push([first, first + 1, first + 2, first + 3]);
    }
    let mesh = TetMesh::new(vertices, tetrahedra).unwrap();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(0.02, height, 0.01)).rotation(turn);
    Scene { soft: DeformableBodyBuilder::mesh(&mesh), shape, rigid, density: 16.0, rounding: 2e-7, ..plate() }
}

/// Around them normals turn.
#[test]
fn round_things_have_gradients() {
    // The vertex that others shift is pinned here.
    let which =
        |friction: f64| ALL.into_iter().filter(move |which| *which != 11 && (*which != 4 || friction > 0.0));
    let ball = || on_tips(SharedShape::ball(0.5), Vector::ZERO, 0.4675);
    for (friction, along) in [(0.0, 0.0625), (0.5, 0.0625), (0.25, 1.0)] {
        let which: Vec<usize> = which(friction).filter(|which| *which != 4 || along == 1.0).collect();
        check(&ball(), &run(friction, along, -0.5), &which, 10);
    }
    // Points on it are projections in `f32`.
    let capsule = on_tips(SharedShape::capsule_y(0.5, 0.3), Vector::X * 1.5, 0.28);
    let capsule = Scene { rounding: 5e-7, ..capsule };
    check(&capsule, &run(0.0, 0.0625, -0.5), &which(0.0).collect::<Vec<_>>(), 10);
}

/// A pyramid that is led along drags its tip over a ball that stands: as its normals turn, so does the force.
#[test]
fn a_tip_that_is_dragged_over_a_fixed_ball_has_gradients() {
    const STEPS: usize = 12;
    let drag = |[modulus, friction, lead, shift]: [f64; 4]| {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let vertices = vec![[0.08, 0.25, 0.0], [-0.04, 0.25, -0.08], [-0.05, 0.25, 0.07], [-0.08, 0.0, 0.0]];
        let mesh = TetMesh::new(vertices, vec![[0, 2, 1, 3]]).unwrap();
        let material = DeformableMaterial::new(modulus, 0.3).mass_damping(1.0).friction(friction);
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
        let settings = settings.contact_tolerance(1e-12).keeps_spin(false);
        let body = DeformableBodyBuilder::mesh(&mesh).pinned(|x| x.y > 0.2).material(material);
        let body = world.insert(body.settings(settings).can_sleep(false)).unwrap();
        let ball =
            ColliderBuilder::ball(0.5).translation(Vector::new(0.02, -0.49, 0.03)).friction(friction as f32);
        let ball = physics.insert_collider(ball, None);
        let at = world.bodies[body].position(3).unwrap();
        world.bodies[body].set_position(3, [at[0] + shift, at[1], at[2] - shift]).unwrap();
        for vertex in 0..3 {
            world.bodies[body].set_pin_velocity(vertex, Vector::new(lead as f32, 0.0, 0.0)).unwrap();
        }
        let mut tape = DeformableTape::new(&world, body).unwrap();
        for _ in 0..STEPS {
            tape.step(&mut physics, &mut world).unwrap();
        }
        let tip = world.bodies[body].position(3).unwrap();
        let force = tape.contact_force(STEPS - 1, ball);
        (tape, ball, tip[1] + 0.5 * tip[2], force[0] + force[1])
    };
    let values = [5.0e4, 0.25, 1.0, 0.0];
    let (tape, ball, ..) = drag(values);
    let (mut of_tip, mut of_force) = (tape.loss(), tape.loss());
    of_tip.add_position(STEPS - 1, 3, [0.0, 1.0, 0.5]).unwrap();
    of_force.add_contact_force(STEPS - 1, ball, [1.0, 1.0, 0.0]).unwrap();
    let gradients = [of_tip, of_force].map(|loss| tape.backward(&loss).unwrap());
    for (k, by) in [64.0, 1.0 / 512.0, 1.0 / 128.0, 1e-4].into_iter().enumerate() {
        let ours = gradients.each_ref().map(|of| match k {
            0 => of.material().youngs_modulus,
            1 => of.friction,
            2 => {
                let led = |(k, s): (usize, &StepGradient)| {
                    (k + 1) as f64 / 60.0 * s.pin_targets.iter().map(|t| t[0]).sum::<f64>()
                };
                of.steps.iter().enumerate().map(led).sum()
            }
            _ => of.initial_positions[3][0] - of.initial_positions[3][2],
        });
        let slopes = slopes(by, |d| {
            let mut values = values;
            values[k] += d;
            let (.., tip, force) = drag(values);
            [tip, force]
        });
        println!("{ours:?} against {slopes:?}");
        assert!(ours.iter().zip(&slopes).all(|(ours, slope)| (ours / slope - 1.0).abs() < EXACT), "{k}");
    }
}

/// What is led along a turntable, or sticks to a ball on which it has just landed, does not begin where it ends.
#[test]
fn what_sticks_to_what_turns_or_is_round_has_gradients() {
    let stuck = |on_ball: bool, shift: f64| {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let vertices = vec![[0.08, 0.2, 0.0], [-0.04, 0.2, -0.08], [-0.05, 0.2, 0.07], [0.01, 0.0, 0.02]];
        let mesh = TetMesh::new(vertices, vec![[0, 2, 1, 3]]).unwrap();
        let material = DeformableMaterial::new(5.0e4, 0.3).mass_damping(1.0).friction(2.0);
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
        let settings = settings.contact_tolerance(1e-12).keeps_spin(false);
        let body = DeformableBodyBuilder::mesh(&mesh).material(material).settings(settings).can_sleep(false);
        let body = world.insert(body.pinned(move |x| x.y > 0.1 && on_ball)).unwrap();
        let (rigid, collider) = match on_ball {
            true => (
                RigidBodyBuilder::fixed(),
                ColliderBuilder::ball(0.25).translation(Vector::new(0.05, -0.255, 0.03)),
            ),
            false => (
                RigidBodyBuilder::kinematic_velocity_based().angvel(Vector::Y * 4.0),
                ColliderBuilder::cuboid(1.0, 0.5, 1.0).translation(Vector::new(0.1, -0.5, 0.05)),
            ),
        };
        physics.insert(rigid, collider.friction(2.0));
        for vertex in world.bodies[body].pinned().collect::<Vec<_>>() {
            world.bodies[body].set_pin_velocity(vertex, Vector::Y * -0.75).unwrap();
        }
        let [x, y, z] = world.bodies[body].position(3).unwrap();
        world.bodies[body].set_position(3, [x + shift, y + 0.5 * shift, z - shift]).unwrap();
        world.bodies[body].set_linvel(Vector::Y * -0.75).unwrap();
        let mut tape = DeformableTape::new(&world, body).unwrap();
        for _ in 0..2 {
            tape.step(&mut physics, &mut world).unwrap();
        }
        let tip = world.bodies[body].position(3).unwrap();
        (tape, tip[0] + 0.5 * tip[1] + 0.25 * tip[2])
    };
    for on_ball in [true, false] {
        let (tape, _) = stuck(on_ball, 0.0);
        let mut loss = tape.loss();
        loss.add_position(1, 3, [1.0, 0.5, 0.25]).unwrap();
        let [x, y, z] = tape.backward(&loss).unwrap().initial_positions[3];
        let [slope] = slopes(2.0f64.powi(-14), |d| [stuck(on_ball, d).1]);
        let ours = x + 0.5 * y - z;
        println!("{on_ball}: {ours} against {slope}");
        assert!((ours / slope - 1.0).abs() < EXACT, "{on_ball}: {ours} {slope}");
    }
}

/// Two pads that close on a box and lift it: how its height at the end answers to the pads' stiffness, its own weight, and how fast they rise.
#[test]
fn pads_that_lift_a_box_have_gradients() {
    let lift = |[modulus, heaviness, gravity, rise]: [f64; 4]| {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::Y * gravity as f32;
        let mut world = DeformableWorld::new();
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
        let settings = settings.contact_tolerance(1e-12).keeps_spin(false);
        let material = DeformableMaterial::new(modulus, 0.3).mass_damping(1.0).friction(1.0);
        let pads = [-1.0f32, 1.0].map(|side| {
            let pad = DeformableBodyBuilder::cuboid(Vector::new(0.04, 0.05, 0.06), [2, 2, 2]);
            let pad = pad.translation(Vector::new(side * 0.142, 0.003 * side, -0.002));
            let pad = pad.pinned(move |x| x.x * side > 0.181).material(material);
            world.insert(pad.can_sleep(false).settings(settings)).unwrap()
        });
        for (pad, side) in pads.into_iter().zip([-1.0, 1.0]) {
            let body = &mut world.bodies[pad];
            for vertex in body.pinned().collect::<Vec<_>>() {
                body.set_pin_velocity(vertex, Vector::new(-side * 0.25, rise as f32, 0.0)).unwrap();
            }
        }
        let rigid = RigidBodyBuilder::dynamic().can_sleep(false);
        let collider = ColliderBuilder::cuboid(0.1, 0.08, 0.09).density(heaviness as f32).friction(1.0);
        let (rigid, _) = physics.insert(rigid, collider);
        let tape = DeformableTape::of_bodies(&world, &pads).unwrap();
        let mut tape = tape.with_rigid_bodies(&physics, &[rigid]).unwrap();
        for _ in 0..10 {
            tape.step(&mut physics, &mut world).unwrap();
        }
        (
            tape,
            rigid,
            f64::from(physics.bodies[rigid].translation().y),
            f64::from(physics.bodies[rigid].mass()),
        )
    };
    let values = [1.0e5, 128.0, -9.75, 0.25];
    let (tape, rigid, height, mass) = lift(values);
    let mut losses = tape.losses();
    losses[1].add_rigid_position(9, rigid, [0.0, 1.0, 0.0]).unwrap();
    let gradients = tape.backward_all(&losses).unwrap();
    let [box_of, ..] = &gradients[0].rigid_bodies[..] else { panic!("a rigid body") };
    let of_rise = |gradient: &DeformableGradient| {
        let steps = gradient.steps.iter().enumerate();
        steps
            .map(|(k, s)| (k + 1) as f64 / 60.0 * s.pin_targets.iter().map(|t| t[1]).sum::<f64>())
            .sum::<f64>()
    };
    let sum = |of: &dyn Fn(&DeformableGradient) -> f64| gradients.iter().map(of).sum::<f64>();
    let ours = [
        sum(&|of| of.material().youngs_modulus),
        box_of.mass * mass / 128.0,
        sum(&|of| of.gravity()[1]) + box_of.gravity()[1],
        sum(&of_rise),
    ];
    println!("height {height}");
    for (k, by) in [8192.0, 8.0, 0.5, 0.03125].into_iter().enumerate() {
        let [slope] = slopes(by, |d| {
            let mut values = values;
            values[k] += d;
            [lift(values).2]
        });
        println!("{} against {slope}", ours[k]);
        // The height of some centimetres is known to 4e-9 m.
        assert!((ours[k] - slope).abs() < EXACT * slope.abs() + 4e-9 / by, "{k}: {} {slope}", ours[k]);
        assert!(4e-9 / by < FELT * slope.abs());
    }
}

/// A block with a box on it.
struct Pair {
    physics: PhysicsWorld,
    world: DeformableWorld,
    soft: DeformableBodyHandle,
    rigid: RigidBodyHandle,
}

impl Pair {
    fn new() -> Self {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-11).max_iterations(200);
        let soft =
            block(0.125, 2).pinned(|x| x.y < -0.249).settings(settings.keeps_spin(false)).can_sleep(false);
        let soft = world.insert(soft).unwrap();
        let rigid = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.0315).can_sleep(false);
        let (rigid, _) = physics.insert(rigid, ColliderBuilder::cuboid(0.25, 0.03125, 0.25).density(512.0));
        Self { physics, world, soft, rigid }
    }

    fn tape(&self) -> DeformableTape {
        let tape = DeformableTape::new(&self.world, self.soft).unwrap();
        tape.with_rigid_bodies(&self.physics, &[self.rigid]).unwrap()
    }

    /// What is said of the first of some steps that has no gradient.
    fn refusal(&mut self) -> String {
        let mut tape = self.tape();
        let mut step = || tape.step(&mut self.physics, &mut self.world).err();
        (0..8).find_map(|_| step()).map_or_else(String::new, |error| error.to_string())
    }
}

#[test]
fn rigid_bodies_that_others_move_are_refused() {
    assert_eq!(Pair::new().refusal(), "");
    // A shelf beside the block, under the edge of the box.
    let mut pair = Pair::new();
    let shelf = ColliderBuilder::cuboid(0.05, 0.5, 0.2).translation(Vector::new(0.19, -0.5, 0.0));
    pair.physics.insert_collider(shelf, None);
    let said = pair.refusal();
    assert!(said.contains("moved by what has no gradient"), "{said}");
    let mut pair = Pair::new();
    let post = pair.physics.bodies.insert(RigidBodyBuilder::fixed());
    let joint = FixedJointBuilder::new().local_anchor1(Vector::Y * 0.03);
    pair.physics.impulse_joints.insert(post, pair.rigid, joint, true);
    assert!(pair.refusal().contains("moved by what has no gradient"));
    // One that it goes along without any force.
    let mut pair = Pair::new();
    let post = pair.physics.bodies.insert(RigidBodyBuilder::fixed());
    let rail = PrismaticJointBuilder::new(Vector::Y).local_anchor1(Vector::Y * 0.0315);
    pair.physics.impulse_joints.insert(post, pair.rigid, rail, true);
    assert!(pair.refusal().contains("moved by what has no gradient"));
    let mut pair = Pair::new();
    let other = block(0.1, 1).translation(Vector::Y * 0.3).can_sleep(false);
    pair.world.insert(other.linvel(Vector::Y * -3.0)).unwrap();
    assert!(pair.refusal().contains("not on the tape"));
    // What sleeps, and what cannot be on a tape.
    let mut pair = Pair::new();
    pair.physics.bodies[pair.rigid].sleep();
    assert!(pair.refusal().contains("sleeps"));
    let pair = Pair::new();
    let tape = || DeformableTape::new(&pair.world, pair.soft).unwrap();
    let mut physics = pair.physics;
    let fixed = physics.bodies.insert(RigidBodyBuilder::fixed());
    assert!(tape().with_rigid_bodies(&physics, &[fixed]).unwrap_err().to_string().contains("not dynamic"));
    let twice = tape().with_rigid_bodies(&physics, &[pair.rigid; 2]).unwrap_err();
    assert!(twice.to_string().contains("twice"));
    let mut loss = tape().loss();
    assert!(
        loss.add_rigid_position(0, pair.rigid, [1.0; 3]).unwrap_err().to_string().contains("not on the tape")
    );
    let mut with = tape().with_rigid_bodies(&physics, &[pair.rigid]).unwrap();
    assert!(with.record(&physics, &pair.world).unwrap_err().to_string().contains("by itself"));
}

/// What the user does to a rigid body between steps takes part, and checkpoints lead to the same bits.
#[test]
fn checkpoints_and_impulses_between_steps_take_part() {
    let control = |step: usize, physics: &mut PhysicsWorld, push: f32| {
        let (handle, body) = physics.bodies.iter_mut().next().unwrap();
        if step == 3 {
            body.apply_impulse(Vector::X * push, true);
            body.add_torque(Vector::Y * 0.25, true);
        }
        handle
    };
    let go = |every: Option<usize>, push: f32| {
        let mut pair = Pair::new();
        let mut tape = pair.tape();
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        for step in 0..8 {
            control(step, &mut pair.physics, push);
            tape.step(&mut pair.physics, &mut pair.world).unwrap();
        }
        let body = &pair.physics.bodies[pair.rigid];
        (tape, pair.rigid, f64::from(body.translation().x), f64::from(body.mass()))
    };
    let (tape, rigid, _, mass) = go(None, 0.0);
    let loss = |tape: &DeformableTape| {
        let mut loss = tape.loss();
        loss.add_rigid_position(7, rigid, [1.0, 0.0, 0.0]).unwrap();
        loss
    };
    let gradient = tape.backward(&loss(&tape)).unwrap();
    for every in [1, 3] {
        let (tape, ..) = go(Some(every), 0.0);
        let replay = |step: usize, physics: &mut PhysicsWorld, _: &mut DeformableWorld| {
            control(step, physics, 0.0);
        };
        assert_eq!(tape.replay(&loss(&tape), replay).unwrap(), gradient);
    }
    // Per newton second at the third step.
    let ours = gradient.rigid_bodies[0].steps[3].linvel[0] / mass;
    let [slope] = slopes(1.0 / 32.0, |d| [go(None, d as f32).2]);
    assert!((ours / slope - 1.0).abs() < EXACT, "{ours} {slope}");
}
