//! What can be wrong with a mesh.

use std::path::Path;
use thiserror::Error;

/// What is wrong with a mesh.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// No elements at all.
    #[error("the mesh has no elements")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is not finite: {position:?}")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Its position \[m\].
        position: [f64; 3],
    },
    /// Too small or too large for what `f32` and gravity make of metres.
    #[error("the mesh is {extent:e} m across: what is simulated is between 1e-6 and 1e6 m")]
    Extent {
        /// Its largest extent along an axis \[m\].
        extent: f64,
    },
    /// An index points outside the vertex list.
    #[error("tetrahedron {tet} refers to vertex {vertex}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the tetrahedron.
        tet: usize,
        /// The index it holds.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A triangle of a surface to be filled, or of a sheet, points outside the vertex list.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are {vertices} vertices")]
    TriangleOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index it holds.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A tetrahedron names one vertex twice.
    #[error("tetrahedron {tet} uses vertex {vertex} twice")]
    RepeatedVertex {
        /// Index of the tetrahedron.
        tet: usize,
        /// The repeated vertex.
        vertex: u32,
    },
    /// A triangle of a sheet names a vertex twice.
    #[error("triangle {triangle} names vertex {vertex} twice")]
    RepeatedInTriangle {
        /// Index of the triangle.
        triangle: usize,
        /// The repeated vertex.
        vertex: u32,
    },
    /// A triangle is in a sheet twice.
    #[error("triangle {triangle} is there twice: {vertices:?}")]
    RepeatedTriangle {
        /// Index of the second one.
        triangle: usize,
        /// Its vertices, ascending.
        vertices: [u32; 3],
    },
    /// A triangle of a sheet without area to speak of.
    #[error("triangle {triangle} is flat (area {area:e} m² with a longest edge of {edge:e} m)")]
    FlatTriangle {
        /// Index of the triangle.
        triangle: usize,
        /// Its area \[m²\].
        area: f64,
        /// Its longest edge \[m\].
        edge: f64,
    },
    /// A direction of the warp that is none in the plane of its triangle.
    #[error("the warp {direction:?} of triangle {triangle} is normal to it, or not finite")]
    BadWarp {
        /// Index of the triangle.
        triangle: usize,
        /// The direction given.
        direction: [f64; 3],
    },
    /// A rod or spring ends outside the vertex list.
    #[error("the edge {ends:?} refers to vertex {vertex}, but there are {vertices} vertices")]
    EndOutOfRange {
        /// Vertices of the edge.
        ends: [u32; 2],
        /// The index that is out of range.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A rod or spring without length to speak of.
    #[error("the edge {ends:?} has no length ({length:e} m)")]
    ShortEdge {
        /// Vertices of the edge.
        ends: [u32; 2],
        /// Its length \[m\].
        length: f64,
    },
    /// A thickness, radius or cross-section that is not a positive number.
    #[error("{quantity} is {value}, but must be positive and finite")]
    BadSize {
        /// What was given.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// Negative orientation.
    #[error("tetrahedron {tet} is inverted (signed volume {volume:e} m³)")]
    Inverted {
        /// Index of the tetrahedron.
        tet: usize,
        /// Its signed volume \[m³\].
        volume: f64,
    },
    /// No volume to speak of.
    #[error("tetrahedron {tet} is flat (volume {volume:e} m³ with a longest edge of {edge:e} m)")]
    Flat {
        /// Index of the tetrahedron.
        tet: usize,
        /// Its volume \[m³\].
        volume: f64,
        /// Its longest edge \[m\].
        edge: f64,
    },
    /// Not one region per element.
    #[error("{regions} regions for {elements} elements")]
    RegionCount {
        /// How many regions were given.
        regions: usize,
        /// How many elements there are.
        elements: usize,
    },
    /// A region that was to be rigid has no tetrahedra, or sheets, rods or springs too.
    #[error("region {region} cannot be rigid: it must have tetrahedra, and nothing else")]
    RegionNotSolid {
        /// The region.
        region: u32,
    },
    /// Two regions that were to be rigid meet.
    #[error("regions {regions:?} cannot both be rigid: they share vertex {vertex}; make them one region")]
    RegionsTouch {
        /// The regions.
        regions: [u32; 2],
        /// The vertex.
        vertex: usize,
    },
    /// A vertex that no tetrahedron uses has no mass.
    #[error("vertex {vertex} belongs to no tetrahedron")]
    UnusedVertex {
        /// Index of the vertex.
        vertex: usize,
    },
    /// Three or more tetrahedra meet in one face.
    #[error("{count} tetrahedra share the face {face:?}")]
    NonManifoldFace {
        /// Vertices of the face, ascending.
        face: [u32; 3],
        /// Number of tetrahedra on it.
        count: usize,
    },
    /// The boundary surface branches, or closes on itself, in an edge.
    #[error("{count} boundary triangles meet in the edge {edge:?}: the surface is not manifold")]
    NonManifoldEdge {
        /// Vertices of the edge, ascending.
        edge: [u32; 2],
        /// Number of boundary triangles on it; two would be right.
        count: usize,
    },
    /// A lattice without cells or extent.
    #[error("a cuboid of {cells:?} cells and half extents {half_extents:?} m has no volume")]
    BadLattice {
        /// Requested cells per axis.
        cells: [usize; 3],
        /// Requested half extents \[m\].
        half_extents: [f64; 3],
    },
    /// More vertices than 32-bit indices can name.
    #[error("a mesh of {vertices} vertices does not fit 32-bit indices")]
    TooLarge {
        /// Requested number of vertices.
        vertices: usize,
    },
    /// A cell size that is not a positive number, or so small that there would be more than 2²⁰ cubes of cells.
    #[error("cell size {cell_size} m does not fill a shape of extents {extents:?} m")]
    BadCellSize {
        /// Requested cell size \[m\].
        cell_size: f32,
        /// Extents of the shape's bounding box \[m\].
        extents: [f32; 3],
    },
    /// The surface encloses nothing that could be filled.
    #[error("the surface of {triangles} triangles encloses no volume at cell size {cell_size} m")]
    NothingEnclosed {
        /// Triangles of the surface.
        triangles: usize,
        /// Requested cell size \[m\].
        cell_size: f32,
    },
    /// Parts of the surface are thinner than the cells, also than those of a quarter of the size.
    #[error(
        "of {volume:e} m³ {filled:e} m³ are filled with cells of {cell_size} m: parts are thinner, choose a smaller size"
    )]
    TooThin {
        /// Smallest cell size that was tried \[m\].
        cell_size: f32,
        /// What the surface encloses \[m³\].
        volume: f64,
        /// What the cells fill of it \[m³\].
        filled: f64,
    },
    /// A wrap leaves parts of the surface outside.
    #[error(
        "{lost:e} m² of {area:e} m² enclose nothing at a cell size of {cell_size} m: they are sheets, or thinner than a cell"
    )]
    NotWrapped {
        /// Requested cell size \[m\].
        cell_size: f32,
        /// Area of all triangles \[m²\].
        area: f64,
        /// Area of those that are more than a cell from the wrap and outside of it \[m²\].
        lost: f64,
    },
    /// A surface with borders, or with neighbouring triangles that are not wound alike.
    #[error("the surface does not close: {edges} edges have no neighbour wound alike, the first at {at:?} m")]
    OpenSurface {
        /// Number of such edges.
        edges: usize,
        /// Middle of the first \[m\].
        at: [f64; 3],
    },
    /// A shape that cannot be filled.
    #[error("a shape of type {shape} is not one that can be filled with tetrahedra")]
    NotFillable {
        /// Name of the shape's type.
        shape: String,
    },
    /// A mesh file that cannot be read.
    #[error("mesh file {path}: {reason}")]
    File {
        /// The file as it was named.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl MeshError {
    /// Of a file, as it was named.
    pub(crate) fn file(path: &Path, reason: impl ToString) -> Self {
        Self::File { path: path.display().to_string(), reason: reason.to_string() }
    }
}
