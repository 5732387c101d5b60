//! Scenes of contact, ours and rapier's: what the accuracy of contact forces costs, and what it leaves.

use crate::clock::timed;
use crate::rapier::tune;
use crate::shared::rapier_body;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

/// What is in a scene besides soft cubes.
#[derive(Clone, Copy, PartialEq)]
pub enum Beside {
    Floor,
    /// And a rigid box on the first cube, with its mass.
    Box,
    /// And four walls around.
    Walls,
    /// Two carriers of the cubes, which close on a box on a table and lift it.
    Carriers,
}

/// Soft cubes of 1000 kg/m³ that touch something.
pub struct Touch {
    pub name: &'static str,
    pub beside: Beside,
    /// Half an edge \[m\], and cells along it.
    half: f32,
    cells: usize,
    /// Centres at the start \[m\], and their velocity [m/s].
    at: Vec<Vector>,
    linvel: Vector,
    /// Pa.
    e: f64,
    friction: f32,
    pub steps: usize,
}

/// What a run leaves.
#[derive(Clone, Default)]
pub struct Touched {
    /// Of every step, the middles of all bodies that move \[m\].
    pub path: Vec<Vec<[f64; 3]>>,
    /// Of every step, what is measured of the forces \[N\]: on the bodies by the floor and walls, or of either pad on
    /// the box.
    pub force: Vec<Vec<[f64; 3]>>,
    /// Deepest penetration ever \[m\].
    pub deepest: f64,
    /// Milliseconds that the thread computed, of every step and of its contact solve.
    pub step: Vec<f64>,
    pub contact: Vec<f64>,
    /// Work of the contact solve: factorizations, sweeps and products.
    pub factorizations: usize,
    pub iterations: usize,
}

const H: f32 = 1.0 / 60.0;
/// Runs of the same bits, of whose times the least of every step counts.
const REPEATS: usize = 2;
/// Where a pad's middle is at the start, beyond what its nodes are carried, and the middle of a carrier \[m\].
const PAD: [f32; 3] = [0.105, 0.1549, 0.18];

pub fn touches() -> Vec<Touch> {
    let cube = |name, y: f32, linvel, beside| Touch {
        name,
        beside,
        half: 0.2,
        cells: 6,
        at: vec![Vector::Y * y],
        linvel,
        e: 1e5,
        friction: 0.5,
        steps: 90,
    };
    // Two by two, a layer turned against the other by its offset.
    let heap = (0..8).map(|k| {
        let (x, z, layer) = ((k % 2) as f32 - 0.5, (k / 2 % 2) as f32 - 0.5, (k / 4) as f32);
        Vector::new(0.22 * x + 0.03 * layer, 0.12 + 0.25 * layer, 0.22 * z - 0.02 * layer)
    });
    vec![
        cube("landing", 0.4, Vector::ZERO, Beside::Floor),
        cube("resting", 0.2, Vector::ZERO, Beside::Box),
        cube("sliding", 0.2, Vector::X * 2.0, Beside::Floor),
        Touch {
            half: 0.05,
            cells: 5,
            at: [-PAD[0], PAD[0]].map(|x| Vector::X * x).into(),
            friction: 0.8,
            steps: 120,
            ..cube("grasping", 0.0, Vector::ZERO, Beside::Carriers)
        },
        Touch { half: 0.1, cells: 4, at: heap.collect(), ..cube("piling", 0.0, Vector::ZERO, Beside::Walls) },
    ]
}

/// The rigid part of a scene.
struct Stage {
    physics: PhysicsWorld,
    load: Option<RigidBodyHandle>,
    carriers: Vec<(RigidBodyHandle, f32)>,
}

impl Stage {
    fn new(scene: &Touch) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = H;
        let mut stage = Self { physics, load: None, carriers: Vec::new() };
        let friction = scene.friction;
        let slab = |half: Vector| ColliderBuilder::cuboid(half.x, half.y, half.z).friction(friction);
        let mut fixed = |at: Vector, half: Vector| {
            stage.physics.insert(RigidBodyBuilder::fixed().translation(at), slab(half));
        };
        if scene.beside == Beside::Carriers {
            fixed(Vector::Y * -0.1, Vector::new(0.03, 0.05, 0.03));
        } else {
            fixed(Vector::Y * -0.5, Vector::new(5.0, 0.5, 5.0));
        }
        if scene.beside == Beside::Walls {
            for side in [-1.0f32, 1.0] {
                fixed(Vector::new(side * 0.35, 0.5, 0.0), Vector::new(0.1, 0.5, 0.5));
                fixed(Vector::new(0.0, 0.5, side * 0.35), Vector::new(0.5, 0.5, 0.1));
            }
        }
        let mut load = |at: f32, half: f32, density: f32| {
            let body = RigidBodyBuilder::dynamic().translation(Vector::Y * at).can_sleep(false);
            stage.load = Some(stage.physics.insert(body, slab(Vector::splat(half)).density(density)).0);
        };
        match scene.beside {
            Beside::Box => load(3.0 * scene.half, scene.half, 1000.0),
            Beside::Carriers => load(0.0, 0.05, 800.0),
            Beside::Floor | Beside::Walls => {}
        }
        if scene.beside == Beside::Carriers {
            for side in [-1.0f32, 1.0] {
                let carrier = RigidBodyBuilder::kinematic_position_based();
                let carrier = carrier.translation(Vector::X * (side * PAD[2]));
                let collider = ColliderBuilder::cuboid(0.02, 0.06, 0.06).sensor(true);
                stage.carriers.push((stage.physics.insert(carrier, collider).0, side));
            }
        }
        stage
    }

    /// Closes within a third of a second, then lifts.
    fn steer(&mut self, step: usize) {
        let t = (step + 1) as f32 * H;
        let (close, lift) = (0.02 * (3.0 * t).min(1.0), 0.1 * (t - 0.5).clamp(0.0, 1.0));
        for &(carrier, side) in &self.carriers {
            let at = Vector::new(side * (PAD[2] - close), lift, 0.0);
            self.physics.bodies[carrier].set_next_kinematic_translation(at);
        }
    }

    fn load_at(&self) -> Option<[f64; 3]> {
        self.load.map(|load| self.physics.bodies[load].translation().to_array().map(f64::from))
    }
}

impl Touch {
    pub fn tets(&self) -> usize {
        5 * self.cells.pow(3) * self.at.len()
    }

    /// What carries nothing else \[N\].
    pub fn weight(&self) -> f64 {
        let soft = self.at.len() as f64 * 8.0 * f64::from(self.half).powi(3) * 1000.0;
        let load = match self.beside {
            Beside::Box => soft,
            Beside::Carriers => 0.8,
            _ => 0.0,
        };
        f64::from(9.81f32) * if self.beside == Beside::Carriers { load } else { soft + load }
    }

    /// Ours; times are the least of several runs.
    pub fn run(&self, settings: &dyn Fn(DeformableBodyBuilder) -> DeformableBodyBuilder) -> Touched {
        let mut touched = self.run_once(settings, DeformableParameters::default());
        for _ in 1..REPEATS {
            let again = self.run_once(settings, DeformableParameters::default());
            assert!(again.path == touched.path, "{} differs from run to run", self.name);
            keep_least(&mut touched.step, &again.step);
            keep_least(&mut touched.contact, &again.contact);
        }
        touched
    }

    /// What all are measured by: Newton's method to 1e-10, and contacts to 1e-12, with a budget that ends nothing.
    pub fn reference(&self) -> Touched {
        let parameters = DeformableParameters::default().contact_iterations(4000);
        let settings = |body: DeformableBodyBuilder| {
            body.fidelity(Fidelity::Reference).tune(|s| s.contact_tolerance = 1e-12)
        };
        self.run_once(&settings, parameters)
    }

    fn run_once(
        &self,
        settings: &dyn Fn(DeformableBodyBuilder) -> DeformableBodyBuilder,
        parameters: DeformableParameters,
    ) -> Touched {
        let mut stage = Stage::new(self);
        let mut world = DeformableWorld::new();
        world.parameters = parameters;
        let material = DeformableMaterial::new(self.e, 0.3).friction(f64::from(self.friction));
        let bodies: Vec<_> = (self.at.iter().enumerate())
            .map(|(k, &at)| {
                let body = DeformableBodyBuilder::cuboid(Vector::splat(self.half), [self.cells; 3]);
                let body = body.translation(at).linvel(self.linvel).material(material).can_sleep(false);
                let body = world.insert(settings(body)).expect("a valid body");
                if let Some(&(carrier, _)) = stage.carriers.get(k) {
                    let back = world.bodies[body].vertices_where(|x| x.x.abs() > PAD[1]);
                    let on = AttachTo::RigidBody(carrier, *stage.physics.bodies[carrier].position());
                    world.bodies.attach(body, &back, on).expect("surface vertices");
                }
                body
            })
            .collect();
        world.prepare(&stage.physics).expect("a valid step");
        let mut touched = Touched::default();
        for step in 0..self.steps {
            stage.steer(step);
            let start = Instant::now();
            let step = timed(|| world.step(&mut stage.physics)).1;
            let counters = world.counters();
            // The counters read the clock on the wall, which others on the machine make go faster.
            let share = counters.contact_time.as_secs_f64() / start.elapsed().as_secs_f64();
            touched.step.push(step);
            touched.contact.push(share * step);
            touched.factorizations += counters.contact_factorizations;
            touched.iterations += counters.contact_sweeps + counters.contact_products;
            let soft = bodies.iter().map(|&body| world.bodies[body].center_of_mass());
            touched.path.push(soft.chain(stage.load_at()).collect());
            touched.force.push(self.forces(&stage, &world, &bodies));
            let gaps = world.contacts().iter().map(|c| c.gap);
            let gaps = gaps.chain(world.pair_contacts().iter().map(|c| c.gap));
            touched.deepest = gaps.fold(touched.deepest, |deepest, gap| deepest.max(-gap));
        }
        touched
    }

    fn forces(
        &self,
        stage: &Stage,
        world: &DeformableWorld,
        bodies: &[DeformableBodyHandle],
    ) -> Vec<[f64; 3]> {
        let is_load = |c: &&DeformableContact| {
            stage.physics.colliders[c.collider].parent() == stage.load && stage.load.is_some()
        };
        let sum = |of: &mut dyn Iterator<Item = &DeformableContact>| {
            of.fold([0.0; 3], |sum, c| [0, 1, 2].map(|k| sum[k] + f64::from(c.force[k])))
        };
        if self.beside == Beside::Carriers {
            return bodies.iter().map(|&body| sum(&mut world.contacts_of(body).filter(is_load))).collect();
        }
        vec![sum(&mut world.contacts().iter().filter(|c| !is_load(c)))]
    }

    /// Rapier's own; the forces by the momentum of all that moves, where nothing else acts on it.
    pub fn run_rapier(&self, setting: &str) -> Touched {
        let mut stage = Stage::new(self);
        tune(&mut stage.physics, setting);
        let bodies: Vec<SoftBodyHandle> =
            (0..self.at.len()).map(|k| self.insert_rapier(&mut stage, k, setting)).collect();
        let mut touched = Touched::default();
        let mut before = momentum(&stage, &bodies);
        for step in 0..self.steps {
            stage.steer(step);
            touched.step.push(timed(|| stage.physics.step()).1);
            let now = momentum(&stage, &bodies);
            if self.beside != Beside::Carriers {
                let mut force = [0, 1, 2].map(|k| (now[k] - before[k]) / f64::from(H));
                force[1] += self.weight();
                touched.force.push(vec![force]);
            }
            before = now;
            let soft = &stage.physics.soft_bodies;
            let middles = bodies.iter().map(|&body| soft[body].center_of_mass().to_array().map(f64::from));
            touched.path.push(middles.chain(stage.load_at()).collect());
            let heights =
                bodies.iter().flat_map(|&body| soft[body].particle_positions().map(|p| f64::from(p.y)));
            let lowest = heights.fold(f64::INFINITY, f64::min);
            touched.deepest =
                if self.beside == Beside::Carriers { f64::NAN } else { touched.deepest.max(-lowest) };
        }
        touched
    }

    fn insert_rapier(&self, stage: &mut Stage, k: usize, setting: &str) -> SoftBodyHandle {
        let half = f64::from(self.half);
        let mesh = TetMesh::cuboid([half; 3], [self.cells; 3]).expect("a valid lattice");
        let body = rapier_body(&mesh, Pose::from_translation(self.at[k]), self.e, 0.3);
        let body =
            body.solver(if setting == "default" { SoftBodySolver::default() } else { SoftBodySolver::Fem });
        let skin = ColliderBuilder::ball(0.05).density(0.0).friction(self.friction);
        let body = stage.physics.insert_soft_body(body.surface_collider(skin));
        let soft = &mut stage.physics.soft_bodies[body];
        for v in 0..soft.num_particles() {
            soft.set_particle_velocity(v, self.linvel);
            if let Some(&(carrier, _)) = stage.carriers.get(k)
                && soft.particle_position(v).x.abs() > PAD[1]
            {
                soft.attach_particle(v, carrier, &stage.physics.bodies);
            }
        }
        body
    }
}

/// Momentum of all that moves [kg m/s].
fn momentum(stage: &Stage, bodies: &[SoftBodyHandle]) -> [f64; 3] {
    let particles = bodies.iter().flat_map(|&body| stage.physics.soft_bodies[body].particles());
    let mut sum = [0.0; 3];
    for particle in particles {
        (0..3).for_each(|k| sum[k] += f64::from(particle.mass()) * f64::from(particle.velocity()[k]));
    }
    if let Some(load) = stage.load {
        let load = &stage.physics.bodies[load];
        (0..3).for_each(|k| sum[k] += f64::from(load.mass()) * f64::from(load.linvel()[k]));
    }
    sum
}

fn keep_least(times: &mut [f64], again: &[f64]) {
    times.iter_mut().zip(again).for_each(|(time, again)| *time = time.min(*again));
}

impl Touched {
    /// Root mean square error of the forces over the largest of the reference.
    pub fn force_error(&self, truth: &Self) -> f64 {
        error(&self.force, &truth.force, None)
    }

    /// The same of the middles, over the largest displacement.
    pub fn path_error(&self, truth: &Self) -> f64 {
        error(&self.path, &truth.path, truth.path.first())
    }
}

/// Root mean square distance over the largest of the reference from a start.
fn error(of: &[Vec<[f64; 3]>], truth: &[Vec<[f64; 3]>], start: Option<&Vec<[f64; 3]>>) -> f64 {
    if of.is_empty() {
        return f64::NAN;
    }
    let squared = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    let (mut sum, mut count, mut largest) = (0.0, 0, 0.0f64);
    for (a, b) in of.iter().zip(truth) {
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            sum += squared(a, b);
            count += 1;
            largest = largest.max(squared(b, &start.map_or([0.0; 3], |start| start[k])));
        }
    }
    (sum / f64::from(count) / largest).sqrt()
}
