//! Heightfields and voxels as triangle meshes, which project points faster and tell faces, rims and corners; and which
//! vertices of a mesh are corners.

use parry3d::bounding_volume::Aabb;
use parry3d::math::{IVector, Vector};
use parry3d::shape::{SharedShape, TriMeshFlags, TypedShape, Voxels};
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::sync::Arc;

/// The meshes of a world's shapes, made when they are first seen and kept while they are.
#[derive(Default)]
pub(super) struct ShapeMeshes {
    /// By address.
    meshes: HashMap<usize, Kept>,
    seen: HashSet<usize>,
}

struct Kept {
    /// Kept so that its address stays its own.
    _shape: SharedShape,
    mesh: SharedShape,
    corners: Arc<[u32]>,
}

impl ShapeMeshes {
    /// Begins a step.
    pub fn begin(&mut self) {
        self.seen.clear();
    }

    /// Forgets what the step has not seen.
    pub fn finish(&mut self) {
        let seen = &self.seen;
        self.meshes.retain(|address, _| seen.contains(address));
    }

    /// The shape, or the mesh that it is better read as; of a mesh the vertices that are corners, ascending.
    pub fn mesh_of(&mut self, shape: SharedShape) -> (SharedShape, Option<Arc<[u32]>>) {
        use TypedShape::{HeightField, TriMesh, Voxels};
        if !matches!(shape.as_typed_shape(), HeightField(_) | Voxels(_) | TriMesh(_)) {
            return (shape, None);
        }
        let address = Arc::as_ptr(&shape.0).cast::<()>() as usize;
        self.seen.insert(address);
        let kept = self.meshes.entry(address).or_insert_with(|| {
            let mesh = made(&shape).unwrap_or_else(|| shape.clone());
            let corners = corners_of(&mesh).into();
            Kept { _shape: shape, mesh, corners }
        });
        (kept.mesh.clone(), Some(kept.corners.clone()))
    }
}

fn made(shape: &SharedShape) -> Option<SharedShape> {
    match shape.as_typed_shape() {
        TypedShape::HeightField(field) => {
            let (vertices, triangles) = field.to_trimesh();
            SharedShape::trimesh(vertices, triangles).ok()
        }
        // Their free faces bound a solid.
        TypedShape::Voxels(voxels) => {
            let (vertices, triangles) = free_faces(voxels);
            SharedShape::trimesh_with_flags(vertices, triangles, TriMeshFlags::ORIENTED).ok()
        }
        _ => None,
    }
}

/// The free faces of voxels, two triangles each. Vertices are those of the grid, so that neighbours share them: parry's
/// own mesh computes each from its voxel's centre, where roundings keep equal ones apart.
fn free_faces(voxels: &Voxels) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let mut known: HashMap<[i32; 3], u32> = HashMap::new();
    let corners = Aabb::new(Vector::ZERO, Vector::ONE).vertices();
    for voxel in voxels.voxels() {
        let faces = voxel.state.free_faces();
        for (k, &(a, b, c, d)) in Aabb::FACES_VERTEX_IDS.iter().enumerate() {
            if faces.bits() & (1 << k) == 0 {
                continue;
            }
            let [a, b, c, d] = [a, b, c, d].map(|corner| {
                let at = voxel.grid_coords + corners[corner].as_ivec3();
                *known.entry(at.to_array()).or_insert_with(|| {
                    vertices.push(grid_point(voxels, at));
                    vertices.len() as u32 - 1
                })
            });
            // Outward: parry lists every other face the other way round.
            let own = if k % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
            triangles.extend(own);
        }
    }
    (vertices, triangles)
}

/// The lower corner of the voxel at these coordinates \[m\].
fn grid_point(voxels: &Voxels, at: IVector) -> Vector {
    voxels.voxel_center(at) - voxels.voxel_size() * 0.5
}

/// Sine below which triangles count as coplanar: of meshes in single precision.
const COPLANAR: f32 = 1.0e-3;

/// What the triangles around a vertex say of it.
#[derive(Clone, Copy, Default)]
struct Fan {
    /// Unit normal of the first of them.
    first: Vector,
    /// Longest cross product of that with another normal.
    across: Vector,
    is_folded: bool,
    /// Not all normals are across one line.
    spans_space: bool,
    /// Hashes of the far ends of edges, by exclusive or: an edge of two triangles cancels itself.
    parity: u64,
}

/// Vertices of a mesh that can press a point into a face: all but those within a plane face or along a straight edge of
/// a surface that goes on around them. Ascending.
fn corners_of(mesh: &SharedShape) -> Vec<u32> {
    let Some(mesh) = mesh.as_trimesh() else { return Vec::new() };
    let normals: Vec<Vector> = mesh.triangles().map(|t| t.scaled_normal().normalize_or_zero()).collect();
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    let mut fans = vec![Fan::default(); mesh.vertices().len()];
    for (&triangle, &normal) in mesh.indices().iter().zip(&normals) {
        let [a, b, c] = triangle;
        for (vertex, ends) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            let fan = &mut fans[vertex as usize];
            fan.parity ^= hasher.hash_one(ends[0]) ^ hasher.hash_one(ends[1]);
            if fan.first == Vector::ZERO {
                fan.first = normal;
            }
            let across = fan.first.cross(normal);
            if across.length_squared() > fan.across.length_squared() {
                fan.across = across;
            }
            fan.is_folded |= fan.first.dot(normal) < 0.0;
        }
    }
    for (triangle, normal) in mesh.indices().iter().zip(&normals) {
        for &vertex in triangle {
            let fan = &mut fans[vertex as usize];
            fan.spans_space |= normal.dot(fan.across.normalize_or_zero()).abs() > COPLANAR;
        }
    }
    let is_corner = |fan: &Fan| {
        let is_plane = fan.across.length() <= COPLANAR;
        let has_shape = if is_plane { fan.is_folded } else { fan.spans_space };
        fan.first != Vector::ZERO && (fan.parity != 0 || has_shape)
    };
    (0..).zip(&fans).filter(|(_, fan)| is_corner(fan)).map(|(vertex, _)| vertex).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::shape::Cuboid;

    fn corners(shape: SharedShape) -> Vec<Vector> {
        let (mesh, corners) = ShapeMeshes::default().mesh_of(shape);
        let mesh = mesh.as_trimesh().unwrap();
        corners.unwrap().iter().map(|&n| mesh.vertices()[n as usize]).collect()
    }

    #[test]
    fn corners_of_a_floor_of_voxels_are_those_of_its_box() {
        // 0.1 is no power of two: computed from the centres, vertices of neighbours differ.
        let cells: Vec<IVector> = (0..6)
            .flat_map(|x| (0..2).flat_map(move |y| (0..5).map(move |z| IVector::new(x, y, z))))
            .collect();
        let found = corners(SharedShape::voxels(Vector::splat(0.1), &cells));
        assert_eq!(found.len(), 8, "{found:?}");
        let size = Vector::new(0.6, 0.2, 0.5);
        for corner in found {
            // 3 ulp of 0.6.
            assert!((corner.min(size - corner)).abs().max_element() < 2e-7, "{corner}");
        }
    }

    #[test]
    fn a_step_of_voxels_has_twelve_corners() {
        let cells = [IVector::ZERO, IVector::new(1, 0, 0), IVector::new(0, 1, 0)];
        // Six above and below each of the two sides of an L: the inner one is a corner too.
        assert_eq!(corners(SharedShape::voxels(Vector::splat(0.3), &cells)).len(), 12);
    }

    #[test]
    fn vertices_within_a_flat_floor_are_no_corners_and_those_at_its_border_are() {
        let at = |x: u32, z: u32| 4 * z + x;
        let vertices = (0..16).map(|k| Vector::new((k % 4) as f32, 0.0, (k / 4) as f32)).collect();
        let cells = (0..3).flat_map(|x| (0..3).map(move |z| (x, z)));
        let triangles = cells.flat_map(|(x, z)| {
            [[at(x, z), at(x, z + 1), at(x + 1, z)], [at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)]]
        });
        let found = corners(SharedShape::trimesh(vertices, triangles.collect()).unwrap());
        assert_eq!(found.len(), 12);
    }

    #[test]
    fn slivers_and_folds_hide_no_corners() {
        let (points, mut triangles) = Cuboid::new(Vector::splat(0.5)).to_trimesh();
        triangles.splice(0..0, (0..8).map(|n| [n, n, (n + 1) % 8]));
        assert_eq!(corners(SharedShape::trimesh(points, triangles).unwrap()).len(), 8);
        // Both sides of a square, without thickness.
        let square = [Vector::ZERO, Vector::X, Vector::X + Vector::Y, Vector::Y].to_vec();
        let sides = vec![[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]];
        assert_eq!(corners(SharedShape::trimesh(square, sides).unwrap()).len(), 4);
    }
}
