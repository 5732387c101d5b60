//! What is wrong with a surface, and where.

use super::SurfaceMesh;
use super::crossings::crossings;
use super::holes::loops;
use super::orientation::wind_alike;
use super::weld::weld;
use crate::math::{Vec3, from_real};
use crate::mesh::sorted_face;
use std::collections::HashMap;
use std::fmt;

/// One thing that is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SurfaceFault {
    /// A triangle names a vertex that is not there.
    VertexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
    },
    /// A vertex is NaN or infinite.
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle without area.
    NoArea {
        /// Index of the triangle.
        triangle: usize,
        /// Its middle \[m\].
        at: [f64; 3],
    },
    /// A triangle with the same corners as another.
    Duplicate {
        /// Index of the triangle.
        triangle: usize,
        /// Its middle \[m\].
        at: [f64; 3],
    },
    /// A hole.
    Hole {
        /// Edges around it.
        edges: usize,
        /// Their middle \[m\].
        at: [f64; 3],
    },
    /// Three triangles and more on an edge.
    NonManifold {
        /// How many.
        triangles: usize,
        /// Middle of the edge \[m\].
        at: [f64; 3],
    },
    /// A triangle that is wound against most of its piece.
    Flipped {
        /// Index of the triangle.
        triangle: usize,
        /// Its middle \[m\].
        at: [f64; 3],
    },
    /// Two triangles that cross.
    Crossing {
        /// Their indices.
        triangles: [usize; 2],
        /// Where an edge of one goes through the other \[m\].
        at: [f64; 3],
    },
}

/// What is wrong with a [`SurfaceMesh`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SurfaceReport {
    /// Number of vertices, and of triangles.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Vertices in the place of others: no fault, along seams of textures and in STL.
    pub welded: usize,
    /// Pieces that share no vertex.
    pub pieces: usize,
    /// What it encloses \[m³\].
    pub volume: f64,
    /// What is wrong with it once vertices in one place are one; of crossings the first thousand.
    pub faults: Vec<SurfaceFault>,
}

/// Most crossings that are listed.
const CROSSINGS: usize = 1000;

/// Distance, in parts of the extent, up to which vertices are in one place.
const WELD: f32 = 1.0e-6;

impl SurfaceReport {
    /// Of a surface.
    pub(super) fn new(mesh: &SurfaceMesh) -> Self {
        let mut faults = Vec::new();
        let is_there = |t: &[u32; 3]| t.iter().all(|v| (*v as usize) < mesh.vertices.len());
        for (triangle, _) in mesh.triangles.iter().enumerate().filter(|(_, t)| !is_there(t)) {
            faults.push(SurfaceFault::VertexOutOfRange { triangle });
        }
        for (vertex, _) in mesh.vertices.iter().enumerate().filter(|(_, v)| !v.is_finite()) {
            faults.push(SurfaceFault::NotFinite { vertex });
        }
        let (vertices, index) = weld(&mesh.vertices, WELD * mesh.extent());
        let welded = mesh.vertices.len() - vertices.len();
        // Places of the triangles that are looked at further.
        let (mut own, mut kept) = (Vec::new(), SurfaceMesh { vertices, triangles: Vec::new() });
        let mut first = HashMap::new();
        let finite = |t: &[u32; 3]| t.iter().all(|v| mesh.vertices[*v as usize].is_finite());
        for (triangle, corners) in mesh.triangles.iter().enumerate().filter(|(_, t)| is_there(t) && finite(t))
        {
            let corners = corners.map(|v| index[v as usize]);
            let at = kept.middle(&corners).into();
            if !kept.has_area(&corners) {
                faults.push(SurfaceFault::NoArea { triangle, at });
            } else if first.insert(sorted_face(corners), triangle).is_some() {
                faults.push(SurfaceFault::Duplicate { triangle, at });
            } else {
                kept.triangles.push(corners);
                own.push(triangle);
            }
        }
        let pieces = kept.add_faults(&own, &mut faults);
        let (volume, triangles) = (kept.volume(), mesh.triangles.len());
        Self { vertices: mesh.vertices.len(), triangles, welded, pieces, volume, faults }
    }

    /// Whether it can be filled as it is.
    pub fn is_sound(&self) -> bool {
        self.faults.is_empty() && self.volume > 0.0
    }
}

impl SurfaceMesh {
    fn middle(&self, triangle: &[u32; 3]) -> Vec3 {
        triangle.iter().map(|v| from_real(self.vertices[*v as usize])).sum::<Vec3>() / 3.0
    }

    fn has_area(&self, triangle: &[u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|v| from_real(self.vertices[v as usize]));
        (b - a).cross(&(c - a)).norm_squared() > 0.0
    }

    /// Of welded triangles, the `k`-th of which is `own[k]` of the mesh. The number of pieces.
    fn add_faults(&self, own: &[usize], faults: &mut Vec<SurfaceFault>) -> usize {
        let at = |v: &u32| from_real(self.vertices[*v as usize]);
        for ([a, b], uses) in self.edges() {
            if uses.triangles.len() > 2 {
                let middle = (at(&a) + at(&b)) * 0.5;
                faults.push(SurfaceFault::NonManifold { triangles: uses.triangles.len(), at: middle.into() });
            }
        }
        let mut alike = self.clone();
        let pieces = wind_alike(&mut alike);
        for (k, (before, after)) in self.triangles.iter().zip(&alike.triangles).enumerate() {
            if before != after {
                faults.push(SurfaceFault::Flipped { triangle: own[k], at: self.middle(before).into() });
            }
        }
        for hole in loops(&alike) {
            let middle = hole.iter().map(at).sum::<Vec3>() / hole.len() as f64;
            faults.push(SurfaceFault::Hole { edges: hole.len(), at: middle.into() });
        }
        for ([i, j], at) in crossings(self, CROSSINGS) {
            let triangles = [own[i as usize], own[j as usize]];
            faults.push(SurfaceFault::Crossing { triangles, at: at.into() });
        }
        pieces.len()
    }
}

impl fmt::Display for SurfaceFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::VertexOutOfRange { triangle } => {
                write!(f, "triangle {triangle} names a vertex that is not there")
            }
            Self::NotFinite { vertex } => write!(f, "vertex {vertex} is not finite"),
            Self::NoArea { triangle, at } => write!(f, "triangle {triangle} has no area, at {at:.6?} m"),
            Self::Duplicate { triangle, at } => {
                write!(f, "triangle {triangle} is there twice, at {at:.6?} m")
            }
            Self::Hole { edges, at } => write!(f, "a hole of {edges} edges around {at:.6?} m"),
            Self::NonManifold { triangles, at } => {
                write!(f, "an edge with {triangles} triangles, at {at:.6?} m")
            }
            Self::Flipped { triangle, at } => {
                write!(f, "triangle {triangle} is wound against its neighbours, at {at:.6?} m")
            }
            Self::Crossing { triangles: [i, j], at } => {
                write!(f, "triangles {i} and {j} cross, at {at:.6?} m")
            }
        }
    }
}

/// A line for the whole, and one for each of the first faults of a kind.
impl fmt::Display for SurfaceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Faults of a kind that are told one by one.
        const TOLD: usize = 5;
        let Self { vertices, triangles, welded, pieces, volume, faults } = self;
        write!(
            f,
            "{vertices} vertices ({welded} in the place of others), {triangles} triangles, {pieces} pieces, {volume:.6e} m³: {} faults",
            faults.len()
        )?;
        let mut told = HashMap::new();
        for fault in faults {
            let count: &mut usize = told.entry(std::mem::discriminant(fault)).or_default();
            *count += 1;
            match *count {
                1..=TOLD => write!(f, "\n  {fault}")?,
                count if count == TOLD + 1 => write!(f, "\n  … and more of the kind")?,
                _ => {}
            }
        }
        Ok(())
    }
}
