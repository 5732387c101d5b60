//! Deformable bodies of a scene, with their regions that are rigid.

use super::{Stage, soft};
use crate::scene::{Deformable, RegionMaterial};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::path::Path;

impl Stage {
    /// Makes a deformable; the names that it knows were checked with the file.
    pub(super) fn add_deformable(&mut self, body: &Deformable, folder: &Path) -> Result<(), String> {
        let (builder, numbers) = soft::deformable(body, folder)?;
        let rigid: Vec<(u32, RigidRegionBody)> = numbers
            .into_iter()
            .zip(body.regions.iter().map(toml::Spanned::as_ref))
            .filter(|(_, region)| region.rigid)
            .map(|(number, region)| (number, self.becomes(region)))
            .collect();
        let name = body.name.as_ref();
        let handle = if rigid.is_empty() {
            self.world.insert(builder).map_err(|e| e.to_string())?
        } else {
            let inserted = self.world.insert_with_rigid_regions(builder, &rigid, &mut self.physics);
            let (handle, regions) = inserted.map_err(|e| e.to_string())?;
            for (region, (_, kind)) in regions.iter().zip(&rigid) {
                if matches!(kind, RigidRegionBody::New(_)) {
                    // As deformables of scenes are.
                    *self.physics.bodies[region.body].activation_mut() = RigidBodyActivation::cannot_sleep();
                    self.bones.push((name.clone(), region.body));
                }
            }
            handle
        };
        if body.pinned.is_some() && self.world.bodies[handle].pinned().len() == 0 {
            return Err("`pinned`: no vertex is in its boxes".into());
        }
        self.deformable.push((name.clone(), handle));
        Ok(())
    }

    fn becomes(&self, region: &RegionMaterial) -> RigidRegionBody {
        let named = region.part_of.as_ref().and_then(|of| self.rigid.iter().find(|r| r.0 == *of.as_ref()));
        named.map_or(RigidRegionBody::New(region.material.density), |r| RigidRegionBody::PartOf(r.1))
    }

    /// Rigid bodies of their own that regions of a deformable are.
    pub(super) fn bones_of(&self, name: &str) -> impl Iterator<Item = &RigidBody> {
        self.bones.iter().filter(move |bone| bone.0 == name).map(|bone| &self.physics.bodies[bone.1])
    }

    /// All rigid bodies, bones with the name of their deformable.
    pub(super) fn all_rigid(&self) -> impl Iterator<Item = (&str, RigidBodyHandle)> {
        let own = self.rigid.iter().map(|(name, body, _)| (name.as_str(), *body));
        own.chain(self.bones.iter().map(|(name, body)| (name.as_str(), *body)))
    }
}
