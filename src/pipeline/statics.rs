//! Rest without the way to it: every step begins without velocities, and the first is as long as it may be, so that inertia has
//! little to say. This is the proximal point method on the energy [Rockafellar 1976], with the contact of any other step, and solved
//! no further than the step itself is from rest.

use super::world::DeformableWorld;
use crate::body::{DeformableBody, DeformableState, FactorBase, Integrator, SolverSettings};
use crate::fem::relaxed;
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use rapier3d::dynamics::{RigidBody, RigidBodyHandle, RigidBodyType};
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsWorld;

/// How far [`DeformableWorld::find_rest`] came.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeformableRest {
    /// Steps that it took.
    pub steps: usize,
    /// The largest force out of balance on a vertex over the largest of its body.
    pub residual: f64,
    /// Whether that is within the tolerance.
    pub is_found: bool,
}

/// Growth of a step that was too long at first. With four a cantilever of 4000 tets takes 5 steps where it takes 4, and twice the time.
const GROWTH: f64 = 16.0;
/// What a step has to leave of the forces out of balance: a longer one makes a factor, which takes as long as three steps of a block
/// in contact.
const SLOW: f64 = 0.1;
/// The longest step over the shortest. Beyond, nothing is left of inertia in a matrix of double precision.
const LONGEST: f64 = 1.0e5;
/// Part of a body's size that it may fall in a step where others are: contacts are looked for along that way.
const FALL: f64 = 0.1;
/// The longest step where others are \[s\], which is the longest that contacts are tested at: a block under a load that presses it by 7 %
/// is overturned by one of 0.118 s that does not converge.
const LONGEST_TOUCHING: f64 = 0.1;
/// Iterations of a step at the most.
const ITERATIONS: usize = 200;
/// Tolerance of a step over what the one before has left; of the first, and of the search's over that of the last. Solved to the end
/// at once, a cantilever of 4000 tets takes more than 200 iterations in frames that it has left; to a hundredth 50, and 19 from there.
const SHARPER: f64 = 0.1;
const ROUGH: f64 = 1.0e-2;

/// Acceleration of rigid bodies over gravity that counts as rest: their velocities are f32, and rapier's solver is not exact.
const RIGID_REST: f64 = 1.0e-3;

/// What the search changes and gives back.
struct Kept {
    settings: SolverSettings,
    can_sleep: bool,
    /// Velocities of pins.
    led: Vec<Vec3>,
    /// What its matrices in time are made for.
    factor_base: FactorBase,
}

impl DeformableWorld {
    /// Brings all bodies, and the dynamic rigid ones with them, to where they rest under their loads, pins, attachments and
    /// contacts, in far fewer steps than it takes in time: each step begins without velocities. Loads are gravity, forces and
    /// tractions ([`DeformableBody::add_force`], [`DeformableBody::add_traction`]), displacements are pins. Rigid bodies and pins that are
    /// led by a velocity stand still meanwhile; deformable bodies that are led so do not. Ends when no force out of balance is above `tolerance` of the forces, or after `max_steps`.
    ///
    /// Where friction holds, what it ends in depends on where it began, as in time. What nothing holds has no rest and falls.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut physics = PhysicsWorld::new();
    /// let mut deformables = DeformableWorld::new();
    /// let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]).pinned(|x| x.x < -0.499);
    /// let beam = deformables.insert(beam.material(DeformableMaterial::new(1.0e7, 0.3)))?;
    /// let rest = deformables.find_rest(&mut physics, 1.0e-8, 100);
    /// assert!(rest.is_found && rest.steps < 20);
    /// deformables.step(&mut physics);
    /// assert!(deformables.bodies[beam].max_speed() < 1e-5);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn find_rest(
        &mut self,
        physics: &mut PhysicsWorld,
        tolerance: f64,
        max_steps: usize,
    ) -> DeformableRest {
        let tolerance = if tolerance > 0.0 { tolerance } else { 1.0e-8 };
        let dt = physics.integration_parameters.dt;
        let kept: Vec<Kept> = self.bodies.iter_mut().map(|(_, body)| begin(body)).collect();
        let led = stop_led(physics);
        // Few problems are solved in a row: columns do not pay.
        let budget = std::mem::take(&mut self.parameters.column_budget);
        let mut rest = DeformableRest { steps: 0, residual: f64::INFINITY, is_found: false };
        let longest = self.longest_step(physics, f64::from(dt));
        let mut h = longest;
        while rest.steps < max_steps && !rest.is_found {
            let last = rest.residual;
            let asked = (SHARPER * last).min(ROUGH).max(SHARPER * tolerance);
            let stays = self.step_towards_rest(physics, h, asked, &mut rest);
            rest.is_found = stays && rest.residual.max(asked) <= tolerance && rigid_ones_rest(physics, h);
            if !stays {
                h = if h > f64::from(dt) { f64::from(dt) } else { h / GROWTH };
            } else if !(rest.residual < SLOW * last) {
                h = (h * GROWTH).min(longest).max(h);
            }
        }
        self.parameters.column_budget = budget;
        stop(self, physics);
        physics.integration_parameters.dt = dt;
        led.into_iter().for_each(|(handle, linvel, angvel)| {
            if let Some(body) = physics.bodies.get_mut(handle) {
                body.set_linvel(linvel, true);
                body.set_angvel(angvel, true);
            }
        });
        self.bodies.iter_mut().zip(kept).for_each(|((_, body), kept)| end(body, kept));
        rest
    }

    /// A step of `h` \[s\] without velocities, solved to `asked`. What has not converged may have gone anywhere: it is put back, and
    /// this is false.
    fn step_towards_rest(
        &mut self,
        physics: &mut PhysicsWorld,
        h: f64,
        asked: f64,
        rest: &mut DeformableRest,
    ) -> bool {
        stop(self, physics);
        for (_, body) in self.bodies.iter_mut() {
            body.set_settings(body.settings().tolerance(asked).contact_tolerance(asked));
        }
        let before: Vec<DeformableState> = self.bodies.iter().map(|(_, body)| body.state.clone()).collect();
        physics.integration_parameters.dt = h as f32;
        self.step(physics);
        rest.steps += 1;
        let fails = |body: &DeformableBody| body.last_step_rejected() || !body.last_converged();
        if self.bodies.iter().any(|(_, body)| body.is_enabled() && fails(body)) {
            rest.residual = f64::INFINITY;
            self.bodies.iter_mut().zip(before).for_each(|((_, body), before)| body.state = before);
            return false;
        }
        let moved = self.bodies.iter().zip(&before).map(|((_, body), before)| imbalance(body, before, h));
        rest.residual = moved.fold(0.0, f64::max);
        true
    }

    /// Where a body could meet another, one in which it falls by a part of its size.
    fn longest_step(&self, physics: &PhysicsWorld, dt: f64) -> f64 {
        // What nothing holds would fall out of sight.
        let is_held =
            |body: &DeformableBody| !body.pins.is_empty() || self.bodies.attachments().next().is_some();
        let is_alone = self.bodies.iter().count() == 1 && physics.colliders.is_empty();
        let is_alone = is_alone && self.bodies.iter().all(|(_, body)| is_held(body));
        let fall = f64::from(physics.gravity.length()).max(f64::MIN_POSITIVE);
        let of = |body: &DeformableBody| (2.0 * FALL * body.model.size / fall).sqrt();
        let least = self.bodies.iter().map(|(_, body)| of(body)).fold(f64::INFINITY, f64::min);
        if is_alone { dt * LONGEST } else { least.min(LONGEST_TOUCHING).max(dt) }
    }
}

fn begin(body: &mut DeformableBody) -> Kept {
    let led = body.pins.iter_mut().map(|pin| std::mem::take(&mut pin.velocity)).collect();
    let (settings, factor_base) = (*body.settings(), body.state.factor_base.clone());
    let kept = Kept { settings, can_sleep: body.can_sleep(), led, factor_base };
    body.set_settings(settings.max_iterations(ITERATIONS).integrator(Integrator::ImplicitEuler));
    body.set_can_sleep(false);
    // Rest is what is left in the end: branches have given way.
    let at_last = |m: &DeformableMaterial| m.mass_damping(0.0).maxwell_branches([]);
    body.materials.iter_mut().for_each(|material| *material = at_last(material));
    kept
}

fn end(body: &mut DeformableBody, kept: Kept) {
    body.set_settings(kept.settings);
    body.set_can_sleep(kept.can_sleep);
    body.state.factor_base = kept.factor_base;
    body.distribute_materials();
    body.state.dampers = relaxed(&body.elements(), &body.state.x);
    body.pins.iter_mut().zip(kept.led).for_each(|(pin, velocity)| pin.velocity = velocity);
}

/// Takes all velocities away.
fn stop(deformables: &mut DeformableWorld, physics: &mut PhysicsWorld) {
    for (_, body) in deformables.bodies.iter_mut() {
        body.state.v.fill(Vec3::zeros());
        body.state.history.clear();
    }
    for (_, body) in physics.bodies.iter_mut().filter(|(_, body)| body.is_dynamic()) {
        body.set_linvel(Vector::ZERO, true);
        body.set_angvel(Vector::ZERO, true);
    }
}

/// Stops rigid bodies that are led; gives back their velocities.
fn stop_led(physics: &mut PhysicsWorld) -> Vec<(RigidBodyHandle, Vector, Vector)> {
    let mut led = Vec::new();
    for (handle, body) in physics.bodies.iter_mut() {
        if body.body_type() == RigidBodyType::KinematicVelocityBased {
            led.push((handle, body.linvel(), body.angvel()));
            body.set_linvel(Vector::ZERO, true);
            body.set_angvel(Vector::ZERO, true);
        }
    }
    led
}

/// The largest force that inertia has taken in a step of `h` \[s\] from `before`, over the largest on a vertex.
fn imbalance(body: &DeformableBody, before: &DeformableState, h: f64) -> f64 {
    if !body.is_enabled() {
        return 0.0;
    }
    let pinned = |node: &usize| body.pins.binary_search_by_key(&(*node as u32), |pin| pin.node).is_ok();
    let taken = |n: usize| body.node_mass(n) * (body.state.x[n] - before.x[n]).amax() / (h * h);
    let left = (0..before.x.len()).filter(|n| !pinned(n)).map(taken).fold(0.0, f64::max);
    let (_, forces) = body.elastic_response();
    let scale = forces.iter().chain(&body.forces).map(|f| f.amax()).fold(0.0, f64::max);
    if left == 0.0 { 0.0 } else { left / scale }
}

/// Whether what rapier moves stands still, as far as it can.
fn rigid_ones_rest(physics: &PhysicsWorld, h: f64) -> bool {
    let most = RIGID_REST * f64::from(physics.gravity.length()) * h;
    let mut dynamic = physics.bodies.iter().filter(|(_, body)| body.is_dynamic() && body.is_enabled());
    let is_still = |body: &RigidBody| {
        let mass = body.mass_properties().local_mprops;
        // The radius of gyration.
        let arm = f64::from(mass.principal_inertia().max_element() * mass.inv_mass).sqrt();
        f64::from(body.linvel().length()) <= most && f64::from(body.angvel().length()) * arm <= most
    };
    dynamic.all(|(_, body)| is_still(body))
}
