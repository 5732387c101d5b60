//! What starts and stops touching, and with what force: events, and who takes them.

use crate::body::{DeformableBodyHandle, DeformableBodySet, DeformableContactPartner};
use rapier3d::dynamics::{RigidBodySet, SoftBodySet, SoftBodyTearEvent};
use rapier3d::geometry::{ColliderSet, CollisionEvent, CollisionEventFlags, ContactPair};
use rapier3d::math::{Real, Vector};
use rapier3d::pipeline::{ChannelEventCollector, EventHandler};
use std::sync::mpsc::Sender;

/// A deformable body and something else start or stop touching: rapier's `CollisionEvent`. Of two deformable bodies
/// that with the lower handle is named first. With [`ActiveEvents::COLLISION_EVENTS`](rapier3d::pipeline::ActiveEvents) of either side.
///
/// What carries a force touches; it stops when no contact is nearer than a hundredth of the body's edges. A sensor sees
/// a body from the step on in which it begins to overlap. Every start has its stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DeformableCollisionEvent {
    /// They touch.
    Started(DeformableBodyHandle, DeformableContactPartner, CollisionEventFlags),
    /// They do so no more, or one of them was removed.
    Stopped(DeformableBodyHandle, DeformableContactPartner, CollisionEventFlags),
}

impl DeformableCollisionEvent {
    fn parts(self) -> (DeformableBodyHandle, DeformableContactPartner, CollisionEventFlags) {
        match self {
            Self::Started(body, partner, flags) | Self::Stopped(body, partner, flags) => {
                (body, partner, flags)
            }
        }
    }

    /// Whether they start touching.
    pub fn started(self) -> bool {
        matches!(self, Self::Started(..))
    }

    /// Whether they stop touching.
    pub fn stopped(self) -> bool {
        matches!(self, Self::Stopped(..))
    }

    /// The deformable body.
    pub fn body(self) -> DeformableBodyHandle {
        self.parts().0
    }

    /// What it touches.
    pub fn partner(self) -> DeformableContactPartner {
        self.parts().1
    }

    /// Whether the partner is a sensor.
    pub fn sensor(self) -> bool {
        self.parts().2.contains(CollisionEventFlags::SENSOR)
    }

    /// Whether they stopped because one of them was removed.
    pub fn removed(self) -> bool {
        self.parts().2.contains(CollisionEventFlags::REMOVED)
    }
}

/// What the contacts of a pair carry is more than its threshold: rapier's `ContactForceEvent`, in every step in which it is.
/// With [`ActiveEvents::CONTACT_FORCE_EVENTS`](rapier3d::pipeline::ActiveEvents) of either side. Forces are those on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeformableContactForceEvent {
    /// The deformable body; of two that with the lower handle.
    pub body: DeformableBodyHandle,
    /// What it touches.
    pub partner: DeformableContactPartner,
    /// Sum of the forces \[N\], friction included.
    pub total_force: Vector,
    /// Sum of their magnitudes \[N\].
    pub total_force_magnitude: Real,
    /// Direction of the strongest.
    pub max_force_direction: Vector,
    /// Its magnitude \[N\].
    pub max_force_magnitude: Real,
    /// It was not above the threshold in the step before.
    pub started: bool,
}

/// Takes events of rapier and of deformable bodies. A handler of rapier's becomes one with an empty `impl`; what it does
/// not implement is left out.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// use std::sync::mpsc::channel;
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
/// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(Vector::Y * 0.5);
/// let cube = deformables.insert(cube.active_events(ActiveEvents::COLLISION_EVENTS))?;
/// let (sender, events) = channel();
/// let handler = DeformableChannelEventCollector::new(sender, channel().0);
/// for _ in 0..60 {
///     deformables.step_with_events(&mut physics, &(), &handler);
/// }
/// let landed = events.try_recv().expect("it has landed");
/// assert_eq!((landed.body(), landed.partner()), (cube, DeformableContactPartner::Collider(floor)));
/// # Ok::<(), DeformableBodyError>(())
/// ```
pub trait DeformableEventHandler: EventHandler {
    /// Something starts or stops touching a deformable body.
    fn handle_deformable_collision_event(
        &self,
        _deformables: &DeformableBodySet,
        _colliders: &ColliderSet,
        _event: DeformableCollisionEvent,
    ) {
    }

    /// The force between a pair is above its threshold.
    fn handle_deformable_contact_force_event(
        &self,
        _deformables: &DeformableBodySet,
        _colliders: &ColliderSet,
        _event: &DeformableContactForceEvent,
    ) {
    }
}

impl DeformableEventHandler for () {}
impl DeformableEventHandler for ChannelEventCollector {}

/// Sends the events of deformable bodies through channels, and those of rapier to its own collector if there is one.
pub struct DeformableChannelEventCollector {
    collisions: Sender<DeformableCollisionEvent>,
    forces: Sender<DeformableContactForceEvent>,
    rapier: Option<ChannelEventCollector>,
}

impl DeformableChannelEventCollector {
    /// Sends to these. A receiver that is gone is no error.
    pub fn new(
        collisions: Sender<DeformableCollisionEvent>,
        forces: Sender<DeformableContactForceEvent>,
    ) -> Self {
        Self { collisions, forces, rapier: None }
    }

    /// Sends rapier's events on to its own collector.
    #[must_use]
    pub fn rapier(self, collector: ChannelEventCollector) -> Self {
        Self { rapier: Some(collector), ..self }
    }
}

impl std::fmt::Debug for DeformableChannelEventCollector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DeformableChannelEventCollector").finish_non_exhaustive()
    }
}

impl DeformableEventHandler for DeformableChannelEventCollector {
    fn handle_deformable_collision_event(
        &self,
        _deformables: &DeformableBodySet,
        _colliders: &ColliderSet,
        event: DeformableCollisionEvent,
    ) {
        let _ = self.collisions.send(event);
    }

    fn handle_deformable_contact_force_event(
        &self,
        _deformables: &DeformableBodySet,
        _colliders: &ColliderSet,
        event: &DeformableContactForceEvent,
    ) {
        let _ = self.forces.send(*event);
    }
}

impl EventHandler for DeformableChannelEventCollector {
    fn handle_collision_event(
        &self,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        event: CollisionEvent,
        pair: Option<&ContactPair>,
    ) {
        if let Some(rapier) = &self.rapier {
            rapier.handle_collision_event(bodies, colliders, event, pair);
        }
    }

    fn handle_contact_force_event(
        &self,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        pair: &ContactPair,
        total_force_magnitude: Real,
    ) {
        if let Some(rapier) = &self.rapier {
            rapier.handle_contact_force_event(dt, bodies, colliders, pair, total_force_magnitude);
        }
    }

    fn handle_soft_body_tear_event(&self, soft_bodies: &SoftBodySet, event: &SoftBodyTearEvent) {
        if let Some(rapier) = &self.rapier {
            rapier.handle_soft_body_tear_event(soft_bodies, event);
        }
    }
}
