//! What steps take from the energy of bodies, which no force does.
//!
//! Over a step the force that changes the velocity by Δv is m Δv/h, and does the work m Δv·Δx/h; the kinetic energy changes by
//! m Δv·(v + v')/2. The difference is nobody's work: `m Δv·(Δx/h − (v + v')/2)`, which is `½ m |Δv|²` where `Δx = h v'`, as in
//! implicit Euler and where rapier moves what soft bodies push, and less in its substeps. Of elasticity it is `E − E' − f'·Δx`, which is
//! `½ Δx·K Δx` for a spring.

use super::Stage;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::collections::BTreeMap;

/// Losses of bodies by name, summed over steps \[J\].
#[derive(Debug, Default)]
pub(super) struct Losses {
    of: BTreeMap<String, f64>,
    rigid: Vec<Motion>,
    soft: Vec<Before>,
}

/// A rigid body before a step.
#[derive(Debug)]
struct Motion {
    centre: Vector,
    rotation: Rotation,
    linvel: Vector,
    angvel: Vector,
}

impl Motion {
    fn of(body: &RigidBody) -> Self {
        let (centre, rotation) = (body.center_of_mass(), *body.rotation());
        Self { centre, rotation, linvel: body.linvel(), angvel: body.angvel() }
    }

    /// What a step of `h` \[s\] has taken.
    fn loss(&self, body: &RigidBody, h: f64) -> f64 {
        let after = Self::of(body);
        let wide = |v: Vector| v.to_array().map(f64::from);
        let taken = |moved: Vector, [before, after]: [Vector; 2], momentum: Vector| {
            let (moved, before, after, momentum) = (wide(moved), wide(before), wide(after), wide(momentum));
            (0..3).map(|k| momentum[k] * (moved[k] / h - 0.5 * (before[k] + after[k]))).sum::<f64>()
        };
        let properties = body.mass_properties().local_mprops;
        let turn = after.rotation * properties.principal_inertia_local_frame;
        let spin = turn * (properties.principal_inertia() * (turn.inverse() * (after.angvel - self.angvel)));
        let angle = (after.rotation * self.rotation.inverse()).to_scaled_axis();
        taken(
            after.centre - self.centre,
            [self.linvel, after.linvel],
            (after.linvel - self.linvel) * body.mass(),
        ) + taken(angle, [self.angvel, after.angvel], spin)
    }
}

/// A soft body before a step.
#[derive(Debug, Default)]
struct Before {
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    elastic: f64,
}

impl Before {
    fn of(body: &DeformableBody) -> Self {
        let vertices = 0..body.vertex_count();
        Self {
            x: vertices.clone().filter_map(|v| body.position(v).ok()).collect(),
            v: vertices.filter_map(|v| body.velocity(v).ok()).collect(),
            elastic: body.elastic_energy(),
        }
    }

    fn loss(&self, body: &DeformableBody) -> f64 {
        let after = Self::of(body);
        let (masses, forces) = (body.vertex_masses(), body.elastic_forces());
        let mut loss = self.elastic - after.elastic;
        for v in 0..masses.len() {
            for k in 0..3 {
                let (dv, dx) = (after.v[v][k] - self.v[v][k], after.x[v][k] - self.x[v][k]);
                loss += 0.5 * masses[v] * dv * dv - forces[v][k] * dx;
            }
        }
        loss
    }
}

impl Stage {
    /// Asked for before every step of a scene that watches losses.
    pub(crate) fn begin_losses(&mut self) {
        self.losses.rigid =
            self.all_rigid().map(|(_, body)| Motion::of(&self.physics.bodies[body])).collect();
        self.losses.soft = self.deformable.iter().map(|d| Before::of(&self.world.bodies[d.1])).collect();
    }

    /// Asked for after it.
    pub(crate) fn end_losses(&mut self) {
        let h = f64::from(self.physics.integration_parameters.dt);
        let mut losses = std::mem::take(&mut self.losses);
        for ((name, body), before) in self.all_rigid().zip(&losses.rigid) {
            let body = &self.physics.bodies[body];
            if body.is_dynamic() {
                *losses.of.entry(name.to_string()).or_default() += before.loss(body, h);
            }
        }
        self.losses = losses;
        for ((name, body), before) in self.deformable.iter().zip(&self.losses.soft) {
            let body = &self.world.bodies[*body];
            // The formulas of the second order lose otherwise, and less.
            if body.settings().integrator == Integrator::ImplicitEuler {
                *self.losses.of.entry(name.clone()).or_default() += before.loss(body);
            }
        }
    }

    pub(super) fn step_loss(&self, of: &str) -> f64 {
        self.losses.of.get(of).copied().unwrap_or(0.0)
    }
}
