//! Rigid bodies that are about to meet within the step.
//!
//! Rapier finds a contact when bodies already touch: what a soft body pushes against another one rapier would then stop
//! by itself, with its own springs. Here such pairs are found beforehand, by rapier's filters, and solved with
//! the rest.

use super::coefficients::coefficients;
use super::neighbourhood::{RigidNeighbourhood, WalkContext};
use super::parts::RapierSets;
use super::rigid_contacts::{contact_constraint, contact_key};
use super::scene::{RapierScene, carried};
use crate::contact::{Obstacle, speculative_points};
use crate::solver::RigidProxy;
use rapier3d::dynamics::{RigidBodyHandle, RigidBodyType};
use rapier3d::geometry::{Collider, ColliderHandle};

impl RigidNeighbourhood {
    /// Contacts of a body with others that it does not touch yet.
    pub(super) fn add_speculative_contacts(&mut self, handle: RigidBodyHandle, around: &mut WalkContext<'_>) {
        let sets = around.context.sets;
        let Some(body) = sets.bodies.get(handle) else { return };
        for &collider in body.colliders() {
            for own in around.scene.obstacles_of(collider) {
                around.candidates.near(&around.scene.obstacles[own].swept_aabb(), &mut self.near);
                for k in 0..self.near.len() {
                    let other = self.near[k] as usize;
                    let other_collider = around.scene.colliders[other];
                    let parent = sets.colliders.get(other_collider).and_then(Collider::parent);
                    let is_done = parent.is_some_and(|b| b == handle || self.done.contains(&b));
                    if !is_done && may_collide(sets, collider, other_collider) {
                        // One order, whichever of them the walk comes to first.
                        self.add_speculative_contact(
                            if own < other { [own, other] } else { [other, own] },
                            around,
                        );
                    }
                }
            }
        }
    }

    fn add_speculative_contact(&mut self, obstacles: [usize; 2], around: &mut WalkContext<'_>) {
        let (scene, sets) = (&*around.scene, around.context.sets);
        let colliders = obstacles.map(|o| scene.colliders[o]);
        let [Some(first), Some(second)] = colliders.map(|c| sets.colliders.get(c)) else { return };
        let skins = f64::from(first.contact_skin() + second.contact_skin());
        let [o1, o2] = obstacles.map(|o| coasting(scene, o, around.context.h));
        self.speculative.clear();
        speculative_points(&o1, &o2, skins, &mut self.speculative);
        if self.speculative.is_empty() {
            return;
        }
        let coefficients = coefficients(first.material(), second.material());
        let proxies = [o1.proxy, o2.proxy];
        for at in &self.speculative {
            // Parts of compounds are obstacles of their own; those of other composite shapes are not.
            let parts = [o1.part + at.subshapes[0], o2.part + at.subshapes[1]];
            let points = [at.on_first, at.on_second];
            let (key, gap) = (contact_key(colliders, parts, at.place), at.gap - skins);
            self.constraints.push(contact_constraint(proxies, points, &at.normal, gap, coefficients, key));
        }
        proxies.into_iter().for_each(|proxy| self.reach(around, proxy));
    }
}

/// An obstacle as its velocity leads it on: forces, as gravity where it lies on a floor, cause no contact.
fn coasting(scene: &RapierScene, obstacle: usize, dt: f64) -> Obstacle {
    let mut obstacle = scene.obstacles[obstacle].clone();
    if let RigidProxy::Rigid { com, twist, .. } | RigidProxy::Link { com, twist, .. } =
        scene.proxies.get(obstacle.proxy)
    {
        obstacle.end = carried(&obstacle.start, com, twist, dt);
    }
    obstacle
}

/// Whether rapier would let two colliders touch that it has no contact of. With hooks in play it is left to rapier.
fn may_collide(sets: RapierSets<'_>, first: ColliderHandle, second: ColliderHandle) -> bool {
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
