//! Contacts in groups between the same two things, ordered so that the factor of their matrix fills in
//! little, with what is condensed out of it first.

use super::elimination::Elimination;
use super::lists::ActiveContact;
use super::rigid_proxy::RigidProxies;
use crate::body::ConstraintKey;
use crate::contact::{Constraint, Endpoint};

/// What the constraints of a group are between.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Ends {
    are_holds: bool,
    /// As far as they yield.
    things: [Option<u64>; 2],
}

/// The groups of an island's contacts and which of them know of one another.
#[derive(Default)]
pub(crate) struct ContactGroups {
    /// First contact of each group, and the number of contacts last.
    pub starts: Vec<usize>,
    /// Pairs of groups (row, column) of the lower triangle that share something which yields.
    pub coupled: Vec<(usize, usize)>,
    /// Those pairs, and those that elimination in this order adds.
    pub filled: Vec<(usize, usize)>,
    /// Groups of what holds deformable bodies fast: the first ones.
    pub holds: usize,
    /// Pairs of the others that are coupled, also by way of those.
    pub condensed: Vec<(usize, usize)>,
    ends: Vec<Ends>,
    are_holds: Vec<bool>,
    /// The groups by their ends, ascending.
    known: Vec<(Ends, usize)>,
    group_of_constraint: Vec<usize>,
    sizes: Vec<usize>,
    elimination: Elimination,
    /// Ranks, names and places of contacts.
    sorted: Vec<(usize, ConstraintKey, usize)>,
}

impl ContactGroups {
    /// Puts the contacts into groups, and the groups into an order of least degree.
    /// Where it `condenses`, what holds deformable bodies comes first.
    pub fn arrange(&mut self, contacts: &mut [ActiveContact], proxies: &RigidProxies, condenses: bool) {
        self.find(contacts, proxies, condenses);
        self.find_adjacent();
        self.are_holds.clear();
        self.are_holds.extend(self.ends.iter().map(|ends| ends.are_holds));
        self.holds = self.are_holds.iter().filter(|are_holds| **are_holds).count();
        self.elimination.arrange(&self.sizes, &self.are_holds);
        for (contact, group) in contacts.iter_mut().zip(&self.group_of_constraint) {
            contact.rank = self.elimination.rank[*group];
        }
        if !contacts.is_sorted_by_key(|contact| contact.rank) {
            self.sort(contacts);
        }
        let groups = self.sizes.len();
        self.starts.clear();
        self.starts.push(0);
        for place in 0..groups {
            self.starts.push(self.starts[place] + self.sizes[self.elimination.order[place]]);
        }
        self.fill();
    }

    /// Sorts contacts by rank and key. Names are sorted and the contacts, of 850 bytes, put in their places once.
    fn sort(&mut self, contacts: &mut [ActiveContact]) {
        let names = contacts.iter().enumerate().map(|(at, c)| (c.rank, c.constraint.key, at));
        self.sorted.clear();
        self.sorted.extend(names);
        self.sorted.sort_unstable();
        for first in 0..contacts.len() {
            // Along the cycle of the permutation: what comes to `at` stays there, and what is there already is a cycle of its own.
            let mut at = first;
            loop {
                let from = std::mem::replace(&mut self.sorted[at].2, at);
                if from == first {
                    break;
                }
                contacts.swap(at, from);
                at = from;
            }
        }
    }

    fn find(&mut self, contacts: &[ActiveContact], proxies: &RigidProxies, condenses: bool) {
        self.ends.clear();
        self.known.clear();
        self.sizes.clear();
        self.group_of_constraint.clear();
        for contact in contacts {
            let ends = ends_of(&contact.constraint, proxies, condenses);
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
        self.elimination.begin(self.ends.len());
        for a in 0..self.ends.len() {
            for b in 0..a {
                if self.share(a, b) {
                    self.elimination.connect(a, b);
                }
            }
        }
    }

    fn share(&self, a: usize, b: usize) -> bool {
        if self.ends[a] == OF_PATHS || self.ends[b] == OF_PATHS {
            return true;
        }
        self.ends[a].things.iter().flatten().any(|end| self.ends[b].things.contains(&Some(*end)))
    }

    /// Lists the pairs in the new order.
    fn fill(&mut self) {
        self.elimination.list_filled(&mut self.filled);
        let mut coupled = std::mem::take(&mut self.coupled);
        let order = &self.elimination.order;
        coupled.clear();
        coupled.extend(self.filled.iter().filter(|&&(i, j)| i == j || self.share(order[i], order[j])));
        self.coupled = coupled;
        self.condense();
    }

    /// Lists the pairs that are coupled when what holds is solved for.
    fn condense(&mut self) {
        let holds = self.holds;
        self.condensed.clear();
        if holds == 0 {
            return;
        }
        self.condensed.extend(self.coupled.iter().filter(|&&(_, j)| j >= holds));
        for column in self.filled.chunk_by(|a, b| a.1 == b.1).filter(|column| column[0].1 < holds) {
            let others = column.partition_point(|&(i, _)| i < holds);
            for (k, &(j, _)) in column[others..].iter().enumerate() {
                self.condensed.extend(column[others + k..].iter().map(|&(i, _)| (i, j)));
            }
        }
        self.condensed.sort_unstable_by_key(|&(i, j)| (j, i));
        self.condensed.dedup();
    }

    /// Multiplications and additions of one factorization, about, with three rows a contact, of what is not condensed out.
    pub fn factor_work(&self) -> usize {
        self.work_of_columns(|column| column >= self.holds)
    }

    /// The same of what condenses.
    pub fn condensation_work(&self) -> usize {
        self.work_of_columns(|column| column < self.holds)
    }

    fn work_of_columns(&self, counts: impl Fn(usize) -> bool) -> usize {
        let rows = |place: usize| 3 * self.sizes[self.elimination.order[place]];
        let column_work = |column: &[(usize, usize)]| {
            let own = rows(column[0].1);
            let below: usize = column[1..].iter().map(|(i, _)| rows(*i)).sum();
            own * own * own / 3 + own * below * (own + below)
        };
        let columns = self.filled.chunk_by(|a, b| a.1 == b.1);
        columns.filter(|column| counts(column[0].1)).map(column_work).sum()
    }

    /// Multiplications and additions of one product, or sweep, about.
    pub fn product_work(&self) -> usize {
        let rows = |place: usize| 3 * self.sizes[self.elimination.order[place]];
        let block_work =
            |&(i, j): &(usize, usize)| if i == j { rows(i) * rows(i) } else { 2 * rows(i) * rows(j) };
        self.coupled.iter().map(block_work).sum()
    }
}

/// Constraints along paths are one group, which knows of all others: they are few, and one may run through any bodies.
const OF_PATHS: Ends = Ends { are_holds: false, things: [Some(u64::MAX); 2] };

/// The two things that a constraint is between, as far as they yield.
fn ends_of(constraint: &Constraint, proxies: &RigidProxies, condenses: bool) -> Ends {
    if !constraint.path.is_empty() {
        return OF_PATHS;
    }
    let thing = |endpoint: &Endpoint| match endpoint {
        Endpoint::Soft { body, .. } => Some(*body as u64),
        Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => {
            let group = proxies.group(*proxy);
            proxies.yields(*proxy).then(|| 1 << 32 | u64::from(group.0))
        }
    };
    let are_holds = condenses && constraint.holds_deformable();
    Ends { are_holds, things: constraint.endpoints.each_ref().map(thing) }
}
