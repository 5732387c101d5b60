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
    /// Where the last step began, of bodies that go forward by two.
    pub(crate) history: History,
    pub(crate) sleep: Sleep,
}

/// The state before the last step; empty where there is none to go on from.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct History {
    /// Length of the step \[s\].
    pub h: f64,
    pub x: Vec<Vec3>,
    pub v: Vec<Vec3>,
}

impl History {
    pub fn clear(&mut self) {
        self.x.clear();
        self.v.clear();
    }
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

/// Slots from here to the links name contacts between deformable bodies.
pub(crate) const SOFT_SLOT: u32 = FIRST_LINK_SLOT - 16;

impl ContactKey {
    /// Whether it names a contact between deformable bodies.
    pub fn is_between(&self) -> bool {
        (SOFT_SLOT..FIRST_LINK_SLOT).contains(&self.slot)
    }

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
    pub geometry: ContactGeometry,
}

/// Where a contact acts: what its rows in the matrix of the contact problem are made of. While it is
/// nearly what it was, the next step takes it as it was: at rest, where rapier's poses differ in their last
/// digits from step to step, the matrix then stays the same to the last bit and need not be made again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ContactGeometry {
    /// Of soft sides: nodes and their weights.
    pub nodes: [[u32; 3]; 2],
    pub weights: [[f64; 3]; 2],
    /// Normal and tangents.
    pub frame: [Vec3; 3],
    /// Of rigid sides: from the centre of mass to the point \[m\].
    pub arms: [Vec3; 2],
}

/// Part of weights, directions and arms by which a geometry may be off. What it leaves of a change of
/// forces within an iteration is this part, for the next iteration to find.
const NEAR: f64 = 1.0e-5;

impl ContactGeometry {
    /// Whether it serves in the place of another; `rounding` \[m\] is that of rapier's positions.
    pub fn is_near(&self, other: &Self, rounding: f64) -> bool {
        let near = |a: &Vec3, b: &Vec3, by: f64| (a - b).amax() <= by;
        // A node that counts in one of them only may have no columns to be read.
        let weighs = |(a, b): (&f64, &f64)| (a - b).abs() <= NEAR && (*a == 0.0) == (*b == 0.0);
        self.nodes == other.nodes
            && self.weights.iter().flatten().zip(other.weights.iter().flatten()).all(weighs)
            && self.frame.iter().zip(&other.frame).all(|(a, b)| near(a, b, NEAR))
            && self.arms.iter().zip(&other.arms).all(|(a, b)| near(a, b, NEAR * a.amax() + rounding))
    }
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
