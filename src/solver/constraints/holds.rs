//! What contacts and attachments hold of a body while hard limits bring its stretches back.

use super::system::ContactSystem;
use crate::contact::{Constraint, Endpoint};
use crate::fem::{Holds, Room};
use crate::math::{Mat3, Vec3};
use crate::solver::body_step::BodyProblem;

/// Part of a direction that has to be new: directions that differ by less are one that is held already.
const NEW: f64 = 0.05;

impl ContactSystem {
    /// Takes from nodes of the island's body `index` what constraints hold that carry: motion along their directions. What carries
    /// nothing leaves room as far as its gap goes, half of it to either of two bodies.
    pub fn hold(&self, index: usize, body: &mut BodyProblem) {
        let (holds, masses) = body.free_holds();
        for contact in &self.active {
            if contact.force(&self.lambda) != Vec3::zeros() {
                for_each_endpoint(&contact.constraint, index, |nodes, _, direction| {
                    let nodes = nodes.iter().map(|n| *n as usize);
                    nodes.for_each(|n| hold(&mut holds.mobility[n], masses[n], &direction));
                });
            } else {
                let gap = self.gaps.get(contact.first).copied().unwrap_or_default();
                leave_room(&contact.constraint, index, gap, holds);
            }
        }
        for candidate in &self.candidates {
            leave_room(&candidate.constraint, index, candidate.end, holds);
        }
    }
}

fn for_each_endpoint(constraint: &Constraint, index: usize, mut with: impl FnMut(&[u32], &[f64], Vec3)) {
    let mut of = |endpoint: &Endpoint, direction: Vec3| {
        if let Endpoint::Soft { body, nodes, weights } = endpoint
            && *body == index
        {
            let count = weights.iter().rposition(|w| *w != 0.0).map_or(0, |last| last + 1);
            with(&nodes[..count], &weights[..count], direction);
        }
    };
    let [a, b] = &constraint.endpoints;
    of(a, constraint.frame[0]);
    of(b, -constraint.frame[0]);
    for point in &constraint.path {
        if let Some(direction) = point.direction.try_normalize(0.0) {
            of(&point.endpoint, direction);
        }
    }
}

fn leave_room(constraint: &Constraint, index: usize, gap: f64, holds: &mut Holds) {
    let is_shared = constraint.endpoints.iter().all(|e| matches!(e, Endpoint::Soft { .. }));
    let left = gap.max(0.0) * if is_shared { 0.5 } else { 1.0 };
    if !constraint.path.is_empty() || !matches!(constraint.law, crate::contact::Law::Contact { .. }) {
        return;
    }
    for_each_endpoint(constraint, index, |nodes, weights, direction| {
        let mut room = Room { nodes: [nodes[0]; 3], weights: [0.0; 3], direction, left };
        room.nodes[..nodes.len()].copy_from_slice(nodes);
        room.weights[..weights.len()].copy_from_slice(weights);
        holds.rooms.push(room);
    });
}

/// Takes motion along a unit direction from what a node may do: `W → W − W n nᵀW / nᵀW n`.
fn hold(mobility: &mut Mat3, mass: f64, direction: &Vec3) {
    let moved = *mobility * direction;
    let yields = direction.dot(&moved);
    if yields * mass > NEW * NEW {
        *mobility -= moved * moved.transpose() / yields;
    }
}
