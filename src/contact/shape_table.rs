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

/// What is asked of a shape for every point: kept with an obstacle, as the table is not free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShapeKind {
    pub solidity: Solidity,
    /// Made of plane faces or straight lines: nodes, rims and corners carry what lies on it, one contact per feature of the
    /// body.
    pub is_faceted: bool,
    /// A plane without edges: its contacts with a body are all at nodes.
    pub is_plane: bool,
    /// Round shapes are a core and the thickness around it \[m\]: projections onto the core are exact where those onto
    /// the round shape iterate.
    pub radius: f64,
}

/// One line of the table.
#[derive(Clone, Copy)]
pub(crate) struct ShapeTraits<'a> {
    pub kind: ShapeKind,
    pub corners: Corners<'a>,
    /// Of a round shape; else the shape.
    pub core: &'a dyn Shape,
}

/// The table.
pub(crate) fn shape_traits(shape: &SharedShape) -> ShapeTraits<'_> {
    use Solidity::{Sheet, Solid};
    // Curved, sharp at the most along circles, which closest points find.
    let curved = ShapeKind { solidity: Solid, is_faceted: false, is_plane: false, radius: 0.0 };
    let plain = ShapeTraits { kind: curved, corners: Corners::None, core: &*shape.0 };
    let round = |core, radius: f32| {
        let kind = ShapeKind { radius: radius.into(), ..curved };
        ShapeTraits { kind, core, ..plain }
    };
    let faceted = |solidity, corners| {
        let kind = ShapeKind { solidity, is_faceted: true, ..curved };
        ShapeTraits { kind, corners, ..plain }
    };
    let thin = |corners| {
        let kind = ShapeKind { solidity: Sheet, is_faceted: true, ..curved };
        ShapeTraits { kind, corners, ..plain }
    };
    match shape.as_typed_shape() {
        TypedShape::Ball(_) | TypedShape::Cylinder(_) | TypedShape::Cone(_) => plain,
        TypedShape::HalfSpace(_) => ShapeTraits { kind: ShapeKind { is_plane: true, ..curved }, ..plain },
        TypedShape::Capsule(s) => round(&s.segment, s.radius),
        TypedShape::RoundCuboid(s) => round(&s.inner_shape, s.border_radius),
        // Its core has no inside; the thickness around it has.
        TypedShape::RoundTriangle(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundCylinder(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundCone(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::RoundConvexPolyhedron(s) => round(&s.inner_shape, s.border_radius),
        TypedShape::Cuboid(cuboid) => faceted(Solid, Corners::Box(cuboid.half_extents)),
        TypedShape::ConvexPolyhedron(hull) => faceted(Solid, Corners::Points(hull.points())),
        TypedShape::TriMesh(mesh) => {
            let solidity = if mesh.pseudo_normals_if_oriented().is_some() { Solid } else { Sheet };
            faceted(solidity, Corners::Mesh(mesh))
        }
        TypedShape::Triangle(triangle) => thin(Corners::Points(triangle.vertices())),
        TypedShape::Segment(segment) => thin(Corners::Ends([segment.a, segment.b])),
        TypedShape::Polyline(line) => thin(Corners::Points(line.vertices())),
        // Read as meshes, and compounds part by part; only a shape that could not be made one comes here.
        TypedShape::HeightField(_) => thin(Corners::None),
        TypedShape::Voxels(_) => faceted(Solid, Corners::None),
        TypedShape::Compound(_) | TypedShape::Custom(_) => plain,
    }
}
