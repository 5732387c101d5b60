//! One scene, stepped by either engine.

use crate::clock::timed;
use crate::shared::rapier_body;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

#[derive(Clone, Copy, PartialEq)]
pub enum Engine {
    Foible,
    Rapier,
}

impl Engine {
    pub const BOTH: [Engine; 2] = [Engine::Foible, Engine::Rapier];

    pub fn name(self) -> &'static str {
        match self {
            Engine::Foible => "foible3d",
            Engine::Rapier => "rapier default",
        }
    }
}

/// A soft body of a scene.
#[derive(Clone)]
pub struct Soft {
    pub mesh: Arc<TetMesh>,
    pub pose: Pose,
    pub e: f64,
    pub nu: f64,
    /// Vertices that are held.
    pub pinned: Vec<usize>,
}

impl Soft {
    pub fn new(mesh: &Arc<TetMesh>, pose: Pose) -> Self {
        Self { mesh: mesh.clone(), pose, e: 1e6, nu: 0.3, pinned: Vec::new() }
    }
}

/// A rigid body, and where it goes if it is kinematic.
#[derive(Clone)]
pub struct Rigid {
    pub body: RigidBodyBuilder,
    pub collider: ColliderBuilder,
    pub way: Option<Way>,
}

impl Rigid {
    pub fn new(body: RigidBodyBuilder, collider: ColliderBuilder) -> Self {
        Self { body, collider: collider.friction(0.5), way: None }
    }
}

/// There with a velocity, and back.
#[derive(Clone, Copy)]
pub struct Way {
    pub velocity: Vector,
    /// Steps at which it sets out, turns and is back.
    pub at: [usize; 3],
}

impl Way {
    fn velocity(&self, step: usize) -> Vector {
        let [out, turn, back] = self.at;
        match step {
            _ if step < out || step >= back => Vector::ZERO,
            _ if step < turn => self.velocity,
            _ => -self.velocity,
        }
    }
}

#[derive(Clone)]
pub struct Scene {
    pub name: String,
    pub soft: Vec<Soft>,
    pub rigid: Vec<Rigid>,
    /// Repeated until the end \[s\].
    pub dt: Vec<f32>,
    pub steps: usize,
    /// Whether `prepare` is called, as while loading.
    pub prepared: bool,
    /// Ends after the step that exceeds it \[s of computing\].
    pub cap: f64,
}

impl Scene {
    pub fn dt(&self, step: usize) -> f32 {
        self.dt[step % self.dt.len()]
    }

    pub fn tets(&self) -> usize {
        self.soft.iter().map(|s| s.mesh.tetrahedra().len()).sum()
    }
}

/// What a scene took and came to.
#[derive(Default)]
pub struct Run {
    /// Of every step \[ms\].
    pub times: Vec<f64>,
    /// Building and inserting the bodies \[ms\].
    pub insertion: f64,
    /// Deepest place of a node in a rigid shape, at the end of any step \[m\].
    pub deepest: f64,
    /// Least volume of all bodies over the one at rest, and that at the end.
    pub volume: [f64; 2],
    /// Largest ever \[bytes\].
    pub factor: usize,
    pub columns: usize,
    pub finite: bool,
}

struct Stage {
    physics: PhysicsWorld,
    movers: Vec<(RigidBodyHandle, Way)>,
    solids: Vec<ColliderHandle>,
}

impl Stage {
    fn new(scene: &Scene) -> Self {
        let mut stage = Self { physics: PhysicsWorld::new(), movers: Vec::new(), solids: Vec::new() };
        for rigid in &scene.rigid {
            let (body, collider) = stage.physics.insert(rigid.body.clone(), rigid.collider.clone());
            stage.solids.push(collider);
            stage.movers.extend(rigid.way.map(|way| (body, way)));
        }
        stage.physics.integration_parameters.dt = scene.dt(0);
        stage
    }

    fn begin(&mut self, scene: &Scene, step: usize) {
        self.physics.integration_parameters.dt = scene.dt(step);
        for (body, way) in &self.movers {
            self.physics.bodies[*body].set_linvel(way.velocity(step), true);
        }
    }

    fn depth(&self, p: Vector) -> f64 {
        let solids = self.solids.iter().map(|c| &self.physics.colliders[*c]);
        let depth = |c: &Collider| {
            let foot = c.shape().project_point(c.position(), p, false);
            if foot.is_inside { f64::from((foot.point - p).length()) } else { 0.0 }
        };
        solids.map(depth).fold(0.0, f64::max)
    }
}

/// Inverted elements count against it.
fn volume(mesh: &TetMesh, at: &[Vector]) -> f64 {
    let of = |t: &[u32; 4]| {
        let [a, b, c, d] = t.map(|v| at[v as usize]);
        f64::from((b - a).dot((c - a).cross(d - a))) / 6.0
    };
    mesh.tetrahedra().iter().map(of).sum()
}

impl Run {
    fn observe(&mut self, scene: &Scene, stage: &Stage, bodies: &[Vec<Vector>]) {
        let rest: f64 = scene.soft.iter().map(|s| s.mesh.volume()).sum();
        let now: f64 = scene.soft.iter().zip(bodies).map(|(s, at)| volume(&s.mesh, at)).sum();
        self.volume = [self.volume[0].min(now / rest), now / rest];
        self.deepest = bodies.iter().flatten().map(|p| stage.depth(*p)).fold(self.deepest, f64::max);
        self.finite = bodies.iter().flatten().all(|p| p.is_finite());
    }

    /// Steps to the end of the scene or of its time.
    fn go(
        scene: &Scene,
        stage: &mut Stage,
        insertion: f64,
        mut step: impl FnMut(&mut PhysicsWorld, &mut Run) -> Vec<Vec<Vector>>,
    ) -> Self {
        let mut run = Run { insertion, volume: [1.0; 2], ..Run::default() };
        let mut spent = 0.0;
        for k in 0..scene.steps {
            stage.begin(scene, k);
            let bodies = step(&mut stage.physics, &mut run);
            run.observe(scene, stage, &bodies);
            spent += run.times[k] * 1e-3;
            if spent > scene.cap || !run.finite {
                break;
            }
        }
        run
    }
}

pub fn run(engine: Engine, scene: &Scene) -> Run {
    match engine {
        Engine::Foible => ours(scene),
        Engine::Rapier => theirs(scene),
    }
}

fn ours(scene: &Scene) -> Run {
    let mut stage = Stage::new(scene);
    let mut world = DeformableWorld::new();
    let (handles, insertion) = timed(|| insert(scene, &mut world));
    if scene.prepared {
        world.prepare(&stage.physics).expect("a valid step");
    }
    let mut quarantined = 0;
    let mut run = Run::go(scene, &mut stage, insertion, |physics, run| {
        run.times.push(timed(|| world.step(physics)).1);
        let counters = world.counters();
        run.factor = run.factor.max(counters.factor_bytes);
        run.columns = run.columns.max(counters.column_bytes);
        quarantined += counters.quarantined;
        handles.iter().map(|h| world.bodies[*h].positions().collect()).collect()
    });
    // A body that is put aside keeps the last state that was finite.
    run.finite &= quarantined == 0;
    run
}

/// Equal meshes share a model.
fn insert(scene: &Scene, world: &mut DeformableWorld) -> Vec<DeformableBodyHandle> {
    let mut models: Vec<(&Arc<TetMesh>, Arc<DeformableModel>)> = Vec::new();
    let mut handles = Vec::new();
    for soft in &scene.soft {
        let known = models.iter().find(|(mesh, _)| Arc::ptr_eq(mesh, &soft.mesh));
        let model = match known {
            Some((_, model)) => model.clone(),
            None => Arc::new(DeformableModel::new(&soft.mesh)),
        };
        models.push((&soft.mesh, model.clone()));
        let material = DeformableMaterial::new(soft.e, soft.nu).friction(0.5);
        let builder = DeformableBodyBuilder::model(model).pose(soft.pose).material(material);
        let handle = world.insert(builder.can_sleep(false)).expect("a valid body");
        let body = &mut world.bodies[handle];
        soft.pinned.iter().for_each(|&v| body.pin(v).expect("a vertex"));
        handles.push(handle);
    }
    handles
}

fn theirs(scene: &Scene) -> Run {
    let mut stage = Stage::new(scene);
    let (handles, insertion) = timed(|| {
        let insert = |soft: &Soft| {
            // The shape is the body's own surface.
            let surface = ColliderBuilder::ball(0.02).density(0.0).friction(0.5);
            let pinned = soft.pinned.iter().map(|&v| v as u32);
            let builder = rapier_body(&soft.mesh, soft.pose, soft.e, soft.nu).surface_collider(surface);
            stage.physics.insert_soft_body(builder.pinned_particles(pinned))
        };
        scene.soft.iter().map(insert).collect::<Vec<_>>()
    });
    Run::go(scene, &mut stage, insertion, |physics, run| {
        run.times.push(timed(|| physics.step()).1);
        handles.iter().map(|h| physics.soft_bodies[*h].particle_positions().collect()).collect()
    })
}
