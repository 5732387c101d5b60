//! The scenes, and how they are run and measured.

use crate::methods::{Choice, Method};
use crate::shared::median;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

#[derive(Clone, Copy, PartialEq)]
pub enum Measure {
    /// The path of what is watched.
    Path,
    /// Where it ends.
    End,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A bar clamped at one end; `twist` \[rad\] is laid into it and let go, without gravity then; `pull` \[N\] at
    /// its end, without gravity too.
    Bar { half: [f64; 3], cells: [usize; 3], twist: f64, pull: f32 },
    /// A cube falls on the floor.
    Drop { cells: usize },
    /// A square sheet on two of its corners.
    Cloth { cells: usize },
    /// A rope on one end.
    Rope { segments: usize },
    /// Two pads on moving carriers close on a box and lift it.
    Grasp { cells: usize },
}

#[derive(Clone)]
pub struct Scene {
    pub name: String,
    pub kind: Kind,
    pub material: DeformableMaterial,
    pub dt: f32,
    pub steps: usize,
    pub measure: Measure,
    /// Tetrahedra smoothed over edges and nodes.
    pub smoothed: bool,
}

/// What a run leaves.
#[derive(Clone, Default)]
pub struct Record {
    /// Mean position of what is watched after each step \[m\].
    pub path: Vec<[f64; 3]>,
    /// The first one.
    pub start: [f64; 3],
    pub times: Vec<f64>,
    pub volume_error: f64,
    /// Of the floor against the weight, at the end.
    pub force_error: f64,
    /// Deepest penetration of the floor ever \[m\].
    pub deepest: f64,
}

impl Record {
    pub fn median(&self) -> f64 {
        median(self.times.clone())
    }

    /// The first step makes the factor: it is left out.
    pub fn worst(&self) -> f64 {
        self.times[1..].iter().copied().fold(0.0, f64::max)
    }

    pub fn error(&self, truth: &Record, measure: Measure) -> f64 {
        let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        let scale = truth.path.iter().map(|p| distance(p, &truth.start)).fold(0.0, f64::max).sqrt();
        let squares: Vec<f64> = self.path.iter().zip(&truth.path).map(|(a, b)| distance(a, b)).collect();
        let square = match measure {
            Measure::Path => squares.iter().sum::<f64>() / squares.len() as f64,
            Measure::End => squares.last().copied().unwrap_or(f64::NAN),
        };
        square.sqrt() / scale
    }
}

pub fn scenes() -> Vec<Scene> {
    let mut scenes = bars();
    scenes.extend(falling_and_hanging());
    scenes
}

/// A slender bar that swings for 1.5 s; the others are this one but for what they say.
fn slender(name: &str, twist: f64, e: f64) -> Scene {
    Scene {
        name: name.into(),
        kind: Kind::Bar { half: [0.5, 0.05, 0.05], cells: [20, 2, 2], twist, pull: 0.0 },
        material: DeformableMaterial::new(e, 0.3),
        dt: 1.0 / 60.0,
        steps: 90,
        measure: Measure::Path,
        smoothed: false,
    }
}

fn bars() -> Vec<Scene> {
    let stretched = |nu: f64| Scene {
        name: format!("stretched block ν {nu}"),
        kind: Kind::Bar { half: [0.25, 0.1, 0.1], cells: [10, 4, 4], twist: 0.0, pull: 800.0 },
        material: DeformableMaterial::new(1e5, nu).mass_damping(5.0).elasticity(Elasticity::NeoHookean),
        dt: 1.0 / 60.0,
        steps: 60,
        measure: Measure::Path,
        smoothed: false,
    };
    vec![
        Scene::cantilever("sagging cantilever", [32, 5, 5], 1e6, 0.3, Measure::End),
        slender("swinging cantilever", 0.0, 1e6),
        slender("stiff swinging cantilever", 0.0, 1e7),
        slender("twisted bar", std::f64::consts::PI, 1e6),
        stretched(0.3),
        stretched(0.45),
        stretched(0.49),
    ]
}

fn falling_and_hanging() -> Vec<Scene> {
    let soft = DeformableMaterial::new(1e5, 0.3);
    let cloth = DeformableMaterial::new(1e6, 0.3).density(400.0);
    vec![
        Scene {
            name: "drop and rest".into(),
            kind: Kind::Drop { cells: 6 },
            material: soft,
            steps: 120,
            ..slender("", 0.0, 1.0)
        },
        Scene {
            name: "pinned cloth".into(),
            kind: Kind::Cloth { cells: 20 },
            material: cloth,
            ..slender("", 0.0, 1.0)
        },
        Scene {
            name: "cloth at rest".into(),
            kind: Kind::Cloth { cells: 20 },
            material: cloth.mass_damping(4.0),
            steps: 360,
            measure: Measure::End,
            ..slender("", 0.0, 1.0)
        },
        Scene {
            name: "swinging rope".into(),
            kind: Kind::Rope { segments: 60 },
            material: DeformableMaterial::new(1e8, 0.3),
            ..slender("", 0.0, 1.0)
        },
        Scene {
            name: "grasp".into(),
            kind: Kind::Grasp { cells: 5 },
            material: soft.friction(0.8),
            steps: 120,
            ..slender("", 0.0, 1.0)
        },
    ]
}

impl Scene {
    /// A beam of 1 × 0.2 × 0.2 m under its own weight: let go, or damped to rest.
    pub fn cantilever(name: &str, cells: [usize; 3], e: f64, nu: f64, measure: Measure) -> Self {
        let (damping, steps) = if measure == Measure::End { (8.0, 180) } else { (0.0, 90) };
        Self {
            name: name.into(),
            kind: Kind::Bar { half: [0.5, 0.1, 0.1], cells, twist: 0.0, pull: 0.0 },
            material: DeformableMaterial::new(e, nu).mass_damping(damping),
            dt: 1.0 / 60.0,
            steps,
            measure,
            smoothed: false,
        }
    }

    /// Tetrahedra, triangles or segments.
    pub fn tets(&self) -> usize {
        match &self.kind {
            Kind::Bar { cells, .. } => 5 * cells.iter().product::<usize>(),
            Kind::Drop { cells } => 5 * cells.pow(3),
            Kind::Grasp { cells } => 10 * cells.pow(3),
            Kind::Cloth { cells } => (2 * cells + 1) * cells,
            Kind::Rope { segments } => *segments,
        }
    }

    fn builder(&self) -> DeformableBodyBuilder {
        let builder = match &self.kind {
            Kind::Bar { half, cells, .. } => {
                let left = -half[0] as f32 + 1e-5;
                DeformableBodyBuilder::cuboid(Vector::from(half.map(|h| h as f32)), *cells)
                    .pinned(move |x| x.x < left)
            }
            Kind::Drop { cells } => {
                DeformableBodyBuilder::cuboid(Vector::splat(0.2), [*cells; 3]).translation(Vector::Y * 0.5)
            }
            Kind::Cloth { cells } => DeformableBodyBuilder::cloth([0.5, 0.5], [*cells; 2], 1e-3)
                .pinned(|x| x.x.abs() > 0.499 && x.z < -0.499),
            Kind::Rope { segments } => {
                let points: Vec<Vector> =
                    (0..=*segments).map(|k| Vector::X * (k as f32 / *segments as f32)).collect();
                DeformableBodyBuilder::rope(&points, 2e-3).pinned(|x| x.x < 1e-4)
            }
            Kind::Grasp { cells } => DeformableBodyBuilder::cuboid(Vector::splat(0.05), [*cells; 3]),
        };
        let builder = builder.material(self.material).can_sleep(false);
        if self.smoothed { builder.smoothed() } else { builder }
    }

    /// Whether a point of the rest shape is watched.
    pub fn watches(&self, p: [f64; 3]) -> bool {
        match &self.kind {
            // Of a twisted bar one corner: its end's middle stays where it is.
            Kind::Bar { half, twist, .. } => {
                p[0] > half[0] - 1e-6 && (*twist == 0.0 || (p[1] > half[1] - 1e-6 && p[2] > half[2] - 1e-6))
            }
            Kind::Drop { .. } => true,
            Kind::Cloth { .. } => p[2] > 0.499,
            Kind::Rope { .. } => p[0] > 0.9999,
            Kind::Grasp { .. } => false,
        }
    }

    /// The shape that is laid into a body of this rest shape.
    pub fn laid(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match &self.kind {
            Kind::Bar { half, twist, .. } if *twist != 0.0 => {
                let (s, c) = (twist * (x + half[0]) / (2.0 * half[0])).sin_cos();
                [x, c * y - s * z, s * y + c * z]
            }
            _ => [x, y, z],
        }
    }

    /// The world without the bodies.
    pub fn world(&self) -> PhysicsWorld {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = self.dt;
        match &self.kind {
            Kind::Drop { .. } => {
                let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
                physics.insert(floor, ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5));
            }
            Kind::Bar { twist, pull, .. } if *twist != 0.0 || *pull != 0.0 => {
                physics.gravity = Vector::ZERO;
            }
            _ => {}
        }
        physics
    }

    pub fn run(&self, method: &Method) -> Record {
        if let Kind::Grasp { .. } = self.kind {
            return self.run_grasp(method);
        }
        let mut physics = self.world();
        let mut world = DeformableWorld::new();
        let body = world.insert(chosen(self.builder(), method)).expect("a valid body");
        let deformable = &mut world.bodies[body];
        let count = deformable.vertex_count();
        let watched: Vec<usize> =
            (0..count).filter(|&v| self.watches(deformable.model().rest_position(v))).collect();
        if let Kind::Bar { twist, pull, .. } = self.kind {
            if twist != 0.0 {
                for v in 0..count {
                    let p = self.laid(deformable.model().rest_position(v));
                    deformable.set_position(v, p).expect("a number");
                }
            }
            deformable.add_force(&watched, Vector::X * pull).expect("a number");
        }
        let mut record = Record { start: middle(&world.bodies[body], &watched), ..Record::default() };
        let volume = world.bodies[body].volume();
        world.prepare(&physics).expect("a valid step");
        for _ in 0..self.steps {
            let start = Instant::now();
            world.step(&mut physics);
            record.times.push(start.elapsed().as_secs_f64() * 1e3);
            let body = &world.bodies[body];
            record.path.push(middle(body, &watched));
            if let Kind::Drop { .. } = self.kind {
                let lowest = body.positions().map(|p| p.y).fold(f32::MAX, f32::min);
                record.deepest = record.deepest.max(f64::from(-lowest));
            }
        }
        let body = &world.bodies[body];
        record.volume_error = if volume > 0.0 { (body.volume() / volume - 1.0).abs() } else { 0.0 };
        if let Kind::Drop { .. } = self.kind {
            let force: f64 = world.contacts().iter().map(|c| f64::from(c.force.y)).sum();
            record.force_error = (force / (body.mass() * f64::from(9.81f32)) - 1.0).abs();
        }
        record
    }

    /// The box is watched.
    fn run_grasp(&self, method: &Method) -> Record {
        let mut stage = Grasp::new(self);
        let mut world = DeformableWorld::new();
        for (carrier, side) in stage.carriers {
            let pad = self.builder().translation(Grasp::pad(side));
            let pad = world.insert(chosen(pad, method)).expect("a valid body");
            let back = world.bodies[pad].vertices_where(|x| x.x.abs() > Grasp::BACK);
            let on = AttachTo::RigidBody(carrier, *stage.physics.bodies[carrier].position());
            world.bodies.attach(pad, &back, on).expect("surface vertices");
        }
        stage.run(self, |physics| world.step(physics))
    }
}

/// A box on a table between two carriers.
pub struct Grasp {
    pub physics: PhysicsWorld,
    load: RigidBodyHandle,
    pub carriers: [(RigidBodyHandle, f32); 2],
}

impl Grasp {
    /// Beyond this the pads are attached \[m\].
    pub const BACK: f32 = 0.1549;

    pub fn new(scene: &Scene) -> Self {
        let mut physics = scene.world();
        let table = RigidBodyBuilder::fixed().translation(Vector::Y * -0.1);
        physics.insert(table, ColliderBuilder::cuboid(0.03, 0.05, 0.03).friction(0.8));
        let load = RigidBodyBuilder::dynamic().can_sleep(false);
        let collider = ColliderBuilder::cuboid(0.05, 0.05, 0.05).density(800.0).friction(0.8);
        let (load, _) = physics.insert(load, collider);
        let carriers = [-1.0f32, 1.0].map(|side| {
            let at = Vector::X * (side * 0.18);
            let carrier = RigidBodyBuilder::kinematic_position_based().translation(at);
            let collider = ColliderBuilder::cuboid(0.02, 0.06, 0.06).sensor(true);
            (physics.insert(carrier, collider).0, side)
        });
        Self { physics, load, carriers }
    }

    /// Where the middle of a pad is at the start.
    pub fn pad(side: f32) -> Vector {
        Vector::X * (side * 0.105)
    }

    pub fn run(&mut self, scene: &Scene, mut advance: impl FnMut(&mut PhysicsWorld)) -> Record {
        let mut record = Record::default();
        for step in 0..scene.steps {
            // Close within a third of a second, then lift.
            let t = (step + 1) as f32 * scene.dt;
            let (close, lift) = (0.02 * (3.0 * t).min(1.0), 0.1 * (t - 0.5).clamp(0.0, 1.0));
            for (carrier, side) in self.carriers {
                let at = Vector::new(side * (0.18 - close), lift, 0.0);
                self.physics.bodies[carrier].set_next_kinematic_translation(at);
            }
            let start = Instant::now();
            advance(&mut self.physics);
            record.times.push(start.elapsed().as_secs_f64() * 1e3);
            let p = self.physics.bodies[self.load].translation();
            record.path.push(p.to_array().map(f64::from));
        }
        record
    }
}

fn chosen(builder: DeformableBodyBuilder, method: &Method) -> DeformableBodyBuilder {
    match method.choice {
        Choice::Preset(fidelity) => builder.fidelity(fidelity),
        Choice::Own(settings) => builder.settings(settings),
    }
}

fn middle(body: &DeformableBody, vertices: &[usize]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &v in vertices {
        let p = body.position(v).unwrap_or([f64::NAN; 3]);
        (0..3).for_each(|k| sum[k] += p[k] / vertices.len() as f64);
    }
    sum
}
