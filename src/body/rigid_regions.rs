//! Builders of bodies some regions of which are rigid.

use super::builder::DeformableBodyBuilder;
use crate::error::DeformableBodyError;
use crate::fem::RigidRegion;
use rapier3d::math::Pose;
use std::sync::Arc;

impl DeformableBodyBuilder {
    /// The builder of the body without some regions, and those, to be made rigid bodies of: see [`DeformableModel::without_regions`](crate::DeformableModel::without_regions). What is set
    /// stays; vertices have new numbers.
    ///
    /// # Errors
    /// What is wrong with the mesh; [`MeshError::RegionNotSolid`](crate::MeshError::RegionNotSolid),
    /// [`MeshError::RegionsTouch`](crate::MeshError::RegionsTouch).
    pub fn without_regions(
        mut self,
        regions: &[u32],
    ) -> Result<(Self, Vec<RigidRegion>), DeformableBodyError> {
        let (model, rigid) = self.model.clone()?.without_regions(regions)?;
        self.model = Ok(Arc::new(model));
        self.region_materials.retain(|(region, _)| !regions.contains(region));
        Ok((self, rigid))
    }

    /// Where the rest mesh is put.
    pub(crate) fn rest_pose(&self) -> Pose {
        self.pose
    }
}
