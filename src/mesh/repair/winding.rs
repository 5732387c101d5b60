//! Generalized winding numbers [Jacobson Kavan Sorkine-Hornung 2013]: the solid angle of all triangles as a point sees them, over
//! 4π. One in what they enclose, nought outside; in between near holes. Far triangles count as the sum of their area vectors
//! in one place, as in [Barill Dickson Schmidt Levin Jacobson 2018].

use crate::math::{Vec3, solid_angle};
use std::f64::consts::PI;

/// Radii of a group of triangles from its middle beyond which it counts as one dipole. Within it winding numbers are right to 0.02.
const FAR: f64 = 3.0;
/// Triangles of a group that is not divided further.
const LEAF: usize = 8;

pub(super) struct Winding {
    nodes: Vec<Node>,
    /// In the order of the leaves.
    triangles: Vec<[Vec3; 3]>,
}

struct Node {
    middle: Vec3,
    radius: f64,
    /// Sum of areas times normals \[m²\].
    dipole: Vec3,
    /// Triangles of it.
    first: usize,
    end: usize,
    /// Its halves; none of a leaf.
    halves: Option<[usize; 2]>,
}

impl Winding {
    pub fn new(mut triangles: Vec<[Vec3; 3]>) -> Self {
        let mut nodes = Vec::new();
        let end = triangles.len();
        divide(&mut triangles, 0, end, &mut nodes);
        Self { nodes, triangles }
    }

    /// At a point.
    pub fn at(&self, x: &Vec3) -> f64 {
        // Halves of halves: the tree is balanced, and no deeper than the number of bits of an index.
        let mut open = vec![0];
        let mut sum = 0.0;
        while let Some(node) = open.pop().and_then(|n: usize| self.nodes.get(n)) {
            let way = node.middle - x;
            let distance = way.norm();
            match node.halves {
                _ if distance > FAR * node.radius && distance > 0.0 => {
                    sum += node.dipole.dot(&way) / (distance * distance * distance);
                }
                Some(halves) => open.extend(halves),
                None => {
                    sum += self.triangles[node.first..node.end].iter().map(|t| solid_angle(t, x)).sum::<f64>()
                }
            }
        }
        sum / (4.0 * PI)
    }
}

/// Makes a node of a range of triangles, and those below it. Its index.
fn divide(triangles: &mut [[Vec3; 3]], first: usize, end: usize, nodes: &mut Vec<Node>) -> usize {
    let own = &mut triangles[first..end];
    let area = |[a, b, c]: &[Vec3; 3]| (b - a).cross(&(c - a)) * 0.5;
    let middle = |t: &[Vec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
    let (mut dipole, mut sum, mut weight) = (Vec3::zeros(), Vec3::zeros(), f64::MIN_POSITIVE);
    for triangle in own.iter() {
        let vector = area(triangle);
        dipole += vector;
        sum += middle(triangle) * vector.norm();
        weight += vector.norm();
    }
    let centre = sum / weight;
    let radius = own.iter().flatten().map(|p| (p - centre).norm()).fold(0.0, f64::max);
    let index = nodes.len();
    nodes.push(Node { middle: centre, radius, dipole, first, end, halves: None });
    if end - first > LEAF {
        let start = own.first().map_or_else(Vec3::zeros, middle);
        let (low, high) =
            own.iter().map(middle).fold((start, start), |(low, high), p| (low.inf(&p), high.sup(&p)));
        let axis = (high - low).imax();
        let half = own.len() / 2;
        own.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let halves =
            [divide(triangles, first, first + half, nodes), divide(triangles, first + half, end, nodes)];
        nodes[index].halves = Some(halves);
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::from_real;
    use parry3d::shape::Ball;

    /// Against the sum over all triangles, for a ball that lacks a third of them.
    #[test]
    fn groups_of_triangles_count_as_their_sum_does() {
        let (vertices, triangles) = Ball::new(1.0).to_trimesh(24, 16);
        let triangles = triangles.iter().enumerate().filter(|(k, _)| k % 3 > 0);
        let triangles: Vec<[Vec3; 3]> =
            triangles.map(|(_, t)| t.map(|v| from_real(vertices[v as usize]))).collect();
        let winding = Winding::new(triangles.clone());
        for k in 0..500 {
            let of = |step: f64| (f64::from(k) * step).fract() * 3.0 - 1.5;
            let x = Vec3::new(of(0.618034), of(0.754878), of(0.569840));
            let sum: f64 = triangles.iter().map(|t| solid_angle(t, &x)).sum::<f64>() / (4.0 * PI);
            assert!((winding.at(&x) - sum).abs() < 0.02, "{x:?}: {} {sum}", winding.at(&x));
        }
        assert!(winding.at(&Vec3::new(9.0, 0.0, 0.0)).abs() < 0.01);
    }
}
