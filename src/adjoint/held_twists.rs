//! Rods that are held against roll, in the Hessian of a step: `T ∇²m`, which is sparse, and `K ∇m ∇mᵀ`, one direction a rod; T is the torque.

use crate::fem::{DeformableModel, EndFrame, TwistedRod};
use crate::material::DeformableMaterial;
use crate::math::{Mat3, Vec3, dot};

/// A held rod of a step.
#[derive(Clone, Debug)]
pub(super) struct TwistRecord {
    pub rod: usize,
    /// At the end of the step.
    pub frames: [EndFrame; 2],
    /// All of its twist where the step has ended \[rad\].
    pub twist: f64,
}

impl TwistRecord {
    fn twisted<'a>(&'a self, model: &'a DeformableModel) -> TwistedRod<'a> {
        TwistedRod { nodes: model.rod(self.rod), frames: &self.frames }
    }

    fn gradient(&self, model: &DeformableModel, x: &[Vec3]) -> Vec<Vec3> {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        self.twisted(model).add_gradient(x, 1.0, &mut gradient);
        gradient
    }

    /// ∇m and K.
    pub fn direction(
        &self,
        model: &DeformableModel,
        materials: &[DeformableMaterial],
        x: &[Vec3],
    ) -> (Vec<Vec3>, f64) {
        (self.gradient(model, x), model.torsional_stiffness(self.rod, materials))
    }

    /// Adds `T ∇²m`.
    pub fn add_twisted(
        &self,
        model: &DeformableModel,
        materials: &[DeformableMaterial],
        x: &[Vec3],
        add: &mut dyn FnMut(usize, usize, &Mat3),
    ) {
        let torque = model.torsional_stiffness(self.rod, materials) * self.twist;
        self.twisted(model).second_derivatives(x, |i, j, block| add(i, j, &(block * torque)));
    }

    /// What part of its compliance each segment has, by region.
    pub fn shares(&self, model: &DeformableModel, materials: &[DeformableMaterial]) -> Vec<(usize, f64)> {
        let stiffness = model.torsional_stiffness(self.rod, materials);
        model.torsional_compliances(self.rod, materials).map(|(region, c)| (region, c * stiffness)).collect()
    }

    /// What z says of a radian more of roll.
    pub fn of_roll(
        &self,
        model: &DeformableModel,
        materials: &[DeformableMaterial],
        x: &[Vec3],
        z: &[Vec3],
    ) -> f64 {
        -model.torsional_stiffness(self.rod, materials) * dot(&self.gradient(model, x), z)
    }
}
