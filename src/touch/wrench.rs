//! What one body does to another.

use crate::body::{DeformableBodyHandle, DeformableContactPartner};
use crate::error::DeformableBodyError;
use crate::math::{Vec3, from_real, to_real};
use crate::pipeline::DeformableWorld;
use rapier3d::math::Vector;

/// Force and moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactWrench {
    /// \[N\].
    pub force: Vector,
    /// About the point that was asked for [N m].
    pub moment: Vector,
}

impl DeformableWorld {
    /// What contacts of the last step with some partners do to a body, about a point in the world: of one collider, of all colliders of a
    /// rigid body, of another deformable body. The forces act where the body's own points were touched.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    /// let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(1.0, 0.1, 1.0));
    /// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(Vector::Y * 0.2);
    /// let cube = deformables.insert(cube.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0)))?;
    /// for _ in 0..120 {
    ///     deformables.step(&mut physics);
    /// }
    /// let by_floor = |partner| partner == DeformableContactPartner::Collider(floor);
    /// let wrench = deformables.contact_wrench(cube, Vector::X, by_floor)?;
    /// // The weight of 8 kg, 1 m aside of the point.
    /// assert!((wrench.force.y - 78.48).abs() < 0.01 && (wrench.moment.z + 78.48).abs() < 0.01);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn contact_wrench(
        &self,
        body: DeformableBodyHandle,
        about: Vector,
        mut by: impl FnMut(DeformableContactPartner) -> bool,
    ) -> Result<ContactWrench, DeformableBodyError> {
        self.bodies.get(body).ok_or_else(|| body.no_such_body())?;
        let (mut sum, mut moment, about) = (Vec3::zeros(), Vec3::zeros(), from_real(about));
        self.for_each_contact_force(body, |partner, point, force, _, _| {
            if by(partner) {
                let force = from_real(force);
                sum += force;
                moment += (from_real(point) - about).cross(&force);
            }
        });
        Ok(ContactWrench { force: to_real(&sum), moment: to_real(&moment) })
    }
}
