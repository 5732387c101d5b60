//! The adjoint of a step of bodies that touch: that of each is its own Hessian's, that of rigid ones their mass's, and contacts are between them.

use super::backward::{Backward, Known};
use super::cables::{OfCable, along};
use super::contact_record::{ContactRecord, Partner};
use super::contact_rows::{ContactRows, ContactShare};
use super::loss::Seed;
use super::record::{BodyRecord, StepRecord};
use super::rigid_back::RigidKnown;
use super::rigid_record::RigidRecord;
use super::tangents::Tangents;
use crate::math::Vec3;
use std::ops::Range;

/// The adjoint of a step of one body, and what it says of pins and cables.
pub(super) struct Solved {
    pub z: Vec<Vec3>,
    pub of_pins: Vec<Vec3>,
    pub cables: Vec<OfCable>,
}

/// A step of bodies whose nodes are in one row.
struct Joint<'a> {
    record: &'a StepRecord,
    seeds: &'a [&'a Seed],
    /// Of each body.
    nodes: Vec<Range<usize>>,
    pins: Vec<usize>,
    /// Nodes that stick with the only contact they have, and all other contacts.
    stuck: Vec<(usize, &'a ContactRecord)>,
    others: Vec<&'a ContactRecord>,
}

/// What contacts say of the motion and the turn of a rigid body, and of its place and its turn at the start.
pub(super) type OfRigid = ([Vec3; 2], [Vec3; 2]);

/// Solves for the adjoint of every body; adds what contacts say of the start, and of friction. Gives what they say of rigid bodies too.
///
/// # Errors
/// Why there is no gradient.
pub(super) fn solve(
    record: &StepRecord,
    seeds: &[&Seed],
    bodies: &mut [Backward<'_>],
    (known, rigid): (&mut [Known], &[RigidKnown]),
) -> Result<(Vec<Solved>, Vec<OfRigid>), &'static str> {
    let joint = Joint::new(record, seeds);
    let mut g: Vec<Vec3> = known.iter_mut().flat_map(|known| std::mem::take(&mut known.g)).collect();
    let deformable = g.len();
    g.extend(rigid.iter().zip(&record.rigid_bodies).flat_map(|(known, record)| known.g(record)));
    let turns: Vec<Vec3> = record.rigid_bodies.iter().map(RigidRecord::turn).collect();
    let (mut is_free, mut of_fixed) = (vec![true; g.len()], vec![Vec3::zeros(); g.len()]);
    let fixed = joint.fixed();
    for &node in &fixed {
        is_free[node] = false;
        of_fixed[node] = std::mem::take(&mut g[node]);
    }
    let mut tangents = joint.tangents(bodies, known, &fixed)?;
    let mut z_stuck = vec![Vec3::zeros(); g.len()];
    for (node, contact) in &joint.stuck {
        z_stuck[*node] = -joint.of_contact(contact);
    }
    tangents.take_off_free(&z_stuck, &is_free, &mut g);
    let share = joint.rows(known, &z_stuck).solve(&mut tangents, (&is_free, &turns), &mut g);
    let (mut share, mut z) = (share.ok_or("its contacts say too little or too much")?, g);
    joint.stuck.iter().for_each(|(node, _)| z[*node] = z_stuck[*node]);
    tangents.take_off_pinned(&z, &mut of_fixed);
    let motions = share.of_end[deformable..].chunks_exact(2).map(|of| [of[0], of[1]]);
    let of_rigid = motions.zip(share.of_rigid.iter().copied()).collect();
    of_fixed.iter_mut().zip(&share.of_end).for_each(|(of, c)| *of += c);
    joint.add_by_stuck(known, &z, &of_fixed, &mut share.of_start);
    Ok((joint.split(known, &share, &z, &of_fixed), of_rigid))
}

impl<'a> Joint<'a> {
    fn new(record: &'a StepRecord, seeds: &'a [&'a Seed]) -> Self {
        let nodes = record.nodes();
        let of_body = |(body, nodes): (usize, &Range<usize>)| {
            let first = nodes.start;
            record.bodies[body].pins.iter().map(move |&pin| first + pin as usize)
        };
        let pins: Vec<usize> = nodes.iter().enumerate().flat_map(of_body).collect();
        let mut count = vec![0; nodes.last().map_or(0, |last| last.end)];
        let acted_on = record.contacts.iter().flat_map(|contact| &contact.nodes);
        acted_on.for_each(|(node, _)| count[*node] += 1);
        // What is led does not stick.
        pins.iter().for_each(|&pin| count[pin] = 2);
        let (mut stuck, mut others) = (Vec::new(), Vec::new());
        for contact in &record.contacts {
            match contact.stuck_node().filter(|node| count[*node] == 1) {
                Some(node) => stuck.push((node, contact)),
                None => others.push(contact),
            }
        }
        Self { record, seeds, nodes, pins, stuck, others }
    }

    /// Nodes that are no unknowns, ascending.
    fn fixed(&self) -> Vec<usize> {
        let mut fixed = self.pins.clone();
        fixed.extend(self.stuck.iter().map(|(node, _)| node));
        fixed.sort_unstable();
        fixed
    }

    /// The Hessians of the step.
    fn tangents<'b>(
        &self,
        bodies: &'b mut [Backward<'_>],
        known: &[Known],
        fixed: &[usize],
    ) -> Result<Tangents<'b>, &'static str> {
        let mut each = Vec::with_capacity(bodies.len());
        for (k, (body, nodes)) in bodies.iter_mut().zip(&self.nodes).enumerate() {
            let own = fixed.iter().filter(|node| nodes.contains(node));
            let own: Vec<u32> = own.map(|node| (node - nodes.start) as u32).collect();
            if !body.tangent.update(body.model, &self.record.bodies[k], &known[k].damping, &own) {
                return Err("its stiffness has no inverse");
            }
            each.push((&mut body.tangent, nodes.clone()));
        }
        let rigid = self.record.rigid_bodies.iter().flat_map(RigidRecord::responses);
        Ok(Tangents::new(each, rigid.collect()))
    }

    /// What the loss says of the force of a contact.
    fn of_contact(&self, contact: &ContactRecord) -> Vec3 {
        let own = self.seeds[contact.body];
        match contact.partner {
            Partner::Collider(collider) => own.of_collider(collider),
            Partner::Body(other) => own.of_body(other) - self.seeds[other].of_body(contact.body),
        }
    }

    /// The laws of contacts whose nodes are not stuck, and of cables that are held at a length.
    fn rows(&self, known: &[Known], z_stuck: &[Vec3]) -> ContactRows<'a> {
        let mut rows = ContactRows::new(
            self.others.iter().map(|contact| (*contact, self.of_contact(contact))).collect(),
        );
        for (k, body) in self.record.bodies.iter().enumerate() {
            for (cable, of_end) in body.cables.iter().zip(&known[k].of_cables) {
                if let Some(compliance) = cable.compliance() {
                    let mut force = cable.force();
                    force.iter_mut().for_each(|(node, _)| *node += self.nodes[k].start);
                    let of_tension = of_end.tension + along(&force, z_stuck);
                    rows.add_cable(force, compliance, of_tension);
                }
            }
        }
        rows
    }

    /// Adds what stuck nodes carry from the start to the end.
    fn add_by_stuck(&self, known: &[Known], z: &[Vec3], of_fixed: &[Vec3], of_start: &mut [Vec3]) {
        for &(node, contact) in &self.stuck {
            let Known { inertia, .. } = &known[contact.body];
            let h = self.record.bodies[contact.body].h;
            let held = (1.0 / h + inertia.damping) / h;
            let mass = inertia.masses[node - self.nodes[contact.body].start];
            let carried = of_fixed[node] - z[node] * (held * mass);
            let normal = contact.frame[0];
            let along = normal * normal.dot(&carried);
            of_start[node] += if contact.recovers { carried } else { carried - along };
            if let Some(geometry) = &contact.on_collider {
                of_start[node] += geometry.by_stuck(contact, &carried);
            }
        }
    }

    /// Gives every body its part.
    fn split(&self, known: &mut [Known], share: &ContactShare, z: &[Vec3], of_fixed: &[Vec3]) -> Vec<Solved> {
        for (body, partner, of) in &share.of_friction {
            match partner {
                Partner::Collider(_) => known[*body].of.friction += of,
                Partner::Body(other) => {
                    known[*body].of.friction += 0.5 * of;
                    known[*other].of.friction += 0.5 * of;
                }
            }
        }
        let mut lengths = share.of_cables.iter();
        let mut solved = Vec::with_capacity(known.len());
        for (k, known) in known.iter_mut().enumerate() {
            let (nodes, record) = (self.nodes[k].clone(), &self.record.bodies[k]);
            let of_start = &share.of_start[nodes.clone()];
            known.of.x_start.iter_mut().zip(of_start).for_each(|(x, c)| *x += c);
            let mut of_targets = share.of_targets[nodes.clone()].to_vec();
            let z = z[nodes.clone()].to_vec();
            let mut of_pins = vec![Vec3::zeros(); z.len()];
            for pin in record.pins.iter().map(|&pin| pin as usize) {
                of_pins[pin] = of_fixed[nodes.start + pin] + std::mem::take(&mut of_targets[pin]);
            }
            add_by_targets(record, known, &of_targets);
            let cables = record.cables.iter().zip(&known.of_cables).map(|(cable, of_end)| {
                let q = cable.compliance().and_then(|_| lengths.next().copied()).unwrap_or(0.0);
                cable.back(&z, q, *of_end, &mut known.of.x_start)
            });
            let cables = cables.collect();
            solved.push(Solved { z, of_pins, cables });
        }
        solved
    }
}

/// Adds what is with respect to where free nodes would go, `xₙ + h vₙ + h² (g + f/m)`.
fn add_by_targets(record: &BodyRecord, known: &mut Known, of_targets: &[Vec3]) {
    let (h, Known { inertia, of, .. }) = (record.h, known);
    for (node, of_target) in of_targets.iter().enumerate().filter(|(_, of)| **of != Vec3::zeros()) {
        let m = inertia.masses[node];
        of.x_start[node] += of_target;
        of.v_start[node] += of_target * h;
        of.gravity += of_target * (h * h * record.gravity_scale);
        of.forces[node] += of_target * (h * h / m);
        let force = record.forces.get(node).copied().unwrap_or_default();
        of.masses[node] -= of_target.dot(&force) * (h * h / (m * m));
    }
}
