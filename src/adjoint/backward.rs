//! One step backward: the derivatives with respect to its end become those with respect to its start, and to all that acts in it.
//!
//! The end solves `F₁ = r(x′) + Jᵀλ = 0` and the laws of the contacts that bind, `F₂ = 0`. With `g = ∂L/∂x′ + ∂L/∂v′/h` and
//! `H = −∂r/∂x′`, the adjoint z, q of section 14 of docs/method.md gives `dL/dθ = z·∂F₁/∂θ + q·∂F₂/∂θ`.

use super::cables::{CableRecord, EndOfCable, OfCable};
use super::filled_rooms::of_pressures;
use super::gradient::{CableGradient, DeformableGradient, MaterialGradient, RigidBodyGradient, StepGradient};
use super::joint_solve::{Solved, solve};
use super::loss::Seed;
use super::parameters::{ElasticWork, Inertia};
use super::record::{BodyRecord, StepRecord};
use super::rigid_back::RigidBackward;
use super::spin::{Cotangents, through_spin};
use super::tangent::Tangent;
use crate::body::DeformableCableHandle;
use crate::fem::{DampedStep, DeformableModel, StiffnessDamping, Stretches};
use crate::material::MAX_BRANCHES;
use crate::math::Vec3;

/// What goes backward over the steps of one body.
pub(super) struct Backward<'a> {
    pub model: &'a DeformableModel,
    pub tangent: Tangent,
    force: Vec<Vec3>,
    /// With respect to the state between two steps: positions, velocities, cables, and what dampers have given way by.
    pub x: Vec<Vec3>,
    pub v: Vec<Vec3>,
    cables: Vec<(DeformableCableHandle, EndOfCable)>,
    dampers: Vec<Stretches>,
}

/// What is known of the step of a body before its adjoint.
pub(super) struct Known {
    pub inertia: Inertia,
    pub damping: StiffnessDamping,
    pub of: Cotangents,
    pub g: Vec<Vec3>,
    pub of_cables: Vec<EndOfCable>,
}

/// Goes through a step of bodies, with what the loss says of the forces in it.
///
/// # Errors
/// Why there is no gradient.
pub(super) fn go_back(
    (bodies, rigid): (&mut [Backward<'_>], &mut [RigidBackward]),
    record: &StepRecord,
    seeds: &[&Seed],
    (out, out_rigid): (&mut [DeformableGradient], &mut [RigidBodyGradient]),
) -> Result<(), &'static str> {
    let mut known = Vec::with_capacity(bodies.len());
    for (k, body) in bodies.iter_mut().enumerate() {
        known.push(body.begin(&record.bodies[k], seeds[k], &mut out[k])?);
    }
    let known_rigid: Vec<_> =
        rigid.iter().zip(&record.rigid_bodies).map(|(body, record)| body.begin(record)).collect();
    let (solved, of_rigid) = solve(record, seeds, bodies, (&mut known, &known_rigid))?;
    for (k, (known, of)) in known_rigid.iter().zip(of_rigid).enumerate() {
        rigid[k].finish(&record.rigid_bodies[k], known, of, &mut out_rigid[k]);
    }
    for (k, (known, solved)) in known.into_iter().zip(solved).enumerate() {
        bodies[k].finish(&record.bodies[k], known, &solved, &mut out[k]);
    }
    Ok(())
}

impl<'a> Backward<'a> {
    /// `None` for a mesh whose matrix cannot be put together.
    pub fn new(model: &'a DeformableModel) -> Option<Self> {
        let zeros = vec![Vec3::zeros(); model.rest.len()];
        let tangent = Tangent::new(model)?;
        Some(Self {
            model,
            tangent,
            force: Vec::new(),
            x: zeros.clone(),
            v: zeros,
            cables: Vec::new(),
            dampers: Vec::new(),
        })
    }

    /// From what is with respect to the end of a step to the right-hand side of its adjoint.
    fn begin(
        &mut self,
        record: &BodyRecord,
        seed: &Seed,
        out: &mut DeformableGradient,
    ) -> Result<Known, &'static str> {
        let (model, h) = (self.model, record.h);
        let inertia = Inertia::new(model, &record.materials);
        let damping = record.damping(model, &record.materials);
        let mut of = Cotangents::new(std::mem::take(&mut self.x), std::mem::take(&mut self.v));
        let elements = record.elements(model);
        self.give_way_back(&record.damped(&elements, &damping), &mut of.x_end, &mut out.materials);
        if record.keeps_spin {
            through_spin(record, &inertia, &mut of);
        }
        let g = of.x_end.iter().zip(&of.v_end).map(|(x, v)| x + v / h).collect();
        of.x_start.iter_mut().zip(&of.v_end).for_each(|(x, v)| *x -= v / h);
        let of_cables = self.of_cables(record, seed)?;
        Ok(Known { inertia, damping, of, g, of_cables })
    }

    /// From the adjoint of a step to what is with respect to its start, and to all that acts in it.
    fn finish(&mut self, record: &BodyRecord, known: Known, solved: &Solved, out: &mut DeformableGradient) {
        let Known { inertia, damping, mut of, .. } = known;
        let (model, Solved { z, of_pins, cables }) = (self.model, solved);
        let between = record.cables.iter().zip(cables).map(|(cable, of)| (cable.handle, of.before));
        self.cables = between.collect();
        out.friction += of.friction;
        add_inertia(record, &inertia, z, &mut of);
        let wind = record.wind.as_ref();
        let wind = wind.map(|wind| wind.back(model, record, &inertia.masses, &mut of)).unwrap_or_default();
        if damping.resists() {
            let elements = record.elements(model);
            record.damped(&elements, &damping).add_by_start(z, &mut of.x_start, &mut self.dampers);
        }
        let mut work = ElasticWork { model, record, z, damping: &damping, force: &mut self.force };
        work.add_materials(&mut out.materials);
        work.add_twists(&mut out.materials);
        let activation = work.activation();
        inertia.add_materials(model, record, (&of.masses, of.damping), &mut out.materials);
        let users = |nodes: &[Vec3]| model.nodes_by_vertex().map(|n| nodes[n].into()).collect();
        out.steps.push(StepGradient {
            forces: users(&of.forces),
            pin_targets: users(of_pins),
            gravity: of.gravity.into(),
            activation,
            pressures: of_pressures(&self.tangent.rooms, model.cavities.len(), z),
            rolls: of_rolls(model, record, z),
            cables: record.cables.iter().zip(cables).map(cable_gradient).collect(),
            wind,
            velocities: users(&of.v_start),
        });
        (self.x, self.v) = (of.x_start, of.v_start);
    }

    /// Goes through how dampers have given way over the step.
    fn give_way_back(&mut self, damped: &DampedStep<'_>, of_end: &mut [Vec3], out: &mut [MaterialGradient]) {
        self.dampers.resize_with(damped.damping.dampers().len(), || Stretches::zeros(self.model));
        if self.dampers.is_empty() {
            return;
        }
        let mut of_times = vec![[0.0; MAX_BRANCHES]; out.len()];
        damped.give_way_back(&mut self.dampers, of_end, &mut of_times);
        for (out, of) in out.iter_mut().zip(of_times) {
            out.maxwell_times.iter_mut().zip(of).for_each(|(out, of)| *out += of);
        }
    }

    /// What the loss and later steps say of the cables.
    fn of_cables(&self, record: &BodyRecord, seed: &Seed) -> Result<Vec<EndOfCable>, &'static str> {
        let is_there = |handle| record.cables.iter().any(|cable| cable.handle == handle);
        if !seed.tensions.iter().all(|(handle, _)| is_there(*handle)) {
            return Err("the loss is of a cable that does not run through the body");
        }
        let of_end = |cable: &CableRecord| {
            let is_it = |handle: &DeformableCableHandle| *handle == cable.handle;
            let later = self.cables.iter().find(|(handle, _)| is_it(handle));
            let mut of_end = later.map_or(EndOfCable::default(), |(_, of)| *of);
            let own = seed.tensions.iter().filter(|(handle, _)| is_it(handle));
            of_end.tension += own.map(|(_, of)| of).sum::<f64>();
            of_end
        };
        Ok(record.cables.iter().map(of_end).collect())
    }
}

fn cable_gradient((cable, of): (&CableRecord, &OfCable)) -> CableGradient {
    CableGradient { cable: cable.handle, tension: of.tension, length: of.length }
}

/// What z says of the roll of each rod of a model.
fn of_rolls(model: &DeformableModel, record: &BodyRecord, z: &[Vec3]) -> Vec<f64> {
    let mut of = vec![0.0; model.rod_count()];
    for twist in &record.twists {
        of[twist.rod] = twist.of_roll(model, &record.materials, &record.x_end, z);
    }
    of
}

/// What z says of `m ((xₙ + h vₙ − x′)/h² + g − α (x′ − xₙ)/h) + f`.
fn add_inertia(record: &BodyRecord, inertia: &Inertia, z: &[Vec3], of: &mut Cotangents) {
    let (h, alpha) = (record.h, inertia.damping);
    for (i, (z, m)) in z.iter().zip(&inertia.masses).enumerate() {
        let moved = record.x_end[i] - record.x_start[i];
        of.x_start[i] += z * (m * (1.0 / (h * h) + alpha / h));
        of.v_start[i] += z * (m / h);
        of.forces[i] += z;
        of.gravity += z * (m * record.gravity_scale);
        let change = (record.v_start[i] - moved / h) / h;
        of.masses[i] += z.dot(&(change + record.gravity * record.gravity_scale - moved * (alpha / h)));
        of.damping -= m * z.dot(&moved) / h;
    }
}
