//! Steps as they are recorded, and the way back.

use super::backward::Backward;
use super::cables::cables_of;
use super::checkpoint::Checkpoint;
use super::gradient::{DeformableGradient, MaterialGradient};
use super::loss::DeformableLoss;
use super::record::StepRecord;
use crate::body::{DeformableBody, DeformableBodyHandle};
use crate::coupling::packed;
use crate::error::{BodyError, DeformableBodyError};
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real};
use crate::pipeline::DeformableWorld;
use rapier3d::geometry::ColliderHandle;
use rapier3d::pipeline::PhysicsWorld;
use std::fmt;
use std::sync::Arc;

/// Mean edges by which a replay may end elsewhere: what is left of recorded steps, where these have not the same bits. Other steps are off by
/// their motion.
const ELSEWHERE: f64 = 1.0e-6;

/// Steps of one body, recorded so that derivatives of a loss with respect to what the body is made of, how it began and what acted on it
/// can be had: exact ones of the converged steps, for one solve a step. What its user changes between steps (forces, pins, wind,
/// activation, impulses, what draws cables) takes part; what moves or speeds vertices up counts as added to what was there.
///
/// Steps have to be solved far: a [`tolerance`](crate::SolverSettings::tolerance) of 1e-10 or less, as that of
/// [`Fidelity::Reference`](crate::Fidelity::Reference). Contacts are those with colliders that do not yield. What has no gradient is
/// refused by [`DeformableTape::record`]; it is listed in `docs/limits.md`.
///
/// How fast has a cube to be thrown so that it is at a target after half a second? Its flight is linear in that: one step of Newton's
/// method on the miss does it.
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let (target, mut throw) = ([1.0, 0.5, 0.0], Vector::new(1.0, 1.0, 0.0));
/// for round in 0..2 {
///     let mut physics = PhysicsWorld::new();
///     let mut deformables = DeformableWorld::new();
///     let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [1, 1, 1]).fidelity(Fidelity::Reference);
///     let cube = deformables.insert(cube.can_sleep(false))?;
///     deformables.bodies[cube].set_linvel(throw)?;
///     let mut tape = DeformableTape::new(&deformables, cube)?;
///     for _ in 0..30 {
///         tape.step(&mut physics, &mut deformables)?;
///     }
///     let middle = deformables.bodies[cube].center_of_mass();
///     let miss = [0, 1, 2].map(|k| middle[k] - target[k]);
///     if round == 1 {
///         assert!(miss.iter().all(|m| m.abs() < 1e-5));
///         break;
///     }
///     // Of the loss ½|miss|², the middle being the mean of all vertices by mass.
///     let mut loss = tape.loss();
///     let body = &deformables.bodies[cube];
///     for (vertex, mass) in body.vertex_masses().into_iter().enumerate() {
///         loss.add_position(29, vertex, miss.map(|m| m * mass / body.mass()))?;
///     }
///     let gradient = tape.backward(&loss)?;
///     // All vertices are thrown alike; what is missed by is the gradient over the time of flight.
///     let of_throw = [0, 1, 2].map(|k| gradient.initial_velocities.iter().map(|v| v[k]).sum::<f64>());
///     let time = 0.5;
///     throw -= Vector::from(of_throw.map(|g| (g / (time * time)) as f32));
/// }
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone)]
pub struct DeformableTape {
    handle: DeformableBodyHandle,
    model: Arc<DeformableModel>,
    /// Those that are kept: all, or with checkpoints those since the last one.
    steps: Vec<StepRecord>,
    /// Steps that are not kept.
    forgotten: usize,
    checkpoint_every: Option<usize>,
    checkpoints: Vec<Checkpoint>,
    /// The last step has no gradient, and is not recorded: none is replayed through it.
    is_interrupted: bool,
}

/// Positions would fill pages.
impl fmt::Debug for DeformableTape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeformableTape").field("steps", &self.len()).finish_non_exhaustive()
    }
}

impl DeformableTape {
    /// An empty tape of a body.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn new(
        deformables: &DeformableWorld,
        body: DeformableBodyHandle,
    ) -> Result<Self, DeformableBodyError> {
        let model = deformables.bodies.get(body).ok_or_else(|| body.no_such_body())?.model().clone();
        Ok(Self {
            handle: body,
            model,
            steps: Vec::new(),
            forgotten: 0,
            checkpoint_every: None,
            checkpoints: Vec::new(),
            is_interrupted: false,
        })
    }

    /// Keeps both worlds every so many steps, at least one, and the steps since: memory for `n/every` worlds and `every` steps in
    /// the place of n. The gradient is that of [`DeformableTape::replay`] then, which steps each once more.
    #[must_use]
    pub fn checkpoint_every(mut self, every: usize) -> Self {
        self.checkpoint_every = Some(every.max(1));
        self
    }

    /// Steps the world and records the step.
    ///
    /// # Errors
    /// As [`DeformableTape::record`]; the world has been stepped nonetheless.
    pub fn step(
        &mut self,
        physics: &mut PhysicsWorld,
        deformables: &mut DeformableWorld,
    ) -> Result<(), DeformableBodyError> {
        self.step_by(physics, deformables, |physics, deformables| deformables.step(physics))
    }

    /// As [`DeformableTape::step`], where `take` steps the worlds once, with hooks or events
    /// ([`DeformableWorld::step_with_events`]).
    ///
    /// # Errors
    /// As [`DeformableTape::record`]; the world has been stepped nonetheless.
    pub fn step_by(
        &mut self,
        physics: &mut PhysicsWorld,
        deformables: &mut DeformableWorld,
        take: impl FnOnce(&mut PhysicsWorld, &mut DeformableWorld),
    ) -> Result<(), DeformableBodyError> {
        let step = self.len();
        if self.checkpoint_every.is_some_and(|every| self.is_interrupted || step.is_multiple_of(every)) {
            let checkpoint = Checkpoint::new(step, self.led_to(step), physics, deformables);
            self.checkpoints.pop_if(|last| last.step == step);
            self.forgotten = step;
            self.steps.clear();
            self.checkpoints.push(checkpoint);
        }
        let gravity = from_real(physics.gravity);
        take(physics, deformables);
        let added = self.add(physics, deformables, gravity);
        self.is_interrupted = added.is_err();
        added
    }

    /// Where the step before one has left the body: of steps that are kept, or that a checkpoint comes after.
    fn led_to(&self, step: usize) -> &[Vec3] {
        let kept = step.checked_sub(self.forgotten + 1).and_then(|place| self.steps.get(place));
        let checkpoint = || self.checkpoints.iter().find(|checkpoint| checkpoint.step == step);
        kept.map(|record| &record.x_end[..])
            .or_else(|| checkpoint().map(|checkpoint| &checkpoint.led_to[..]))
            .unwrap_or_default()
    }

    /// Records the step that the world has just taken, before anything is changed: where several bodies have a tape each.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] for a step that has none; [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn record(
        &mut self,
        physics: &PhysicsWorld,
        deformables: &DeformableWorld,
    ) -> Result<(), DeformableBodyError> {
        if self.checkpoint_every.is_some() {
            let what = "with checkpoints a tape has to take its steps by itself";
            return Err(BodyError::NoGradient { step: self.len(), what }.into());
        }
        self.add(physics, deformables, from_real(physics.gravity))
    }

    fn add(
        &mut self,
        physics: &PhysicsWorld,
        deformables: &DeformableWorld,
        gravity: Vec3,
    ) -> Result<(), DeformableBodyError> {
        let body = self.body(deformables)?;
        let step = self.len();
        let solved = deformables.pipeline.solved(self.handle).filter(|_| !deformables.counters().skipped);
        let what = "the body was not stepped: it sleeps or is not enabled";
        let solved = solved.ok_or(BodyError::NoGradient { step, what })?;
        let cables = cables_of(self.handle, (&deformables.bodies, physics), &solved);
        let record = cables.and_then(|cables| StepRecord::new(body, &solved, cables, gravity));
        self.steps.push(record.map_err(|what| BodyError::NoGradient { step, what })?);
        Ok(())
    }

    fn body<'a>(&self, deformables: &'a DeformableWorld) -> Result<&'a DeformableBody, DeformableBodyError> {
        Ok(deformables.bodies.get(self.handle).ok_or_else(|| self.handle.no_such_body())?)
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.forgotten + self.steps.len()
    }

    /// Whether nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets the steps.
    pub fn clear(&mut self) {
        self.steps.clear();
        self.checkpoints.clear();
        self.forgotten = 0;
        self.is_interrupted = false;
    }

    /// The first of the steps that are kept: with checkpoints that after the last one.
    pub fn first_kept(&self) -> usize {
        self.forgotten
    }

    /// Force \[N\] of a collider on the body in a step, in the solver's precision; zero of steps that are not kept.
    pub fn contact_force(&self, step: usize, collider: ColliderHandle) -> [f64; 3] {
        let key = packed(collider.into_raw_parts());
        let place = step.checked_sub(self.forgotten);
        let contacts =
            place.and_then(|place| self.steps.get(place)).into_iter().flat_map(|step| &step.contacts);
        contacts.filter(|c| c.collider == key).map(|c| c.force).sum::<Vec3>().into()
    }

    /// A loss of what was recorded so far, which depends on nothing yet.
    pub fn loss(&self) -> DeformableLoss {
        DeformableLoss::new(self.model.clone(), self.len())
    }

    /// The derivatives of a loss.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] for a step that cannot be solved backward, if the loss is of another tape, or if the tape has
    /// checkpoints.
    pub fn backward(&self, loss: &DeformableLoss) -> Result<DeformableGradient, BodyError> {
        if self.forgotten > 0 {
            let what = "it is not kept: with checkpoints a tape is replayed";
            return Err(BodyError::NoGradient { step: 0, what });
        }
        let mut gradient = self.begin(loss)?;
        let mut back = self.back()?;
        self.go_back(0, loss, &mut back, &mut gradient)?;
        Ok(self.finish(&back, gradient))
    }

    /// As [`DeformableTape::backward`], from checkpoints: the steps between them are taken again, on copies of the worlds.
    /// `control` has to do before each step, of which it is told the number, what was done then.
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
        mut control: impl FnMut(usize, &mut PhysicsWorld, &mut DeformableWorld),
        mut take: impl FnMut(&mut PhysicsWorld, &mut DeformableWorld),
    ) -> Result<DeformableGradient, DeformableBodyError> {
        let mut gradient = self.begin(loss)?;
        let mut back = self.back()?;
        let mut end = self.len();
        for checkpoint in self.checkpoints.iter().rev() {
            let (mut physics, mut deformables) = checkpoint.worlds();
            let mut part = Self::new(&deformables, self.handle)?;
            for step in checkpoint.step..end {
                // Before its own step a checkpoint was taken.
                if step > checkpoint.step {
                    control(step, &mut physics, &mut deformables);
                }
                part.step_by(&mut physics, &mut deformables, &mut take)?;
            }
            self.check_replay(end, part.led_to(part.len()))?;
            part.go_back(checkpoint.step, loss, &mut back, &mut gradient)?;
            end = checkpoint.step;
        }
        Ok(self.finish(&back, gradient))
    }

    /// Whether a replay has led where the steps before one did.
    fn check_replay(&self, end: usize, led_to: &[Vec3]) -> Result<(), BodyError> {
        let far = ELSEWHERE * self.model.surface.mean_edge;
        let is_there = |(a, b): (&Vec3, &Vec3)| (a - b).amax() <= far;
        if !self.led_to(end).iter().zip(led_to).all(is_there) {
            let what = "replayed, it leads elsewhere: `control` does not do what was done, or steps are solved to too little";
            return Err(BodyError::NoGradient { step: end - 1, what });
        }
        Ok(())
    }

    fn begin(&self, loss: &DeformableLoss) -> Result<DeformableGradient, BodyError> {
        if loss.seeds.len() != self.len() {
            let what = "the loss is of another number of steps";
            return Err(BodyError::NoGradient { step: self.len(), what });
        }
        let materials = vec![MaterialGradient::default(); self.model.regions().len()];
        Ok(DeformableGradient { materials, ..Default::default() })
    }

    fn back(&self) -> Result<Backward<'_>, BodyError> {
        let what = "its stiffness has no inverse";
        Backward::new(&self.model).ok_or(BodyError::NoGradient { step: 0, what })
    }

    /// Through the steps that are kept, of which the first is that of this number of the loss.
    fn go_back(
        &self,
        first: usize,
        loss: &DeformableLoss,
        back: &mut Backward<'_>,
        gradient: &mut DeformableGradient,
    ) -> Result<(), BodyError> {
        for (step, record) in self.steps.iter().enumerate().rev() {
            let step = first + step;
            let seed = &loss.seeds[step];
            seed.positions.iter().for_each(|(node, derivative)| back.x[*node] += derivative);
            seed.velocities.iter().for_each(|(node, derivative)| back.v[*node] += derivative);
            let none = |what| BodyError::NoGradient { step, what };
            back.step(record, seed, gradient).map_err(none)?;
        }
        Ok(())
    }

    fn finish(&self, back: &Backward<'_>, mut gradient: DeformableGradient) -> DeformableGradient {
        gradient.steps.reverse();
        let users = |nodes: &[Vec3]| self.model.nodes_by_vertex().map(|n| nodes[n].into()).collect();
        gradient.initial_positions = users(&back.x);
        gradient.initial_velocities = users(&back.v);
        gradient
    }
}
