//! Twist of round rods. Their frames turn about the rod without inertia, so that twist is alike all along, and one angle tells it: between
//! a director that goes along the rod, turned at each vertex the shortest way (Bishop's frame), and that of the other end
//! [Bergou et al. 2008].

use super::model::DeformableModel;
use crate::material::DeformableMaterial;
use crate::math::{Mat3, Vec3, skew};
use std::f64::consts::{PI, TAU};

/// A cosine above −1 by less is of an edge that goes straight back: the angle jumps there, and its slope is bounded by this.
const REVERSED: f64 = 1.0e-9;

/// `v` after the shortest turn from one direction to another: from sines and cosines, as angles lose half of the digits.
fn carried(v: &Vec3, from: &Vec3, to: &Vec3) -> Vec3 {
    let (cosine, axis) = (from.dot(to), from.cross(to));
    v * cosine + axis.cross(v) + axis * (axis.dot(v) / (1.0 + cosine).max(REVERSED))
}

/// What an end of a rod is held by: the direction that the rod has where it is held, and a unit vector across.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct EndFrame {
    pub tangent: Vec3,
    pub director: Vec3,
}

impl EndFrame {
    /// How the angle of a rod grows with a turn of the frame that holds its last end, where the rod's end points along `segment`: as about both,
    /// where they differ [–].
    pub fn axis_of_torque(&self, segment: &Vec3) -> Vec3 {
        (self.tangent + segment) / (1.0 + self.tangent.dot(segment)).max(REVERSED)
    }

    /// The same, seen through `turn`.
    pub fn map(&self, turn: impl Fn(&Vec3) -> Vec3) -> Self {
        Self { tangent: turn(&self.tangent), director: turn(&self.director) }
    }
}

/// A rod within its body: nodes along it, and what its two ends are held by. A ring, whose last node is its first, is held by itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwistedRod<'a> {
    pub nodes: &'a [u32],
    pub frames: &'a [EndFrame; 2],
}

impl TwistedRod<'_> {
    /// Whether it is held by itself: nothing outside of it turns it.
    pub fn is_ring(&self) -> bool {
        self.nodes.first() == self.nodes.last()
    }

    /// Length \[m\] and direction of a segment; of one without length any.
    fn segment(&self, k: usize, x: &[Vec3]) -> (f64, Vec3) {
        let along = x[self.nodes[k + 1] as usize] - x[self.nodes[k] as usize];
        (along.norm(), along.try_normalize(0.0).unwrap_or(self.frames[0].tangent))
    }

    /// Calls `f` at every turn of the rod, from its first frame to its last, with the segments before and after it, if there are such, and
    /// their directions.
    fn for_each_turn(&self, x: &[Vec3], mut f: impl FnMut([Option<usize>; 2], [Vec3; 2])) {
        let segments = self.nodes.len() - 1;
        let first = if self.is_ring() { segments - 1 } else { 0 };
        let mut from = if self.is_ring() { self.segment(first, x).1 } else { self.frames[0].tangent };
        for k in 0..segments {
            let to = self.segment(k, x).1;
            let before = if self.is_ring() { Some((k + first) % segments) } else { k.checked_sub(1) };
            f([before, Some(k)], [from, to]);
            from = to;
        }
        if !self.is_ring() {
            f([Some(segments - 1), None], [from, self.frames[1].tangent]);
        }
    }

    /// How far the last director is turned about the rod against the first, where nodes are at `x`: the angle \[rad\] that is nearest to `near`.
    pub fn angle(&self, x: &[Vec3], near: f64) -> f64 {
        let start = match self.is_ring() {
            true => EndFrame::across(self.segment(self.nodes.len() - 2, x).1),
            false => self.frames[0],
        };
        let end = if self.is_ring() { start } else { self.frames[1] };
        let mut director = start.director;
        self.for_each_turn(x, |_, [from, to]| director = carried(&director, &from, &to));
        let (sine, cosine) = (director.cross(&end.director).dot(&end.tangent), director.dot(&end.director));
        let angle = sine.atan2(cosine);
        angle + TAU * ((near - angle) / TAU).round()
    }

    /// Adds `scale` times the derivative of the angle by the nodes' positions [1/m].
    pub fn add_gradient(&self, x: &[Vec3], scale: f64, out: &mut [Vec3]) {
        self.for_each_turn(x, |segments, [from, to]| {
            // Half of the curvature binormal.
            let bend = from.cross(&to) / (1.0 + from.dot(&to)).max(REVERSED);
            for k in segments.into_iter().flatten() {
                let length = self.segment(k, x).0;
                if length > 0.0 {
                    let by = bend * (scale / length);
                    out[self.nodes[k + 1] as usize] += by;
                    out[self.nodes[k] as usize] -= by;
                }
            }
        });
    }
}

impl TwistedRod<'_> {
    /// Calls `f` with parts of the second derivative of the angle by the positions of two nodes [1/m²], the larger first. They add up to a
    /// symmetric matrix; no part has to be.
    pub fn second_derivatives(&self, x: &[Vec3], mut f: impl FnMut(usize, usize, Mat3)) {
        self.for_each_turn(x, |segments, directions| {
            let [from, to] = directions;
            let share = 1.0 / (1.0 + from.dot(&to)).max(REVERSED);
            let bend = from.cross(&to) * share;
            // Of the bend by the directions before and after.
            let of = [
                (-skew(&to) - bend * to.transpose()) * share,
                (skew(&from) - bend * from.transpose()) * share,
            ];
            let lengths = segments.map(|segment| segment.map(|k| self.segment(k, x).0).filter(|l| *l > 0.0));
            for (place, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (Some(k), Some(length)) = (segments[place], lengths[place]) else { continue };
                let (Some(a), Some(other_length)) = (segments[other], lengths[other]) else { continue };
                let t = directions[other];
                let across = Mat3::identity() - t * t.transpose();
                let mut block = of[other] * across / (length * other_length);
                if place == other {
                    block -= bend * t.transpose() / (length * length);
                }
                for (i, one) in [(self.nodes[k], -1.0), (self.nodes[k + 1], 1.0)] {
                    for (j, two) in [(self.nodes[a], -1.0), (self.nodes[a + 1], 1.0)] {
                        if i >= j {
                            f(i as usize, j as usize, block * (one * two));
                        }
                    }
                }
            }
        });
    }
}

impl EndFrame {
    /// One of this direction, its director anywhere across.
    pub fn across(tangent: Vec3) -> Self {
        Self { tangent, director: crate::math::tangents(&tangent)[0] }
    }
}

impl DeformableModel {
    /// Nodes along a rod.
    pub(crate) fn rod(&self, rod: usize) -> &[u32] {
        &self.rods[rod]
    }

    /// Directions of the first and the last segment of a rod where the nodes are at `x`.
    pub(crate) fn end_directions(&self, rod: usize, x: &[Vec3]) -> [Vec3; 2] {
        let nodes = self.rod(rod);
        let lying = TwistedRod { nodes, frames: &[EndFrame::across(Vec3::x()); 2] };
        [0, nodes.len() - 2].map(|k| lying.segment(k, x).1)
    }

    /// Frames that hold the ends of a rod as it lies at `x`, without twist.
    pub(crate) fn end_frames(&self, rod: usize, x: &[Vec3]) -> [EndFrame; 2] {
        let nodes = self.rod(rod);
        let mut frames = self.end_directions(rod, x).map(EndFrame::across);
        let mut director = frames[0].director;
        TwistedRod { nodes, frames: &frames }
            .for_each_turn(x, |_, [from, to]| director = carried(&director, &from, &to));
        frames[1].director = director;
        frames
    }

    /// Torque per twist of a whole rod [N·m/rad], `1/Σ l/GJ` with `J = π r⁴/2`.
    pub(crate) fn torsional_stiffness(&self, rod: usize, materials: &[DeformableMaterial]) -> f64 {
        1.0 / self.torsional_compliances(rod, materials).map(|(_, compliance)| compliance).sum::<f64>()
    }

    /// Of each segment of a rod its region and what it gives way by, `l/GJ` [rad/(N·m)].
    pub(crate) fn torsional_compliances<'a>(
        &'a self,
        rod: usize,
        materials: &'a [DeformableMaterial],
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let (nodes, rod) = (self.rod(rod), self.structure.rod_at(rod));
        let polar = 0.5 * PI * rod.radius.powi(4);
        nodes.windows(2).zip(&rod.regions).map(move |(ends, tag)| {
            let region = self.region(*tag).unwrap_or(0);
            let material = &materials[region];
            let shear = 0.5 * material.youngs_modulus / (1.0 + material.poisson_ratio);
            let length = (self.rest[ends[1] as usize] - self.rest[ends[0] as usize]).norm();
            (region, length / (shear * polar))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Structure;
    use proptest::prelude::*;
    use std::ops::AddAssign;

    fn rod(points: &[Vec3]) -> DeformableModel {
        let points: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
        DeformableModel::from_structure(&Structure::rod(&points, 0.01).unwrap()).unwrap()
    }

    fn ring(points: &[Vec3]) -> DeformableModel {
        let points: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
        DeformableModel::from_structure(&Structure::ring(&points, 0.01).unwrap()).unwrap()
    }

    /// `x` by node.
    fn by_node(model: &DeformableModel, x: &[Vec3]) -> Vec<Vec3> {
        model.vertex_of_node.iter().map(|&v| x[v as usize]).collect()
    }

    /// Writhe of a closed polygon by the solid angles of its pairs of segments [Klenin & Langowski 2000].
    fn writhe(x: &[Vec3]) -> f64 {
        let n = x.len();
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..i {
                let [a, b, c, d] = [x[i], x[(i + 1) % n], x[j], x[(j + 1) % n]];
                let [ac, ad, bc, bd] = [c - a, d - a, c - b, d - b];
                let sides = [ac.cross(&ad), ad.cross(&bd), bd.cross(&bc), bc.cross(&ac)];
                let Some(sides) =
                    sides.map(|s| s.try_normalize(1e-14)).into_iter().collect::<Option<Vec<_>>>()
                else {
                    continue;
                };
                let angle = |k: usize| sides[k].dot(&sides[(k + 1) % 4]).clamp(-1.0, 1.0).asin();
                let area: f64 = (0..4).map(angle).sum();
                sum += area * (d - c).cross(&(b - a)).dot(&ac).signum();
            }
        }
        sum / TAU
    }

    fn is_long(points: &[Vec3]) -> bool {
        (0..points.len()).all(|k| (points[(k + 1) % points.len()] - points[k]).norm() > 0.1)
    }

    fn points(numbers: &[f64]) -> Vec<Vec3> {
        numbers.chunks(3).map(Vec3::from_column_slice).collect()
    }

    proptest! {
        #[test]
        fn gradients_are_the_slope_of_the_angle_and_have_no_resultant(
            numbers in proptest::collection::vec(-1.0..1.0f64, 18), moved in proptest::collection::vec(-0.2..0.2f64, 18),
            along in proptest::collection::vec(-1.0..1.0f64, 18), closes in any::<bool>(),
        ) {
            let (at, by) = (points(&numbers), points(&along));
            prop_assume!(is_long(&at));
            let model = if closes { ring(&at) } else { rod(&at) };
            let frames = model.end_frames(0, &model.rest);
            let twisted = TwistedRod { nodes: model.rod(0), frames: &frames };
            let x: Vec<Vec3> = at.iter().zip(points(&moved)).map(|(x, d)| x + d).collect();
            let place = |t: f64| by_node(&model, &x.iter().zip(&by).map(|(x, d)| x + d * t).collect::<Vec<_>>());
            let mut is_sharp = false;
            twisted.for_each_turn(&place(0.0), |_, [from, to]| is_sharp |= from.dot(&to) < -0.9);
            let longest = (0..twisted.nodes.len() - 1).map(|k| twisted.segment(k, &place(0.0)).0).fold(f64::INFINITY, f64::min);
            prop_assume!(!is_sharp && longest > 0.1);
            let mut gradient = vec![Vec3::zeros(); x.len()];
            twisted.add_gradient(&place(0.0), 1.0, &mut gradient);
            let now = twisted.angle(&place(0.0), 0.0);
            let slope = (twisted.angle(&place(1e-6), now) - twisted.angle(&place(-1e-6), now)) / 2e-6;
            let directions = by_node(&model, &by);
            let wanted: f64 = gradient.iter().zip(&directions).map(|(g, d)| g.dot(d)).sum();
            // Central differences: 1e-12 of third derivatives up to 1e4, 1e-15/1e-6 of rounding.
            prop_assert!((slope - wanted).abs() < 1e-6 * (1.0 + wanted.abs()), "{slope} {wanted}");
            let mut second = nalgebra::DMatrix::<f64>::zeros(3 * x.len(), 3 * x.len());
            twisted.second_derivatives(&place(0.0), |i, j, block| {
                second.view_mut((3 * i, 3 * j), (3, 3)).add_assign(&block);
            });
            let lower = nalgebra::DMatrix::from_fn(3 * x.len(), 3 * x.len(), |r, c| second[(r.max(c), r.min(c))]);
            let of_gradient = |t: f64| {
                let mut gradient = vec![Vec3::zeros(); x.len()];
                twisted.add_gradient(&place(t), 1.0, &mut gradient);
                nalgebra::DVector::from_iterator(3 * x.len(), gradient.iter().flat_map(|g| [g.x, g.y, g.z]))
            };
            let slope = (of_gradient(1e-6) - of_gradient(-1e-6)) / 2e-6;
            let along = nalgebra::DVector::from_iterator(3 * x.len(), directions.iter().flat_map(|d| [d.x, d.y, d.z]));
            let wanted = lower * along;
            prop_assert!((&slope - &wanted).amax() < 1e-5 * (1.0 + wanted.amax()), "{slope} {wanted}");
            let force: Vec3 = gradient.iter().sum();
            prop_assert!(force.norm() < 1e-10, "{force}");
            if closes {
                let moment: Vec3 = place(0.0).iter().zip(&gradient).map(|(x, g)| x.cross(g)).sum();
                prop_assert!(moment.norm() < 1e-9, "{moment}");
            }
        }

        /// Călugăreanu, White and Fuller: linking number is twist and writhe. What goes around a ring comes back turned by
        /// −2π times its writhe.
        #[test]
        fn rings_are_turned_by_their_writhe(numbers in proptest::collection::vec(-1.0..1.0f64, 30)) {
            let at = points(&numbers);
            prop_assume!(is_long(&at));
            let model = ring(&at);
            let frames = model.end_frames(0, &model.rest);
            let twisted = TwistedRod { nodes: model.rod(0), frames: &frames };
            // What goes straight back is turned either way.
            let mut is_sharp = false;
            twisted.for_each_turn(&model.rest, |_, [from, to]| is_sharp |= from.dot(&to) < -0.999);
            prop_assume!(!is_sharp);
            let angle = twisted.angle(&model.rest, 0.0);
            let off = (angle / TAU + writhe(&at)).rem_euclid(1.0);
            prop_assert!(off.min(1.0 - off) < 1e-9, "{angle} {}", writhe(&at));
        }
    }

    #[test]
    fn rods_are_held_without_twist_and_turn_with_their_ends() {
        let helix = |k: u32| {
            let t = 0.3 * f64::from(k);
            Vec3::new(t.cos(), t.sin(), 0.2 * t)
        };
        let model = rod(&(0..40).map(helix).collect::<Vec<_>>());
        let frames = model.end_frames(0, &model.rest);
        let nodes = model.rod(0);
        let angle = |frames: &[EndFrame; 2], near| TwistedRod { nodes, frames }.angle(&model.rest, near);
        assert!(angle(&frames, 0.0).abs() < 1e-12);
        let mut turned = frames;
        let by = crate::math::rotation_from_vector(&(frames[1].tangent * 0.7));
        turned[1].director = by * turned[1].director;
        // Right-handed about the rod, by the whole turns that are nearest.
        assert!((angle(&turned, 0.0) - 0.7).abs() < 1e-12);
        assert!((angle(&turned, 4.0 * TAU) - 0.7 - 4.0 * TAU).abs() < 1e-12);
        turned[0].director =
            crate::math::rotation_from_vector(&(frames[0].tangent * 0.7)) * turned[0].director;
        assert!(angle(&turned, 0.0).abs() < 1e-12);
        let material = DeformableMaterial::new(3.0e6, 0.5 - 1e-9);
        let length: f64 =
            nodes.windows(2).map(|e| (model.rest[e[1] as usize] - model.rest[e[0] as usize]).norm()).sum();
        let wanted = 1.0e6 * 0.5 * PI * 1e-8 / length;
        assert!((model.torsional_stiffness(0, &[material]) / wanted - 1.0).abs() < 1e-8);
    }
}
