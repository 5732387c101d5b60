//! Edges of two surfaces across one another.

use super::meeting::{self, Closing};
use super::soft_surface::{DEEPEST, STILL_BESIDE, SoftSurface};
use crate::math::Vec3;

/// What two edges that cross may miss.
#[derive(Clone, Copy)]
pub(super) struct EdgeTolerance {
    /// Part of an edge beyond its ends.
    beside: f64,
    /// Angle \[rad\] between the direction across them and the normals at them.
    askew: f64,
    /// Sine of the angle below which they count as parallel.
    crossing: f64,
}

/// Of edges that did not carry: within a thousandth of an end the node's own constraint serves.
pub(super) const NEW_EDGES: EdgeTolerance = EdgeTolerance { beside: -1.0e-3, askew: 0.4, crossing: 0.1 };
/// Of edges that carried in the last step.
pub(super) const CARRYING_EDGES: EdgeTolerance =
    EdgeTolerance { beside: STILL_BESIDE, askew: 0.6, crossing: 0.05 };

/// Part of both thicknesses by which edges may overlap where they come over one another from the side. Of twelve strips that fold, five had contacts along
/// their width, a thickness deep, for a step; what slides over an edge comes onto it less than a hundredth deep.
const ACROSS: f64 = 0.5;

/// Two edges across one another.
pub(super) struct Crossing {
    /// Places on the two edges, 0 at their first nodes.
    pub places: [f64; 2],
    /// From the second body to the first.
    pub normal: Vec3,
    pub gap: f64,
    pub closing: Closing,
}

/// Edges of two bodies that cross within the step, or nearly. Edges of sheets and rods have no outside: they are
/// on the side of one another where they were `last`, else where they are at the start of the step.
pub(super) fn crossing(
    a: &SoftSurface<'_>,
    ea: usize,
    b: &SoftSurface<'_>,
    eb: usize,
    tolerance: EdgeTolerance,
    last: Option<Vec3>,
) -> Option<Crossing> {
    let ends = |s: &SoftSurface<'_>, e: usize| s.model.surface.edges[e].map(|n| n as usize);
    let ([i, j], [k, l]) = (ends(a, ea), ends(b, eb));
    let (p, u) = (a.x[i], a.x[j] - a.x[i]);
    let (q, v) = (b.x[k], b.x[l] - b.x[k]);
    let across = u.cross(&v);
    let length = across.norm();
    if !(length > tolerance.crossing * u.norm() * v.norm()) {
        return None;
    }
    let normal = across / length;
    let reach = reach_of(a, [i, j]) + reach_of(b, [k, l]);
    let deepest = DEEPEST * a.model.surface.mean_edge.min(b.model.surface.mean_edge);
    let height = normal.dot(&(p - q));
    if !(height.abs() < reach.max(deepest)) {
        return None;
    }
    // Of what is not there, none.
    let face = |s: &SoftSurface<'_>, t: u32| s.faces.get(t as usize).copied().unwrap_or_default();
    let faces = |s: &SoftSurface<'_>, e: usize| s.model.surface.edge_triangles[e].map(|t| face(s, t));
    let [outward_a, outward_b] = [faces(a, ea), faces(b, eb)];
    let thin = [a.model.surface.is_thin_edge(ea), b.model.surface.is_thin_edge(eb)];
    // From b to a: into a, out of b.
    let towards = match thin {
        [false, false] => outward_b[0] + outward_b[1] - outward_a[0] - outward_a[1],
        _ => last.unwrap_or(normal * height),
    };
    let sign = if towards.dot(&normal) < 0.0 { -1.0 } else { 1.0 };
    let (normal, height) = (normal * sign, height * sign);
    if !(height < reach && height > -deepest) {
        return None;
    }
    let x = [a.x[i], a.x[j], b.x[k], b.x[l]];
    let targets = [a.target[i], a.target[j], b.target[k], b.target[l]];
    let (closing, [s, t]) = meeting::across(&normal, &x, &targets);
    let inside = |t: f64| t > -tolerance.beside && t < 1.0 + tolerance.beside;
    // Most edges pass one another beyond their ends: what takes longer comes last.
    let crosses = inside(s)
        && inside(t)
        && (thin[0] || looks_along(a, ea, &outward_a, &-normal, tolerance.askew))
        && (thin[1] || looks_along(b, eb, &outward_b, &normal, tolerance.askew));
    let skins = skin(a, [i, j], s) + skin(b, [k, l], t);
    let gap = height - skins;
    // Borders of a sheet that folds are above one another in the plane of both: what comes from the side and is deep at once is not across.
    let comes_across = gap > -ACROSS * skins
        || last.is_some()
        || meeting::places_at(0.0, &x, &targets).into_iter().all(inside);
    (crosses && comes_across).then_some(Crossing { places: [s, t], normal, gap, closing })
}

/// How far the farther of two nodes may come \[m\].
fn reach_of(s: &SoftSurface<'_>, ends: [usize; 2]) -> f64 {
    ends.map(|n| s.reach_of(n)).into_iter().fold(0.0, f64::max)
}

/// Half thickness at a place between two nodes \[m\].
fn skin(s: &SoftSurface<'_>, [i, j]: [usize; 2], t: f64) -> f64 {
    s.model.half_thickness[i] * (1.0 - t) + s.model.half_thickness[j] * t
}

/// Whether a direction across an edge is between the normals of its two triangles, or nearly; of an edge that
/// is no ridge, nearly their mean.
fn looks_along(s: &SoftSurface<'_>, edge: usize, outward: &[Vec3; 2], direction: &Vec3, askew: f64) -> bool {
    let sum = outward[0] + outward[1];
    let length = sum.norm();
    if !(length > 0.0) {
        return false;
    }
    let surface = &s.model.surface;
    let [i, _] = surface.edges[edge].map(|n| s.x[n as usize]);
    // The second triangle's third corner is below the first one's plane at a ridge.
    let second = surface.triangles[surface.edge_triangles[edge][1] as usize];
    let lowest = second.iter().map(|&n| outward[0].dot(&(s.x[n as usize] - i))).fold(0.0, f64::min);
    let highest = second.iter().map(|&n| outward[0].dot(&(s.x[n as usize] - i))).fold(0.0, f64::max);
    // The cosine of half the angle between the two normals, and of that and some more.
    let half = if -lowest > highest { (0.5 * length).min(1.0) } else { 1.0 };
    let (sin, cos) = askew.sin_cos();
    direction.dot(&sum) >= length * (half * cos - (1.0 - half * half).sqrt() * sin)
}
