//! Who sleeps and who wakes.

use super::island_work::IslandWork;
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet, Partner, Surroundings};
use crate::contact::{Candidates, Law};
use crate::coupling::{RapierScene, RapierSets, StepContext, collider_handle, packed};
use crate::math::{Pose64, Vec3};
use crate::solver::ContactResult;
use rapier3d::dynamics::{RigidBody, RigidBodyHandle};

/// Where a body looks around.
pub(super) struct LookAround<'a> {
    pub scene: &'a RapierScene,
    pub candidates: &'a Candidates,
    pub context: &'a StepContext<'a>,
}

/// Memory for looking around.
#[derive(Default)]
pub(super) struct Sleeping {
    near: Vec<u32>,
    now: Surroundings,
    wake: Vec<DeformableBodyHandle>,
    /// Bodies that fall asleep at the start of this step, as their users have asked for.
    pub asked: Vec<DeformableBodyHandle>,
    /// Rigid bodies that fall asleep with the soft ones in this step.
    pub rigid: Vec<RigidBodyHandle>,
}

impl Sleeping {
    /// Wakes bodies whose attachments or cables were changed, or are to a rigid body that is awake.
    fn wake_attached(&mut self, deformables: &mut DeformableBodySet, sets: RapierSets<'_>) {
        let moves = |body: &RigidBody| {
            let led = body.is_kinematic() && body.next_position() != body.position();
            led || body.is_moving() && !body.is_sleeping()
        };
        self.wake.clear();
        for attachment in deformables.attachments_mut() {
            self.wake.extend(attachment.take_changed().into_iter().flatten());
            if attachment.is_broken() || attachment.rigid().is_none() {
                continue;
            }
            let rigid = attachment.rigid().and_then(|handle| sets.bodies.get(handle));
            // Moved by its user, or gone.
            let moved = attachment.notice(rigid.map(|body| Pose64::from_real(body.position())));
            if moved || rigid.is_some_and(moves) {
                self.wake.push(attachment.body());
            }
        }
        for (_, cable) in deformables.cables_mut() {
            let pose = |handle| Some(Pose64::from_real(sets.bodies.get(handle)?.position()));
            let changed = cable.take_changed(pose);
            let mut rigid = cable.rigid_bodies().filter_map(|handle| sets.bodies.get(handle));
            if changed || rigid.any(moves) {
                self.wake.extend(cable.bodies());
            }
        }
        self.wake_listed(deformables);
    }

    /// Wakes bodies that are attached to one that is awake, or fell asleep touching one that is not asleep any
    /// more.
    pub fn wake_together(&mut self, deformables: &mut DeformableBodySet) {
        loop {
            self.wake.clear();
            for (_, attachment) in deformables.attachments().filter(|(_, a)| !a.is_broken()) {
                let [Some(one), Some(other)] = attachment.bodies() else { continue };
                let (Some(a), Some(b)) = (deformables.get(one), deformables.get(other)) else { continue };
                if a.is_enabled() && b.is_enabled() && a.is_sleeping() != b.is_sleeping() {
                    self.wake.push(if a.is_sleeping() { one } else { other });
                }
            }
            for (_, cable) in deformables.cables() {
                let sleeps = |body| deformables.get(body).is_some_and(|b| b.is_enabled() && b.is_sleeping());
                if !cable.bodies().all(sleeps) {
                    self.wake.extend(cable.bodies().filter(|body| sleeps(*body)));
                }
            }
            for (handle, body) in deformables.iter() {
                let Some(around) = &body.state.sleep.surroundings else { continue };
                let sleeps = |mate| deformables.get(mate).is_some_and(|b| b.is_enabled() && b.is_sleeping());
                if !around.mate.is_none_or(sleeps) {
                    self.wake.push(handle);
                }
            }
            if self.wake.is_empty() {
                return;
            }
            self.wake_listed(deformables);
        }
    }

    fn wake_listed(&mut self, deformables: &mut DeformableBodySet) {
        for handle in &self.wake {
            if let Some(body) = deformables.get_mut(*handle).filter(|body| body.is_sleeping()) {
                body.wake_up();
            }
        }
    }

    /// Wakes whoever has a reason to: a changed attachment, anything around it that is not as it was when
    /// it fell asleep, an attachment to a body that is awake, a touching body that woke or went.
    pub fn wake(
        &mut self,
        deformables: &mut DeformableBodySet,
        scene: &RapierScene,
        candidates: &Candidates,
        context: &StepContext<'_>,
    ) {
        let around = LookAround { scene, candidates, context };
        self.put_to_sleep(deformables, &around);
        self.wake_attached(deformables, context.sets);
        for (_, body) in deformables.iter_mut().filter(|(_, body)| body.is_enabled() && body.is_sleeping()) {
            self.look_around(body, &around);
            let before = body.state.sleep.surroundings.as_ref();
            if !before.is_some_and(|before| before.is_around(&self.now)) {
                body.wake_up();
            }
        }
        self.wake_together(deformables);
    }

    /// Lets bodies fall asleep whose users have put them to sleep, with what they touched that sleeps too: what carries them
    /// wakes them when it goes.
    fn put_to_sleep(&mut self, deformables: &mut DeformableBodySet, around: &LookAround<'_>) {
        let asked = deformables.iter().filter(|(_, body)| body.is_enabled() && body.is_asked_to_sleep());
        self.asked.clear();
        self.asked.extend(asked.map(|(handle, _)| handle));
        for k in 0..self.asked.len() {
            let handle = self.asked[k];
            let name = |handle: DeformableBodyHandle| Partner::Soft(packed(handle.into_raw_parts()));
            let touches = |body: &DeformableBody, partner: Partner| {
                body.state
                    .contacts
                    .iter()
                    .any(|c| c.force != Vec3::zeros() && c.key.partner() == Some(partner))
            };
            let own = &deformables[handle];
            let mate = deformables.iter().find(|(other, body)| {
                *other != handle
                    && body.is_sleeping()
                    && (touches(body, name(handle)) || touches(own, name(*other)))
            });
            let mate = mate.map(|(other, _)| other);
            let sets = around.context.sets;
            let rigid = own.state.contacts.iter().filter_map(|c| match c.key.partner()? {
                Partner::Collider(collider) => sets.colliders.get(collider_handle(collider))?.parent(),
                Partner::Soft(_) => None,
            });
            let is_asleep = |handle: &RigidBodyHandle| {
                sets.bodies.get(*handle).is_some_and(|body| body.is_dynamic() && body.is_sleeping())
            };
            let mut rigid: Vec<RigidBodyHandle> = rigid.filter(is_asleep).collect();
            rigid.dedup();
            let body = &mut deformables[handle];
            self.look_around(body, around);
            (self.now.mate, self.now.rigid) = (mate, rigid);
            body.fall_asleep(self.now.clone());
        }
    }

    fn look_around(&mut self, body: &DeformableBody, around: &LookAround<'_>) {
        let LookAround { scene, candidates, context } = around;
        candidates.around(&body.state.x, &mut self.near);
        self.now.obstacles.clear();
        for obstacle in self.near.iter().map(|&o| &scene.obstacles[o as usize]) {
            self.now.obstacles.push((obstacle.key, obstacle.part, obstacle.start));
        }
        self.now.obstacles.sort_unstable_by_key(|(key, part, _)| (*key, *part));
        self.now.gravity = context.gravity;
    }

    /// Lets an island fall asleep of which every part has been still for long enough.
    pub fn fall_asleep(
        &mut self,
        island: &IslandWork,
        handles: &[DeformableBodyHandle],
        deformables: &mut DeformableBodySet,
        around: &LookAround<'_>,
    ) {
        let LookAround { scene, context, .. } = around;
        let rested = |h: &DeformableBodyHandle| deformables.get(*h).is_some_and(DeformableBody::has_rested);
        if !handles.iter().all(rested) {
            return;
        }
        // What a belt carries moves on, however slowly.
        let runs = |c: ContactResult<'_>| c.constraint.surface_motion != Vec3::zeros();
        if island.island.contacts.results().any(runs) {
            return;
        }
        let first = self.rigid.len();
        // What is only about to meet another rigid body stays awake.
        let touching = |contact: &ContactResult<'_>| {
            let constraint = contact.constraint;
            let between_rigid = constraint.key.is_shared() && matches!(constraint.law, Law::Contact { .. });
            !between_rigid || contact.force != Vec3::zeros()
        };
        let touching = island.island.contacts.results().filter(touching);
        for endpoint in touching.flat_map(|contact| &contact.constraint.endpoints) {
            let Some(proxy) = endpoint.proxy().filter(|p| scene.proxies.yields(*p)) else { continue };
            let Some(handle) = scene.handles[proxy.0 as usize] else { continue };
            if !scene.is_still(context.sets, handle) {
                self.rigid.truncate(first);
                return;
            }
            if !self.rigid[first..].contains(&handle) {
                self.rigid.push(handle);
            }
        }
        self.now.rigid.clear();
        self.now.rigid.extend_from_slice(&self.rigid[first..]);
        for (k, handle) in handles.iter().enumerate() {
            let Some(body) = deformables.get_mut(*handle) else { continue };
            self.look_around(body, around);
            let mate = handles[(k + 1) % handles.len()];
            self.now.mate = (mate != *handle).then_some(mate);
            body.fall_asleep(self.now.clone());
        }
    }
}
