//! The pipeline as games with their own loop call it.

use super::contacts::{JointForce, RigidContact};
use super::events::{DeformableCollisionEvent, DeformableContactForceEvent, DeformableEventHandler};
use super::parameters::{DeformableCounters, DeformableParameters};
use super::step::{SolvedBody, StepScratch};
use crate::body::{
    DeformableBodyHandle, DeformableBodySet, DeformableContact, DeformablePairContact, Integrator,
};
use crate::coupling::{DeformableHooks, PhysicsParts};
use crate::error::DeformableBodyError;
use crate::solver::{FactorKey, Reaction, SECOND_ORDER, alpha_step};
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::ColliderSet;
use std::fmt;

/// Steps deformable bodies beside rapier: for games with their own loop and sets. Holds memory and
/// caches only: a fresh pipeline goes on with the same bits.
///
/// Call [`DeformablePipeline::before_step`], step rapier, then [`DeformablePipeline::after_step`],
/// all with the same `dt`. A loop with sets of its own is `examples/own_loop.rs`.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut physics = PhysicsWorld::new();
/// let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
/// let mut deformables = DeformableBodySet::new();
/// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(Vector::Y * 0.2);
/// let cube = deformables.insert(cube.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0)))?;
/// let (parameters, mut pipeline) = (DeformableParameters::default(), DeformablePipeline::new());
/// for _ in 0..120 {
///     let mut parts = PhysicsParts {
///         gravity: physics.gravity,
///         dt: physics.integration_parameters.dt,
///         substeps: physics.integration_parameters.num_solver_iterations,
///         bodies: &mut physics.bodies,
///         colliders: &physics.colliders,
///         narrow_phase: &physics.narrow_phase,
///         impulse_joints: &mut physics.impulse_joints,
///         multibody_joints: &mut physics.multibody_joints,
///     };
///     pipeline.before_step(&parameters, &mut deformables, &mut parts);
///     physics.step(); // or `PhysicsPipeline::step` with all of rapier's sets
///     pipeline.after_step(&mut PhysicsParts::from(&mut physics));
/// }
/// let load: Vector = pipeline.contacts().iter().filter(|c| c.collider == floor).map(|c| c.force).sum();
/// assert!((f64::from(load.y) - 9.81 * deformables[cube].mass()).abs() < 0.1);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Default)]
pub struct DeformablePipeline {
    scratch: StepScratch,
}

/// Caches would fill pages: what the last step did instead.
impl fmt::Debug for DeformablePipeline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeformablePipeline").field("counters", self.counters()).finish_non_exhaustive()
    }
}

impl DeformablePipeline {
    /// An empty pipeline.
    pub fn new() -> Self {
        Self::default()
    }

    /// Steps all bodies of `deformables` by `parts.dt` \[s\] and hands rapier what they do to its bodies.
    /// Never fails: a `dt` that is not positive and finite, or a gravity that is not finite, skips the
    /// step ([`DeformableCounters::skipped`]).
    pub fn before_step(
        &mut self,
        parameters: &DeformableParameters,
        deformables: &mut DeformableBodySet,
        parts: &mut PhysicsParts<'_>,
    ) {
        self.before_step_with_hooks(parameters, deformables, parts, &());
    }

    /// As [`DeformablePipeline::before_step`], with hooks for pairs of deformable bodies.
    pub fn before_step_with_hooks(
        &mut self,
        parameters: &DeformableParameters,
        deformables: &mut DeformableBodySet,
        parts: &mut PhysicsParts<'_>,
        hooks: &dyn DeformableHooks,
    ) {
        self.scratch.run(parameters, deformables, parts, hooks);
    }

    /// Hands the events of the last step to a handler: [`DeformablePipeline::collision_events`], then
    /// [`DeformablePipeline::contact_force_events`].
    pub fn send_events(
        &self,
        deformables: &DeformableBodySet,
        colliders: &ColliderSet,
        handler: &dyn DeformableEventHandler,
    ) {
        for event in self.collision_events() {
            handler.handle_deformable_collision_event(deformables, colliders, *event);
        }
        for event in self.contact_force_events() {
            handler.handle_deformable_contact_force_event(deformables, colliders, event);
        }
    }

    /// What has started and stopped touching in the last step.
    pub fn collision_events(&self) -> &[DeformableCollisionEvent] {
        &self.scratch.collision_events
    }

    /// Forces of the last step that were above their thresholds.
    pub fn contact_force_events(&self) -> &[DeformableContactForceEvent] {
        &self.scratch.contact_force_events
    }

    /// Puts the users' forces and motors back. To be called after rapier's step.
    pub fn after_step(&mut self, parts: &mut PhysicsParts<'_>) {
        self.scratch.reactions.take_back(parts);
    }

    /// Makes factors, and columns for contact anywhere on the surface, ahead of time; not for bodies that
    /// hard attachments prescribe, whose matrix depends on what they are attached to.
    ///
    /// # Errors
    /// [`DeformableBodyError::TimeStep`].
    pub fn prepare(&mut self, deformables: &DeformableBodySet, dt: f32) -> Result<(), DeformableBodyError> {
        let h = f64::from(dt);
        if !(h.is_finite() && h > 0.0) {
            return Err(DeformableBodyError::TimeStep { dt: h });
        }
        for (_, body) in deformables.iter().filter(|(_, b)| b.is_enabled()) {
            let near = body.matrix_step(h);
            self.scratch.factors.prepare_surface(&FactorKey::new(body, near), body);
            let is_second_order = body.settings().integrator == Integrator::Bdf2;
            let flies = FactorKey::untouched(body, if is_second_order { SECOND_ORDER * near } else { near });
            self.scratch.factors.prepare(&flies, body, 1, std::iter::empty());
            if is_second_order {
                self.scratch.factors.prepare_surface(&FactorKey::new(body, alpha_step(near)), body);
            }
        }
        Ok(())
    }

    /// Contacts of the last step; of sleeping bodies those with which they fell asleep.
    pub fn contacts(&self) -> &[DeformableContact] {
        &self.scratch.contacts
    }

    /// Contacts between deformable bodies, and of bodies with themselves; of sleeping bodies those with which
    /// they fell asleep.
    pub fn pair_contacts(&self) -> &[DeformablePairContact] {
        &self.scratch.pair_contacts
    }

    /// Contacts between rigid bodies that the last step solved.
    pub fn rigid_contacts(&self) -> &[RigidContact] {
        &self.scratch.rigid_contacts
    }

    /// Forces of the joints that the last step solved, axis by axis.
    pub fn joint_forces(&self) -> &[JointForce] {
        &self.scratch.joint_forces
    }

    /// What the last step has done to a rigid body; `None` of one that no deformable body has met.
    pub(crate) fn reaction_on(&self, body: RigidBodyHandle) -> Option<Reaction> {
        self.scratch.reaction_on(body)
    }

    /// What the last step has solved of a body; `None` if it was not stepped.
    pub(crate) fn solved(&self, body: DeformableBodyHandle) -> Option<SolvedBody<'_>> {
        self.scratch.solved(body)
    }

    /// What the last step did.
    pub fn counters(&self) -> &DeformableCounters {
        &self.scratch.counters
    }
}
