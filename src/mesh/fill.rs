//! Closed surfaces and parry shapes filled with tetrahedra.

use super::surface::{EdgeUse, boundary_triangles, edge_uses};
use super::tet_mesh::{MeshError, TetMesh};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::shape::{Ball, Shape, SupportMap, TypedShape};
use parry3d::transformation::{VolumeMeshParameters, convex_hull, volume_mesh};

/// Subdivisions of a full circle when a curved shape is turned into triangles.
const CIRCLE: u32 = 24;
/// Shrink-wrap passes that pull the blocky cover onto the surface, and how far off it they stay,
/// in cells. The tightest wrap cuts deep into boxes (parry 0.31 leaves 0.63 of the volume of a
/// 1 × 0.6 × 0.4 box in 0.1 cells), so the first one that keeps the volume is taken.
const WRAPS: [(u32, f32); 3] = [(8, 0.15), (8, 0.5), (0, 0.5)];
/// Part of the enclosed volume that a wrap has to keep.
const KEPT: f32 = 0.98;
/// Cells per axis at the most: 2²⁴ cells are beyond what a step could carry.
const MAX_CELLS: f32 = 256.0;

impl TetMesh {
    /// Fills a closed, outward-wound triangle surface with tetrahedra of about `cell_size` \[m\]
    /// (parry's lattice cover, pulled towards the surface). The result covers the surface to within a
    /// fraction of a cell.
    ///
    /// # Errors
    /// [`MeshError::BadCellSize`], [`MeshError::NothingEnclosed`] for an open or empty surface,
    /// [`MeshError::TriangleOutOfRange`] for a bad index.
    pub fn fill_surface(
        vertices: &[Vector],
        triangles: &[[u32; 3]],
        cell_size: f32,
    ) -> Result<Self, MeshError> {
        for (k, &vertex) in triangles.iter().flatten().enumerate() {
            if vertex as usize >= vertices.len() {
                let (triangle, vertices) = (k / 3, vertices.len());
                return Err(MeshError::TriangleOutOfRange { triangle, vertex, vertices });
            }
        }
        if let Some(vertex) = vertices.iter().position(|v| !v.is_finite()) {
            let position = vertices[vertex].to_array().map(f64::from);
            return Err(MeshError::NotFinite { vertex, position });
        }
        let nothing = MeshError::NothingEnclosed { triangles: triangles.len(), cell_size };
        let volume = signed_volume_of(vertices, triangles);
        if triangles.is_empty() || volume <= 0.0 {
            return Err(nothing);
        }
        let extents = Aabb::from_points(vertices.iter().copied()).extents();
        let fits = |e: f32| e <= MAX_CELLS * cell_size;
        if !(cell_size > 0.0 && extents.to_array().into_iter().all(fits)) {
            let extents = extents.to_array();
            return Err(MeshError::BadCellSize { cell_size, extents });
        }
        let mut wraps = WRAPS.iter().filter_map(|&(smoothing, guard)| {
            let mut parameters = VolumeMeshParameters::new(cell_size);
            (parameters.cover_smoothing, parameters.cover_guard) = (smoothing, guard);
            let mesh = volume_mesh(vertices, triangles, &parameters)?;
            let of_cell = |c: &[u32; 4]| {
                let [a, b, c, d] = c.map(|i| mesh.vertices[i as usize]);
                (b - a).cross(c - a).dot(d - a) / 6.0
            };
            let kept = mesh.cells.iter().map(of_cell).sum::<f32>() >= KEPT * volume;
            kept.then_some(mesh)
        });
        let mut filled = wraps.next().ok_or(nothing)?;
        open_branching_edges(&mut filled.cells);
        filled.compact();
        let points = filled.vertices.iter().map(|v| v.to_array().map(f64::from)).collect();
        TetMesh::new(points, filled.cells)
    }

    /// Fills one of parry's shapes with tetrahedra of about `cell_size` \[m\].
    ///
    /// # Errors
    /// [`MeshError::NotFillable`] for shapes that enclose nothing (half-spaces, heightfields, segments,
    /// triangles) and for compounds and voxels, [`MeshError::BadSize`] for a radius or length that is not positive, else as
    /// [`TetMesh::fill_surface`].
    pub fn fill_shape(shape: &dyn Shape, cell_size: f32) -> Result<Self, MeshError> {
        check_sizes(shape)?;
        let (vertices, triangles) = match shape.as_typed_shape() {
            TypedShape::Ball(s) => s.to_trimesh(CIRCLE, CIRCLE / 2),
            TypedShape::Cuboid(s) => s.to_trimesh(),
            TypedShape::Capsule(s) => s.to_trimesh(CIRCLE, CIRCLE / 2),
            TypedShape::Cylinder(s) => s.to_trimesh(CIRCLE),
            TypedShape::Cone(s) => s.to_trimesh(CIRCLE),
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

/// A capsule has two ends, in any order, and no sign of its length.
fn check_sizes(shape: &dyn Shape) -> Result<(), MeshError> {
    let radius = |radius: f32| [("radius", radius); 3];
    let sizes = match shape.as_typed_shape() {
        TypedShape::Ball(s) => radius(s.radius),
        TypedShape::Capsule(s) => radius(s.radius),
        TypedShape::Cuboid(s) => s.half_extents.to_array().map(|e| ("half extent", e)),
        TypedShape::Cylinder(s) => {
            [("radius", s.radius), ("half height", s.half_height), ("radius", s.radius)]
        }
        TypedShape::Cone(s) => [("radius", s.radius), ("half height", s.half_height), ("radius", s.radius)],
        _ => return Ok(()),
    };
    let bad = sizes.into_iter().find(|(_, size)| !(size.is_finite() && *size > 0.0));
    bad.map_or(Ok(()), |(quantity, value)| Err(MeshError::BadSize { quantity, value: value.into() }))
}

/// The hull of a convex shape's extreme points in many directions.
fn hull_of(shape: &dyn SupportMap) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let (directions, _) = Ball::new(1.0).to_trimesh(CIRCLE, CIRCLE / 2);
    let points: Vec<Vector> = directions.iter().map(|d| shape.local_support_point(*d)).collect();
    convex_hull(&points)
}

/// Removes tetrahedra where the boundary branches: cells of the cover that meet in nothing but an
/// edge. The smaller of the fans around such an edge goes, until there is no such edge.
fn open_branching_edges(cells: &mut Vec<[u32; 4]>) {
    loop {
        let Ok(boundary) = boundary_triangles(cells) else { return };
        let branching = edge_uses(&boundary).into_iter().find(|u| u.count != 2);
        let Some(EdgeUse { edge, .. }) = branching else { return };
        let mut fans: Vec<Vec<usize>> = Vec::new();
        for (k, cell) in cells.iter().enumerate() {
            if !edge.iter().all(|e| cell.contains(e)) {
                continue;
            }
            // Neighbours in a fan share a face: three vertices.
            let shares_face = |&j: &usize| cells[j].iter().filter(|v| cell.contains(v)).count() == 3;
            let (near, mut far): (Vec<_>, Vec<_>) =
                fans.drain(..).partition(|fan| fan.iter().any(shares_face));
            far.push(near.into_iter().flatten().chain([k]).collect());
            fans = far;
        }
        let Some(mut smallest) = fans.into_iter().min_by_key(|fan| (fan.len(), fan[0])) else {
            return;
        };
        smallest.sort_unstable();
        for k in smallest.into_iter().rev() {
            cells.swap_remove(k);
        }
    }
}

fn signed_volume_of(vertices: &[Vector], triangles: &[[u32; 3]]) -> f32 {
    let volume = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| vertices[i as usize] - vertices[0]);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(volume).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::shape::{Capsule, Cone, Cuboid, Cylinder, HalfSpace, RoundShape, Segment};

    #[test]
    fn filled_shapes_contain_their_volume_and_little_more() {
        let round = RoundShape { inner_shape: Cuboid::new(Vector::splat(0.3)), border_radius: 0.1 };
        // A box of half extent a under a border r: its volume is (2a)³ + 6(2a)²r + 6aπr² + 4πr³/3, which
        // parry's mass properties leave the border out of.
        let filled = TetMesh::fill_shape(&round, 0.1).unwrap().volume() / 0.4927;
        assert!((0.97..1.35).contains(&filled), "round cuboid: {filled}");
        let shapes: [(&dyn Shape, f32); 5] = [
            (&Ball::new(0.5), 0.1),
            (&Cuboid::new(Vector::new(0.5, 0.3, 0.2)), 0.1),
            (&Capsule::new_y(0.4, 0.25), 0.08),
            (&Cylinder::new(0.5, 0.3), 0.1),
            (&Cone::new(0.5, 0.4), 0.1),
        ];
        for (shape, cell) in shapes {
            let mesh = TetMesh::fill_shape(shape, cell).unwrap();
            let volume = shape.mass_properties(1.0).mass() as f64;
            let ratio = mesh.volume() / volume;
            // A cover overshoots by at most about half a cell on each side.
            assert!((0.97..1.35).contains(&ratio), "{:?}: {ratio}", shape.shape_type());
        }
    }

    #[test]
    fn shapes_and_surfaces_that_enclose_nothing_are_refused() {
        let plane = HalfSpace::new(Vector::Y);
        assert!(matches!(TetMesh::fill_shape(&plane, 0.1), Err(MeshError::NotFillable { .. })));
        let negative: [&dyn Shape; 4] = [
            &Ball::new(-0.5),
            &Cylinder { half_height: -0.5, radius: 0.3 },
            &Cone { half_height: 0.5, radius: 0.0 },
            &Capsule { segment: Segment::new(Vector::ZERO, Vector::Y), radius: f32::NAN },
        ];
        for shape in negative {
            assert!(matches!(TetMesh::fill_shape(shape, 0.1), Err(MeshError::BadSize { .. })));
        }
        let open = [Vector::ZERO, Vector::X, Vector::Y];
        assert!(matches!(
            TetMesh::fill_surface(&open, &[[0, 1, 2]], 0.1),
            Err(MeshError::NothingEnclosed { .. })
        ));
        for cell in [0.0, -1.0, f32::NAN, 1e-6] {
            let refused = TetMesh::fill_shape(&Ball::new(0.5), cell);
            assert!(matches!(refused, Err(MeshError::BadCellSize { .. })), "{cell}");
        }
    }
}
