//! Which soft parts and links do not touch.
//!
//! A soft part does not touch the link that carries it, nor those its file names; all else it does touch. Rapier's groups have
//! 32 bits for a whole scene, of which a hand of five fingers would take one for each part and each link, and the groups of a
//! file would be overwritten. A table of pairs has no end and leaves them alone.

use foible3d::{
    DeformableBodyHandle, DeformableContactModificationContext, DeformableHooks, DeformablePairFilterContext,
};
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::SolverFlags;
use rapier3d::pipeline::{ContactModificationContext, PairFilterContext, PhysicsHooks};
use rapier3d_mjcf::MjcfContactHooks;
use std::collections::HashSet;

/// The hooks of a robot, for [`DeformableWorld::step_with_events`](foible3d::DeformableWorld::step_with_events): pairs that
/// do not touch, and an MJCF file's `<contact>`. They are asked about the robot's soft parts only.
///
/// [`Robot::step`](crate::Robot::step) passes them on; [`RobotHooks::beside`] puts other hooks beside them, those of a second
/// robot for instance.
#[derive(Clone, Debug, Default)]
pub struct RobotHooks {
    apart: HashSet<(DeformableBodyHandle, RigidBodyHandle)>,
    file: MjcfContactHooks,
}

impl RobotHooks {
    pub(crate) fn new(file: MjcfContactHooks) -> Self {
        Self { apart: HashSet::new(), file }
    }

    /// Keeps a soft part and a link from touching. Wake the part if it may be asleep; its hooks have to be active
    /// ([`FILTER_CONTACT_PAIRS`](rapier3d::pipeline::ActiveHooks::FILTER_CONTACT_PAIRS)), as those of a robot's parts are.
    pub fn keep_apart(&mut self, part: DeformableBodyHandle, link: RigidBodyHandle) {
        self.apart.insert((part, link));
    }

    /// Lets a soft part and a link touch. Vertices that are attached to the link do not even so.
    pub fn let_touch(&mut self, part: DeformableBodyHandle, link: RigidBodyHandle) {
        self.apart.remove(&(part, link));
    }

    /// Whether a soft part and a link are kept apart.
    pub fn are_apart(&self, part: DeformableBodyHandle, link: RigidBodyHandle) -> bool {
        self.apart.contains(&(part, link))
    }

    /// These hooks and others: what either forbids does not touch, and both change contacts, these first.
    pub fn beside<'a>(&'a self, others: &'a dyn DeformableHooks) -> impl DeformableHooks + 'a {
        Joined { own: self, others }
    }
}

impl PhysicsHooks for RobotHooks {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        self.file.filter_contact_pair(context)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        self.file.modify_solver_contacts(context);
    }
}

impl DeformableHooks for RobotHooks {
    fn filter_deformable_contact_pair(&self, pair: &DeformablePairFilterContext<'_>) -> bool {
        pair.rigid_body.is_none_or(|link| !self.are_apart(pair.body, link))
    }
}

struct Joined<'a> {
    own: &'a RobotHooks,
    others: &'a dyn DeformableHooks,
}

impl PhysicsHooks for Joined<'_> {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let own = self.own.filter_contact_pair(context)?;
        Some(own & self.others.filter_contact_pair(context)?)
    }

    fn filter_intersection_pair(&self, context: &PairFilterContext<'_>) -> bool {
        self.own.filter_intersection_pair(context) && self.others.filter_intersection_pair(context)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        self.own.modify_solver_contacts(context);
        self.others.modify_solver_contacts(context);
    }
}

impl DeformableHooks for Joined<'_> {
    fn filter_deformable_contact_pair(&self, pair: &DeformablePairFilterContext<'_>) -> bool {
        self.own.filter_deformable_contact_pair(pair) && self.others.filter_deformable_contact_pair(pair)
    }

    fn filter_deformable_intersection_pair(&self, pair: &DeformablePairFilterContext<'_>) -> bool {
        self.others.filter_deformable_intersection_pair(pair)
    }

    fn modify_deformable_contacts(&self, contacts: &mut DeformableContactModificationContext<'_>) {
        self.others.modify_deformable_contacts(contacts);
    }
}
