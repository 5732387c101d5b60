//! Deformable bodies beside a rapier `PhysicsWorld`.

use super::contacts::{RigidContact, SolvedJoint};
use super::events::{DeformableCollisionEvent, DeformableContactForceEvent, DeformableEventHandler};
use super::parameters::{DeformableCounters, DeformableParameters};
use super::pipeline::DeformablePipeline;
use crate::body::{
    DeformableBody, DeformableBodyBuilder, DeformableBodyHandle, DeformableBodySet, DeformableContact,
    DeformableContactPartner, DeformablePairContact,
};
use crate::coupling::{DeformableActuators, DeformableColliders, DeformableHooks, PhysicsParts};
use crate::error::DeformableBodyError;
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsWorld;

/// All deformable bodies of a scene, stepped together with a rapier world. `dt` and gravity are the
/// rapier world's: one truth.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut physics = PhysicsWorld::new();
/// let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
/// let mut deformables = DeformableWorld::new();
/// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3, 3, 3]).translation(Vector::Y * 0.31);
/// let cube = deformables.insert(cube.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(2.0)))?;
/// for _ in 0..180 {
///     deformables.step(&mut physics);
/// }
/// let carried = deformables.contact_force(cube, floor);
/// assert!((carried.y - 64.0 * 9.81).abs() < 0.1);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableWorld {
    /// The bodies.
    pub bodies: DeformableBodySet,
    /// World-wide parameters.
    pub parameters: DeformableParameters,
    /// Colliders with which rapier's queries, character controllers and vehicles see the bodies; none unless asked for, as
    /// they are refitted in every step.
    pub query_colliders: Option<DeformableColliders>,
    /// What drives the scene, by name.
    pub actuators: DeformableActuators,
    /// Memory and caches of the step.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub pipeline: DeformablePipeline,
}

/// Of what the world holds; the copy makes its caches anew.
impl Clone for DeformableWorld {
    fn clone(&self) -> Self {
        Self {
            bodies: self.bodies.clone(),
            parameters: self.parameters,
            query_colliders: self.query_colliders.clone(),
            actuators: self.actuators.clone(),
            pipeline: DeformablePipeline::new(),
        }
    }
}

impl DeformableWorld {
    /// An empty world.
    pub fn new() -> Self {
        Self::default()
    }

    /// Builds a body and takes it in.
    ///
    /// # Errors
    /// As [`DeformableBodyBuilder::build`].
    pub fn insert(
        &mut self,
        builder: DeformableBodyBuilder,
    ) -> Result<DeformableBodyHandle, DeformableBodyError> {
        self.bodies.insert(builder)
    }

    /// Takes a body out.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn remove(&mut self, handle: DeformableBodyHandle) -> Result<DeformableBody, DeformableBodyError> {
        self.bodies.remove(handle)
    }

    /// Makes factors and contact columns for the coming steps ahead of time, so that a first touch
    /// takes no longer than a later one.
    ///
    /// # Errors
    /// [`DeformableBodyError::TimeStep`] if the world's `dt` is not positive and finite.
    pub fn prepare(&mut self, physics: &PhysicsWorld) -> Result<(), DeformableBodyError> {
        self.pipeline.prepare(&self.bodies, physics.integration_parameters.dt)
    }

    /// One step: deformables, reactions, then rapier.
    pub fn step(&mut self, physics: &mut PhysicsWorld) {
        self.step_with_events(physics, &(), &());
    }

    /// One step, with hooks and an event handler, for pairs with deformable bodies and for rapier's own. A handler of
    /// rapier's serves with an empty `impl` of [`DeformableEventHandler`], hooks with one of [`DeformableHooks`].
    pub fn step_with_events(
        &mut self,
        physics: &mut PhysicsWorld,
        hooks: &dyn DeformableHooks,
        events: &dyn DeformableEventHandler,
    ) {
        let mut parts = PhysicsParts::from(&mut *physics);
        self.actuators.apply(&mut self.bodies, &mut parts);
        self.pipeline.before_step_with_hooks(&self.parameters, &mut self.bodies, &mut parts, hooks);
        self.pipeline.send_events(&self.bodies, &physics.colliders, events);
        if let Some(colliders) = &mut self.query_colliders {
            let gone = colliders.update(&self.bodies, &mut physics.colliders);
            gone.into_iter().for_each(|collider| drop(physics.remove_collider(collider)));
        }
        physics.step_with_events(hooks, events);
        self.pipeline.after_step(&mut PhysicsParts::from(physics));
    }

    /// What has started and stopped touching deformable bodies in the last step.
    pub fn collision_events(&self) -> &[DeformableCollisionEvent] {
        self.pipeline.collision_events()
    }

    /// Forces between deformable bodies and others that were above their thresholds in the last step.
    pub fn contact_force_events(&self) -> &[DeformableContactForceEvent] {
        self.pipeline.contact_force_events()
    }

    /// Contacts of the last step; of sleeping bodies those with which they fell asleep.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut physics = PhysicsWorld::new();
    /// let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
    /// let mut deformables = DeformableWorld::new();
    /// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(Vector::Y * 0.2);
    /// let cube = deformables.insert(cube.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0)))?;
    /// for _ in 0..120 {
    ///     deformables.step(&mut physics);
    /// }
    /// // Where it is pressed most, by what, and how deep it is there.
    /// let most = deformables.contacts().iter().max_by(|a, b| a.force.length().total_cmp(&b.force.length()));
    /// let most = most.expect("it lies on the floor");
    /// assert_eq!((most.body, most.collider), (cube, floor));
    /// assert!(most.normal.y > 0.999 && (most.point.y - 0.1).abs() < 1.0e-4 && most.gap.abs() < 1.0e-4);
    /// // All of them together.
    /// let carried = deformables.contact_force(cube, floor);
    /// assert!((carried.y - 8.0 * 9.81).abs() < 0.1);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn contacts(&self) -> &[DeformableContact] {
        self.pipeline.contacts()
    }

    /// Contacts of the last step with one collider.
    pub fn contacts_with(&self, collider: ColliderHandle) -> impl Iterator<Item = &DeformableContact> {
        self.contacts().iter().filter(move |c| c.collider == collider)
    }

    /// Contacts of the last step of one body.
    pub fn contacts_of(&self, body: DeformableBodyHandle) -> impl Iterator<Item = &DeformableContact> {
        self.contacts().iter().filter(move |c| c.body == body)
    }

    /// Force \[N\] of a collider on a body in the last step: the sum of [`DeformableWorld::contacts`] between them.
    pub fn contact_force(&self, body: DeformableBodyHandle, collider: ColliderHandle) -> Vector {
        let pair = self.contacts_of(body).filter(|c| c.collider == collider);
        pair.map(|c| c.force).sum()
    }

    /// Contacts between deformable bodies in the last step, and of bodies with themselves.
    pub fn pair_contacts(&self) -> &[DeformablePairContact] {
        self.pipeline.pair_contacts()
    }

    /// Force \[N\] on the first body from the second in the last step.
    pub fn pair_force(&self, first: DeformableBodyHandle, second: DeformableBodyHandle) -> Vector {
        let forces = self.pair_contacts().iter().filter_map(|c| match (c.body1, c.body2) {
            ends if ends == (first, second) => Some(c.force),
            ends if ends == (second, first) => Some(-c.force),
            _ => None,
        });
        forces.sum()
    }

    /// Calls `f` with every contact of the last step that a body has: what it touched, where \[m\], the force on the body \[N\], and the
    /// vertices that share it.
    pub(crate) fn for_each_contact_force(
        &self,
        body: DeformableBodyHandle,
        mut f: impl FnMut(DeformableContactPartner, Vector, Vector, &[usize; 3], &[f64; 3]),
    ) {
        for contact in self.contacts_of(body) {
            let partner = DeformableContactPartner::Collider(contact.collider);
            f(partner, contact.point, contact.force, &contact.vertices, &contact.weights);
        }
        for contact in self.pair_contacts() {
            let ends = [contact.body1, contact.body2];
            for side in (0..2).filter(|side| ends[*side] == body) {
                let force = if side == 0 { contact.force } else { -contact.force };
                let partner = DeformableContactPartner::Deformable(ends[1 - side]);
                f(partner, contact.point, force, &contact.vertices[side], &contact.weights[side]);
            }
        }
    }

    /// Force per area \[Pa\] of all contacts of the last step on each vertex of a body, those with deformable bodies and itself
    /// included: times [`DeformableBody::vertex_areas`] it sums to the contact forces, in the solver's precision. Zero at vertices without a
    /// surface.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn contact_tractions(
        &self,
        body: DeformableBodyHandle,
    ) -> Result<Vec<[f64; 3]>, DeformableBodyError> {
        let areas = self.bodies.get(body).ok_or_else(|| body.no_such_body())?.vertex_areas();
        let mut tractions = vec![[0.0; 3]; areas.len()];
        self.for_each_contact_force(body, |_, _, force, vertices, weights| {
            for (vertex, weight) in vertices.iter().zip(weights) {
                // Contacts of a damaged snapshot may name any vertex.
                if let Some(area) = areas.get(*vertex).filter(|area| **area > 0.0) {
                    let own = tractions[*vertex].iter_mut().zip(force.to_array());
                    let share = weight / area;
                    own.for_each(|(t, f)| *t += f64::from(f) * share);
                }
            }
        });
        Ok(tractions)
    }

    /// Area \[m²\] on which contacts of the last step press a body: that of the triangles of its surface all of whose corners they
    /// press. What is touched at points and along edges has none.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn contact_area(&self, body: DeformableBodyHandle) -> Result<f64, DeformableBodyError> {
        let is_pressed: Vec<bool> = self.contact_tractions(body)?.iter().map(|t| *t != [0.0; 3]).collect();
        let body = self.bodies.get(body).ok_or_else(|| body.no_such_body())?;
        Ok(body.area_within(|vertex| is_pressed[vertex]))
    }

    /// Contacts between rigid bodies that the last step solved: of those that deformables touch, or that
    /// hold such. What rapier's own contacts show is their remainder.
    pub fn rigid_contacts(&self) -> &[RigidContact] {
        self.pipeline.rigid_contacts()
    }

    /// Force \[N\] or moment \[N m\] of one axis of a joint that the last step solved: locks, limits and
    /// motors together, on its second body. Zero for joints that it did not solve.
    pub fn joint_force(&self, joint: SolvedJoint, axis: usize) -> f64 {
        let forces = self.pipeline.joint_forces().iter();
        forces.filter(|f| f.joint == joint && f.axis == axis).map(|f| f.force).sum()
    }

    /// What the last step did, and how long it took.
    pub fn counters(&self) -> &DeformableCounters {
        self.pipeline.counters()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_that_is_no_number_is_quarantined_until_it_is_enabled_again() {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let cube = || DeformableBodyBuilder::cuboid(Vector::splat(0.2), [2, 2, 2]);
        let (bad, good) = (world.insert(cube()).unwrap(), world.insert(cube()).unwrap());
        let sound = world.bodies[bad].state().clone();
        world.bodies[bad].state.x[3].y = f64::NAN;
        world.step(&mut physics);
        assert_eq!(world.counters().quarantined, 1);
        assert!(world.bodies[bad].is_quarantined() && !world.bodies[good].is_quarantined());
        world.step(&mut physics);
        assert_eq!((world.counters().quarantined, world.counters().bodies), (0, 1));
        world.bodies[bad].restore(sound).unwrap();
        world.bodies[bad].set_enabled(true);
        world.step(&mut physics);
        // After a step there is a state to go back to.
        let before = world.bodies[bad].state().x.clone();
        world.bodies[bad].state.v[0].x = f64::INFINITY;
        world.step(&mut physics);
        assert!(world.bodies[bad].is_quarantined());
        assert_eq!(world.bodies[bad].state().x, before);
        world.bodies[bad].set_enabled(true);
        world.step(&mut physics);
        assert!(!world.bodies[bad].is_quarantined() && world.counters().bodies == 2);
    }

    /// Positions, and whether the step converged.
    type Grabbed = (Vec<crate::math::Vec3>, bool);

    /// After each of its steps, of a block that lies on a floor, is grabbed by a corner, lifted and let go; in
    /// steps that vary if they do. With `own` factors every step has one made for its own length and pins.
    fn grabbed(vary: bool, own: bool) -> (Vec<Grabbed>, usize) {
        let mut physics = PhysicsWorld::new();
        let floor = rapier3d::dynamics::RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        physics.insert(floor, rapier3d::geometry::ColliderBuilder::cuboid(5.0, 0.5, 5.0));
        let mut world = DeformableWorld::new();
        let tight = crate::SolverSettings::default().max_iterations(300).tolerance(1e-10);
        let block = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2])
            .translation(Vector::Y * 0.1)
            .material(
                crate::DeformableMaterial::new(2e5, 0.4)
                    .mass_damping(1.0)
                    .stiffness_damping(0.01)
                    .friction(0.0),
            )
            .settings(tight)
            .can_sleep(false);
        let handle = world.insert(block).unwrap();
        let corner = world.bodies[handle].vertices_where(|x| x.min_element() > 0.09 && x.x > 0.29);
        let (mut states, mut made) = (Vec::new(), 0);
        for step in 0..70 {
            let body = &mut world.bodies[handle];
            match step {
                20 => corner.iter().for_each(|&v| body.pin(v).unwrap()),
                50 => corner.iter().for_each(|&v| body.unpin(v).unwrap()),
                _ => {}
            }
            if (20..40).contains(&step) {
                for &v in &corner {
                    let [x, y, z] = body.position(v).unwrap().map(|c| c as f32);
                    body.move_pin(v, Vector::new(x, y + 0.003, z)).unwrap();
                }
            }
            if own {
                body.state.factor_base = Default::default();
            }
            if vary {
                physics.integration_parameters.dt = 1.0 / (40.0 + 37.0 * (step * 5 % 7) as f32 / 7.0);
            }
            world.step(&mut physics);
            made += world.counters().factorizations;
            let body = &world.bodies[handle];
            let is_solved = body.last_converged() && world.counters().contact_error < 1e-7;
            states.push((body.state().x.clone(), is_solved));
        }
        (states, made)
    }

    #[test]
    fn shared_factors_lead_where_factors_of_their_own_do() {
        for vary in [false, true] {
            let ((shared, few), (own, many)) = (grabbed(vary, false), grabbed(vary, true));
            // A step whose contacts come and go from iteration to iteration ends at its limit, wherever that finds it.
            // Ten steps after the grab: in the twelfth of steps that vary a vertex that is 1e-9 m off the floor opens in one.
            let pairs = shared.iter().zip(&own).take(30).take_while(|(a, b)| a.1 && b.1);
            let difference = |((a, _), (b, _)): (&Grabbed, &Grabbed)| {
                a.iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
            };
            let errors: Vec<f64> = pairs.map(difference).collect();
            let error = errors.iter().copied().fold(0.0, f64::max);
            println!("vary {vary}: {error:e} m in {} steps, {few} factors against {many}", errors.len());
            // Each step to 1e-10 of the forces and 1e-8 of the contacts'; two of them after the grab.
            assert!(error < 1e-6 && errors.len() >= 22, "{error:e} in {}", errors.len());
            assert!(few <= if vary { 3 } else { 1 } && many > few, "{few} {many}");
        }
    }
}
