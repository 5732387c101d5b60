//! Rods that are held against roll: turns, energy, momenta, snapshots, statics.

use crate::common::rods::{RADIUS, aside, clamped, pendulum, world};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::f64::consts::PI;

/// A motor that winds a cord up, turn after turn.
#[test]
fn whole_turns_of_led_ends_are_counted() {
    let (mut physics, mut deformables) = world();
    let chuck = physics.insert_body(RigidBodyBuilder::kinematic_velocity_based().translation(Vector::X));
    let cord = clamped(1.0, 10, 1.0e6).pinned(|x| x.x < 0.11).hold_twist(0, 0.0);
    let cord = deformables.insert(cord).unwrap();
    let to = AttachTo::RigidBody(chuck, *physics.bodies[chuck].position());
    deformables.bodies.attach(cord, &[9, 10], to).unwrap();
    physics.bodies[chuck].set_angvel(Vector::new(2.0 * PI as f32, 0.0, 0.0), true);
    let stiffness = |deformables: &DeformableWorld| {
        let body = &deformables.bodies[cord];
        body.twist_torque(0).unwrap() / body.twist(0).unwrap().unwrap()
    };
    for _ in 0..300 {
        deformables.step(&mut physics);
    }
    let twist = deformables.bodies[cord].twist(0).unwrap().unwrap();
    let turned = f64::from(physics.bodies[chuck].rotation().to_scaled_axis().x);
    let turned = turned - 2.0 * PI * (turned / (2.0 * PI)).round();
    println!("wound up by {:.6} turns, the chuck beyond them by {turned:.2e} rad", twist / (2.0 * PI));
    // Rapier's angles are of single precision.
    assert!((twist - 6.0 * PI - turned).abs() < 1.0e-5 && turned.abs() < 1.0e-3, "{twist} {turned}");
    assert!((stiffness(&deformables) / (5.0e5 * 0.5 * PI * 1.0e-8) - 1.0).abs() < 1.0e-9);
    // Let go, it is free of twist; held again, it is so from there.
    let body = &mut deformables.bodies[cord];
    body.release_twist(0).unwrap();
    assert_eq!((body.twist(0).unwrap(), body.twist_torque(0).unwrap()), (None, 0.0));
    body.hold_twist(0, 0.5).unwrap();
    assert!((body.twist(0).unwrap().unwrap() - 0.5).abs() < 1.0e-12);
}

/// No stiffness, step, twist or solver makes energy of it: what is there at first, and no more, undamped and with itself to touch.
#[test]
fn twisted_rods_gain_no_energy_at_the_extremes() {
    let mut worst = (f64::NEG_INFINITY, String::new());
    for modulus in [1.0e3, 1.0e6, 1.0e9] {
        for dt in [1.0e-3, 1.0 / 60.0, 0.1] {
            for turns in [1.0, 10.0, 100.0] {
                for solver in [Solver::Newton, Solver::Projective, Solver::Xpbd] {
                    for iterations in [1, 10] {
                        for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
                            let case = format!(
                                "{modulus:.0e} Pa, {dt:.3} s, {turns} turns, {solver:?}, {iterations}, {integrator:?}"
                            );
                            let gain = gain(modulus, dt, turns, (solver, iterations, integrator));
                            assert!(gain.is_finite(), "{case}: {gain}");
                            if gain > worst.0 {
                                worst = (gain, case);
                            }
                        }
                    }
                }
            }
        }
    }
    println!("{:.2e} of the energy at most: {}", worst.0, worst.1);
    assert!(worst.0 < 1.0e-6, "{worst:?}");
}

/// Largest gain of energy over its start, as part of that.
fn gain(
    modulus: f64,
    dt: f32,
    turns: f64,
    (solver, iterations, integrator): (Solver, usize, Integrator),
) -> f64 {
    let (mut physics, mut deformables) = world();
    physics.integration_parameters.dt = dt;
    let rod = clamped(1.0, 12, modulus).material(DeformableMaterial::new(modulus, 0.3)).self_contact(true);
    let rod = rod.hold_twist(0, 2.0 * PI * turns).tune(|s| {
        *s = s.solver(solver).max_iterations(iterations).integrator(integrator);
    });
    let mut rod = rod.build().unwrap();
    rod.set_position(6, [0.5, 0.01, 0.005]).unwrap();
    let start = rod.kinetic_energy() + rod.elastic_energy();
    // Of what position-based dynamics leaves unsolved the strain tells another energy than the constraints hold.
    let elastic = if solver == Solver::Xpbd { 0.0 } else { 1.0 };
    let energy = |body: &DeformableBody| body.kinetic_energy() + elastic * body.elastic_energy();
    let rod = deformables.bodies.insert_body(rod);
    let mut most = f64::NEG_INFINITY;
    for _ in 0..60 {
        deformables.step(&mut physics);
        let now = energy(&deformables.bodies[rod]);
        most = if now.is_finite() { most.max(now / start - 1.0) } else { f64::INFINITY };
    }
    most
}

/// A twisted ring in flight has nothing outside to turn it: it keeps its momenta while it buckles.
#[test]
fn twisted_rings_keep_their_momenta() {
    let (mut physics, mut deformables) = world();
    let at = |k: usize| {
        let angle = 2.0 * PI * k as f64 / 24.0;
        [0.2 * angle.cos(), 0.2 * angle.sin(), 0.004 * (3.0 * angle).sin()]
    };
    let ring = Structure::ring(&(0..24).map(at).collect::<Vec<_>>(), RADIUS).unwrap();
    let ring = DeformableBodyBuilder::structure(&ring).material(DeformableMaterial::new(1.0e6, 0.3));
    let ring =
        ring.hold_twist(0, 30.0).linvel(Vector::new(0.3, 0.1, -0.2)).angvel(Vector::new(0.0, 1.0, 2.0));
    let ring = deformables.insert(ring.can_sleep(false)).unwrap();
    let momenta = |deformables: &DeformableWorld| {
        let body = &deformables.bodies[ring];
        [body.linear_momentum(), body.angular_momentum()]
    };
    let before = momenta(&deformables);
    for _ in 0..300 {
        deformables.step(&mut physics);
    }
    let flat = |deformables: &DeformableWorld| {
        let pose = deformables.bodies[ring].pose();
        deformables.bodies[ring]
            .positions()
            .map(|x| pose.inverse_transform_point(x).z.abs())
            .fold(0.0, f32::max)
    };
    println!("{:?} {:?}, out of its plane by {:.3} m", before, momenta(&deformables), flat(&deformables));
    assert!(flat(&deformables) > 0.02);
    for (was, is) in before.iter().flatten().zip(momenta(&deformables).iter().flatten()) {
        assert!((was - is).abs() < 1.0e-6, "{was} {is}");
    }
}

#[test]
fn snapshots_teleports_and_sleep_keep_the_twist() {
    let mut pendulum = pendulum(0.01, Solver::Newton);
    pendulum.physics.bodies[pendulum.disc].set_angvel(Vector::new(0.0, 30.0, 0.0), true);
    (0..10).for_each(|_| pendulum.step());
    let (bodies, physics) = (pendulum.deformables.bodies.clone(), pendulum.physics.bodies.clone());
    (0..10).for_each(|_| pendulum.step());
    let first = pendulum.deformables.bodies[pendulum.wire].state().clone();
    let turned = pendulum.turned();
    pendulum.deformables.bodies = bodies;
    pendulum.physics.bodies = physics;
    (0..10).for_each(|_| pendulum.step());
    assert!(pendulum.turned() == turned && *pendulum.deformables.bodies[pendulum.wire].state() == first);

    let (mut physics, mut deformables) = world();
    let rod = clamped(1.0, 10, 1.0e6).hold_twist(0, 3.0).can_sleep(true).build().unwrap();
    let rod = deformables.bodies.insert_body(rod);
    for _ in 0..200 {
        deformables.step(&mut physics);
    }
    let body = &mut deformables.bodies[rod];
    assert!(body.is_sleeping());
    let turn = Pose::new(Vector::new(1.0, 2.0, 3.0), Vector::new(0.3, -1.2, 0.8));
    body.teleport(turn).unwrap();
    assert!(!body.is_sleeping());
    deformables.step(&mut physics);
    let body = &mut deformables.bodies[rod];
    assert!((body.twist(0).unwrap().unwrap() - 3.0).abs() < 1.0e-9);
    let error = body.hold_twist(1, 0.0).unwrap_err().to_string();
    assert!(error.contains("rod 1 does not exist: the body has 1"), "{error}");
    assert!(body.hold_twist(0, f64::NAN).unwrap_err().to_string().contains("roll"));
    assert!(body.twist(7).is_err() && body.twist_torque(7).is_err() && body.release_twist(7).is_err());
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1, 1, 1]);
    assert!(cube.hold_twist(0, 0.0).build().is_err());
}

/// Statics finds what dynamics comes to: a rod twisted beyond what buckles it.
#[test]
fn rest_is_found_of_buckled_rods() {
    let found = |statics: bool| {
        let (mut physics, mut deformables) = world();
        let mut rod = clamped(1.0, 20, 1.0e8).hold_twist(0, 12.0).build().unwrap();
        rod.set_position(10, [0.5, 1.0e-3, 0.0]).unwrap();
        let rod = deformables.bodies.insert_body(rod);
        if statics {
            let rest = deformables.find_rest(&mut physics, 1.0e-8, 400);
            assert!(rest.is_found, "{rest:?}");
        } else {
            (0..2000).for_each(|_| deformables.step(&mut physics));
        }
        let body = &deformables.bodies[rod];
        (aside(body), body.elastic_energy())
    };
    let (rest, motion) = (found(true), found(false));
    println!("aside and energy: found {rest:?}, in time {motion:?}");
    assert!((rest.0 - motion.0).abs() < 1.0e-3 * motion.0 && (rest.1 - motion.1).abs() < 1.0e-6 * motion.1);
}

/// Two rods from one vertex on, held by 1 and −2 rad, and their points.
fn fork() -> (DeformableBodyBuilder, Vec<[f64; 3]>) {
    let mut points: Vec<[f64; 3]> = (0..=8).map(|k| [0.1 * f64::from(k), 0.0, 0.0]).collect();
    let aside: Vec<[f64; 3]> = points.iter().skip(1).map(|x| [x[0], 0.3, 0.0]).collect();
    let two = Structure::rod(&points, RADIUS).unwrap().rod_from(0, &aside, RADIUS).unwrap();
    points.extend(aside);
    let rods = DeformableBodyBuilder::structure(&two).material(DeformableMaterial::new(1.0e7, 0.3));
    (rods.hold_twist(0, 1.0).hold_twist(1, -2.0).can_sleep(false), points)
}

fn twists(deformables: &DeformableWorld, rods: DeformableBodyHandle) -> [f64; 2] {
    [0, 1].map(|rod| deformables.bodies[rods].twist(rod).unwrap().unwrap())
}

fn dynamic(x: f32, y: f32, inertia: f32) -> RigidBodyBuilder {
    let mass = MassProperties::new(Vector::ZERO, 1.0, Vector::splat(inertia));
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, y, 0.0)).can_sleep(false);
    body.additional_mass_properties(mass)
}

/// A frame that carries all of two rods turns as a whole, and their twist stays.
#[test]
fn both_ends_may_be_on_one_body() {
    let (mut physics, mut deformables) = world();
    let rods = deformables.insert(fork().0).unwrap();
    assert_eq!(twists(&deformables, rods), [1.0, -2.0]);
    let frame = physics.insert_body(dynamic(0.0, 0.0, 0.05));
    let to = AttachTo::RigidBody(frame, *physics.bodies[frame].position());
    deformables.bodies.attach(rods, &(0..17).collect::<Vec<_>>(), to).unwrap();
    physics.bodies[frame].set_angvel(Vector::new(2.0, 1.0, -0.5), true);
    // The rods start still.
    deformables.step(&mut physics);
    for _ in 0..100 {
        deformables.step(&mut physics);
        let [one, other] = twists(&deformables, rods);
        assert!((one - 1.0).abs() < 1.0e-3 && (other + 2.0).abs() < 1.0e-3, "{one} {other}");
    }
}

/// On a link of a multibody, and on a body that is taken away: no step panics, and both untwist.
#[test]
fn ends_may_be_on_links_and_on_what_goes() {
    let (mut physics, mut deformables) = world();
    let (rods, points) = fork();
    let rods = deformables.insert(rods.pinned(|x| x.x < 0.15 && x.y < 0.1)).unwrap();
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let bodies = [0.0, 0.3].map(|y| physics.insert_body(dynamic(0.8, y, 1.0e-3)));
    let hinge = RevoluteJointBuilder::new(Vector::X).local_anchor1(Vector::new(0.8, 0.0, 0.0));
    physics.multibody_joints.insert(base, bodies[0], hinge, true).unwrap();
    for (k, ends) in [[7, 8], [15, 16]].iter().enumerate() {
        assert!((points[ends[1]][0] - 0.8).abs() < 1.0e-9);
        let to = AttachTo::RigidBody(bodies[k], *physics.bodies[bodies[k]].position());
        deformables.bodies.attach(rods, ends, to).unwrap();
    }
    for step in 0..200 {
        if step == 100 {
            physics.remove_body(bodies[1]);
        }
        deformables.step(&mut physics);
        let body = &deformables.bodies[rods];
        assert!(body.is_enabled() && body.positions().all(|x| x.is_finite()), "{step}");
    }
    println!("twists {:?}", twists(&deformables, rods));
    assert!(twists(&deformables, rods).iter().all(|twist| twist.abs() < 2.0));
}

/// A twisted ring that a free body is attached to turns nothing by itself.
#[test]
fn rings_turn_nothing_that_they_are_attached_to() {
    let (mut physics, mut deformables) = world();
    let at = |k: usize| {
        let angle = 2.0 * PI * k as f64 / 24.0;
        [0.2 * angle.cos(), 0.2 * angle.sin(), 0.0]
    };
    let ring = Structure::ring(&(0..24).map(at).collect::<Vec<_>>(), RADIUS).unwrap();
    assert!(Structure::ring(&[at(0), at(1)], RADIUS).is_err());
    let ring = DeformableBodyBuilder::structure(&ring).material(DeformableMaterial::new(1.0e7, 0.3));
    let ring = deformables.insert(ring.hold_twist(0, 3.0).can_sleep(false)).unwrap();
    let body = physics.insert_body(dynamic(0.2, 0.0, 1.0e-2));
    let to = AttachTo::RigidBody(body, *physics.bodies[body].position());
    deformables.bodies.attach(ring, &[0], to).unwrap();
    (0..100).for_each(|_| deformables.step(&mut physics));
    let spin = physics.bodies[body].angvel().length();
    println!("the body turns by {spin:.1e} rad/s");
    assert!(spin < 1.0e-3, "{spin}");
}

/// Discs at the ends of a bent rod, each held by one vertex: how far its end turns out of its disc is part of the twist, and what that
/// does to the disc keeps the angular momentum of all.
#[test]
fn ends_held_by_one_vertex_keep_the_angular_momentum() {
    let (mut physics, mut deformables) = world();
    physics.integration_parameters.dt = 1.0e-3;
    let at = |k: usize| [0.1 * k as f64, 0.02 * (k * (6 - k)) as f64, 0.0];
    let points: Vec<[f64; 3]> = (0..7).map(at).collect();
    let rod = DeformableBodyBuilder::structure(&Structure::rod(&points, 0.01).unwrap());
    let material = DeformableMaterial::new(1.0e6, 0.3).density(10.0);
    let rod = deformables.insert(rod.material(material).hold_twist(0, 0.0).can_sleep(false)).unwrap();
    let discs = [0, 6].map(|end| {
        let disc = physics.insert_body(dynamic(points[end][0] as f32, points[end][1] as f32, 2.0e-3));
        let to = AttachTo::RigidBody(disc, *physics.bodies[disc].position());
        deformables.bodies.attach(rod, &[end], to).unwrap();
        disc
    });
    // Aside of the rod's ends: their directions come to differ from what the discs hold.
    physics.bodies[discs[0]].set_angvel(Vector::new(2.0, -3.0, 6.0), true);
    let momentum = |physics: &PhysicsWorld, deformables: &DeformableWorld| {
        let mut sum = [0.0; 3];
        for body in discs.map(|disc| &physics.bodies[disc]) {
            let spin = body.angvel() * 2.0e-3 + body.translation().cross(body.linvel());
            (0..3).for_each(|k| sum[k] += f64::from(spin[k]));
        }
        let body = &deformables.bodies[rod];
        let (own, p, x) = (body.angular_momentum(), body.linear_momentum(), body.center_of_mass());
        let orbit = [x[1] * p[2] - x[2] * p[1], x[2] * p[0] - x[0] * p[2], x[0] * p[1] - x[1] * p[0]];
        (0..3).for_each(|k| sum[k] += own[k] + orbit[k]);
        sum
    };
    let start = momentum(&physics, &deformables);
    let mut off = 0.0_f64;
    for _ in 0..300 {
        deformables.step(&mut physics);
        let now = momentum(&physics, &deformables);
        off = now.iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(off, f64::max);
    }
    let twist = deformables.bodies[rod].twist(0).unwrap().unwrap();
    println!("twisted by {twist:.3} rad; {off:.1e} of {start:.3?} kg m²/s is off");
    // 1e-4 with torques about what holds the ends alone.
    assert!(off < 1.0e-5, "{off}");
}

/// Statics waits for what turns, and counts whole turns of it.
#[test]
fn rest_is_found_of_discs_that_turn() {
    for has_floor in [false, true] {
        let mut pendulum = pendulum(0.01, Solver::Newton);
        if has_floor {
            let floor = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -3.0);
            pendulum.physics.insert(RigidBodyBuilder::fixed(), floor);
        }
        pendulum.physics.bodies[pendulum.disc].add_torque(Vector::new(0.0, 6.0, 0.0), true);
        let rest = pendulum.deformables.find_rest(&mut pendulum.physics, 1.0e-8, 400);
        println!("floor {has_floor}: {rest:?}, turned by {:.6}", pendulum.turned());
        assert!(rest.is_found && (pendulum.turned().abs() - 7.5).abs() < 1.0e-3, "{}", pendulum.turned());
    }
}
