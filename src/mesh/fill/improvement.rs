//! Vertices of bad tetrahedra moved to where the worst of them is best.

use super::domain::Domain;
use super::draft::{Draft, Home};
use crate::math::Vec3;

/// Tetrahedra below this quality are worked on: 15° at least then. With 0.45 a cone of six cells takes 270 ms, not 40,
/// and keeps 16°.
const GOOD: f64 = 0.35;
/// What a move has to gain.
const GAIN: f64 = 1.0e-4;
/// A place that is worse by this before it is projected onto the surface is not projected: that is what takes time.
const PROJECTED: f64 = 0.05;
/// Passes at the most.
const PASSES: usize = 6;
/// Steps of the search, in cubes.
const STEPS: [f64; 4] = [0.2, 0.1, 0.05, 0.02];

/// Moves vertices where they belong until no tetrahedron is bad, or none gets better.
pub(super) fn improve(draft: &mut Draft, domain: &Domain, cube: f64) {
    for _ in 0..PASSES {
        let mut vertices: Vec<u32> = Vec::new();
        for tet in &draft.tetrahedra {
            if draft.quality(tet) < GOOD {
                vertices.extend(tet);
            }
        }
        vertices.sort_unstable();
        vertices.dedup();
        let mut any = false;
        for vertex in vertices {
            any |= improve_vertex(draft, domain, vertex as usize, cube);
        }
        if !any {
            return;
        }
    }
}

/// A search by pattern: to the middle of the neighbours, then along the axes. Whether the vertex moved.
fn improve_vertex(draft: &mut Draft, domain: &Domain, vertex: usize, cube: f64) -> bool {
    if matches!(&draft.home[vertex], Home::Surface(patches) if patches.len() > 2) {
        return false;
    }
    let start = draft.points[vertex];
    let mut worst = draft.worst_at(vertex);
    let mut attempt = |draft: &mut Draft, x: Vec3| {
        if draft.worst_if(vertex, x) < worst - PROJECTED {
            return;
        }
        let Some(at) = draft.at_home(vertex, &x, domain) else { return };
        let would = draft.worst_if(vertex, at);
        if would > worst + GAIN {
            draft.points[vertex] = at;
            worst = would;
        }
    };
    let middle = draft.middle_of_neighbours(vertex);
    attempt(draft, middle);
    for step in STEPS {
        for axis in 0..6 {
            let mut x = draft.points[vertex];
            x[axis % 3] += if axis < 3 { step * cube } else { -step * cube };
            attempt(draft, x);
        }
    }
    draft.points[vertex] != start
}
