//! An island as the step keeps it: its solver's bodies and contacts, and which bodies of the step they are.

use super::work::BodyWork;
use crate::body::{ConstraintKey, ConstraintMemory, DeformableBodyHandle, DeformableState, is_number};
use crate::contact::{Constraint, Endpoint};
use crate::solver::Island;

/// An island with the places of its bodies in the step's list.
#[derive(Default)]
pub(super) struct IslandWork {
    pub island: Island,
    pub members: Vec<usize>,
    pub handles: Vec<DeformableBodyHandle>,
    /// The contacts of the problem, ascending by key: names and places.
    by_key: Vec<(ConstraintKey, usize)>,
}

impl IslandWork {
    /// Adds the problem and the constraints of the body at `index` of the step's list.
    pub fn add_body(&mut self, index: usize, work: &mut BodyWork) {
        let local = self.members.len();
        self.members.push(index);
        self.handles.push(work.handle);
        self.island.bodies.extend(work.problem.take());
        for endpoint in work.constraints.iter_mut().flat_map(|constraint| &mut constraint.endpoints) {
            if let Endpoint::Soft { body, .. } = endpoint {
                *body = local;
            }
        }
        self.island.contacts.extend(work.constraints.drain(..));
    }

    /// Adds a constraint between members or proxies of the island: of what holds the latter, of
    /// attachments, of contacts between deformables.
    pub fn add_shared(&mut self, mut constraint: Constraint) {
        for endpoint in constraint.all_endpoints_mut() {
            if let Endpoint::Soft { body, .. } = endpoint {
                // Members are in ascending order.
                let Ok(local) = self.members.binary_search(body) else { return };
                *body = local;
            }
        }
        self.island.contacts.push(constraint);
    }

    /// Whether every number that leaves the island is finite.
    pub fn is_finite(&self) -> bool {
        self.island.bodies.iter().all(|b| b.current.x.iter().all(is_number))
            && self.island.contacts.lambda.iter().all(|l| l.is_finite())
    }

    /// Gives neighbourhood and attachments the forces that a member remembers.
    pub fn warm_start_links(&mut self, state: &DeformableState) {
        let constraints =
            self.island.contacts.candidates.iter_mut().map(|candidate| &mut candidate.constraint);
        for constraint in constraints.filter(|constraint| constraint.key.is_shared()) {
            if let Some(memory) = state.shared_memory(&constraint.key) {
                constraint.warm_start(memory);
            }
        }
    }

    /// Sorts the contacts of the problem for what they leave to the next step. Names are sorted, not memories: those have 272 bytes.
    pub fn sort_contacts(&mut self) {
        let active = &self.island.contacts.active;
        self.by_key.clear();
        self.by_key.extend(active.iter().enumerate().map(|(place, contact)| (contact.constraint.key, place)));
        self.by_key.sort_unstable();
    }

    /// What neighbourhood and attachments leave to the next step, ascending by key, once the contacts are sorted.
    pub fn memory_of_links(&self, h: f64, memory: &mut Vec<ConstraintMemory>) {
        memory.clear();
        let contacts = &self.island.contacts;
        let links = self.by_key.iter().filter(|(key, _)| key.is_shared());
        memory.extend(links.map(|(_, place)| contacts.memory(&contacts.active[*place], h)));
    }

    /// What the contacts of a member leave to the next step, ascending by key, once they are sorted.
    pub fn memory_of(&self, member: usize, h: f64, memory: &mut Vec<ConstraintMemory>) {
        memory.clear();
        // What pushed a rigid shape says nothing of the next step.
        if self.island.bodies[member].is_rejected {
            return;
        }
        let contacts = &self.island.contacts;
        let own = self.by_key.iter().filter(|(key, _)| !key.is_shared());
        let own = own.map(|(_, place)| &contacts.active[*place]);
        let own = own.filter(|contact| contact.constraint.endpoints[0].is_of(member));
        memory.extend(own.map(|contact| contacts.memory(contact, h)));
    }
}
