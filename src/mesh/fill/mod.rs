//! Closed surfaces and parry shapes filled with tetrahedra.
//!
//! A body-centred lattice is cut at the surface (`stuffing`), vertices beside creases move onto them (`snapping`), and
//! the worst tetrahedra are mended (`improvement`). The result has its boundary vertices on the surface.

mod creases;
mod domain;
mod draft;
mod improvement;
mod lattice;
mod scan;
mod snapping;
mod stuffing;
mod surface_check;

use super::mesh_error::MeshError;
use super::tet_mesh::TetMesh;
use crate::math::Vec3;
use domain::Domain;
use draft::Draft;
pub(super) use lattice::Lattice;
use parry3d::math::Vector;
use parry3d::shape::{Ball, Shape, SupportMap, TriMesh, TypedShape};
use parry3d::transformation::convex_hull;
pub(super) use surface_check::{check_closed, signed_volume_of};
use surface_check::{check_sizes, check_vertices};

/// Side of the lattice's cubes, in cells: the long edges. The short ones are 0.62 cells. With it a ball of eight cells
/// across has 99.2 % of its volume, with 0.77 98.95 %.
const CUBE: f64 = 0.72;
/// Most cubes of a lattice: 12 million tetrahedra, beyond what a step could carry.
const MOST_CUBES: f64 = 1048576.0;
/// Part of the enclosed volume by which a filling may differ; else cells are halved. A ball needs three cells across.
const OFF: f64 = 0.1;
/// How often cells are halved at the most: each time makes eight times as many.
const HALVINGS: u32 = 2;
/// Sides of a circle for creases, and where a curved shape has no surface of its own to ask: 7e-5 of the radius within.
const CIRCLE: u32 = 256;
/// Directions around the equator in which extreme points of other convex shapes are looked up.
const DIRECTIONS: u32 = 64;

impl TetMesh {
    /// Fills a closed, outward-wound triangle surface with tetrahedra of about `cell_size` \[m\]: edges of 0.62 and
    /// 0.72 cells inside, the boundary's vertices on the surface, its creases and corners kept where they turn by
    /// more than 30°. Where parts are thinner than a cell, all cells are halved, twice at the most. The volume is that of
    /// the surface to second order in the cell: 1 % at eight cells across a ball. Dihedral angles are between 15° and
    /// 151° in smooth shapes, down to 8° between sharp edges (docs/meshes.md). Surfaces that overlap are filled as one.
    ///
    /// Method: isosurface stuffing \[Labelle Shewchuk 2007\].
    ///
    /// ```
    /// use foible3d::TetMesh;
    /// use rapier3d::prelude::Ball;
    /// let mesh = TetMesh::fill_shape(&Ball::new(0.5), 0.125)?;
    /// let sphere = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
    /// assert!((mesh.volume() / sphere - 1.0).abs() < 0.01);
    /// # Ok::<(), foible3d::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::BadCellSize`], [`MeshError::NothingEnclosed`] for an empty surface or one wound inward,
    /// [`MeshError::OpenSurface`], [`MeshError::TooThin`], [`MeshError::TriangleOutOfRange`] for a bad index,
    /// [`MeshError::NotFinite`].
    pub fn fill_surface(
        vertices: &[Vector],
        triangles: &[[u32; 3]],
        cell_size: f32,
    ) -> Result<Self, MeshError> {
        check_vertices(vertices, triangles)?;
        let nothing = || MeshError::NothingEnclosed { triangles: triangles.len(), cell_size };
        let volume = signed_volume_of(vertices, triangles);
        if triangles.is_empty() || volume <= 0.0 {
            return Err(nothing());
        }
        check_closed(vertices, triangles)?;
        let mesh = TriMesh::new(vertices.to_vec(), triangles.to_vec()).map_err(|_| nothing())?;
        fill(&Domain::faceted(&mesh, volume), cell_size)
    }

    /// Fills one of parry's shapes with tetrahedra of about `cell_size` \[m\], as [`TetMesh::fill_surface`] does. Cuboids
    /// become lattices, see [`TetMesh::cuboid`].
    ///
    /// # Errors
    /// [`MeshError::NotFillable`] for shapes that enclose nothing (half-spaces, heightfields, segments,
    /// triangles) and for compounds and voxels, [`MeshError::BadSize`] for a radius or length that is not positive, else as
    /// [`TetMesh::fill_surface`].
    pub fn fill_shape(shape: &dyn Shape, cell_size: f32) -> Result<Self, MeshError> {
        check_sizes(shape)?;
        let curved = |(vertices, triangles): (Vec<Vector>, Vec<[u32; 3]>)| {
            let nothing = MeshError::NothingEnclosed { triangles: triangles.len(), cell_size };
            let mesh = TriMesh::new(vertices, triangles).map_err(|_| nothing)?;
            fill(&Domain::curved(shape, &mesh), cell_size)
        };
        let (vertices, triangles) = match shape.as_typed_shape() {
            TypedShape::Cuboid(s) => return lattice_of(s.half_extents.to_array(), cell_size),
            TypedShape::Ball(_) | TypedShape::Capsule(_) => return fill(&Domain::smooth(shape), cell_size),
            TypedShape::Cylinder(s) => return curved(s.to_trimesh(CIRCLE)),
            TypedShape::Cone(s) => return curved(s.to_trimesh(CIRCLE)),
            TypedShape::ConvexPolyhedron(s) => s.to_trimesh(),
            TypedShape::TriMesh(s) => (s.vertices().to_vec(), s.indices().to_vec()),
            _ => match shape.as_support_map() {
                Some(convex) if shape.mass_properties(1.0).mass() > 0.0 => hull_of(convex),
                _ => {
                    let shape = format!("{:?}", shape.shape_type());
                    return Err(MeshError::NotFillable { shape });
                }
            },
        };
        Self::fill_surface(&vertices, &triangles, cell_size)
    }
}

/// The hull of a convex shape's extreme points in many directions.
fn hull_of(shape: &dyn SupportMap) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let (directions, _) = Ball::new(1.0).to_trimesh(DIRECTIONS, DIRECTIONS / 2);
    let points: Vec<Vector> = directions.iter().map(|d| shape.local_support_point(*d)).collect();
    convex_hull(&points)
}

/// A cuboid's lattice with cells of about this size.
fn lattice_of(half_extents: [f32; 3], cell_size: f32) -> Result<TetMesh, MeshError> {
    let cells = half_extents.map(|e| (2.0 * e / cell_size).round().max(1.0));
    if !(cell_size > 0.0) || cells.map(f64::from).iter().product::<f64>() > MOST_CUBES {
        return Err(MeshError::BadCellSize { cell_size, extents: half_extents.map(|e| 2.0 * e) });
    }
    TetMesh::cuboid(half_extents.map(f64::from), cells.map(|c| c as usize))
}

/// The lattice of cells of this size \[m\] over a box; an error if those are too many, or none.
pub(super) fn lattice_over(low: Vec3, high: Vec3, cell_size: f32) -> Result<Lattice, MeshError> {
    let (cube, extents) = (CUBE * f64::from(cell_size), high - low);
    let cubes: f64 = extents.iter().map(|e| (e / cube).ceil() + 2.0).product();
    if !(cube > 0.0 && cubes <= MOST_CUBES) {
        let extents = [extents.x, extents.y, extents.z].map(|e| e as f32);
        return Err(MeshError::BadCellSize { cell_size, extents });
    }
    Ok(Lattice::over(low, high, cube))
}

/// Fills with cells of this size, or smaller ones where they hold too little or too much.
fn fill(domain: &Domain, cell_size: f32) -> Result<TetMesh, MeshError> {
    let (mut filled, mut tried) = (0.0, cell_size);
    for halving in 0..=HALVINGS {
        let size = cell_size / (1 << halving) as f32;
        let lattice = match lattice_over(domain.low, domain.high, size) {
            Ok(lattice) => lattice,
            Err(_) if halving > 0 => break,
            Err(error) => return Err(error),
        };
        let cube = lattice.a;
        let (is_inside, overlaps) = domain.inside(&lattice);
        let mut draft = Draft::new(stuffing::stuff(domain, &lattice, &is_inside), domain);
        snapping::snap_to_creases(&mut draft, domain, cube);
        (filled, tried) = (draft.volume(), size);
        // What overlaps is enclosed more than once.
        if filled > 0.0 && (overlaps || (filled / domain.volume - 1.0).abs() < OFF) {
            finish(&mut draft, domain, cube);
            let points = draft.points.iter().map(|&x| x.into()).collect();
            return TetMesh::new(points, draft.tetrahedra);
        }
    }
    Err(MeshError::TooThin { cell_size: tried, volume: domain.volume, filled })
}

/// Mends tetrahedra and what still lies across a crease, in turn.
fn finish(draft: &mut Draft, domain: &Domain, cube: f64) {
    improvement::improve(draft, domain, cube);
    snapping::snap_to_creases(draft, domain, cube);
    improvement::improve(draft, domain, cube);
    for _ in 0..2 {
        snapping::split_at_creases(draft, domain, cube);
        draft.find_skin();
        improvement::improve(draft, domain, cube);
    }
}
