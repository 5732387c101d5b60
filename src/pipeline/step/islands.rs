//! Which bodies have to be solved together: those that touch the same yielding proxy, directly or
//! through attachments or the rigid neighbourhood.

use super::island_work::IslandWork;
use super::work::BodyWork;
use crate::contact::{Constraint, Endpoint};
use crate::solver::RigidProxies;

/// Memory for forming islands.
#[derive(Default)]
pub(super) struct Grouping {
    /// Bodies, then proxies: a member of the same group with a smaller index, or itself.
    parent: Vec<usize>,
    /// The island of each group, at the group's first body.
    island_of_root: Vec<Option<usize>>,
    bodies: usize,
}

impl Grouping {
    /// Moves the problems and constraints of all bodies, and the constraints between them or their proxies, into islands,
    /// ordered by their first bodies; returns how many there are.
    pub fn form(
        &mut self,
        works: &mut [BodyWork],
        links: &mut Vec<Constraint>,
        proxies: &RigidProxies,
        islands: &mut Vec<IslandWork>,
    ) -> usize {
        self.join(works, links, proxies);
        for island in islands.iter_mut() {
            island.members.clear();
            island.handles.clear();
            island.island.contacts.clear();
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
            islands[place].add_body(index, &mut works[index]);
        }
        for constraint in links.drain(..) {
            let root = self.ends(&constraint, proxies).next().map(|p| self.root_of(p));
            // Proxies that no body touches have an index beyond the bodies for their root.
            if let Some(Some(place)) = root.and_then(|root| self.island_of_root.get(root)) {
                islands[*place].add_shared(constraint);
            }
        }
        islands.truncate(count);
        count
    }

    fn join(&mut self, works: &[BodyWork], links: &[Constraint], proxies: &RigidProxies) {
        self.bodies = works.len();
        self.parent.clear();
        self.parent.extend(0..works.len() + proxies.list.len());
        for constraint in works.iter().flat_map(|work| &work.constraints).chain(links) {
            let mut ends = self.ends(constraint, proxies);
            let Some(first) = ends.next() else { continue };
            ends.for_each(|end| self.unite(first, end));
        }
    }

    /// Places of the soft bodies and yielding proxies of a constraint.
    fn ends<'a>(
        &self,
        constraint: &'a Constraint,
        proxies: &'a RigidProxies,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let first = self.bodies;
        constraint.all_endpoints().filter_map(move |endpoint| match endpoint {
            Endpoint::Soft { body, .. } => Some(*body),
            Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => {
                proxies.yields(*proxy).then(|| first + proxies.group(*proxy).0 as usize)
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
