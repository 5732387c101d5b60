//! Derivatives of the elastic forces with respect to material and activation, at positions held fast: differences of the forces
//! themselves, so that they hold for every energy. In moduli and activation forces are linear, and differences exact, but where
//! regions meet: there they are of the fourth order. Those of Poisson's ratio are small.

use super::gradient::{MaterialGradient, WovenGradient};
use super::record::BodyRecord;
use crate::fem::elastic_forces::{Evaluation, add_forces};
use crate::fem::{DeformableModel, Elements, StiffnessDamping};
use crate::material::{DeformableMaterial, OrthotropicSheet};
use crate::math::{Mat3, Vec3, dot};

/// Differences of moduli, relative to Young's, of activation, and of what resists beside branches, relative to itself.
const DIFFERENCE: f64 = 1.0e-3;
/// Of Poisson's ratio, relative to its distance from a half: squared the error of the difference, 1e-16 over it that of rounding.
const POISSON: f64 = 1.0e-5;

/// Places and weights of a derivative: between two, four, and of five to one side.
const LINEAR: &[(f64, f64)] = &[(1.0, 0.5), (-1.0, -0.5)];
const CENTRAL: &[(f64, f64)] =
    &[(1.0, 2.0 / 3.0), (-1.0, -2.0 / 3.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0)];
const FORWARD: &[(f64, f64)] =
    &[(0.0, -25.0 / 12.0), (1.0, 4.0), (2.0, -3.0), (3.0, 4.0 / 3.0), (4.0, -0.25)];

/// Virtual work of the elastic forces of a step along z, by materials and activation.
pub(super) struct ElasticWork<'a> {
    pub model: &'a DeformableModel,
    pub record: &'a BodyRecord,
    pub z: &'a [Vec3],
    /// What resists in the step.
    pub damping: &'a StiffnessDamping,
    pub force: &'a mut Vec<Vec3>,
}

impl ElasticWork<'_> {
    fn of(&mut self, materials: &[DeformableMaterial], activations: &[f64]) -> f64 {
        self.with(self.damping, materials, activations)
    }

    fn with(
        &mut self,
        damping: &StiffnessDamping,
        materials: &[DeformableMaterial],
        activations: &[f64],
    ) -> f64 {
        self.force.clear();
        self.force.resize(self.z.len(), Vec3::zeros());
        let elements = Elements { model: self.model, materials, activations };
        let (x, frame) = (&self.record.x_end, Mat3::identity());
        let at = Evaluation { damping, x, frame: &frame, limit: f64::INFINITY };
        add_forces(&elements, &at, self.force);
        dot(self.force, self.z)
    }

    /// The derivative with respect to what `set` changes of the material of a region, by differences of `by`.
    fn along(
        &mut self,
        region: usize,
        by: f64,
        scheme: &[(f64, f64)],
        set: impl Fn(&mut DeformableMaterial, f64),
    ) -> f64 {
        self.difference(region, (by, scheme), set, |work, materials| {
            work.of(materials, &work.record.activations)
        })
    }

    /// The same of what resists motion.
    fn along_damping(
        &mut self,
        region: usize,
        by: f64,
        scheme: &[(f64, f64)],
        set: impl Fn(&mut DeformableMaterial, f64),
    ) -> f64 {
        self.difference(region, (by, scheme), set, |work, materials| {
            let damping = work.record.damping(work.model, materials);
            work.with(&damping, materials, &work.record.activations)
        })
    }

    fn difference(
        &mut self,
        region: usize,
        (by, scheme): (f64, &[(f64, f64)]),
        set: impl Fn(&mut DeformableMaterial, f64),
        mut of: impl FnMut(&mut Self, &[DeformableMaterial]) -> f64,
    ) -> f64 {
        let mut materials = self.record.materials.clone();
        let mut sum = 0.0;
        for (place, weight) in scheme {
            materials[region] = self.record.materials[region];
            set(&mut materials[region], place * by);
            sum += weight * of(self, &materials);
        }
        sum / by
    }

    /// Adds the derivatives with respect to what is elastic in the materials.
    pub fn add_materials(&mut self, out: &mut [MaterialGradient]) {
        // Of one material without fibres or weave all forces are in proportion to it.
        let is_in_proportion =
            !self.model.has_fibres() && self.record.materials.iter().all(|m| m.orthotropic.is_none());
        let moduli = match (out.len(), is_in_proportion) {
            (1, true) => &[],
            (1, false) => LINEAR,
            _ => CENTRAL,
        };
        for (region, out) in out.iter_mut().enumerate() {
            let DeformableMaterial { youngs_modulus, poisson_ratio, .. } = self.record.materials[region];
            let by = DIFFERENCE * youngs_modulus;
            out.youngs_modulus += if moduli.is_empty() {
                self.of(&self.record.materials, &self.record.activations) / youngs_modulus
            } else {
                self.along(region, by, moduli, |m, d| m.youngs_modulus += d)
            };
            let apart = POISSON * (0.5 - poisson_ratio);
            // Below nought smoothed elements have no volume to keep.
            let scheme = if poisson_ratio > apart { LINEAR } else { FORWARD };
            out.poisson_ratio += self.along(region, apart, scheme, |m, d| m.poisson_ratio += d);
            self.add_damping(region, out);
            self.add_weave(region, &mut out.woven);
            if self.model.has_fibres() {
                out.fibre_modulus += self.along(region, by, LINEAR, |m, d| m.fibre_modulus += d);
            }
        }
    }

    /// Adds the elastic constants of woven cloth. Its stiffness goes with 1/(1 − ν₁₂ν₂₁): differences are relative to the distance from one,
    /// as ν₁₂ν₂₁ goes with the moduli and with ν₁₂².
    fn add_weave(&mut self, region: usize, out: &mut WovenGradient) {
        let Some(weave) = self.record.materials[region].orthotropic else { return };
        let apart = DIFFERENCE * (1.0 - weave.coupling());
        type Constant = fn(&mut OrthotropicSheet) -> &mut f64;
        let mut along = |by: f64, constant: Constant| {
            self.along(region, by, CENTRAL, |m, d| {
                if let Some(sheet) = &mut m.orthotropic {
                    *constant(sheet) += d;
                }
            })
        };
        out.warp_modulus += along(apart * weave.warp_modulus, |sheet| &mut sheet.warp_modulus);
        out.weft_modulus += along(apart * weave.weft_modulus, |sheet| &mut sheet.weft_modulus);
        out.poisson_ratio += along(apart, |sheet| &mut sheet.poisson_ratio);
        out.shear_modulus += along(DIFFERENCE * weave.shear_modulus, |sheet| &mut sheet.shear_modulus);
    }

    /// Adds what resists motion says, with what dampers have given way by as it is.
    fn add_damping(&mut self, region: usize, out: &mut MaterialGradient) {
        let material = self.record.materials[region];
        let beta = material.stiffness_damping;
        if beta != 0.0 {
            // Alone it is linear; with branches it has a part of the stretch that they measure from.
            let (by, scheme) = if self.damping.dampers().is_empty() {
                (0.5 * beta, LINEAR)
            } else {
                (DIFFERENCE * beta, CENTRAL)
            };
            out.stiffness_damping += self.along_damping(region, by, scheme, |m, d| m.stiffness_damping += d);
        }
        for (k, branch) in material.maxwell_branches.iter().enumerate().filter(|(_, b)| b.ratio > 0.0) {
            let [ratio, time] = [branch.ratio, branch.time].map(|whole| DIFFERENCE * whole);
            out.maxwell_ratios[k] +=
                self.along_damping(region, ratio, CENTRAL, |m, d| m.maxwell_branches[k].ratio += d);
            out.maxwell_times[k] +=
                self.along_damping(region, time, CENTRAL, |m, d| m.maxwell_branches[k].time += d);
        }
    }

    /// Adds what held rods say, in closed form: K goes with E and with 1/(1 + ν), by the share that a region has of a rod's compliance.
    pub fn add_twists(&self, out: &mut [MaterialGradient]) {
        let BodyRecord { materials, x_end, twists, .. } = self.record;
        for twist in twists {
            // Virtual work of its forces along z [J].
            let work = twist.of_roll(self.model, materials, x_end, self.z) * twist.twist;
            for (region, share) in twist.shares(self.model, materials) {
                let DeformableMaterial { youngs_modulus, poisson_ratio, .. } = materials[region];
                out[region].youngs_modulus += work * share / youngs_modulus;
                out[region].poisson_ratio -= work * share / (1.0 + poisson_ratio);
            }
        }
    }

    /// With respect to the activation, of all regions alike.
    pub fn activation(&mut self) -> f64 {
        if !self.model.has_fibres() {
            return 0.0;
        }
        let (record, mut sum) = (self.record, 0.0);
        for (place, weight) in LINEAR {
            let activations = record.activations.iter().map(|stretch| stretch + place * DIFFERENCE);
            sum += weight * self.of(&record.materials, &activations.collect::<Vec<_>>());
        }
        sum / DIFFERENCE
    }
}

/// What masses and damping of the nodes follow from.
pub(super) struct Inertia {
    pub masses: Vec<f64>,
    /// α [1/s].
    pub damping: f64,
}

impl Inertia {
    pub fn new(model: &DeformableModel, materials: &[DeformableMaterial]) -> Self {
        let masses = model.weigh_nodes(materials, |material| material.density);
        Self { masses, damping: model.mass_damping(materials) }
    }

    /// Adds what derivatives with respect to masses and damping come to.
    pub fn add_materials(
        &self,
        model: &DeformableModel,
        record: &BodyRecord,
        (of_masses, of_damping): (&[f64], f64),
        out: &mut [MaterialGradient],
    ) {
        let materials = &record.materials;
        let mass = model.weigh(materials, |material| material.density);
        for (region, out) in out.iter_mut().enumerate() {
            let mut alone: Vec<_> = materials.iter().map(|material| material.density(0.0)).collect();
            alone[region].density = 1.0;
            let per_density = model.weigh_nodes(&alone, |material| material.density);
            let volume = model.weigh(&alone, |material| material.density);
            out.density += of_masses.iter().zip(per_density).map(|(a, b)| a * b).sum::<f64>();
            let DeformableMaterial { density, mass_damping, .. } = materials[region];
            out.density += of_damping * volume * (mass_damping - self.damping) / mass;
            out.mass_damping += of_damping * volume * density / mass;
        }
    }
}
