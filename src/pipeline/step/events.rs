//! What starts and stops touching in a step.

use super::scratch::StepScratch;
use crate::body::{
    DeformableBody, DeformableBodyHandle, DeformableBodySet, DeformableContact,
    DeformableContactPartner as Partner, DeformablePairContact, Partner as ConstraintPartner, TouchKey,
};
use crate::contact::overlaps;
use crate::coupling::{HookedPair, StepContext, packed, pose_of};
use crate::pipeline::{DeformableCollisionEvent, DeformableContactForceEvent};
use parry3d::bounding_volume::BoundingVolume;
use rapier3d::geometry::{ColliderSet, CollisionEventFlags};
use rapier3d::math::Vector;
use rapier3d::pipeline::ActiveEvents;
use std::cmp::Ordering;

/// Two things that touch stop to when they are farther apart than this part of the body's mean edge: contacts of what
/// bounces on the spot open by less. At 0 a cube of 1e4 Pa that settles on a floor stops touching it up to four times.
const PARTED: f64 = 0.01;

/// What the contacts of a pair amount to.
#[derive(Clone, Copy)]
struct PairForce {
    key: TouchKey,
    is_near: bool,
    total: Vector,
    magnitude: f32,
    strongest: Vector,
}

/// Memory for finding out.
#[derive(Default)]
pub(super) struct Touching {
    pairs: Vec<PairForce>,
    /// Sensors that see bodies in this step.
    sensed: Vec<TouchKey>,
    gone: Vec<TouchKey>,
}

impl StepScratch {
    /// Finds the bodies that sensors see, at the start of the step as rapier does.
    pub(super) fn sense(&mut self, deformables: &DeformableBodySet, context: &StepContext<'_>) {
        self.touching.sensed.clear();
        if self.scene.sensors.is_empty() {
            return;
        }
        for (body, of) in deformables.iter().filter(|(_, body)| body.is_enabled() && body.state.is_finite()) {
            let bounds = of.aabb();
            for handle in &self.scene.sensors {
                let Some(sensor) = context.sets.colliders.get(*handle) else { continue };
                let wanted = of.active_events() | sensor.active_events();
                let pose = pose_of(sensor, context);
                let sees = wanted.contains(ActiveEvents::COLLISION_EVENTS)
                    && of.collision_groups().test(sensor.collision_groups())
                    && sensor.shape().compute_aabb(&pose).intersects(&bounds)
                    && HookedPair::with_collider((body, of), (*handle, sensor))
                        .may_sense(deformables, context)
                    && overlaps(of, &pose, sensor.shape());
                if sees {
                    let partner = Partner::Collider(*handle);
                    self.touching.sensed.push(TouchKey { body, partner, is_sensor: true });
                }
            }
        }
    }

    /// Tells what has started and stopped touching since the last step, and which forces are above their thresholds.
    pub(super) fn tell_events(&mut self, deformables: &mut DeformableBodySet, context: &StepContext<'_>) {
        let touching = &mut self.touching;
        touching.sum_up(deformables, context.sets.colliders, &self.contacts, &self.pair_contacts);
        for pair in &touching.pairs {
            let wanted = wanted(deformables, context.sets.colliders, &pair.key);
            let known = deformables.touching.get(&pair.key).copied();
            let carries = pair.magnitude > 0.0;
            if wanted.events.is_empty() && known.is_none() || !(carries || known.is_some() && pair.is_near) {
                continue;
            }
            let mut touch = known.unwrap_or_default();
            if !touch.is_told && wanted.events.contains(ActiveEvents::COLLISION_EVENTS) {
                touch.is_told = true;
                self.collision_events.push(started(&pair.key));
            }
            let is_above = pair.magnitude > wanted.threshold;
            if is_above && !wanted.is_asleep {
                self.contact_force_events.push(force_event(pair, !touch.was_above));
            }
            touch.was_above = is_above;
            deformables.touching.insert(pair.key, touch);
        }
        for key in &touching.sensed {
            let touch = deformables.touching.entry(*key).or_default();
            if !std::mem::replace(&mut touch.is_told, true) {
                self.collision_events.push(started(key));
            }
        }
        touching.list_gone(deformables, context.sets.colliders);
        for key in &touching.gone {
            if deformables.touching.remove(key).is_some_and(|touch| touch.is_told) {
                self.collision_events.push(stopped(key, deformables, context.sets.colliders));
            }
        }
    }
}

impl Touching {
    /// Sums the contacts up, pair by pair, ascending; pairs that no one asks about are left out.
    fn sum_up(
        &mut self,
        deformables: &DeformableBodySet,
        colliders: &ColliderSet,
        contacts: &[DeformableContact],
        pair_contacts: &[DeformablePairContact],
    ) {
        let near = |body: DeformableBodyHandle| {
            deformables.get(body).map_or(0.0, |body| PARTED * body.model.surface.mean_edge)
        };
        let single = |c: &DeformableContact| {
            let key = TouchKey { body: c.body, partner: Partner::Collider(c.collider), is_sensor: false };
            PairForce::new(key, c.force, c.gap < near(c.body))
        };
        let pair = |c: &DeformablePairContact| {
            let (body, partner, force) = match c.body1.cmp(&c.body2) {
                Ordering::Less => (c.body1, c.body2, c.force),
                Ordering::Greater => (c.body2, c.body1, -c.force),
                // What touches itself tells no one.
                Ordering::Equal => return None,
            };
            let key = TouchKey { body, partner: Partner::Deformable(partner), is_sensor: false };
            Some(PairForce::new(key, force, c.gap < near(body).min(near(partner))))
        };
        self.pairs.clear();
        self.pairs.extend(contacts.iter().map(single).chain(pair_contacts.iter().filter_map(pair)));
        if deformables.touching.is_empty() {
            // The usual case.
            self.pairs.retain(|pair| !wanted(deformables, colliders, &pair.key).events.is_empty());
        }
        // Stable: sums have the same bits in every run.
        self.pairs.sort_by_key(|pair| pair.key);
        self.pairs.dedup_by(|later, first| {
            later.key == first.key && {
                first.add(later);
                true
            }
        });
    }

    /// Lists what touches no more. What sleeps touches what it did: a fresh pipeline has no list of its contacts.
    fn list_gone(&mut self, deformables: &DeformableBodySet, colliders: &ColliderSet) {
        let (pairs, sensed) = (&self.pairs, &self.sensed);
        let stays = |key: &TouchKey| {
            if key.is_sensor {
                return sensed.binary_search(key).is_ok();
            }
            if sleeps_with(deformables, colliders, key) {
                return true;
            }
            let place = pairs.binary_search_by_key(key, |pair| pair.key);
            place.is_ok_and(|place| pairs[place].magnitude > 0.0 || pairs[place].is_near)
        };
        self.gone.clear();
        self.gone.extend(deformables.touching.keys().filter(|key| !stays(key)));
    }
}

/// Whether a body sleeps touching the partner, by what it remembers of its contacts.
fn sleeps_with(deformables: &DeformableBodySet, colliders: &ColliderSet, key: &TouchKey) -> bool {
    let asleep = |handle| {
        deformables.get(handle).filter(|body: &&DeformableBody| body.is_enabled() && body.is_sleeping())
    };
    let Some(body) = asleep(key.body) else { return false };
    let remembers = |body: &DeformableBody, name: ConstraintPartner| {
        body.state.contacts.iter().any(|memory| memory.key.partner() == Some(name))
    };
    match key.partner {
        Partner::Collider(handle) => {
            let name = ConstraintPartner::Collider(packed(handle.into_raw_parts()));
            colliders.get(handle).is_some_and(|c| c.is_enabled()) && remembers(body, name)
        }
        Partner::Deformable(handle) => asleep(handle).is_some_and(|other| {
            let [own, others] =
                [key.body, handle].map(|h| ConstraintPartner::Soft(packed(h.into_raw_parts())));
            remembers(body, others) || remembers(other, own)
        }),
    }
}

impl PairForce {
    fn new(key: TouchKey, force: Vector, is_near: bool) -> Self {
        Self { key, is_near, total: force, magnitude: force.length(), strongest: force }
    }

    fn add(&mut self, other: &Self) {
        self.is_near |= other.is_near;
        self.total += other.total;
        self.magnitude += other.magnitude;
        if other.strongest.length_squared() > self.strongest.length_squared() {
            self.strongest = other.strongest;
        }
    }
}

/// What both sides of a pair want to be told.
struct Wanted {
    events: ActiveEvents,
    threshold: f32,
    is_asleep: bool,
}

fn wanted(deformables: &DeformableBodySet, colliders: &ColliderSet, key: &TouchKey) -> Wanted {
    let mut wanted = Wanted { events: ActiveEvents::empty(), threshold: f32::INFINITY, is_asleep: true };
    let mut add = |events: ActiveEvents, threshold: f32| {
        wanted.events |= events;
        if events.contains(ActiveEvents::CONTACT_FORCE_EVENTS) {
            wanted.threshold = wanted.threshold.min(threshold);
        }
    };
    let of = |handle| deformables.get(handle);
    if let Some(body) = of(key.body) {
        add(body.active_events(), body.contact_force_event_threshold());
    }
    match key.partner {
        Partner::Collider(handle) => {
            if let Some(collider) = colliders.get(handle) {
                add(collider.active_events(), collider.contact_force_event_threshold());
            }
        }
        Partner::Deformable(handle) => {
            if let Some(body) = of(handle) {
                add(body.active_events(), body.contact_force_event_threshold());
            }
        }
    }
    wanted.is_asleep = of(key.body).is_none_or(|body| body.is_sleeping());
    wanted
}

fn started(key: &TouchKey) -> DeformableCollisionEvent {
    DeformableCollisionEvent::Started(key.body, key.partner, flags(key))
}

fn stopped(
    key: &TouchKey,
    deformables: &DeformableBodySet,
    colliders: &ColliderSet,
) -> DeformableCollisionEvent {
    let is_there = deformables.contains(key.body)
        && match key.partner {
            Partner::Collider(handle) => colliders.contains(handle),
            Partner::Deformable(handle) => deformables.contains(handle),
        };
    let removed = if is_there { CollisionEventFlags::empty() } else { CollisionEventFlags::REMOVED };
    DeformableCollisionEvent::Stopped(key.body, key.partner, flags(key) | removed)
}

fn flags(key: &TouchKey) -> CollisionEventFlags {
    if key.is_sensor { CollisionEventFlags::SENSOR } else { CollisionEventFlags::empty() }
}

fn force_event(pair: &PairForce, started: bool) -> DeformableContactForceEvent {
    DeformableContactForceEvent {
        body: pair.key.body,
        partner: pair.key.partner,
        total_force: pair.total,
        total_force_magnitude: pair.magnitude,
        max_force_direction: pair.strongest.normalize_or_zero(),
        max_force_magnitude: pair.strongest.length(),
        started,
    }
}
