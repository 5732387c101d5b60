//! Contacts at closest points: inside triangles and segments of the body, where nodes, rims and corners miss.

use super::constraint::Constraint;
use super::detection::Detector;
use super::pair_scene::PairScene;
use super::surface_point::{SurfacePoint, surface_point};
use super::thin_contact::segment_point;
use super::triangle_contact::{TrianglePoint, edge_point, triangle_point};
use crate::body::{ConstraintKey, ConstraintMemory, Feature};
use crate::math::{Vec3, to_real};
use crate::mesh::NONE;
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// Slot of the first closest point on a feature; those before are nodes, rims and corners.
const FIRST_POINT: u32 = 1;
/// Cosine beyond which two contacts of an edge push the same way.
const PARALLEL: f64 = 0.9;
/// Cosine beyond which a contact is with a face: 2.5 degrees, more than what a box turns in a step.
const OF_FACE: f64 = 0.999;

impl Detector {
    /// Closest points that carried in the last step are looked at again where they were. One closest
    /// point per triangle is not enough where a surface wraps around another: pushed in at one
    /// point, the next one is elsewhere, and without memory the two would take turns for ever. Contacts with
    /// shapes of plane faces have no slots: of those see [`Detector::keep_edges`].
    pub(super) fn keep_points(
        &mut self,
        scene: &PairScene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let surface = &scene.model.surface;
        let carried = memory.iter().filter(|m| m.force != Vec3::zeros());
        for kept in carried {
            let ConstraintKey::Obstacle(contact) = kept.key else { continue };
            // A node's second wall is none, of what was a mesh in the last step.
            if contact.slot < FIRST_POINT || matches!(contact.feature, Feature::Node(_)) {
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

    /// Edges of the body across edges of plane faces that carried in the last step: of the two edges of a triangle that
    /// lies across the border of a sheet the closest points are on one, and in the next step on the other (20 of 24
    /// cubes on a border swayed by 6e-3 to 6e-2 m/s for ever). They are not looked at where they were, as the normal of
    /// a face is not the one of the contact, but along the whole edge; what touches a rim is found there.
    pub(super) fn keep_edges(
        &mut self,
        scene: &PairScene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let surface = &scene.model.surface;
        for kept in memory.iter().filter(|m| m.force != Vec3::zeros()) {
            let ConstraintKey::Obstacle(contact) = kept.key else { continue };
            let Feature::Edge(e) = contact.feature else { continue };
            // A restored state may be another mesh's.
            if e as usize >= surface.edges.len() || self.is_said(scene, e, &kept.geometry.frame[0]) {
                continue;
            }
            let triangles = surface.edge_triangles[e as usize].into_iter().filter(|t| *t != NONE);
            let found = triangles.filter_map(|t| Some((t, self.point_on_edge(scene, t as usize, e)?)));
            let deepest = found.min_by(|a, b| a.1.surface.gap.total_cmp(&b.1.surface.gap));
            if let Some((t, hit)) = deepest {
                let name = (contact.feature, 0);
                self.points.push((contact.feature, 0, hit.surface));
                let nodes = surface.triangles[t as usize];
                constraints.push(scene.constraint(nodes, hit.weights, &hit.surface, name));
            }
        }
    }

    /// Whether a contact of an edge, which had this normal in the world, is one with a face that an end of it touches, or with
    /// a rim that is found again: along a face any point of the edge would be the closest.
    fn is_said(&self, scene: &PairScene<'_>, edge: u32, normal: &Vec3) -> bool {
        let surface = &scene.model.surface;
        let normal = scene.obstacle.start.rotation.tr_mul(normal);
        let ends = surface.edges[edge as usize].map(|n| surface.index_of_node[n as usize] as usize);
        let touches = |at: &SurfacePoint| at.gap < scene.scales.shift && at.normal.dot(&normal) > OF_FACE;
        let same = |rim: &SurfacePoint| rim.gap < scene.scales.band || rim.normal.dot(&normal) > PARALLEL;
        ends.iter().filter_map(|&s| self.nodes[s].as_ref()).any(touches)
            || self.on_edge(edge).is_some_and(same)
    }

    /// The closest point on an edge of a triangle.
    fn point_on_edge(&self, scene: &PairScene<'_>, t: usize, edge: u32) -> Option<TrianglePoint> {
        let surface = &scene.model.surface;
        let triangle = &surface.triangles[t];
        let s = triangle.map(|n| surface.index_of_node[n as usize] as usize);
        let reach = s.iter().fold(0.0, |a: f64, &s| a.max(self.reach[s])) + scene.motion;
        let mut corners = s.map(|s| self.local[s]);
        let mut opposite = surface.triangle_edges[t].iter().position(|e| *e == edge)?;
        let turned = t >= surface.closed && self.looks_away(scene, triangle, &corners);
        if turned {
            corners.swap(1, 2);
            opposite = [0, 2, 1][opposite];
        }
        let mut hit = edge_point(scene.obstacle, &corners, opposite, reach, &scene.scales)?;
        if turned {
            hit.weights.swap(1, 2);
        }
        Some(hit)
    }

    pub(super) fn detect_triangles(&mut self, scene: &PairScene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        for k in 0..self.near.len() {
            let (t, aabb) = (self.near[k].0 as usize, self.near[k].1);
            let triangle = &surface.triangles[t];
            let s = triangle.map(|n| surface.index_of_node[n as usize] as usize);
            let corners = s.map(|s| self.local[s]);
            let reach = s.iter().fold(0.0, |a: f64, &s| a.max(self.reach[s])) + scene.motion;
            let around = aabb.loosened(reach as f32);
            if !around.intersects(&scene.extent) || self.lies_under_one_face(&s) {
                continue;
            }
            let edges = surface.triangle_edges[t].map(|e| self.on_edge(e));
            let standing = self.standing_on(t).iter().map(|corner| &corner.found);
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
    pub(super) fn detect_segments(&mut self, scene: &PairScene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        for &e in &surface.segments {
            let e = e as usize;
            if self.are_beyond(surface, &surface.edges[e]) {
                continue;
            }
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
            let known =
                s.iter().filter_map(|&s| self.nodes[s].as_ref()).chain(self.on_edge(e as u32)).chain(points);
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

    /// Whether a triangle's corners all touch the same plane face: there is nothing to add then.
    fn lies_under_one_face(&self, s: &[usize; 3]) -> bool {
        let [Some(a), Some(b), Some(c)] = s.map(|s| self.nodes[s]) else {
            return false;
        };
        let same = |o: &SurfacePoint| o.flat && o.normal == a.normal;
        a.flat && same(&b) && same(&c)
    }
}
