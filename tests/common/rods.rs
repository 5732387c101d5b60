//! Rods that are held against roll.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::f64::consts::PI;

pub const RADIUS: f64 = 0.01;

/// Along x, `n` segments, without Poisson's ratio: EI = GJ.
pub fn straight(length: f64, n: usize) -> Vec<[f64; 3]> {
    (0..=n).map(|k| [length * k as f64 / n as f64, 0.0, 0.0]).collect()
}

pub fn clamped(length: f64, n: usize, modulus: f64) -> DeformableBodyBuilder {
    let edge = length / n as f64;
    let near = move |x: f64| x < 1.01 * edge || x > length - 1.01 * edge;
    let material = DeformableMaterial::new(modulus, 0.0).mass_damping(2.0);
    let rod = DeformableBodyBuilder::structure(&Structure::rod(&straight(length, n), RADIUS).unwrap());
    rod.material(material)
        .pinned(move |x| near(x.x.into()))
        .gravity_scale(0.0)
        .can_sleep(false)
        .tune(|s| s.tolerance = 1.0e-10)
}

pub fn world() -> (PhysicsWorld, DeformableWorld) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = 1.0 / 100.0;
    (physics, DeformableWorld::new())
}

/// How far a rod along x is from its axis at the most \[m\].
pub fn aside(body: &DeformableBody) -> f64 {
    body.positions().map(|x| f64::from(x.y).hypot(x.z.into())).fold(0.0, f64::max)
}

/// A disc on the end of a wire that hangs from the world.
pub struct Pendulum {
    pub physics: PhysicsWorld,
    pub deformables: DeformableWorld,
    pub wire: DeformableBodyHandle,
    pub disc: RigidBodyHandle,
}

/// A wire of half a metre and 2 mm, 0.4 N·m/rad·m of GJ, and a disc of 1 kg: 2.5e-3 kg m² about the wire.
pub const STIFFNESS: f64 = 0.8;
pub const INERTIA: f64 = 2.5e-3;

pub fn pendulum(dt: f32, solver: Solver) -> Pendulum {
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
    pub fn step(&mut self) {
        self.deformables.step(&mut self.physics);
    }

    /// How far the disc is turned about the wire, whole turns and all, from the wire's top.
    pub fn turned(&self) -> f64 {
        self.deformables.bodies[self.wire].twist(0).unwrap().unwrap()
    }
}
