//! The verbs in their order.

use super::scratch::StepScratch;
use crate::body::{DeformableBody, DeformableBodySet, Sleep};
use crate::coupling::{DeformableHooks, PhysicsParts, StepContext};
use crate::math::from_real;
use crate::pipeline::{DeformableCounters, DeformableParameters};
use crate::profiler::Stopwatch;
use rapier3d::geometry::ColliderSet;

impl StepScratch {
    /// Steps all bodies and hands rapier what they do to its bodies.
    pub fn run(
        &mut self,
        parameters: &DeformableParameters,
        deformables: &mut DeformableBodySet,
        parts: &mut PhysicsParts<'_>,
        hooks: &dyn DeformableHooks,
    ) {
        self.collision_events.clear();
        self.contact_force_events.clear();
        self.counters = DeformableCounters::default();
        self.rigid_contacts.clear();
        self.joint_forces.clear();
        // If the last step was not ended by `after_step`, the users' forces are still ours to return.
        self.reactions.take_back(parts);
        let (gravity, dt) = (parts.gravity, parts.dt);
        if !(dt.is_finite() && dt > 0.0 && gravity.is_finite()) {
            self.contacts.clear();
            self.pair_contacts.clear();
            self.counters.skipped = true;
            return;
        }
        parts.wake(&deformables.take_released());
        let context = StepContext {
            sets: parts.sets(),
            gravity: from_real(gravity),
            h: f64::from(dt),
            substeps: parts.substeps,
            hooks,
        };
        self.solve_bodies(parameters, deformables, &context);
        let mut clock = Stopwatch::start();
        let asleep = &self.sleeping.rigid;
        self.reactions.write(parts, &self.scene, &self.reaction_list, &self.neighbourhood, asleep);
        parts.wake(&deformables.take_released());
        self.counters.advance_time += clock.lap();
    }

    fn solve_bodies(
        &mut self,
        parameters: &DeformableParameters,
        deformables: &mut DeformableBodySet,
        context: &StepContext<'_>,
    ) {
        let limits = parameters.contact_limits();
        let mut clock = Stopwatch::start();
        self.read_obstacles(context);
        self.sense(deformables, context);
        self.wake(deformables, context);
        self.predict(deformables, context, limits.recovery_speed * context.h);
        self.detect(deformables, context, 0);
        self.detect_soft_pairs(deformables, context);
        self.list_contacts_of_sleepers(deformables, context.sets.colliders);
        self.attach(deformables, context);
        self.walk_neighbourhood(context, parameters.neighbourhood_bodies);
        self.counters.detection_time = clock.lap();
        self.choose_integration_order(deformables, context);
        self.prepare_factors(deformables, parameters.column_budget);
        self.form_islands(deformables);
        self.counters.factor_time = clock.lap();
        self.solve(&limits, context.h);
        self.counters.solve_time = clock.lap();
        self.stop_tunnelling(&limits, context.h);
        self.carry_attached(deformables, context, &limits);
        self.advance(deformables, context.h);
        self.fall_asleep(deformables, context);
        self.tell_events(deformables, context);
        self.counters.advance_time = clock.lap();
    }

    /// What touches a sleeping body goes on to do so.
    fn list_contacts_of_sleepers(&mut self, deformables: &DeformableBodySet, colliders: &ColliderSet) {
        self.contacts.clear();
        self.pair_contacts.clear();
        let is_there = |collider| colliders.get(collider).is_some_and(|c| c.is_enabled());
        let sleeps = |body| deformables.get(body).is_some_and(DeformableBody::is_sleeping);
        for (_, body) in deformables.iter().filter(|(_, body)| body.is_sleeping()) {
            let Sleep { contacts, pair_contacts, .. } = &body.state.sleep;
            self.contacts.extend(contacts.iter().filter(|c| is_there(c.collider)));
            self.pair_contacts.extend(pair_contacts.iter().filter(|c| sleeps(c.body2)));
        }
    }
}
