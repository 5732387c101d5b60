//! Couplings of a multibody's coordinates, `q₂ = c q₁ + q₀`: mimic joints, MuJoCo's `<equality><joint>`.

use super::joint_constraints::{Coordinate, JointEnds, coordinate};
use crate::body::JointRole;
use crate::contact::{Constraint, Law, PathPoint, ProxyId};
use rapier3d::dynamics::{Multibody, MultibodyDofCoupling};

/// Adds the couplings of a multibody; `ends` of the joint that leads to a link, `idle` a proxy that does not yield.
pub(super) fn coupling_constraints(
    multibody: &Multibody,
    mut ends: impl FnMut(usize) -> Option<JointEnds>,
    idle: ProxyId,
    constraints: &mut Vec<Constraint>,
) {
    for coupling in multibody.couplings() {
        let MultibodyDofCoupling { link1, axis1, link2, axis2, .. } = *coupling;
        let places = [(link1, axis1), (link2, axis2)];
        let of = |(link, axis): (usize, usize)| {
            let joint = &multibody.link(link)?.joint.data;
            (axis < 6).then_some(coordinate(joint, axis, &ends(link)?))
        };
        let [Some(first), Some(second)] = places.map(of) else { continue };
        let ratio = f64::from(coupling.coeff);
        let along = |q: &Coordinate, scale: f64| {
            let [ahead, behind] = q.endpoints;
            let direction = q.axis * scale;
            [PathPoint { endpoint: ahead, direction }, PathPoint { endpoint: behind, direction: -direction }]
        };
        let path: Vec<PathPoint> = along(&second, 1.0).into_iter().chain(along(&first, -ratio)).collect();
        let gap = second.value - ratio * first.value - f64::from(coupling.offset);
        let key = second.name.key(second.number, JointRole::Coupling);
        constraints.push(Constraint::along(path, idle, gap, Law::BILATERAL, key));
    }
}
