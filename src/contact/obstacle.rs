//! Rigid geometry as contact sees it.

use super::shape_table::{ShapeKind, ShapeTraits, Solidity, shape_traits};
use crate::math::{Pose64, Vec3};
use parry3d::bounding_volume::Aabb;
use parry3d::shape::SharedShape;
use std::sync::Arc;

/// Names a rigid body (or a collider without one) within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct ProxyId(pub u32);

/// One collider, with the motion it makes over the step if nothing touches it.
#[derive(Clone)]
pub(crate) struct Obstacle {
    pub proxy: ProxyId,
    /// Names the collider over several steps.
    pub key: u64,
    /// Part of a compound.
    pub part: u32,
    pub shape: SharedShape,
    pub start: Pose64,
    pub end: Pose64,
    kind: ShapeKind,
    /// Of a mesh, the vertices that are corners, ascending; all of them if nobody has said.
    corners: Option<Arc<[u32]>>,
}

impl Obstacle {
    /// The `part` of a collider that `key` names, on its way from `start` to `end`.
    pub fn new(
        (proxy, key, part): (ProxyId, u64, u32),
        shape: SharedShape,
        [start, end]: [Pose64; 2],
    ) -> Self {
        let kind = shape_traits(&shape).kind;
        Self { proxy, key, part, shape, start, end, kind, corners: None }
    }

    /// One that stands at the origin, for tests.
    #[cfg(test)]
    pub fn at_origin(shape: SharedShape) -> Self {
        let here = Pose64::from_real(&parry3d::math::Pose::IDENTITY);
        Self::new((ProxyId(0), 0, 0), shape, [here, here])
    }

    /// The same, with the vertices of its mesh that are corners, ascending.
    pub fn with_corners(mut self, corners: Option<Arc<[u32]>>) -> Self {
        self.corners = corners;
        self
    }

    /// Whether a vertex of its mesh is a corner.
    pub fn is_corner(&self, vertex: u32) -> bool {
        self.corners.as_ref().is_none_or(|corners| corners.binary_search(&vertex).is_ok())
    }

    /// Displacement over the step \[m\] of the obstacle's material point that is at `p` at its start, at `local` in its
    /// own frame.
    pub fn displacement(&self, p: &Vec3, local: &Vec3) -> Vec3 {
        self.end.transform(local) - p
    }

    /// Displacement over the step \[m\] of the corner of the obstacle's box that goes farthest.
    pub fn largest_displacement(&self) -> f64 {
        if self.start == self.end || self.shape.as_halfspace().is_some() {
            return 0.0;
        }
        let corners = self.shape.compute_local_aabb().vertices().map(crate::math::from_real);
        let moved = corners.map(|v| (self.end.transform(&v) - self.start.transform(&v)).norm());
        moved.into_iter().fold(0.0, f64::max)
    }

    /// Box around all of the step.
    pub fn swept_aabb(&self) -> Aabb {
        let local = self.shape.compute_local_aabb();
        if self.shape.as_halfspace().is_some() {
            return local;
        }
        let corner = |pose: &Pose64, v: parry3d::math::Vector| {
            crate::math::to_real(&pose.transform(&crate::math::from_real(v)))
        };
        let vertices = local.vertices();
        let corners = vertices.iter().flat_map(|&v| [corner(&self.start, v), corner(&self.end, v)]);
        Aabb::from_points(corners)
    }

    /// What contact has to know of its shape.
    pub fn kind(&self) -> ShapeKind {
        self.kind
    }

    /// Its corners, and the core that a thickness is around.
    pub fn traits(&self) -> ShapeTraits<'_> {
        shape_traits(&self.shape)
    }

    pub fn solidity(&self) -> Solidity {
        self.kind.solidity
    }
}
