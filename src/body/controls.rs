//! What its user sets of a body besides its motion.

use super::body::{DeformableBody, in_range};
use super::settings::{Acceleration, SolverSettings};
use crate::error::{BodyError, DeformableBodyError};
use crate::material::{DeformableMaterial, MaterialError};
use rapier3d::dynamics::CoefficientCombineRule;
use rapier3d::geometry::InteractionGroups;
use rapier3d::pipeline::{ActiveEvents, ActiveHooks};

/// Clusters of a body at the most.
const MAX_CLUSTERS: usize = 32;
/// Accuracies of contact forces: below the first there is only rounding, beyond the last forces are hardly solved for.
const CONTACT_TOLERANCES: [f64; 2] = [1.0e-12, 0.1];

impl DeformableBody {
    /// The material, of all regions that have none of their own.
    pub fn material(&self) -> &DeformableMaterial {
        &self.material
    }

    /// Changes the material. The next step makes a new factor.
    ///
    /// # Errors
    /// [`MaterialError`]; the material stays as it was then.
    pub fn set_material(&mut self, material: DeformableMaterial) -> Result<(), MaterialError> {
        self.wake_up();
        material.validate()?;
        let has_own = |region: &u32| self.region_materials.iter().any(|(tag, _)| tag == region);
        let others = self.model.regions().filter(|region| !has_own(region));
        others.into_iter().try_for_each(|region| self.check_warp(&material, region))?;
        self.material = material;
        self.state.history.held = None;
        self.distribute_materials();
        Ok(())
    }

    /// Whether a region may have a material: woven cloth needs the direction of its warp.
    pub(super) fn check_warp(&self, material: &DeformableMaterial, region: u32) -> Result<(), MaterialError> {
        let without = self.model.triangles_without_warp(region);
        if material.orthotropic.is_none() || without == 0 {
            return Ok(());
        }
        let range = "0: a woven sheet has one, by DeformableBodyBuilder::warp";
        Err(MaterialError::new("number of triangles without a direction of the warp", without as f64, range))
    }

    /// The material of a region: its own, or the body's.
    pub fn region_material(&self, region: u32) -> &DeformableMaterial {
        let own = self.region_materials.binary_search_by_key(&region, |(tag, _)| *tag);
        own.map_or(&self.material, |place| &self.region_materials[place].1)
    }

    /// Gives a region of the model a material of its own. Stiffness, density and stiffness damping are those of its elements; mass
    /// damping is that of the whole body, by mass the mean; friction and restitution are those of its surface, and between regions
    /// the mean.
    ///
    /// # Errors
    /// A material out of range, [`BodyError::NoSuchRegion`]; nothing is changed then.
    pub fn set_region_material(
        &mut self,
        region: u32,
        material: DeformableMaterial,
    ) -> Result<(), DeformableBodyError> {
        material.validate()?;
        if self.model.region(region).is_none() {
            return Err(BodyError::NoSuchRegion { region, regions: self.model.regions().len() }.into());
        }
        self.check_warp(&material, region)?;
        self.wake_up();
        match self.region_materials.binary_search_by_key(&region, |(tag, _)| *tag) {
            Ok(place) => self.region_materials[place].1 = material,
            Err(place) => self.region_materials.insert(place, (region, material)),
        }
        self.state.history.held = None;
        self.distribute_materials();
        Ok(())
    }

    /// Makes what follows from materials and model.
    pub(crate) fn distribute_materials(&mut self) {
        let model = self.model.clone();
        self.materials = model.regions().map(|region| *self.region_material(region)).collect();
        self.distribute_activations();
        self.masses = model.weigh_nodes(&self.materials, |material| material.density);
        self.node_surfaces.clear();
        let surface = |material: &DeformableMaterial| [material.friction, material.restitution];
        if self.materials.iter().any(|material| surface(material) != surface(&self.material)) {
            let [friction, restitution] =
                [0, 1].map(|k| model.weigh_nodes(&self.materials, |material| surface(material)[k]));
            let both = friction.into_iter().zip(restitution).zip(&model.node_volumes);
            self.node_surfaces.extend(both.map(|((f, e), volume)| [f / volume, e / volume]));
        }
    }

    /// The knobs of the solver.
    pub fn settings(&self) -> &SolverSettings {
        &self.settings
    }

    /// Sets the knobs of the solver; out-of-range ones are brought into range.
    pub fn set_settings(&mut self, settings: SolverSettings) {
        self.wake_up();
        let mut settings = settings;
        settings.max_iterations = settings.max_iterations.max(1);
        settings.clusters = settings.clusters.min(MAX_CLUSTERS);
        // NaN too becomes zero: iterate to the limit.
        settings.tolerance = settings.tolerance.max(0.0);
        let [finest, coarsest] = CONTACT_TOLERANCES;
        // NaN too becomes the finest.
        settings.contact_tolerance = settings.contact_tolerance.max(finest).min(coarsest);
        match &mut settings.acceleration {
            Acceleration::Lbfgs { window } | Acceleration::Anderson { window } => {
                *window = (*window).clamp(1, 16);
            }
            Acceleration::Chebyshev { radius } => {
                *radius = if radius.is_nan() { 0.0 } else { radius.clamp(0.0, 0.9999) };
            }
            Acceleration::None => {}
        }
        self.settings = settings;
    }

    /// Factor on gravity.
    pub fn gravity_scale(&self) -> f64 {
        self.gravity_scale
    }

    /// Sets the factor on gravity, negative ones too.
    ///
    /// # Errors
    /// [`BodyError::OutOfRange`] for one that is not finite; nothing is changed then.
    pub fn set_gravity_scale(&mut self, scale: f64) -> Result<(), BodyError> {
        in_range("gravity_scale", scale, "finite", scale.is_finite())?;
        self.wake_up();
        self.gravity_scale = scale;
        Ok(())
    }

    /// Whether the body takes part in the simulation.
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Takes the body out of the simulation, or back in.
    pub fn set_enabled(&mut self, enabled: bool) {
        self.wake_up();
        self.enabled = enabled;
        self.report.quarantined &= !enabled;
    }

    /// Whether the last step had to be undone because the state became non-finite; the body is
    /// then disabled and stays where it was. [`DeformableBody::set_enabled`] ends it.
    pub fn is_quarantined(&self) -> bool {
        self.report.quarantined
    }

    /// Whether the body collides with itself.
    pub fn self_contact(&self) -> bool {
        self.self_contact
    }

    /// Lets the body collide with itself: for slender ones, which may fold.
    pub fn set_self_contact(&mut self, self_contact: bool) {
        self.wake_up();
        self.self_contact = self_contact;
    }

    /// Which colliders and deformable bodies the body collides with, by rapier's rules.
    pub fn collision_groups(&self) -> InteractionGroups {
        self.collision_groups
    }

    /// Sets which colliders and deformable bodies the body collides with.
    pub fn set_collision_groups(&mut self, groups: InteractionGroups) {
        self.wake_up();
        self.collision_groups = groups;
    }

    /// Which events the body gives rise to.
    pub fn active_events(&self) -> ActiveEvents {
        self.active_events
    }

    /// Sets which events the body gives rise to; those of what it touches count too, by rapier's rules.
    pub fn set_active_events(&mut self, events: ActiveEvents) {
        self.active_events = events;
    }

    /// Which hooks are asked about the body.
    pub fn active_hooks(&self) -> ActiveHooks {
        self.active_hooks
    }

    /// Sets which hooks are asked about the body; those of what it touches count too, by rapier's rules.
    pub fn set_active_hooks(&mut self, hooks: ActiveHooks) {
        self.wake_up();
        self.active_hooks = hooks;
    }

    /// Force \[N\] above which [`ActiveEvents::CONTACT_FORCE_EVENTS`] of the body give rise to events.
    pub fn contact_force_event_threshold(&self) -> f32 {
        self.contact_force_event_threshold
    }

    /// Sets the force \[N\] above which [`ActiveEvents::CONTACT_FORCE_EVENTS`] of the body give rise to events; the sum of
    /// the magnitudes of what its contacts with one partner carry. Of two thresholds the smaller counts.
    pub fn set_contact_force_event_threshold(&mut self, threshold: f32) {
        self.contact_force_event_threshold = threshold;
    }

    /// How friction combines with that of what it touches.
    pub fn friction_combine_rule(&self) -> CoefficientCombineRule {
        self.friction_combine_rule
    }

    /// Sets how friction combines with that of what it touches.
    pub fn set_friction_combine_rule(&mut self, rule: CoefficientCombineRule) {
        self.wake_up();
        self.friction_combine_rule = rule;
    }

    /// How restitution combines with that of what it touches.
    pub fn restitution_combine_rule(&self) -> CoefficientCombineRule {
        self.restitution_combine_rule
    }

    /// Sets how restitution combines with that of what it touches.
    pub fn set_restitution_combine_rule(&mut self, rule: CoefficientCombineRule) {
        self.wake_up();
        self.restitution_combine_rule = rule;
    }
}
