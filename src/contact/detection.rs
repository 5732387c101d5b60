//! Contacts of one body with one obstacle.

use super::constraint::Constraint;
use super::corner_contacts::StandingCorner;
use super::obstacle::Obstacle;
use super::pair_scene::{Pair, PairScene, near, one_constraint_per_feature};
use super::rim_contact::rim_crossing;
use super::shape_table::Solidity;
use super::surface_point::{SurfacePoint, surface_point};
use super::surface_tree::ROUNDING;
use super::thin_contact::{looks_away, side_of_node};
use super::walls::{carried_wall, walls_at};
use crate::body::{ConstraintMemory, Feature};
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real, to_real};
use crate::mesh::{NONE, Surface};
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// Part of the mean edge within which contacts are looked for even without motion.
pub(crate) const STATIC_MARGIN: f64 = 0.05;
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
    pub(super) local: Vec<Vec3>,
    /// Per surface node, beyond which sides of the obstacle's box it is, by more than anything may reach.
    beyond: Vec<u8>,
    /// Triangles that are not wholly beyond one of them, ascending, and their boxes in the obstacle's frame.
    pub(super) near: Vec<(u32, Aabb)>,
    pub(super) nodes: Vec<Option<SurfacePoint>>,
    /// Surface nodes that have a point.
    found: Vec<u32>,
    near_edges: Vec<u32>,
    /// Of an edge, those over triangles of a face.
    parts: Vec<[f64; 2]>,
    /// Rim crossings, ascending by their edges.
    edges: Vec<(u32, SurfacePoint)>,
    /// Corners of the obstacle near the body, with their numbers.
    pub(super) corners: Vec<(u32, Vec3)>,
    /// Ascending by the triangles that they stand on.
    pub(super) standing: Vec<StandingCorner>,
    /// Places in `near` of the triangles that a corner may stand on.
    pub(super) over: Vec<u32>,
    /// Closest points, kept from the last step and new: feature, slot, point.
    pub(super) points: Vec<(Feature, u32, SurfacePoint)>,
}

impl Detector {
    /// Prepares for a body: positions `x` at the start of the step, where its nodes would go without contact (`target`), and how much farther they may be
    /// taken (`lead`).
    pub fn begin(&mut self, model: &DeformableModel, x: &[Vec3], target: &[Vec3], lead: f64) {
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
        self.nodes.clear();
        self.nodes.resize(surface.nodes.len(), None);
        self.found.clear();
        // A node whose triangles cancel has no outside; any direction serves.
        self.normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or(Vec3::y()));
        let margin = STATIC_MARGIN * surface.mean_edge + lead;
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
        let scene = PairScene::new(pair, obstacle, model, x, &self.local);
        self.find_beyond(&scene);
        self.detect_nodes(&scene, memory, constraints);
        let kind = obstacle.kind();
        if !kind.is_plane {
            self.list_near(surface);
            self.detect_rims(&scene, constraints);
            self.detect_corners(&scene, memory, constraints);
            self.points.clear();
            if kind.is_faceted {
                self.keep_edges(&scene, memory, constraints);
            } else {
                self.keep_points(&scene, memory, constraints);
            }
            self.detect_triangles(&scene, constraints);
            self.detect_segments(&scene, constraints);
        }
        if kind.is_faceted {
            one_constraint_per_feature(constraints, first);
        }
        constraints[first..].sort_unstable_by_key(|r| r.key);
    }

    /// How far anything of the body and the obstacle may come towards each other \[m\].
    pub(super) fn farthest_reach(&self, scene: &PairScene<'_>) -> f64 {
        self.reach.iter().fold(0.0, |a: f64, b| a.max(*b)) + scene.motion
    }

    fn find_beyond(&mut self, scene: &PairScene<'_>) {
        let (low, high) = (from_real(scene.extent.mins), from_real(scene.extent.maxs));
        let reach = self.farthest_reach(scene);
        let reach = reach + f64::from(ROUNDING) * (low.abs().max().max(high.abs().max()) + reach);
        let (low, high) = (low.add_scalar(-reach), high.add_scalar(reach));
        let sides = |p: &Vec3| {
            let sides = (0..3).map(|k| u8::from(p[k] < low[k]) << k | u8::from(p[k] > high[k]) << (k + 3));
            sides.fold(0, |all, side| all | side)
        };
        self.beyond.clear();
        self.beyond.extend(self.local.iter().map(sides));
    }

    /// Whether all of some nodes are beyond one side of the obstacle.
    pub(super) fn are_beyond(&self, surface: &Surface, nodes: &[u32]) -> bool {
        let beyond = |n: &u32| self.beyond[surface.index_of_node[*n as usize] as usize];
        nodes.iter().fold(u8::MAX, |sides, n| sides & beyond(n)) != 0
    }

    /// Lists the triangles and the edges that are not.
    fn list_near(&mut self, surface: &Surface) {
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        self.near_edges.clear();
        let corner = |n: &u32| to_real(&self.local[surface.index_of_node[*n as usize] as usize]);
        for (t, triangle) in (0..).zip(&surface.triangles) {
            if !self.are_beyond(surface, triangle) {
                near.push((t, Aabb::from_points(triangle.iter().map(corner))));
                let own = |e: &&u32| surface.edge_triangles[**e as usize][0] == t;
                self.near_edges.extend(surface.triangle_edges[t as usize].iter().filter(own));
            }
        }
        self.near_edges.extend(&surface.segments);
        self.near_edges.sort_unstable();
        self.near = near;
    }

    /// The rim that crosses an edge.
    pub(super) fn on_edge(&self, edge: u32) -> Option<&SurfacePoint> {
        let place = self.edges.binary_search_by_key(&edge, |(e, _)| *e);
        place.ok().map(|k| &self.edges[k].1)
    }

    fn detect_nodes(
        &mut self,
        scene: &PairScene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let surface = &scene.model.surface;
        let nodes = &surface.nodes;
        // Those of the obstacle before.
        self.found.drain(..).for_each(|s| self.nodes[s as usize] = None);
        for s in 0..nodes.len() {
            if self.beyond[s] != 0 {
                continue;
            }
            let p = self.local[s];
            let reach = self.reach[s] + scene.motion;
            if !near(&scene.extent, &p, reach) {
                continue;
            }
            let to_local = |v: &Vec3| scene.obstacle.start.rotation.tr_mul(v);
            let outward = || {
                let motion = to_local(&self.motions[s]);
                let side = || side_of_node(scene.obstacle, nodes[s], &p, &motion, memory, scene.scales.band);
                if surface.is_thin[s] { side() } else { to_local(&self.normals[s]) }
            };
            let is_sheet = scene.obstacle.solidity() == Solidity::Sheet;
            let carried = || carried_wall(scene, nodes[s], &p, surface.is_thin[s], memory);
            self.nodes[s] = is_sheet
                .then(carried)
                .flatten()
                .or_else(|| surface_point(scene.obstacle, &p, &outward(), &scene.scales));
            self.found.push(s as u32);
            if let Some(found) = self.nodes[s].filter(|f| f.gap < reach) {
                let walls = match surface.is_thin[s] {
                    true => walls_at(scene, nodes[s], &p, found, reach, memory),
                    false => [Some(found), None, None],
                };
                for (slot, found) in
                    (0..).zip(&walls).filter_map(|(slot, found)| Some((slot, found.as_ref()?)))
                {
                    constraints.push(scene.node_constraint(nodes[s], slot, found));
                }
            }
        }
    }

    fn detect_rims(&mut self, scene: &PairScene<'_>, constraints: &mut Vec<Constraint>) {
        let surface = &scene.model.surface;
        self.edges.clear();
        let mut parts = std::mem::take(&mut self.parts);
        for k in 0..self.near_edges.len() {
            let e = self.near_edges[k] as usize;
            let edge = &surface.edges[e];
            let ends = edge.map(|n| surface.index_of_node[n as usize] as usize);
            let reach = self.reach[ends[0]].max(self.reach[ends[1]]) + scene.motion;
            let points = ends.map(|s| self.local[s]);
            let mut crossing = |inner: usize| {
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
                let (t, found) =
                    rim_crossing(scene.obstacle, &on_face, [a, b], &outward, &scene.scales, &mut parts)?;
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
                self.edges.push((e as u32, found));
            }
        }
        self.parts = parts;
    }

    /// Whether a triangle of a sheet has to be turned over for this obstacle.
    pub(super) fn looks_away(&self, scene: &PairScene<'_>, triangle: &[u32; 3], corners: &[Vec3; 3]) -> bool {
        let s = triangle.map(|n| scene.model.surface.index_of_node[n as usize] as usize);
        let found = s.iter().filter_map(|&s| self.nodes[s].as_ref());
        looks_away(scene.obstacle, corners, found)
    }

    /// The body's normal at an edge, in the obstacle's frame.
    fn edge_normal(&self, surface: &Surface, edge: usize) -> Vec3 {
        let normal = |&t: &u32| {
            let triangle = surface.triangles[t as usize];
            let [a, b, c] = triangle.map(|n| self.local[surface.index_of_node[n as usize] as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        let sum: Vec3 = surface.edge_triangles[edge].iter().filter(|t| **t != NONE).map(normal).sum();
        sum.try_normalize(0.0).unwrap_or_default()
    }
}
