//! Rigid bodies that are about to meet within the step.
//!
//! Rapier finds a contact when bodies already touch: what a soft body pushes against another one rapier would then stop
//! by itself, with its own springs. Here such pairs are found beforehand, by rapier's filters, and solved with
//! the rest.

use super::closure::{Around, Closure, POINTS, contact_key, contact_row};
use super::obstacles::{RapierScene, carried, coefficients};
use super::parts::RapierSets;
use crate::contact::{Obstacle, meeting_points};
use crate::solver::Partner;
use rapier3d::dynamics::{RigidBodyHandle, RigidBodyType};
use rapier3d::geometry::{Collider, ColliderHandle};

impl Closure {
    /// Rows where a body is to meet others that it does not touch yet.
    pub(super) fn take_approaches(&mut self, handle: RigidBodyHandle, around: &mut Around<'_>) {
        let sets = around.sets;
        let Some(body) = sets.bodies.get(handle) else { return };
        for &collider in body.colliders() {
            for own in around.scene.obstacles_of(collider) {
                around.candidates.near(&around.scene.obstacles[own].swept_aabb(), &mut self.near);
                for k in 0..self.near.len() {
                    let other = self.near[k] as usize;
                    let other_collider = around.scene.colliders[other];
                    let parent = sets.colliders.get(other_collider).and_then(Collider::parent);
                    let is_done = parent.is_some_and(|b| b == handle || self.done.contains(&b));
                    if !is_done && may_meet(sets, collider, other_collider) {
                        // One order, whichever of them the walk comes to first.
                        self.take_approach(if own < other { [own, other] } else { [other, own] }, around);
                    }
                }
            }
        }
    }

    fn take_approach(&mut self, obstacles: [usize; 2], around: &mut Around<'_>) {
        let (scene, sets) = (&*around.scene, around.sets);
        let colliders = obstacles.map(|o| scene.colliders[o]);
        let [Some(first), Some(second)] = colliders.map(|c| sets.colliders.get(c)) else { return };
        let skins = f64::from(first.contact_skin() + second.contact_skin());
        let [o1, o2] = obstacles.map(|o| coasting(scene, o, around.dt));
        self.meeting.clear();
        meeting_points(&o1, &o2, skins, &mut self.meeting);
        if self.meeting.is_empty() {
            return;
        }
        let coefficients = coefficients(first.material(), second.material());
        let partners = [o1.partner, o2.partner];
        let mut key = contact_key(colliders);
        self.pairs.push(((key.obstacle, key.part), (colliders[0], colliders[1])));
        // Parts of compounds are obstacles of their own.
        let first_feature = (o1.part * 31 + o2.part) % POINTS * POINTS;
        for (feature, at) in (first_feature..).zip(&self.meeting) {
            key.feature = feature;
            let points = [at.on_first, at.on_second];
            let gap = at.gap - skins;
            self.rows.push(contact_row(partners, points, &at.normal, gap, coefficients, key));
        }
        partners.into_iter().for_each(|partner| self.reach(around, partner));
    }
}

/// An obstacle as its velocity leads it on: forces, as gravity where it lies on a floor, make no meeting.
fn coasting(scene: &RapierScene, obstacle: usize, dt: f64) -> Obstacle {
    let mut obstacle = scene.obstacles[obstacle].clone();
    if let Partner::Rigid { com, twist, .. } | Partner::Link { com, twist, .. } =
        scene.partners.get(obstacle.partner)
    {
        obstacle.end = carried(&obstacle.start, com, twist, dt);
    }
    obstacle
}

/// Whether rapier would let two colliders touch that it has no contact of. With hooks in play it is left to rapier.
fn may_meet(sets: RapierSets<'_>, first: ColliderHandle, second: ColliderHandle) -> bool {
    let [Some(one), Some(other)] = [first, second].map(|c| sets.colliders.get(c)) else { return false };
    let pair = sets.narrow_phase.contact_pair(first, second);
    if pair.is_some_and(|pair| pair.has_any_active_contact()) {
        return false;
    }
    let parents = [one.parent(), other.parent()];
    let kind = |parent: Option<RigidBodyHandle>| {
        let body = parent.and_then(|handle| sets.bodies.get(handle));
        body.map_or(RigidBodyType::Fixed, |body| body.body_type())
    };
    let [kind1, kind2] = parents.map(kind);
    let types =
        one.active_collision_types().test(kind1, kind2) || other.active_collision_types().test(kind1, kind2);
    let groups = one.collision_groups().test(other.collision_groups())
        && one.solver_groups().test(other.solver_groups());
    let hooks = !one.active_hooks().is_empty() || !other.active_hooks().is_empty();
    let jointed = parents[0].zip(parents[1]).is_some_and(|(a, b)| are_kept_together(sets, a, b));
    types && groups && !hooks && !jointed
}

/// Whether joints forbid two bodies to touch.
fn are_kept_together(sets: RapierSets<'_>, first: RigidBodyHandle, second: RigidBodyHandle) -> bool {
    let mut joints = sets.impulse_joints.joints_between(first, second);
    if joints.any(|(_, joint)| !joint.data.contacts_enabled) {
        return true;
    }
    let links = [first, second].map(|body| sets.multibody_joints.rigid_body_link(body));
    let [Some(link1), Some(link2)] = links else { return false };
    let multibody = sets.multibody_joints.get_multibody(link1.multibody);
    let between = sets.multibody_joints.joint_between(first, second);
    link1.multibody == link2.multibody
        && (multibody.is_some_and(|m| !m.self_contacts_enabled())
            || between.is_some_and(|(_, _, link)| !link.joint.data.contacts_enabled))
}
