//! One scene, stepped by either engine.

use crate::clock::timed;
use crate::scene::{Scene, Soft, Way};
use crate::{ours, theirs};
use foible3d::prelude::*;
use rapier3d::prelude::*;

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

/// What a scene took and came to.
#[derive(Default)]
pub struct Run {
    /// Of every step \[ms\].
    pub times: Vec<f64>,
    /// Of every step, ours only.
    pub counters: Vec<DeformableCounters>,
    /// Building and inserting the bodies \[ms\].
    pub insertion: f64,
    /// Deepest place of a node in a rigid shape, after any step and after the last \[m\].
    pub deepest: [f64; 2],
    /// Least volume of all solids over the one at rest, and that at the end.
    pub volume: [f64; 2],
    /// Largest ever \[bytes\].
    pub factor: usize,
    pub columns: usize,
    /// Of both and the state together, and the state alone \[bytes\].
    pub peak: usize,
    pub state: usize,
    /// Since when every body that may sleep does \[s\].
    pub asleep: Option<f64>,
    /// How many of them do not, at the end.
    pub awake: usize,
    pub finite: bool,
}

/// The rigid part of a scene, and what moves it.
pub struct Stage {
    pub physics: PhysicsWorld,
    pub rigid: Vec<RigidBodyHandle>,
    movers: Vec<(RigidBodyHandle, Way)>,
    solids: Vec<ColliderHandle>,
}

/// What a step left, to be looked at.
struct Seen {
    bodies: Vec<Vec<Vector>>,
    /// Bodies that may sleep and do not.
    awake: usize,
}

impl Stage {
    pub fn new(scene: &Scene) -> Self {
        let physics = PhysicsWorld::new();
        let mut stage = Self { physics, rigid: Vec::new(), movers: Vec::new(), solids: Vec::new() };
        for rigid in &scene.rigid {
            let body = if scene.sleeps { rigid.body.clone() } else { rigid.body.clone().can_sleep(false) };
            let (body, collider) = stage.physics.insert(body, rigid.collider.clone());
            stage.rigid.push(body);
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

    fn deepest<'a>(&self, nodes: impl Iterator<Item = &'a Vector>) -> f64 {
        let solids = self.solids.iter().map(|c| &self.physics.colliders[*c]);
        // Most are far from most nodes.
        let solids: Vec<(&Collider, Aabb)> = solids.map(|c| (c, c.compute_aabb())).collect();
        let depth = |p: &Vector| {
            let near = solids.iter().filter(|(_, aabb)| aabb.contains_local_point(*p));
            let feet = near.map(|(c, _)| c.shape().project_point(c.position(), *p, false));
            let depths = feet.filter(|foot| foot.is_inside).map(|foot| f64::from((foot.point - *p).length()));
            depths.fold(0.0, f64::max)
        };
        nodes.map(depth).fold(0.0, f64::max)
    }

    fn awake_rigid(&self) -> usize {
        let awake = |h: &&RigidBodyHandle| {
            let body = &self.physics.bodies[**h];
            body.is_dynamic() && !body.is_sleeping()
        };
        self.rigid.iter().filter(awake).count()
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
    fn observe(&mut self, scene: &Scene, stage: &Stage, seen: &Seen) {
        let rest: f64 = scene.soft.iter().filter_map(Soft::mesh).map(|mesh| mesh.volume()).sum();
        let solids = scene.soft.iter().zip(&seen.bodies).filter_map(|(s, at)| Some((s.mesh()?, at)));
        let now: f64 = solids.map(|(mesh, at)| volume(mesh, at)).sum();
        self.volume = [self.volume[0].min(now / rest), now / rest];
        let nodes = || seen.bodies.iter().flatten();
        let deep = stage.deepest(nodes());
        self.deepest = [self.deepest[0].max(deep), deep];
        self.finite = nodes().all(|p| p.is_finite());
        self.awake = seen.awake + stage.awake_rigid();
        let now: f64 = (0..self.times.len()).map(|k| f64::from(scene.dt(k))).sum();
        // From then on to the end.
        self.asleep = if scene.sleeps && self.awake == 0 { self.asleep.or(Some(now)) } else { None };
    }

    /// Steps to the end of the scene or of its time, or until all sleep that may.
    fn go(
        scene: &Scene,
        stage: &mut Stage,
        insertion: f64,
        mut step: impl FnMut(&mut PhysicsWorld, &mut Run) -> Seen,
    ) -> Self {
        let mut run = Run { insertion, volume: [1.0; 2], ..Run::default() };
        let may_end = scene.sleeps && scene.soft.iter().all(|s| s.can_sleep);
        let mut spent = 0.0;
        for k in 0..scene.steps {
            stage.begin(scene, k);
            let seen = step(&mut stage.physics, &mut run);
            run.observe(scene, stage, &seen);
            spent += run.times[k] * 1e-3;
            if spent > scene.cap || !run.finite || (may_end && run.asleep.is_some()) {
                break;
            }
        }
        run
    }
}

pub fn run(engine: Engine, scene: &Scene) -> Run {
    match engine {
        Engine::Foible => run_ours(scene),
        Engine::Rapier => run_theirs(scene),
    }
}

fn run_ours(scene: &Scene) -> Run {
    let mut stage = Stage::new(scene);
    let mut world = DeformableWorld::new();
    let (handles, insertion) = timed(|| ours::insert(scene, &stage.physics, &stage.rigid, &mut world));
    if scene.prepared {
        world.prepare(&stage.physics).expect("a valid step");
    }
    let mut quarantined = 0;
    let mut run = Run::go(scene, &mut stage, insertion, |physics, run| {
        run.times.push(timed(|| world.step(physics)).1);
        let counters = *world.counters();
        run.state = ours::state_bytes(&world);
        run.factor = run.factor.max(counters.factor_bytes);
        run.columns = run.columns.max(counters.column_bytes);
        run.peak = run.peak.max(counters.factor_bytes + counters.column_bytes + run.state);
        run.counters.push(counters);
        quarantined += counters.quarantined;
        let bodies = handles.iter().map(|h| world.bodies[*h].positions().collect()).collect();
        let awake = world.bodies.iter().filter(|(_, b)| b.can_sleep() && !b.is_sleeping()).count();
        Seen { bodies, awake }
    });
    // A body that is put aside keeps the last state that was finite.
    run.finite &= quarantined == 0;
    run
}

fn run_theirs(scene: &Scene) -> Run {
    let mut stage = Stage::new(scene);
    let (handles, insertion) = timed(|| theirs::insert(scene, &mut stage.physics, &stage.rigid));
    Run::go(scene, &mut stage, insertion, |physics, run| {
        run.times.push(timed(|| physics.step()).1);
        let bodies: Vec<_> = handles.iter().map(|h| &physics.soft_bodies[*h]).collect();
        let awake =
            bodies.iter().zip(&scene.soft).filter(|(b, soft)| soft.can_sleep && !b.is_sleeping()).count();
        Seen { bodies: bodies.iter().map(|b| b.particle_positions().collect()).collect(), awake }
    })
}
