//! The same scenes with rapier's own soft bodies: solids on the same meshes with the same material, cloth and
//! rope with as many particles and the same mass, at the softness that they have by default, as they know no
//! Young's modulus.

use crate::scenes::{Grasp, Kind, Record, Scene};
use crate::shared::rapier_body;
use foible3d::prelude::{Elasticity, TetMesh};
use rapier3d::prelude::*;
use std::time::Instant;

pub const SETTINGS: [&str; 2] = ["default", "fem tuned"];

/// `None` for what a solver is not made for: the implicit one is of solids.
pub fn run(scene: &Scene, setting: &str) -> Option<Record> {
    if let Kind::Grasp { cells } = scene.kind {
        return Some(run_grasp(scene, cells, setting));
    }
    let (builder, rest) = builder(scene, setting)?;
    let mut physics = scene.world();
    tune(&mut physics, setting);
    let body = physics.insert_soft_body(builder);
    let watched: Vec<usize> = (0..rest.len()).filter(|&v| scene.watches(rest[v])).collect();
    if let Kind::Bar { twist, pull, .. } = scene.kind {
        let soft = &mut physics.soft_bodies[body];
        if twist != 0.0 {
            for (v, p) in rest.iter().enumerate() {
                soft.set_particle_position(v, Vector::from(scene.laid(*p).map(|c| c as f32)));
            }
        }
        let share = Vector::X * (pull / watched.len() as f32);
        watched.iter().for_each(|&v| soft.add_particle_force(v, share, true));
    }
    let middle = |physics: &PhysicsWorld| {
        let at = |&v: &usize| physics.soft_bodies[body].particle_position(v);
        let sum = watched.iter().map(at).fold([0.0; 3], |s, p| [0, 1, 2].map(|k| s[k] + f64::from(p[k])));
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
        if let Kind::Drop { .. } = scene.kind {
            let heights = physics.soft_bodies[body].particle_positions().map(|p| p.y);
            record.deepest = record.deepest.max(f64::from(-heights.fold(f32::MAX, f32::min)));
        }
    }
    Some(record)
}

/// The soft body of a scene, and its particles at rest.
fn builder(scene: &Scene, setting: &str) -> Option<(SoftBodyBuilder, Vec<[f64; 3]>)> {
    let is_fem = setting != "default";
    Some(match scene.kind {
        Kind::Bar { half, cells, .. } => {
            let mesh = TetMesh::cuboid(half, cells).ok()?;
            let held = |v: &u32| mesh.vertices()[*v as usize][0] < -half[0] + 1e-6;
            let pinned = (0..mesh.vertices().len() as u32).filter(held);
            let builder = solid(scene, &mesh, Vector::ZERO, setting).pinned_particles(pinned);
            (builder.no_surface_collider(), mesh.vertices().to_vec())
        }
        Kind::Drop { cells } => {
            let mesh = TetMesh::cuboid([0.2; 3], [cells; 3]).ok()?;
            let builder = solid(scene, &mesh, Vector::Y * 0.5, setting);
            (builder.surface_collider(skin(0.5)), mesh.vertices().to_vec())
        }
        Kind::Cloth { cells } if !is_fem => {
            let (edge, n) = (1.0 / cells as f32, cells + 1);
            let origin = Vector::new(-0.5, 0.0, -0.5);
            let builder = SoftBodyBuilder::cloth(origin, Vector::X * edge, Vector::Z * edge, n, n);
            let mass = scene.material.density as f32 * 1e-3 / (n * n) as f32;
            // Particle (i, j) is number i n + j: the corners of least z.
            let builder = builder.particle_mass(mass).pinned_particles([0, (cells * n) as u32]);
            thin(scene, builder)
        }
        Kind::Rope { segments } if !is_fem => {
            let builder = SoftBodyBuilder::rope(Vector::ZERO, Vector::X, segments + 1);
            let volume = std::f32::consts::PI * 2e-3 * 2e-3;
            let mass = scene.material.density as f32 * volume / (segments + 1) as f32;
            thin(scene, builder.particle_mass(mass).pinned_particles([0]))
        }
        _ => return None,
    })
}

pub fn tune(physics: &mut PhysicsWorld, setting: &str) {
    if setting != "default" {
        physics.integration_parameters.num_solver_iterations = 1;
        physics.integration_parameters.soft_bodies.fem.max_linear_iterations = 400;
    }
}

/// A solid with the scene's material, at a place.
fn solid(scene: &Scene, mesh: &TetMesh, at: Vector, setting: &str) -> SoftBodyBuilder {
    let material = scene.material;
    let pose = Pose::from_translation(at);
    let builder = rapier_body(mesh, pose, material.youngs_modulus, material.poisson_ratio)
        .linear_damping(material.mass_damping as f32)
        .solver(if setting == "default" { SoftBodySolver::default() } else { SoftBodySolver::Fem });
    match material.elasticity {
        Elasticity::NeoHookean => builder.cell_model(SoftBodyCellModel::NeoHookean),
        _ => builder,
    }
}

fn thin(scene: &Scene, builder: SoftBodyBuilder) -> (SoftBodyBuilder, Vec<[f64; 3]>) {
    let rest = builder.particle_positions().iter().map(|p| p.to_array().map(f64::from)).collect();
    let builder = builder.linear_damping(scene.material.mass_damping as f32).can_sleep(false);
    (builder.no_surface_collider(), rest)
}

fn skin(friction: f32) -> ColliderBuilder {
    ColliderBuilder::ball(0.05).density(0.0).friction(friction)
}

fn run_grasp(scene: &Scene, cells: usize, setting: &str) -> Record {
    let mut stage = Grasp::new(scene);
    tune(&mut stage.physics, setting);
    let mesh = TetMesh::cuboid([0.05; 3], [cells; 3]).expect("a valid lattice");
    for (carrier, side) in stage.carriers {
        let pad = solid(scene, &mesh, Grasp::pad(side), setting).surface_collider(skin(0.8));
        let physics = &mut stage.physics;
        let pad = physics.insert_soft_body(pad);
        let soft = &mut physics.soft_bodies[pad];
        for v in 0..soft.num_particles() {
            if soft.particle_position(v).x.abs() > Grasp::BACK {
                soft.attach_particle(v, carrier, &physics.bodies);
            }
        }
    }
    Record { force_error: f64::NAN, volume_error: f64::NAN, ..stage.run(scene, |physics| physics.step()) }
}
