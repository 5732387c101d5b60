//! Which tetrahedron holds a point of the rest shape, or is nearest to doing so.

use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3};
use std::collections::HashMap;

/// Mean edges along a cell of the grid.
const CELL: f64 = 1.0;
/// Cells around that of a point in which a tetrahedron is looked for before all of them are looked at.
const RINGS: i64 = 2;

/// Tetrahedra by the cells of a grid that their boxes overlap.
pub(super) struct TetGrid<'a> {
    model: &'a DeformableModel,
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// First corner, and what makes weights of the other three of the way from it.
    inverses: Vec<(Vec3, Mat3)>,
    size: f64,
}

impl<'a> TetGrid<'a> {
    pub fn new(model: &'a DeformableModel) -> Self {
        let size = CELL * model.surface.mean_edge;
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let mut inverses = Vec::with_capacity(model.tetrahedra.len());
        for (tet, nodes) in (0..).zip(&model.tetrahedra) {
            let [a, b, c, d] = nodes.map(|n| model.rest[n as usize]);
            let inverse = Mat3::from_columns(&[b - a, c - a, d - a]).try_inverse();
            // Meshes without flat tetrahedra have one.
            inverses.push((a, inverse.unwrap_or_default()));
            let low = a.inf(&b).inf(&c).inf(&d).map(|x| (x / size).floor() as i64);
            let high = a.sup(&b).sup(&c).sup(&d).map(|x| (x / size).floor() as i64);
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    (low.z..=high.z).for_each(|z| cells.entry([x, y, z]).or_default().push(tet));
                }
            }
        }
        Self { model, cells, inverses, size }
    }

    /// Weights of a point in a tetrahedron; they sum to one.
    fn weights(&self, tet: u32, p: &Vec3) -> [f64; 4] {
        let (first, inverse) = &self.inverses[tet as usize];
        let w = inverse * (p - first);
        [1.0 - w.x - w.y - w.z, w.x, w.y, w.z]
    }

    /// How far a point is outside of a tetrahedron \[m\]: by the most that it is beyond a face.
    fn outside(&self, tet: u32, p: &Vec3) -> f64 {
        let (_, inverse) = &self.inverses[tet as usize];
        let rows = [0, 1, 2].map(|r| inverse.row(r).norm());
        let first = (inverse.row(0) + inverse.row(1) + inverse.row(2)).norm();
        let heights = [first, rows[0], rows[1], rows[2]];
        let weights = self.weights(tet, p);
        weights.iter().zip(heights).map(|(w, per_length)| -w / per_length).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far a point is from the nearest tetrahedron, or about that \[m\]; zero inside.
    pub fn distance(&self, p: &Vec3) -> f64 {
        self.nearest(p).map_or(f64::INFINITY, |(outside, _)| outside.max(0.0))
    }

    /// The tetrahedron that a point is in, or least outside of, and what its weights follow from.
    pub fn find(&self, p: &Vec3) -> Option<(u32, Mat3, Vec3)> {
        let (_, tet) = self.nearest(p)?;
        let (first, inverse) = self.inverses[tet as usize];
        Some((tet, inverse, first))
    }

    /// The tetrahedron that a point is least outside of, and by how much \[m\].
    fn nearest(&self, p: &Vec3) -> Option<(f64, u32)> {
        let [x, y, z] = [p.x, p.y, p.z].map(|c| (c / self.size).floor() as i64);
        let mut best: Option<(f64, u32)> = None;
        let look = |tet: u32, best: &mut Option<(f64, u32)>| {
            let outside = self.outside(tet, p);
            if best.is_none_or(|least| (outside, tet) < least) {
                *best = Some((outside, tet));
            }
            outside <= 0.0
        };
        for ring in 0..=RINGS {
            let mut is_in = false;
            for i in -ring..=ring {
                for j in -ring..=ring {
                    for k in (-ring..=ring).filter(|k| [i, j, *k].iter().any(|c| c.abs() == ring)) {
                        let own = self.cells.get(&[x + i, y + j, z + k]).into_iter().flatten();
                        own.for_each(|tet| is_in |= look(*tet, &mut best));
                    }
                }
            }
            // One ring more: what is nearer may be in it.
            if is_in || ring > 0 && best.is_some() {
                break;
            }
        }
        if best.is_none() {
            (0..self.model.tetrahedra.len() as u32).for_each(|tet| _ = look(tet, &mut best));
        }
        best
    }
}
