//! The metric of islands with large bodies: these have the modes of their lattices, all else those of [`super::coarse_space`].

use super::coarse_space::{CoarseParts, connect, has_affine_modes};
use super::elimination::Elimination;
use super::improve::CROWD;
use super::lists::ActiveContact;
use crate::contact::Endpoint;
use crate::math::Vec3;
use crate::solver::cone::{ConeMetric, LatticeMetric, MetricSide, PointGroup, Support};
use crate::solver::linear::{DenseScratch, LatticeModes, MODES, invert};

/// Operations of a factorization of the coarse problem, and of making its matrix, over the numbers of the bodies' factors, at the most: one to four
/// of them take as long as a product then. A slab of 1024 contacts, of 24 at its first touch, lands with errors of 0.4 and 61 products without a
/// lattice, with 19 and 0.03 with it; at twice that, four cubes on one another take longer than without.
const SHARE: f64 = 32.0;
/// Operations for two points that a contact has, about.
const PER_PAIR: f64 = 14.0;
/// Points that the modes of a body without a lattice take, and those of one that moves rigidly.
const AFFINE_POINTS: usize = MODES / 3;
const RIGID_POINTS: usize = 2;

/// Memory for making it.
#[derive(Default)]
pub(super) struct LatticeSpace {
    /// Of each place of the metric: the points of its lattice that contacts are near, and which each of these is among them.
    near: Vec<Vec<usize>>,
    slots: Vec<Vec<usize>>,
    /// What the groups of the metric were made for.
    made: Vec<(u64, Vec<usize>)>,
    elimination: Elimination,
    sizes: Vec<usize>,
    scratch: DenseScratch,
    supports: Vec<Support>,
}

impl LatticeSpace {
    /// Takes lattices in the place of the modes that the metric has of the bodies, whose places are given; `false` where there are none, or would
    /// cost more than products do.
    pub fn update(
        &mut self,
        metric: &mut ConeMetric,
        contacts: &[ActiveContact],
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) -> bool {
        metric.lattice.points = 0;
        let bodies = 0..parts.bodies.len();
        // Under rigid loads solves take most of the budget either way: nine boxes of 10 to 20 000 kg/m³ that land on a cube of 13 720 tetrahedra 100 to
        // 115 ms in the worst step, 140 to 165 with lattices.
        let has_loads = metric.bodies > places.iter().flatten().count();
        let none = || bodies.clone().all(|body| lattice_of(parts, body).is_none());
        if bodies.len() >= CROWD || has_loads || none() {
            return false;
        }
        self.find_points(metric, contacts, places, parts);
        self.arrange(metric);
        let numbers: usize =
            bodies.clone().map(|b| parts.factors.of(b, &parts.bodies[b]).symbolic.factor_len()).sum();
        let points: usize = self.near[..metric.bodies].iter().map(Vec::len).sum();
        let work = self.work(metric, contacts, parts);
        if work > SHARE * numbers as f64 || !self.make_groups(metric, places, parts) {
            return false;
        }
        self.list_supports(metric, contacts, parts);
        metric.lattice.points = points;
        true
    }

    /// Of a factorization of the coarse problem, and of making its matrix.
    fn work(&self, metric: &ConeMetric, contacts: &[ActiveContact], parts: CoarseParts<'_>) -> f64 {
        let LatticeMetric { order, pattern, .. } = &metric.lattice;
        let size = |rank: usize| 3.0 * self.near[order[rank]].len() as f64;
        let factor: f64 = pattern.filled.iter().map(|&(i, j)| size(i) * size(j) * size(j)).sum();
        let points = |endpoint: &Endpoint| match endpoint {
            Endpoint::Soft { body, .. } if lattice_of(parts, *body).is_some() => {
                8 * endpoint.soft_nodes().count()
            }
            _ => AFFINE_POINTS,
        };
        let pairs = |contact: &ActiveContact| {
            let points: usize = contact.constraint.endpoints.iter().map(points).sum();
            (points * points) as f64
        };
        factor + PER_PAIR * contacts.iter().map(pairs).sum::<f64>()
    }

    /// Puts places into an order of elimination.
    fn arrange(&mut self, metric: &mut ConeMetric) {
        connect(&mut self.elimination, metric);
        self.sizes.clear();
        self.sizes.extend(self.near[..metric.bodies].iter().map(|near| 3 * near.len()));
        self.elimination.arrange(&self.sizes, &[]);
        let LatticeMetric { order, pattern, .. } = &mut metric.lattice;
        order.clone_from(&self.elimination.order);
        self.elimination.list_filled(&mut pattern.filled);
        pattern.index(order.iter().map(|&place| self.sizes[place]));
    }

    fn find_points(
        &mut self,
        metric: &ConeMetric,
        contacts: &[ActiveContact],
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) {
        let count = metric.bodies.max(self.near.len());
        self.near.resize_with(count, Vec::new);
        self.slots.resize_with(count, Vec::new);
        for (near, slots) in self.near.iter_mut().zip(&mut self.slots) {
            near.clear();
            slots.clear();
            near.extend(0..RIGID_POINTS);
        }
        for (body, place) in places.iter().enumerate() {
            let Some(place) = *place else { continue };
            let near = &mut self.near[place];
            if let Some(lattice) = lattice_of(parts, body) {
                near.clear();
                self.slots[place].resize(lattice.len(), usize::MAX);
            } else if has_affine_modes(parts, body) {
                near.extend(RIGID_POINTS..AFFINE_POINTS);
            }
        }
        for endpoint in contacts.iter().flat_map(|contact| &contact.constraint.endpoints) {
            let Endpoint::Soft { body, .. } = endpoint else { continue };
            let (Some(lattice), Some(place)) = (lattice_of(parts, *body), places[*body]) else { continue };
            for (node, _) in endpoint.soft_nodes() {
                for (point, weight) in lattice.stencil(&parts.bodies[*body].model.rest, node) {
                    if weight != 0.0 {
                        self.slots[place][point] = 0;
                    }
                }
            }
        }
        for (near, slots) in self.near.iter_mut().zip(&mut self.slots) {
            for (point, slot) in slots.iter_mut().enumerate().filter(|(_, slot)| **slot == 0) {
                *slot = near.len();
                near.push(point);
            }
            // Of a body without contacts any one.
            if near.is_empty() {
                near.push(0);
            }
        }
    }

    /// What the points near contacts yield by, and its inverse: as in the last step where nothing has changed.
    fn make_groups(
        &mut self,
        metric: &mut ConeMetric,
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) -> bool {
        let LatticeMetric { groups, order, pattern, .. } = &mut metric.lattice;
        let count = metric.bodies.max(groups.len());
        groups.resize_with(count, Default::default);
        self.made.resize_with(count, Default::default);
        for (rank, &place) in order.iter().enumerate() {
            (groups[place].first, groups[place].count) = (pattern.rows[rank] / 3, self.near[place].len());
        }
        for place in 0..metric.bodies {
            let (group, near, made) = (&mut groups[place], &self.near[place], &mut self.made[place]);
            let body = places.iter().position(|p| *p == Some(place));
            let Some((body, lattice)) = body.and_then(|b| Some((b, lattice_of(parts, b)?))) else {
                *made = Default::default();
                group.stiffness.clear();
                continue;
            };
            let serial = parts.factors.of(body, &parts.bodies[body]).serial;
            if made.0 == serial && made.1 == *near && !group.stiffness.is_empty() {
                continue;
            }
            made.0 = serial;
            made.1.clone_from(near);
            if !make_group(lattice, near, group, &mut self.scratch) {
                group.stiffness.clear();
                return false;
            }
        }
        true
    }

    /// Moves what the contacts have of modes into rows of the lattices' points.
    fn list_supports(&mut self, metric: &mut ConeMetric, contacts: &[ActiveContact], parts: CoarseParts<'_>) {
        let ConeMetric { contacts: rows, lattice: into, .. } = metric;
        into.supports.clear();
        into.starts.clear();
        for (contact, row) in contacts.iter().zip(rows) {
            into.starts.push(into.supports.len());
            self.supports.clear();
            for (k, endpoint) in contact.constraint.endpoints.iter().enumerate() {
                let Some(side) = row.sides[k].take() else { continue };
                let place = side.body;
                match endpoint {
                    Endpoint::Soft { body, .. } if let Some(lattice) = lattice_of(parts, *body) => {
                        let rows = (contact.constraint.directions(), [1.0, -1.0][k]);
                        self.add_stencils(lattice, &into.groups[place], endpoint, rows, (place, parts));
                    }
                    _ => self.add_modes(&into.groups[place], &side),
                }
            }
            self.supports.sort_unstable_by_key(|support| support.point);
            into.supports.extend_from_slice(&self.supports);
        }
        into.starts.push(into.supports.len());
    }

    /// Modes of what has no lattice, three at a time.
    fn add_modes(&mut self, group: &PointGroup, side: &MetricSide) {
        let (rank, is_rigid) = (self.elimination.rank[side.body], group.count == RIGID_POINTS);
        for point in 0..group.count {
            let rows = support_at(&mut self.supports, rank, group.first + point);
            for (row, modes) in rows.iter_mut().zip(&side.rows) {
                for (k, v) in row.iter_mut().enumerate() {
                    // Of what moves rigidly three are in a lane.
                    let [lane, at] =
                        if is_rigid { [point, k] } else { [(3 * point + k) / 4, (3 * point + k) % 4] };
                    *v += modes[lane].0[at];
                }
            }
        }
    }

    fn add_stencils(
        &mut self,
        lattice: &LatticeModes,
        group: &PointGroup,
        endpoint: &Endpoint,
        (directions, sign): (&[Vec3], f64),
        (place, parts): (usize, CoarseParts<'_>),
    ) {
        let Endpoint::Soft { body: index, .. } = endpoint else { return };
        let (body, rank) = (&parts.bodies[*index], self.elimination.rank[place]);
        let scale = sign / body.step_damping.sqrt();
        for (node, share) in endpoint.soft_nodes() {
            let frame = body.preconditioner.frame(node);
            for (point, weight) in lattice.stencil(&body.model.rest, node) {
                if weight != 0.0 {
                    let slot = self.slots[place][point];
                    let rows = support_at(&mut self.supports, rank, group.first + slot);
                    for (row, d) in rows.iter_mut().zip(directions) {
                        let turned = frame.tr_mul(d) * (scale * share * weight);
                        (0..3).for_each(|k| row[k] += turned[k] * group.units[3 * slot + k]);
                    }
                }
            }
        }
    }
}

/// Sets what the points near contacts yield by and resist with, each in the unit in which it alone resists with one.
fn make_group(
    lattice: &LatticeModes,
    near: &[usize],
    group: &mut PointGroup,
    scratch: &mut DenseScratch,
) -> bool {
    let PointGroup { stiffness, compliance, units, .. } = group;
    lattice.compliance_of(near, compliance);
    stiffness.clone_from(compliance);
    let n = 3 * near.len();
    if invert(stiffness, n, scratch).is_err() {
        return false;
    }
    units.clear();
    units.extend(stiffness.iter().step_by(n + 1).map(|s| 1.0 / s.sqrt()));
    for (j, column) in units.iter().enumerate() {
        for (i, row) in units.iter().enumerate() {
            stiffness[n * j + i] *= row * column;
            compliance[n * j + i] /= row * column;
        }
    }
    units.iter().all(|unit| unit.is_finite())
}

/// The lattice of a body, if it has one, and no columns: then it was asked for in this step, whatever there was before.
fn lattice_of(parts: CoarseParts<'_>, index: usize) -> Option<&LatticeModes> {
    let body = &parts.bodies[index];
    let is_used = has_affine_modes(parts, index) && !parts.factors.has_columns(index, body);
    is_used.then(|| parts.factors.of(index, body).coarse.lattice()).flatten()
}

/// The rows that a contact has of a point.
fn support_at(supports: &mut Vec<Support>, group: usize, point: usize) -> &mut [[f64; 3]; 3] {
    let at = supports.iter().position(|support| support.point == point).unwrap_or_else(|| {
        supports.push(Support { group, point, rows: [[0.0; 3]; 3] });
        supports.len() - 1
    });
    &mut supports[at].rows
}
