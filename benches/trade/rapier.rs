//! The same scenes with rapier's own soft bodies, where it has such.

use crate::scenes::{Kind, Record, Scene};
use crate::shared::rapier_body;
use foible3d::prelude::TetMesh;
use rapier3d::prelude::*;
use std::time::Instant;

pub const SETTINGS: [&str; 2] = ["default", "fem tuned"];

/// `None` for sheets, ropes and grasps, whose counterparts there have no Young's modulus, or need contacts that
/// its solvers do not hold, and for twists, which are laid into particles that cannot be set.
pub fn run(scene: &Scene, setting: &str) -> Option<Record> {
    let (half, cells, at, clamp, pull) = match scene.kind {
        Kind::Bar { half, cells, twist: 0.0, pull } => (half, cells, Vector::ZERO, true, pull),
        Kind::Drop { cells } => ([0.2; 3], [cells; 3], Vector::Y * 0.5, false, 0.0),
        _ => return None,
    };
    // Forces on single particles are not part of its interface.
    if pull != 0.0 {
        return None;
    }
    let mut physics = scene.world();
    if setting == "fem tuned" {
        physics.integration_parameters.num_solver_iterations = 1;
        physics.integration_parameters.soft_bodies.fem.max_linear_iterations = 400;
    }
    let mesh = TetMesh::cuboid(half, cells).ok()?;
    let held = |v: &u32| clamp && mesh.vertices()[*v as usize][0] < -half[0] + 1e-6;
    let material = scene.material;
    let builder =
        rapier_body(&mesh, Pose::from_translation(at), material.youngs_modulus, material.poisson_ratio)
            .linear_damping(material.mass_damping as f32)
            .solver(if setting == "default" { SoftBodySolver::default() } else { SoftBodySolver::Fem })
            .pinned_particles((0..mesh.vertices().len() as u32).filter(held));
    let is_drop = matches!(scene.kind, Kind::Drop { .. });
    let builder = match is_drop {
        true => builder.surface_collider(ColliderBuilder::ball(0.05).density(0.0).friction(0.5)),
        false => builder.no_surface_collider(),
    };
    let body = physics.insert_soft_body(builder);
    let middle = |physics: &PhysicsWorld| {
        let particles = physics.soft_bodies[body].particle_positions().zip(mesh.vertices());
        let watched: Vec<Vector> =
            particles.filter(|(_, rest)| scene.watches(**rest)).map(|(p, _)| p).collect();
        let sum = watched.iter().fold([0.0; 3], |s, p| [0, 1, 2].map(|k| s[k] + f64::from(p[k])));
        sum.map(|s| s / watched.len() as f64)
    };
    let mut record = Record {
        start: middle(&physics),
        force_error: f64::NAN,
        volume_error: f64::NAN,
        ..Record::default()
    };
    for _ in 0..scene.steps {
        let start = Instant::now();
        physics.step();
        record.times.push(start.elapsed().as_secs_f64() * 1e3);
        record.path.push(middle(&physics));
        if is_drop {
            let lowest = physics.soft_bodies[body].particle_positions().map(|p| p.y).fold(f32::MAX, f32::min);
            record.deepest = record.deepest.max(f64::from(-lowest));
        }
    }
    Some(record)
}
