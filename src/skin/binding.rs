//! What a vertex of a skin is bound to.

use super::rod_frames::Frame;
use super::tet_grid::TetGrid;
use crate::contact::nearest_weights;
use crate::fem::DeformableModel;
use crate::math::{Vec3, tangents, to_real};
use rapier3d::math::Vector;

/// A vertex, and its normal.
#[derive(Clone, Copy, Debug)]
pub(super) enum Binding {
    /// To a tetrahedron: weights of the ways from its first corner to the others, of the place and of two tangents.
    Solid { nodes: [u32; 4], place: [f32; 3], tangents: [[f32; 3]; 2] },
    /// To a triangle of a sheet: weights of its corners, height over it, and the side of the normal.
    Sheet { nodes: [u32; 3], weights: [f32; 3], height: f32, side: f32 },
    /// To a segment of a rod: part of the way along it, place across it in its frame, normal in that frame.
    Rod { nodes: [u32; 2], segment: u32, along: f32, across: [f32; 2], normal: [f32; 3] },
}

/// What bindings are read with.
#[derive(Default)]
pub(super) struct Motion {
    /// Nodes of the body \[m\].
    pub x: Vec<Vec3>,
    /// Unit normals of the sheets at nodes.
    pub normals: Vec<Vec3>,
    /// Frames of the segments of all rods.
    pub frames: Vec<Frame>,
}

impl Binding {
    /// Place and unit normal in the world.
    #[inline]
    pub fn read(&self, motion: &Motion) -> (Vector, Vector) {
        let at = |n: u32| &motion.x[n as usize];
        match self {
            Self::Solid { nodes, place, tangents } => {
                let first = at(nodes[0]);
                let ways = [1, 2, 3].map(|k| at(nodes[k]) - first);
                let sum = |w: &[f32; 3]| -> Vec3 {
                    let [a, b, c] = w.map(f64::from);
                    ways[0] * a + ways[1] * b + ways[2] * c
                };
                let normal = sum(&tangents[0]).cross(&sum(&tangents[1]));
                (to_real(&(first + sum(place))), unit(&normal))
            }
            Self::Sheet { nodes, weights, height, side } => {
                let mix = |of: &[Vec3]| {
                    let terms = nodes.iter().zip(weights);
                    terms.fold(Vec3::zeros(), |sum, (n, w)| sum + of[*n as usize] * f64::from(*w))
                };
                let normal = mix(&motion.normals).try_normalize(0.0).unwrap_or_default();
                (
                    to_real(&(mix(&motion.x) + normal * f64::from(*height))),
                    to_real(&(normal * f64::from(*side))),
                )
            }
            Self::Rod { nodes, segment, along, across, normal } => {
                let [a, b] = nodes.map(at);
                let [u, v, t] = &motion.frames[*segment as usize];
                let place =
                    a + (b - a) * f64::from(*along) + u * f64::from(across[0]) + v * f64::from(across[1]);
                let normal = {
                    let [a, b, c] = normal.map(f64::from);
                    u * a + v * b + t * c
                };
                (to_real(&place), unit(&normal))
            }
        }
    }
}

/// In `f32`, after the differences have been taken: nothing cancels any more.
fn unit(v: &Vec3) -> Vector {
    to_real(&(v / v.amax().max(f64::MIN_POSITIVE))).normalize_or_zero()
}

fn singles(v: &Vec3) -> [f32; 3] {
    [v.x, v.y, v.z].map(|c| c as f32)
}

/// To the tetrahedron that holds a point, or is nearest.
pub(super) fn bind_to_solid(
    grid: &TetGrid<'_>,
    model: &DeformableModel,
    p: &Vec3,
    normal: &Vec3,
) -> Option<Binding> {
    let (tet, inverse, first) = grid.find(p)?;
    let nodes = model.tetrahedra[tet as usize];
    let sides = normal.try_normalize(0.0).map_or([Vec3::zeros(); 2], |n| tangents(&n));
    let tangents = sides.map(|side| singles(&(inverse * side)));
    Some(Binding::Solid { nodes, place: singles(&(inverse * (p - first))), tangents })
}

/// To a triangle of a sheet, with the rest normals of its corners; and how far it is \[m\].
pub(super) fn bind_to_triangle(
    model: &DeformableModel,
    nodes: [u32; 3],
    normals: &[Vec3],
    p: &Vec3,
    normal: &Vec3,
) -> (f64, Binding) {
    let [a, b, c] = nodes.map(|n| model.rest[n as usize]);
    let weights = nearest_weights([a, b, c], p);
    let foot = a * weights[0] + b * weights[1] + c * weights[2];
    let up = (0..3).fold(Vec3::zeros(), |sum, k| sum + normals[nodes[k] as usize] * weights[k]);
    let up = up.try_normalize(0.0).unwrap_or_default();
    let away = p - foot;
    let side = if up.dot(normal) < 0.0 { -1.0 } else { 1.0 };
    let height = up.dot(&away) as f32;
    (away.norm(), Binding::Sheet { nodes, weights: weights.map(|w| w as f32), height, side })
}

/// To a segment of a rod with its rest frame; and how far its axis is \[m\].
pub(super) fn bind_to_segment(
    model: &DeformableModel,
    (nodes, segment, frame): ([u32; 2], u32, &Frame),
    p: &Vec3,
    normal: &Vec3,
) -> (f64, Binding) {
    let [a, b] = nodes.map(|n| model.rest[n as usize]);
    let way = b - a;
    let along = (way.dot(&(p - a)) / way.norm_squared()).clamp(0.0, 1.0);
    let away = p - (a + way * along);
    let [u, v, t] = frame;
    let across = [u.dot(&away) as f32, v.dot(&away) as f32];
    let normal = singles(&Vec3::new(u.dot(normal), v.dot(normal), t.dot(normal)));
    // Caps of a tube stand out beyond its ends.
    let along = along + t.dot(&away) / way.norm();
    (away.norm(), Binding::Rod { nodes, segment, along: along as f32, across, normal })
}
