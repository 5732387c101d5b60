//! Nodes of one surface on triangles of another.

use super::meeting::{self, Closing};
use super::soft_surface::{DEEPEST, SoftSurface};
use crate::math::Vec3;

/// Cosine beyond which two surfaces face one another.
const FACING: f64 = -0.1;

/// A node on a triangle.
#[derive(Clone, Copy)]
pub(super) struct Touch {
    pub triangle: usize,
    pub weights: [f64; 3],
    /// Outward of the triangle.
    pub normal: Vec3,
    pub gap: f64,
    /// By how much the weights miss the triangle.
    pub miss: f64,
    pub closing: Closing,
}

/// Surface node `s` of one body on triangle `t` of another, where it comes to lie within the step, or misses
/// it by no more than `tolerance`. A sheet's triangle has two sides: the node is on that where it was `last`, else where it
/// is at the start of the step.
pub(super) fn on_triangle(
    own: &SoftSurface<'_>,
    s: usize,
    other: &SoftSurface<'_>,
    t: usize,
    tolerance: f64,
    last: Option<Vec3>,
) -> Option<Touch> {
    let node = own.model.surface.nodes[s] as usize;
    let nodes = other.model.surface.triangles[t].map(|n| n as usize);
    let [a, b, c] = nodes.map(|n| other.x[n]);
    let x = own.x[node];
    let mut normal = other.faces[t];
    if t >= other.model.surface.closed {
        let side = last.unwrap_or(x - a);
        normal *= if normal.dot(&side) < 0.0 { -1.0 } else { 1.0 };
    }
    let looks_away = !own.model.surface.is_thin[s] && normal.dot(&own.normals[s]) > FACING;
    if normal == Vec3::zeros() || looks_away {
        return None;
    }
    let height = normal.dot(&(x - a));
    let reach = own.reach_of(node) + nodes.iter().fold(0.0, |r: f64, &n| r.max(other.reach_of(n)));
    if !(height < reach && height > -DEEPEST * other.model.surface.mean_edge) {
        return None;
    }
    let targets = [own.target[node], other.target[nodes[0]], other.target[nodes[1]], other.target[nodes[2]]];
    let (closing, weights) = meeting::on_triangle(&normal, &[x, a, b, c], &targets)?;
    let miss = weights.iter().fold(0.0, |miss: f64, w| miss.max(-w));
    if miss > tolerance {
        return None;
    }
    let weights = weights.map(|w| w.max(0.0));
    let sum: f64 = weights.iter().sum();
    let weights = weights.map(|w| w / sum);
    let foot = a * weights[0] + b * weights[1] + c * weights[2];
    let skins = nodes.iter().zip(weights).map(|(&n, w)| other.model.half_thickness[n] * w).sum::<f64>();
    let gap = normal.dot(&(x - foot)) - skins - own.model.half_thickness[node];
    Some(Touch { triangle: t, weights, normal, gap, miss, closing })
}
