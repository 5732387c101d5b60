//! The scene in rapier's own soft bodies, as nearly as it can tell them.
//!
//! Solids have the same meshes, masses and moduli. Sheets and ropes of rapier's have no modulus: their edges are springs
//! of a frequency, at its default, and only their shape and mass are ours. A flag's grid is of squares with diagonals.

use crate::scene::{Form, Scene, Soft, bound};
use crate::shared::rapier_body;
use rapier3d::prelude::*;

pub fn insert(scene: &Scene, physics: &mut PhysicsWorld, rigid: &[RigidBodyHandle]) -> Vec<SoftBodyHandle> {
    let mut insert = |soft: &Soft| {
        let (builder, rest) = builder(soft);
        let (held, ties) = bound(soft, &rest);
        let builder = builder
            .linear_damping(soft.damping as f32)
            .can_sleep(scene.sleeps && soft.can_sleep)
            // The shape is the body's own surface.
            .surface_collider(ColliderBuilder::ball(0.02).density(0.0).friction(0.5))
            .pinned_particles(held.iter().map(|&v| v as u32));
        let handle = physics.insert_soft_body(builder);
        (0..rest.len()).for_each(|v| physics.soft_bodies[handle].set_particle_velocity(v, soft.velocity));
        for (v, to) in ties {
            physics.soft_bodies[handle].attach_particle(v, rigid[to], &physics.bodies);
        }
        handle
    };
    scene.soft.iter().map(&mut insert).collect()
}

/// With its places at rest.
fn builder(soft: &Soft) -> (SoftBodyBuilder, Vec<[f64; 3]>) {
    const DENSITY: f32 = 1000.0;
    let place = |p: &Vector| soft.pose.transform_point(*p);
    match &soft.form {
        Form::Solid(mesh) => (rapier_body(mesh, soft.pose, soft.e, soft.nu), mesh.vertices().to_vec()),
        Form::Cloth([x, z], [nx, nz], thickness) => {
            let (du, dv) = (Vector::X * (2.0 * x / *nx as f32), Vector::Z * (2.0 * z / *nz as f32));
            let origin = Vector::new(-x, 0.0, -z);
            let sheet = SoftBodyBuilder::cloth(origin, du, dv, nx + 1, nz + 1);
            let rest = sheet.particle_positions().to_vec();
            let mass = DENSITY * 4.0 * x * z * thickness;
            let builder = sheet.positions(rest.iter().map(place).collect()).mass(mass);
            (builder.particle_radius(*thickness), doubles(&rest))
        }
        Form::Rope(points, radius) => {
            let links: Vec<[u32; 2]> = (1..points.len() as u32).map(|k| [k - 1, k]).collect();
            let bends = (2..points.len() as u32).map(|k| [k - 2, k]).collect();
            let length: f32 = points.windows(2).map(|p| (p[1] - p[0]).length()).sum();
            let builder = SoftBodyBuilder::new(points.iter().map(place).collect())
                .edges(links.clone())
                .bend_edges(bends)
                .wire(links)
                .particle_radius(*radius)
                .mass(DENSITY * std::f32::consts::PI * radius * radius * length);
            (builder, doubles(points))
        }
    }
}

fn doubles(points: &[Vector]) -> Vec<[f64; 3]> {
    points.iter().map(|p| p.to_array().map(f64::from)).collect()
}
