//! A body and an obstacle, as the searches for their contacts share them.

use super::constraint::{Constraint, Endpoint, Law};
use super::obstacle::Obstacle;
use super::shape_table::Corners;
use super::surface_point::{Scales, SurfacePoint};
use crate::body::{ConstraintKey, Feature, ObstacleContact};
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real};
use parry3d::bounding_volume::Aabb;

/// A body and an obstacle that may touch: filters have been passed and coefficients combined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Index of the body in the step's list.
    pub body: usize,
    pub friction: f64,
    pub restitution: f64,
}

/// Part of the mean edge by which nodes are shifted back to tell inside from outside.
pub(crate) const SHIFT: f64 = 0.1;
/// Part of the body's size within which a projection's direction is not trusted.
const BAND: f64 = 1.0e-4;

/// One call's arguments, shared by its parts.
pub(super) struct PairScene<'a> {
    pub pair: &'a Pair,
    pub obstacle: &'a Obstacle,
    pub model: &'a DeformableModel,
    pub extent: Aabb,
    pub scales: Scales,
    /// Largest motion of the obstacle near the body \[m\].
    pub motion: f64,
}

impl<'a> PairScene<'a> {
    /// Of a body whose surface nodes are at `x`, and at `local` in the obstacle's frame.
    pub fn new(
        pair: &'a Pair,
        obstacle: &'a Obstacle,
        model: &'a DeformableModel,
        x: &[Vec3],
        local: &[Vec3],
    ) -> Self {
        let surface = &model.surface;
        let moves = obstacle.start != obstacle.end;
        let motion = |(n, p): (&u32, &Vec3)| obstacle.displacement(&x[*n as usize], p).norm_squared();
        let motions = surface.nodes.iter().zip(local).map(motion);
        let extent = obstacle.shape.compute_local_aabb();
        let farthest = from_real(extent.mins).abs().sup(&from_real(extent.maxs).abs()).max();
        // Boxes clamp the point: nothing but its own coordinates is rounded.
        let is_box = matches!(obstacle.traits().corners, Corners::Box(_));
        let scales = Scales {
            band: BAND * model.size,
            shift: SHIFT * surface.mean_edge,
            extent: if is_box { 0.0 } else { farthest },
            middle: local.iter().sum::<Vec3>() / local.len().max(1) as f64,
        };
        Self {
            pair,
            obstacle,
            model,
            extent,
            scales,
            motion: if moves { motions.fold(0.0, f64::max).sqrt() } else { 0.0 },
        }
    }

    /// The constraint of a point; its name is a feature and a slot. With plane faces one per feature is kept, but for nodes in hollows.
    pub fn constraint(
        &self,
        nodes: [u32; 3],
        weights: [f64; 3],
        found: &SurfacePoint,
        (feature, slot): (Feature, u32),
    ) -> Constraint {
        let slot = if self.obstacle.kind().is_faceted { 0 } else { slot };
        self.named_constraint(nodes, weights, found, (feature, slot))
    }

    /// That of a node with one of the walls that it touches.
    pub fn node_constraint(&self, node: u32, wall: u32, found: &SurfacePoint) -> Constraint {
        self.named_constraint([node, 0, 0], [1.0, 0.0, 0.0], found, (Feature::Node(node), wall))
    }

    fn named_constraint(
        &self,
        nodes: [u32; 3],
        weights: [f64; 3],
        found: &SurfacePoint,
        (feature, slot): (Feature, u32),
    ) -> Constraint {
        let obstacle = self.obstacle;
        let soft = Endpoint::Soft { body: self.pair.body, nodes, weights };
        let proxy = Endpoint::Rigid { proxy: obstacle.proxy, point: obstacle.start.transform(&found.point) };
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
pub(super) fn near(extent: &Aabb, p: &Vec3, reach: f64) -> bool {
    let (low, high) = (from_real(extent.mins), from_real(extent.maxs));
    (0..3).all(|k| p[k] >= low[k] - reach && p[k] <= high[k] + reach)
}

/// Of the constraints from `first` on that name one feature, the deepest stays.
pub(super) fn one_constraint_per_feature(constraints: &mut Vec<Constraint>, first: usize) {
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
