//! Contacts between the surfaces of two deformable bodies, or of one with itself: nodes on triangles, and
//! edges across edges.
//!
//! Two flat faces on one another touch everywhere at once. What carries are the nodes of the finer one, on
//! the triangles of the other; where those do not reach, nodes of the other on triangles of the finer one, and
//! rims across rims.
//!
//! What carried in the last step is looked at again, and given more room: on the ridge between two triangles
//! each pushes the node onto the other, and with one of them at a time the two would take turns for ever.

use super::constraint::{Constraint, Endpoint};
use super::edge_contact::{CARRYING_EDGES, NEW_EDGES, crossing};
use super::meeting::Closing;
use super::node_contact::{Touch, on_triangle};
use super::soft_surface::{STILL_BESIDE, SoftPair, SoftSurface, near_in_mesh};
use super::tangle::{untangle, untangle_itself};
use crate::body::{ConstraintKey, ConstraintMemory, SoftPairContact, SoftPairKind};
use crate::math::Vec3;

/// By how much weights may miss a triangle at first; [`STILL_BESIDE`] where contact was.
const BESIDE: f64 = 0.02;
/// Cosine beyond which two triangles of one surface are one face.
const COPLANAR: f64 = 0.9999;
/// Cosine beyond which two constraints push the same way.
pub(super) const PARALLEL: f64 = 0.9;
/// Depth, in mean edges, of an overlap that another contact of the two has made impossible.
const LATE: f64 = 2.0;

/// Finds contacts between deformables; holds the memory it needs between calls.
#[derive(Default)]
pub(crate) struct SoftDetector {
    /// Triangles whose boxes meet.
    pairs: Vec<(u32, u32)>,
    /// Surface nodes of one body and triangles of the other.
    on_triangles: [Vec<(u32, u32)>; 2],
    edges: Vec<(u32, u32)>,
    /// The contacts that carried in the last step, ascending by what of the second and the first body they are of and
    /// their kind, with their normals.
    carried: Vec<((u32, u32, SoftPairKind), Vec3)>,
    touches: Vec<Touch>,
    /// When each constraint closes, as part of the step, and how much it closes in all of it \[m\].
    closings: Vec<Closing>,
    /// Per surface node: the normal of its contact, towards its own body.
    pushed: [Vec<Option<Vec3>>; 2],
}

impl SoftDetector {
    /// Appends the contacts of two bodies to `constraints`: of the first as side 0, of the second as side 1.
    /// `memory` holds the contacts of the first in the last step.
    pub fn detect(
        &mut self,
        pair: &SoftPair,
        surfaces: [&SoftSurface<'_>; 2],
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let [a, b] = surfaces;
        self.carried.clear();
        self.carried.extend(memory.iter().filter(|m| m.force != Vec3::zeros()).filter_map(|m| match m.key {
            ConstraintKey::SoftPair(c) if c.other == b.key => Some((name(&c), m.geometry.frame[0])),
            _ => None,
        }));
        let itself = a.key == b.key;
        self.collect(surfaces, itself);
        for (pushed, surface) in self.pushed.iter_mut().zip(surfaces) {
            pushed.clear();
            pushed.resize(surface.model.surface.nodes.len(), None);
        }
        self.closings.clear();
        let first = constraints.len();
        let finer = usize::from(b.model.surface.mean_edge < a.model.surface.mean_edge);
        for side in [finer, 1 - finer] {
            // One's own surface was listed on both sides alike.
            if !(itself && side != finer) {
                self.touch(pair, surfaces, side, constraints);
            }
        }
        if itself {
            let [first, second] = &mut self.pushed;
            let (from, to) = if finer == 0 { (first, second) } else { (second, first) };
            to.clone_from(from);
        }
        self.cross(pair, surfaces, constraints);
        self.drop_late(surfaces, first, constraints);
        constraints[first..].sort_unstable_by_key(|constraint| constraint.key);
        if surfaces.iter().all(|s| s.model.surface.is_closed()) {
            match itself {
                true => untangle_itself(a, &self.pairs, first, constraints),
                false => {
                    let is_kept_apart = |kind: SoftPairKind| kind != SoftPairKind::Separation;
                    let has_contacts = self.carried.iter().any(|((_, _, kind), _)| is_kept_apart(*kind));
                    untangle(surfaces, &self.pairs, !has_contacts, constraints);
                }
            }
        }
    }

    /// Drops constraints that would close only when the bodies have gone through one another somewhere else: what
    /// stops them there keeps them from it.
    fn drop_late(&self, surfaces: [&SoftSurface<'_>; 2], first: usize, constraints: &mut Vec<Constraint>) {
        let edge = surfaces.iter().map(|s| s.model.surface.mean_edge).fold(f64::INFINITY, f64::min);
        let earliest = self.closings.iter().map(|c| c.when).fold(1.0, f64::min);
        let mut closings = self.closings.iter();
        let mut place = 0;
        constraints.retain(|_| {
            place += 1;
            let own = if place > first { closings.next() } else { None };
            own.is_none_or(|c| (c.when - earliest) * c.distance < LATE * edge)
        });
    }

    /// Lists what is to be looked at closely.
    fn collect(&mut self, [a, b]: [&SoftSurface<'_>; 2], itself: bool) {
        self.on_triangles.iter_mut().for_each(Vec::clear);
        self.edges.clear();
        let [of_a, of_b] = &mut self.on_triangles;
        // Every node and every edge is looked at with one of its facets, whose box holds it.
        let index = |s: &SoftSurface<'_>, n: u32| s.model.surface.index_of_node[n as usize];
        let at_node =
            |s: &SoftSurface<'_>, t: u32, n: u32| s.model.surface.node_facet[index(s, n) as usize] == t;
        let is_triangle = |s: &SoftSurface<'_>, t: u32| (t as usize) < s.model.surface.triangles.len();
        let on_edge = |s: &SoftSurface<'_>, t: u32, e: u32| {
            !is_triangle(s, t) || s.model.surface.edge_triangles[e as usize][0] == t
        };
        self.pairs.clear();
        self.pairs.extend(a.tree.pairs(b.tree));
        for &(ta, tb) in &self.pairs {
            let (s, t) = (&a.model.surface, &b.model.surface);
            if is_triangle(b, tb) {
                let own = s.facet_nodes(ta as usize).iter().filter(|&&n| at_node(a, ta, n));
                of_a.extend(own.map(|&n| (index(a, n), tb)));
            }
            if !itself && is_triangle(a, ta) {
                let own = t.facet_nodes(tb as usize).iter().filter(|&&n| at_node(b, tb, n));
                of_b.extend(own.map(|&n| (index(b, n), ta)));
            }
            for &ea in s.facet_edges(ta as usize).iter().filter(|&&e| on_edge(a, ta, e)) {
                let others = t.facet_edges(tb as usize).iter().filter(|&&e| on_edge(b, tb, e));
                self.edges.extend(others.map(|&eb| (ea, eb)).filter(|(ea, eb)| !itself || ea < eb));
            }
        }
        // Edges may come in any order: each pair of them is looked at alone.
        of_a.sort_unstable();
        of_b.sort_unstable();
    }

    /// Nodes of the body on `side` on triangles of the other.
    fn touch(
        &mut self,
        pair: &SoftPair,
        surfaces: [&SoftSurface<'_>; 2],
        side: usize,
        constraints: &mut Vec<Constraint>,
    ) {
        let (own, other) = (surfaces[side], surfaces[1 - side]);
        let list = std::mem::take(&mut self.on_triangles[side]);
        let mut touches = std::mem::take(&mut self.touches);
        for near in list.chunk_by(|a, b| a.0 == b.0) {
            let s = near[0].0 as usize;
            let node = own.model.surface.nodes[s];
            let kind = [SoftPairKind::FirstNode, SoftPairKind::SecondNode][side];
            let other_key = surfaces[1].key;
            let key = |t: u32| SoftPairContact { other: other_key, second: t, first: node, kind };
            self.touches_of_node(surfaces, side, near, &key, &mut touches);
            let Some(last) = touches.last() else { continue };
            self.pushed[side][s] = Some(last.normal);
            for touch in &touches {
                let own_endpoint = Endpoint::node(own.body, node);
                let nodes = other.model.surface.triangles[touch.triangle];
                let other_endpoint = Endpoint::Soft { body: other.body, nodes, weights: touch.weights };
                let (endpoints, normal) = match side {
                    0 => ([own_endpoint, other_endpoint], touch.normal),
                    _ => ([other_endpoint, own_endpoint], -touch.normal),
                };
                let key = ConstraintKey::SoftPair(key(touch.triangle as u32));
                constraints.push(pair.constraint(endpoints, normal, touch.gap, key));
                self.closings.push(touch.closing);
            }
        }
        self.touches = touches;
        self.on_triangles[side] = list;
    }

    /// The triangles that a node touches: those of the last step that still serve, and the nearest fresh one. `near` are
    /// the node and the triangles near it.
    fn touches_of_node(
        &self,
        surfaces: [&SoftSurface<'_>; 2],
        side: usize,
        near: &[(u32, u32)],
        key: &impl Fn(u32) -> SoftPairContact,
        touches: &mut Vec<Touch>,
    ) {
        let (own, other) = (surfaces[side], surfaces[1 - side]);
        let itself = own.key == other.key;
        touches.clear();
        let mut best: Option<Touch> = None;
        for &(s, t) in near {
            let s = s as usize;
            if itself && are_neighbours(own, s, t as usize) {
                continue;
            }
            let last = self.last_normal(&key(t)).map(|normal| if side == 0 { normal } else { -normal });
            let carried = last.is_some();
            let tolerance = if carried { STILL_BESIDE } else { BESIDE };
            let touch = on_triangle(own, s, other, t as usize, tolerance, last);
            let touch = touch.filter(|touch| carried || itself || !self.is_kept_off(touch, other, 1 - side));
            let Some(touch) = touch else { continue };
            if carried {
                touches.push(touch);
            }
            if touch.miss <= BESIDE && best.is_none_or(|b| touch.gap.abs() < b.gap.abs()) {
                best = Some(touch);
            }
        }
        if let Some(best) = best {
            touches.retain(|t| t.triangle != best.triangle && t.normal.dot(&best.normal) < COPLANAR);
            touches.push(best);
        }
    }

    /// The normal of a contact that carried in the last step.
    fn last_normal(&self, contact: &SoftPairContact) -> Option<Vec3> {
        let place = self.carried.binary_search_by_key(&name(contact), |(name, _)| *name);
        place.ok().map(|k| self.carried[k].1)
    }

    /// Whether the nodes of a triangle have constraints already that keep it from what touches it.
    fn is_kept_off(&self, touch: &Touch, surface: &SoftSurface<'_>, side: usize) -> bool {
        surface.model.surface.triangles[touch.triangle].iter().all(|&n| {
            let index = surface.model.surface.index_of_node[n as usize] as usize;
            self.pushed[side][index].is_some_and(|pushed| pushed.dot(&touch.normal) < -PARALLEL)
        })
    }

    /// Edges across edges.
    fn cross(&mut self, pair: &SoftPair, surfaces: [&SoftSurface<'_>; 2], constraints: &mut Vec<Constraint>) {
        let [a, b] = surfaces;
        let itself = a.key == b.key;
        for &(ea, eb) in &self.edges {
            let nodes = [a.model.surface.edges[ea as usize], b.model.surface.edges[eb as usize]];
            if itself && nodes[0].iter().any(|&n| nodes[1].iter().any(|&m| near_in_mesh(a.model, n, m))) {
                continue;
            }
            let kind = SoftPairKind::Edges;
            let key = SoftPairContact { other: b.key, second: eb, first: ea, kind };
            let last = self.last_normal(&key);
            let carried = last.is_some();
            let tolerance = if carried { CARRYING_EDGES } else { NEW_EDGES };
            let Some(crossing) = crossing(a, ea as usize, b, eb as usize, tolerance, last) else { continue };
            let is_kept_off = |side: usize| {
                nodes[side].iter().all(|&n| {
                    let index = surfaces[side].model.surface.index_of_node[n as usize] as usize;
                    self.pushed[side][index]
                        .is_some_and(|pushed| pushed.dot(&crossing.normal).abs() > PARALLEL)
                })
            };
            if !carried && (is_kept_off(0) || is_kept_off(1)) {
                continue;
            }
            let soft = |k: usize, body: usize| {
                let [i, j] = nodes[k];
                let t = crossing.places[k];
                Endpoint::Soft { body, nodes: [i, j, 0], weights: [1.0 - t, t, 0.0] }
            };
            constraints.push(pair.constraint(
                [soft(0, a.body), soft(1, b.body)],
                crossing.normal,
                crossing.gap,
                ConstraintKey::SoftPair(key),
            ));
            self.closings.push(crossing.closing);
        }
    }
}

/// What of two given bodies a contact is of, ascending as [`ConstraintKey`] is.
fn name(contact: &SoftPairContact) -> (u32, u32, SoftPairKind) {
    (contact.second, contact.first, contact.kind)
}

/// Whether a surface node and a triangle of the same body are too near in the mesh to touch.
fn are_neighbours(s: &SoftSurface<'_>, node: usize, triangle: usize) -> bool {
    let node = s.model.surface.nodes[node];
    s.model.surface.triangles[triangle].iter().any(|&n| near_in_mesh(s.model, node, n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface_tree::SurfaceTree;
    use crate::fem::DeformableModel;
    use crate::math::{rotation_from_vector, to_real};
    use crate::mesh::TetMesh;
    use parry3d::math::Pose;
    use parry3d::query::{PointQuery, distance};
    use parry3d::shape::{Segment, Triangle};
    use proptest::prelude::*;

    fn vector(size: f64) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn nodes_and_edges_that_are_near_are_listed_and_no_others(
            shift in vector(0.35), turn in vector(3.0), margin in 0.005..0.05f64,
        ) {
            let model = DeformableModel::new(&TetMesh::cuboid([0.2, 0.15, 0.1], [3, 2, 2]).unwrap());
            let moved: Vec<Vec3> =
                model.rest.iter().map(|x| rotation_from_vector(&turn) * x + shift).collect();
            let x = [&model.rest, &moved];
            let trees = x.map(|x| {
                let mut tree = SurfaceTree::default();
                tree.update(&model, x, x, margin);
                tree
            });
            let surface = |k: usize| SoftSurface {
                body: k, key: k as u64, model: &model, x: x[k], target: x[k],
                faces: &[], normals: &[], reach: &[], withheld: 0.0, tree: &trees[k],
            };
            let mut detector = SoftDetector::default();
            detector.collect([&surface(0), &surface(1)], false);
            detector.edges.sort_unstable();
            let at = |k: usize, n: u32| to_real(&x[k][n as usize]);
            let mesh = &model.surface;
            // Two boxes with the margin around each meet within √3 of twice the margin along their
            // diagonal; triangles reach no farther than their longest edge from a corner of theirs.
            let longest = mesh.edges.iter().map(|e| (model.rest[e[0] as usize] - model.rest[e[1] as usize]).norm());
            let far = (3.5 * margin + 2.0 * longest.fold(0.0, f64::max)) as f32;
            for side in 0..2 {
                let list = &detector.on_triangles[side];
                prop_assert!(list.windows(2).all(|w| w[0] < w[1]), "once each");
                for (s, &n) in mesh.nodes.iter().enumerate() {
                    for (t, triangle) in mesh.triangles.iter().enumerate() {
                        let [a, b, c] = triangle.map(|n| at(1 - side, n));
                        let gap = Triangle::new(a, b, c).distance_to_local_point(at(side, n), true);
                        let listed = list.binary_search(&(s as u32, t as u32)).is_ok();
                        prop_assert!(listed || f64::from(gap) > 2.0 * margin);
                        prop_assert!(!listed || gap < far);
                    }
                }
            }
            prop_assert!(detector.edges.windows(2).all(|w| w[0] < w[1]), "once each");
            let segment = |k: usize, e: usize| Segment::new(at(k, mesh.edges[e][0]), at(k, mesh.edges[e][1]));
            for ea in 0..mesh.edges.len() {
                for eb in 0..mesh.edges.len() {
                    let gap =
                        distance(&Pose::IDENTITY, &segment(0, ea), &Pose::IDENTITY, &segment(1, eb)).unwrap().distance;
                    let listed = detector.edges.binary_search(&(ea as u32, eb as u32)).is_ok();
                    prop_assert!(listed || f64::from(gap) > 2.0 * margin);
                    prop_assert!(!listed || gap < far);
                }
            }
        }
    }
}
