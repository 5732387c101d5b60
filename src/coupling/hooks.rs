//! What users decide about contacts: which pairs touch, and with what friction, restitution and surface velocity.

use super::parts::{StepContext, packed};
use crate::body::{
    DeformableBody, DeformableBodyHandle, DeformableBodySet, DeformableContactPartner, Partner,
};
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::{Vec3, from_real, to_real};
use rapier3d::dynamics::{RigidBodyHandle, RigidBodySet};
use rapier3d::geometry::{Collider, ColliderSet};
use rapier3d::math::{Pose, Vector};
use rapier3d::pipeline::{ActiveHooks, PhysicsHooks};
use std::fmt;

/// Rapier's hooks for pairs with a deformable body. They are asked where [`ActiveHooks`] of either side say so, from the
/// threads that look for contacts. What sleeps is not asked about: wake it where answers change.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// struct Ghosts;
/// impl PhysicsHooks for Ghosts {}
/// impl DeformableHooks for Ghosts {
///     fn filter_deformable_contact_pair(&self, pair: &DeformablePairFilterContext<'_>) -> bool {
///         pair.deformables[pair.body].user_data != 1
///     }
/// }
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1, 2.0));
/// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(Vector::Y * 0.2);
/// let cube = cube.active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS).user_data(1);
/// let ghost = deformables.insert(cube)?;
/// for _ in 0..60 {
///     deformables.step_with_events(&mut physics, &Ghosts, &());
/// }
/// assert!(deformables.bodies[ghost].center_of_mass()[1] < -1.0);
/// # Ok::<(), DeformableBodyError>(())
/// ```
pub trait DeformableHooks: PhysicsHooks + Sync {
    /// Whether a pair may touch. Asked with [`ActiveHooks::FILTER_CONTACT_PAIRS`].
    fn filter_deformable_contact_pair(&self, _pair: &DeformablePairFilterContext<'_>) -> bool {
        true
    }

    /// Whether a sensor sees a body. Asked with [`ActiveHooks::FILTER_INTERSECTION_PAIR`].
    fn filter_deformable_intersection_pair(&self, _pair: &DeformablePairFilterContext<'_>) -> bool {
        true
    }

    /// Changes the contacts of a pair, or takes some of them away. Asked with [`ActiveHooks::MODIFY_SOLVER_CONTACTS`].
    fn modify_deformable_contacts(&self, _contacts: &mut DeformableContactModificationContext<'_>) {}
}

impl DeformableHooks for () {}

/// A pair that a hook is asked about.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct DeformablePairFilterContext<'a> {
    /// The deformable bodies.
    pub deformables: &'a DeformableBodySet,
    /// The rigid bodies.
    pub bodies: &'a RigidBodySet,
    /// The colliders.
    pub colliders: &'a ColliderSet,
    /// The deformable body; of two that with the lower handle.
    pub body: DeformableBodyHandle,
    /// What it may touch.
    pub partner: DeformableContactPartner,
    /// The rigid body of a collider that has one.
    pub rigid_body: Option<RigidBodyHandle>,
}

/// The contacts of a pair, for a hook to change.
#[derive(Debug)]
#[non_exhaustive]
pub struct DeformableContactModificationContext<'a> {
    /// The pair.
    pub pair: DeformablePairFilterContext<'a>,
    /// Pose of the collider; the identity where the partner is deformable.
    pub partner_pose: Pose,
    /// Contacts that the step will solve. What is taken out is not solved.
    pub contacts: &'a mut Vec<DeformableSolverContact>,
    /// Kept for the pair from step to step, as long as their boxes are near; zero at first. While it is not, hooks are asked
    /// without contacts too.
    pub user_data: &'a mut u32,
}

/// A contact that the step will solve: where a part of a body's surface may touch in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformableSolverContact {
    point: Vector,
    normal: Vector,
    dist: f64,
    place: usize,
    /// Coefficient of friction.
    pub friction: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Velocity of the partner's surface along itself, beside its own motion [m/s]: that of a conveyor belt.
    pub tangent_velocity: Vector,
}

impl DeformableSolverContact {
    /// Point on the partner at the start of the step \[m\].
    pub fn point(&self) -> Vector {
        self.point
    }

    /// Unit normal, from the partner to the body.
    pub fn normal(&self) -> Vector {
        self.normal
    }

    /// Distance along the normal at the start of the step \[m\]; negative is penetration.
    pub fn dist(&self) -> f64 {
        self.dist
    }
}

/// The sets are whole worlds: the names only.
impl fmt::Debug for DeformablePairFilterContext<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeformablePairFilterContext")
            .field("body", &self.body)
            .field("partner", &self.partner)
            .field("rigid_body", &self.rigid_body)
            .finish_non_exhaustive()
    }
}

/// What the pair has been found to be, in its `user_data`.
const UNKNOWN: u32 = 0;
const ALLOWED: u32 = 1;
const FORBIDDEN: u32 = 2;

impl DeformableContactModificationContext<'_> {
    /// Lets the body through, but from the side to which `allowed_normal` of the partner's frame points: as rapier's own
    /// `update_as_oneway_platform`. Normals may differ from it by `allowed_angle` \[rad\]. Needs `user_data` for itself.
    pub fn update_as_oneway_platform(&mut self, allowed_normal: Vector, allowed_angle: f32) {
        let allowed = self.partner_pose.rotation * allowed_normal;
        let is_allowed = |c: &DeformableSolverContact| c.normal.dot(allowed) >= allowed_angle.cos();
        // Contacts are where the body is near: what is on its way through has parts on the other side.
        let top = self.contacts.iter().map(|c| c.point.dot(allowed)).fold(f32::NEG_INFINITY, f32::max);
        let body = &self.pair.deformables[self.pair.body];
        let lowest = top - BELOW * body.model.surface.mean_edge as f32;
        let is_beyond = || body.state.x.iter().all(|x| to_real(x).dot(allowed) > lowest);
        *self.user_data = match *self.user_data {
            // Between two rows of its vertices a body has no contacts, and has not passed.
            FORBIDDEN if self.contacts.is_empty() => FORBIDDEN,
            _ if self.contacts.is_empty() => UNKNOWN,
            // What lies on it may hang over its rim.
            ALLOWED => ALLOWED,
            _ if self.contacts.iter().all(is_allowed) && is_beyond() => ALLOWED,
            _ => FORBIDDEN,
        };
        if *self.user_data == FORBIDDEN {
            self.contacts.clear();
        }
    }
}

/// Mean edges by which a vertex of what has passed a one-way platform may be below its top: it may land fast.
const BELOW: f32 = 0.1;
/// Of normals, by the endpoint that is the partner.
const SIGNS: [f64; 2] = [-1.0, 1.0];
/// Coefficients of friction that the solver takes.
const MOST_FRICTION: f64 = 1.0e4;

/// Two things that a hook may be asked about.
#[derive(Clone, Copy)]
pub(crate) struct HookedPair<'a> {
    pub body: DeformableBodyHandle,
    pub partner: DeformableContactPartner,
    collider: Option<&'a Collider>,
    active: ActiveHooks,
}

impl<'a> HookedPair<'a> {
    /// Of a body and a collider.
    pub fn with_collider(
        (body, of): (DeformableBodyHandle, &DeformableBody),
        (partner, collider): (rapier3d::geometry::ColliderHandle, &'a Collider),
    ) -> Self {
        let active = of.active_hooks() | collider.active_hooks();
        Self { body, partner: DeformableContactPartner::Collider(partner), collider: Some(collider), active }
    }

    /// Of two bodies.
    pub fn between(bodies: [(DeformableBodyHandle, &DeformableBody); 2]) -> Self {
        let [(body, first), (partner, second)] = bodies;
        let active = first.active_hooks() | second.active_hooks();
        Self { body, partner: DeformableContactPartner::Deformable(partner), collider: None, active }
    }

    fn filter(
        &self,
        deformables: &'a DeformableBodySet,
        context: &StepContext<'a>,
    ) -> DeformablePairFilterContext<'a> {
        DeformablePairFilterContext {
            deformables,
            bodies: context.sets.bodies,
            colliders: context.sets.colliders,
            body: self.body,
            partner: self.partner,
            rigid_body: self.collider.and_then(Collider::parent),
        }
    }

    /// Whether hooks are to change their contacts.
    pub fn modifies(&self) -> bool {
        self.active.contains(ActiveHooks::MODIFY_SOLVER_CONTACTS)
    }

    /// Whether hooks let them touch.
    pub fn may_touch(&self, deformables: &'a DeformableBodySet, context: &StepContext<'a>) -> bool {
        !self.active.contains(ActiveHooks::FILTER_CONTACT_PAIRS)
            || context.hooks.filter_deformable_contact_pair(&self.filter(deformables, context))
    }

    /// Whether hooks let the one see the other.
    pub fn may_sense(&self, deformables: &'a DeformableBodySet, context: &StepContext<'a>) -> bool {
        !self.active.contains(ActiveHooks::FILTER_INTERSECTION_PAIR)
            || context.hooks.filter_deformable_intersection_pair(&self.filter(deformables, context))
    }

    /// Lets hooks change the contacts between them; whether they have taken any away. What they note goes into `data`;
    /// `place` is that of the body in the step's list.
    pub fn modify(
        &self,
        (deformables, place): (&'a DeformableBodySet, usize),
        context: &StepContext<'a>,
        constraints: &mut Vec<Constraint>,
        data: &mut Vec<(Partner, u32)>,
    ) -> bool {
        let is_itself = self.partner == DeformableContactPartner::Deformable(self.body);
        if !self.modifies() || is_itself {
            return false;
        }
        let name = match self.partner {
            DeformableContactPartner::Collider(handle) => Partner::Collider(packed(handle.into_raw_parts())),
            DeformableContactPartner::Deformable(handle) => Partner::Soft(packed(handle.into_raw_parts())),
        };
        let kept = deformables[self.body].state.pair_data.iter().find(|(partner, _)| *partner == name);
        let mut user_data = kept.map_or(0, |(_, data)| *data);
        if constraints.is_empty() && user_data == 0 {
            return false;
        }
        // The body is endpoint 0, or 1 where a node of another deformable body touches it.
        let side = |constraint: &Constraint| usize::from(constraint.endpoints[0].is_of(place));
        let point = |endpoint: &Endpoint| match (endpoint, self.partner) {
            (Endpoint::Rigid { point, .. }, _) => *point,
            (_, DeformableContactPartner::Deformable(partner)) => {
                endpoint.interpolate(&deformables[partner].state.x)
            }
            _ => Vec3::zeros(),
        };
        let shown = |(i, constraint): (usize, &Constraint)| {
            let side = side(constraint);
            shown(constraint, i, SIGNS[side], point(&constraint.endpoints[side]))
        };
        let mut contacts: Vec<_> = constraints.iter().enumerate().map(shown).collect();
        context.hooks.modify_deformable_contacts(&mut DeformableContactModificationContext {
            pair: self.filter(deformables, context),
            partner_pose: self.collider.map_or(Pose::IDENTITY, |c| pose_of(c, context)),
            contacts: &mut contacts,
            user_data: &mut user_data,
        });
        if user_data != 0 {
            data.push((name, user_data));
        }
        contacts.sort_unstable_by_key(|contact| contact.place);
        contacts.dedup_by_key(|contact| contact.place);
        let mut left = contacts.iter().peekable();
        let count = constraints.len();
        let mut i = 0;
        constraints.retain_mut(|constraint| {
            let own = left.next_if(|contact| contact.place == i);
            i += 1;
            let step = context.h * SIGNS[side(constraint)];
            own.inspect(|contact| apply(contact, constraint, step)).is_some()
        });
        // Without contacts, what is noted of the pair may keep it from touching.
        constraints.len() < count || count == 0 && user_data != 0
    }
}

/// Where a collider is; its own pose may be behind its body's.
pub(crate) fn pose_of(collider: &Collider, context: &StepContext<'_>) -> Pose {
    let body = collider.parent().and_then(|handle| context.sets.bodies.get(handle));
    let offset = collider.position_wrt_parent();
    match (body, offset) {
        (Some(body), Some(offset)) => *body.position() * *offset,
        _ => *collider.position(),
    }
}

fn shown(constraint: &Constraint, place: usize, sign: f64, point: Vec3) -> DeformableSolverContact {
    let friction = match constraint.law {
        Law::Contact { friction } => friction,
        Law::Bounded { .. } => 0.0,
    };
    DeformableSolverContact {
        point: to_real(&point),
        normal: to_real(&(constraint.frame[0] * sign)),
        dist: constraint.gap,
        place,
        friction,
        restitution: constraint.restitution,
        tangent_velocity: Vector::ZERO,
    }
}

/// Takes over what a hook has set for a step \[s\], negative where the partner is endpoint 0; NaN is zero.
fn apply(contact: &DeformableSolverContact, constraint: &mut Constraint, step: f64) {
    constraint.law = Law::Contact { friction: within(contact.friction, MOST_FRICTION) };
    constraint.restitution = within(contact.restitution, 1.0);
    if contact.tangent_velocity.is_finite() {
        let [normal, ..] = constraint.frame;
        let motion = from_real(contact.tangent_velocity) * step;
        constraint.surface_motion = motion - normal * normal.dot(&motion);
    }
}

/// From zero to `most`; zero if it is NaN.
fn within(value: f64, most: f64) -> f64 {
    if value > 0.0 { value.min(most) } else { 0.0 }
}
