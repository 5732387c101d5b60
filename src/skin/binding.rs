//! What a vertex of a skin is bound to.

use super::rod_frames::Frame;
use super::tet_grid::TetGrid;
use crate::contact::nearest_weights;
use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3, tangents};
use parry3d::glamx::Vec3A;
use rapier3d::math::Vector;

/// Rounds in which the foot of a vertex on a curved sheet is found: a dome of 0.5 m with a skin 5 cm off needs five.
const FOOT_ROUNDS: usize = 8;

/// A vertex, and its normal.
#[derive(Clone, Copy, Debug)]
pub(super) enum Binding {
    /// To a tetrahedron: weights of the ways from its first corner to the others, of the place and of two tangents.
    Solid { nodes: [u32; 4], place: [f32; 3], tangents: [[f32; 3]; 2] },
    /// To a triangle of a sheet: weights of its corners, height over it, and the normal in its frame.
    Sheet { nodes: [u32; 3], weights: [f32; 3], height: f32, normal: [f32; 3] },
    /// To a segment of a rod: part of the way along it, place across it in its frame, normal in that frame.
    Rod { nodes: [u32; 2], segment: u32, along: f32, across: [f32; 2], normal: [f32; 3] },
}

/// What bindings are read with: in single precision, and all that is far from the origin in `origin` alone.
#[derive(Default)]
pub(super) struct Motion {
    /// A place in the body \[m\].
    pub origin: Vec3A,
    /// Nodes of the body from there \[m\].
    pub x: Vec<Vec3A>,
    /// Unit normals of the sheets at nodes.
    pub normals: Vec<Vec3A>,
    /// Frames of the segments of all rods.
    pub frames: Vec<[Vec3A; 3]>,
}

impl Binding {
    /// Place and unit normal in the world.
    #[inline]
    pub fn read(&self, motion: &Motion) -> (Vector, Vector) {
        let at = |n: u32| motion.x[n as usize];
        let (place, normal) = match self {
            Self::Solid { nodes, place, tangents: [s, t] } => {
                let first = at(nodes[0]);
                let ways = [1, 2, 3].map(|k| at(nodes[k]) - first);
                let sum = |[a, b, c]: &[f32; 3]| ways[0] * *a + ways[1] * *b + ways[2] * *c;
                (first + sum(place), unit(sum(s).cross(sum(t))))
            }
            Self::Sheet { nodes: [i, j, k], weights: [a, b, c], height, normal } => {
                let mix = |of: &[Vec3A]| of[*i as usize] * *a + of[*j as usize] * *b + of[*k as usize] * *c;
                let up = unit(mix(&motion.normals));
                let place = mix(&motion.x) + up * *height;
                let [across, beyond, over] = *normal;
                // The sides of a sheet: with what follows 10 000 vertices take 0.4 ms instead of 0.14.
                if across == 0.0 && beyond == 0.0 {
                    return ((motion.origin + place).into(), (up * over).into());
                }
                let way = at(*j) - at(*i);
                let along = unit(way - up * up.dot(way));
                (place, along * across + up.cross(along) * beyond + up * over)
            }
            Self::Rod { nodes, segment, along, across, normal: [a, b, c] } => {
                let [from, to] = nodes.map(at);
                let [u, v, t] = &motion.frames[*segment as usize];
                let place = from + (to - from) * *along + *u * across[0] + *v * across[1];
                (place, unit(*u * *a + *v * *b + *t * *c))
            }
        };
        ((motion.origin + place).into(), normal.into())
    }
}

/// Zero stays zero.
#[inline]
fn unit(v: Vec3A) -> Vec3A {
    v * (1.0 / v.length().max(f32::MIN_POSITIVE))
}

/// Lengths \[m\] and parts below this are rounding, and written as zero. The root of the least normal `f32`: a product of two numbers is
/// then never subnormal, which takes a hundred times as long. 10 000 vertices on a rope that falls straight took 2.3 ms, now 0.07
/// (`cargo bench --bench skins`); at half of it products may be subnormal again, at twice nothing changes.
const ROUNDING: f64 = 1.1e-19;

/// In single precision, without what would make subnormal products.
pub(super) fn single(v: &Vec3) -> Vec3A {
    Vec3A::from(singles(v))
}

fn singles(v: &Vec3) -> [f32; 3] {
    [v.x, v.y, v.z].map(rounded)
}

fn rounded(c: f64) -> f32 {
    if c.abs() < ROUNDING { 0.0 } else { c as f32 }
}

/// To a tetrahedron.
pub(super) fn bind_to_solid(grid: &TetGrid<'_>, tet: u32, p: &Vec3, normal: &Vec3) -> Binding {
    let (nodes, first, inverse) = grid.weights(tet);
    let sides = normal.try_normalize(0.0).map_or([Vec3::zeros(); 2], |n| tangents(&n));
    let tangents = sides.map(|side| singles(&(inverse * side)));
    Binding::Solid { nodes, place: singles(&(inverse * (p - first))), tangents }
}

/// To a triangle of a sheet, with the rest normals of its corners; and how far it is \[m\].
pub(super) fn bind_to_triangle(
    model: &DeformableModel,
    nodes: [u32; 3],
    normals: &[Vec3],
    p: &Vec3,
    normal: &Vec3,
) -> (f64, Binding) {
    let corners @ [a, b, c] = nodes.map(|n| model.rest[n as usize]);
    let mut weights = nearest_weights(corners, p);
    let away = (p - (a * weights[0] + b * weights[1] + c * weights[2])).norm();
    let up = |weights: &[f64; 3]| {
        let sum = (0..3).fold(Vec3::zeros(), |sum, k| sum + normals[nodes[k] as usize] * weights[k]);
        sum.try_normalize(0.0).unwrap_or_default()
    };
    // The point is `Σ w X + h n(w)`: solved for w and h with n held, again and again.
    let mut height = 0.0;
    for _ in 0..FOOT_ROUNDS {
        let frame = Mat3::from_columns(&[b - a, c - a, up(&weights)]);
        let Some(inverse) = frame.try_inverse() else { break };
        let [v, w, h] = (inverse * (p - a)).into();
        (weights, height) = ([1.0 - v - w, v, w], h);
    }
    let up = up(&weights);
    let along = (b - a) - up * up.dot(&(b - a));
    let along = along.try_normalize(0.0).unwrap_or_default();
    let normal = normal.try_normalize(0.0).unwrap_or_default();
    let normal = Vec3::new(along.dot(&normal), up.cross(&along).dot(&normal), up.dot(&normal));
    let normal = singles(&normal.map(|c| if c.abs() < f64::from(f32::EPSILON) { 0.0 } else { c }));
    (away, Binding::Sheet { nodes, weights: weights.map(rounded), height: rounded(height), normal })
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
    let across = [rounded(u.dot(&away)), rounded(v.dot(&away))];
    let normal = singles(&Vec3::new(u.dot(normal), v.dot(normal), t.dot(normal)));
    // Caps of a tube stand out beyond its ends.
    let along = along + t.dot(&away) / way.norm();
    (away.norm(), Binding::Rod { nodes, segment, along: rounded(along), across, normal })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Nor is NaN made zero, which would hide it.
        #[test]
        fn products_of_two_are_never_subnormal(a in -60.0f64..3.0, b in -60.0f64..3.0, sign in prop::sample::select(vec![-1.0, 1.0])) {
            let (v, w) = (sign * 10f64.powf(a), 10f64.powf(b));
            let [v32, w32, nan] = single(&Vec3::new(v, w, f64::NAN)).to_array();
            prop_assert!(!(v32 * w32).is_subnormal() && nan.is_nan());
            prop_assert!((f64::from(v32) - v).abs() <= 1e-7 * v.abs() + ROUNDING);
        }
    }
}
