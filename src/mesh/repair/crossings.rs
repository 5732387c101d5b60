//! Triangles that cross others of the same surface.

use super::SurfaceMesh;
use crate::math::{Vec3, from_real};
use parry3d::bounding_volume::Aabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

/// Pairs of triangles without a common vertex that cross, and the first point where they do \[m\]; at most `most`.
pub(super) fn crossings(mesh: &SurfaceMesh, most: usize) -> Vec<([u32; 2], Vec3)> {
    let corners: Vec<[Vec3; 3]> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| mesh.vertices.get(v as usize).map_or(Vec3::repeat(f64::NAN), |v| from_real(*v))))
        .collect();
    let finite = |t: &[Vec3; 3]| t.iter().all(|p| p.iter().all(|c| c.is_finite()));
    let bounds = |t: &[u32; 3]| Aabb::from_points(t.iter().map(|v| mesh.vertices[*v as usize]));
    let sound: Vec<u32> = (0..corners.len() as u32).filter(|t| finite(&corners[*t as usize])).collect();
    let boxes: Vec<Aabb> = sound.iter().map(|t| bounds(&mesh.triangles[*t as usize])).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let mut found = Vec::new();
    for (i, own) in sound.iter().zip(&boxes) {
        for other in tree.intersect_aabb(own) {
            let j = sound[other as usize];
            let (t, u) = (&mesh.triangles[*i as usize], &mesh.triangles[j as usize]);
            if j <= *i || t.iter().any(|v| u.contains(v)) {
                continue;
            }
            if let Some(at) = crossing(&corners[*i as usize], &corners[j as usize]) {
                found.push(([*i, j], at));
                if found.len() >= most {
                    return found;
                }
            }
        }
    }
    found
}

/// Where an edge of one of two triangles goes through the other.
fn crossing(t: &[Vec3; 3], u: &[Vec3; 3]) -> Option<Vec3> {
    let through = |[a, b, c]: &[Vec3; 3], other: &[Vec3; 3]| {
        [[a, b], [b, c], [c, a]].into_iter().find_map(|[p, q]| hit(p, q, other))
    };
    through(t, u).or_else(|| through(u, t))
}

/// Where a segment goes from one side of a triangle to the other, strictly.
fn hit(p: &Vec3, q: &Vec3, [a, b, c]: &[Vec3; 3]) -> Option<Vec3> {
    let normal = (b - a).cross(&(c - a));
    let [before, after] = [p, q].map(|x| normal.dot(&(x - a)));
    if !(before * after < 0.0) {
        return None;
    }
    let at = p + (q - p) * (before / (before - after));
    let inside = [[a, b], [b, c], [c, a]].iter().all(|[e, f]| (*f - *e).cross(&(at - *e)).dot(&normal) > 0.0);
    inside.then_some(at)
}
