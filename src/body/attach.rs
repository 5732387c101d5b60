//! Attaching vertices of bodies to things.

use super::attachment::{Anchors, AttachTo, DeformableAttachment};
use super::handle::{DeformableAttachmentHandle, DeformableBodyHandle};
use super::set::DeformableBodySet;
use crate::error::{BodyError, DeformableBodyError};
use crate::math::Pose64;

impl DeformableBodySet {
    /// Ties surface vertices of a body to something, where they are now.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody); [`BodyError::NoSuchVertex`];
    /// [`BodyError::NotOnSurface`] for vertices inside of a body, which can be pinned but not attached;
    /// [`BodyError::NoVertices`]; [`BodyError::NotFinite`] for a pose that is no number; [`BodyError::WrongSize`] if the two lists of vertices differ in length.
    pub fn attach(
        &mut self,
        body: DeformableBodyHandle,
        vertices: &[usize],
        to: AttachTo,
    ) -> Result<DeformableAttachmentHandle, DeformableBodyError> {
        let nodes = self.surface_nodes(body, vertices)?;
        let x = |node: &u32| self[body].state.x[*node as usize];
        let anchors = match to {
            AttachTo::World => Anchors::World(nodes.iter().map(x).collect()),
            AttachTo::RigidBody(handle, pose) => {
                super::body::finite("pose of the rigid body", pose.translation)?;
                super::body::finite("rotation of the rigid body", pose.rotation.to_scaled_axis())?;
                let pose = Pose64::from_real(&pose);
                Anchors::Rigid(handle, nodes.iter().map(|n| pose.inverse_transform(&x(n))).collect())
            }
            AttachTo::Deformable(other, others) => {
                if others.len() != nodes.len() {
                    let error = BodyError::WrongSize { vertices: others.len(), expected: nodes.len() };
                    return Err(error.into());
                }
                Anchors::Deformable(other, self.surface_nodes(other, &others)?)
            }
        };
        let attachment = DeformableAttachment::new(body, nodes, anchors);
        Ok(self.insert_attachment(attachment))
    }

    fn surface_nodes(
        &self,
        handle: DeformableBodyHandle,
        vertices: &[usize],
    ) -> Result<Vec<u32>, DeformableBodyError> {
        let body = self.get(handle).ok_or_else(|| handle.no_such_body())?;
        if vertices.is_empty() {
            return Err(BodyError::NoVertices { quantity: "attachment" }.into());
        }
        let mut nodes = Vec::with_capacity(vertices.len());
        for &vertex in vertices {
            let node = body.node(vertex)?;
            if body.model.surface.index_of_node[node] == u32::MAX {
                return Err(BodyError::NotOnSurface { vertex }.into());
            }
            nodes.push(node as u32);
        }
        Ok(nodes)
    }
}
