//! Triangle surfaces as people have them: what is wrong with one, and its repair.

mod crossings;
mod facing;
mod holes;
mod marching;
mod orientation;
mod report;
mod weld;
mod winding;
mod wrap;

pub use report::{SurfaceFault, SurfaceReport};
pub use wrap::SurfaceWrapped;

use super::fill::{check_closed, signed_volume_of};
use super::mesh_error::MeshError;
use super::surface::sorted_face;
use super::tet_mesh::TetMesh;
use holes::fill_holes;
use orientation::orient;
use rapier3d::math::Vector;
use std::collections::{BTreeMap, HashSet};
use weld::weld;

/// Triangles that enclose a solid, or are meant to: imported, checked, repaired, then filled.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// // A box without its lid, in which every triangle has corners of its own.
/// let (vertices, mut triangles) = Cuboid::new(Vector::splat(0.2)).to_trimesh();
/// triangles.truncate(10);
/// let vertices = triangles.iter().flatten().map(|v| vertices[*v as usize]).collect();
/// let triangles = (0..10).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
/// let open = SurfaceMesh { vertices, triangles };
/// println!("{}", open.report());
/// let (closed, repair) = open.repaired(&SurfaceRepair::default())?;
/// assert_eq!((repair.welded, repair.holes), (22, 1));
/// let body = DeformableBodyBuilder::mesh(&closed.filled(0.1)?).build()?;
/// assert!((body.volume() - 0.064).abs() < 1.0e-5);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Where its vertices are \[m\].
    pub vertices: Vec<Vector>,
    /// Three indices each, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// What [`SurfaceMesh::repaired`] may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceRepair {
    /// Vertices closer than this part of the surface's extent become one.
    pub weld: f32,
    /// Holes of up to so many edges are filled.
    pub hole_edges: usize,
}

impl Default for SurfaceRepair {
    fn default() -> Self {
        Self { weld: 1.0e-6, hole_edges: 64 }
    }
}

/// What [`SurfaceMesh::repaired`] has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SurfaceRepaired {
    /// Vertices that became others.
    pub welded: usize,
    /// Triangles without area, with bad vertices, or there twice, that were left out.
    pub removed: usize,
    /// Triangles that were turned round.
    pub turned: usize,
    /// Holes that were filled.
    pub holes: usize,
}

impl SurfaceMesh {
    /// The same in another unit: `1.0e-3` for a file in millimetres.
    #[must_use]
    pub fn scaled(mut self, factor: f32) -> Self {
        self.vertices.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// The same turned so that what was up along z is so along y.
    #[must_use]
    pub fn z_up_to_y_up(mut self) -> Self {
        self.vertices.iter_mut().for_each(|v| *v = Vector::new(v.x, v.z, -v.y));
        self
    }

    /// What it encloses \[m³\]; negative if it is wound inward, and of no meaning if it is open.
    pub fn volume(&self) -> f64 {
        let is_there = |triangle: &&[u32; 3]| triangle.iter().all(|v| (*v as usize) < self.vertices.len());
        let triangles: Vec<[u32; 3]> = self.triangles.iter().filter(is_there).copied().collect();
        signed_volume_of(&self.vertices, &triangles)
    }

    /// Fills it with tetrahedra, see [`TetMesh::fill_surface`].
    ///
    /// # Errors
    /// As [`TetMesh::fill_surface`].
    pub fn filled(&self, cell_size: f32) -> Result<TetMesh, MeshError> {
        TetMesh::fill_surface(&self.vertices, &self.triangles, cell_size)
    }

    /// What is wrong with it, and where.
    pub fn report(&self) -> SurfaceReport {
        SurfaceReport::new(self)
    }

    /// Made fit to be filled: vertices in one place become one, triangles that are bad or there twice are left out, all are wound
    /// outward (those of cavities inward), small holes are filled.
    ///
    /// # Errors
    /// [`MeshError::OpenSurface`] if it does not close even then: its holes are larger, or edges have three triangles and more.
    /// [`MeshError::Empty`] if nothing is left.
    pub fn repaired(&self, repair: &SurfaceRepair) -> Result<(Self, SurfaceRepaired), MeshError> {
        let mut done = SurfaceRepaired::default();
        let mut mesh = self.welded(repair.weld);
        let mut known = HashSet::new();
        mesh.triangles.retain(|triangle| known.insert(sorted_face(*triangle)));
        done.welded = self.vertices.len() - mesh.vertices.len();
        done.removed = self.triangles.len() - mesh.triangles.len();
        if mesh.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let as_given = mesh.triangles.clone();
        orient(&mut mesh, false);
        done.holes = fill_holes(&mut mesh, repair.hole_edges);
        // Which way is out is known when it is closed.
        orient(&mut mesh, true);
        done.turned = as_given.iter().zip(&mesh.triangles).filter(|(a, b)| a != b).count();
        check_closed(&mesh.vertices, &mesh.triangles)?;
        mesh.drop_unused();
        Ok((mesh, done))
    }

    /// Leaves out vertices that no triangle names.
    fn drop_unused(&mut self) {
        let mut name = vec![u32::MAX; self.vertices.len()];
        let mut kept = Vec::new();
        for vertex in self.triangles.iter_mut().flatten() {
            let own = &mut name[*vertex as usize];
            if *own == u32::MAX {
                *own = kept.len() as u32;
                kept.push(self.vertices[*vertex as usize]);
            }
            *vertex = *own;
        }
        self.vertices = kept;
    }

    /// Vertices closer than this part of the extent made one; without triangles that name a vertex twice, or one that is not
    /// there or not finite.
    #[must_use]
    pub fn welded(&self, part: f32) -> Self {
        let (vertices, index) = weld(&self.vertices, part * self.extent());
        let is_sound = |v: &u32| self.vertices.get(*v as usize).is_some_and(|v| v.is_finite());
        let sound = self.triangles.iter().filter(|t| t.iter().all(is_sound));
        let triangles = sound.map(|t| t.map(|v| index[v as usize]));
        Self { vertices, triangles: triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect() }
    }

    /// Largest distance from the middle of what is finite, along an axis \[m\].
    fn extent(&self) -> f32 {
        let finite = || self.vertices.iter().filter(|v| v.is_finite());
        let low = finite().fold(Vector::splat(f32::INFINITY), |a, b| a.min(*b));
        let high = finite().fold(Vector::splat(f32::NEG_INFINITY), |a, b| a.max(*b));
        let half = (high - low).max_element() * 0.5;
        if half.is_finite() { half } else { 0.0 }
    }

    /// Edges with the triangles that pass along them.
    fn edges(&self) -> BTreeMap<[u32; 2], EdgeUses> {
        let mut edges: BTreeMap<[u32; 2], EdgeUses> = BTreeMap::new();
        for (triangle, [a, b, c]) in self.triangles.iter().enumerate() {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                let uses = edges.entry([*p.min(q), *p.max(q)]).or_default();
                uses.forward += usize::from(p < q);
                uses.triangles.push(triangle as u32);
            }
        }
        edges
    }
}

/// The triangles on an edge.
#[derive(Clone, Debug, Default)]
struct EdgeUses {
    /// How many pass from the lower vertex to the higher.
    forward: usize,
    triangles: Vec<u32>,
}
