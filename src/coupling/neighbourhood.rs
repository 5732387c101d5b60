//! What else holds the rigid bodies that soft ones touch: rapier's own contacts and joints, as constraints of
//! the same solve.
//!
//! A rigid body that stands on another, or hangs on a joint, yields as far as that lets it. Found by
//! a walk, breadth first, from the touched bodies through dynamic ones. What these constraints carry is handed
//! to rapier with the rest, so that its own solver finds almost nothing left to do.

use super::joint_constraints::{JointEnds, JointName, drive_constraints, joint_constraints};
use super::joint_couplings::coupling_constraints;
use super::parts::StepContext;
use super::rigid_contacts::{collider_pose, contact_constraints};
use super::scene::RapierScene;
use crate::contact::{Candidates, Constraint, ProxyId, SpeculativePoint};
use crate::math::Pose64;
use crate::solver::RigidProxy;
use rapier3d::dynamics::{
    ImpulseJointHandle, JointAxesMask, Multibody, MultibodyIndex, MultibodyJoint, RigidBodyHandle,
};
use rapier3d::geometry::ColliderHandle;
use std::collections::HashSet;

/// The constraints between rigid bodies in one step.
#[derive(Default)]
pub(crate) struct RigidNeighbourhood {
    pub constraints: Vec<Constraint>,
    /// Impulse joints whose motors this step drives.
    pub driven: Vec<ImpulseJointHandle>,
    /// Multibody links whose joints' motors this step drives.
    pub driven_links: Vec<(MultibodyIndex, usize)>,
    articulations: HashSet<usize>,
    queue: Vec<RigidBodyHandle>,
    reached: HashSet<RigidBodyHandle>,
    pub(super) done: HashSet<RigidBodyHandle>,
    /// Obstacles near one.
    pub(super) near: Vec<u32>,
    pub(super) speculative: Vec<SpeculativePoint>,
}

/// Where a walk takes place.
pub(crate) struct WalkContext<'a> {
    pub scene: &'a mut RapierScene,
    pub candidates: &'a Candidates,
    pub context: StepContext<'a>,
    /// Bodies that the walk goes through at the most.
    pub limit: usize,
}

impl RigidNeighbourhood {
    /// Walks from the `touched` proxies.
    pub fn walk(&mut self, around: &mut WalkContext<'_>, touched: impl Iterator<Item = ProxyId>) {
        self.constraints.clear();
        self.driven.clear();
        self.driven_links.clear();
        self.articulations.clear();
        self.queue.clear();
        self.reached.clear();
        self.done.clear();
        if around.limit == 0 {
            return;
        }
        for proxy in touched {
            self.reach(around, proxy);
        }
        // Whichever soft body came first: the walk must not depend on it.
        self.queue.sort_unstable_by_key(|h| h.into_raw_parts());
        let mut next = 0;
        while let Some(&handle) = self.queue.get(next) {
            next += 1;
            self.add_contacts(handle, around);
            self.add_speculative_contacts(handle, around);
            self.add_joints(handle, around);
            self.add_articulation(handle, around);
            self.done.insert(handle);
        }
        self.constraints.sort_unstable_by_key(|constraint| constraint.key);
    }

    pub(super) fn reach(&mut self, around: &WalkContext<'_>, proxy: ProxyId) {
        let WalkContext { scene, limit, .. } = around;
        let Some(handle) = scene.handles[proxy.0 as usize] else { return };
        if scene.proxies.yields(proxy) && self.queue.len() < *limit && self.reached.insert(handle) {
            self.queue.push(handle);
        }
    }

    fn add_contacts(&mut self, handle: RigidBodyHandle, around: &mut WalkContext<'_>) {
        let sets = around.context.sets;
        let Some(body) = sets.bodies.get(handle) else { return };
        for &collider in body.colliders() {
            for pair in sets.narrow_phase.contact_pairs_with(collider) {
                let other = if pair.collider1 == collider { pair.collider2 } else { pair.collider1 };
                let other_body = sets.colliders.get(other).and_then(|c| c.parent());
                if other_body.is_some_and(|b| b == handle || self.done.contains(&b)) {
                    continue;
                }
                let endpoints = [pair.collider1, pair.collider2]
                    .map(|c| around.collider_proxy(c).zip(collider_pose(sets, c)));
                let [Some((first, pose1)), Some((second, pose2))] = endpoints else { continue };
                contact_constraints(pair, [first, second], [&pose1, &pose2], sets, &mut self.constraints);
                self.reach(around, first);
                self.reach(around, second);
            }
        }
    }

    fn add_joints(&mut self, handle: RigidBodyHandle, around: &mut WalkContext<'_>) {
        for (body1, body2, joint_handle, joint) in
            around.context.sets.impulse_joints.attached_enabled_joints(handle)
        {
            let other = if body1 == handle { body2 } else { body1 };
            if other == handle || self.done.contains(&other) {
                continue;
            }
            let Some(ends) = around.ends(JointName::Impulse(joint_handle), [body1, body2]) else { continue };
            let (proxies, h) = (&around.scene.proxies, around.context.h);
            joint_constraints(&joint.data, &ends, proxies, h, &mut self.constraints);
            if !joint.data.motor_axes.is_empty() {
                self.driven.push(joint_handle);
            }
            ends.proxies.into_iter().for_each(|proxy| self.reach(around, proxy));
        }
    }

    /// Limits and motors of the whole multibody that a link belongs to.
    fn add_articulation(&mut self, handle: RigidBodyHandle, around: &mut WalkContext<'_>) {
        let proxy = around.body_proxy(handle).map(|id| *around.scene.proxies.get(id));
        let Some(RigidProxy::Link { articulation, .. }) = proxy else { return };
        if !self.articulations.insert(articulation) {
            return;
        }
        for id in around.scene.proxies.articulations[articulation].links.clone() {
            self.reach(around, id);
        }
        let index = around.scene.articulated[articulation].multibody;
        let Some(multibody) = around.context.sets.multibody_joints.get_multibody(index) else { return };
        for link in multibody.links() {
            let Some(ends) = around.link_ends(multibody, link.link_id()) else { continue };
            let (proxies, h) = (&around.scene.proxies, around.context.h);
            drive_constraints(&link.joint.data, &ends, proxies, h, &mut self.constraints);
            if !link.joint.data.motor_axes.is_empty() {
                self.driven_links.push((index, link.link_id()));
            }
        }
        if !multibody.couplings().is_empty() {
            let idle = around.scene.world_proxy();
            let mut couplings = Vec::new();
            coupling_constraints(multibody, |link| around.link_ends(multibody, link), idle, &mut couplings);
            self.constraints.append(&mut couplings);
        }
    }
}

impl WalkContext<'_> {
    fn body_proxy(&mut self, body: RigidBodyHandle) -> Option<ProxyId> {
        self.scene.body_proxy(&self.context, body)
    }

    fn collider_proxy(&mut self, collider: ColliderHandle) -> Option<ProxyId> {
        self.scene.collider_proxy(&self.context, collider)
    }

    /// Those of the multibody joint that leads to a link.
    fn link_ends(&mut self, multibody: &Multibody, id: usize) -> Option<JointEnds> {
        let link = multibody.link(id)?;
        let parent = multibody.link(link.parent_id()?)?;
        let handles = [parent.rigid_body_handle(), link.rigid_body_handle()];
        let ends = self.ends(JointName::Multibody(handles[1]), handles)?;
        Some(JointEnds { coordinates: own_coordinates(&link.joint), ..ends })
    }

    /// Two bodies as a joint sees them.
    fn ends(&mut self, name: JointName, bodies: [RigidBodyHandle; 2]) -> Option<JointEnds> {
        let [first, second] = bodies.map(|b| self.body_proxy(b));
        let [pose1, pose2] =
            bodies.map(|b| Some(Pose64::from_real(self.context.sets.bodies.get(b)?.position())));
        Some(JointEnds { name, coordinates: None, proxies: [first?, second?], poses: [pose1?, pose2?] })
    }
}

/// Coordinates of a multibody joint that turns about one axis at the most; others' angles are no coordinates.
fn own_coordinates(joint: &MultibodyJoint) -> Option<[f64; 6]> {
    let free = (JointAxesMask::ANG_AXES & !joint.data.locked_axes).bits().count_ones();
    (free <= 1).then(|| joint.coords().map(f64::from))
}
