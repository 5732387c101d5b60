//! What changes while a body moves.

use super::sleep::Sleep;
use crate::math::Vec3;

/// What the motion of a body changes: what a snapshot has to hold beside the user's own settings (pins,
/// forces, material). A body restored from it goes on with the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct DeformableState {
    /// Node positions \[m\].
    pub(crate) x: Vec<Vec3>,
    /// Node velocities [m/s].
    pub(crate) v: Vec<Vec3>,
    /// Contacts of the last step, ascending by key: warm starts of the next.
    pub(crate) contacts: Vec<ContactMemory>,
    /// What held the rigid bodies of the island in the last step, ascending by key; with the first body
    /// of the island.
    pub(crate) closure: Vec<ContactMemory>,
    pub(crate) sleep: Sleep,
}

/// Names a contact over several steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ContactKey {
    /// The obstacle, as coupling names it.
    pub obstacle: u64,
    /// Part of a composite obstacle.
    pub part: u32,
    /// Surface feature of the body: nodes first, then edges, then triangles, then corners of the
    /// obstacle.
    pub feature: u32,
    /// Which of the contacts on one feature: closest points of curved surfaces have several.
    pub slot: u32,
}

/// Slots from here on name rows that are no contacts of a deformable body: what holds rigid bodies, and
/// attachments.
pub(crate) const FIRST_LINK_SLOT: u32 = u32::MAX - 15;

impl ContactKey {
    /// Whether it names a row that belongs to an island and not to one body.
    pub fn is_link(&self) -> bool {
        self.slot >= FIRST_LINK_SLOT
    }
}

/// What one contact leaves to the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactMemory {
    pub key: ContactKey,
    /// Force on the body \[N\], in the world.
    pub force: Vec3,
    /// De Saxcé shift μ‖slip‖ \[m\] over the step, per second of it [m/s].
    pub shift_rate: f64,
    /// Where on the body: nodes and their weights.
    pub nodes: [u32; 3],
    pub weights: [f64; 3],
}

/// Farther than this [m], or faster [m/s], is no number to rapier: its `f32` overflows in squares.
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

    /// The contact of the last step with this key.
    pub(crate) fn contact(&self, key: &ContactKey) -> Option<&ContactMemory> {
        let place = self.contacts.binary_search_by(|c| c.key.cmp(key));
        place.ok().map(|i| &self.contacts[i])
    }

    /// The row between rigid bodies of the last step with this key.
    pub(crate) fn closure_row(&self, key: &ContactKey) -> Option<&ContactMemory> {
        let place = self.closure.binary_search_by(|c| c.key.cmp(key));
        place.ok().map(|i| &self.closure[i])
    }

    /// The contacts of the last step with one obstacle.
    pub(crate) fn contacts_with(&self, obstacle: u64, part: u32) -> &[ContactMemory] {
        let before = |c: &ContactMemory| (c.key.obstacle, c.key.part) < (obstacle, part);
        let start = self.contacts.partition_point(before);
        let same = |c: &ContactMemory| (c.key.obstacle, c.key.part) == (obstacle, part);
        let count = self.contacts[start..].partition_point(same);
        &self.contacts[start..start + count]
    }
}
