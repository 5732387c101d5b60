//! What else holds the rigid bodies that soft ones touch: rapier's own contacts and joints, as rows of
//! the same solve.
//!
//! A rigid body that stands on another, or hangs on a joint, yields as far as that lets it. Found by
//! a walk, breadth first, from the touched bodies through dynamic ones. What these rows carry is handed
//! to rapier with the rest, so that its own solver finds almost nothing left to do.

use super::joint_rows::{JointEnds, drive_rows, joint_rows};
use super::obstacles::RapierScene;
use super::parts::RapierSets;
use crate::body::{ContactKey, FIRST_LINK_SLOT};
use crate::contact::{Law, PartnerId, Row, Side};
use crate::math::{Pose64, from_real};
use crate::solver::Partner;
use rapier3d::dynamics::{ImpulseJointHandle, MultibodyIndex, RigidBodyHandle};
use rapier3d::geometry::{ColliderHandle, ContactManifold, ContactPair, SolverFlags};
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
    pairs: Vec<((u64, u32), (ColliderHandle, ColliderHandle))>,
    queue: Vec<RigidBodyHandle>,
    reached: HashSet<RigidBodyHandle>,
    done: HashSet<RigidBodyHandle>,
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
/// Points of a manifold that keys tell apart.
const POINTS: u32 = 1 << 16;

impl Closure {
    /// Walks from the `touched` partners; at most `limit` bodies are walked through.
    pub fn walk(
        &mut self,
        scene: &mut RapierScene,
        sets: RapierSets<'_>,
        touched: impl Iterator<Item = PartnerId>,
        gravity: Vector,
        dt: f64,
        limit: usize,
    ) {
        self.rows.clear();
        self.driven.clear();
        self.driven_links.clear();
        self.articulations.clear();
        self.pairs.clear();
        self.queue.clear();
        self.reached.clear();
        self.done.clear();
        if limit == 0 {
            return;
        }
        for partner in touched {
            self.reach(scene, partner, limit);
        }
        // Whichever soft body came first: the walk must not depend on it.
        self.queue.sort_unstable_by_key(|h| h.into_raw_parts());
        let mut next = 0;
        while let Some(&handle) = self.queue.get(next) {
            next += 1;
            self.take_contacts(handle, scene, sets, gravity, dt, limit);
            self.take_joints(handle, scene, sets, gravity, dt, limit);
            self.take_articulation(handle, scene, sets, gravity, dt, limit);
            self.done.insert(handle);
        }
        self.rows.sort_unstable_by_key(|row| row.key);
        self.pairs.sort_unstable_by_key(|(key, _)| *key);
    }

    /// What a row of the last walk belongs to.
    pub fn source(&self, key: &ContactKey) -> Option<ClosureSource> {
        let (index, generation) = ((key.obstacle >> 32) as u32, key.obstacle as u32);
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

    fn reach(&mut self, scene: &RapierScene, partner: PartnerId, limit: usize) {
        let Some(handle) = scene.handles[partner.0 as usize] else { return };
        if scene.partners.yields(partner) && self.queue.len() < limit && self.reached.insert(handle) {
            self.queue.push(handle);
        }
    }

    fn take_contacts(
        &mut self,
        handle: RigidBodyHandle,
        scene: &mut RapierScene,
        sets: RapierSets<'_>,
        gravity: Vector,
        dt: f64,
        limit: usize,
    ) {
        let Some(body) = sets.bodies.get(handle) else { return };
        for &collider in body.colliders() {
            for pair in sets.narrow_phase.contact_pairs_with(collider) {
                let other = if pair.collider1 == collider { pair.collider2 } else { pair.collider1 };
                let other_body = sets.colliders.get(other).and_then(|c| c.parent());
                if other_body.is_some_and(|b| b == handle || self.done.contains(&b)) {
                    continue;
                }
                let sides = [pair.collider1, pair.collider2]
                    .map(|c| scene.collider_partner(sets, c, gravity, dt).zip(collider_pose(sets, c)));
                let [Some((first, pose1)), Some((second, pose2))] = sides else { continue };
                let (index, generation) = pair.collider1.into_raw_parts();
                let key = (u64::from(index) << 32 | u64::from(generation), pair.collider2.into_raw_parts().0);
                self.pairs.push((key, (pair.collider1, pair.collider2)));
                contact_rows(pair, [first, second], [&pose1, &pose2], sets, &mut self.rows);
                self.reach(scene, first, limit);
                self.reach(scene, second, limit);
            }
        }
    }

    fn take_joints(
        &mut self,
        handle: RigidBodyHandle,
        scene: &mut RapierScene,
        sets: RapierSets<'_>,
        gravity: Vector,
        dt: f64,
        limit: usize,
    ) {
        for (body1, body2, joint_handle, joint) in sets.impulse_joints.attached_enabled_joints(handle) {
            let other = if body1 == handle { body2 } else { body1 };
            if other == handle || self.done.contains(&other) {
                continue;
            }
            let ends = [body1, body2].map(|b| scene.body_partner(sets, b, gravity, dt));
            let poses = [body1, body2].map(|b| sets.bodies.get(b).map(|b| Pose64::from_real(b.position())));
            let ([Some(first), Some(second)], [Some(pose1), Some(pose2)]) = (ends, poses) else { continue };
            let (index, generation) = joint_handle.into_raw_parts();
            let key = ContactKey {
                obstacle: u64::from(index) << 32 | u64::from(generation),
                part: 0,
                feature: 0,
                slot: JOINT_SLOT,
            };
            let ends = JointEnds { partners: [first, second], poses: [pose1, pose2] };
            joint_rows(&joint.data, &ends, &scene.partners, dt, key, &mut self.rows);
            if !joint.data.motor_axes.is_empty() {
                self.driven.push(joint_handle);
            }
            self.reach(scene, first, limit);
            self.reach(scene, second, limit);
        }
    }
}

impl Closure {
    /// Limits and motors of the whole multibody that a link belongs to.
    fn take_articulation(
        &mut self,
        handle: RigidBodyHandle,
        scene: &mut RapierScene,
        sets: RapierSets<'_>,
        gravity: Vector,
        dt: f64,
        limit: usize,
    ) {
        let partner = scene.body_partner(sets, handle, gravity, dt).map(|id| *scene.partners.get(id));
        let Some(Partner::Link { articulation, .. }) = partner else { return };
        if !self.articulations.insert(articulation) {
            return;
        }
        for id in scene.partners.articulations[articulation].links.clone() {
            self.reach(scene, id, limit);
        }
        let index = scene.articulated[articulation].multibody;
        let Some(multibody) = sets.multibody_joints.get_multibody(index) else { return };
        for link in multibody.links() {
            let Some(parent) = link.parent_id().and_then(|id| multibody.link(id)) else { continue };
            let handles = [parent.rigid_body_handle(), link.rigid_body_handle()];
            let ends = handles.map(|b| scene.body_partner(sets, b, gravity, dt));
            let poses = handles.map(|b| sets.bodies.get(b).map(|b| Pose64::from_real(b.position())));
            let ([Some(first), Some(second)], [Some(pose1), Some(pose2)]) = (ends, poses) else { continue };
            let (body, generation) = handles[1].into_raw_parts();
            let key = ContactKey {
                obstacle: u64::from(body) << 32 | u64::from(generation),
                part: 0,
                feature: 0,
                slot: LINK_SLOT,
            };
            let ends = JointEnds { partners: [first, second], poses: [pose1, pose2] };
            drive_rows(&link.joint.data, &ends, &scene.partners, dt, key, &mut self.rows);
            if !link.joint.data.motor_axes.is_empty() {
                self.driven_links.push((index, link.link_id()));
            }
        }
    }
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

/// The points of a pair that rapier solves for, at the present poses. Overlaps count as touching: they
/// are rapier's to recover.
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
    let (index, generation) = pair.collider1.into_raw_parts();
    for (m, manifold) in (0u32..).zip(pair.manifolds()) {
        if !manifold.data.solver_flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES) {
            continue;
        }
        let offset = |pose: &Pose64, which: usize| subshape_pose(manifold, which, pose);
        let (pose1, pose2) = (offset(poses[0], 0), offset(poses[1], 1));
        let normal = pose1.rotation * from_real(manifold.local_n1);
        for (k, point) in (0u32..).zip(&manifold.points) {
            let p1 = pose1.transform(&from_real(point.local_p1));
            let p2 = pose2.transform(&from_real(point.local_p2));
            let key = ContactKey {
                obstacle: u64::from(index) << 32 | u64::from(generation),
                part: pair.collider2.into_raw_parts().0,
                feature: (m % POINTS) * POINTS + k % POINTS,
                slot: CONTACT_SLOT,
            };
            let sides = [
                Side::Partner { partner: partners[1], point: p2 },
                Side::Partner { partner: partners[0], point: p1 },
            ];
            let gap = ((p2 - p1).dot(&normal) - skins).max(0.0);
            let mut row = Row::new(sides, normal, gap, key);
            row.law = Law::Contact { friction: f64::from(manifold.data.friction).clamp(0.0, 1e4) };
            row.restitution = f64::from(manifold.data.restitution).clamp(0.0, 1.0);
            rows.push(row);
        }
    }
}

/// Where a shape of a manifold is: composite shapes place their parts.
fn subshape_pose(manifold: &ContactManifold, which: usize, pose: &Pose64) -> Pose64 {
    let Some(parts) = &manifold.subshape_poses else { return *pose };
    let part = if which == 0 { &parts.pos1 } else { &parts.pos2 };
    part.as_ref().map_or(*pose, |part| pose.compose(&Pose64::from_real(part)))
}
