//! Holes, and what fills them.

use super::SurfaceMesh;
use rapier3d::math::Vector;
use std::collections::BTreeMap;

/// Loops of edges with one triangle, each in the direction in which a triangle that fills it would pass.
pub(super) fn loops(mesh: &SurfaceMesh) -> Vec<Vec<u32>> {
    let mut ways: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ([low, high], uses) in mesh.edges() {
        if uses.triangles.len() == 1 {
            let [from, to] = if uses.forward == 1 { [high, low] } else { [low, high] };
            ways.entry(from).or_default().push(to);
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = ways.iter().find(|(_, to)| !to.is_empty()) {
        let mut path = vec![start];
        let mut at = start;
        while let Some(to) = ways.get_mut(&at).and_then(Vec::pop) {
            // Where a path meets itself a loop is done: holes that touch at a vertex are several.
            if let Some(begin) = path.iter().position(|v| *v == to) {
                loops.push(path.split_off(begin));
            }
            path.push(to);
            at = to;
        }
    }
    loops
}

/// Fills holes of up to `most` edges, each by a fan around the middle of its edge; of three edges by one triangle. How many.
pub(super) fn fill_holes(mesh: &mut SurfaceMesh, most: usize) -> usize {
    let mut filled = 0;
    for hole in loops(mesh) {
        if hole.len() < 3 || hole.len() > most {
            continue;
        }
        filled += 1;
        if let [a, b, c] = hole[..] {
            mesh.triangles.push([a, b, c]);
            continue;
        }
        let at = |v: &u32| mesh.vertices[*v as usize];
        let middle = hole.iter().map(at).sum::<Vector>() / hole.len() as f32;
        let centre = mesh.vertices.len() as u32;
        mesh.vertices.push(middle);
        for (k, from) in hole.iter().enumerate() {
            mesh.triangles.push([*from, hole[(k + 1) % hole.len()], centre]);
        }
    }
    filled
}
