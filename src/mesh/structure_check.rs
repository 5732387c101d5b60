//! What makes a structure one that a body can be made of.

use super::mesh_error::MeshError;
#[cfg(feature = "serde-serialize")]
use super::structure::SheetTriangle;
use super::structure::{Rod, Spring, Structure};
use super::tet_mesh::check_extent;
#[cfg(feature = "serde-serialize")]
use super::tet_mesh::{check_finite, check_tetrahedra};
use crate::math::Vec3;

/// Lengths over that of the whole below which an edge counts as none.
const SHORT: f64 = 1.0e-9;
/// Area over squared longest edge below which a triangle counts as flat.
const THIN: f64 = 1.0e-6;

/// A structure as it is read, of which anything may be wrong.
#[cfg(feature = "serde-serialize")]
#[derive(serde::Deserialize)]
pub(super) struct Unchecked {
    vertices: Vec<[f64; 3]>,
    tetrahedra: Vec<[u32; 4]>,
    regions: Vec<u32>,
    is_network: bool,
    sheets: Vec<SheetTriangle>,
    rods: Vec<Rod>,
    springs: Vec<Spring>,
}

#[cfg(feature = "serde-serialize")]
impl TryFrom<Unchecked> for Structure {
    type Error = MeshError;

    fn try_from(read: Unchecked) -> Result<Self, MeshError> {
        let Unchecked { vertices, tetrahedra, regions, is_network, sheets, rods, springs } = read;
        check_finite(&vertices)?;
        check_tetrahedra(&vertices, &tetrahedra)?;
        if regions.len() != tetrahedra.len() {
            return Err(MeshError::RegionCount { regions: regions.len(), elements: tetrahedra.len() });
        }
        let structure = Self { vertices, tetrahedra, regions, is_network, sheets, rods, springs };
        for (triangle, sheet) in structure.sheets.iter().enumerate() {
            check_size("thickness", sheet.thickness)?;
            structure.check_triangle(triangle, &sheet.corners)?;
            structure.check_warp(triangle, sheet)?;
        }
        structure.check_sheets()?;
        let size = structure.size();
        structure.rods.iter().try_for_each(|rod| structure.check_rod(rod, size))?;
        structure.springs.iter().try_for_each(|spring| structure.check_spring(spring, size))?;
        Ok(structure)
    }
}

impl Structure {
    /// Checks a triangle of a sheet.
    pub(super) fn check_triangle(&self, triangle: usize, corners: &[u32; 3]) -> Result<(), MeshError> {
        for (c, &vertex) in corners.iter().enumerate() {
            let vertices = self.vertices.len();
            if vertex as usize >= vertices {
                return Err(MeshError::TriangleOutOfRange { triangle, vertex, vertices });
            }
            if corners[..c].contains(&vertex) {
                return Err(MeshError::RepeatedInTriangle { triangle, vertex });
            }
        }
        let [a, b, c] = corners.map(|v| Vec3::from(self.vertices[v as usize]));
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        let edge = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        if area <= THIN * edge * edge {
            return Err(MeshError::FlatTriangle { triangle, area, edge });
        }
        Ok(())
    }

    /// Checks how the triangles of sheets go together.
    pub(super) fn check_sheets(&self) -> Result<(), MeshError> {
        let all: Vec<[u32; 3]> = self.sheets.iter().map(|t| t.corners).collect();
        let mut sorted: Vec<([u32; 3], usize)> = all.iter().copied().zip(0..).collect();
        sorted.iter_mut().for_each(|(t, _)| t.sort_unstable());
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|p| p[0].0 == p[1].0) {
            return Err(MeshError::RepeatedTriangle { triangle: pair[1].1, vertices: pair[1].0 });
        }
        for used in super::surface::edge_uses(&all) {
            if used.count > 2 {
                return Err(MeshError::NonManifoldEdge { edge: used.edge, count: used.count });
            }
        }
        Ok(())
    }

    /// Checks a rod of a structure of this `size` \[m\].
    pub(super) fn check_rod(&self, rod: &Rod, size: f64) -> Result<(), MeshError> {
        check_size("radius", rod.radius)?;
        if rod.points.len() < 2 {
            return Err(MeshError::Empty);
        }
        if rod.regions.len() + 1 != rod.points.len() {
            return Err(MeshError::RegionCount {
                regions: rod.regions.len(),
                elements: rod.points.len() - 1,
            });
        }
        rod.points.windows(2).try_for_each(|ends| self.check_ends([ends[0], ends[1]], size))
    }

    /// Checks a spring of a structure of this `size` \[m\].
    pub(super) fn check_spring(&self, spring: &Spring, size: f64) -> Result<(), MeshError> {
        check_size("cross-section", spring.area)?;
        self.check_ends(spring.ends, size)
    }

    /// Whether a body of it has mass everywhere: every vertex belongs to a tetrahedron, a sheet or a rod.
    ///
    /// # Errors
    /// [`MeshError::Empty`], [`MeshError::UnusedVertex`], [`MeshError::Extent`].
    pub(crate) fn check(&self) -> Result<(), MeshError> {
        let mut used = vec![false; self.vertices.len()];
        let corners = self.tetrahedra.iter().flatten();
        let corners = corners.chain(self.sheets.iter().flat_map(|t| &t.corners));
        corners.chain(self.rods.iter().flat_map(|r| &r.points)).for_each(|&v| used[v as usize] = true);
        match used.iter().position(|u| !u) {
            _ if used.is_empty() => Err(MeshError::Empty),
            Some(vertex) => Err(MeshError::UnusedVertex { vertex }),
            None => check_extent(&self.vertices),
        }
    }

    /// Extent of the vertices \[m\].
    pub(super) fn size(&self) -> f64 {
        let all = self.vertices.iter().map(|v| Vec3::from(*v));
        let low = all.clone().fold(Vec3::repeat(f64::INFINITY), |a, b| a.inf(&b));
        let high = all.fold(Vec3::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b));
        (high - low).norm()
    }

    fn check_ends(&self, ends: [u32; 2], size: f64) -> Result<(), MeshError> {
        let vertices = self.vertices.len();
        if let Some(&vertex) = ends.iter().find(|&&v| v as usize >= vertices) {
            return Err(MeshError::EndOutOfRange { ends, vertex, vertices });
        }
        let [a, b] = ends.map(|v| Vec3::from(self.vertices[v as usize]));
        let length = (b - a).norm();
        match length > SHORT * size {
            true => Ok(()),
            false => Err(MeshError::ShortEdge { ends, length }),
        }
    }
}

pub(super) fn check_size(quantity: &'static str, value: f64) -> Result<(), MeshError> {
    match value.is_finite() && value > 0.0 {
        true => Ok(()),
        false => Err(MeshError::BadSize { quantity, value }),
    }
}
