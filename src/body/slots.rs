//! Slots with generations: where bodies live.

use rapier3d::data::arena::Index;
use std::collections::BTreeSet;

/// Values in numbered slots. Rapier's own arena keeps a list of free slots inside, which a broken snapshot can tie into a
/// knot; here it follows from the slots.
#[derive(Clone, Debug)]
pub(super) struct Slots<T> {
    slots: Vec<Slot<T>>,
    /// Slots without a value. The lowest is taken first.
    free: BTreeSet<u32>,
}

#[derive(Clone, Debug)]
pub(super) struct Slot<T> {
    /// How often it was emptied.
    pub generation: u32,
    pub value: Option<T>,
}

impl<T> Slot<T> {
    fn value_of(&mut self, generation: u32) -> Option<&mut T> {
        self.value.as_mut().filter(|_| self.generation == generation)
    }
}

impl<T> Default for Slots<T> {
    fn default() -> Self {
        Self { slots: Vec::new(), free: BTreeSet::new() }
    }
}

impl<T> Slots<T> {
    /// Of slots that were saved.
    #[cfg(feature = "serde-serialize")]
    pub fn new(slots: Vec<Slot<T>>) -> Self {
        let free = (0..).zip(&slots).filter(|(_, slot)| slot.value.is_none()).map(|(i, _)| i).collect();
        Self { slots, free }
    }

    #[cfg(feature = "serde-serialize")]
    pub fn slots(&self) -> &[Slot<T>] {
        &self.slots
    }

    pub fn insert(&mut self, value: T) -> Index {
        let index = self.free.pop_first().unwrap_or_else(|| {
            self.slots.push(Slot { generation: 0, value: None });
            self.slots.len() as u32 - 1
        });
        let slot = &mut self.slots[index as usize];
        slot.value = Some(value);
        Index::from_raw_parts(index, slot.generation)
    }

    pub fn remove(&mut self, index: Index) -> Option<T> {
        let (i, generation) = index.into_raw_parts();
        let slot = self.slots.get_mut(i as usize).filter(|slot| slot.generation == generation)?;
        let value = slot.value.take()?;
        slot.generation = generation.wrapping_add(1);
        self.free.insert(i);
        Some(value)
    }

    pub fn get(&self, index: Index) -> Option<&T> {
        let (i, generation) = index.into_raw_parts();
        let slot = self.slots.get(i as usize).filter(|slot| slot.generation == generation)?;
        slot.value.as_ref()
    }

    pub fn get_mut(&mut self, index: Index) -> Option<&mut T> {
        let (i, generation) = index.into_raw_parts();
        let slot = self.slots.get_mut(i as usize).filter(|slot| slot.generation == generation)?;
        slot.value.as_mut()
    }

    /// Two values at once; of one slot there is one at the most.
    pub fn get2_mut(&mut self, first: Index, second: Index) -> (Option<&mut T>, Option<&mut T>) {
        let ((i, of_first), (j, of_second)) = (first.into_raw_parts(), second.into_raw_parts());
        if i == j || i.max(j) as usize >= self.slots.len() {
            // One slot, or one that is none.
            return if self.get(first).is_some() {
                (self.get_mut(first), None)
            } else {
                (None, self.get_mut(second))
            };
        }
        match self.slots.get_disjoint_mut([i as usize, j as usize]) {
            Ok([a, b]) => (a.value_of(of_first), b.value_of(of_second)),
            Err(_) => (None, None),
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = (Index, &T)> {
        (0..)
            .zip(&self.slots)
            .filter_map(|(i, slot)| Some((Index::from_raw_parts(i, slot.generation), slot.value.as_ref()?)))
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Index, &mut T)> {
        (0..)
            .zip(&mut self.slots)
            .filter_map(|(i, slot)| Some((Index::from_raw_parts(i, slot.generation), slot.value.as_mut()?)))
    }

    pub fn len(&self) -> usize {
        self.slots.len() - self.free.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashMap;

    proptest! {
        #[test]
        fn slots_hold_what_a_map_holds(steps in prop::collection::vec((0..3u8, 0..12usize), 1..80)) {
            let (mut slots, mut map, mut known) = (Slots::default(), HashMap::new(), Vec::new());
            for (n, (what, which)) in steps.into_iter().enumerate() {
                let index = known.get(which).copied();
                match (what, index) {
                    (0, _) | (_, None) => {
                        let index = slots.insert(n);
                        prop_assert!(map.insert(index, n).is_none(), "a handle is never used again");
                        known.push(index);
                    }
                    (1, Some(index)) => prop_assert_eq!(slots.remove(index), map.remove(&index)),
                    (_, Some(index)) => {
                        let other = known[known.len() - 1];
                        let (a, b) = slots.get2_mut(index, other);
                        let expected = map.get(&other).filter(|_| index != other);
                        prop_assert_eq!(a.as_deref(), map.get(&index));
                        prop_assert_eq!(b.as_deref(), expected);
                    }
                }
                prop_assert_eq!(slots.len(), map.len());
                prop_assert!(known.iter().all(|i| slots.get(*i) == map.get(i)));
                let all: Vec<_> = slots.iter().map(|(i, v)| (i, *v)).collect();
                prop_assert!(all.len() == map.len() && all.is_sorted() && all.iter().all(|(i, v)| map[i] == *v));
            }
        }
    }
}
