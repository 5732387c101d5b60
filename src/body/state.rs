//! What changes while a body moves.

use super::constraint_memory::{ConstraintKey, ConstraintMemory};
use super::contacts::{DeformableContact, DeformablePairContact};
use super::factor_base::FactorBase;
use super::handle::DeformableBodyHandle;
use super::impact::{Impact, Partner};
use super::twist::HeldTwist;
use crate::fem::{Dampers, DeformableModel, are_dampers};
use crate::math::{Pose64, Vec3};
use rapier3d::dynamics::RigidBodyHandle;

/// What the motion of a body changes: what a snapshot has to hold beside the user's own settings (pins,
/// forces, material). A body restored from it goes on with the same bits.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableState {
    /// Node positions \[m\].
    pub(crate) x: Vec<Vec3>,
    /// Node velocities [m/s].
    pub(crate) v: Vec<Vec3>,
    /// Contacts of the last step, ascending by key: warm starts of the next.
    pub(crate) contacts: Vec<ConstraintMemory>,
    /// Constraints of the rigid neighbourhood and of attachments in the last step, ascending by key; with the first body
    /// of the island.
    pub(crate) shared: Vec<ConstraintMemory>,
    /// What it hits and has not parted from, with restitution.
    pub(crate) impacts: Vec<Impact>,
    /// What hooks have noted of the pairs that it is in, with the partner, packed.
    pub(crate) pair_data: Vec<(Partner, u32)>,
    /// What Maxwell branches have given way.
    pub(crate) dampers: Dampers,
    /// Where the last step began, of bodies that go forward by two.
    pub(crate) history: History,
    pub(crate) sleep: Sleep,
    pub(crate) factor_base: FactorBase,
    /// Rods that are held against roll, ascending.
    pub(crate) twists: Vec<HeldTwist>,
}

/// The state before the last step; empty where no step can go on from it.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct History {
    /// Length of the step \[s\].
    pub h: f64,
    pub x: Vec<Vec3>,
    pub v: Vec<Vec3>,
    /// Accelerations [m/s²] of a step of generalized-α, and what contacts hold nodes against \[N\].
    pub acceleration: Vec<Vec3>,
    pub steady: Vec<Vec3>,
    /// Steps in contact to come that are of implicit Euler, and how often in a row it had to step in.
    pub wait: u8,
    pub failures: u8,
    /// Elastic energy \[J\] that the multipliers of position-based dynamics held at the end of the last step.
    pub held: Option<f64>,
}

/// Most failures in a row that double the steps until the next try.
const MAX_FAILURES: u8 = 4;

impl History {
    /// Notes how a step in contact went: by generalized-α, or because that had failed, or in wait of the next try.
    pub fn count(&mut self, went: bool, failed: bool) {
        if failed {
            self.failures = (self.failures + 1).min(MAX_FAILURES);
            self.wait = (1 << self.failures) - 1;
        } else if went {
            self.failures = 0;
        } else {
            self.wait = self.wait.saturating_sub(1);
        }
    }

    pub fn clear(&mut self) {
        self.x.clear();
        self.v.clear();
        self.acceleration.clear();
        self.steady.clear();
        self.held = None;
    }
}

/// How a body sleeps, or how far it is from that.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Sleep {
    /// Time \[s\] for which the body has been still.
    pub still_for: f64,
    /// Its user has put it to sleep; the next step looks around.
    pub is_asked: bool,
    pub surroundings: Option<Surroundings>,
    /// Rigid bodies that slept on a body that does so no more, for the next step to wake: what it carried may have nothing
    /// below it.
    pub released: Vec<RigidBodyHandle>,
    /// With which it fell asleep: they stay what `contacts` lists.
    pub contacts: Vec<DeformableContact>,
    /// Of which it is the first body.
    pub pair_contacts: Vec<DeformablePairContact>,
}

/// What was around a body when it fell asleep: whatever differs wakes it.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Surroundings {
    /// Key, part, and pose of the obstacles near it.
    pub obstacles: Vec<(u64, u32, Pose64)>,
    /// The next of the bodies that fell asleep together, because they touched, in a ring.
    pub mate: Option<DeformableBodyHandle>,
    pub gravity: Vec3,
    /// Rigid bodies that fell asleep with it.
    pub rigid: Vec<RigidBodyHandle>,
}

impl Surroundings {
    /// Whether the things around are those of another time.
    pub fn is_around(&self, other: &Self) -> bool {
        self.obstacles == other.obstacles && self.gravity == other.gravity
    }
}

/// Farther than this [m], or faster [m/s], overflows in squares of rapier's `f32`.
const FARTHEST: f64 = 1.0e15;

/// Whether a position or velocity is one that a step can go on from.
pub(crate) fn is_number(v: &Vec3) -> bool {
    v.iter().all(|c| c.abs() < FARTHEST)
}

impl DeformableState {
    /// Whether a step can go on from it.
    pub(crate) fn is_finite(&self) -> bool {
        self.x.iter().chain(&self.v).all(is_number)
    }

    /// What of it a body of this model cannot have; positions and velocities may be anything.
    ///
    /// # Errors
    /// What is wrong.
    pub(super) fn check(&self, model: &DeformableModel) -> Result<(), &'static str> {
        let nodes = model.rest.len();
        if self.x.len() != nodes || self.v.len() != nodes {
            return Err("its positions or velocities are not those of its mesh");
        }
        let lists = [&self.history.x, &self.history.v, &self.history.acceleration, &self.history.steady];
        let is_list =
            |list: &&Vec<Vec3>| list.is_empty() || list.len() == nodes && list.iter().all(is_number);
        if !(lists.iter().all(is_list)
            && self.history.x.len() == self.history.v.len()
            && self.history.h.is_finite()
            && self.history.held.is_none_or(f64::is_finite))
        {
            return Err("the step before its last is not one of its mesh");
        }
        let memories = || [&self.contacts, &self.shared].into_iter();
        if !memories().all(|list| list.is_sorted_by(|a, b| a.key < b.key)) {
            return Err("its contacts are not in order");
        }
        let is_memory = |memory: &ConstraintMemory| {
            let (of, numbers) = (&memory.geometry.nodes[0], memory.numbers());
            let is_own = matches!(memory.key, ConstraintKey::Obstacle(_));
            numbers.iter().all(is_number) && !(is_own && of.iter().any(|n| *n as usize >= nodes))
        };
        if !memories().flatten().all(is_memory) {
            return Err("a contact is not one of its mesh");
        }
        let slept_on = self.sleep.contacts.iter().map(|c| &c.vertices);
        let slept_with = self.sleep.pair_contacts.iter().map(|c| &c.vertices[0]);
        if slept_on.chain(slept_with).flatten().any(|vertex| *vertex >= nodes) {
            return Err("a contact with which it fell asleep is not one of its mesh");
        }
        let numbers = |i: &Impact| [i.approach, i.stored, i.most_stored, i.left];
        if !self.impacts.iter().flat_map(numbers).all(f64::is_finite) {
            return Err("an impact is not finite");
        }
        if !are_dampers(&self.dampers, model) {
            return Err("its dampers are not those of its mesh");
        }
        if !self.are_twists(model) {
            return Err("what holds its rods is not of its mesh");
        }
        self.factor_base.check(nodes)
    }

    /// The contact of the last step with this key.
    pub(crate) fn contact(&self, key: &ConstraintKey) -> Option<&ConstraintMemory> {
        let place = self.contacts.binary_search_by(|c| c.key.cmp(key));
        place.ok().map(|i| &self.contacts[i])
    }

    /// The shared constraint of the last step with this key.
    pub(crate) fn shared_memory(&self, key: &ConstraintKey) -> Option<&ConstraintMemory> {
        let place = self.shared.binary_search_by(|c| c.key.cmp(key));
        place.ok().map(|i| &self.shared[i])
    }

    /// The contacts of the last step with one obstacle.
    pub(crate) fn contacts_with(&self, obstacle: u64, part: u32) -> &[ConstraintMemory] {
        let name = |c: &ConstraintMemory| match c.key {
            ConstraintKey::Obstacle(contact) => (contact.collider, contact.part),
            // Sorted after all contacts with obstacles.
            _ => (u64::MAX, u32::MAX),
        };
        let before = |c: &ConstraintMemory| name(c) < (obstacle, part);
        let start = self.contacts.partition_point(before);
        let same = |c: &ConstraintMemory| name(c) == (obstacle, part);
        let count = self.contacts[start..].partition_point(same);
        &self.contacts[start..start + count]
    }
}
