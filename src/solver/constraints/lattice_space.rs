//! The metric of islands with large bodies: these have the modes of their lattices, all else those of [`super::coarse_space`].

use super::coarse_space::{CoarseParts, has_affine_modes};
use super::improve::CROWD;
use super::lists::ActiveContact;
use crate::contact::Endpoint;
use crate::math::Vec3;
use crate::solver::cone::{ConeMetric, MetricSide, Support};
use crate::solver::linear::{DenseScratch, LatticeModes, MODES, invert};

/// Third power of the unknowns over the numbers of the bodies' factors, at the most: the three or four factorizations of a coarse problem take as
/// long as a product then.
const SHARE: usize = 32;
/// Points that modes which are none of a lattice's take.
const POINTS: usize = MODES / 3;

/// Memory for making it.
#[derive(Default)]
pub(super) struct LatticeSpace {
    /// Of each place of the metric: the points of its lattice that contacts are near, and which each of these is among them.
    near: Vec<Vec<usize>>,
    slots: Vec<Vec<usize>>,
    /// What the groups of the metric were made for.
    made: Vec<(u64, Vec<usize>)>,
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
        if bodies.len() >= CROWD || bodies.clone().all(|body| lattice_of(parts, body).is_none()) {
            return false;
        }
        self.find_points(metric, contacts, places, parts);
        let numbers: usize =
            bodies.map(|b| parts.factors.of(b, &parts.bodies[b]).symbolic.factor_len()).sum();
        let unknowns: usize = 3 * self.near.iter().map(Vec::len).sum::<usize>();
        if unknowns.pow(3) > SHARE * numbers || !self.make_groups(metric, places, parts) {
            return false;
        }
        self.list_supports(metric, contacts, places, parts);
        metric.lattice.points = unknowns / 3;
        true
    }

    fn find_points(
        &mut self,
        metric: &ConeMetric,
        contacts: &[ActiveContact],
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) {
        self.near.resize_with(metric.bodies, Vec::new);
        self.slots.resize_with(metric.bodies, Vec::new);
        for (near, slots) in self.near.iter_mut().zip(&mut self.slots) {
            near.clear();
            slots.clear();
            near.extend(0..POINTS);
        }
        for (body, place) in places.iter().enumerate() {
            if let (Some(lattice), Some(place)) = (lattice_of(parts, body), place) {
                self.near[*place].clear();
                self.slots[*place].resize(lattice.len(), usize::MAX);
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
        }
    }

    /// What the points near contacts yield by, and its inverse: as in the last step where nothing has changed.
    fn make_groups(
        &mut self,
        metric: &mut ConeMetric,
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) -> bool {
        let groups = &mut metric.lattice.groups;
        groups.resize_with(metric.bodies, Default::default);
        self.made.resize_with(metric.bodies, Default::default);
        let mut first = 0;
        for (group, near) in groups.iter_mut().zip(&self.near) {
            (group.first, group.count) = (first, near.len());
            first += near.len();
        }
        for place in 0..metric.bodies {
            let (group, near, made) = (&mut groups[place], &self.near[place], &mut self.made[place]);
            let body = places.iter().position(|p| *p == Some(place));
            let Some((body, lattice)) = body.and_then(|b| Some((b, lattice_of(parts, b)?))) else {
                *made = Default::default();
                group.stiffness.clear();
                group.compliance.clear();
                continue;
            };
            let serial = parts.factors.of(body, &parts.bodies[body]).serial;
            if made.0 == serial && made.1 == *near && !group.stiffness.is_empty() {
                continue;
            }
            made.0 = serial;
            made.1.clone_from(near);
            lattice.compliance_of(near, &mut group.compliance);
            group.stiffness.clone_from(&group.compliance);
            if invert(&mut group.stiffness, 3 * near.len(), &mut self.scratch).is_err() {
                group.stiffness.clear();
                return false;
            }
        }
        true
    }

    /// Moves what the contacts have of modes into rows of the lattices' points.
    fn list_supports(
        &mut self,
        metric: &mut ConeMetric,
        contacts: &[ActiveContact],
        places: &[Option<usize>],
        parts: CoarseParts<'_>,
    ) {
        let ConeMetric { contacts: rows, lattice: into, .. } = metric;
        into.supports.clear();
        into.starts.clear();
        for (contact, row) in contacts.iter().zip(rows) {
            into.starts.push(into.supports.len());
            self.supports.clear();
            for (k, endpoint) in contact.constraint.endpoints.iter().enumerate() {
                let Some(side) = row.sides[k].take() else { continue };
                let first = into.groups[side.body].first;
                match endpoint {
                    Endpoint::Soft { body, .. } if let Some(lattice) = lattice_of(parts, *body) => {
                        let rows = (contact.constraint.directions(), [1.0, -1.0][k]);
                        self.add_stencils(lattice, first, endpoint, rows, (places, parts));
                    }
                    _ => add_modes(&mut self.supports, first, &side),
                }
            }
            self.supports.sort_unstable_by_key(|support| support.point);
            into.supports.extend_from_slice(&self.supports);
        }
        into.starts.push(into.supports.len());
    }

    fn add_stencils(
        &mut self,
        lattice: &LatticeModes,
        first: usize,
        endpoint: &Endpoint,
        (directions, sign): (&[Vec3], f64),
        (places, parts): (&[Option<usize>], CoarseParts<'_>),
    ) {
        let Endpoint::Soft { body: index, .. } = endpoint else { return };
        let (body, Some(place)) = (&parts.bodies[*index], places[*index]) else { return };
        let scale = sign / body.step_damping.sqrt();
        for (node, share) in endpoint.soft_nodes() {
            let frame = body.preconditioner.frame(node);
            for (point, weight) in lattice.stencil(&body.model.rest, node) {
                if weight != 0.0 {
                    let rows = support_at(&mut self.supports, first + self.slots[place][point]);
                    for (row, d) in rows.iter_mut().zip(directions) {
                        let turned = frame.tr_mul(d) * (scale * share * weight);
                        (0..3).for_each(|k| row[k] += turned[k]);
                    }
                }
            }
        }
    }
}

/// The lattice of a body, if it has one, and no columns: then it was asked for in this step, whatever there was before.
fn lattice_of(parts: CoarseParts<'_>, index: usize) -> Option<&LatticeModes> {
    let body = &parts.bodies[index];
    let is_used = has_affine_modes(parts, index) && !parts.factors.has_columns(index, body);
    is_used.then(|| parts.factors.of(index, body).coarse.lattice()).flatten()
}

/// The rows that a contact has of a point.
fn support_at(supports: &mut Vec<Support>, point: usize) -> &mut [[f64; 3]; 3] {
    let at = supports.iter().position(|support| support.point == point).unwrap_or_else(|| {
        supports.push(Support { point, rows: [[0.0; 3]; 3] });
        supports.len() - 1
    });
    &mut supports[at].rows
}

/// Modes of a body without a lattice, three at a time.
fn add_modes(supports: &mut Vec<Support>, first: usize, side: &MetricSide) {
    for point in 0..POINTS {
        let rows = support_at(supports, first + point);
        for (row, modes) in rows.iter_mut().zip(&side.rows) {
            for (k, v) in row.iter_mut().enumerate() {
                let mode = 3 * point + k;
                *v += modes[mode / 4].0[mode % 4];
            }
        }
    }
}
