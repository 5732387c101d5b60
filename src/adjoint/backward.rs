//! One step backward: the derivatives with respect to its end become those with respect to its start, and to all that acts in it.
//!
//! The end solves `F₁ = r(x′) + Jᵀλ = 0` and the laws of the contacts that bind, `F₂ = 0`. With `g = ∂L/∂x′ + ∂L/∂v′/h` and
//! `H = −∂r/∂x′`, the adjoint z, q of section 14 of docs/method.md gives `dL/dθ = z·∂F₁/∂θ + q·∂F₂/∂θ`.

use super::cables::{CableRecord, EndOfCable, OfCable, along};
use super::contact_rows::ContactRows;
use super::filled_rooms::of_pressures;
use super::gradient::{CableGradient, DeformableGradient, MaterialGradient, StepGradient};
use super::loss::Seed;
use super::parameters::{ElasticWork, Inertia};
use super::record::{ContactRecord, StepRecord};
use super::spin::{Cotangents, through_spin};
use super::tangent::Tangent;
use crate::body::DeformableCableHandle;
use crate::fem::{DampedStep, DeformableModel, Elements, StiffnessDamping, Stretches};
use crate::material::MAX_BRANCHES;
use crate::math::Vec3;

/// What goes backward over the steps.
pub(super) struct Backward<'a> {
    model: &'a DeformableModel,
    tangent: Tangent,
    force: Vec<Vec3>,
    /// With respect to the state between two steps: positions, velocities, cables, and what dampers have given way by.
    pub x: Vec<Vec3>,
    pub v: Vec<Vec3>,
    cables: Vec<(DeformableCableHandle, EndOfCable)>,
    dampers: Vec<Stretches>,
}

/// Derivatives of a loss with respect to the forces of a step: of colliders, and of its cables.
pub(super) struct OfForces<'a> {
    colliders: &'a [(u64, Vec3)],
    cables: Vec<EndOfCable>,
}

impl OfForces<'_> {
    /// Of the force of a collider on the body.
    pub fn of_collider(&self, collider: u64) -> Vec3 {
        self.colliders.iter().filter(|(own, _)| *own == collider).map(|(_, derivative)| *derivative).sum()
    }
}

/// The adjoint of a step, and what it says of pins and cables.
struct Solved {
    z: Vec<Vec3>,
    of_pins: Vec<Vec3>,
    cables: Vec<OfCable>,
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

    /// Goes through a step, with what the loss says of the forces in it.
    ///
    /// # Errors
    /// Why there is no gradient.
    pub fn step(
        &mut self,
        record: &StepRecord,
        seed: &Seed,
        out: &mut DeformableGradient,
    ) -> Result<(), &'static str> {
        let (model, h) = (self.model, record.h);
        let inertia = Inertia::new(model, &record.materials);
        let elements = Elements { model, materials: &record.materials, activations: &record.activations };
        let damping = record.damping(model, &record.materials);
        let damped = DampedStep {
            elements: &elements,
            damping: &damping,
            h,
            x_start: &record.x_start,
            x_end: &record.x_end,
        };
        let mut of = Cotangents::new(std::mem::take(&mut self.x), std::mem::take(&mut self.v));
        self.give_way_back(&damped, &mut of.x_end, &mut out.materials);
        if record.keeps_spin {
            through_spin(record, &inertia, &mut of);
        }
        let g: Vec<Vec3> = of.x_end.iter().zip(&of.v_end).map(|(x, v)| x + v / h).collect();
        of.x_start.iter_mut().zip(&of.v_end).for_each(|(x, v)| *x -= v / h);
        let of_forces = self.of_forces(record, seed)?;
        let Solved { z, of_pins, cables } =
            self.solve(record, (&inertia, &damping), &of_forces, g, &mut of)?;
        let between = record.cables.iter().zip(&cables).map(|(cable, of)| (cable.handle, of.before));
        self.cables = between.collect();
        out.friction += of.friction;
        add_inertia(record, &inertia, &z, &mut of);
        let wind = record.wind.as_ref();
        let wind = wind.map(|wind| wind.back(model, record, &inertia.masses, &mut of)).unwrap_or_default();
        if damping.resists() {
            damped.add_by_start(&z, &mut of.x_start, &mut self.dampers);
        }
        let mut work = ElasticWork { model, record, z: &z, damping: &damping, force: &mut self.force };
        work.add_materials(&mut out.materials);
        work.add_twists(&mut out.materials);
        let activation = work.activation();
        inertia.add_materials(model, record, (&of.masses, of.damping), &mut out.materials);
        let users = |nodes: &[Vec3]| model.nodes_by_vertex().map(|n| nodes[n].into()).collect();
        out.steps.push(StepGradient {
            forces: users(&of.forces),
            pin_targets: users(&of_pins),
            gravity: of.gravity.into(),
            activation,
            pressures: of_pressures(&self.tangent.rooms, model.cavities.len(), &z),
            rolls: of_rolls(model, record, &z),
            cables: record.cables.iter().zip(&cables).map(cable_gradient).collect(),
            wind,
            velocities: users(&of.v_start),
        });
        (self.x, self.v) = (of.x_start, of.v_start);
        Ok(())
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

    /// Solves for z, and for what is with respect to the targets of pins; adds what contacts say of the start, and of friction.
    fn solve(
        &mut self,
        record: &StepRecord,
        (inertia, damping): (&Inertia, &StiffnessDamping),
        of_forces: &OfForces<'_>,
        mut g: Vec<Vec3>,
        of: &mut Cotangents,
    ) -> Result<Solved, &'static str> {
        let (stuck, others) = stuck_contacts(record);
        let mut fixed = record.pins.clone();
        fixed.extend(stuck.iter().map(|(node, _)| *node as u32));
        fixed.sort_unstable();
        let (mut is_free, mut of_fixed) = (vec![true; g.len()], vec![Vec3::zeros(); g.len()]);
        for &node in &fixed {
            is_free[node as usize] = false;
            of_fixed[node as usize] = std::mem::take(&mut g[node as usize]);
        }
        if !self.tangent.update(self.model, record, damping, &fixed) {
            return Err("its stiffness has no inverse");
        }
        let mut z_stuck = vec![Vec3::zeros(); g.len()];
        for (node, contact) in &stuck {
            z_stuck[*node] = -of_forces.of_collider(contact.collider);
        }
        self.tangent.take_off_free(&z_stuck, &is_free, &mut g);
        let mut rows = ContactRows::new(&others, of_forces);
        for (cable, of_end) in record.cables.iter().zip(&of_forces.cables) {
            if let Some(compliance) = cable.compliance() {
                let force = cable.force();
                let of_tension = of_end.tension + along(&force, &z_stuck);
                rows.add_cable(force, compliance, of_tension);
            }
        }
        let share = rows.solve(&mut self.tangent, &is_free, &mut g);
        let (share, mut z) = (share.ok_or("its contacts say too little or too much")?, g);
        stuck.iter().for_each(|(node, _)| z[*node] = z_stuck[*node]);
        self.tangent.take_off_pinned(&z, &mut of_fixed);
        let held = (1.0 / record.h + inertia.damping) / record.h;
        for (node, contact) in stuck {
            let carried = of_fixed[node] + share.of_end[node] - z[node] * (held * inertia.masses[node]);
            let normal = contact.frame[0];
            let along = normal * normal.dot(&carried);
            of.x_start[node] += if contact.recovers { carried } else { carried - along };
        }
        let mut of_pins = vec![Vec3::zeros(); z.len()];
        for pin in record.pins.iter().map(|&pin| pin as usize) {
            of_pins[pin] = of_fixed[pin] + share.of_end[pin];
        }
        of.x_start.iter_mut().zip(&share.of_start).for_each(|(x, c)| *x += c);
        of.friction = share.of_friction;
        let mut lengths = share.of_cables.iter();
        let cables = record.cables.iter().zip(&of_forces.cables).map(|(cable, of_end)| {
            let q = cable.compliance().and_then(|_| lengths.next().copied()).unwrap_or(0.0);
            cable.back(&z, q, *of_end, &mut of.x_start)
        });
        let cables = cables.collect();
        Ok(Solved { z, of_pins, cables })
    }

    /// What the loss says of forces, and later steps of cables.
    fn of_forces<'b>(&self, record: &StepRecord, seed: &'b Seed) -> Result<OfForces<'b>, &'static str> {
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
        Ok(OfForces { colliders: &seed.contact_forces, cables: record.cables.iter().map(of_end).collect() })
    }
}

fn cable_gradient((cable, of): (&CableRecord, &OfCable)) -> CableGradient {
    CableGradient { cable: cable.handle, tension: of.tension, length: of.length }
}

/// What z says of the roll of each rod of a model.
fn of_rolls(model: &DeformableModel, record: &StepRecord, z: &[Vec3]) -> Vec<f64> {
    let mut of = vec![0.0; model.rod_count()];
    for twist in &record.twists {
        of[twist.rod] = twist.of_roll(model, &record.materials, &record.x_end, z);
    }
    of
}

/// Nodes that stick with the only contact they have, and all other contacts.
fn stuck_contacts(record: &StepRecord) -> (Vec<(usize, &ContactRecord)>, Vec<&ContactRecord>) {
    let mut count = vec![0; record.x_end.len()];
    record.contacts.iter().flat_map(ContactRecord::weighted_nodes).for_each(|(node, _)| count[node] += 1);
    // What is led does not stick.
    record.pins.iter().for_each(|&pin| count[pin as usize] = 2);
    let (mut stuck, mut others) = (Vec::new(), Vec::new());
    for contact in &record.contacts {
        match contact.stuck_node().filter(|node| count[*node] == 1) {
            Some(node) => stuck.push((node, contact)),
            None => others.push(contact),
        }
    }
    (stuck, others)
}

/// What z says of `m ((xₙ + h vₙ − x′)/h² + g − α (x′ − xₙ)/h) + f`.
fn add_inertia(record: &StepRecord, inertia: &Inertia, z: &[Vec3], of: &mut Cotangents) {
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
