//! Vertices in one place made one.

use rapier3d::math::Vector;
use std::collections::HashMap;

/// Vertices without those that are within `tolerance` \[m\] of earlier ones, and the index of each among them. What is not finite
/// stays. Meshes have several vertices along the seams of their textures, which are a rounding apart.
pub(super) fn weld(vertices: &[Vector], tolerance: f32) -> (Vec<Vector>, Vec<u32>) {
    let tolerance = f64::from(tolerance.max(0.0));
    // Twice as wide as the box around a vertex: rounding must not carry its corners over a cell.
    let width = 4.0 * tolerance;
    let cell = |v: Vector, k: usize| {
        let corner = [k & 1, k >> 1 & 1, k >> 2].map(|side| 2.0 * side as f64 - 1.0);
        let at = |c: f32, side: f64| match tolerance > 0.0 {
            true => ((f64::from(c) + side * tolerance) / width).round().to_bits(),
            false => f64::from(c).to_bits(),
        };
        // Adding zero makes -0 equal to 0.
        [at(v.x + 0.0, corner[0]), at(v.y + 0.0, corner[1]), at(v.z + 0.0, corner[2])]
    };
    let mut kept: Vec<Vector> = Vec::new();
    let mut cells: HashMap<[u64; 3], Vec<u32>> = HashMap::new();
    let mut index = Vec::with_capacity(vertices.len());
    for vertex in vertices {
        let mut near = (0..8).filter_map(|k| cells.get(&cell(*vertex, k))).flatten();
        let is_near = |v: &&u32| f64::from(kept[**v as usize].distance(*vertex)) <= tolerance;
        let known = near.find(is_near).copied();
        index.push(known.unwrap_or_else(|| {
            let name = kept.len() as u32;
            kept.push(*vertex);
            // In every cell that a corner of its own box is in: the neighbour's box needs one of them.
            for k in 0..if vertex.is_finite() { 8 } else { 0 } {
                let of_cell = cells.entry(cell(*vertex, k)).or_default();
                if of_cell.last() != Some(&name) {
                    of_cell.push(name);
                }
            }
            name
        }));
    }
    (kept, index)
}
