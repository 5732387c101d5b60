//! What a body can be made of besides tetrahedra: sheets, rods and springs over shared vertices.

use super::mesh_error::MeshError;
use super::structure_check::check_size;
use super::tet_mesh::{TetMesh, check_finite, middle};

/// Tetrahedra, sheets, rods and springs over shared vertices, in any mix: a body of several materials' shapes.
/// Cross-sections make stiffness and mass of what is thin follow from the same pascals and kilograms per
/// cubic metre as of what is solid.
///
/// ```
/// use foible3d::Structure;
/// // A pendulum: a rope of 1 m, 5 mm thick, with a block of 0.1 m on its end.
/// let block = foible3d::TetMesh::cuboid([0.05; 3], [2; 3])?;
/// let pendulum = Structure::solid(&block);
/// let top = pendulum.vertices().iter().position(|v| *v == [0.0, 0.05, 0.0]).unwrap() as u32;
/// let points: Vec<[f64; 3]> = (1..=20).map(|k| [0.0, 0.05 + 0.05 * f64::from(k), 0.0]).collect();
/// let pendulum = pendulum.rod_from(top, &points, 0.0025)?;
/// assert_eq!(pendulum.vertices().len(), 27 + 20);
/// # Ok::<(), foible3d::MeshError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde-serialize", serde(try_from = "super::structure_check::Unchecked"))]
pub struct Structure {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) tetrahedra: Vec<[u32; 4]>,
    /// The region of each tetrahedron.
    pub(crate) regions: Vec<u32>,
    /// The tetrahedra give mass and a surface; their edges are springs that take the place of the solid.
    pub(crate) is_network: bool,
    pub(crate) sheets: Vec<SheetTriangle>,
    pub(crate) rods: Vec<Rod>,
    pub(crate) springs: Vec<Spring>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SheetTriangle {
    pub corners: [u32; 3],
    pub thickness: f64,
    pub region: u32,
    /// Direction of the warp, not normal to the triangle.
    pub warp: Option<[f64; 3]>,
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Rod {
    pub points: Vec<u32>,
    pub radius: f64,
    /// Of each segment.
    pub regions: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Spring {
    pub ends: [u32; 2],
    /// Cross-section \[m²\].
    pub area: f64,
    pub region: u32,
}

impl Structure {
    /// The tetrahedra of a mesh.
    #[must_use]
    pub fn solid(mesh: &TetMesh) -> Self {
        Self {
            vertices: mesh.vertices().to_vec(),
            tetrahedra: mesh.tetrahedra().to_vec(),
            regions: mesh.regions().to_vec(),
            ..Self::default()
        }
    }

    /// A mass–spring network: the edges of a mesh as springs of `E V/l²` each, V the volume of the tetrahedra
    /// around the edge. Under random directions that is Young's modulus E at a Poisson's ratio of 1/4, the only
    /// one that springs can have.
    #[must_use]
    pub fn spring_network(mesh: &TetMesh) -> Self {
        Self { is_network: true, ..Self::solid(mesh) }
    }

    /// A sheet of triangles, `thickness` \[m\]: cloth, paper, shells. It bends as a thin plate does, however it is cut into triangles, and keeps the
    /// curvature that it has at rest, to either side.
    ///
    /// # Errors
    /// What is wrong with the triangles or the thickness.
    pub fn sheet(vertices: Vec<[f64; 3]>, triangles: &[[u32; 3]], thickness: f64) -> Result<Self, MeshError> {
        let structure = Self { vertices, ..Self::default() };
        check_finite(&structure.vertices)?;
        structure.with_sheet(triangles, thickness)
    }

    /// A flat rectangle in the plane of x and z, centred at the origin, of `cells[1]` strips along x that are cut
    /// into `2 cells[0] + 1` triangles each: every other row of vertices is shifted by half a cell, so that
    /// triangles of cells of `1 : 0.87` are equilateral.
    ///
    /// # Errors
    /// [`MeshError::BadLattice`] without cells or extent; a bad thickness.
    pub fn rectangle(half_extents: [f64; 2], cells: [usize; 2], thickness: f64) -> Result<Self, MeshError> {
        let [ex, ez] = half_extents;
        let extents_are_good = half_extents.iter().all(|e| e.is_finite() && *e > 0.0);
        let vertices = cells.iter().fold(1usize, |n, c| n.saturating_mul(c.saturating_add(1)));
        if cells.contains(&0) || !extents_are_good {
            let (cells, half_extents) = ([cells[0], 1, cells[1]], [ex, thickness, ez]);
            return Err(MeshError::BadLattice { cells, half_extents });
        }
        if vertices > u32::MAX as usize / 8 {
            return Err(MeshError::TooLarge { vertices });
        }
        let [nx, nz] = cells;
        let (mut points, mut rows) = (Vec::with_capacity(vertices + nz), Vec::with_capacity(nz + 1));
        for j in 0..=nz {
            let z = ez * ((2.0 * j as f64 - nz as f64) / nz as f64);
            let shift = (j % 2) as f64 / 2.0;
            rows.push(points.len() as u32..(points.len() + nx + 1 + j % 2) as u32);
            for i in 0..=nx + j % 2 {
                let at = (i as f64 - shift).clamp(0.0, nx as f64);
                points.push([ex * ((2.0 * at - nx as f64) / nx as f64), 0.0, z]);
            }
        }
        let mut triangles = Vec::with_capacity((2 * nx + 1) * nz);
        for pair in rows.windows(2) {
            // Along the strip, the row with fewer vertices and the one with more take turns.
            let [few, many] =
                if pair[0].len() < pair[1].len() { [&pair[0], &pair[1]] } else { [&pair[1], &pair[0]] };
            let up = few.start > many.start;
            let mut add = |[a, b, c]: [u32; 3]| triangles.push(if up { [a, b, c] } else { [a, c, b] });
            for i in 0..=nx as u32 {
                add([few.start + i, many.start + i + 1, many.start + i]);
                if i < nx as u32 {
                    add([few.start + i, few.start + i + 1, many.start + i + 1]);
                }
            }
        }
        Self::sheet(points, &triangles, thickness)
    }

    /// A round rod or rope along a polyline, `radius` \[m\].
    ///
    /// # Errors
    /// Fewer than two points, points on one another, a bad radius.
    pub fn rod(points: &[[f64; 3]], radius: f64) -> Result<Self, MeshError> {
        check_finite(points)?;
        let structure = Self { vertices: points.to_vec(), ..Self::default() };
        structure.with_rod((0..points.len() as u32).collect(), radius)
    }

    /// The same, closed: from the last point back to the first.
    ///
    /// # Errors
    /// As [`Structure::rod`], with [`MeshError::Empty`] for fewer than three points.
    pub fn ring(points: &[[f64; 3]], radius: f64) -> Result<Self, MeshError> {
        check_finite(points)?;
        if points.len() < 3 {
            return Err(MeshError::Empty);
        }
        let structure = Self { vertices: points.to_vec(), ..Self::default() };
        structure.with_rod((0..points.len() as u32).chain([0]).collect(), radius)
    }

    /// Adds triangles over the present vertices.
    ///
    /// # Errors
    /// As [`Structure::sheet`].
    pub fn with_sheet(mut self, triangles: &[[u32; 3]], thickness: f64) -> Result<Self, MeshError> {
        check_size("thickness", thickness)?;
        let first = self.sheets.len();
        for (triangle, corners) in (first..).zip(triangles) {
            self.check_triangle(triangle, corners)?;
        }
        let sheet = |&corners: &[u32; 3]| SheetTriangle { corners, thickness, region: 0, warp: None };
        self.sheets.extend(triangles.iter().map(sheet));
        self.check_sheets()?;
        Ok(self)
    }

    /// Adds a rod along vertices that are there already.
    ///
    /// # Errors
    /// As [`Structure::rod`].
    pub fn with_rod(mut self, points: Vec<u32>, radius: f64) -> Result<Self, MeshError> {
        let regions = vec![0; points.len().saturating_sub(1)];
        let rod = Rod { points, radius, regions };
        self.check_rod(&rod, self.size())?;
        self.rods.push(rod);
        Ok(self)
    }

    /// Adds a rod from a vertex on along new points.
    ///
    /// # Errors
    /// As [`Structure::rod`].
    pub fn rod_from(mut self, start: u32, points: &[[f64; 3]], radius: f64) -> Result<Self, MeshError> {
        check_finite(points)?;
        let first = self.vertices.len() as u32;
        if start >= first {
            let (ends, vertices) = ([start, first], self.vertices.len());
            return Err(MeshError::EndOutOfRange { ends, vertex: start, vertices });
        }
        self.vertices.extend_from_slice(points);
        let along = std::iter::once(start).chain(first..self.vertices.len() as u32);
        self.with_rod(along.collect(), radius)
    }

    /// Adds a spring without mass: as stiff as a bar of this cross-section `area` \[m²\] between its ends.
    ///
    /// # Errors
    /// Ends that are no vertices or in one place, a bad area.
    pub fn with_spring(mut self, ends: [u32; 2], area: f64) -> Result<Self, MeshError> {
        let spring = Spring { ends, area, region: 0 };
        self.check_spring(&spring, self.size())?;
        self.springs.push(spring);
        Ok(self)
    }

    /// The same with the region of each tetrahedron, triangle, segment of a rod and spring by the place \[m\] of its middle, as
    /// [`TetMesh::painted`].
    #[must_use]
    pub fn painted(mut self, region: impl Fn([f64; 3]) -> u32) -> Self {
        let vertices = &self.vertices;
        let region = |corners: &[u32]| region(middle(vertices, corners));
        self.regions = self.tetrahedra.iter().map(|tet| region(tet)).collect();
        self.sheets.iter_mut().for_each(|sheet| sheet.region = region(&sheet.corners));
        self.rods.iter_mut().for_each(|rod| rod.regions = rod.points.windows(2).map(region).collect());
        self.springs.iter_mut().for_each(|spring| spring.region = region(&spring.ends));
        self
    }

    /// Every region that an element is in.
    pub(crate) fn all_regions(&self) -> impl Iterator<Item = u32> + '_ {
        let of_rods = self.rods.iter().flat_map(|rod| &rod.regions);
        let listed = self.regions.iter().chain(of_rods).copied();
        let of_sheets = self.sheets.iter().map(|sheet| sheet.region);
        listed.chain(of_sheets).chain(self.springs.iter().map(|spring| spring.region))
    }

    /// Rest positions \[m\], one per vertex.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    pub(crate) fn rod_at(&self, rod: usize) -> &Rod {
        &self.rods[rod]
    }

    /// Vertices along each rod.
    pub(crate) fn rods(&self) -> impl Iterator<Item = &[u32]> {
        self.rods.iter().map(|rod| &rod.points[..])
    }

    /// Four vertex indices per tetrahedron.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn triangles_of_a_rectangle_cover_it_and_face_up() {
        for cells in [[1, 1], [3, 2], [4, 5]] {
            let sheet = Structure::rectangle([0.5, 0.2], cells, 0.01).unwrap();
            assert_eq!(sheet.sheets.len(), (2 * cells[0] + 1) * cells[1]);
            let area = |t: &SheetTriangle| {
                let [a, b, c] = t.corners.map(|v| Vec3::from(sheet.vertices[v as usize]));
                0.5 * (b - a).cross(&(c - a)).y
            };
            assert!(sheet.sheets.iter().all(|t| area(t) > 0.0), "{cells:?}");
            assert!((sheet.sheets.iter().map(area).sum::<f64>() - 0.4).abs() < 1e-12);
        }
    }

    #[test]
    fn each_kind_of_bad_structure_is_named() {
        let square = || vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        let sheet = |triangles: &[[u32; 3]]| Structure::sheet(square(), triangles, 0.01).unwrap_err();
        assert!(matches!(sheet(&[[0, 1, 4]]), MeshError::TriangleOutOfRange { triangle: 0, vertex: 4, .. }));
        assert!(matches!(
            sheet(&[[0, 1, 2], [0, 2, 2]]),
            MeshError::RepeatedInTriangle { triangle: 1, vertex: 2 }
        ));
        let mut book = square();
        book.push([0.5, 1.0, 0.5]);
        let fan = Structure::sheet(book, &[[0, 1, 2], [0, 2, 3], [0, 2, 4]], 0.01).unwrap_err();
        assert!(matches!(fan, MeshError::NonManifoldEdge { count: 2.., .. }));
        assert!(matches!(
            sheet(&[[0, 1, 2], [1, 2, 0]]),
            MeshError::RepeatedTriangle { triangle: 1, vertices: [0, 1, 2] }
        ));
        let line = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let flat = Structure::sheet(line.clone(), &[[0, 1, 2]], 0.01);
        assert!(matches!(flat, Err(MeshError::FlatTriangle { triangle: 0, .. })));
        let thickness = Structure::sheet(square(), &[[0, 1, 2]], -1.0);
        assert!(matches!(thickness, Err(MeshError::BadSize { quantity: "thickness", value: -1.0 })));
        assert!(matches!(Structure::rod(&line[..1], 0.1), Err(MeshError::Empty)));
        assert!(matches!(
            Structure::rod(&line, f64::NAN),
            Err(MeshError::BadSize { quantity: "radius", .. })
        ));
        let twice = Structure::rod(&[line[0], line[0], line[1]], 0.1);
        assert!(matches!(twice, Err(MeshError::ShortEdge { ends: [0, 1], .. })));
        let rod = Structure::rod(&line, 0.1).unwrap();
        assert!(matches!(
            rod.clone().with_spring([0, 9], 1.0),
            Err(MeshError::EndOutOfRange { vertex: 9, .. })
        ));
        let beyond = rod.clone().rod_from(3, &[[3.0, 0.0, 0.0], [4.0, 0.0, 0.0]], 0.1);
        assert!(matches!(beyond, Err(MeshError::EndOutOfRange { vertex: 3, .. })));
        let alone = Structure { vertices: vec![[0.0; 3]; 4], ..rod };
        assert_eq!(alone.check(), Err(MeshError::UnusedVertex { vertex: 3 }));
        assert_eq!(Structure::default().check(), Err(MeshError::Empty));
        assert!(matches!(Structure::rectangle([1.0, 1.0], [0, 3], 0.1), Err(MeshError::BadLattice { .. })));
    }
}
