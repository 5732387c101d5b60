//! Creases of a triangle surface: smooth patches, the curves between them, and corners where curves meet.

use crate::math::{Vec3, from_real, to_real};
use parry3d::shape::{CompositeShapeRef, Polyline, TriMesh};
use std::collections::{BTreeMap, BTreeSet};

/// Cosine of the angle between the normals of two triangles beyond which their edge is a crease: 30°, twice that
/// between facets of a circle of 24.
const CREASE: f64 = 0.866;
/// Cosine of the angle by which a crease turns at a corner between two patches: 45°.
const TURN: f64 = 0.707;

/// Two patches, the lower first.
pub(super) type Pair = [u32; 2];

/// Where a triangle surface turns sharply.
pub(super) struct Creases {
    /// Of each triangle.
    patch: Vec<u32>,
    curves: BTreeMap<Pair, Polyline>,
    /// Where curves end, meet or turn, and the patches there.
    pub corners: Vec<(Vec3, Vec<u32>)>,
}

impl Creases {
    /// Those of closed triangles. Vertices at the same place are one.
    pub fn of(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let triangles = merged(vertices, triangles);
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            (b - a).cross(&(c - a)).normalize()
        };
        let normals: Vec<Vec3> = triangles.iter().map(normal).collect();
        let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (t, &[a, b, c]) in triangles.iter().enumerate() {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                sides.entry([p.min(q), p.max(q)]).or_default().push(t);
            }
        }
        // Needles have no direction to speak of: they crease nothing.
        let is_smooth = |sides: &[usize]| match sides {
            &[s, t] => {
                let cosine = normals[s].dot(&normals[t]);
                !(cosine < CREASE)
            }
            _ => false,
        };
        let mut patch: Vec<u32> = (0..triangles.len() as u32).collect();
        for sides in sides.values().filter(|s| is_smooth(s)) {
            let (a, b) = (root(&mut patch, sides[0]), root(&mut patch, sides[1]));
            patch[a.max(b)] = a.min(b) as u32;
        }
        (0..patch.len()).for_each(|t| patch[t] = root(&mut patch, t) as u32);
        let mut edges: BTreeMap<Pair, Vec<[u32; 2]>> = BTreeMap::new();
        for (edge, sides) in &sides {
            let patches: BTreeSet<u32> = sides.iter().map(|&t| patch[t]).collect();
            if let [p, q] = patches.into_iter().collect::<Vec<_>>()[..] {
                edges.entry([p, q]).or_default().push(*edge);
            }
        }
        let corners = corners_of(&edges, vertices);
        let curves = edges.iter().map(|(pair, edges)| (*pair, curve(edges, vertices))).collect();
        Self { patch, curves, corners }
    }

    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.curves.is_empty()
    }

    /// The patch nearest to a point.
    pub fn patch_at(&self, mesh: &TriMesh, x: &Vec3) -> u32 {
        let nearest = CompositeShapeRef(mesh).project_local_point(to_real(x), f32::MAX, false);
        self.patch[nearest.map_or(0, |(triangle, _)| triangle as usize)]
    }

    /// The nearest point on the curve between two patches, if they have one.
    pub fn nearest_on(&self, pair: &Pair, x: &Vec3) -> Option<Vec3> {
        let curve = CompositeShapeRef(self.curves.get(pair)?);
        Some(from_real(curve.project_local_point(to_real(x), f32::MAX, false)?.1.point))
    }
}

fn curve(edges: &[[u32; 2]], vertices: &[Vec3]) -> Polyline {
    let ends: Vec<_> = edges.iter().flatten().map(|v| to_real(&vertices[*v as usize])).collect();
    let segments = (0..edges.len() as u32).map(|k| [2 * k, 2 * k + 1]).collect();
    Polyline::new(ends, Some(segments))
}

/// Triangles with one index for each place.
pub(super) fn merged(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut first: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    // Adding zero makes -0 equal to 0.
    let key = |v: &Vec3| [v.x, v.y, v.z].map(|c| (c + 0.0).to_bits());
    let name: Vec<u32> =
        vertices.iter().enumerate().map(|(k, v)| *first.entry(key(v)).or_insert(k as u32)).collect();
    triangles.iter().map(|t| t.map(|v| name[v as usize])).collect()
}

/// The representative of a union of triangles.
fn root(patch: &mut [u32], mut t: usize) -> usize {
    while patch[t] as usize != t {
        patch[t] = patch[patch[t] as usize];
        t = patch[t] as usize;
    }
    t
}

/// Vertices where other than two edges of creases meet, or two at an angle, or edges between different patches.
fn corners_of(edges: &BTreeMap<Pair, Vec<[u32; 2]>>, vertices: &[Vec3]) -> Vec<(Vec3, Vec<u32>)> {
    let mut at: BTreeMap<u32, Vec<(Pair, u32)>> = BTreeMap::new();
    for (pair, edges) in edges {
        for &[a, b] in edges {
            at.entry(a).or_default().push((*pair, b));
            at.entry(b).or_default().push((*pair, a));
        }
    }
    let is_corner = |v: u32, ends: &[(Pair, u32)]| match ends {
        &[(p, a), (q, b)] => {
            let to = |w: u32| (vertices[w as usize] - vertices[v as usize]).normalize();
            p != q || to(a).dot(&to(b)) > -TURN
        }
        _ => true,
    };
    let patches = |ends: &[(Pair, u32)]| {
        let all: BTreeSet<u32> = ends.iter().flat_map(|(pair, _)| *pair).collect();
        all.into_iter().collect()
    };
    at.iter()
        .filter(|(v, ends)| is_corner(**v, ends))
        .map(|(v, ends)| (vertices[*v as usize], patches(ends)))
        .collect()
}
