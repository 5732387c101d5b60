//! The way back over the steps of a tape, from what was kept of them or from checkpoints.

use super::backward::{Backward, go_back};
use super::gradient::{DeformableGradient, MaterialGradient, RigidBodyGradient};
use super::loss::{DeformableLoss, Seed};
use super::record::StepRecord;
use super::rigid_back::RigidBackward;
use super::tape::DeformableTape;
use crate::error::{BodyError, DeformableBodyError};
use crate::fem::DeformableModel;
use crate::math::Vec3;
use crate::pipeline::DeformableWorld;
use rapier3d::pipeline::PhysicsWorld;
use std::sync::Arc;

/// Mean edges by which a replay may end elsewhere: what is left of recorded steps, where these have not the same bits. Other steps are off by
/// their motion.
const ELSEWHERE: f64 = 1.0e-6;

/// What goes backward, and what has come of that.
struct WayBack<'a> {
    bodies: Vec<Backward<'a>>,
    rigid: Vec<RigidBackward>,
    gradients: Vec<DeformableGradient>,
    of_rigid: Vec<RigidBodyGradient>,
}

impl DeformableTape {
    /// The derivatives of a loss of a tape of one body.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] for a step that cannot be solved backward, if the loss is of another tape, or if the tape is of several
    /// bodies or has checkpoints.
    pub fn backward(&self, loss: &DeformableLoss) -> Result<DeformableGradient, BodyError> {
        Ok(one(self.backward_all(std::slice::from_ref(loss))?))
    }

    /// The derivatives of the sum of losses, those of [`DeformableTape::losses`], with respect to every body.
    ///
    /// # Errors
    /// As [`DeformableTape::backward`].
    pub fn backward_all(&self, losses: &[DeformableLoss]) -> Result<Vec<DeformableGradient>, BodyError> {
        if self.forgotten > 0 {
            let what = "it is not kept: with checkpoints a tape is replayed";
            return Err(BodyError::NoGradient { step: 0, what });
        }
        let mut back = self.begin(losses)?;
        self.go_back(0, losses, &mut back)?;
        Ok(back.finish())
    }

    /// As [`DeformableTape::backward`], from checkpoints: the steps between them are taken again, on copies of the worlds.
    /// `control` has to do before each step, of which it is told the number, what was done then. Without checkpoints all steps are kept,
    /// and none is taken again.
    ///
    /// # Errors
    /// As [`DeformableTape::backward`], and if the steps lead elsewhere than they did.
    pub fn replay(
        &self,
        loss: &DeformableLoss,
        control: impl FnMut(usize, &mut PhysicsWorld, &mut DeformableWorld),
    ) -> Result<DeformableGradient, DeformableBodyError> {
        self.replay_by(loss, control, |physics, deformables| deformables.step(physics))
    }

    /// As [`DeformableTape::replay`], of steps that `take` takes ([`DeformableTape::step_by`]).
    ///
    /// # Errors
    /// As [`DeformableTape::replay`].
    pub fn replay_by(
        &self,
        loss: &DeformableLoss,
        control: impl FnMut(usize, &mut PhysicsWorld, &mut DeformableWorld),
        take: impl FnMut(&mut PhysicsWorld, &mut DeformableWorld),
    ) -> Result<DeformableGradient, DeformableBodyError> {
        Ok(one(self.replay_all(std::slice::from_ref(loss), control, take)?))
    }

    /// As [`DeformableTape::replay_by`], of a tape of several bodies.
    ///
    /// # Errors
    /// As [`DeformableTape::replay`].
    pub fn replay_all(
        &self,
        losses: &[DeformableLoss],
        mut control: impl FnMut(usize, &mut PhysicsWorld, &mut DeformableWorld),
        mut take: impl FnMut(&mut PhysicsWorld, &mut DeformableWorld),
    ) -> Result<Vec<DeformableGradient>, DeformableBodyError> {
        if self.checkpoints.is_empty() {
            return Ok(self.backward_all(losses)?);
        }
        let mut back = self.begin(losses)?;
        let mut end = self.len();
        for checkpoint in self.checkpoints.iter().rev() {
            let (mut physics, mut deformables) = checkpoint.worlds();
            let mut part = Self::of_bodies(&deformables, &self.bodies)?;
            part.rigid_bodies = self.rigid_bodies.clone();
            // Its steps have the numbers of these, in errors too.
            part.forgotten = checkpoint.step;
            for step in checkpoint.step..end {
                // Before its own step a checkpoint was taken.
                if step > checkpoint.step {
                    control(step, &mut physics, &mut deformables);
                }
                part.step_by(&mut physics, &mut deformables, &mut take)?;
            }
            self.check_replay(end, &part.led_to(part.len()))?;
            part.go_back(checkpoint.step, losses, &mut back)?;
            end = checkpoint.step;
        }
        Ok(back.finish())
    }

    /// Whether a replay has led where the steps before one did.
    fn check_replay(&self, end: usize, led_to: &[Vec3]) -> Result<(), BodyError> {
        let edge = self.models.iter().map(|model| model.surface.mean_edge).fold(f64::INFINITY, f64::min);
        let is_there = |(a, b): (&Vec3, &Vec3)| (a - b).amax() <= ELSEWHERE * edge;
        if !self.led_to(end).iter().zip(led_to).all(is_there) {
            let what = "replayed, it leads elsewhere: `control` does not do what was done, or steps are solved to too little";
            return Err(BodyError::NoGradient { step: end - 1, what });
        }
        Ok(())
    }

    fn begin(&self, losses: &[DeformableLoss]) -> Result<WayBack<'_>, BodyError> {
        let step = self.len();
        if losses.len() != self.bodies.len() {
            let what = "a tape of several bodies has a loss of each: see `losses` and `backward_all`";
            return Err(BodyError::NoGradient { step, what });
        }
        let is_ours = |(place, loss): (usize, &DeformableLoss)| {
            let is_like = loss.model.rest.len() == self.models[place].rest.len() && loss.seeds.len() == step;
            let has_bodies = loss.bodies == self.bodies && loss.rigid_bodies == self.rigid_bodies;
            is_like && has_bodies && loss.place == place
        };
        if !losses.iter().enumerate().all(is_ours) {
            let what = "the loss is of another tape, another number of steps, or another body";
            return Err(BodyError::NoGradient { step, what });
        }
        let none = |model: &Arc<DeformableModel>| {
            let materials = vec![MaterialGradient::default(); model.regions().len()];
            DeformableGradient { materials, ..Default::default() }
        };
        let what = "its stiffness has no inverse";
        let bodies = self.models.iter().map(|model| Backward::new(model));
        Ok(WayBack {
            bodies: bodies.collect::<Option<_>>().ok_or(BodyError::NoGradient { step: 0, what })?,
            rigid: vec![RigidBackward::default(); self.rigid_bodies.len()],
            gradients: self.models.iter().map(none).collect(),
            of_rigid: self.rigid_bodies.iter().copied().map(RigidBodyGradient::of).collect(),
        })
    }

    /// Through the steps that are kept, of which the first is that of this number of the losses.
    fn go_back(
        &self,
        first: usize,
        losses: &[DeformableLoss],
        back: &mut WayBack<'_>,
    ) -> Result<(), BodyError> {
        for (step, record) in self.steps.iter().enumerate().rev() {
            let step = first + step;
            let seeds: Vec<_> = losses.iter().map(|loss| &loss.seeds[step]).collect();
            back.take(record, &seeds).map_err(|what| BodyError::NoGradient { step, what })?;
        }
        Ok(())
    }
}

/// The gradient of a tape of one body.
fn one(gradients: Vec<DeformableGradient>) -> DeformableGradient {
    gradients.into_iter().next().unwrap_or_default()
}

impl WayBack<'_> {
    /// Through one step.
    fn take(&mut self, record: &StepRecord, seeds: &[&Seed]) -> Result<(), &'static str> {
        for (back, seed) in self.bodies.iter_mut().zip(seeds) {
            seed.positions.iter().for_each(|(node, derivative)| back.x[*node] += derivative);
            seed.velocities.iter().for_each(|(node, derivative)| back.v[*node] += derivative);
        }
        self.rigid.iter_mut().enumerate().for_each(|(place, back)| back.add_seeds(seeds, place));
        let out = (&mut self.gradients[..], &mut self.of_rigid[..]);
        go_back((&mut self.bodies, &mut self.rigid), record, seeds, out)
    }

    fn finish(mut self) -> Vec<DeformableGradient> {
        for (back, gradient) in self.bodies.iter().zip(&mut self.gradients) {
            let users = |nodes: &[Vec3]| back.model.nodes_by_vertex().map(|n| nodes[n].into()).collect();
            gradient.steps.reverse();
            gradient.initial_positions = users(&back.x);
            gradient.initial_velocities = users(&back.v);
        }
        self.rigid.iter().zip(&mut self.of_rigid).for_each(|(back, gradient)| back.end(gradient));
        if let Some(first) = self.gradients.first_mut() {
            first.rigid_bodies = self.of_rigid;
        }
        self.gradients
    }
}
