//! Rods that are held against roll, against closed forms.

mod common;

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::f64::consts::PI;

const RADIUS: f64 = 0.01;

/// Along x, `n` segments, without Poisson's ratio: EI = GJ.
fn straight(length: f64, n: usize) -> Vec<[f64; 3]> {
    (0..=n).map(|k| [length * k as f64 / n as f64, 0.0, 0.0]).collect()
}

fn clamped(length: f64, n: usize, modulus: f64) -> DeformableBodyBuilder {
    let edge = length / n as f64;
    let near = move |x: f64| x < 1.01 * edge || x > length - 1.01 * edge;
    let material = DeformableMaterial::new(modulus, 0.0).mass_damping(2.0);
    let rod = DeformableBodyBuilder::structure(&Structure::rod(&straight(length, n), RADIUS).unwrap());
    rod.material(material).pinned(move |x| near(x.x.into())).gravity_scale(0.0).can_sleep(false).tune(|s| s.tolerance = 1.0e-10)
}

fn world() -> (PhysicsWorld, DeformableWorld) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = 1.0 / 100.0;
    (physics, DeformableWorld::new())
}

/// How far from its axis \[m\] a clamped rod of 1 m ends that is a millimetre off at first, and twisted by `share` of what buckles
/// it [Greenhill 1883].
fn sideways(share: f64, n: usize) -> f64 {
    let (mut physics, mut deformables) = world();
    // Clamped in the middles of its outermost edges: a vertex bends over half of each of its edges.
    let free = 1.0 - 1.0 / n as f64;
    let critical = 8.9868 / free;
    let mut rod = clamped(1.0, n, 1.0e8).hold_twist(0, share * critical).build().unwrap();
    let middle = n / 2;
    rod.set_position(middle, [0.5, 1.0e-3, 0.0]).unwrap();
    let rod = deformables.bodies.insert_body(rod);
    for _ in 0..600 {
        deformables.step(&mut physics);
    }
    aside(&deformables.bodies[rod])
}

/// How far a rod along x is from its axis at the most \[m\].
fn aside(body: &DeformableBody) -> f64 {
    body.positions().map(|x| f64::from(x.y).hypot(x.z.into())).fold(0.0, f64::max)
}

#[test]
fn clamped_rods_buckle_at_greenhills_torque() {
    for n in [20, 40] {
        let (below, above) = (sideways(0.97, n), sideways(1.03, n));
        println!("{n} segments: {below:.1e} m aside at 0.97 of it, {above:.1e} at 1.03");
        assert!(below < 1.0e-5 && above > 5.0e-4, "{below} {above}");
    }
}

/// How far from its plane \[m\] a straight rod ends that is bent to a ring of 1 m, a millimetre off at first, and twisted by `share` of what
/// buckles it, 2π√3·EI/GJ [Michell 1889].
fn out_of_plane(share: f64, n: usize) -> f64 {
    let (mut physics, mut deformables) = world();
    // The last segment lies on the first.
    let edge = 1.0 / n as f64;
    // So thin that its bend hardly shortens it: where it is clamped it would be bent otherwise, and leave its plane for that.
    let rod = Structure::rod(&straight(1.0 + edge, n + 1), 1.0e-3).unwrap();
    let material = DeformableMaterial::new(1.0e10, 0.0).mass_damping(2.0);
    let rod = DeformableBodyBuilder::structure(&rod).material(material).gravity_scale(0.0).can_sleep(false);
    let mut rod = rod.tune(|s| s.tolerance = 1.0e-10).build().unwrap();
    let radius = 0.5 * edge / (PI / n as f64).sin();
    let at = |k: usize| {
        let angle = 2.0 * PI * k as f64 / n as f64;
        [radius * angle.cos(), radius * angle.sin(), 0.0]
    };
    rod.set_positions(&(0..n + 2).map(at).collect::<Vec<_>>()).unwrap();
    for vertex in [0, 1, n, n + 1] {
        rod.pin(vertex).unwrap();
    }
    rod.hold_twist(0, share * 2.0 * PI * 3.0_f64.sqrt() * (1.0 + edge)).unwrap();
    let x = at(n / 2);
    rod.set_position(n / 2, [x[0], x[1], 1.0e-3]).unwrap();
    let rod = deformables.bodies.insert_body(rod);
    for _ in 0..600 {
        deformables.step(&mut physics);
    }
    deformables.bodies[rod].positions().map(|x| f64::from(x.z).abs()).fold(0.0, f64::max)
}

#[test]
fn rings_buckle_at_michells_twist() {
    for n in [20, 40] {
        let (below, above) = (out_of_plane(0.97, n), out_of_plane(1.03, n));
        println!("{n} segments: {below:.1e} m aside at 0.97 of it, {above:.1e} at 1.03");
        // What is left of the millimetre is below the rounding of forces of 1e10 Pa.
        assert!(below < 3.0e-4 && above > 3.0e-2, "{below} {above}");
    }
}

/// A disc on the end of a wire that hangs from the world.
struct Pendulum {
    physics: PhysicsWorld,
    deformables: DeformableWorld,
    wire: DeformableBodyHandle,
    disc: RigidBodyHandle,
}

/// A wire of half a metre and 2 mm, 0.4 N·m/rad·m of GJ, and a disc of 1 kg: 2.5e-3 kg m² about the wire.
const STIFFNESS: f64 = 0.8;
const INERTIA: f64 = 2.5e-3;

fn pendulum(dt: f32, solver: Solver) -> Pendulum {
    let (mut physics, mut deformables) = world();
    physics.integration_parameters.dt = dt;
    physics.gravity = Vector::new(0.0, -9.81, 0.0);
    let points: Vec<[f64; 3]> = (0..=10).map(|k| [0.0, 0.5 - 0.05 * f64::from(k), 0.0]).collect();
    let radius = 2.0e-3_f64;
    // GJ/l of it.
    let modulus = STIFFNESS * 0.5 * 2.0 / (0.5 * PI * radius.powi(4));
    let wire = DeformableBodyBuilder::structure(&Structure::rod(&points, radius).unwrap()).can_sleep(false);
    let wire = wire.material(DeformableMaterial::new(modulus, 0.0)).pinned(|x| x.y > 0.44).hold_twist(0, 0.0);
    let wire = deformables.insert(wire.tune(|s| s.solver = solver)).unwrap();
    let disc = RigidBodyBuilder::dynamic().can_sleep(false).additional_mass_properties(MassProperties::new(
        Vector::ZERO,
        1.0,
        Vector::new(1.3e-3, INERTIA as f32, 1.3e-3),
    ));
    let disc = physics.insert_body(disc);
    let to = AttachTo::RigidBody(disc, *physics.bodies[disc].position());
    deformables.bodies.attach(wire, &[9, 10], to).unwrap();
    Pendulum { physics, deformables, wire, disc }
}

impl Pendulum {
    fn step(&mut self) {
        self.deformables.step(&mut self.physics);
    }

    /// How far the disc is turned about the wire, whole turns and all, from the wire's top.
    fn turned(&self) -> f64 {
        self.deformables.bodies[self.wire].twist(0).unwrap().unwrap()
    }
}

#[test]
fn torsion_pendulums_swing_by_their_period() {
    let period = 2.0 * PI * (INERTIA / STIFFNESS).sqrt();
    for solver in [Solver::Newton, Solver::Projective, Solver::Xpbd] {
        let mut pendulum = pendulum(1.0e-3, solver);
        pendulum.physics.bodies[pendulum.disc].set_angvel(Vector::new(0.0, 20.0, 0.0), true);
        let mut crossings = Vec::new();
        let (mut last, mut most) = (0.0, 0.0_f64);
        for step in 0..1500 {
            pendulum.step();
            let now = pendulum.turned();
            most = most.max(now.abs());
            if last < 0.0 && now >= 0.0 || last > 0.0 && now <= 0.0 {
                crossings.push((step as f64 + last / (last - now)) * 1.0e-3);
            }
            last = now;
        }
        let measured = 2.0 * (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
        // Started at 20 rad/s: that over its frequency, less what implicit Euler takes in a quarter of a period.
        let swing = 20.0 * period / (2.0 * PI);
        println!("{solver:?}: a period of {measured:.5} s ({period:.5}), swings by {most:.3} rad ({swing:.3})");
        assert!((measured / period - 1.0).abs() < 2.0e-3, "{measured} {period}");
        assert!((most / swing - 1.0).abs() < 0.03, "{most} {swing}");
    }
}

#[test]
fn discs_hang_where_their_torque_leaves_them() {
    for dt in [1.0 / 240.0, 1.0 / 60.0, 1.0 / 20.0] {
        let mut pendulum = pendulum(dt, Solver::Newton);
        pendulum.physics.bodies[pendulum.disc].add_torque(Vector::new(0.0, 6.0, 0.0), true);
        pendulum.physics.bodies[pendulum.disc].set_angular_damping(8.0);
        let steps = (4.0 / dt) as usize;
        (0..steps).for_each(|_| pendulum.step());
        let body = &pendulum.deformables.bodies[pendulum.wire];
        let (turned, torque) = (pendulum.turned(), body.twist_torque(0).unwrap());
        println!("dt {dt:.4}: turned by {turned:.6} rad, torque {torque:.6}");
        // More than a turn; the wire points down, so that it is turned back about −y.
        assert!((turned.abs() - 6.0 / STIFFNESS).abs() < 1.0e-3 * 6.0 / STIFFNESS, "{turned}");
        assert!((torque.abs() - 6.0).abs() < 6.0e-3, "{torque}");
    }
}
