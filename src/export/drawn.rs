//! What is drawn of a body, bound to it once.

use crate::body::DeformableBody;
use crate::error::BodyError;
use crate::skin::{DeformableSkin, DeformableSurfaceMesh};
use rapier3d::math::Vector;

/// A mesh that follows a body. The order of its vertices does not change.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    skin: DeformableSkin,
    /// \[m\], as of the last [`Drawn::follow`].
    pub positions: Vec<Vector>,
    pub normals: Vec<Vector>,
    pub triangles: Vec<[u32; 3]>,
    /// The body's node at each vertex; none of a mesh of the caller's.
    #[cfg_attr(not(feature = "export"), allow(dead_code))]
    pub nodes: Vec<u32>,
}

impl Drawn {
    /// The body's own surface.
    pub fn of(body: &DeformableBody) -> Result<Self, BodyError> {
        let (mesh, nodes) = DeformableSurfaceMesh::with_nodes(body.model());
        let skin = DeformableSkin::bind(body.model(), &mesh.vertices, &mesh.normals)?;
        Ok(Self { skin, positions: mesh.vertices, normals: mesh.normals, triangles: mesh.triangles, nodes })
    }

    /// A skin of the caller's.
    #[cfg(feature = "export")]
    pub fn with_skin(skin: DeformableSkin, triangles: Vec<[u32; 3]>) -> Self {
        let places = vec![Vector::ZERO; skin.vertex_count()];
        Self { skin, positions: places.clone(), normals: places, triangles, nodes: Vec::new() }
    }

    /// Where it is now.
    pub fn follow(&mut self, body: &DeformableBody) -> Result<(), BodyError> {
        self.skin.update(body, &mut self.positions, &mut self.normals)
    }
}
