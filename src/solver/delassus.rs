//! The Delassus operator of an island's contacts, `W = J P Jᵀ + h² J M⁻¹ Jᵀ`, made when what it is made
//! of has changed.

use super::block_matrix::BlockMatrix;
use super::body_problem::BodyProblem;
use super::contact_groups::ContactGroups;
use super::partner::{Articulation, Partner, Partners, stacked};
use super::tangent::Factors;
use crate::body::ContactGeometry;
use crate::contact::{PartnerId, Row, Side};
use crate::math::{Mat3, Vec3};
use nalgebra::Vector6;

/// What the last W was made of, and memory for making the next.
#[derive(Default)]
pub(crate) struct Delassus {
    made_from: Ingredients,
    fresh: Ingredients,
    levers: Vec<[Lever; 2]>,
    /// First row of each group, and the number of rows last.
    starts: Vec<usize>,
}

/// The rows of an island in their order.
pub(crate) struct ContactRows<'a> {
    pub rows: &'a [Row],
    pub geometry: &'a [ContactGeometry],
    /// First row of each contact in W, and the number of rows last.
    pub offsets: &'a [usize],
    pub groups: &'a ContactGroups,
}

/// Rounding of rapier's positions, relative to them: a few units of `f32`.
const POSITION_ROUNDING: f64 = 5.0e-7;

/// The geometry that W takes for a row: that of the last step as long as it serves.
pub(crate) fn steady_geometry(row: &Row, partners: &Partners) -> ContactGeometry {
    let mut now = ContactGeometry { frame: row.frame, ..Default::default() };
    let mut farthest = 0.0f64;
    for (k, side) in row.sides.iter().enumerate() {
        match side {
            Side::Soft { nodes, weights, .. } => (now.nodes[k], now.weights[k]) = (*nodes, *weights),
            // Where it is touched does not matter to what does not yield.
            Side::Partner { partner, point } if partners.yields(*partner) => {
                now.arms[k] = point - partners.get(*partner).com();
                farthest = farthest.max(point.amax());
            }
            Side::Partner { .. } | Side::Turn { .. } => {}
        }
    }
    let kept = row.warm_geometry.filter(|before| before.is_near(&now, POSITION_ROUNDING * farthest));
    kept.unwrap_or(now)
}

impl Delassus {
    /// Brings W up to date; false if it was.
    pub fn update(
        &mut self,
        W: &mut BlockMatrix,
        contacts: &ContactRows<'_>,
        bodies: &[BodyProblem],
        factors: Factors<'_>,
        partners: &Partners,
        h: f64,
    ) -> bool {
        self.fresh.describe(contacts, bodies, factors, partners, h);
        if self.fresh.comparable && self.fresh == self.made_from {
            return false;
        }
        std::mem::swap(&mut self.fresh, &mut self.made_from);
        self.levers.clear();
        for (row, geometry) in contacts.rows.iter().zip(contacts.geometry) {
            let lever = |k: usize| Lever::new(row, k, geometry, bodies, partners, h);
            self.levers.push([lever(0), lever(1)]);
        }
        let ContactRows { rows, offsets, groups, .. } = contacts;
        self.starts.clear();
        self.starts.extend(groups.starts.iter().map(|&contact| offsets[contact]));
        W.reset(&self.starts, &groups.coupled);
        let between = Between { bodies, factors, partners };
        for (k, &(gi, gj)) in groups.coupled.iter().enumerate() {
            let (first_row, first_column) = (self.starts[gi], self.starts[gj]);
            let m = self.starts[gi + 1] - first_row;
            let values = W.block_mut(k);
            for j in groups.starts[gj]..groups.starts[gj + 1] {
                // The diagonal's blocks are symmetric.
                let from = if gi == gj { j } else { groups.starts[gi] };
                for i in from..groups.starts[gi + 1] {
                    let block = between.contacts(&self.levers[i], &self.levers[j]);
                    let (row, column) = (offsets[i] - first_row, offsets[j] - first_column);
                    for c in 0..rows[j].dimension() {
                        for r in 0..rows[i].dimension() {
                            values[(column + c) * m + row + r] = block[(r, c)];
                            if gi == gj {
                                values[(row + r) * m + column + c] = block[(r, c)];
                            }
                        }
                    }
                }
                if gi == gj {
                    let own = offsets[j] - first_row;
                    values[own * m + own] += rows[j].compliance;
                }
            }
        }
        true
    }
}

/// What one side of a contact moves, along the contact's directions, with its sign.
enum Lever {
    /// Fixed or kinematic.
    Idle,
    Soft {
        body: usize,
        count: usize,
        nodes: [usize; 3],
        /// Their places on the surface.
        places: [usize; 3],
        /// Directions by weights; in the frame of a body that has one frame.
        directions: [Mat3; 3],
    },
    Rigid {
        partner: PartnerId,
        /// Force and moment per unit along each direction.
        wrenches: [[Vec3; 2]; 3],
        /// What those move in a step.
        motions: [[Vec3; 2]; 3],
    },
    Link {
        articulation: usize,
        slot: usize,
        wrenches: [Vector6<f64>; 3],
    },
}

impl Lever {
    fn new(
        row: &Row,
        k: usize,
        geometry: &ContactGeometry,
        bodies: &[BodyProblem],
        partners: &Partners,
        h: f64,
    ) -> Self {
        let sign = [1.0, -1.0][k];
        let side = match row.sides[k] {
            Side::Soft { body, .. } => {
                return Self::soft(body, geometry, k, sign, &bodies[body]);
            }
            Side::Partner { partner, .. } => {
                Side::Partner { partner, point: partners.get(partner).com() + geometry.arms[k] }
            }
            turn @ Side::Turn { .. } => turn,
        };
        let Some(id) = side.partner() else { return Self::Idle };
        let partner = partners.get(id);
        let wrenches = geometry.frame.map(|d| partner.wrench(&side, &(d * sign)));
        match partner {
            Partner::Rigid { inv_mass, steady_inv_inertia, .. } if partners.yields(id) => {
                let motion = |[f, m]: [Vec3; 2]| {
                    [inv_mass.component_mul(&f) * (h * h), steady_inv_inertia * m * (h * h)]
                };
                Self::Rigid { partner: id, wrenches, motions: wrenches.map(motion) }
            }
            Partner::Link { articulation, slot, .. } => Self::Link {
                articulation: *articulation,
                slot: *slot,
                wrenches: wrenches.map(|w| stacked(&w) * h),
            },
            _ => Self::Idle,
        }
    }

    fn soft(body: usize, geometry: &ContactGeometry, k: usize, sign: f64, problem: &BodyProblem) -> Self {
        let frame = problem.metric.one_frame().unwrap_or_else(Mat3::identity);
        let turned = frame.tr_mul(&Mat3::from_columns(&geometry.frame)) * (sign / problem.scaling.sqrt());
        let (mut count, mut nodes, mut places, mut directions) = (0, [0; 3], [0; 3], [Mat3::zeros(); 3]);
        for (&node, &weight) in geometry.nodes[k].iter().zip(&geometry.weights[k]) {
            if weight != 0.0 {
                nodes[count] = node as usize;
                places[count] = problem.model.surface.index_of_node[node as usize] as usize;
                directions[count] = turned * weight;
                count += 1;
            }
        }
        Self::Soft { body, count, nodes, places, directions }
    }
}

/// What the levers act on.
struct Between<'a> {
    bodies: &'a [BodyProblem],
    factors: Factors<'a>,
    partners: &'a Partners,
}

impl Between<'_> {
    /// The block of W between two contacts.
    fn contacts(&self, a: &[Lever; 2], b: &[Lever; 2]) -> Mat3 {
        let mut sum = Mat3::zeros();
        for a in a {
            for b in b {
                self.add(a, b, &mut sum);
            }
        }
        sum
    }

    fn add(&self, a: &Lever, b: &Lever, sum: &mut Mat3) {
        match (a, b) {
            (
                Lever::Soft { body: i, count: m, nodes, places, directions },
                Lever::Soft { body: j, count: n, nodes: nodes_b, places: places_b, directions: directions_b },
            ) if i == j => {
                let body = &self.bodies[*i];
                let factor = self.factors.of(*i, body);
                let columns = &factor.columns;
                let has_one_frame = body.metric.one_frame().is_some();
                for l in 0..*n {
                    for k in 0..*m {
                        let mut block = columns.block(places[k], places_b[l]);
                        if !has_one_frame {
                            block = body.metric.compliance(factor, &block, nodes[k], nodes_b[l]);
                        }
                        *sum += directions[k].tr_mul(&(block * directions_b[l]));
                    }
                }
            }
            (Lever::Rigid { partner: i, wrenches, .. }, Lever::Rigid { partner: j, motions, .. })
                if i == j =>
            {
                *sum += Mat3::from_fn(|r, c| {
                    wrenches[r][0].dot(&motions[c][0]) + wrenches[r][1].dot(&motions[c][1])
                });
            }
            (
                Lever::Link { articulation, slot, wrenches },
                Lever::Link { articulation: other, slot: from, wrenches: acting },
            ) if articulation == other => {
                let Articulation { links, blocks } = &self.partners.articulations[*articulation];
                let moved = acting.map(|w| blocks[slot * links.len() + from] * w);
                *sum += Mat3::from_fn(|r, c| wrenches[r].dot(&moved[c]));
            }
            _ => {}
        }
    }
}

/// Everything that W depends on.
#[derive(Default, PartialEq)]
struct Ingredients {
    bits: Vec<f64>,
    nodes: Vec<u32>,
    /// Serial numbers.
    factors: Vec<u64>,
    /// Frames per node are too many to compare.
    comparable: bool,
}

impl Ingredients {
    fn describe(
        &mut self,
        contacts: &ContactRows<'_>,
        bodies: &[BodyProblem],
        factors: Factors<'_>,
        partners: &Partners,
        h: f64,
    ) {
        self.bits.clear();
        self.nodes.clear();
        self.factors.clear();
        self.comparable = bodies.iter().all(|b| b.metric.one_frame().is_some());
        if !self.comparable {
            return;
        }
        self.factors.extend(bodies.iter().enumerate().map(|(i, b)| factors.of(i, b).serial));
        self.bits.push(h);
        for articulation in &partners.articulations {
            self.bits.extend(articulation.blocks.iter().flat_map(|b| b.iter()));
        }
        for body in bodies {
            self.bits.push(body.scaling);
            self.bits.extend(body.metric.one_frame().iter().flat_map(|frame| frame.iter()));
        }
        for (row, geometry) in contacts.rows.iter().zip(contacts.geometry) {
            self.bits.push(row.compliance);
            self.bits.extend(geometry.frame[..row.dimension()].iter().flat_map(|d| d.iter()));
            for (k, side) in row.sides.iter().enumerate() {
                match side {
                    Side::Soft { body, .. } => {
                        self.nodes.push(*body as u32);
                        self.nodes.extend(geometry.nodes[k]);
                        self.bits.extend(geometry.weights[k]);
                    }
                    Side::Partner { partner, .. } | Side::Turn { partner } => {
                        self.nodes.push(partner.0);
                        self.bits.extend(geometry.arms[k].iter());
                        if let Partner::Rigid { inv_mass, steady_inv_inertia, .. } = partners.get(*partner) {
                            self.bits.extend(inv_mass.iter().chain(steady_inv_inertia));
                        }
                    }
                }
            }
        }
    }
}
