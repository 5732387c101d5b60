//! Which bodies have to be solved together: those that touch the same yielding partner, directly or
//! through what ties or holds it.

use super::work::{BodyWork, IslandWork};
use crate::contact::{Row, Side};
use crate::solver::Partners;

/// Memory for forming islands.
#[derive(Default)]
pub(super) struct Grouping {
    /// Bodies, then partners: a member of the same group with a smaller index, or itself.
    parent: Vec<usize>,
    /// The island of each group, at the group's first body.
    island_of_root: Vec<Option<usize>>,
    bodies: usize,
}

impl Grouping {
    /// Moves the problems and rows of all bodies, and the rows between them or their partners, into islands,
    /// ordered by their first bodies; returns how many there are.
    pub fn form(
        &mut self,
        works: &mut [BodyWork],
        links: &mut Vec<Row>,
        partners: &Partners,
        islands: &mut Vec<IslandWork>,
    ) -> usize {
        self.join(works, links, partners);
        for island in islands.iter_mut() {
            island.members.clear();
            island.handles.clear();
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
        for row in links.drain(..) {
            let root = self.ends(&row, partners).next().map(|p| self.root_of(p));
            // Partners that no body touches have an index beyond the bodies for their root.
            if let Some(Some(place)) = root.and_then(|root| self.island_of_root.get(root)) {
                islands[*place].take_in_link(row);
            }
        }
        islands.truncate(count);
        count
    }

    fn join(&mut self, works: &[BodyWork], links: &[Row], partners: &Partners) {
        self.bodies = works.len();
        self.parent.clear();
        self.parent.extend(0..works.len() + partners.list.len());
        for row in works.iter().flat_map(|work| &work.rows).chain(links) {
            let mut ends = self.ends(row, partners);
            if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
                self.unite(a, b);
            }
        }
    }

    /// Places of the soft bodies and yielding partners of a row.
    fn ends<'a>(&self, row: &'a Row, partners: &'a Partners) -> impl Iterator<Item = usize> + use<'a> {
        let first = self.bodies;
        row.sides.iter().filter_map(move |side| match side {
            Side::Soft { body, .. } => Some(*body),
            Side::Partner { partner, .. } | Side::Turn { partner } => {
                partners.yields(*partner).then(|| first + partners.group(*partner).0 as usize)
            }
        })
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }

    fn root(&mut self, i: usize) -> usize {
        let root = self.root_of(i);
        self.parent[i] = root;
        root
    }

    fn root_of(&self, i: usize) -> usize {
        let mut at = i;
        while self.parent[at] != at {
            at = self.parent[at];
        }
        at
    }
}
