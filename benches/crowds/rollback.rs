//! What a rollback costs: eight frames taken back and computed again within one.

use crate::clock::timed;
use crate::engines::{Engine, Run, Stage};
use crate::report::{Times, brief};
use crate::scene::{Rigid, Scene, Soft};
use crate::scenes::{cube, floor};
use crate::{ours, theirs};
use foible3d::prelude::*;
use rapier3d::prelude::*;

const FRAMES: usize = 8;
/// Steps until all lies still, and rollbacks after that.
const SETTLING: usize = 240;
const ROLLBACKS: usize = 15;

/// A cube of 1920 tets with nine boxes on it, and one on those.
pub fn scene() -> Scene {
    let mut rigid = vec![floor()];
    for k in 0..10 {
        let (row, column) = ((k / 3) as f32 - 1.0, (k % 3) as f32 - 1.0);
        let at = Vector::new(row * 0.125, 0.45, column * 0.125);
        let at = if k == 9 { Vector::new(0.0, 0.56, 0.0) } else { at };
        let body = RigidBodyBuilder::dynamic().translation(at);
        rigid.push(Rigid::new(body, ColliderBuilder::cuboid(0.05, 0.05, 0.05).density(500.0)));
    }
    let soft = Soft::new(&cube(0.2, [8, 8, 6]), Pose::from_translation(Vector::Y * 0.2));
    Scene { steps: SETTLING + ROLLBACKS * FRAMES, ..Scene::new("rollback of 8 frames", vec![soft], rigid) }
}

/// Both engines' worlds in one: what a game keeps of a frame.
struct World {
    physics: PhysicsWorld,
    deformables: Option<DeformableWorld>,
    rigid: Vec<RigidBodyHandle>,
}

/// All that a step reads. `PhysicsWorld` cannot be cloned, its sets can; its pipelines are memory only.
#[derive(Clone)]
struct Snapshot {
    islands: IslandManager,
    broad_phase: DefaultBroadPhase,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    soft_bodies: SoftBodySet,
    deformables: Option<DeformableBodySet>,
}

impl World {
    fn new(engine: Engine, scene: &Scene) -> Self {
        let mut stage = Stage::new(scene);
        let deformables = match engine {
            Engine::Foible => {
                let mut world = DeformableWorld::new();
                ours::insert(scene, &stage.physics, &stage.rigid, &mut world);
                world.prepare(&stage.physics).expect("a valid step");
                Some(world)
            }
            Engine::Rapier => {
                theirs::insert(scene, &mut stage.physics, &stage.rigid);
                None
            }
        };
        Self { physics: stage.physics, deformables, rigid: stage.rigid }
    }

    fn step(&mut self) {
        match &mut self.deformables {
            Some(world) => world.step(&mut self.physics),
            None => self.physics.step(),
        }
    }

    fn save(&self) -> Snapshot {
        let p = &self.physics;
        Snapshot {
            islands: p.islands.clone(),
            broad_phase: p.broad_phase.clone(),
            narrow_phase: p.narrow_phase.clone(),
            bodies: p.bodies.clone(),
            colliders: p.colliders.clone(),
            soft_bodies: p.soft_bodies.clone(),
            deformables: self.deformables.as_ref().map(|world| world.bodies.clone()),
        }
    }

    fn restore(&mut self, from: Snapshot) {
        let p = &mut self.physics;
        (p.islands, p.broad_phase, p.narrow_phase) = (from.islands, from.broad_phase, from.narrow_phase);
        (p.bodies, p.colliders, p.soft_bodies) = (from.bodies, from.colliders, from.soft_bodies);
        if let (Some(world), Some(bodies)) = (&mut self.deformables, from.deformables) {
            world.bodies = bodies;
        }
    }

    /// Bits of all that moves.
    fn bits(&self) -> Vec<u64> {
        let mut bits = Vec::new();
        for (_, body) in self.physics.bodies.iter() {
            let (p, v) = (body.position(), body.linvel());
            let all = p.translation.to_array().into_iter().chain(p.rotation.to_array());
            bits.extend(
                all.chain(v.to_array()).chain(body.angvel().to_array()).map(|x| u64::from(x.to_bits())),
            );
        }
        for (_, body) in self.physics.soft_bodies.iter() {
            let all = body.particle_positions().chain(body.particle_velocities());
            bits.extend(all.flat_map(|p| p.to_array()).map(|x| u64::from(x.to_bits())));
        }
        for (_, body) in self.deformables.iter().flat_map(|world| world.bodies.iter()) {
            for v in 0..body.vertex_count() {
                let (x, v) = (body.position(v).expect("a vertex"), body.velocity(v).expect("a vertex"));
                bits.extend(x.into_iter().chain(v).map(f64::to_bits));
            }
        }
        bits
    }
}

/// What was found.
pub struct Rollbacks {
    /// Of the frames as they come.
    pub run: Run,
    /// Median step at rest, before any rollback \[ms\].
    pub settled: f64,
    /// Restoring and computing again, each rollback \[ms\].
    pub again: Vec<f64>,
    /// The same where an input came late: a box is pushed sideways in the first of the frames.
    pub late: Vec<f64>,
    /// The frames after such an input.
    pub late_frames: Run,
    /// Taking a snapshot \[ms\].
    pub saving: f64,
    pub same_bits: bool,
}

pub fn run(engine: Engine, scene: &Scene) -> Rollbacks {
    let mut world = World::new(engine, scene);
    let mut found = Rollbacks {
        run: Run { finite: true, ..Run::default() },
        settled: 0.0,
        again: Vec::new(),
        late: Vec::new(),
        late_frames: Run::default(),
        saving: 0.0,
        same_bits: true,
    };
    step(&mut world, SETTLING, Some(&mut found.run));
    found.settled = Times::of(&found.run.times[SETTLING - 60..]).median;
    for _ in 0..ROLLBACKS {
        let (snapshot, saving) = timed(|| world.save());
        found.saving = saving;
        step(&mut world, FRAMES, Some(&mut found.run));
        let (expected, here, late) = (world.bits(), world.save(), snapshot.clone());
        let ((), time) = timed(|| {
            world.restore(snapshot);
            step(&mut world, FRAMES, None);
        });
        found.again.push(time);
        found.same_bits &= world.bits() == expected;
        found.late.push(with_late_input(&mut world, late, &mut found.late_frames));
        world.restore(here);
    }
    found
}

/// Restores a frame and computes on from there with a box pushed sideways \[ms\].
fn with_late_input(world: &mut World, from: Snapshot, frames: &mut Run) -> f64 {
    let ((), time) = timed(|| {
        world.restore(from);
        let last = world.rigid[world.rigid.len() - 1];
        world.physics.bodies[last].apply_impulse(Vector::X * 0.3, true);
        step(world, FRAMES, Some(frames));
    });
    time
}

/// Frames, noted in a run if they count.
fn step(world: &mut World, frames: usize, mut run: Option<&mut Run>) {
    for _ in 0..frames {
        let ((), time) = timed(|| world.step());
        if let Some(run) = &mut run {
            run.times.push(time);
            run.counters.extend(world.deformables.as_ref().map(|d| *d.counters()));
            run.finite &= world.physics.bodies.iter().all(|(_, body)| body.translation().is_finite());
            run.finite &= run.counters.last().is_none_or(|c| c.quarantined == 0);
        }
    }
}

impl Rollbacks {
    /// Over a settled step.
    pub fn ratio(&self) -> f64 {
        Times::of(&self.again).median / self.settled
    }

    pub fn late_ratio(&self) -> f64 {
        Times::of(&self.late).median / self.settled
    }

    pub fn text(&self) -> String {
        let bits = if self.same_bits { "same bits" } else { "OTHER BITS" };
        let (again, late) = (Times::of(&self.again), Times::of(&self.late));
        format!(
            "restored and computed again in {} ms (worst {}), {:.1} × a settled step, {bits}; {:.1} × with a late input (worst {} \
             ms); snapshot {} ms",
            brief(again.median),
            brief(again.worst),
            self.ratio(),
            self.late_ratio(),
            brief(late.worst),
            brief(self.saving)
        )
    }
}
