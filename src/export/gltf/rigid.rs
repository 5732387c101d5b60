//! Triangles of colliders' shapes.

use parry3d::shape::{Shape, TypedShape};
use rapier3d::math::Vector;

/// Segments around round shapes.
const AROUND: u32 = 24;
/// Half the side of the square that stands for a half-space \[m\].
const HALF_SPACE: f32 = 10.0;

type Triangles = (Vec<Vector>, Vec<[u32; 3]>);

/// Of shapes that have some; of rounded ones without their rim.
pub(super) fn triangles(shape: &dyn Shape) -> Option<Triangles> {
    Some(match shape.as_typed_shape() {
        TypedShape::Ball(s) => s.to_trimesh(AROUND, AROUND / 2),
        TypedShape::Cuboid(s) => s.to_trimesh(),
        TypedShape::Capsule(s) => s.to_trimesh(AROUND, AROUND / 4),
        TypedShape::Cylinder(s) => s.to_trimesh(AROUND),
        TypedShape::Cone(s) => s.to_trimesh(AROUND),
        TypedShape::RoundCuboid(s) => s.inner_shape.to_trimesh(),
        TypedShape::RoundCylinder(s) => s.inner_shape.to_trimesh(AROUND),
        TypedShape::RoundCone(s) => s.inner_shape.to_trimesh(AROUND),
        TypedShape::ConvexPolyhedron(s) => s.to_trimesh(),
        TypedShape::RoundConvexPolyhedron(s) => s.inner_shape.to_trimesh(),
        TypedShape::TriMesh(s) => (s.vertices().to_vec(), s.indices().to_vec()),
        TypedShape::HeightField(s) => s.to_trimesh(),
        TypedShape::Voxels(s) => s.to_trimesh(),
        TypedShape::Triangle(s) => (vec![s.a, s.b, s.c], vec![[0, 1, 2]]),
        TypedShape::HalfSpace(s) => {
            let (a, b) = s.normal.any_orthonormal_pair();
            let corner = |x: f32, y: f32| (a * x + b * y) * HALF_SPACE;
            let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            (corners, vec![[0, 1, 2], [0, 2, 3]])
        }
        TypedShape::Compound(s) => {
            let (mut vertices, mut all) = (Vec::new(), Vec::new());
            for (pose, part) in s.shapes() {
                let Some((own, of_own)) = triangles(&**part) else { continue };
                let first = vertices.len() as u32;
                vertices.extend(own.iter().map(|v| pose.transform_point(*v)));
                all.extend(of_own.iter().map(|t| t.map(|v| v + first)));
            }
            (vertices, all)
        }
        _ => return None,
    })
    .filter(|(_, triangles)| !triangles.is_empty())
}
