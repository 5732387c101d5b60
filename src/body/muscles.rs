//! What muscle fibres want: of a body, and by region.

use super::body::{DeformableBody, in_range};
use crate::error::BodyError;

impl DeformableBody {
    /// Stretch that muscle fibres want to have [–], of all regions that have none of their own: one at rest, less when they contract.
    pub fn activation(&self) -> f64 {
        self.activation
    }

    /// Sets the stretch that muscle fibres want to have, from 0 to 10.
    ///
    /// # Errors
    /// [`BodyError::OutOfRange`]; nothing is changed then.
    pub fn set_activation(&mut self, stretch: f64) -> Result<(), BodyError> {
        check(stretch)?;
        self.wake_up();
        self.activation = stretch;
        self.state.history.held = None;
        self.distribute_activations();
        Ok(())
    }

    /// Stretch that the muscle fibres of a region want to have [–]: its own, or the body's.
    pub fn region_activation(&self, region: u32) -> f64 {
        let own = self.region_activations.binary_search_by_key(&region, |(tag, _)| *tag);
        own.map_or(self.activation, |place| self.region_activations[place].1)
    }

    /// Gives the muscle fibres of a region of the model a stretch of their own that they want to have, as
    /// [`DeformableBody::set_activation`]. Directions and stiffness differ by region too, by
    /// [`DeformableBodyBuilder::fibres`](crate::DeformableBodyBuilder::fibres) and
    /// [`DeformableBody::set_region_material`].
    ///
    /// # Errors
    /// [`BodyError::NoSuchRegion`], [`BodyError::OutOfRange`]; nothing is changed then.
    pub fn set_region_activation(&mut self, region: u32, stretch: f64) -> Result<(), BodyError> {
        if self.model.region(region).is_none() {
            return Err(BodyError::NoSuchRegion { region, regions: self.model.regions().len() });
        }
        check(stretch)?;
        self.wake_up();
        match self.region_activations.binary_search_by_key(&region, |(tag, _)| *tag) {
            Ok(place) => self.region_activations[place].1 = stretch,
            Err(place) => self.region_activations.insert(place, (region, stretch)),
        }
        self.state.history.held = None;
        self.distribute_activations();
        Ok(())
    }

    /// Makes what follows for each region.
    pub(super) fn distribute_activations(&mut self) {
        let model = self.model.clone();
        self.activations.clear();
        for region in model.regions() {
            let stretch = self.region_activation(region);
            self.activations.push(stretch);
        }
    }

    /// Whether what was read can be.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn are_activations(&self) -> bool {
        let (own, fine) = (&self.region_activations, |stretch: f64| (0.0..=10.0).contains(&stretch));
        let known = |(tag, stretch): &(u32, f64)| self.model.region(*tag).is_some() && fine(*stretch);
        fine(self.activation) && own.is_sorted_by(|a, b| a.0 < b.0) && own.iter().all(known)
    }
}

fn check(stretch: f64) -> Result<(), BodyError> {
    in_range("activation", stretch, "from 0 to 10", (0.0..=10.0).contains(&stretch))
}
