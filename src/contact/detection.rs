//! Contacts of one body with one obstacle.

use super::constraint::{Constraint, Endpoint, Law};
use super::obstacle::Obstacle;
use super::rim_contact::{corner_on_triangle, corners_in, rim_crossing};
use super::surface_point::{Scales, SurfacePoint, surface_point};
use super::thin_contact::{looks_away, segment_point, side_of_node};
use super::triangle_contact::triangle_point;
use crate::body::{ConstraintKey, ConstraintMemory, Feature, ObstacleContact};
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real, to_real};
use crate::mesh::NONE;
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// A body and an obstacle that may touch: filters have been passed and coefficients combined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Index of the body in the step's list.
    pub body: usize,
    pub friction: f64,
    pub restitution: f64,
}

/// Part of the mean edge within which contacts are looked for even without motion.
pub(crate) const STATIC_MARGIN: f64 = 0.05;
/// Part of the mean edge by which nodes are shifted back to tell inside from outside.
const SHIFT: f64 = 0.1;
/// Part of the body's size within which a projection's direction is not trusted.
const BAND: f64 = 1.0e-4;
/// Slot of the first closest point on a feature; those before are nodes, rims and corners.
const FIRST_POINT: u32 = 1;

/// Finds contacts; holds the memory it needs between calls.
#[derive(Default)]
pub(crate) struct Detector {
    /// Normals of the surface's triangles.
    pub faces: Vec<Vec3>,
    /// Per surface node, in the world: normal, and how far the node may come.
    pub normals: Vec<Vec3>,
    pub reach: Vec<f64>,
    /// Where each surface node would go over the step.
    motions: Vec<Vec3>,
    /// Per surface node, in the obstacle's frame.
    local: Vec<Vec3>,
    nodes: Vec<Option<SurfacePoint>>,
    /// Rim crossings found per edge.
    edges: Vec<Option<SurfacePoint>>,
    /// Corners of the obstacle, and which triangle each stands on.
    corners: Vec<(u32, Vec3)>,
    standing: Vec<(usize, SurfacePoint)>,
    /// Closest points, kept from the last step and new: feature, slot, constraint.
    points: Vec<(Feature, u32, SurfacePoint)>,
}

/// One call's arguments, shared by its parts.
struct Scene<'a> {
    pair: &'a Pair,
    obstacle: &'a Obstacle,
    model: &'a DeformableModel,
    extent: Aabb,
    scales: Scales,
    /// Largest motion of the obstacle near the body \[m\].
    motion: f64,
}

impl Detector {
    /// Prepares for a body: positions `x` at the start of the step, where its nodes would go
    /// without contact (`target`).
    pub fn begin(&mut self, model: &DeformableModel, x: &[Vec3], target: &[Vec3]) {
        let surface = &model.surface;
        self.normals.clear();
        self.normals.resize(surface.nodes.len(), Vec3::zeros());
        self.faces.clear();
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|n| x[n as usize]);
            let area = (b - a).cross(&(c - a));
            // Where a sheet meets a solid, the solid has the say.
            for s in triangle.map(|n| surface.index_of_node[n as usize] as usize) {
                if t < surface.closed || surface.is_thin[s] {
                    self.normals[s] += area;
                }
            }
            // None for a triangle that has shrunk to nothing.
            self.faces.push(area.try_normalize(0.0).unwrap_or_default());
        }
        // A node whose triangles cancel has no outside; any direction serves.
        self.normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or(Vec3::y()));
        let margin = STATIC_MARGIN * surface.mean_edge;
        self.motions.clear();
        self.motions.extend(surface.nodes.iter().map(|&n| target[n as usize] - x[n as usize]));
        let skins = surface.nodes.iter().map(|&n| model.half_thickness[n as usize]);
        self.reach.clear();
        self.reach.extend(self.motions.iter().zip(skins).map(|(motion, skin)| margin + skin + motion.norm()));
    }

    /// Box around all that the body may touch over the step.
    pub fn aabb(&self, model: &DeformableModel, x: &[Vec3]) -> Aabb {
        let reach = self.reach.iter().fold(0.0, |a: f64, b| a.max(*b));
        let points = model.surface.nodes.iter().map(|&n| to_real(&x[n as usize]));
        Aabb::from_points(points).loosened(reach as f32)
    }

    /// Appends the contacts of a pair to `constraints`; `memory` holds those of the last step that carried.
    /// [`Detector::begin`] was called for the body.
    pub fn detect(
        &mut self,
        pair: &Pair,
        obstacle: &Obstacle,
        model: &DeformableModel,
        x: &[Vec3],
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let first = constraints.len();
        let surface = &model.surface;
        let to_local = |n: &u32| obstacle.start.inverse_transform(&x[*n as usize]);
        self.local.clear();
        self.local.extend(surface.nodes.iter().map(to_local));
        let moves = obstacle.start != obstacle.end;
        let motion = |n: &u32| obstacle.displacement(&x[*n as usize]).norm();
        let scene = Scene {
            pair,
            obstacle,
            model,
            extent: obstacle.shape.compute_local_aabb(),
            scales: Scales { band: BAND * model.size, shift: SHIFT * surface.mean_edge },
            motion: if moves { surface.nodes.iter().map(motion).fold(0.0, f64::max) } else { 0.0 },
        };
        self.detect_nodes(&scene, memory, constraints);
        if !obstacle.is_half_space() {
            self.detect_rims(&scene, constraints);
            self.detect_corners(&scene, constraints);
            self.keep_points(&scene, memory, constraints);
            self.detect_triangles(&scene, constraints);
            self.detect_segments(&scene, constraints);
        }
        if obstacle.is_faceted() {
            one_constraint_per_feature(constraints, first);
        }
        constraints[first..].sort_unstable_by_key(|r| r.key);
    }

    fn detect_nodes(
        &mut self,
        scene: &Scene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let surface = &scene.model.surface;
        let nodes = &surface.nodes;
        self.nodes.clear();
        self.nodes.resize(nodes.len(), None);
        for s in 0..nodes.len() {
            let p = self.local[s];
            let reach = self.reach[s] + scene.motion;
            if !near(&scene.extent, &p, reach) {
                continue;
            }
            let to_local = |v: &Vec3| scene.obstacle.start.rotation.tr_mul(v);
            let outward = if surface.is_thin[s] {
                side_of_node(
                    scene.obstacle,
                    nodes[s],
                    &p,
                    &to_local(&self.motions[s]),
                    memory,
                    scene.scales.band,
                )
            } else {
                to_local(&self.normals[s])
            };
            self.nodes[s] = surface_point(scene.obstacle, &p, &outward, &scene.scales);
            if let Some(found) = self.nodes[s].filter(|f| f.gap < reach) {
                constraints.push(scene.constraint(
                    [nodes[s], 0, 0],
                    [1.0, 0.0, 0.0],
                    &found,
                    (Feature::Node(nodes[s]), 0),
                ));
            }
        }
    }

    fn detect_rims(&mut self, scene: &Scene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        self.edges.clear();
        self.edges.resize(surface.edges.len(), None);
        for (e, edge) in surface.edges.iter().enumerate() {
            let ends = edge.map(|n| surface.index_of_node[n as usize] as usize);
            let reach = self.reach[ends[0]].max(self.reach[ends[1]]) + scene.motion;
            let points = ends.map(|s| self.local[s]);
            let crossing = |inner: usize| {
                let (on_face, other) = (self.nodes[ends[inner]]?, self.nodes[ends[1 - inner]]);
                let same_face = |o: SurfacePoint| o.flat && o.normal == on_face.normal;
                if !on_face.flat || on_face.gap > reach || other.is_some_and(same_face) {
                    return None;
                }
                let mut outward = self.edge_normal(surface, e);
                if surface.is_thin_edge(e) {
                    outward = -on_face.normal;
                }
                let [a, b] = [&points[inner], &points[1 - inner]];
                let (t, found) = rim_crossing(scene.obstacle, &on_face, a, b, &outward, &scene.scales)?;
                Some((if inner == 0 { t } else { 1.0 - t }, found))
            };
            // Draped over an edge of the obstacle, one edge of the body crosses two rims in one place:
            // the deeper one stands for both.
            let crossings = [crossing(0), crossing(1)].into_iter().flatten();
            let found = crossings.min_by(|a, b| a.1.gap.total_cmp(&b.1.gap));
            if let Some((t, found)) = found.filter(|(_, found)| found.gap < reach) {
                let nodes = [edge[0], edge[1], 0];
                constraints.push(scene.constraint(
                    nodes,
                    [1.0 - t, t, 0.0],
                    &found,
                    (Feature::Edge(e as u32), 0),
                ));
                self.edges[e] = Some(found);
            }
        }
    }

    fn detect_corners(&mut self, scene: &Scene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        let reach = self.reach.iter().fold(0.0, |a: f64, b| a.max(*b)) + scene.motion;
        let body = Aabb::from_points(self.local.iter().map(to_real)).loosened(reach as f32);
        corners_in(scene.obstacle, &body, &mut self.corners);
        self.standing.clear();
        for (number, corner) in &self.corners {
            let at = to_real(corner);
            let mut best: Option<(usize, [f64; 3], SurfacePoint)> = None;
            for (t, triangle) in surface.triangles.iter().enumerate() {
                let corners = triangle.map(|n| self.local[surface.index_of_node[n as usize] as usize]);
                let around = Aabb::from_points(corners.iter().map(to_real)).loosened(reach as f32);
                if !around.contains_local_point(at) {
                    continue;
                }
                let turned = t >= surface.closed && self.looks_away(scene, triangle, &corners);
                let [a, b, c] = corners;
                let corners = if turned { [a, c, b] } else { corners };
                let found = corner_on_triangle(scene.obstacle, corner, &corners, reach, &scene.scales);
                let Some((mut weights, constraint)) = found else { continue };
                if turned {
                    weights.swap(1, 2);
                }
                if best.is_none_or(|(_, _, b)| constraint.gap.abs() < b.gap.abs()) {
                    best = Some((t, weights, constraint));
                }
            }
            if let Some((t, weights, found)) = best {
                self.standing.push((t, found));
                let feature = Feature::Corner(*number);
                constraints.push(scene.constraint(surface.triangles[t], weights, &found, (feature, 0)));
            }
        }
    }

    /// Closest points that carried in the last step are looked at again where they were. One closest
    /// point per triangle is not enough where a surface wraps around another: pushed in at one
    /// point, the next one is elsewhere, and without memory the two would take turns for ever. Rows with
    /// shapes of plane faces have no slots, and so none is kept: beside an edge the normal of a face is not
    /// the one of the contact.
    fn keep_points(
        &mut self,
        scene: &Scene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let surface = &scene.model.surface;
        self.points.clear();
        let carried = memory.iter().filter(|m| m.force != Vec3::zeros());
        for kept in carried {
            let ConstraintKey::Obstacle(contact) = kept.key else { continue };
            if contact.slot < FIRST_POINT {
                continue;
            }
            let (nodes, weights) = (kept.geometry.nodes[0], kept.geometry.weights[0]);
            let s = nodes.map(|n| surface.index_of_node[n as usize] as usize);
            // A restored state may be another mesh's.
            if s.iter().any(|s| *s >= self.local.len()) {
                continue;
            }
            let [a, b, c] = s.map(|s| self.local[s]);
            let p = a * weights[0] + b * weights[1] + c * weights[2];
            let mut outward = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            if outward == Vec3::zeros() || s.iter().any(|&s| surface.is_thin[s]) {
                outward = -scene.obstacle.start.rotation.tr_mul(&kept.geometry.frame[0]);
            }
            let reach = s.iter().fold(0.0, |a: f64, &s| a.max(self.reach[s])) + scene.motion;
            let found = surface_point(scene.obstacle, &p, &outward, &scene.scales);
            if let Some(found) = found.filter(|f| f.gap < reach && f.normal.dot(&outward) < 0.0) {
                self.points.push((contact.feature, contact.slot, found));
                constraints.push(scene.constraint(nodes, weights, &found, (contact.feature, contact.slot)));
            }
        }
    }

    fn detect_triangles(&mut self, scene: &Scene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let s = triangle.map(|n| surface.index_of_node[n as usize] as usize);
            let corners = s.map(|s| self.local[s]);
            let reach = s.iter().fold(0.0, |a: f64, &s| a.max(self.reach[s])) + scene.motion;
            let around = Aabb::from_points(corners.iter().map(to_real)).loosened(reach as f32);
            if !around.intersects(&scene.extent) || self.lies_under_one_face(&s) {
                continue;
            }
            let edges = surface.triangle_edges[t].map(|e| &self.edges[e as usize]);
            let standing = self.standing.iter().filter(|(on, _)| *on == t).map(|(_, constraint)| constraint);
            let known = s.iter().filter_map(|&s| self.nodes[s].as_ref());
            let [e0, e1, e2] = surface.triangle_edges[t].map(Feature::Edge);
            let own = [e0, e1, e2, Feature::Triangle(t as u32)];
            let points = self.points.iter().filter(|(feature, ..)| own.contains(feature)).map(|p| &p.2);
            let known = known.chain(edges.into_iter().flatten()).chain(standing).chain(points);
            let turned = t >= surface.closed && self.looks_away(scene, triangle, &corners);
            let corners = if turned { [corners[0], corners[2], corners[1]] } else { corners };
            if let Some(mut hit) = triangle_point(scene.obstacle, &corners, known, reach, &scene.scales) {
                if turned {
                    hit.weights.swap(1, 2);
                }
                let feature = match hit.weights.iter().position(|w| *w == 0.0) {
                    Some(opposite) => Feature::Edge(surface.triangle_edges[t][opposite]),
                    None => Feature::Triangle(t as u32),
                };
                let slot = self.free_slot(feature);
                self.points.push((feature, slot, hit.surface));
                constraints.push(scene.constraint(*triangle, hit.weights, &hit.surface, (feature, slot)));
            }
        }
    }

    /// Contacts inside the segments of rods.
    fn detect_segments(&mut self, scene: &Scene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        let alone = surface.edge_triangles.iter().enumerate().filter(|(_, endpoints)| endpoints[0] == NONE);
        for (e, _) in alone {
            let s = surface.edges[e].map(|n| surface.index_of_node[n as usize] as usize);
            let ends = s.map(|s| self.local[s]);
            let reach = self.reach[s[0]].max(self.reach[s[1]]) + scene.motion;
            let around = Aabb::from_points(ends.iter().map(to_real)).loosened(reach as f32);
            if !around.intersects(&scene.extent) {
                continue;
            }
            let feature = Feature::Edge(e as u32);
            let skin =
                surface.edges[e].iter().map(|&n| scene.model.half_thickness[n as usize]).fold(0.0, f64::max);
            let points = self.points.iter().filter(|p| p.0 == feature).map(|p| &p.2);
            let known = s.iter().filter_map(|&s| self.nodes[s].as_ref()).chain(&self.edges[e]).chain(points);
            if let Some((t, found)) = segment_point(scene.obstacle, &ends, known, reach, skin, &scene.scales)
            {
                let [a, b] = surface.edges[e];
                let name = (feature, self.free_slot(feature));
                constraints.push(scene.constraint([a, b, a], [1.0 - t, t, 0.0], &found, name));
            }
        }
    }

    /// The first slot of a feature that no closest point has yet.
    fn free_slot(&self, feature: Feature) -> u32 {
        let taken = |slot: u32| self.points.iter().any(|p| (p.0, p.1) == (feature, slot));
        (FIRST_POINT..).find(|&slot| !taken(slot)).unwrap_or(FIRST_POINT)
    }

    /// Whether a triangle of a sheet has to be turned over for this obstacle.
    fn looks_away(&self, scene: &Scene<'_>, triangle: &[u32; 3], corners: &[Vec3; 3]) -> bool {
        let s = triangle.map(|n| scene.model.surface.index_of_node[n as usize] as usize);
        let found = s.iter().filter_map(|&s| self.nodes[s].as_ref());
        looks_away(scene.obstacle, corners, found)
    }

    /// Whether a triangle's corners all touch the same plane face: there is nothing to add then.
    fn lies_under_one_face(&self, s: &[usize; 3]) -> bool {
        let [Some(a), Some(b), Some(c)] = s.map(|s| self.nodes[s]) else {
            return false;
        };
        let same = |o: &SurfacePoint| o.flat && o.normal == a.normal;
        a.flat && same(&b) && same(&c)
    }

    /// The body's normal at an edge, in the obstacle's frame.
    fn edge_normal(&self, surface: &crate::mesh::Surface, edge: usize) -> Vec3 {
        let normal = |&t: &u32| {
            let triangle = surface.triangles[t as usize];
            let [a, b, c] = triangle.map(|n| self.local[surface.index_of_node[n as usize] as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        let sum: Vec3 = surface.edge_triangles[edge].iter().filter(|t| **t != NONE).map(normal).sum();
        sum.try_normalize(0.0).unwrap_or_default()
    }
}

impl Scene<'_> {
    /// The constraint of a point; its name is a feature and a slot. With plane faces one per feature is kept.
    fn constraint(
        &self,
        nodes: [u32; 3],
        weights: [f64; 3],
        found: &SurfacePoint,
        (feature, slot): (Feature, u32),
    ) -> Constraint {
        let obstacle = self.obstacle;
        let soft = Endpoint::Soft { body: self.pair.body, nodes, weights };
        let proxy = Endpoint::Rigid { proxy: obstacle.proxy, point: obstacle.start.transform(&found.point) };
        let slot = if obstacle.is_faceted() { 0 } else { slot };
        let key = ObstacleContact { collider: obstacle.key, part: obstacle.part, feature, slot };
        let key = ConstraintKey::Obstacle(key);
        let normal = obstacle.start.rotation * found.normal;
        let skin = nodes.iter().zip(weights).map(|(&n, w)| self.model.half_thickness[n as usize] * w);
        let gap = found.gap - skin.sum::<f64>();
        let mut constraint = Constraint::new([soft, proxy], normal.normalize(), gap, key);
        constraint.law = Law::Contact { friction: self.pair.friction };
        constraint.restitution = self.pair.restitution;
        constraint
    }
}

/// Whether a point is within `reach` of a box.
fn near(extent: &Aabb, p: &Vec3, reach: f64) -> bool {
    let (low, high) = (from_real(extent.mins), from_real(extent.maxs));
    (0..3).all(|k| p[k] >= low[k] - reach && p[k] <= high[k] + reach)
}

/// Of the constraints from `first` on that name one feature, the deepest stays.
fn one_constraint_per_feature(constraints: &mut Vec<Constraint>, first: usize) {
    constraints[first..].sort_unstable_by(|a, b| a.key.cmp(&b.key).then(a.gap.total_cmp(&b.gap)));
    let mut kept = first;
    for i in first..constraints.len() {
        if kept == first || constraints[kept - 1].key != constraints[i].key {
            constraints.swap(kept, i);
            kept += 1;
        }
    }
    constraints.truncate(kept);
}
