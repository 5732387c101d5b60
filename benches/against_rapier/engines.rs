//! The same bodies in either engine.

use crate::shared::rapier_body;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

#[derive(Clone, Copy, PartialEq)]
pub enum Engine {
    Foible,
    Rapier(&'static str),
}

impl Engine {
    pub const ALL: [Engine; 4] =
        [Engine::Foible, Engine::Rapier("default"), Engine::Rapier("fem"), Engine::Rapier("fem tuned")];

    pub fn names(self) -> (&'static str, &'static str) {
        match self {
            Engine::Foible => ("foible3d", "default"),
            Engine::Rapier(setting) => ("rapier", setting),
        }
    }

    /// Rapier's implicit solver, which takes minutes.
    pub fn is_implicit(self) -> bool {
        matches!(self, Engine::Rapier(setting) if setting != "default")
    }
}

/// A body of a scene, for either engine.
#[derive(Clone)]
pub struct Item {
    pub half: [f64; 3],
    pub cells: [usize; 3],
    pub at: [f32; 3],
    pub turn: Vector,
    pub e: f64,
    pub nu: f64,
    /// 1/s.
    pub damping: f64,
    pub clamped: bool,
}

impl Item {
    pub fn mesh(&self) -> TetMesh {
        TetMesh::cuboid(self.half, self.cells).expect("a valid lattice")
    }

    pub fn tets(&self) -> usize {
        5 * self.cells.iter().product::<usize>()
    }

    fn is_clamped(&self, rest: [f64; 3]) -> bool {
        self.clamped && rest[0] < -self.half[0] + 1e-6
    }

    pub fn is_tip(&self, rest: [f64; 3]) -> bool {
        rest[0] > self.half[0] - 1e-6
    }
}

#[derive(Default)]
pub struct Outcome {
    pub median: f64,
    pub worst: f64,
    pub tips: Vec<f64>,
    pub lowest: f64,
    pub deepest: f64,
    /// Upward force of the floor over the weight.
    pub force: f64,
    /// Of `DeformableWorld::prepare`, before the first step \[ms\].
    pub prepared: f64,
    pub finite: bool,
}

impl Outcome {
    /// Median and worst of the times of its steps \[ms\].
    fn of(times: Vec<f64>) -> Self {
        // Without a floor the first step makes the factor: counted in the worst, not in the median.
        let worst = times.iter().copied().fold(0.0, f64::max);
        let mut sorted = times;
        sorted.sort_by(f64::total_cmp);
        Self { median: sorted[sorted.len() / 2], worst, ..Self::default() }
    }
}

pub fn run(engine: Engine, items: &[Item], floor: bool, steps: usize) -> Outcome {
    match engine {
        Engine::Foible => run_foible(items, floor, steps),
        Engine::Rapier(setting) => run_rapier(setting, items, floor, steps),
    }
}

fn world(floor: bool) -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    if floor {
        let body = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        physics.insert(body, ColliderBuilder::cuboid(20.0, 0.5, 20.0).friction(0.5));
    }
    physics
}

fn run_foible(items: &[Item], floor: bool, steps: usize) -> Outcome {
    let mut physics = world(floor);
    let mut world = DeformableWorld::new();
    let handles: Vec<_> = items
        .iter()
        .map(|item| {
            let left = item.at[0] - item.half[0] as f32 + 1e-5;
            let clamped = item.clamped;
            let builder = DeformableBodyBuilder::mesh(&item.mesh())
                .can_sleep(false)
                .translation(item.at.into())
                .rotation(item.turn)
                .material(DeformableMaterial::new(item.e, item.nu).mass_damping(item.damping))
                .pinned(move |x| clamped && x.x < left);
            world.insert(builder).expect("a valid body")
        })
        .collect();
    let (mut times, mut deepest, mut lowest_ever) = (Vec::new(), 0.0f64, 0.0f64);
    // As a user would while loading: factors, and columns where there is a floor to touch.
    let start = Instant::now();
    if floor {
        world.prepare(&physics).expect("a valid step");
    }
    let prepared = start.elapsed().as_secs_f64() * 1e3;
    for _ in 0..steps {
        let start = Instant::now();
        world.step(&mut physics);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if floor {
            let lowest = handles
                .iter()
                .flat_map(|h| world.bodies[*h].positions())
                .map(|p| p.y)
                .fold(f32::MAX, f32::min);
            deepest = f64::from(lowest.abs());
            lowest_ever = lowest_ever.max(f64::from(-lowest));
        }
    }
    let tips = items.iter().zip(&handles).map(|(item, h)| {
        let body = &world.bodies[*h];
        let tip: Vec<f64> = (0..body.vertex_count())
            .filter(|&v| item.is_tip(body.model().rest_position(v)))
            .map(|v| body.position(v).map_or(f64::NAN, |p| p[1]))
            .collect();
        tip.iter().sum::<f64>() / tip.len() as f64
    });
    let weight: f64 = handles.iter().map(|h| world.bodies[*h].mass() * f64::from(9.81f32)).sum();
    let force: f64 = world.contacts().iter().map(|c| f64::from(c.force.y)).sum();
    Outcome {
        tips: tips.collect(),
        lowest: lowest_ever,
        deepest,
        force: force / weight,
        prepared,
        finite: handles.iter().all(|h| world.bodies[*h].is_enabled()),
        ..Outcome::of(times)
    }
}

fn run_rapier(setting: &str, items: &[Item], floor: bool, steps: usize) -> Outcome {
    let mut physics = world(floor);
    if setting == "fem tuned" {
        physics.integration_parameters.num_solver_iterations = 1;
        physics.integration_parameters.soft_bodies.fem.max_linear_iterations = 400;
    }
    let handles: Vec<_> = items
        .iter()
        .map(|item| {
            let mesh = item.mesh();
            let pose = Pose::new(item.at.into(), item.turn);
            let rest = |v: u32| mesh.vertices()[v as usize];
            let mut builder = rapier_body(&mesh, pose, item.e, item.nu)
                .linear_damping(item.damping as f32)
                .solver(if setting == "default" { SoftBodySolver::default() } else { SoftBodySolver::Fem })
                .pinned_particles((0..mesh.vertices().len() as u32).filter(|&v| item.is_clamped(rest(v))));
            if floor {
                builder = builder.surface_collider(ColliderBuilder::ball(0.05).density(0.0).friction(0.5));
            } else {
                builder = builder.no_surface_collider();
            }
            physics.insert_soft_body(builder)
        })
        .collect();
    let (mut times, mut lowest_ever, mut deepest) = (Vec::new(), 0.0f64, 0.0f64);
    for _ in 0..steps {
        let start = Instant::now();
        physics.step();
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if floor {
            let lowest = handles
                .iter()
                .flat_map(|h| physics.soft_bodies[*h].particle_positions())
                .map(|p| p.y)
                .fold(f32::MAX, f32::min);
            deepest = f64::from(lowest.abs());
            lowest_ever = lowest_ever.max(f64::from(-lowest));
        }
    }
    let tips = items.iter().zip(&handles).map(|(item, h)| {
        let rest = item.mesh();
        let tip: Vec<f64> = physics.soft_bodies[*h]
            .particle_positions()
            .zip(rest.vertices())
            .filter(|(_, r)| item.is_tip(**r))
            .map(|(p, _)| f64::from(p.y))
            .collect();
        tip.iter().sum::<f64>() / tip.len() as f64
    });
    let tips: Vec<f64> = tips.collect();
    let finite = tips.iter().all(|t| t.is_finite());
    Outcome { tips, lowest: lowest_ever, deepest, force: f64::NAN, finite, ..Outcome::of(times) }
}
