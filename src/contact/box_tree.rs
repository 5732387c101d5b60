//! Boxes that move a little from step to step, in a tree.
//!
//! The tree holds fat boxes, and is left alone while every box stays in its fat one. What it finds is a superset, to be
//! filtered by the boxes of the step: results do not depend on what the tree has seen before.

use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

/// A tree over numbered boxes.
#[derive(Default)]
pub(crate) struct BoxTree {
    tree: Bvh,
    fat: Vec<Aabb>,
    /// How often a box has left its fat one since the tree was built.
    departures: usize,
    workspace: BvhWorkspace,
}

/// Room around a box, as part of its longest side.
const FAT: f32 = 0.1;

impl BoxTree {
    /// Brings the tree up to date; returns whether a box has left its fat one.
    pub fn update(&mut self, boxes: &[Aabb]) -> bool {
        if self.fat.len() != boxes.len() {
            self.fat.clear();
            self.fat.extend(boxes.iter().map(fattened));
            self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &self.fat);
            self.departures = 0;
            return true;
        }
        let before = self.departures;
        for (number, (fat, aabb)) in (0..).zip(self.fat.iter_mut().zip(boxes)) {
            if !fat.contains(aabb) {
                *fat = fattened(aabb);
                self.tree.insert_or_update_partially(*fat, number, 0.0);
                self.departures += 1;
            }
        }
        if self.departures == before {
            return false;
        }
        // When the boxes have gone as far as they are long, on average, neighbours in the tree are none any more.
        if self.departures as f32 * FAT > boxes.len() as f32 {
            self.tree.rebuild(&mut self.workspace, BvhBuildStrategy::Binned);
            self.departures = 0;
        } else {
            self.tree.refit_without_opt();
        }
        true
    }

    /// Numbers of the boxes that may meet `aabb`, in no order.
    pub fn near<'a>(&'a self, aabb: &'a Aabb) -> impl Iterator<Item = u32> + 'a {
        self.tree.intersect_aabb(aabb)
    }

    /// Pairs of boxes that may meet, the lower number first, in no order.
    pub fn list_pairs(&mut self, found: &mut Vec<[u32; 2]>) {
        found.clear();
        let mut add = |a: u32, b: u32| found.push([a.min(b), a.max(b)]);
        self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut add);
    }
}

fn fattened(aabb: &Aabb) -> Aabb {
    let fat = aabb.loosened(FAT * aabb.extents().max_element());
    // A half-space has no room left around it.
    if fat.extents().is_finite() { fat } else { *aabb }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::math::Vector;
    use proptest::prelude::*;

    fn vector(size: f32) -> impl Strategy<Value = Vector> {
        [-size..size, -size..size, -size..size].prop_map(Vector::from)
    }

    /// What becomes of the boxes in a step.
    #[derive(Clone, Debug)]
    enum Change {
        /// All move a little.
        Drift(Vector),
        /// One is elsewhere.
        Teleport(usize, Vector),
        Remove(usize),
        Insert(Vector),
        /// Two change places in the list.
        Swap(usize, usize),
        Nothing,
    }

    fn change() -> impl Strategy<Value = Change> {
        prop_oneof![
            6 => vector(0.05).prop_map(Change::Drift),
            2 => (0..99usize, vector(2.0)).prop_map(|(k, to)| Change::Teleport(k, to)),
            1 => (0..99usize).prop_map(Change::Remove),
            1 => vector(2.0).prop_map(Change::Insert),
            1 => (0..99usize, 0..99usize).prop_map(|(a, b)| Change::Swap(a, b)),
            2 => Just(Change::Nothing),
        ]
    }

    fn apply(change: Change, places: &mut Vec<Vector>) {
        let count = places.len();
        match change {
            Change::Drift(way) => {
                let turned =
                    |k: usize| if k.is_multiple_of(2) { way } else { Vector::new(way.z, -way.x, way.y) };
                (0..count).for_each(|k| places[k] += turned(k));
            }
            Change::Teleport(k, to) if count > 0 => places[k % count] = to,
            Change::Remove(k) if count > 0 => drop(places.remove(k % count)),
            Change::Insert(at) => places.push(at),
            Change::Swap(a, b) if count > 0 => places.swap(a % count, b % count),
            _ => {}
        }
    }

    proptest! {
        #[test]
        fn kept_trees_and_pairs_find_what_all_pairs_find(
            places in proptest::collection::vec(vector(1.5), 0..50),
            changes in proptest::collection::vec(change(), 1..60),
            query in vector(1.5),
        ) {
            let (mut places, mut kept, mut pairs) = (places, BoxTree::default(), Vec::new());
            let half = |k: usize| Vector::new(0.1, 0.15, 0.05 * (1 + k % 7) as f32);
            for change in changes {
                apply(change, &mut places);
                let boxes: Vec<Aabb> =
                    places.iter().enumerate().map(|(k, at)| Aabb::from_half_extents(*at, half(k))).collect();
                if kept.update(&boxes) {
                    kept.list_pairs(&mut pairs);
                }
                let mut found: Vec<[u32; 2]> = pairs.clone();
                found.retain(|pair| {
                    let [a, b] = pair.map(|k| &boxes[k as usize]);
                    a.intersects(b)
                });
                found.sort_unstable();
                let count = boxes.len() as u32;
                let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
                let met: Vec<[u32; 2]> =
                    all.filter(|[a, b]| boxes[*a as usize].intersects(&boxes[*b as usize])).collect();
                prop_assert_eq!(found, met);
                let around = Aabb::from_half_extents(query, Vector::splat(0.3));
                let mut near: Vec<u32> =
                    kept.near(&around).filter(|&k| boxes[k as usize].intersects(&around)).collect();
                near.sort_unstable();
                let met: Vec<u32> = (0..count).filter(|&k| boxes[k as usize].intersects(&around)).collect();
                prop_assert_eq!(near, met);
            }
        }
    }
}
