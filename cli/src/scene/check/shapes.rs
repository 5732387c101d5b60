//! Shapes: whether they have a size, and one that ends.

use super::LARGEST;
use crate::scene::{Body, Part, Shape};

/// Cells of a lattice, cells that a filled shape is cut into, segments of a rope, at the most. A cube of 98 415 tetrahedra is the largest
/// that has been measured.
const MOST_CELLS: f64 = 1.0e6;

pub(super) fn shape_problem(shape: &Shape) -> Option<String> {
    let lengths: Vec<(&str, f32)> = match shape {
        Shape::Ball { radius } => vec![("radius", *radius)],
        Shape::Cuboid { half_extents } => half_extents.iter().map(|e| ("half_extents", *e)).collect(),
        Shape::Capsule { half_height, radius }
        | Shape::Cylinder { half_height, radius }
        | Shape::Cone { half_height, radius } => vec![("half_height", *half_height), ("radius", *radius)],
        Shape::HalfSpace { normal } => {
            let zero = normal.iter().all(|n| *n == 0.0) || !normal.iter().all(|n| n.is_finite());
            return zero.then(|| "`normal` must not be zero".into());
        }
        Shape::Mesh { scale, .. } => vec![("scale", *scale)],
        Shape::Compound { parts } => return compound_problem(parts),
        Shape::Heightfield { heights, size } => {
            if let Some(problem) = heightfield_problem(heights) {
                return Some(problem);
            }
            size.iter().map(|s| ("size", *s)).collect()
        }
    };
    let wrong = lengths.into_iter().find(|(_, length)| !(*length > 0.0 && *length <= LARGEST));
    wrong.map(|(key, length)| format!("`{key}` is {length}, but must be positive, up to {LARGEST:e}"))
}

fn compound_problem(parts: &[Part]) -> Option<String> {
    if parts.is_empty() {
        return Some("`parts` is empty, but a compound has at least one".into());
    }
    parts.iter().find_map(|part| match &part.shape {
        Shape::HalfSpace { .. } | Shape::Mesh { .. } | Shape::Heightfield { .. } | Shape::Compound { .. } => {
            Some("`parts` of a compound are balls, boxes, capsules, cylinders and cones".into())
        }
        simple => {
            let placed = part.translation.iter().chain(&part.rotation).find(|x| !(x.abs() <= LARGEST));
            let placed = placed.map(|x| format!("a part is placed at {x}, but must be up to {LARGEST:e}"));
            shape_problem(simple).or(placed)
        }
    })
}

fn heightfield_problem(heights: &[Vec<f32>]) -> Option<String> {
    let columns = heights.first().map_or(0, Vec::len);
    if heights.len() < 2 || columns < 2 || heights.iter().any(|row| row.len() != columns) {
        return Some("`heights` must be at least two rows of equal length, of two numbers or more".into());
    }
    let wrong = heights.iter().flatten().find(|h| !(h.abs() <= LARGEST));
    wrong.map(|h| format!("`heights` has {h}, but must be numbers up to {LARGEST:e}"))
}

fn cells_problem(cells: &[usize]) -> Option<String> {
    if cells.contains(&0) {
        return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
    }
    let count: f64 = cells.iter().map(|c| *c as f64).product();
    (count > MOST_CELLS).then(|| format!("`cells` is {cells:?}, but {MOST_CELLS:.0} are the most"))
}

pub(super) fn body_problem(body: &Body) -> Option<String> {
    match body {
        Body::Lattice { half_extents, cells, .. } | Body::Network { half_extents, cells } => {
            cells_problem(cells).or_else(|| shape_problem(&Shape::Cuboid { half_extents: *half_extents }))
        }
        Body::Filled { shape, cell_size } => {
            if matches!(shape, Shape::Mesh { .. } | Shape::Heightfield { .. } | Shape::Compound { .. }) {
                return Some("`filled` fills simple shapes; give `mesh` as the body itself".into());
            }
            shape_problem(shape).or_else(|| filled_problem(shape, *cell_size))
        }
        Body::Cloth { half_extents: [x, z], cells, thickness } => {
            let thin = !(*thickness > 0.0 && thickness.is_finite());
            let thin = thin.then(|| format!("`thickness` is {thickness}, but must be positive"));
            let sides = || shape_problem(&Shape::Cuboid { half_extents: [*x, *thickness, *z] });
            cells_problem(cells).or(thin).or_else(sides)
        }
        Body::Rope { points, segments, radius } => {
            if points.len() < 2 || *segments == 0 {
                return Some("a rope needs at least two `points` and one of `segments`".into());
            }
            if *segments as f64 > MOST_CELLS {
                return Some(format!("`segments` is {segments}, but {MOST_CELLS:.0} are the most"));
            }
            shape_problem(&Shape::Ball { radius: *radius })
        }
        Body::Mesh { cell_size, scale, .. } => {
            let wrong = [("cell_size", cell_size.unwrap_or(1.0)), ("scale", *scale)];
            let wrong = wrong.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite()));
            wrong.map(|(key, v)| format!("`{key}` is {v}, but must be positive"))
        }
    }
}

fn filled_problem(shape: &Shape, cell_size: f32) -> Option<String> {
    if !(cell_size > 0.0 && cell_size.is_finite()) {
        return Some(format!("`cell_size` is {cell_size}, but must be positive"));
    }
    let sides = match *shape {
        Shape::Ball { radius } => [radius; 3],
        Shape::Cuboid { half_extents } => half_extents,
        Shape::Capsule { half_height, radius } => [radius, half_height + radius, radius],
        Shape::Cylinder { half_height, radius } | Shape::Cone { half_height, radius } => {
            [radius, half_height, radius]
        }
        _ => [0.0; 3],
    };
    let cells: f64 = sides.iter().map(|s| (2.0 * f64::from(*s) / f64::from(cell_size)).ceil()).product();
    (cells > MOST_CELLS).then(|| {
        format!(
            "`cell_size` of {cell_size} m cuts it into {cells:.0} cells, but {MOST_CELLS:.0} are the most"
        )
    })
}
