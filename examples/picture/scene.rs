//! A heavy plate and a crate fall on two soft cubes, and a softer one on top of them.

use crate::render::{Color, Paint, Soup};
use foible3d::prelude::*;
use rapier3d::parry::shape::{Cone, Cylinder};
use rapier3d::prelude::*;

const RATE: f32 = 120.0;
const GREY: Paint = Paint { color: Color::new(0.38, 0.40, 0.43), edges: 0.0 };
const ARROW: Paint = Paint { color: Color::new(0.55, 0.0, 0.03), edges: 0.0 };
/// Length of an arrow per newton \[m\], and the least upward force that is drawn \[N\].
const METRES_PER_NEWTON: f32 = 1.6e-2;
const LEAST_FORCE: f32 = 0.3;

/// Everything in motion, with the colours of the soft bodies.
pub struct Stack {
    physics: PhysicsWorld,
    world: DeformableWorld,
    paints: Vec<(DeformableBodyHandle, Paint)>,
    rigid: Vec<(ColliderHandle, Vector)>,
}

impl Stack {
    pub fn new() -> Result<Self, DeformableBodyError> {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = 1.0 / RATE;
        let ground = RigidBodyBuilder::fixed().translation(Vector::NEG_Y * 0.5);
        physics.insert(ground, ColliderBuilder::cuboid(4.0, 0.5, 4.0).friction(0.9));
        let mut rigid = Vec::new();
        for (half, at, density) in [
            (Vector::new(0.27, 0.018, 0.13), Vector::new(0.0, 0.33, 0.0), 4500.0),
            (Vector::splat(0.075), Vector::new(0.0, 0.47, 0.0), 2500.0),
        ] {
            let body = RigidBodyBuilder::dynamic().translation(at);
            let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density(density).friction(0.6);
            rigid.push((physics.insert(body, shape).1, half));
        }
        let mut world = DeformableWorld::new();
        let rubber =
            DeformableMaterial::new(4.0e4, 0.4).density(1000.0).friction(0.9).stiffness_damping(1e-2);
        let jelly =
            DeformableMaterial::new(2.0e4, 0.45).density(1000.0).friction(0.9).stiffness_damping(1e-2);
        let cube = || DeformableBodyBuilder::cuboid(Vector::splat(0.1), [6, 6, 6]).material(rubber);
        let top = DeformableBodyBuilder::cuboid(Vector::splat(0.06), [5, 5, 5]).material(jelly);
        let top = top.rotation(Vector::Y * 0.5);
        let paint = |r, g, b| Paint { color: Color::new(r, g, b), edges: 0.28 };
        let mut paints = Vec::new();
        for (body, at, paint) in [
            (cube(), Vector::new(-0.15, 0.14, 0.0), paint(0.02, 0.42, 0.45)),
            (cube(), Vector::new(0.15, 0.14, 0.0), paint(0.80, 0.16, 0.08)),
            (top, Vector::new(0.0, 0.65, 0.0), paint(0.90, 0.55, 0.05)),
        ] {
            paints.push((world.insert(body.translation(at))?, paint));
        }
        Ok(Self { physics, world, paints, rigid })
    }

    pub fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds * RATE).round() as usize {
            self.world.step(&mut self.physics);
        }
    }

    /// Fastest vertex of the soft bodies \[m/s\].
    pub fn speed(&self) -> f64 {
        self.world.bodies.iter().map(|(_, body)| body.max_speed()).fold(0.0, f64::max)
    }

    /// Adds what is there now to a picture, aside by `offset`.
    pub fn draw(&self, offset: Vector, solids: &mut Soup, arrows: &mut Soup) {
        for (handle, paint) in &self.paints {
            let body = &self.world.bodies[*handle];
            solids.add(body.positions().map(|x| x + offset), body.model().surface_triangles(), *paint);
        }
        for (handle, half) in &self.rigid {
            let pose = *self.physics.colliders[*handle].position();
            let (vertices, triangles) = Cuboid::new(*half).to_trimesh();
            solids.add(vertices.into_iter().map(|x| pose * x + offset), triangles, GREY);
        }
        for contact in self.world.contacts().iter().filter(|c| c.force.y > LEAST_FORCE) {
            draw_arrow(arrows, contact.point + offset, contact.force * METRES_PER_NEWTON);
        }
    }
}

fn draw_arrow(soup: &mut Soup, from: Vector, along: Vector) {
    let (length, radius) = (along.length(), 0.0022);
    let head = (6.0 * radius).min(0.5 * length);
    let turn = Rotation::from_rotation_arc(Vector::Y, along / length);
    let shaft = 0.5 * (length - head);
    for ((vertices, triangles), height) in [
        (Cylinder::new(shaft, radius).to_trimesh(10), shaft),
        (Cone::new(0.5 * head, 2.6 * radius).to_trimesh(12), length - 0.5 * head),
    ] {
        soup.add(vertices.into_iter().map(|x| from + turn * (x + Vector::Y * height)), triangles, ARROW);
    }
}
