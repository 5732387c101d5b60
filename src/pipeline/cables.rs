//! Where cables are, which the rigid bodies that they run through have a part in.

use crate::body::{DeformableBodySet, DeformableCable, DeformableCableHandle};
use crate::math::{Pose64, Vec3, to_real};
use rapier3d::dynamics::RigidBodySet;
use rapier3d::math::Vector;

impl DeformableBodySet {
    /// Where the points of a cable are now \[m\]; empty if it, or one of the rigid bodies that it runs through, is gone.
    pub fn cable_points(&self, handle: DeformableCableHandle, bodies: &RigidBodySet) -> Vec<Vector> {
        let points = self.cable(handle).and_then(|cable| self.points_of_cable(cable, bodies));
        points.iter().flatten().map(to_real).collect()
    }

    /// The same in the solver's precision; `None` if something of it is gone.
    pub(crate) fn points_of_cable(
        &self,
        cable: &DeformableCable,
        bodies: &RigidBodySet,
    ) -> Option<Vec<Vec3>> {
        let mut points = Vec::new();
        let pose = |body| Some(Pose64::from_real(bodies.get(body)?.position()));
        self.locate(cable, pose, &mut points).then_some(points)
    }

    /// How long the way of a cable through its points is now \[m\]; zero of what is gone.
    pub fn cable_length(&self, handle: DeformableCableHandle, bodies: &RigidBodySet) -> f64 {
        let points = self.cable_points(handle, bodies);
        points.windows(2).map(|w| f64::from((w[1] - w[0]).length())).sum()
    }
}

impl DeformableCable {
    /// Whether one of the rigid bodies that it runs through yields, or is gone.
    pub(crate) fn yields(&self, bodies: &RigidBodySet) -> bool {
        self.rigid_bodies().any(|body| bodies.get(body).is_none_or(|body| body.is_dynamic()))
    }
}
