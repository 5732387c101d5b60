//! Bodies with regions that are rigid: inserted as one deformable body and rapier's rigid ones, attached to each other.

use super::world::DeformableWorld;
use crate::body::{
    AttachTo, DeformableAttachmentHandle, DeformableBody, DeformableBodyBuilder, DeformableBodyHandle,
    in_range,
};
use crate::error::{BodyError, DeformableBodyError, HandleError};
use crate::fem::RigidRegion;
use crate::math::{Vec3, from_real, to_real};
use parry3d::mass_properties::MassProperties;
use rapier3d::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::{ColliderBuilder, ColliderHandle};
use rapier3d::math::{Matrix, Pose, Vector};
use rapier3d::pipeline::PhysicsWorld;

/// What a region is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RigidRegionBody {
    /// A rigid body of its own, of this density [kg/m³]: its mass and inertia are the solid's.
    New(f64),
    /// Part of a rigid body or multibody link that is there, which keeps its mass and its colliders.
    PartOf(RigidBodyHandle),
}

/// A region that was inserted as part of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct InsertedRegion {
    /// Its number.
    pub region: u32,
    /// The rigid body. One of its own has the frame of the rest shape.
    pub body: RigidBodyHandle,
    /// What it has of the surface, a mesh of triangles; `None` of one that is inside, or part of a body that was there.
    pub collider: Option<ColliderHandle>,
    /// What holds the deformable body to it.
    pub attachment: DeformableAttachmentHandle,
}

impl DeformableWorld {
    /// Inserts a body some regions of which are rigid: bones, inserts of metal, the back of a finger. Each becomes a rigid body of
    /// rapier's, or part of one that is there, and the vertices that it shares with the rest are attached to it. The two do not collide. What it has
    /// of the surface gets a collider with the body's friction and groups.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// // A finger with a bone, 2 cm of it.
    /// let mut physics = PhysicsWorld::new();
    /// let mut deformables = DeformableWorld::new();
    /// let bone = |[x, y, z]: [f64; 3]| u32::from(x.abs() < 0.01 && y.abs() < 0.005 && z.abs() < 0.005);
    /// let finger = DeformableBodyBuilder::cuboid(Vector::new(0.04, 0.01, 0.01), [16, 4, 4])
    ///     .regions(bone)
    ///     .material(DeformableMaterial::new(1.0e5, 0.45).density(1_100.0));
    /// let (finger, bones) =
    ///     deformables.insert_with_rigid_regions(finger, &[(1, RigidRegionBody::New(1_900.0))], &mut physics)?;
    /// deformables.step(&mut physics);
    /// let bone = &physics.bodies[bones[0].body];
    /// assert!((bone.mass() - 2.0e-6 * 1_900.0).abs() < 1e-8);
    /// assert!((deformables.bodies[finger].mass() - (32.0e-6 - 2.0e-6) * 1_100.0).abs() < 1e-8);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// As [`DeformableBodyBuilder::build`] and [`DeformableBodyBuilder::without_regions`]; [`BodyError::OutOfRange`] for a density that
    /// is not positive and finite; [`HandleError::NoSuchRigidBody`]; [`BodyError::NoVertices`]
    /// for a region that nothing hangs on. Nothing is inserted then.
    pub fn insert_with_rigid_regions(
        &mut self,
        builder: DeformableBodyBuilder,
        regions: &[(u32, RigidRegionBody)],
        physics: &mut PhysicsWorld,
    ) -> Result<(DeformableBodyHandle, Vec<InsertedRegion>), DeformableBodyError> {
        for (_, kind) in regions {
            check(kind, physics)?;
        }
        let numbers: Vec<u32> = regions.iter().map(|(region, _)| *region).collect();
        let (builder, rigid) = builder.without_regions(&numbers)?;
        if rigid.iter().any(|region| region.vertices().is_empty()) {
            return Err(BodyError::NoVertices { quantity: "attachment of a rigid region" }.into());
        }
        let pose = builder.rest_pose();
        let body = self.insert(builder)?;
        let mut inserted = Vec::with_capacity(rigid.len());
        for (region, (_, kind)) in rigid.iter().zip(regions) {
            let own = &self.bodies[body];
            let (handle, collider) = match *kind {
                RigidRegionBody::New(density) => {
                    let handle = physics.insert_body(rigid_body(region, density, pose, own));
                    let collider = collider(region, own);
                    let collider = collider.map(|collider| physics.insert_collider(collider, Some(handle)));
                    // So that its mass can be read before the first step.
                    physics.bodies[handle].recompute_mass_properties_from_colliders(&physics.colliders);
                    (handle, collider)
                }
                RigidRegionBody::PartOf(handle) => (handle, None),
            };
            let pose = *physics.bodies[handle].position();
            let to = AttachTo::RigidBody(handle, pose);
            let attachment = self.bodies.attach(body, region.vertices(), to)?;
            if let Some(attachment) = self.bodies.attachment_mut(attachment) {
                attachment.set_contacts_enabled(false);
            }
            inserted.push(InsertedRegion { region: region.region(), body: handle, collider, attachment });
        }
        Ok((body, inserted))
    }
}

fn check(kind: &RigidRegionBody, physics: &PhysicsWorld) -> Result<(), DeformableBodyError> {
    match *kind {
        RigidRegionBody::New(density) => {
            let is_in = density > 0.0 && density.is_finite();
            Ok(in_range("density", density, "positive and finite", is_in)?)
        }
        RigidRegionBody::PartOf(handle) if physics.bodies.contains(handle) => Ok(()),
        RigidRegionBody::PartOf(handle) => {
            let (index, generation) = handle.into_raw_parts();
            Err(HandleError::NoSuchRigidBody { index, generation }.into())
        }
    }
}

/// Of the region's mass and inertia, in the frame of the rest shape, moving as the deformable body does.
fn rigid_body(region: &RigidRegion, density: f64, pose: Pose, own: &DeformableBody) -> RigidBodyBuilder {
    let centre = Vector::from_array(region.centre().map(|c| c as f32));
    let inertia = Matrix::from_cols_array_2d(&region.inertia(density).map(|row| row.map(|c| c as f32)));
    let masses = MassProperties::with_inertia_matrix(centre, (region.volume() * density) as f32, inertia);
    let [linvel, angvel, about] = [own.linvel(), own.angvel(), own.center_of_mass()].map(Vec3::from);
    let arm = from_real(pose.transform_point(centre)) - about;
    RigidBodyBuilder::dynamic()
        .pose(pose)
        .linvel(to_real(&(linvel + angvel.cross(&arm))))
        .angvel(to_real(&angvel))
        .additional_mass_properties(masses)
}

/// The region's part of the surface; its mass is the rigid body's already.
fn collider(region: &RigidRegion, own: &DeformableBody) -> Option<ColliderBuilder> {
    let (points, triangles) = region.surface();
    let points = points.iter().map(|p| Vector::from_array(p.map(|c| c as f32))).collect();
    let collider = ColliderBuilder::trimesh(points, triangles.to_vec()).ok()?;
    let material = own.material();
    let collider = collider
        .density(0.0)
        .friction(material.friction as f32)
        .restitution(material.restitution as f32)
        .friction_combine_rule(own.friction_combine_rule())
        .restitution_combine_rule(own.restitution_combine_rule());
    Some(collider.collision_groups(own.collision_groups()))
}
