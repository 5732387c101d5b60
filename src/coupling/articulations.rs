//! Multibodies as articulations: links that yield together by the inverse of their mass matrix.
//!
//! Rapier moves a link by its generalized velocities only: what we do to links is handed over as
//! `v += M⁻¹ Σ Jᵀp`; an impulse on the link's body would be lost. Damping and springs of joints are in `passive_joints`.

use super::mass_properties::{current_mass_properties, external_force};
use super::parts::{PhysicsParts, RapierSets, StepContext};
use super::passive_joints::PassiveJoints;
use crate::contact::ProxyId;
use crate::math::{Vec3, from_real};
use crate::solver::{Articulation, Reaction, RigidProxy, Twist};
use nalgebra::{DMatrix, DVector, Dyn, Matrix6, OMatrix, U6, Vector6};
use rapier3d::dynamics::{Multibody, MultibodyIndex, RigidBodyHandle};
use rapier3d::math::Vector;

/// The links of a multibody in one step.
pub(super) struct ArticulatedLinks {
    pub multibody: MultibodyIndex,
    /// Number within the multibody, and body, by slot.
    pub links: Vec<(usize, RigidBodyHandle)>,
    pub passive: Option<PassiveJoints>,
}

/// A multibody's dynamic links as proxies.
pub(super) struct ReadArticulation {
    /// As [`ArticulatedLinks::links`].
    pub links: Vec<(usize, RigidBodyHandle)>,
    pub proxies: Vec<RigidProxy>,
    /// As [`Articulation::blocks`](crate::solver::Articulation::blocks).
    pub blocks: Vec<Matrix6<f64>>,
    pub passive: Option<PassiveJoints>,
}

/// Reads all dynamic links of a multibody as the articulation `number` of the step; `None` if rapier has not computed
/// its mass matrix yet, or some of its joints are kinematic, of which the order of coordinates is not known.
pub(super) fn read_articulation(
    context: &StepContext<'_>,
    index: MultibodyIndex,
    number: usize,
) -> Option<ReadArticulation> {
    let sets = context.sets;
    let multibody = sets.multibody_joints.get_multibody(index)?;
    let dofs = multibody.ndofs();
    if dofs == 0 || multibody.inv_augmented_mass().lu_internal().nrows() != dofs {
        return None;
    }
    let dynamic = |handle: RigidBodyHandle| sets.bodies.get(handle).is_some_and(|b| b.is_dynamic());
    let links = multibody.links().map(|link| (link.link_id(), link.rigid_body_handle()));
    let links: Vec<(usize, RigidBodyHandle)> = links.filter(|(_, handle)| dynamic(*handle)).collect();
    let jacobians = links.iter().map(|(id, _)| multibody.body_jacobian(*id));
    if links.is_empty() || jacobians.clone().any(|J| J.ncols() != dofs) {
        return None;
    }
    let passive = PassiveJoints::of(multibody, context.h, context.substeps);
    let blocks = compliances(multibody, &links, passive.as_ref());
    let count = links.len();
    let gravity = context.gravity_f32();
    let forces: Vec<Vector6<f64>> = links.iter().map(|(_, h)| external_wrench(sets, *h, gravity)).collect();
    let free = passive.as_ref();
    let free = free.and_then(|passive| free_velocity(multibody, &links, &forces, context.h, passive));
    let mut proxies = Vec::with_capacity(count);
    for (slot, &(_, handle)) in links.iter().enumerate() {
        let body = sets.bodies.get(handle)?;
        let mut gain = Vector6::zeros();
        for (other, force) in forces.iter().enumerate() {
            gain += blocks[slot * count + other] * force * context.h;
        }
        let twist = Twist { linear: from_real(body.linvel()), angular: from_real(body.angvel()) };
        let all: Vector6<f64> = match &free {
            Some(free) => wide(multibody, links[slot].0) * free,
            None => {
                let [l, a] = [twist.linear, twist.angular];
                Vector6::new(l.x, l.y, l.z, a.x, a.y, a.z) + gain
            }
        };
        let free = Twist { linear: all.fixed_rows::<3>(0).into(), angular: all.fixed_rows::<3>(3).into() };
        let com = from_real(current_mass_properties(sets.colliders, body).world_com);
        proxies.push(RigidProxy::Link { articulation: number, slot, com, twist, free });
    }
    Some(ReadArticulation { links, proxies, blocks, passive })
}

/// `J_a M⁻¹ J_bᵀ` of all pairs of links, made symmetric: rapier's matrices are in single precision.
fn compliances(
    multibody: &Multibody,
    links: &[(usize, RigidBodyHandle)],
    passive: Option<&PassiveJoints>,
) -> Vec<Matrix6<f64>> {
    let count = links.len();
    let J = |slot: usize| multibody.body_jacobian(links[slot].0);
    let moved: Vec<Option<DMatrix<f64>>> = (0..count)
        .map(|b| {
            let transposed = DMatrix::from_fn(J(b).ncols(), 6, |i, j| J(b)[(j, i)]);
            match passive {
                Some(passive) => passive.mean_responses(&transposed.map(f64::from)),
                None => Some(multibody.inv_augmented_mass().solve(&transposed)?.map(f64::from)),
            }
        })
        .collect();
    let block = |a: usize, b: usize| {
        let Some(moved) = &moved[b] else { return Matrix6::zeros() };
        let product = wide(multibody, links[a].0) * moved;
        Matrix6::from_fn(|r, c| product[(r, c)])
    };
    let mut blocks = Vec::with_capacity(count * count);
    for a in 0..count {
        for b in 0..count {
            blocks.push((block(a, b) + block(b, a).transpose()) * 0.5);
        }
    }
    blocks
}

/// The Jacobian of a link in double precision.
fn wide(multibody: &Multibody, link: usize) -> OMatrix<f64, U6, Dyn> {
    let J = multibody.body_jacobian(link);
    OMatrix::<f64, U6, Dyn>::from_fn(J.ncols(), |i, j| f64::from(J[(i, j)]))
}

/// Mean of the generalized velocities over a step under external forces, damping and springs.
fn free_velocity(
    multibody: &Multibody,
    links: &[(usize, RigidBodyHandle)],
    forces: &[Vector6<f64>],
    h: f64,
    passive: &PassiveJoints,
) -> Option<DVector<f64>> {
    let mut impulse = DVector::zeros(multibody.ndofs());
    for ((link, _), force) in links.iter().zip(forces) {
        impulse += wide(multibody, *link).tr_mul(force) * h;
    }
    passive.free_velocity(multibody, &impulse)
}

fn external_wrench(sets: RapierSets<'_>, handle: RigidBodyHandle, gravity: Vector) -> Vector6<f64> {
    let Some(body) = sets.bodies.get(handle) else { return Vector6::zeros() };
    let masses = current_mass_properties(sets.colliders, body);
    let force = from_real(external_force(body, &masses, gravity));
    let torque = from_real(body.user_torque());
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// Changes the generalized velocities of touched articulations by the reactions on their links, and by
/// what external forces do over the step; hands out the bodies whose forces have to rest for it.
pub(super) fn write_articulations(
    parts: &mut PhysicsParts<'_>,
    articulations: &[Articulation],
    articulated: &[ArticulatedLinks],
    reactions: &[Reaction],
    touched: &mut Vec<RigidBodyHandle>,
) {
    let dt = f64::from(parts.dt);
    for (articulation, read) in articulations.iter().zip(articulated) {
        let of = |id: &ProxyId| &reactions[id.0 as usize];
        if !articulation.links.iter().any(|id| of(id).touched) {
            continue;
        }
        let wrenches = articulation.links.iter().zip(&read.links).map(|(id, (_, handle))| {
            let external = external_wrench(parts.sets(), *handle, parts.gravity) * dt;
            let (p, l): (Vec3, Vec3) = (of(id).impulse, of(id).torque_impulse);
            Vector6::new(p.x, p.y, p.z, l.x, l.y, l.z) + external
        });
        let wrenches: Vec<Vector6<f64>> = wrenches.collect();
        let Some(multibody) = parts.multibody_joints.get_multibody_mut(read.multibody) else { continue };
        let mut impulse = DVector::<f32>::zeros(multibody.ndofs());
        for ((link, _), wrench) in read.links.iter().zip(&wrenches) {
            impulse += multibody.body_jacobian(*link).tr_mul(&wrench.map(|w| w as f32));
        }
        let change = match &read.passive {
            Some(passive) => passive.kick(&impulse.map(f64::from)).map(|change| change.map(|c| c as f32)),
            None => multibody.inv_augmented_mass().solve(&impulse),
        };
        let Some(change) = change else { continue };
        if change.iter().all(|c| c.is_finite()) {
            let mut velocity = multibody.generalized_velocity_mut();
            velocity += &change;
            touched.extend(read.links.iter().map(|(_, handle)| *handle));
        }
    }
}
