//! A tetrahedral mesh that is valid by construction.

use super::mesh_error::MeshError;
use super::surface::{EdgeUse, boundary_triangles, edge_uses};
use crate::math::{Mat3, Vec3};

/// Relative volume (volume over cubed longest edge) below which a tetrahedron counts as flat; a
/// regular one has 0.118. Flatter ones have gradients that no double precision factor survives.
const FLAT: f64 = 1.0e-9;

/// Tetrahedra over shared vertices: indices in range, positive volumes, every vertex used, and a
/// closed manifold surface. All of it is checked once, in [`TetMesh::new`].
///
/// ```
/// use foible3d::TetMesh;
/// let mesh = TetMesh::cuboid([0.5, 0.1, 0.1], [20, 4, 4]).unwrap();
/// assert_eq!(mesh.tetrahedra().len(), 20 * 4 * 4 * 5);
/// assert!((mesh.volume() - 1.0 * 0.2 * 0.2).abs() < 1e-12);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    vertices: Vec<[f64; 3]>,
    tetrahedra: Vec<[u32; 4]>,
    volumes: Vec<f64>,
    /// The region of each tetrahedron.
    regions: Vec<u32>,
    /// Regions that have names.
    names: Vec<(u32, String)>,
}

impl TetMesh {
    /// Checks and takes a mesh: `vertices` in metres, four vertex indices per tetrahedron with
    /// `det [b − a, c − a, d − a] > 0`.
    ///
    /// # Errors
    /// The first thing that is wrong, with the index of the offender.
    pub fn new(vertices: Vec<[f64; 3]>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, MeshError> {
        if tetrahedra.is_empty() {
            return Err(MeshError::Empty);
        }
        check_finite(&vertices)?;
        let volumes = check_tetrahedra(&vertices, &tetrahedra)?;
        let mut used = vec![false; vertices.len()];
        tetrahedra.iter().flatten().for_each(|&c| used[c as usize] = true);
        if let Some(vertex) = used.iter().position(|u| !u) {
            return Err(MeshError::UnusedVertex { vertex });
        }
        check_extent(&vertices)?;
        let regions = vec![0; tetrahedra.len()];
        Ok(Self { vertices, tetrahedra, volumes, regions, names: Vec::new() })
    }

    /// The same with a region for each tetrahedron, in their order: any numbers. A body takes a material for each, see
    /// [`DeformableBodyBuilder::region_material`](crate::DeformableBodyBuilder::region_material).
    ///
    /// # Errors
    /// [`MeshError::RegionCount`] for more or fewer numbers than tetrahedra.
    pub fn with_regions(self, regions: Vec<u32>) -> Result<Self, MeshError> {
        match regions.len() == self.tetrahedra.len() {
            true => Ok(Self { regions, ..self }),
            false => Err(MeshError::RegionCount { regions: regions.len(), elements: self.tetrahedra.len() }),
        }
    }

    /// The same with the region of each tetrahedron by the place \[m\] of its middle.
    ///
    /// ```
    /// use foible3d::TetMesh;
    /// // A sole of 1 cm under 3 cm of foam.
    /// let shoe = TetMesh::cuboid([0.15, 0.02, 0.05], [15, 4, 5])?.painted(|[_, y, _]| u32::from(y < -0.01));
    /// assert_eq!(shoe.regions().iter().filter(|region| **region == 1).count(), shoe.tetrahedra().len() / 4);
    /// # Ok::<(), foible3d::MeshError>(())
    /// ```
    #[must_use]
    pub fn painted(mut self, region: impl Fn([f64; 3]) -> u32) -> Self {
        let middle = |tet: &[u32; 4]| middle(&self.vertices, tet);
        self.regions = self.tetrahedra.iter().map(|tet| region(middle(tet))).collect();
        self
    }

    /// The same without the tetrahedra whose middle \[m\] is in a room, and without the vertices that no other has: chambers for
    /// [`DeformableBody::fill_cavity`](crate::DeformableBody::fill_cavity), holes, notches.
    ///
    /// ```
    /// use foible3d::{DeformableModel, TetMesh};
    /// let finger = TetMesh::cuboid([0.1, 0.03, 0.03], [20, 6, 6])?;
    /// let finger = finger.without(|[x, y, z]| x.abs() < 0.09 && y > 0.0 && y < 0.02 && z.abs() < 0.02)?;
    /// let chamber = DeformableModel::new(&finger).cavities().next().expect("it is closed");
    /// assert!((chamber.volume - 0.18 * 0.02 * 0.04).abs() < 1.0e-12);
    /// # Ok::<(), foible3d::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// As [`TetMesh::new`]: [`MeshError::Empty`] if nothing is left, and surfaces that touch themselves along an edge.
    pub fn without(&self, is_room: impl Fn([f64; 3]) -> bool) -> Result<Self, MeshError> {
        let mut number = vec![u32::MAX; self.vertices.len()];
        let (mut vertices, mut tetrahedra, mut regions) = (Vec::new(), Vec::new(), Vec::new());
        for (tet, region) in self.tetrahedra.iter().zip(&self.regions) {
            if is_room(middle(&self.vertices, tet)) {
                continue;
            }
            let mut name = |old: u32| {
                let new = &mut number[old as usize];
                if *new == u32::MAX {
                    *new = vertices.len() as u32;
                    vertices.push(self.vertices[old as usize]);
                }
                *new
            };
            tetrahedra.push(tet.map(&mut name));
            regions.push(*region);
        }
        Ok(Self { regions, names: self.names.clone(), ..Self::new(vertices, tetrahedra)? })
    }

    /// The same with all lengths times `factor`: 0.001 for millimetres.
    ///
    /// # Errors
    /// As [`TetMesh::new`], of a factor that makes it too small, too large or nothing.
    pub fn scaled(self, factor: f64) -> Result<Self, MeshError> {
        let vertices = self.vertices.iter().map(|v| v.map(|c| c * factor)).collect();
        Ok(Self { regions: self.regions, names: self.names, ..Self::new(vertices, self.tetrahedra)? })
    }

    pub(super) fn with_names(self, names: Vec<(u32, String)>) -> Self {
        Self { names, ..self }
    }

    /// The region that a file gave this name.
    pub fn region_named(&self, name: &str) -> Option<u32> {
        self.names.iter().find(|(_, own)| own == name).map(|(region, _)| *region)
    }

    /// Region of each tetrahedron; 0 unless told or read.
    pub fn regions(&self) -> &[u32] {
        &self.regions
    }

    /// Rest positions \[m\], one per vertex.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Four vertex indices per tetrahedron.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// Volume of each tetrahedron \[m³\].
    pub fn volumes(&self) -> &[f64] {
        &self.volumes
    }

    /// Volume of the mesh \[m³\].
    pub fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }

    /// The six dihedral angles of each tetrahedron \[°\]: the nearer to 0 or 180 they are, the less a step can do with it.
    pub fn dihedral_angles(&self) -> impl Iterator<Item = f64> {
        self.tetrahedra.iter().flat_map(|tet| {
            let x = tet.map(|v| Vec3::from(self.vertices[v as usize]));
            [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]].map(
                |[a, b, c, d]| {
                    let edge = x[b] - x[a];
                    let (p, q) = (edge.cross(&(x[c] - x[a])), edge.cross(&(x[d] - x[a])));
                    p.cross(&q).norm().atan2(p.dot(&q)).to_degrees()
                },
            )
        })
    }
}

/// The mean of an element's vertices.
pub(super) fn middle(vertices: &[[f64; 3]], corners: &[u32]) -> [f64; 3] {
    let sum = corners.iter().map(|v| Vec3::from(vertices[*v as usize])).sum::<Vec3>();
    (sum / corners.len() as f64).into()
}

pub(super) fn check_finite(vertices: &[[f64; 3]]) -> Result<(), MeshError> {
    match vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        Some(vertex) => Err(MeshError::NotFinite { vertex, position: vertices[vertex] }),
        None => Ok(()),
    }
}

/// Extents \[m\] of what can be simulated: f32 keeps 6e-8 of a place, and squares far beyond overflow it.
const EXTENTS: [f64; 2] = [1.0e-6, 1.0e6];

/// Checks tetrahedra over finite vertices, and how they go together; returns their volumes \[m³\].
pub(super) fn check_tetrahedra(
    vertices: &[[f64; 3]],
    tetrahedra: &[[u32; 4]],
) -> Result<Vec<f64>, MeshError> {
    let mut volumes = Vec::with_capacity(tetrahedra.len());
    for (tet, corners) in tetrahedra.iter().enumerate() {
        check_indices(tet, corners, vertices.len())?;
        volumes.push(check_volume(tet, corners.map(|c| Vec3::from(vertices[c as usize])))?);
    }
    check_surface(tetrahedra)?;
    Ok(volumes)
}

/// Whether a mesh or structure has the size of something in a world of metres.
pub(super) fn check_extent(vertices: &[[f64; 3]]) -> Result<(), MeshError> {
    let along = |axis: usize| {
        let places = || vertices.iter().map(|v| v[axis]);
        places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min)
    };
    let extent = (0..3).map(along).fold(0.0, f64::max);
    if (EXTENTS[0]..=EXTENTS[1]).contains(&extent) { Ok(()) } else { Err(MeshError::Extent { extent }) }
}

fn check_indices(tet: usize, corners: &[u32; 4], vertices: usize) -> Result<(), MeshError> {
    for (k, &vertex) in corners.iter().enumerate() {
        if vertex as usize >= vertices {
            return Err(MeshError::IndexOutOfRange { tet, vertex, vertices });
        }
        if corners[..k].contains(&vertex) {
            return Err(MeshError::RepeatedVertex { tet, vertex });
        }
    }
    Ok(())
}

fn check_volume(tet: usize, p: [Vec3; 4]) -> Result<f64, MeshError> {
    let volume = signed_volume(&p);
    let edge = (0..4)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| (p[i] - p[j]).norm())
        .fold(0.0, f64::max);
    if volume.abs() <= FLAT * edge.powi(3) {
        return Err(MeshError::Flat { tet, volume, edge });
    }
    if volume < 0.0 {
        return Err(MeshError::Inverted { tet, volume });
    }
    Ok(volume)
}

/// Signed volume of a tetrahedron \[m³\].
pub(crate) fn signed_volume(p: &[Vec3; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0])) / 6.0
}

/// Whether a point is in a tetrahedron; in none without volume.
pub(crate) fn tetrahedron_holds([a, b, c, d]: &[Vec3; 4], p: &Vec3) -> bool {
    let inverse = Mat3::from_columns(&[b - a, c - a, d - a]).try_inverse();
    inverse.is_some_and(|inverse| {
        let w = inverse * (p - a);
        w.iter().all(|w| *w >= 0.0) && w.sum() <= 1.0
    })
}

pub(super) fn check_surface(tetrahedra: &[[u32; 4]]) -> Result<(), MeshError> {
    let triangles =
        boundary_triangles(tetrahedra).map_err(|(face, count)| MeshError::NonManifoldFace { face, count })?;
    for EdgeUse { edge, count } in edge_uses(&triangles) {
        if count != 2 {
            return Err(MeshError::NonManifoldEdge { edge, count });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn corner() -> Vec<[f64; 3]> {
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    }

    #[test]
    fn a_regular_tetrahedron_has_its_dihedral_angles() {
        let x = vec![[1.0; 3], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let mesh = TetMesh::new(x, vec![[0, 1, 2, 3]]).unwrap();
        let third: f64 = 1.0 / 3.0;
        assert!(mesh.dihedral_angles().all(|a| (a - third.acos().to_degrees()).abs() < 1e-12));
        assert_eq!(mesh.dihedral_angles().count(), 6);
    }

    #[test]
    fn each_kind_of_bad_mesh_is_named() {
        let tet = |v, t| TetMesh::new(v, t).unwrap_err();
        assert_eq!(tet(corner(), vec![]), MeshError::Empty);
        assert!(matches!(
            tet(corner(), vec![[0, 2, 1, 3]]),
            MeshError::Inverted { tet: 0, volume } if volume < 0.0
        ));
        assert!(matches!(
            tet(corner(), vec![[0, 1, 2, 4]]),
            MeshError::IndexOutOfRange { tet: 0, vertex: 4, vertices: 4 }
        ));
        assert!(matches!(tet(corner(), vec![[0, 1, 2, 2]]), MeshError::RepeatedVertex { tet: 0, vertex: 2 }));
        let mut flat = corner();
        flat[3] = [0.3, 0.3, 1e-12];
        assert!(matches!(tet(flat, vec![[0, 1, 2, 3]]), MeshError::Flat { tet: 0, .. }));
        let mut nan = corner();
        nan[2][1] = f64::NAN;
        assert!(matches!(tet(nan, vec![[0, 1, 2, 3]]), MeshError::NotFinite { vertex: 2, .. }));
        let mut unused = corner();
        unused.push([5.0; 3]);
        assert_eq!(tet(unused, vec![[0, 1, 2, 3]]), MeshError::UnusedVertex { vertex: 4 });
        // Two tetrahedra that share nothing but an edge.
        let mut hinge = corner();
        hinge.extend([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        assert!(matches!(
            tet(hinge, vec![[0, 1, 2, 3], [0, 1, 4, 5]]),
            MeshError::NonManifoldEdge { edge: [0, 1], count: 4 }
        ));
        // Three tetrahedra on one face.
        let mut fan = corner();
        fan.extend([[0.2, 0.2, 2.0], [0.1, 0.1, 3.0]]);
        assert!(matches!(
            tet(fan, vec![[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]]),
            MeshError::NonManifoldFace { face: [0, 1, 2], count: 3 }
        ));
    }

    proptest! {
        #[test]
        fn random_tetrahedra_are_taken_or_refused_but_never_panic(
            coordinates in proptest::collection::vec(
                prop_oneof![8 => -1.0..1.0f64, 1 => Just(0.0), 1 => Just(f64::NAN), 1 => Just(1e300)], 3..30),
            indices in proptest::collection::vec(0u32..12, 0..40),
        ) {
            let vertices: Vec<_> = coordinates.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
            let tets: Vec<_> = indices.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
            if let Ok(mesh) = TetMesh::new(vertices, tets) {
                prop_assert!(mesh.volumes().iter().all(|&v| v > 0.0));
            }
        }
    }
}
