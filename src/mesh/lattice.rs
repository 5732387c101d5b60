//! Cuboids as lattices of cells, five tetrahedra each.

use super::mesh_error::MeshError;
use super::tet_mesh::{TetMesh, signed_volume};
use crate::math::Vec3;

/// Corners (bit 0 = x, bit 1 = y, bit 2 = z) of the five tetrahedra of an even cell: one in the
/// middle, one at each remaining corner. An odd cell has every x mirrored, so that the diagonals of
/// neighbours meet.
const EVEN_CELL: [[usize; 4]; 5] = [
    [0b000, 0b011, 0b101, 0b110],
    [0b001, 0b000, 0b011, 0b101],
    [0b010, 0b000, 0b110, 0b011],
    [0b100, 0b000, 0b101, 0b110],
    [0b111, 0b011, 0b110, 0b101],
];

impl TetMesh {
    /// A cuboid centred at the origin, `half_extents` \[m\], cut into `cells` per axis, each cell into
    /// five tetrahedra whose diagonals alternate with the cell's parity.
    ///
    /// # Errors
    /// [`MeshError::BadLattice`] when an axis has no cells or no extent, [`MeshError::TooLarge`], [`MeshError::Extent`].
    pub fn cuboid(half_extents: [f64; 3], cells: [usize; 3]) -> Result<Self, MeshError> {
        if cells.contains(&0) || !half_extents.iter().all(|&e| e.is_finite() && e > 0.0) {
            return Err(MeshError::BadLattice { cells, half_extents });
        }
        let nodes = cells.map(|c| c.saturating_add(1));
        let vertices = nodes.iter().fold(1usize, |a, &b| a.saturating_mul(b));
        if vertices > u32::MAX as usize / 8 {
            return Err(MeshError::TooLarge { vertices });
        }
        let index = |i: usize, j: usize, k: usize| ((k * nodes[1] + j) * nodes[0] + i) as u32;
        let mut points = Vec::with_capacity(vertices);
        for k in 0..nodes[2] {
            for j in 0..nodes[1] {
                for i in 0..nodes[0] {
                    // Mirror-symmetric to the last bit: -e at 0, +e at the end.
                    let at = |n: usize, axis: usize| {
                        let c = cells[axis] as f64;
                        half_extents[axis] * ((2.0 * n as f64 - c) / c)
                    };
                    points.push([at(i, 0), at(j, 1), at(k, 2)]);
                }
            }
        }
        let mut tetrahedra = Vec::with_capacity(5 * cells.iter().product::<usize>());
        for k in 0..cells[2] {
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    let mirror = (i + j + k) % 2;
                    for tet in EVEN_CELL {
                        let corner = |c: usize| {
                            let c = c ^ mirror;
                            index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))
                        };
                        tetrahedra.push(oriented(tet.map(corner), &points));
                    }
                }
            }
        }
        TetMesh::new(points, tetrahedra)
    }
}

fn oriented(mut tet: [u32; 4], points: &[[f64; 3]]) -> [u32; 4] {
    if signed_volume(&tet.map(|i| Vec3::from(points[i as usize]))) < 0.0 {
        tet.swap(2, 3);
    }
    tet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_fills_its_box() {
        for cells in [[1, 1, 1], [2, 3, 4], [11, 3, 3]] {
            let mesh = TetMesh::cuboid([0.5, 0.1, 0.2], cells).unwrap();
            assert_eq!(mesh.tetrahedra().len(), 5 * cells.iter().product::<usize>());
            assert!((mesh.volume() - 8.0 * 0.5 * 0.1 * 0.2).abs() < 1e-14);
        }
    }

    #[test]
    fn lattice_without_cells_or_extent_is_refused() {
        assert!(matches!(TetMesh::cuboid([1.0; 3], [1, 0, 1]), Err(MeshError::BadLattice { .. })));
        assert!(matches!(TetMesh::cuboid([1.0, -1.0, 1.0], [1; 3]), Err(MeshError::BadLattice { .. })));
        assert!(matches!(TetMesh::cuboid([1.0; 3], [usize::MAX; 3]), Err(MeshError::TooLarge { .. })));
        for size in [1e-10, 1e20] {
            assert!(matches!(TetMesh::cuboid([size; 3], [1; 3]), Err(MeshError::Extent { .. })), "{size}");
        }
    }
}
