//! Contacts of one body with one obstacle.

use super::obstacle::Obstacle;
use super::row::{Row, Side};
use super::surface_point::{Scales, SurfacePoint, surface_point};
use super::triangle_rows::triangle_point;
use crate::body::{ContactKey, DeformableModel};
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// A body and an obstacle that may touch: filters have been passed and coefficients combined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Index of the body in the step's list.
    pub body: usize,
    /// Index of the obstacle in the step's list.
    pub obstacle: usize,
    pub friction: f64,
    pub restitution: f64,
}

/// Part of the mean edge within which contacts are looked for even without motion.
const STATIC_MARGIN: f64 = 0.05;
/// Part of the mean edge by which nodes are shifted back to tell inside from outside.
const SHIFT: f64 = 0.1;
/// Part of the body's size within which a projection's direction is not trusted.
const BAND: f64 = 1.0e-4;

/// Finds contacts; holds the memory it needs between calls.
#[derive(Default)]
pub(crate) struct Detector {
    normals: Vec<Vec3>,
    local: Vec<Vec3>,
    reach: Vec<f64>,
    found: Vec<Option<SurfacePoint>>,
}

impl Detector {
    /// Prepares for a body: positions `x` at the start of the step, where its nodes would go
    /// without contact (`target`).
    pub fn begin(&mut self, model: &DeformableModel, x: &[Vec3], target: &[Vec3]) {
        let surface = &model.surface;
        self.normals.clear();
        self.normals.resize(surface.nodes.len(), Vec3::zeros());
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|n| x[n as usize]);
            let area = (b - a).cross(&(c - a));
            triangle.iter().for_each(|&n| self.normals[surface.index_of_node[n as usize] as usize] += area);
        }
        // A node whose triangles cancel has no outside; any direction serves.
        self.normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or(Vec3::y()));
        let margin = STATIC_MARGIN * surface.mean_edge;
        let motion = |&n: &u32| margin + (target[n as usize] - x[n as usize]).norm();
        self.reach.clear();
        self.reach.extend(surface.nodes.iter().map(motion));
    }

    /// Box around all that the body may touch over the step.
    pub fn aabb(&self, model: &DeformableModel, x: &[Vec3]) -> Aabb {
        let reach = self.reach.iter().fold(0.0, |a: f64, b| a.max(*b));
        let points = model.surface.nodes.iter().map(|&n| to_real(&x[n as usize]));
        Aabb::from_points(points).loosened(reach as f32)
    }

    /// Appends the contacts of a pair to `rows`. [`Detector::begin`] was called for the body.
    pub fn detect(
        &mut self,
        pair: &Pair,
        obstacle: &Obstacle,
        model: &DeformableModel,
        x: &[Vec3],
        rows: &mut Vec<Row>,
    ) {
        let first = rows.len();
        let surface = &model.surface;
        let scales = Scales {
            band: BAND * model.size,
            shift: SHIFT * surface.mean_edge,
        };
        let to_local = |n: &u32| obstacle.start.inverse_transform(&x[*n as usize]);
        self.local.clear();
        self.local.extend(surface.nodes.iter().map(to_local));
        let extent = obstacle.shape.compute_local_aabb();
        self.found.clear();
        self.found.resize(surface.nodes.len(), None);
        for s in 0..surface.nodes.len() {
            let p = self.local[s];
            let world = x[surface.nodes[s] as usize];
            let reach = self.reach[s] + obstacle.displacement(&world).norm();
            if !near(&extent, &p, reach) {
                continue;
            }
            let outward = obstacle.start.rotation.tr_mul(&self.normals[s]);
            self.found[s] = surface_point(obstacle, &p, &outward, &scales);
            if let Some(found) = self.found[s].filter(|f| f.gap < reach) {
                let nodes = [surface.nodes[s], 0, 0];
                let feature = surface.nodes[s];
                rows.push(row(pair, obstacle, nodes, [1.0, 0.0, 0.0], &found, feature));
            }
        }
        if !obstacle.is_half_space() {
            self.detect_triangles(pair, obstacle, model, x, &extent, &scales, rows);
        }
        rows[first..].sort_by_key(|r| r.key);
        remove_repeated(rows, first);
    }

    fn detect_triangles(
        &self,
        pair: &Pair,
        obstacle: &Obstacle,
        model: &DeformableModel,
        x: &[Vec3],
        extent: &Aabb,
        scales: &Scales,
        rows: &mut Vec<Row>,
    ) {
        let surface = &model.surface;
        let node_count = model.rest.len() as u32;
        let edge_count = surface.edges.len() as u32;
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let s = triangle.map(|n| surface.index_of_node[n as usize] as usize);
            let corners = s.map(|s| self.local[s]);
            let motion = obstacle.displacement(&x[triangle[0] as usize]).norm();
            let reach = s.iter().fold(0.0, |a: f64, &s| a.max(self.reach[s])) + motion;
            let around = Aabb::from_points(corners.iter().map(to_real)).loosened(reach as f32);
            if !around.intersects(extent) {
                continue;
            }
            let corner_rows = s.map(|s| self.found[s]);
            if let Some(hit) = triangle_point(obstacle, &corners, &corner_rows, reach, scales) {
                let inside = hit.weights.iter().position(|w| *w == 0.0);
                let feature = node_count
                    + match inside {
                        Some(opposite) => surface.triangle_edges[t][opposite],
                        None => edge_count + t as u32,
                    };
                rows.push(row(pair, obstacle, *triangle, hit.weights, &hit.surface, feature));
            }
        }
    }
}

/// Whether a point is within `reach` of a box.
fn near(extent: &Aabb, p: &Vec3, reach: f64) -> bool {
    let (low, high) = (from_real(extent.mins), from_real(extent.maxs));
    (0..3).all(|k| p[k] >= low[k] - reach && p[k] <= high[k] + reach)
}

fn row(
    pair: &Pair,
    obstacle: &Obstacle,
    nodes: [u32; 3],
    weights: [f64; 3],
    found: &SurfacePoint,
    feature: u32,
) -> Row {
    let soft = Side::Soft {
        body: pair.body,
        nodes,
        weights,
    };
    let partner = Side::Partner {
        partner: obstacle.partner,
        point: obstacle.start.transform(&found.point),
    };
    let key = ContactKey {
        obstacle: obstacle.key,
        part: obstacle.part,
        feature,
    };
    let normal = obstacle.start.rotation * found.normal;
    let mut row = Row::new([soft, partner], normal.normalize(), found.gap, key);
    row.friction = pair.friction;
    row.restitution = pair.restitution;
    row
}

/// Of rows with equal keys (an edge seen from both of its triangles) the deepest stays.
fn remove_repeated(rows: &mut Vec<Row>, first: usize) {
    let mut kept = first;
    for i in first..rows.len() {
        if kept > first && rows[kept - 1].key == rows[i].key {
            if rows[i].gap < rows[kept - 1].gap {
                rows.swap(kept - 1, i);
            }
        } else {
            rows.swap(kept, i);
            kept += 1;
        }
    }
    rows.truncate(kept);
}
