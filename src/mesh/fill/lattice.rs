//! The body-centred cubic lattice: corners of cubes and their centres.

use crate::math::Vec3;

/// Cubes of side `a` with a vertex at each corner and each centre. Tetrahedra stand on two neighbouring centres and
/// an edge of the face between them: all are alike, with dihedral angles of 60° and 90°.
pub(in crate::mesh) struct Lattice {
    /// Side of a cube \[m\].
    pub a: f64,
    /// Cubes per axis.
    pub cubes: [usize; 3],
    /// The first corner \[m\].
    pub origin: Vec3,
}

impl Lattice {
    /// Cubes of side `a` \[m\] over a box, a whole one beyond it on each side, symmetric about its centre.
    pub fn over(low: Vec3, high: Vec3, a: f64) -> Self {
        let extents = high - low;
        let cubes = [0, 1, 2].map(|k| (extents[k] / a).ceil() as usize + 2);
        let half = Vec3::from_fn(|k, _| cubes[k] as f64 * a / 2.0);
        Self { a, cubes, origin: (low + high) / 2.0 - half }
    }

    fn corners(&self) -> usize {
        self.cubes.iter().map(|n| n + 1).product()
    }

    pub fn vertices(&self) -> usize {
        self.corners() + self.cubes.iter().product::<usize>()
    }

    pub fn corner(&self, [i, j, k]: [usize; 3]) -> u32 {
        ((k * (self.cubes[1] + 1) + j) * (self.cubes[0] + 1) + i) as u32
    }

    pub fn centre(&self, [i, j, k]: [usize; 3]) -> u32 {
        (self.corners() + (k * self.cubes[1] + j) * self.cubes[0] + i) as u32
    }

    /// Where a vertex is \[m\].
    pub fn position(&self, vertex: u32) -> Vec3 {
        let corners = self.corners();
        let (index, n, shift) = match (vertex as usize).checked_sub(corners) {
            None => (vertex as usize, self.cubes.map(|n| n + 1), 0.0),
            Some(index) => (index, self.cubes, 0.5),
        };
        let place = [index % n[0], index / n[0] % n[1], index / (n[0] * n[1])];
        self.origin + Vec3::from_fn(|k, _| (place[k] as f64 + shift) * self.a)
    }

    /// Whether an edge is one of the long ones, between two corners or two centres.
    pub fn is_long(&self, edge: [u32; 2]) -> bool {
        let corners = self.corners() as u32;
        (edge[0] < corners) == (edge[1] < corners)
    }

    /// Calls `visit` with the vertices of every tetrahedron, positively oriented.
    pub fn for_each_tetrahedron(&self, mut visit: impl FnMut([u32; 4])) {
        let n = self.cubes;
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let here = [i, j, k];
                    for axis in (0..3).filter(|&axis| here[axis] + 1 < n[axis]) {
                        // Not by `at[axis] += 1` on a parameter: rustc 1.95 with `opt-level = 1` changes the caller's then, and
                        // what is filled falls apart.
                        let step = |at: [usize; 3], axis: usize| -> [usize; 3] {
                            std::array::from_fn(|k| at[k] + usize::from(k == axis))
                        };
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let first = step(here, axis);
                        let ring = [first, step(first, u), step(step(first, u), v), step(first, v)];
                        let (below, above) = (self.centre(here), self.centre(first));
                        for m in 0..4 {
                            visit([below, self.corner(ring[m]), self.corner(ring[(m + 1) % 4]), above]);
                        }
                    }
                }
            }
        }
    }
}
