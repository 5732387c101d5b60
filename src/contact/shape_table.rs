//! What contact has to know of every shape of parry's, in one table: a new shape of parry's is a compile error here.

use parry3d::math::Vector;
use parry3d::shape::{Shape, SharedShape, TriMesh, TypedShape};

/// How "inside" is to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Solidity {
    /// The shape has an inside that projections know.
    Solid,
    /// A sheet or a line: the side is the one the body comes from.
    Sheet,
}

/// Which corners of a shape press into a face of a body that spans it.
#[derive(Clone, Copy)]
pub(crate) enum Corners<'a> {
    /// None, or no sharp ones.
    None,
    /// Of an axis-aligned box with these half extents \[m\].
    Box(Vector),
    Points(&'a [Vector]),
    Ends([Vector; 2]),
    /// The vertices of a mesh, found through its tree.
    Mesh(&'a TriMesh),
}

/// One line of the table.
#[derive(Clone, Copy)]
pub(crate) struct ShapeTraits<'a> {
    pub solidity: Solidity,
    /// Made of plane faces: nodes, rims and corners carry what lies on it, one contact per feature of the body.
    pub is_faceted: bool,
    /// A plane without edges: its contacts with a body are all at nodes.
    pub is_plane: bool,
    pub corners: Corners<'a>,
    /// Round shapes are a core and the thickness around it \[m\]: projections onto the core are exact where those onto
    /// the round shape iterate.
    pub core: &'a dyn Shape,
    pub radius: f64,
}

/// The table.
pub(crate) fn shape_traits(shape: &SharedShape) -> ShapeTraits<'_> {
    use Solidity::{Sheet, Solid};
    // Curved, sharp at the most along circles, which closest points find.
    let curved = ShapeTraits {
        solidity: Solid,
        is_faceted: false,
        is_plane: false,
        corners: Corners::None,
        core: &*shape.0,
        radius: 0.0,
    };
    let round = |core, radius: f32| ShapeTraits { core, radius: radius.into(), ..curved };
    let faceted = |corners| ShapeTraits { is_faceted: true, corners, ..curved };
    let thin = |corners| ShapeTraits { solidity: Sheet, corners, ..curved };
    match shape.as_typed_shape() {
        TypedShape::Ball(_) | TypedShape::Cylinder(_) | TypedShape::Cone(_) => curved,
        TypedShape::HalfSpace(_) => ShapeTraits { is_plane: true, ..curved },
        TypedShape::Capsule(s) => round(&s.segment, s.radius),
        TypedShape::RoundCuboid(s) => round(&s.inner_shape, s.border_radius),
        // Its core has no inside; the thickness around it has.
        TypedShape::RoundTriangle(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundCylinder(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundCone(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundConvexPolyhedron(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::Cuboid(cuboid) => faceted(Corners::Box(cuboid.half_extents)),
        TypedShape::ConvexPolyhedron(hull) => faceted(Corners::Points(hull.points())),
        TypedShape::TriMesh(mesh) => {
            let solidity = if mesh.pseudo_normals_if_oriented().is_some() { Solid } else { Sheet };
            ShapeTraits { solidity, ..faceted(Corners::Mesh(mesh)) }
        }
        TypedShape::Triangle(triangle) => thin(Corners::Points(triangle.vertices())),
        TypedShape::Segment(segment) => thin(Corners::Ends([segment.a, segment.b])),
        TypedShape::Polyline(line) => thin(Corners::Points(line.vertices())),
        // Read as meshes, and compounds part by part; only a shape that could not be made one comes here.
        TypedShape::HeightField(_) => thin(Corners::None),
        TypedShape::Voxels(_) => faceted(Corners::None),
        TypedShape::Compound(_) | TypedShape::Custom(_) => curved,
    }
}
