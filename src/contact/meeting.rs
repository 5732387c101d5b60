//! Where a node and a triangle, or two edges, are when they meet: what the weights of their contact are taken from. All follows from where
//! their nodes are at the start of the step, and where these would go without contact; what a gradient differentiates is this.

use super::triangle_contact::barycentric;
use crate::math::Vec3;

/// How a gap closes without contact.
#[derive(Clone, Copy)]
pub(crate) struct Closing {
    /// Part of the step: zero if the gap is closed already or opens.
    pub when: f64,
    /// \[m\] in the whole step.
    pub distance: f64,
}

impl Closing {
    pub fn new([gap, distance]: [f64; 2]) -> Self {
        let when = if gap > 0.0 && distance > 0.0 { (gap / distance).min(1.0) } else { 0.0 };
        Self { when, distance }
    }
}

/// Of a node on a triangle, first of the four, with the normal towards it: how they close, and the weights of the corners.
pub(super) fn on_triangle(normal: &Vec3, x: &[Vec3; 4], targets: &[Vec3; 4]) -> Option<(Closing, [f64; 3])> {
    let closing = Closing::new(triangle_closing(normal, x, targets));
    Some((closing, weights_at(closing.when, x, targets)?))
}

/// Height of a node over a triangle, and by how much that closes in the step \[m\].
pub(crate) fn triangle_closing(normal: &Vec3, x: &[Vec3; 4], targets: &[Vec3; 4]) -> [f64; 2] {
    let ways = ways(x, targets);
    [normal.dot(&(x[0] - x[1])), normal.dot(&((ways[1] + ways[2] + ways[3]) / 3.0 - ways[0]))]
}

/// Weights of the corners below the node at a part of the step.
pub(crate) fn weights_at(when: f64, x: &[Vec3; 4], targets: &[Vec3; 4]) -> Option<[f64; 3]> {
    let ways = ways(x, targets);
    let [node, met @ ..]: [Vec3; 4] = std::array::from_fn(|k| x[k] + ways[k] * when);
    barycentric(&met, &node)
}

/// Of an edge, the first two of four nodes, across another, with the normal towards it: how they close, and the places on both, 0 at their first nodes.
pub(super) fn across(normal: &Vec3, x: &[Vec3; 4], targets: &[Vec3; 4]) -> (Closing, [f64; 2]) {
    let closing = Closing::new(edges_closing(normal, x, targets));
    (closing, places_at(closing.when, x, targets))
}

/// Height of an edge over another, and by how much that closes in the step \[m\].
pub(crate) fn edges_closing(normal: &Vec3, x: &[Vec3; 4], targets: &[Vec3; 4]) -> [f64; 2] {
    [normal.dot(&(x[0] - x[2])), -normal.dot(&mean_way(x, targets))]
}

/// Places on both edges at a part of the step, where they are nearest: in the plane of both `p + s u = q + t v`.
pub(crate) fn places_at(when: f64, x: &[Vec3; 4], targets: &[Vec3; 4]) -> [f64; 2] {
    let [p, p_end, q, q_end] = x;
    let (u, v) = (p_end - p, q_end - q);
    let across = u.cross(&v);
    let length = across.norm();
    let w = q - p - mean_way(x, targets) * when;
    [w.cross(&v), w.cross(&u)].map(|side| side.dot(&across) / (length * length))
}

/// Mean motion over the step, without contact, of the first two of four nodes against the other two \[m\].
fn mean_way(x: &[Vec3; 4], targets: &[Vec3; 4]) -> Vec3 {
    let mean = |i: usize, j: usize| (targets[i] - x[i] + targets[j] - x[j]) * 0.5;
    mean(0, 1) - mean(2, 3)
}

fn ways(x: &[Vec3; 4], targets: &[Vec3; 4]) -> [Vec3; 4] {
    std::array::from_fn(|k| targets[k] - x[k])
}
