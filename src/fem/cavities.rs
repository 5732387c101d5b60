//! Closed rooms of a body: hollows within its tetrahedra, and what its sheets close in.

use crate::math::{Mat3, Vec3, skew, solid_angle};
use crate::mesh::{NONE, Surface};
use std::collections::HashMap;

/// A closed room of a body's rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeformableCavity {
    /// \[m³\]
    pub volume: f64,
    /// Mean of its walls' vertices \[m\]; with several rooms, to tell which is which.
    pub centre: [f64; 3],
    /// Area of its walls \[m²\].
    pub area: f64,
}

/// A room and the triangles around it.
#[derive(Clone, Debug)]
pub(crate) struct Cavity {
    /// Nodes, wound so that normals point out of the room.
    pub triangles: Vec<[u32; 3]>,
    /// Volume at rest \[m³\].
    pub rest_volume: f64,
}

impl Cavity {
    /// What is told of it.
    pub fn describe(&self, rest: &[Vec3]) -> DeformableCavity {
        let corners = self.triangles.iter().map(|t| t.map(|n| rest[n as usize]));
        let mut nodes: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let centre = nodes.iter().map(|&n| rest[n as usize]).sum::<Vec3>() / nodes.len().max(1) as f64;
        let area = corners.map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
        DeformableCavity { volume: self.rest_volume, centre: centre.into(), area }
    }

    /// Volume \[m³\] where nodes are at `x`.
    pub fn volume(&self, x: &[Vec3]) -> f64 {
        volume(&self.triangles, x)
    }

    /// Whether a place is within the room at rest: its walls cover the whole sphere of directions there.
    pub fn holds(&self, place: &Vec3, rest: &[Vec3]) -> bool {
        let angle = |nodes: &[u32; 3]| solid_angle(&nodes.map(|n| rest[n as usize]), place);
        self.triangles.iter().map(angle).sum::<f64>() > 2.0 * std::f64::consts::PI
    }

    /// Adds `scale` times the derivative of the volume by the nodes' positions, \[m²\]: areas along normals, which sum to nothing.
    pub fn add_gradient(&self, x: &[Vec3], scale: f64, out: &mut [Vec3]) {
        let origin = self.triangles.first().map_or(Vec3::zeros(), |t| x[t[0] as usize]);
        for nodes in &self.triangles {
            let [a, b, c] = nodes.map(|n| x[n as usize] - origin);
            for (n, by) in nodes.iter().zip([b.cross(&c), c.cross(&a), a.cross(&b)]) {
                out[*n as usize] += by * (scale / 6.0);
            }
        }
    }

    /// Calls `f` with the second derivative of the volume by the positions of two nodes \[m\], the larger first, for every edge of the
    /// walls twice, from either side.
    pub fn second_derivatives(&self, x: &[Vec3], mut f: impl FnMut(usize, usize, Mat3)) {
        let origin = self.triangles.first().map_or(Vec3::zeros(), |t| x[t[0] as usize]);
        for nodes in &self.triangles {
            let [a, b, c] = nodes.map(|n| n as usize);
            for (from, to, across) in [(a, b, c), (b, c, a), (c, a, b)] {
                // Skew: what it is the other way round, it is transposed.
                let sign = if from > to { -6.0 } else { 6.0 };
                f(from.max(to), from.min(to), skew(&(x[across] - origin)) / sign);
            }
        }
    }
}

/// Signed volume within triangles \[m³\], from one of their corners: coordinates far from zero lose nothing.
fn volume(triangles: &[[u32; 3]], x: &[Vec3]) -> f64 {
    let Some(first) = triangles.first() else { return 0.0 };
    let origin = x[first[0] as usize];
    let of = |nodes: &[u32; 3]| {
        let [a, b, c] = nodes.map(|n| x[n as usize] - origin);
        a.dot(&b.cross(&c))
    };
    triangles.iter().map(of).sum::<f64>() / 6.0
}

/// The rooms of a surface, the largest first. Of tetrahedra those that lie within them, not their outside; of sheets all that is
/// closed and wound one way.
pub(crate) fn cavities(surface: &Surface, rest: &[Vec3]) -> Vec<Cavity> {
    let mut found = Vec::new();
    for part in connected(surface) {
        let is_solid = (part[0] as usize) < surface.closed;
        let mut triangles: Vec<[u32; 3]> = part.iter().map(|&t| surface.triangles[t as usize]).collect();
        if !is_closed(&triangles) {
            continue;
        }
        let mut rest_volume = volume(&triangles, rest);
        // Around tetrahedra triangles look out of those: into a room.
        if is_solid && rest_volume >= 0.0 || rest_volume == 0.0 {
            continue;
        }
        if rest_volume < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            rest_volume = -rest_volume;
        }
        found.push(Cavity { triangles, rest_volume });
    }
    found.sort_by(|a, b| b.rest_volume.total_cmp(&a.rest_volume));
    found
}

/// Triangles that hang together by edges, those of tetrahedra and those of sheets for themselves.
fn connected(surface: &Surface) -> Vec<Vec<u32>> {
    let mut is_seen = vec![false; surface.triangles.len()];
    let mut parts = Vec::new();
    for first in 0..surface.triangles.len() {
        if std::mem::replace(&mut is_seen[first], true) {
            continue;
        }
        let (mut part, mut next) = (vec![first as u32], 0);
        while next < part.len() {
            for edge in surface.triangle_edges[part[next] as usize] {
                for other in surface.edge_triangles[edge as usize] {
                    let is_same_kind = || ((other as usize) < surface.closed) == (first < surface.closed);
                    if other != NONE
                        && is_same_kind()
                        && !std::mem::replace(&mut is_seen[other as usize], true)
                    {
                        part.push(other);
                    }
                }
            }
            next += 1;
        }
        part.sort_unstable();
        parts.push(part);
    }
    parts
}

/// Whether every edge is gone along as often one way as the other.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut ways: HashMap<[u32; 2], i32> = HashMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let way = if from < to { 1 } else { -1 };
            *ways.entry([*from.min(to), *from.max(to)]).or_default() += way;
        }
    }
    ways.values().all(|sum| *sum == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::DeformableModel;
    use crate::mesh::{Structure, TetMesh};
    use std::ops::AddAssign;

    /// A lattice of 5 × 3 × 3 cells without some of them.
    fn hollow(without: &[[usize; 3]]) -> DeformableModel {
        let cell = |[x, y, z]: [f64; 3]| {
            [(x + 0.5) / 0.2, (y + 0.3) / 0.2, (z + 0.3) / 0.2].map(|c| c.floor() as usize)
        };
        let whole = TetMesh::cuboid([0.5, 0.3, 0.3], [5, 3, 3]).unwrap();
        DeformableModel::new(&whole.without(|middle| without.contains(&cell(middle))).unwrap())
    }

    #[test]
    fn rooms_are_found_and_outsides_are_none() {
        let volumes = |model: &DeformableModel| -> Vec<f64> {
            model.cavities.iter().map(|cavity| (cavity.rest_volume * 1e6).round() / 1e6).collect()
        };
        assert!(volumes(&hollow(&[])).is_empty());
        assert_eq!(volumes(&hollow(&[[1, 1, 1]])), [0.008]);
        assert_eq!(volumes(&hollow(&[[1, 1, 1], [3, 1, 1]])), [0.008, 0.008]);
        assert_eq!(volumes(&hollow(&[[1, 1, 1], [2, 1, 1]])), [0.016]);
        let two = hollow(&[[1, 1, 1], [3, 1, 1]]);
        let found = |x: f64| two.cavity_at([x, 0.03, -0.02]);
        let centres: Vec<f64> = two.cavities().map(|cavity| cavity.centre[0]).collect();
        for x in [-0.2, 0.2] {
            let expected = centres.iter().position(|c| (c - x).abs() < 1e-9);
            assert!(expected.is_some() && found(x) == expected, "{x}: {:?}", found(x));
        }
        // In a wall, and outside.
        assert_eq!((found(0.0), found(1.0), found(f64::NAN)), (None, None, None));
        // A mouth lets it out.
        assert!(volumes(&hollow(&[[1, 1, 1], [1, 2, 1]])).is_empty());
    }

    #[test]
    fn closed_sheets_are_rooms_whichever_way_they_are_wound() {
        let corners: Vec<[f64; 3]> = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let model = |faces: &[[u32; 3]]| {
            DeformableModel::from_structure(&Structure::sheet(corners.clone(), faces, 0.01).unwrap()).unwrap()
        };
        let inward = faces.map(|[a, b, c]| [a, c, b]);
        for wound in [&faces[..], &inward[..]] {
            assert!((model(wound).cavities[0].rest_volume - 1.0 / 6.0).abs() < 1e-12);
        }
        assert!(model(&faces[..3]).cavities.is_empty());
    }

    #[test]
    fn gradients_are_the_slope_of_the_volume_and_push_nothing_away() {
        let model = hollow(&[[1, 1, 1], [2, 1, 1]]);
        let cavity = &model.cavities[0];
        let x: Vec<Vec3> = (0..model.rest.len())
            .map(|i| {
                let shake = |k: usize| 0.02 * (((i * 7 + k * 13) % 11) as f64 - 5.0) / 5.0;
                model.rest[i] + Vec3::new(shake(1) + 50.0, shake(2), shake(3))
            })
            .collect();
        let mut gradient = vec![Vec3::zeros(); x.len()];
        cavity.add_gradient(&x, 1.0, &mut gradient);
        for i in 0..x.len() {
            for c in 0..3 {
                let moved = |by: f64| {
                    let mut y = x.clone();
                    y[i][c] += by;
                    cavity.volume(&y)
                };
                let slope = (moved(1e-4) - moved(-1e-4)) / 2e-4;
                // Linear in one coordinate: 1e-16 of 50 m times an area over the step.
                assert!((slope - gradient[i][c]).abs() < 1e-9, "{slope} {}", gradient[i][c]);
            }
        }
        // Of the gradient, by nodes in a row.
        let mut second = nalgebra::DMatrix::<f64>::zeros(3 * x.len(), 3 * x.len());
        cavity.second_derivatives(&x, |i, j, block| {
            second.view_mut((3 * i, 3 * j), (3, 3)).add_assign(&block);
            second.view_mut((3 * j, 3 * i), (3, 3)).add_assign(&block.transpose());
        });
        let at = |by: f64, node: usize, axis: usize| {
            let mut y = x.clone();
            y[node][axis] += by;
            let mut gradient = vec![Vec3::zeros(); y.len()];
            cavity.add_gradient(&y, 1.0, &mut gradient);
            gradient
        };
        for node in (0..x.len()).step_by(5) {
            for axis in 0..3 {
                let [ahead, behind] = [at(1e-3, node, axis), at(-1e-3, node, axis)];
                for (k, (a, b)) in ahead.iter().zip(&behind).enumerate() {
                    let column = second.fixed_view::<3, 1>(3 * k, 3 * node + axis);
                    // Linear again: rounding over the step.
                    assert!(((a - b) / 2e-3 - column).norm() < 1e-10, "{k} {node}");
                }
            }
        }
        let force: Vec3 = gradient.iter().sum();
        let moment: Vec3 = x.iter().zip(&gradient).map(|(x, g)| x.cross(g)).sum();
        assert!(force.norm() < 1e-12 && moment.norm() < 1e-10, "{force} {moment}");
    }
}
