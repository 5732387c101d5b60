//! Who sleeps and who wakes.

use super::work::IslandWork;
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet, Surroundings, TIME_UNTIL_SLEEP};
use crate::contact::Candidates;
use crate::coupling::{RapierScene, RapierSets};
use crate::math::Vec3;
use rapier3d::dynamics::RigidBodyHandle;

/// Memory for looking around.
#[derive(Default)]
pub(super) struct Sleeping {
    near: Vec<u32>,
    now: Surroundings,
    wake: Vec<DeformableBodyHandle>,
    /// Rigid bodies that fall asleep with the soft ones in this step.
    pub rigid: Vec<RigidBodyHandle>,
}

impl Sleeping {
    /// Wakes bodies whose attachments were changed, or are to a rigid body that is awake.
    pub fn wake_attached(&mut self, deformables: &mut DeformableBodySet, sets: RapierSets<'_>) {
        self.wake.clear();
        for attachment in deformables.attachments_mut() {
            self.wake.extend(attachment.take_changed().into_iter().flatten());
            let rigid = attachment.rigid().and_then(|handle| sets.bodies.get(handle));
            if rigid.is_some_and(|body| body.is_moving() && !body.is_sleeping()) {
                self.wake.push(attachment.body());
            }
        }
        for handle in &self.wake {
            if let Some(body) = deformables.get_mut(*handle).filter(|body| body.is_sleeping()) {
                body.wake_up();
            }
        }
    }

    /// Wakes a body if anything around it is not as it was when it fell asleep; tells whether it sleeps
    /// on.
    pub fn sleeps_on(
        &mut self,
        body: &mut DeformableBody,
        scene: &RapierScene,
        candidates: &Candidates,
        gravity: &Vec3,
        dt: f64,
    ) -> bool {
        if !body.is_sleeping() {
            return false;
        }
        self.look_around(body, scene, candidates, gravity, dt);
        if body.state.sleep.surroundings.as_ref() == Some(&self.now) {
            return true;
        }
        body.wake_up();
        false
    }

    fn look_around(
        &mut self,
        body: &DeformableBody,
        scene: &RapierScene,
        candidates: &Candidates,
        gravity: &Vec3,
        dt: f64,
    ) {
        candidates.around(&body.state.x, &mut self.near);
        self.now.obstacles.clear();
        for obstacle in self.near.iter().map(|&o| &scene.obstacles[o as usize]) {
            self.now.obstacles.push((obstacle.key, obstacle.part, obstacle.start));
        }
        self.now.obstacles.sort_unstable_by_key(|(key, part, _)| (*key, *part));
        (self.now.gravity, self.now.dt) = (*gravity, dt);
    }

    /// Lets an island fall asleep of which every part has been still for long enough.
    pub fn fall_asleep(
        &mut self,
        island: &IslandWork,
        handles: &[DeformableBodyHandle],
        deformables: &mut DeformableBodySet,
        scene: &RapierScene,
        candidates: &Candidates,
        sets: RapierSets<'_>,
        gravity: &Vec3,
        dt: f64,
    ) {
        let rested = |h: &DeformableBodyHandle| {
            deformables.get(*h).is_some_and(|b| b.state.sleep.still_for >= TIME_UNTIL_SLEEP)
        };
        if !handles.iter().all(rested) {
            return;
        }
        let first = self.rigid.len();
        for side in island.island.contacts.rows.iter().flat_map(|row| &row.sides) {
            let Some(partner) = side.partner().filter(|p| scene.partners.yields(*p)) else { continue };
            let Some(handle) = scene.handles[partner.0 as usize] else { continue };
            if !scene.is_still(sets, handle) {
                self.rigid.truncate(first);
                return;
            }
            if !self.rigid[first..].contains(&handle) {
                self.rigid.push(handle);
            }
        }
        for handle in handles {
            let Some(body) = deformables.get_mut(*handle) else { continue };
            self.look_around(body, scene, candidates, gravity, dt);
            body.fall_asleep(self.now.clone());
        }
    }
}
