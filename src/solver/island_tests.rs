//! The contacts of an island: momentum, Signorini's and Coulomb's conditions.

use super::constraints::{
    ContactLimits, ContactSystem, Reaction, RigidProxies, RigidProxy, SolveContext, Twist,
};
use super::island::Island;
use super::linear::FactorCache;
pub(super) use super::tests::H;
use super::tests::prepared;
use crate::body::{ConstraintKey, Feature, Frames, ObstacleContact, SolverSettings};
use crate::contact::{Constraint, Endpoint, Law, ProxyId};
use crate::fem::SystemMatrix;
use crate::math::{Mat3, Vec3};

pub(super) const LIMITS: ContactLimits =
    ContactLimits { recovery_speed: 1.0, restitution_threshold: 0.5, iterations: 60 };

/// A bent body with contacts at its lowest nodes.
pub(super) fn touching() -> (FactorCache, Island) {
    let (cache, problem) = prepared(SystemMatrix::RestStiffness, Frames::PerNode, false);
    let mut island = Island::default();
    let nodes: Vec<u32> = problem
        .model
        .surface
        .nodes
        .iter()
        .copied()
        .filter(|&n| problem.model.rest[n as usize].y < -0.19)
        .collect();
    for n in nodes {
        let x = problem.x_start[n as usize];
        let soft = Endpoint::Soft { body: 0, nodes: [n, 0, 0], weights: [1.0, 0.0, 0.0] };
        let key = ObstacleContact { collider: 0, part: 0, feature: Feature::Node(n), slot: 0 };
        let key = ConstraintKey::Obstacle(key);
        let mut constraint =
            Constraint::new([soft, Endpoint::Rigid { proxy: ProxyId(0), point: x }], Vec3::y(), 0.0, key);
        constraint.law = Law::Contact { friction: 0.4 };
        island.contacts.push(constraint);
    }
    island.bodies.push(problem);
    island.bodies[0].settings.contact_tolerance = 1e-12;
    (cache, island)
}

pub(super) fn plate() -> RigidProxies {
    let plate = RigidProxy::Rigid {
        com: Vec3::new(0.1, -0.3, 0.05),
        inv_mass: Vec3::repeat(1.0 / 30.0),
        inv_inertia: Mat3::from_diagonal(&Vec3::new(1.0, 0.7, 1.3)),
        steady_inv_inertia: Mat3::from_diagonal(&Vec3::new(1.0, 0.7, 1.3)),
        twist: Twist { linear: Vec3::y() * 0.5, angular: Vec3::new(0.1, 0.2, -0.3) },
        free: Twist { linear: Vec3::y() * 0.4, angular: Vec3::new(0.1, 0.2, -0.3) },
    };
    RigidProxies { list: vec![plate], articulations: Vec::new() }
}

#[test]
fn impulses_on_the_two_sides_cancel() {
    let proxy = plate();
    let (cache, mut island) = touching();
    island.solve(&SolveContext { factors: &cache, proxies: &proxy, h: H, limits: &LIMITS });
    let mut reactions = [Reaction::default()];
    island.contacts.add_reactions(&proxy, H, &mut reactions);
    let body = &island.bodies[0];
    let gained = (0..body.current.x.len()).map(|i| {
        let mass = 1000.0 * body.model.node_volumes[i];
        (body.current.x[i] - body.x_start[i] - body.v_start[i] * H) * (mass / H)
    });
    let mass = 1000.0 * body.model.volume;
    let by_contact: Vec3 = gained.sum::<Vec3>() + Vec3::y() * (9.81 * H * mass);
    assert!(by_contact.y > 1.0, "they touch: {by_contact}");
    let sum = by_contact + reactions[0].impulse;
    assert!(sum.norm() < 1e-12 * by_contact.norm(), "{:e} of {:e}", sum.norm(), by_contact.norm());
}

#[test]
fn solved_contacts_obey_signorini_and_coulomb() {
    let proxy = plate();
    let (cache, mut island) = touching();
    island.bodies[0].settings = SolverSettings::iterations(100).contact_tolerance(1e-12);
    island.solve(&SolveContext { factors: &cache, proxies: &proxy, h: H, limits: &LIMITS });
    let contacts: &ContactSystem = &island.contacts;
    let mut carrying = 0;
    for (contact, result) in contacts.active.iter().zip(contacts.results()) {
        let (l, gap) = (&contacts.lambda[contact.rows()], result.gap);
        // Lengths are of 1e-3 m over a step; the regularisation (ε = 1e-4) and the lagging shift of
        // slipping contacts leave less than 1e-4 of that.
        assert!(
            gap > -1e-7 && l[0] >= 0.0 && l[1].hypot(l[2]) <= 0.4 * l[0] * (1.0 + 1e-9),
            "{gap:e} {l:?} after {} it.",
            island.report.iterations
        );
        // What carries is closed, but for the part of its slip by which the shift lags.
        let slack = 1e-7 + 0.05 * contact.shift;
        assert!(l[0] == 0.0 || gap < slack, "carries {} N at {gap:e} m, slack {slack:e}", l[0]);
        carrying += usize::from(l[0] > 0.0);
    }
    assert!(carrying >= 3);
}
