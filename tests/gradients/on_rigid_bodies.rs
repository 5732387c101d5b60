//! Gradients over steps of deformable bodies that touch rigid ones that yield, against central differences between whole runs. Rapier is in
//! `f32`: what is changed is changed by powers of two, by so much that its last places do not count.

use crate::differences::{nearest, slopes, strict, weight};
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
pub const EXACT: f64 = 1e-3;
/// Part of a derivative that rounding may be, or its differences say nothing.
pub const FELT: f64 = 0.02;

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

/// What a run begins with.
struct Start {
    physics: PhysicsWorld,
    world: DeformableWorld,
    soft: DeformableBodyHandle,
    rigid: RigidBodyHandle,
    collider: ColliderHandle,
    shifted: usize,
}

impl Scene {
    fn start(&self, run: &Run) -> Start {
        let [modulus, density, heaviness, gravity, friction, along, down, spin, x, y, turn, low, lead] =
            run.values;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::Y * gravity as f32;
        let mut world = DeformableWorld::new();
        let settings = strict();
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
        let shifted = nearest(body, [0.12, -0.125, 0.01]);
        let at = body.position(shifted).unwrap();
        body.set_position(shifted, [at[0] + low, at[1] - 0.5 * low, at[2] - low]).unwrap();
        for vertex in body.pinned().collect::<Vec<_>>() {
            body.set_pin_velocity(vertex, Vector::new(lead as f32, 0.0, 0.5 * lead as f32)).unwrap();
        }
        Start { physics, world, soft, rigid, collider, shifted }
    }

    fn run(&self, run: &Run) -> Outcome {
        let Start { mut physics, mut world, soft, rigid, collider, shifted } = self.start(run);
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
        let mass = f64::from(physics.bodies[rigid].mass()) / run.values[2];
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

pub fn block(half: f32, cells: usize) -> DeformableBodyBuilder {
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

/// Corners of a box stand on triangles of the block, and edges of that go across its edges and corners.
fn on_block(place: [f32; 2], turn: f32, cells: usize) -> Scene {
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(place[0], 0.0632, place[1]));
    let (soft, shape) = (block(0.25, cells), SharedShape::cuboid(0.1, 0.0625, 0.07));
    Scene { soft, shape, rigid: rigid.rotation(Vector::Y * turn), stride: 0.25, ..plate() }
}

#[test]
fn a_box_on_a_block_has_gradients() {
    check(&on_block([0.02, -0.03], 0.1, 5), &run(1.0, 0.0, -0.5), &WITHOUT_FRICTION, 11);
    check(&on_block([0.01, 0.0], 0.2, 4), &run(0.25, 1.0, -0.5), &ALL, 9);
}

/// Open contacts took turns with themselves in a step of 31 of these 32, and no iteration ended it.
#[test]
fn boxes_that_fall_on_a_block_with_friction_are_solved_in_every_step() {
    for friction in [0.5, 1.0] {
        for (x, z) in [(0.01, 0.0), (0.01, 0.05), (0.06, 0.0), (0.06, 0.05)] {
            for turn in [0.2, 0.5] {
                let scene = on_block([x, z], turn, 5);
                // A step without a gradient is an error there.
                for (along, down) in [(0.0, -0.125), (0.5, -0.5)] {
                    assert_eq!(scene.run(&run(friction, along, down)).tape.len(), 12);
                }
            }
        }
    }
}

/// Four pyramids, on whose tips something round touches nothing but these.
pub fn tips() -> DeformableBodyBuilder {
    let (mut vertices, mut tetrahedra) = (Vec::new(), Vec::new());
    for [x, z] in [[-0.15, -0.1], [0.12, -0.13], [0.14, 0.11], [-0.11, 0.14]] {
        let first = vertices.len() as u32;
        let base = [[0.08, 0.0], [-0.04, -0.08], [-0.05, 0.07]];
        vertices.extend(base.map(|[u, w]| [x + u, -0.25, z + w]));
        vertices.push([x, 0.0, z]);
        tetrahedra.push([first, first + 1, first + 2, first + 3]);
    }
    let mesh = TetMesh::new(vertices, tetrahedra).unwrap();
    DeformableBodyBuilder::mesh(&mesh)
}

fn on_tips(shape: SharedShape, turn: Vector, height: f32) -> Scene {
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(0.02, height, 0.01)).rotation(turn);
    Scene { soft: tips(), shape, rigid, density: 16.0, rounding: 2e-7, ..plate() }
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
