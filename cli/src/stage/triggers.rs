//! When this, then that.

use super::Stage;
use super::drive::Motored;
use crate::scene::{Scene, Trigger, When};

impl Stage {
    /// Lets happen what is due after a step that ended at `time` \[s\]. Names were checked with the file.
    pub(crate) fn pull_triggers(&mut self, scene: &Scene, time: f64) {
        for (k, trigger) in scene.trigger.iter().enumerate() {
            let is_time =
                trigger.after.as_ref().is_none_or(|after| time >= f64::from(*after.as_ref()) - 1e-6);
            let is_so = |when: &When| {
                let on = when.on.as_ref().map(|on| on.as_ref().as_str());
                when.holds(self.measure(*when.quantity.as_ref(), when.of.as_ref(), on))
            };
            if !self.happened[k] && is_time && trigger.when.as_ref().is_none_or(|when| is_so(when.as_ref())) {
                self.happened[k] = true;
                self.pull(scene, trigger);
            }
        }
    }

    fn pull(&mut self, scene: &Scene, trigger: &Trigger) {
        for name in &trigger.release {
            let (name, bodies) = (name.as_ref(), &mut self.world.bodies);
            for (_, handle) in self.attachments.iter().filter(|(held, _)| held == name) {
                bodies.detach(*handle);
            }
            for (_, body) in self.deformable.iter().filter(|(own, _)| own == name) {
                let body = &mut bodies[*body];
                let pinned: Vec<usize> = body.pinned().collect();
                for vertex in pinned {
                    // It is pinned: nothing can be wrong with that.
                    let _ = body.unpin(vertex);
                }
            }
        }
        let joints: Vec<_> = scene.joint.iter().zip(self.joints.clone()).collect();
        for [one, other] in &trigger.cut {
            for (_, made) in joints.iter().filter(|(joint, _)| joint.is_between(one.as_ref(), other.as_ref()))
            {
                match *made {
                    Motored::Joint(handle) => drop(self.physics.impulse_joints.remove(handle, true)),
                    Motored::Link(handle) => self.physics.multibody_joints.remove(handle, true),
                }
            }
        }
        for switch in &trigger.switch {
            let [one, other] = switch.between.each_ref().map(|name| name.as_ref().as_str());
            for (joint, made) in joints.iter().filter(|(joint, _)| joint.is_between(one, other)) {
                self.set_motor(joint, *made, switch.velocity);
            }
        }
    }
}
