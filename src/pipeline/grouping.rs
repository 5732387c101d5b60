//! Which bodies have to be solved together: those that touch the same yielding partner, directly or
//! through others.

use super::work::{BodyWork, IslandWork};
use crate::contact::Side;
use crate::solver::Partner;

/// Memory for forming islands.
#[derive(Default)]
pub(super) struct Grouping {
    /// A body of the same group with a smaller index, or itself.
    parent: Vec<usize>,
    /// The first body that touches each partner.
    first_on_partner: Vec<Option<usize>>,
    /// The island of each group, at the group's first body.
    island_of_root: Vec<Option<usize>>,
}

impl Grouping {
    /// Moves the problems and rows of all bodies into islands, ordered by their first bodies; returns
    /// how many there are.
    pub fn form(
        &mut self,
        works: &mut [BodyWork],
        partners: &[Partner],
        islands: &mut Vec<IslandWork>,
    ) -> usize {
        self.join(works, partners);
        for island in islands.iter_mut() {
            island.members.clear();
            island.island.contacts.rows.clear();
        }
        self.island_of_root.clear();
        self.island_of_root.resize(works.len(), None);
        let mut count = 0;
        for index in 0..works.len() {
            let root = self.root(index);
            let place = *self.island_of_root[root].get_or_insert(count);
            count = count.max(place + 1);
            if place == islands.len() {
                islands.push(IslandWork::default());
            }
            islands[place].take_in(index, &mut works[index]);
        }
        islands.truncate(count);
        count
    }

    fn join(&mut self, works: &[BodyWork], partners: &[Partner]) {
        self.parent.clear();
        self.parent.extend(0..works.len());
        self.first_on_partner.clear();
        self.first_on_partner.resize(partners.len(), None);
        for (index, work) in works.iter().enumerate() {
            for side in work.rows.iter().flat_map(|row| &row.sides) {
                let Side::Partner { partner, .. } = side else { continue };
                if partners[partner.0 as usize].yields() {
                    let other = *self.first_on_partner[partner.0 as usize].get_or_insert(index);
                    let (a, b) = (self.root(other), self.root(index));
                    self.parent[a.max(b)] = a.min(b);
                }
            }
        }
    }

    fn root(&mut self, i: usize) -> usize {
        let mut at = i;
        while self.parent[at] != at {
            self.parent[at] = self.parent[self.parent[at]];
            at = self.parent[at];
        }
        at
    }
}
