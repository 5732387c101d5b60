//! Attaching vertices of bodies to things.

use super::attachment::{Anchors, AttachTo, DeformableAttachment};
use super::handle::{DeformableAttachmentHandle, DeformableBodyHandle};
use super::set::DeformableBodySet;
use crate::error::{BodyError, DeformableBodyError};
use crate::math::Pose64;

impl DeformableBodySet {
    /// Attaches surface vertices of a body to something, where they are now.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut physics = PhysicsWorld::new();
    /// let hook = RigidBodyBuilder::kinematic_position_based().translation(Vector::Y);
    /// let hook = physics.insert_body(hook);
    /// let mut deformables = DeformableWorld::new();
    /// let block = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).can_sleep(false);
    /// let block = deformables.insert(block.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0)))?;
    /// // The upper face, where it is on the hook now.
    /// let top = deformables.bodies[block].vertices_where(|x| x.y > 0.099);
    /// let pose = *physics.bodies[hook].position();
    /// let glue = deformables.bodies.attach(block, &top, AttachTo::RigidBody(hook, pose))?;
    /// for _ in 0..120 {
    ///     deformables.step(&mut physics);
    /// }
    /// let held = deformables.bodies.attachment(glue).map(|glue| glue.force().y);
    /// assert!((held.unwrap_or(0.0) - 8.0 * 9.81).abs() < 0.1);
    /// // Its user may let go, or have it break by itself: `attachment_mut(glue)` and `set_break_force`.
    /// assert!(deformables.bodies.detach(glue).is_some());
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody); [`BodyError::NoSuchVertex`];
    /// [`BodyError::NotOnSurface`] for vertices inside of a body, which can be pinned but not attached;
    /// [`BodyError::NoVertices`]; [`BodyError::NotFinite`] for a pose that is not finite; [`BodyError::WrongSize`] if the two lists of vertices differ in length.
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
                super::body::rotation("rotation of the rigid body", pose.rotation)?;
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
            if !body.model.surface.has_node(node) {
                return Err(BodyError::NotOnSurface { vertex }.into());
            }
            nodes.push(node as u32);
        }
        Ok(nodes)
    }
}
