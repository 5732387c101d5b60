//! Triangles of what is drawn.

use foible3d::{DeformableBody, DeformableSkin, DeformableSurfaceMesh};
use rapier3d::prelude::*;

/// Triangles of a half-space reach so far from its middle, in sizes of the rest of the scene.
const HALF_SPACE_REACH: f32 = 2.0;

/// Vertices \[m\] and triangles, wound outward.
pub(crate) type Triangles = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// How the vertices of a deformable body's mesh move.
#[derive(Clone, Debug)]
pub(crate) enum Surface {
    /// They are these of the body.
    Own(Vec<u32>),
    /// They are led by it.
    Skin(Box<DeformableSkin>),
    /// They stay: no skin could be made.
    Still,
}

/// What is drawn of a deformable body: its own surface, or a skin around sheets and rods.
pub(crate) fn of_deformable(body: &DeformableBody) -> (Triangles, Surface) {
    let model = body.model();
    let is_solid = model.sheet_triangles().next().is_none() && model.rod_segments().next().is_none();
    if is_solid {
        let (own, triangles) = compact(model.surface_triangles());
        let positions: Vec<[f32; 3]> = body.positions().map(|p| p.to_array()).collect();
        let vertices = own.iter().map(|v| positions[*v as usize]).collect();
        return ((vertices, triangles), Surface::Own(own));
    }
    let mesh = DeformableSurfaceMesh::new(model);
    let skin = DeformableSkin::bind(model, &mesh.vertices, &mesh.normals);
    let surface = skin.map_or(Surface::Still, |skin| Surface::Skin(Box::new(skin)));
    ((mesh.vertices.iter().map(|v| v.to_array()).collect(), mesh.triangles), surface)
}

/// The vertices that triangles have, in order, and the triangles in their numbers.
fn compact(triangles: impl Iterator<Item = [u32; 3]>) -> (Vec<u32>, Vec<[u32; 3]>) {
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let mut of_surface: Vec<u32> = triangles.iter().flatten().copied().collect();
    of_surface.sort_unstable();
    of_surface.dedup();
    let number = |v: u32| of_surface.binary_search(&v).unwrap_or(0) as u32;
    let triangles = triangles.into_iter().map(|t| t.map(number)).collect();
    (of_surface, triangles)
}

/// Triangles of a collider's shape, round ones without their rounding; none of what is a line.
pub(crate) fn of_shape(shape: &dyn Shape, reach: f32) -> Option<Triangles> {
    let (vertices, triangles) = surface(shape, reach)?;
    Some((vertices.into_iter().map(|v| v.to_array()).collect(), triangles))
}

fn surface(shape: &dyn Shape, reach: f32) -> Option<(Vec<Vector>, Vec<[u32; 3]>)> {
    let mesh = match shape.as_typed_shape() {
        TypedShape::Ball(s) => s.to_trimesh(20, 20),
        TypedShape::Cuboid(s) => s.to_trimesh(),
        TypedShape::RoundCuboid(s) => s.inner_shape.to_trimesh(),
        TypedShape::Capsule(s) => s.to_trimesh(20, 10),
        TypedShape::Cylinder(s) => s.to_trimesh(24),
        TypedShape::RoundCylinder(s) => s.inner_shape.to_trimesh(24),
        TypedShape::Cone(s) => s.to_trimesh(24),
        TypedShape::RoundCone(s) => s.inner_shape.to_trimesh(24),
        TypedShape::ConvexPolyhedron(s) => s.to_trimesh(),
        TypedShape::RoundConvexPolyhedron(s) => s.inner_shape.to_trimesh(),
        TypedShape::Triangle(s) => (vec![s.a, s.b, s.c], vec![[0, 1, 2]]),
        TypedShape::TriMesh(s) => (s.vertices().to_vec(), s.indices().to_vec()),
        TypedShape::HeightField(s) => s.to_trimesh(),
        TypedShape::Voxels(s) => s.to_trimesh(),
        TypedShape::Compound(s) => {
            let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
            for (pose, part) in s.shapes() {
                let (own, of_own) = surface(&**part, reach)?;
                let first = vertices.len() as u32;
                vertices.extend(own.iter().map(|v| pose.transform_point(*v)));
                triangles.extend(of_own.iter().map(|t| t.map(|v| v + first)));
            }
            (vertices, triangles)
        }
        TypedShape::HalfSpace(s) => {
            let (a, b) = s.normal.any_orthonormal_pair();
            let corner = |x: f32, y: f32| (a * x + b * y) * reach * HALF_SPACE_REACH;
            (
                vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
                vec![[0, 1, 2], [0, 2, 3]],
            )
        }
        _ => return None,
    };
    Some(mesh)
}
