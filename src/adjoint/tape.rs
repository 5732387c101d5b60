//! Steps as they are recorded. The way back over them is in `way_back.rs`.

use super::checkpoint::Checkpoint;
use super::contact_record::Partner;
use super::loss::DeformableLoss;
use super::record::StepRecord;
use super::rigid_record::{NOT_FREE, RigidStart};
use crate::body::DeformableBodyHandle;
use crate::coupling::packed;
use crate::error::{BodyError, DeformableBodyError};
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real};
use crate::pipeline::DeformableWorld;
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::ColliderHandle;
use rapier3d::pipeline::PhysicsWorld;
use std::fmt;
use std::sync::Arc;

/// Steps of one body, or of several that touch, recorded so that derivatives of a loss with respect to what the body is made of, how it began and what acted on it
/// can be had: exact ones of the converged steps, for one solve a step. What its user changes between steps (forces, pins, wind,
/// activation, impulses, what draws cables) takes part; what moves or speeds vertices up counts as added to what was there.
///
/// Steps have to be solved far: a [`tolerance`](crate::SolverSettings::tolerance) of 1e-10 or less, as that of
/// [`Fidelity::Reference`](crate::Fidelity::Reference). Contacts are those with colliders that do not yield, with rigid bodies of the
/// tape ([`DeformableTape::with_rigid_bodies`]), and between its deformable ones. What has no gradient is
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
    pub(super) bodies: Arc<[DeformableBodyHandle]>,
    pub(super) models: Vec<Arc<DeformableModel>>,
    pub(super) rigid_bodies: Arc<[RigidBodyHandle]>,
    /// Those that are kept: all, or with checkpoints those since the last one.
    pub(super) steps: Vec<StepRecord>,
    /// Steps that are not kept.
    pub(super) forgotten: usize,
    checkpoint_every: Option<usize>,
    pub(super) checkpoints: Vec<Checkpoint>,
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
        Self::of_bodies(deformables, &[body])
    }

    /// An empty tape of several bodies, which may touch one another. Losses and gradients are lists in their order
    /// ([`DeformableTape::losses`], [`DeformableTape::backward_all`]).
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody); [`BodyError::NoGradient`] if none is named, or one twice.
    pub fn of_bodies(
        deformables: &DeformableWorld,
        bodies: &[DeformableBodyHandle],
    ) -> Result<Self, DeformableBodyError> {
        let is_repeated = bodies.iter().enumerate().any(|(k, body)| bodies[..k].contains(body));
        if bodies.is_empty() || is_repeated {
            let what = if is_repeated { "the tape names a body twice" } else { "the tape names no body" };
            return Err(BodyError::NoGradient { step: 0, what }.into());
        }
        let model = |body: &DeformableBodyHandle| {
            Ok(deformables.bodies.get(*body).ok_or_else(|| body.no_such_body())?.model().clone())
        };
        Ok(Self {
            bodies: bodies.into(),
            models: bodies.iter().map(model).collect::<Result<_, DeformableBodyError>>()?,
            rigid_bodies: Arc::new([]),
            steps: Vec::new(),
            forgotten: 0,
            checkpoint_every: None,
            checkpoints: Vec::new(),
            is_interrupted: false,
        })
    }

    /// The tape, of rigid bodies too: dynamic ones that the deformable bodies of the tape touch, and nothing else does. A tape that has some has to
    /// take its steps by itself ([`DeformableTape::step`]); what their user does to them between steps takes part, as with the deformable ones.
    /// Losses may be of them ([`DeformableLoss::add_rigid_position`]), and gradients are with respect to them
    /// ([`DeformableGradient::rigid_bodies`](crate::DeformableGradient::rigid_bodies)). Steps that were recorded before are forgotten.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    /// let block = DeformableBodyBuilder::cuboid(Vector::splat(0.125), [2, 2, 2]).fidelity(Fidelity::Reference);
    /// let block = deformables.insert(block.pinned(|x| x.y < -0.12).can_sleep(false))?;
    /// let plate = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.157).can_sleep(false);
    /// let (plate, _) = physics.insert(plate, ColliderBuilder::cuboid(0.25, 0.03, 0.25).density(200.0));
    /// let mut tape = DeformableTape::new(&deformables, block)?.with_rigid_bodies(&physics, &[plate])?;
    /// for _ in 0..10 {
    ///     tape.step(&mut physics, &mut deformables)?;
    /// }
    /// let mut loss = tape.loss();
    /// loss.add_rigid_position(9, plate, [0.0, 1.0, 0.0])?;
    /// let gradient = tape.backward(&loss)?;
    /// // On a stiffer block the plate lies higher, a heavier one lower.
    /// assert!(gradient.material().youngs_modulus > 0.0 && gradient.rigid_bodies[0].mass < 0.0);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] if one is named twice, is not there, not dynamic, not enabled, or part of a multibody.
    pub fn with_rigid_bodies(
        mut self,
        physics: &PhysicsWorld,
        bodies: &[RigidBodyHandle],
    ) -> Result<Self, DeformableBodyError> {
        let none = |what| BodyError::NoGradient { step: 0, what };
        if bodies.iter().enumerate().any(|(k, body)| bodies[..k].contains(body)) {
            return Err(none("the tape names a rigid body twice").into());
        }
        self.rigid_bodies = bodies.into();
        self.starts(physics).map_err(none)?;
        self.clear();
        Ok(self)
    }

    /// The rigid bodies, in the order in which they were named.
    pub fn rigid_bodies(&self) -> &[RigidBodyHandle] {
        &self.rigid_bodies
    }

    /// The bodies, in the order in which they were named.
    pub fn bodies(&self) -> &[DeformableBodyHandle] {
        &self.bodies
    }

    /// Keeps both worlds every so many steps, at least one, and the steps since: memory for `n/every` worlds and `every` steps in
    /// the place of n. The gradient is that of [`DeformableTape::replay`] then, which steps each once more. Steps that were recorded before,
    /// without a world to replay them from, are forgotten.
    #[must_use]
    pub fn checkpoint_every(mut self, every: usize) -> Self {
        self.clear();
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
        let is_due =
            self.checkpoint_every.is_some_and(|every| self.is_interrupted || step.is_multiple_of(every));
        let checkpoint = is_due.then(|| Checkpoint::new(step, &self.led_to(step), physics, deformables));
        let gravity = from_real(physics.gravity);
        let starts = self.starts(physics);
        take(physics, deformables);
        let starts = starts.map_err(|what| BodyError::NoGradient { step, what }.into());
        let record = starts.and_then(|starts| self.record_of(physics, deformables, (gravity, &starts)));
        self.is_interrupted = record.is_err();
        let record = record?;
        if let Some(checkpoint) = checkpoint {
            self.forgotten = step;
            self.steps.clear();
            self.checkpoints.push(checkpoint);
        }
        self.steps.push(record);
        Ok(())
    }

    /// Where the step before one has left the bodies: of steps that are kept, or that a checkpoint comes after.
    pub(super) fn led_to(&self, step: usize) -> Vec<Vec3> {
        let kept = step.checked_sub(self.forgotten + 1).and_then(|place| self.steps.get(place));
        let checkpoint = || self.checkpoints.iter().find(|checkpoint| checkpoint.step == step);
        kept.map(StepRecord::led_to)
            .or_else(|| checkpoint().map(|checkpoint| checkpoint.led_to.clone()))
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
        if self.checkpoint_every.is_some() || !self.rigid_bodies.is_empty() {
            let what = "with checkpoints or rigid bodies a tape has to take its steps by itself";
            return Err(BodyError::NoGradient { step: self.len(), what }.into());
        }
        let record = self.record_of(physics, deformables, (from_real(physics.gravity), &[]))?;
        self.steps.push(record);
        Ok(())
    }

    fn record_of(
        &self,
        physics: &PhysicsWorld,
        deformables: &DeformableWorld,
        (gravity, starts): (Vec3, &[RigidStart]),
    ) -> Result<StepRecord, DeformableBodyError> {
        let step = self.len();
        for body in self.bodies.iter() {
            deformables.bodies.get(*body).ok_or_else(|| body.no_such_body())?;
        }
        let began = (gravity, &self.rigid_bodies[..], starts);
        let record = StepRecord::new((&self.bodies, &self.models), (physics, deformables), began);
        Ok(record.map_err(|what| BodyError::NoGradient { step, what })?)
    }

    /// Of the rigid bodies before a step.
    fn starts(&self, physics: &PhysicsWorld) -> Result<Vec<RigidStart>, &'static str> {
        let start = |body: &RigidBodyHandle| RigidStart::of(physics, *body).ok_or(NOT_FREE);
        self.rigid_bodies.iter().map(start).collect()
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

    /// Force \[N\] of a collider on the body in a step, of several bodies on the first one, in the solver's precision; zero of steps that are
    /// not kept.
    pub fn contact_force(&self, step: usize, collider: ColliderHandle) -> [f64; 3] {
        self.contact_force_on(step, self.bodies[0], collider)
    }

    /// Force \[N\] of a collider on a body of the tape in a step, as [`DeformableTape::contact_force`].
    pub fn contact_force_on(
        &self,
        step: usize,
        body: DeformableBodyHandle,
        collider: ColliderHandle,
    ) -> [f64; 3] {
        let key = Partner::Collider(packed(collider.into_raw_parts()));
        let Some(body) = self.place(body) else { return [0.0; 3] };
        self.force_between(step, body, key).into()
    }

    /// Force \[N\] of another body of the tape on one of it in a step, as [`DeformableTape::contact_force`].
    pub fn body_force(
        &self,
        step: usize,
        body: DeformableBodyHandle,
        other: DeformableBodyHandle,
    ) -> [f64; 3] {
        let (Some(body), Some(other)) = (self.place(body), self.place(other)) else { return [0.0; 3] };
        // A body's forces on itself sum to none.
        let force = |a, b| self.force_between(step, a, Partner::Body(b));
        (force(body, other) - force(other, body)).into()
    }

    fn force_between(&self, step: usize, body: usize, partner: Partner) -> Vec3 {
        let kept = step.checked_sub(self.forgotten).and_then(|place| self.steps.get(place));
        let contacts = kept.into_iter().flat_map(|step| &step.contacts);
        contacts.filter(|c| c.body == body && c.partner == partner).map(|c| c.force).sum()
    }

    fn place(&self, body: DeformableBodyHandle) -> Option<usize> {
        self.bodies.iter().position(|own| *own == body)
    }

    /// A loss of what was recorded so far, which depends on nothing yet; of several bodies that of the first one.
    pub fn loss(&self) -> DeformableLoss {
        self.loss_at(0)
    }

    /// As [`DeformableTape::loss`], of each body: a loss of several is their sum.
    pub fn losses(&self) -> Vec<DeformableLoss> {
        (0..self.bodies.len()).map(|place| self.loss_at(place)).collect()
    }

    fn loss_at(&self, place: usize) -> DeformableLoss {
        let bodies = (self.bodies.clone(), place);
        DeformableLoss::new(bodies, self.rigid_bodies.clone(), self.models[place].clone(), self.len())
    }
}
