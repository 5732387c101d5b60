//! Which soft parts and links do not touch.
//!
//! A soft part does not touch the link that carries it, nor those its file names; all else it does touch. Rapier's groups have
//! 32 bits for a whole scene, of which a hand of five fingers would take one for each part and each link, and the groups of a
//! file would be overwritten. A table of pairs has no end and leaves them alone.

use foible3d::{
    DeformableBodyHandle, DeformableContactModificationContext, DeformableHooks, DeformablePairFilterContext,
};
use rapier3d::dynamics::RigidBodyHandle;
#[cfg(feature = "serde-serialize")]
use rapier3d::geometry::ColliderHandle;
use rapier3d::geometry::SolverFlags;
use rapier3d::pipeline::{ContactModificationContext, PairFilterContext, PhysicsHooks};
use rapier3d_mjcf::MjcfContactHooks;
#[cfg(feature = "serde-serialize")]
use rapier3d_mjcf::PairOverride;
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

/// What hooks hold, in order: pairs kept apart, pairs of colliders that a file excludes, and those that it gives a friction.
#[cfg(feature = "serde-serialize")]
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Pairs {
    pub apart: Vec<(DeformableBodyHandle, RigidBodyHandle)>,
    pub excluded: Vec<(ColliderHandle, ColliderHandle)>,
    pub frictions: Vec<(ColliderHandle, ColliderHandle, Option<f32>)>,
}

#[cfg(feature = "serde-serialize")]
impl RobotHooks {
    /// All pairs; those of the file are among these colliders.
    pub(crate) fn pairs(&self, colliders: &[ColliderHandle]) -> Pairs {
        let mut pairs = Pairs { apart: self.apart.iter().copied().collect(), ..Pairs::default() };
        // The same bytes on every run.
        pairs.apart.sort_unstable_by_key(|(part, link)| (*part, link.into_raw_parts()));
        for (k, a) in colliders.iter().enumerate() {
            for b in &colliders[k..] {
                if self.file.is_excluded(*a, *b) {
                    pairs.excluded.push((*a, *b));
                }
                if let Some(own) = self.file.pair_override(*a, *b) {
                    pairs.frictions.push((*a, *b, own.friction));
                }
            }
        }
        pairs
    }

    /// Of such pairs.
    pub(crate) fn of_pairs(pairs: &Pairs) -> Self {
        let mut file = MjcfContactHooks::new();
        pairs.excluded.iter().for_each(|(a, b)| file.exclude(*a, *b));
        for (a, b, friction) in &pairs.frictions {
            file.add_override(*a, *b, PairOverride { friction: *friction });
        }
        Self { apart: pairs.apart.iter().copied().collect(), file }
    }
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
