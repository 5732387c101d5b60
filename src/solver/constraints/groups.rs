//! Contacts in groups between the same two things, ordered so that the factor of their matrix fills in
//! little.

use super::rigid_proxy::RigidProxies;
use crate::contact::{Constraint, Endpoint};

/// The groups of an island's contacts and which of them know of one another.
#[derive(Default)]
pub(crate) struct ContactGroups {
    /// First contact of each group, and the number of contacts last.
    pub starts: Vec<usize>,
    /// Pairs of groups (row, column) of the lower triangle that share something which yields.
    pub coupled: Vec<(usize, usize)>,
    /// Those pairs, and those that elimination in this order adds.
    pub filled: Vec<(usize, usize)>,
    ends: Vec<[Option<u64>; 2]>,
    /// The groups by their ends, ascending.
    known: Vec<([Option<u64>; 2], usize)>,
    group_of_constraint: Vec<usize>,
    sizes: Vec<usize>,
    /// Adjacency during elimination, row by row.
    adjacent: Vec<bool>,
    eliminated: Vec<bool>,
    /// Contacts of each group and of those adjacent to it, as far as they are not eliminated.
    degrees: Vec<usize>,
    /// Groups adjacent to the one that is eliminated.
    near: Vec<usize>,
    rank: Vec<usize>,
    /// The group at each rank.
    order: Vec<usize>,
    /// Ends and sizes of the groups that the order was made for: the same ones, the same order.
    ordered: (Vec<[Option<u64>; 2]>, Vec<usize>),
}

impl ContactGroups {
    /// Puts the constraints into groups, and the groups into an order of least degree.
    pub fn arrange(&mut self, constraints: &mut [Constraint], proxies: &RigidProxies) {
        self.find(constraints, proxies);
        if self.ordered.0 != self.ends || self.ordered.1 != self.sizes {
            self.find_adjacent();
            self.eliminate();
            self.ordered.0.clone_from(&self.ends);
            self.ordered.1.clone_from(&self.sizes);
        }
        let (group_of_constraint, rank) = (&self.group_of_constraint, &self.rank);
        let sorted = group_of_constraint.windows(2).all(|w| rank[w[0]] <= rank[w[1]]);
        if !sorted {
            let known = &self.known;
            let rank_of = |constraint: &Constraint| {
                let found = known.binary_search_by_key(&ends_of(constraint, proxies), |(ends, _)| *ends);
                found.map_or(usize::MAX, |at| rank[known[at].1])
            };
            constraints.sort_unstable_by(|a, b| rank_of(a).cmp(&rank_of(b)).then(a.key.cmp(&b.key)));
        }
        let groups = self.sizes.len();
        self.starts.clear();
        self.starts.push(0);
        for place in 0..groups {
            self.starts.push(self.starts[place] + self.sizes[self.order[place]]);
        }
        self.fill();
    }

    fn find(&mut self, constraints: &[Constraint], proxies: &RigidProxies) {
        self.ends.clear();
        self.known.clear();
        self.sizes.clear();
        self.group_of_constraint.clear();
        for constraint in constraints {
            let ends = ends_of(constraint, proxies);
            let last = self.group_of_constraint.last().copied().filter(|&g: &usize| self.ends[g] == ends);
            let group = last.unwrap_or_else(|| match self.known.binary_search_by_key(&ends, |(e, _)| *e) {
                Ok(at) => self.known[at].1,
                Err(at) => {
                    self.known.insert(at, (ends, self.ends.len()));
                    self.ends.push(ends);
                    self.sizes.push(0);
                    self.ends.len() - 1
                }
            });
            self.sizes[group] += 1;
            self.group_of_constraint.push(group);
        }
    }

    fn find_adjacent(&mut self) {
        let groups = self.ends.len();
        self.adjacent.clear();
        self.adjacent.resize(groups * groups, false);
        for a in 0..groups {
            for b in 0..groups {
                let shared = self.ends[a].iter().flatten().any(|e| self.ends[b].contains(&Some(*e)));
                self.adjacent[a * groups + b] = shared || a == b;
            }
        }
    }

    /// Least degree first, counted in contacts; ties by index.
    fn eliminate(&mut self) {
        let Self { sizes, adjacent, eliminated, degrees, near, rank, order, .. } = self;
        let groups = sizes.len();
        eliminated.clear();
        eliminated.resize(groups, false);
        degrees.clear();
        for row in adjacent.chunks(groups.max(1)) {
            degrees.push(row.iter().zip(&*sizes).filter(|(a, _)| **a).map(|(_, size)| size).sum());
        }
        rank.clear();
        rank.resize(groups, 0);
        order.clear();
        for place in 0..groups {
            let open = (0..groups).filter(|&g| !eliminated[g]);
            let Some(next) = open.min_by_key(|&g| (degrees[g], g)) else { break };
            rank[next] = place;
            order.push(next);
            eliminated[next] = true;
            near.clear();
            near.extend((0..groups).filter(|&g| adjacent[next * groups + g] && !eliminated[g]));
            for &a in &*near {
                degrees[a] -= sizes[next];
                for &b in &*near {
                    if !std::mem::replace(&mut adjacent[a * groups + b], true) {
                        degrees[a] += sizes[b];
                    }
                }
            }
        }
    }

    /// Lists the pairs in the new order.
    fn fill(&mut self) {
        let groups = self.sizes.len();
        self.coupled.clear();
        self.filled.clear();
        for j in 0..groups {
            for i in j..groups {
                let (a, b) = (self.order[i], self.order[j]);
                let shared = self.ends[a].iter().flatten().any(|e| self.ends[b].contains(&Some(*e)));
                if shared || i == j {
                    self.coupled.push((i, j));
                }
                if self.adjacent[a * groups + b] {
                    self.filled.push((i, j));
                }
            }
        }
    }
}

/// The two things that a constraint is between, as far as they yield.
fn ends_of(constraint: &Constraint, proxies: &RigidProxies) -> [Option<u64>; 2] {
    [&constraint.endpoints[0], &constraint.endpoints[1]].map(|endpoint| match endpoint {
        Endpoint::Soft { body, .. } => Some(*body as u64),
        Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => {
            let group = proxies.group(*proxy);
            proxies.yields(*proxy).then(|| 1 << 32 | u64::from(group.0))
        }
    })
}
