//! Gradients with rigid bodies, beside `on_rigid_bodies.rs`: of what touches those that do not yield, what pads lift, which steps are refused, and what
//! is done to rigid bodies between steps.

use crate::differences::{slopes, strict};
use crate::on_rigid_bodies::{EXACT, FELT, block, tips};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Steps of [`drag`].
const STEPS: usize = 12;

/// A pyramid that is led along and drags its tip over a ball that stands: the tape, the ball, the place of the tip, and the force on it.
fn drag([modulus, friction, lead, shift]: [f64; 4]) -> (DeformableTape, ColliderHandle, f64, f64) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let vertices = vec![[0.08, 0.25, 0.0], [-0.04, 0.25, -0.08], [-0.05, 0.25, 0.07], [-0.08, 0.0, 0.0]];
    let mesh = TetMesh::new(vertices, vec![[0, 2, 1, 3]]).unwrap();
    let material = DeformableMaterial::new(modulus, 0.3).mass_damping(1.0).friction(friction);
    let settings = strict();
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
}

/// As normals turn, so does the force.
#[test]
fn a_tip_that_is_dragged_over_a_fixed_ball_has_gradients() {
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
        let settings = strict();
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

/// Two pads that close on a box and lift it, for ten steps: the tape, the box, its height at the end and its mass.
fn lift([modulus, heaviness, gravity, rise]: [f64; 4]) -> (DeformableTape, RigidBodyHandle, f64, f64) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::Y * gravity as f32;
    let mut world = DeformableWorld::new();
    let settings = strict();
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
    (tape, rigid, f64::from(physics.bodies[rigid].translation().y), f64::from(physics.bodies[rigid].mass()))
}

/// How its height answers to the pads' stiffness, its own weight, and how fast they rise.
#[test]
fn pads_that_lift_a_box_have_gradients() {
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

/// A plate with a ball beside its middle lands four metres from the origin, where `f32` keeps 2e-7 m of x, and another body of the tape falls freely.
#[test]
fn a_body_of_two_colliders_far_from_the_origin_has_gradients() {
    let run = |[heaviness, down, spin]: [f64; 3]| {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        physics.gravity = Vector::Y * -9.75;
        let settings = strict();
        let material = DeformableMaterial::new(5.0e4, 0.3).mass_damping(1.0).friction(1.0);
        let soft = tips().translation(Vector::X * 4.0).pinned(|x| x.y < -0.249).material(material);
        let soft = world.insert(soft.settings(settings).can_sleep(false)).unwrap();
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(4.02, 0.051, 0.01)).can_sleep(false);
        let body = body.linvel(Vector::Y * down as f32).angvel(Vector::Z * spin as f32);
        let plate = ColliderBuilder::cuboid(0.5, 0.05, 0.4).density(heaviness as f32).friction(1.0);
        let (body, _) = physics.insert(body, plate);
        let ball = ColliderBuilder::ball(0.06).translation(Vector::new(0.03, 0.1, 0.02)).density(512.0);
        physics.insert_collider(ball, Some(body));
        let other = RigidBodyBuilder::dynamic().translation(Vector::Y * 5.0);
        let (other, _) = physics.insert(other, ColliderBuilder::ball(0.1));
        let tape = DeformableTape::new(&world, soft).unwrap();
        let mut tape = tape.with_rigid_bodies(&physics, &[other, body]).unwrap();
        for _ in 0..8 {
            tape.step(&mut physics, &mut world).unwrap();
        }
        let height = f64::from(physics.bodies[body].center_of_mass().y);
        (tape, [other, body], height)
    };
    let values = [16.0, -0.5, 0.0625];
    let (tape, [other, body], _) = run(values);
    let mut loss = tape.loss();
    loss.add_rigid_position(7, body, [0.0, 1.0, 0.0]).unwrap();
    loss.add_rigid_position(7, other, [0.0, 1.0, 0.0]).unwrap();
    let gradient = tape.backward(&loss).unwrap();
    let [of_other, of_body] = &gradient.rigid_bodies[..] else { panic!("two rigid bodies") };
    // Eight steps of four substeps.
    assert!((of_other.initial_linvel[1] - 8.0 / 60.0).abs() < 1e-6 && of_other.mass == 0.0);
    assert!((of_other.gravity()[1] - (28.0 + 8.0 * 0.625) / 3600.0).abs() < 1e-8);
    let ours = [of_body.initial_linvel[1], of_body.initial_angvel[2]];
    for (k, by) in [(1, 1.0 / 256.0), (2, 1.0 / 64.0)] {
        let [slope] = slopes(by, |d| {
            let mut values = values;
            values[k] += d;
            [run(values).2]
        });
        println!("{} against {slope}", ours[k - 1]);
        assert!(
            (ours[k - 1] - slope).abs() < EXACT * slope.abs() + 1e-8 / by,
            "{k}: {} {slope}",
            ours[k - 1]
        );
        assert!(4e-8 / by < FELT * slope.abs());
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
