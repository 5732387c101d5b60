//! What a run looked like: surfaces, contact forces and stress, a few times a second.

use crate::scene::{Kind, Scene};
use crate::stage::Stage;
use foible_replay::Replay;

/// Pictures per second, and at least so many in all: a fall of 30 ms is looked at in slow motion.
const RATE: f64 = 60.0;
const LEAST_PICTURES: f64 = 120.0;

/// Pictures per second that show a scene well, no more than it has steps.
pub fn replay_rate(scene: &Scene) -> f64 {
    let (steps, dt) = scene.steps();
    RATE.max(LEAST_PICTURES / (steps as f64 * dt).max(dt)).min(1.0 / dt)
}

/// Of a scene before its first step, which is the first picture.
pub(super) fn replay_of(scene: &Scene, stage: &Stage, rate: f64) -> Replay {
    let mut replay = Replay::new(rate);
    for (name, handle) in &stage.deformable {
        replay.add_deformable(name, *handle, &stage.world.bodies[*handle]);
    }
    let rigid = stage.rigid.iter().zip(&scene.rigid);
    let rigid = rigid.map(|((name, _, collider), own)| (name.as_str(), *collider, own.kind == Kind::Fixed));
    replay.add_colliders(&stage.physics.colliders, rigid);
    replay.take(0.0, &stage.physics.bodies, &stage.physics.colliders, &stage.world);
    replay
}
