//! What else holds the rigid bodies that soft ones touch: rapier's own contacts and joints, as rows of
//! the same solve.
//!
//! A rigid body that stands on another, or hangs on a joint, yields as far as that lets it. Found by
//! a walk, breadth first, from the touched bodies through dynamic ones. What these rows carry is handed
//! to rapier with the rest, so that its own solver finds almost nothing left to do.

use super::joint_rows::{JointEnds, drive_rows, joint_rows};
use super::obstacles::RapierScene;
use super::parts::{RapierSets, packed, unpacked};
use crate::body::{ContactKey, FIRST_LINK_SLOT};
use crate::contact::{Candidates, Law, MeetingPoint, PartnerId, Row, Side, placed};
use crate::math::{Pose64, Vec3};
use crate::solver::Partner;
use rapier3d::dynamics::{ImpulseJointHandle, MultibodyIndex, RigidBodyHandle};
use rapier3d::geometry::{ColliderHandle, ContactPair, SolverFlags};
use rapier3d::math::Vector;
use std::collections::HashSet;

/// The rows between rigid bodies in one step.
#[derive(Default)]
pub(crate) struct Closure {
    pub rows: Vec<Row>,
    /// Impulse joints whose motors this step drives.
    pub driven: Vec<ImpulseJointHandle>,
    /// Multibody links whose joints' motors this step drives.
    pub driven_links: Vec<(MultibodyIndex, usize)>,
    articulations: HashSet<usize>,
    /// Pairs of colliders by what the keys of their rows hold, ascending.
    pub(super) pairs: Vec<((u64, u32), (ColliderHandle, ColliderHandle))>,
    queue: Vec<RigidBodyHandle>,
    reached: HashSet<RigidBodyHandle>,
    pub(super) done: HashSet<RigidBodyHandle>,
    /// Obstacles near one.
    pub(super) near: Vec<u32>,
    pub(super) meeting: Vec<MeetingPoint>,
}

/// Where a walk takes place, and how many bodies it goes through at the most.
pub(crate) struct Around<'a> {
    pub scene: &'a mut RapierScene,
    pub candidates: &'a Candidates,
    pub sets: RapierSets<'a>,
    pub gravity: Vector,
    /// \[s\].
    pub dt: f64,
    pub limit: usize,
}

/// What a row between rigid bodies belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ClosureSource {
    Contact(ColliderHandle, ColliderHandle),
    Joint(ImpulseJointHandle),
    Link(RigidBodyHandle),
}

/// Where in [`ContactKey::slot`] rows of rapier's contacts are told from those of its joints.
const CONTACT_SLOT: u32 = FIRST_LINK_SLOT;
/// As [`CONTACT_SLOT`].
const JOINT_SLOT: u32 = FIRST_LINK_SLOT + 1;
/// As [`CONTACT_SLOT`], of the joints of multibodies.
const LINK_SLOT: u32 = FIRST_LINK_SLOT + 2;
/// Share of a gap that may close in a step. What goes all the way rapier stops by itself in its last substep, of which
/// there are four by default, unevenly, and the impulses of that would push in the next step too.
const LANDING: f64 = 0.75;
/// Points of a manifold that keys tell apart.
pub(super) const POINTS: u32 = 1 << 16;

impl Closure {
    /// Walks from the `touched` partners.
    pub fn walk(&mut self, around: &mut Around<'_>, touched: impl Iterator<Item = PartnerId>) {
        self.rows.clear();
        self.driven.clear();
        self.driven_links.clear();
        self.articulations.clear();
        self.pairs.clear();
        self.queue.clear();
        self.reached.clear();
        self.done.clear();
        if around.limit == 0 {
            return;
        }
        for partner in touched {
            self.reach(around, partner);
        }
        // Whichever soft body came first: the walk must not depend on it.
        self.queue.sort_unstable_by_key(|h| h.into_raw_parts());
        let mut next = 0;
        while let Some(&handle) = self.queue.get(next) {
            next += 1;
            self.take_contacts(handle, around);
            self.take_approaches(handle, around);
            self.take_joints(handle, around);
            self.take_articulation(handle, around);
            self.done.insert(handle);
        }
        self.rows.sort_unstable_by_key(|row| row.key);
        self.pairs.sort_unstable_by_key(|(key, _)| *key);
    }

    /// What a row of the last walk belongs to.
    pub fn source(&self, key: &ContactKey) -> Option<ClosureSource> {
        let (index, generation) = unpacked(key.obstacle);
        match key.slot {
            CONTACT_SLOT => {
                let wanted = (key.obstacle, key.part);
                let place = self.pairs.binary_search_by_key(&wanted, |(key, _)| *key).ok()?;
                let (first, second) = self.pairs[place].1;
                Some(ClosureSource::Contact(first, second))
            }
            JOINT_SLOT => Some(ClosureSource::Joint(ImpulseJointHandle::from_raw_parts(index, generation))),
            LINK_SLOT => Some(ClosureSource::Link(RigidBodyHandle::from_raw_parts(index, generation))),
            _ => None,
        }
    }

    pub(super) fn reach(&mut self, around: &Around<'_>, partner: PartnerId) {
        let Around { scene, limit, .. } = around;
        let Some(handle) = scene.handles[partner.0 as usize] else { return };
        if scene.partners.yields(partner) && self.queue.len() < *limit && self.reached.insert(handle) {
            self.queue.push(handle);
        }
    }

    fn take_contacts(&mut self, handle: RigidBodyHandle, around: &mut Around<'_>) {
        let sets = around.sets;
        let Some(body) = sets.bodies.get(handle) else { return };
        for &collider in body.colliders() {
            for pair in sets.narrow_phase.contact_pairs_with(collider) {
                let other = if pair.collider1 == collider { pair.collider2 } else { pair.collider1 };
                let other_body = sets.colliders.get(other).and_then(|c| c.parent());
                if other_body.is_some_and(|b| b == handle || self.done.contains(&b)) {
                    continue;
                }
                let sides = [pair.collider1, pair.collider2]
                    .map(|c| around.collider_partner(c).zip(collider_pose(sets, c)));
                let [Some((first, pose1)), Some((second, pose2))] = sides else { continue };
                let key = contact_key([pair.collider1, pair.collider2]);
                self.pairs.push(((key.obstacle, key.part), (pair.collider1, pair.collider2)));
                contact_rows(pair, [first, second], [&pose1, &pose2], sets, &mut self.rows);
                self.reach(around, first);
                self.reach(around, second);
            }
        }
    }

    fn take_joints(&mut self, handle: RigidBodyHandle, around: &mut Around<'_>) {
        for (body1, body2, joint_handle, joint) in around.sets.impulse_joints.attached_enabled_joints(handle)
        {
            let other = if body1 == handle { body2 } else { body1 };
            if other == handle || self.done.contains(&other) {
                continue;
            }
            let Some(ends) = around.ends([body1, body2]) else { continue };
            let key = joint_key(joint_handle.into_raw_parts(), JOINT_SLOT);
            joint_rows(&joint.data, &ends, &around.scene.partners, around.dt, key, &mut self.rows);
            if !joint.data.motor_axes.is_empty() {
                self.driven.push(joint_handle);
            }
            ends.partners.into_iter().for_each(|partner| self.reach(around, partner));
        }
    }

    /// Limits and motors of the whole multibody that a link belongs to.
    fn take_articulation(&mut self, handle: RigidBodyHandle, around: &mut Around<'_>) {
        let partner = around.body_partner(handle).map(|id| *around.scene.partners.get(id));
        let Some(Partner::Link { articulation, .. }) = partner else { return };
        if !self.articulations.insert(articulation) {
            return;
        }
        for id in around.scene.partners.articulations[articulation].links.clone() {
            self.reach(around, id);
        }
        let index = around.scene.articulated[articulation].multibody;
        let Some(multibody) = around.sets.multibody_joints.get_multibody(index) else { return };
        for link in multibody.links() {
            let Some(parent) = link.parent_id().and_then(|id| multibody.link(id)) else { continue };
            let handles = [parent.rigid_body_handle(), link.rigid_body_handle()];
            let Some(ends) = around.ends(handles) else { continue };
            let key = joint_key(handles[1].into_raw_parts(), LINK_SLOT);
            drive_rows(&link.joint.data, &ends, &around.scene.partners, around.dt, key, &mut self.rows);
            if !link.joint.data.motor_axes.is_empty() {
                self.driven_links.push((index, link.link_id()));
            }
        }
    }
}

impl Around<'_> {
    fn body_partner(&mut self, body: RigidBodyHandle) -> Option<PartnerId> {
        self.scene.body_partner(self.sets, body, self.gravity, self.dt)
    }

    fn collider_partner(&mut self, collider: ColliderHandle) -> Option<PartnerId> {
        self.scene.collider_partner(self.sets, collider, self.gravity, self.dt)
    }

    /// Two bodies as a joint sees them.
    fn ends(&mut self, bodies: [RigidBodyHandle; 2]) -> Option<JointEnds> {
        let [first, second] = bodies.map(|b| self.body_partner(b));
        let [pose1, pose2] = bodies.map(|b| Some(Pose64::from_real(self.sets.bodies.get(b)?.position())));
        Some(JointEnds { partners: [first?, second?], poses: [pose1?, pose2?] })
    }
}

/// The key that the rows of a joint begin with.
fn joint_key(joint: (u32, u32), slot: u32) -> ContactKey {
    ContactKey { obstacle: packed(joint), part: 0, feature: 0, slot }
}

fn collider_pose(sets: RapierSets<'_>, handle: ColliderHandle) -> Option<Pose64> {
    let collider = sets.colliders.get(handle)?;
    let Some(body) = collider.parent().and_then(|b| sets.bodies.get(b)) else {
        return Some(Pose64::from_real(collider.position()));
    };
    let start = Pose64::from_real(body.position());
    let offset = collider.position_wrt_parent().map(Pose64::from_real);
    Some(offset.map_or(start, |offset| start.compose(&offset)))
}

/// The key that the rows of two colliders' contact begin with.
pub(super) fn contact_key(colliders: [ColliderHandle; 2]) -> ContactKey {
    let [first, second] = colliders.map(ColliderHandle::into_raw_parts);
    ContactKey { obstacle: packed(first), part: second.0, feature: 0, slot: CONTACT_SLOT }
}

/// The row between points of two partners, with a unit normal out of the first, friction and restitution. Overlaps
/// count as touching: they are rapier's to recover.
pub(super) fn contact_row(
    partners: [PartnerId; 2],
    points: [Vec3; 2],
    normal: &Vec3,
    gap: f64,
    (friction, restitution): (f64, f64),
    key: ContactKey,
) -> Row {
    let sides = [1, 0].map(|k| Side::Partner { partner: partners[k], point: points[k] });
    let mut row = Row::new(sides, *normal, LANDING * gap.max(0.0), key);
    row.law = Law::Contact { friction: friction.clamp(0.0, 1e4) };
    row.restitution = restitution.clamp(0.0, 1.0);
    row
}

/// The points of a pair that rapier solves for, at the present poses.
fn contact_rows(
    pair: &ContactPair,
    partners: [PartnerId; 2],
    poses: [&Pose64; 2],
    sets: RapierSets<'_>,
    rows: &mut Vec<Row>,
) {
    if !pair.has_any_active_contact() {
        return;
    }
    let skin = |c: ColliderHandle| sets.colliders.get(c).map_or(0.0, |c| f64::from(c.contact_skin()));
    let skins = skin(pair.collider1) + skin(pair.collider2);
    for (m, manifold) in (0u32..).zip(pair.manifolds()) {
        if !manifold.data.solver_flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES) {
            continue;
        }
        let (normal, points) = placed(manifold, poses);
        for (k, points) in (0u32..).zip(points) {
            let mut key = contact_key([pair.collider1, pair.collider2]);
            key.feature = (m % POINTS) * POINTS + k % POINTS;
            let gap = (points[1] - points[0]).dot(&normal) - skins;
            let coefficients = (manifold.data.friction.into(), manifold.data.restitution.into());
            rows.push(contact_row(partners, points, &normal, gap, coefficients, key));
        }
    }
}
