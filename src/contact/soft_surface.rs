//! The surface of a deformable body as contact with another one sees it.

use super::constraint::{Constraint, Endpoint, Law};
use super::surface_tree::SurfaceTree;
use crate::body::ConstraintKey;
use crate::fem::DeformableModel;
use crate::math::Vec3;

/// By how much weights may miss a triangle, or places an edge, where contact was in the last step.
pub(super) const STILL_BESIDE: f64 = 0.3;
/// Depth, in mean edges, beyond which nothing is pushed out where it came in.
pub(super) const DEEPEST: f64 = 1.0;

/// A body's surface in one step.
#[derive(Clone, Copy)]
pub(crate) struct SoftSurface<'a> {
    /// Place in the step's list.
    pub body: usize,
    /// Names the body over several steps.
    pub key: u64,
    pub model: &'a DeformableModel,
    /// Nodes at the start of the step, and where they would go without contact.
    pub x: &'a [Vec3],
    pub target: &'a [Vec3],
    /// Unit normals of the triangles; zero for those without area.
    pub faces: &'a [Vec3],
    /// Per surface node: the body's normal, and how far the node may come.
    pub normals: &'a [Vec3],
    pub reach: &'a [f64],
    /// What of that is not for soft bodies \[m\].
    pub withheld: f64,
    pub tree: &'a SurfaceTree,
}

impl SoftSurface<'_> {
    /// How far a node may come towards another soft body \[m\].
    pub(super) fn reach_of(&self, node: usize) -> f64 {
        self.reach[self.model.surface.index_of_node[node] as usize] - self.withheld
    }
}

/// Two bodies that may touch: filters have been passed and coefficients combined.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SoftPair {
    pub friction: f64,
    pub restitution: f64,
}

impl SoftPair {
    pub fn constraint(
        &self,
        endpoints: [Endpoint; 2],
        normal: Vec3,
        gap: f64,
        key: ConstraintKey,
    ) -> Constraint {
        let mut constraint = Constraint::new(endpoints, normal, gap, key);
        constraint.law = Law::Contact { friction: self.friction };
        constraint.restitution = self.restitution;
        constraint
    }
}

/// Whether two nodes are the same, neighbours, or have a neighbour in common: nothing can come between those
/// but a crease sharper than the mesh can show.
pub(super) fn near_in_mesh(model: &DeformableModel, a: u32, b: u32) -> bool {
    let [of_a, of_b] = [a, b].map(|n| &model.adjacency[n as usize]);
    a == b || of_a.binary_search(&b).is_ok() || of_a.iter().any(|n| of_b.binary_search(n).is_ok())
}
