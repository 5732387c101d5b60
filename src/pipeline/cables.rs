//! Where cables are, which the rigid bodies that they run through have a part in.

use crate::body::{DeformableBodySet, DeformableCableHandle};
use crate::math::{Pose64, to_real};
use rapier3d::dynamics::RigidBodySet;
use rapier3d::math::Vector;

impl DeformableBodySet {
    /// Where the points of a cable are now \[m\]; empty if it, or one of the rigid bodies that it runs through, is gone.
    pub fn cable_points(&self, handle: DeformableCableHandle, bodies: &RigidBodySet) -> Vec<Vector> {
        let mut points = Vec::new();
        let known = self.cable(handle).is_some_and(|cable| {
            self.locate(cable, |body| Some(Pose64::from_real(bodies.get(body)?.position())), &mut points)
        });
        if known { points.iter().map(to_real).collect() } else { Vec::new() }
    }

    /// How long the way of a cable through its points is now \[m\]; zero of what is gone.
    pub fn cable_length(&self, handle: DeformableCableHandle, bodies: &RigidBodySet) -> f64 {
        let points = self.cable_points(handle, bodies);
        points.windows(2).map(|w| f64::from((w[1] - w[0]).length())).sum()
    }
}
