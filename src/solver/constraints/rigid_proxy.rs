//! The rigid endpoint of contacts: how points of it move over a step, and how they yield.

use crate::contact::{Endpoint, ProxyId};
use crate::math::{Mat3, Pose64, Vec3, rotation_from_vector, rotation_vector};
use nalgebra::{Matrix6, Vector6};

/// Linear and angular part of a motion; the linear one is of the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Twist {
    /// [m/s].
    pub linear: Vec3,
    /// [rad/s].
    pub angular: Vec3,
}

/// A rigid body as the contact solve sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RigidProxy {
    /// Fixed or kinematic: goes from pose to pose whatever touches it.
    Prescribed { start: Pose64, end: Pose64 },
    /// Dynamic: implicit Euler like the soft endpoint, `Δ = h v + h² M⁻¹(f_ext + Jᵀλ)`.
    Rigid {
        com: Vec3,
        /// Per axis: locked axes have zero [1/kg].
        inv_mass: Vec3,
        /// In the world [1/(kg m²)].
        inv_inertia: Mat3,
        /// The same at a rounded rotation: at rest the same bits in every step.
        steady_inv_inertia: Mat3,
        /// At the start of the step.
        twist: Twist,
        /// At its end if nothing touched the body.
        free: Twist,
    },
    /// A link of an articulation: yields with all its links.
    Link { articulation: usize, slot: usize, com: Vec3, twist: Twist, free: Twist },
}

/// Links that are moved by each other's forces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Articulation {
    /// The links, by their slots.
    pub links: Vec<ProxyId>,
    /// `J_a M⁻¹ J_bᵀ` between slots a and b, row by row: twist per wrench.
    pub blocks: Vec<Matrix6<f64>>,
}

/// All rigid things of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct RigidProxies {
    pub list: Vec<RigidProxy>,
    pub articulations: Vec<Articulation>,
}

/// What soft bodies do to a proxy over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reaction {
    /// [N s].
    pub impulse: Vec3,
    /// About the centre of mass [N m s].
    pub torque_impulse: Vec3,
    /// Sum of the magnitudes of all forces and moments over the step \[N s\], \[N m s\].
    pub pushed: f64,
    pub touched: bool,
}

impl RigidProxy {
    pub fn com(&self) -> Vec3 {
        match self {
            Self::Prescribed { .. } => Vec3::zeros(),
            Self::Rigid { com, .. } | Self::Link { com, .. } => *com,
        }
    }

    /// Force and moment about the centre of mass of a unit along `d` at an endpoint.
    pub fn wrench(&self, endpoint: &Endpoint, d: &Vec3) -> [Vec3; 2] {
        match endpoint {
            Endpoint::Rigid { point, .. } => [*d, (point - self.com()).cross(d)],
            Endpoint::Rotation { .. } | Endpoint::Soft { .. } => [Vec3::zeros(), *d],
        }
    }

    /// What a motion is at an endpoint: of its point, or its turn.
    fn at(&self, endpoint: &Endpoint, twist: &Twist) -> Vec3 {
        match endpoint {
            Endpoint::Rigid { point, .. } => twist.linear + twist.angular.cross(&(point - self.com())),
            Endpoint::Rotation { .. } | Endpoint::Soft { .. } => twist.angular,
        }
    }

    /// Where a body that does not yield is at the start and at the end of the step.
    pub fn prescribed(&self) -> Option<[Pose64; 2]> {
        match self {
            Self::Prescribed { start, end } => Some([*start, *end]),
            Self::Rigid { .. } | Self::Link { .. } => None,
        }
    }

    fn yields(&self) -> bool {
        match self {
            Self::Prescribed { .. } => false,
            Self::Rigid { inv_mass, inv_inertia, .. } => {
                *inv_mass != Vec3::zeros() || *inv_inertia != Mat3::zeros()
            }
            Self::Link { .. } => true,
        }
    }
}

impl RigidProxies {
    pub fn clear(&mut self) {
        self.list.clear();
        self.articulations.clear();
    }

    pub fn get(&self, id: ProxyId) -> &RigidProxy {
        &self.list[id.0 as usize]
    }

    /// Adds a proxy.
    pub fn push(&mut self, proxy: RigidProxy) -> ProxyId {
        self.list.push(proxy);
        ProxyId(self.list.len() as u32 - 1)
    }

    /// Whether forces move it.
    pub fn yields(&self, id: ProxyId) -> bool {
        self.get(id).yields()
    }

    /// Mass \[kg\] of what moves by itself, along its lightest axis.
    pub fn mass(&self, id: ProxyId) -> Option<f64> {
        match self.get(id) {
            RigidProxy::Rigid { inv_mass, .. } if inv_mass.max() > 0.0 => Some(1.0 / inv_mass.max()),
            _ => None,
        }
    }

    /// What yields with this proxy: itself, or the first link of its articulation.
    pub fn group(&self, id: ProxyId) -> ProxyId {
        match self.get(id) {
            RigidProxy::Link { articulation, .. } => self.articulations[*articulation].links[0],
            _ => id,
        }
    }

    /// How far an endpoint moves over a step of `h` \[s\] under reactions \[m, rad\]; zero for a soft one.
    pub fn displacement(&self, endpoint: &Endpoint, reactions: &[Reaction], h: f64) -> Vec3 {
        let Some(id) = endpoint.proxy() else { return Vec3::zeros() };
        let proxy = self.get(id);
        match proxy {
            RigidProxy::Prescribed { start, end } => prescribed(endpoint, start, end),
            RigidProxy::Rigid { free, .. } | RigidProxy::Link { free, .. } => {
                proxy.at(endpoint, &self.end_twist(id, free, reactions)) * h
            }
        }
    }

    /// Motion of a proxy at the end of the step, that without contact being `free`.
    fn end_twist(&self, id: ProxyId, free: &Twist, reactions: &[Reaction]) -> Twist {
        let gained = self.gained(self.get(id), id, reactions);
        Twist { linear: free.linear + gained.linear, angular: free.angular + gained.angular }
    }

    /// Turn of a yielding body in a step of `h` \[s\] under reactions \[rad\]; `None` of others.
    pub fn turn(&self, id: ProxyId, reactions: &[Reaction], h: f64) -> Option<Vec3> {
        let (RigidProxy::Rigid { free, .. } | RigidProxy::Link { free, .. }) = self.get(id) else {
            return None;
        };
        Some(self.end_twist(id, free, reactions).angular * h)
    }

    /// The same without reactions.
    pub fn free_turn(&self, id: ProxyId, h: f64) -> Option<Vec3> {
        match self.get(id) {
            RigidProxy::Rigid { free, .. } | RigidProxy::Link { free, .. } => Some(free.angular * h),
            RigidProxy::Prescribed { .. } => None,
        }
    }

    /// Where a yielding body takes its points in a step of `h` \[s\] under reactions \[m\], its turn exact; `None` of others.
    pub fn carries(&self, id: ProxyId, reactions: &[Reaction], h: f64) -> Option<impl Fn(&Vec3) -> Vec3> {
        let proxy = self.get(id);
        let (RigidProxy::Rigid { free, .. } | RigidProxy::Link { free, .. }) = proxy else { return None };
        let (twist, com) = (self.end_twist(id, free, reactions), proxy.com());
        let turn = rotation_from_vector(&(twist.angular * h));
        Some(move |point: &Vec3| com + twist.linear * h + turn * (point - com))
    }

    /// As [`Self::displacement`], of what the reactions add alone.
    pub fn response(&self, endpoint: &Endpoint, reactions: &[Reaction], h: f64) -> Vec3 {
        let Some(id) = endpoint.proxy() else { return Vec3::zeros() };
        let proxy = self.get(id);
        proxy.at(endpoint, &self.gained(proxy, id, reactions)) * h
    }

    /// Velocity that reactions give to a proxy.
    fn gained(&self, proxy: &RigidProxy, id: ProxyId, reactions: &[Reaction]) -> Twist {
        match proxy {
            RigidProxy::Prescribed { .. } => Twist::default(),
            RigidProxy::Rigid { inv_mass, inv_inertia, .. } => {
                let reaction = &reactions[id.0 as usize];
                Twist {
                    linear: inv_mass.component_mul(&reaction.impulse),
                    angular: inv_inertia * reaction.torque_impulse,
                }
            }
            RigidProxy::Link { articulation, slot, .. } => {
                let Articulation { links, blocks } = &self.articulations[*articulation];
                let mut sum = Vector6::zeros();
                for (link, block) in links.iter().zip(&blocks[slot * links.len()..]) {
                    let reaction = &reactions[link.0 as usize];
                    sum += block * stacked(&[reaction.impulse, reaction.torque_impulse]);
                }
                Twist {
                    linear: sum.fixed_rows::<3>(0).into_owned(),
                    angular: sum.fixed_rows::<3>(3).into_owned(),
                }
            }
        }
    }

    /// Velocity of an endpoint at the start of the step [m/s, rad/s].
    pub fn velocity(&self, endpoint: &Endpoint, h: f64) -> Vec3 {
        let Some(id) = endpoint.proxy() else { return Vec3::zeros() };
        let proxy = self.get(id);
        match proxy {
            RigidProxy::Prescribed { start, end } => prescribed(endpoint, start, end) / h,
            RigidProxy::Rigid { twist, .. } | RigidProxy::Link { twist, .. } => proxy.at(endpoint, twist),
        }
    }

    /// Velocity that an endpoint gains in the step without contact [m/s, rad/s].
    pub fn falls(&self, endpoint: &Endpoint) -> Vec3 {
        match endpoint.proxy().map(|id| self.get(id)) {
            Some(proxy @ (RigidProxy::Rigid { twist, free, .. } | RigidProxy::Link { twist, free, .. })) => {
                proxy.at(endpoint, free) - proxy.at(endpoint, twist)
            }
            _ => Vec3::zeros(),
        }
    }

    /// Velocity that an impulse at endpoint `by` gives to endpoint `at`, for each unit along `direction`.
    pub fn mobility(&self, at: &Endpoint, by: &Endpoint, direction: &Vec3) -> Vec3 {
        let (Some(i), Some(j)) = (at.proxy(), by.proxy()) else { return Vec3::zeros() };
        let (moved, pushed) = (self.get(i), self.get(j));
        let [force, moment] = pushed.wrench(by, direction);
        let twist = match (moved, pushed) {
            (RigidProxy::Rigid { inv_mass, inv_inertia, .. }, RigidProxy::Rigid { .. }) if i == j => {
                Twist { linear: inv_mass.component_mul(&force), angular: inv_inertia * moment }
            }
            (
                RigidProxy::Link { articulation, slot, .. },
                RigidProxy::Link { articulation: other, slot: from, .. },
            ) if articulation == other => {
                let Articulation { links, blocks } = &self.articulations[*articulation];
                let gained = blocks[slot * links.len() + from] * stacked(&[force, moment]);
                Twist {
                    linear: gained.fixed_rows::<3>(0).into_owned(),
                    angular: gained.fixed_rows::<3>(3).into_owned(),
                }
            }
            _ => Twist::default(),
        };
        moved.at(at, &twist)
    }

    /// Adds a force \[N\] (or moment \[N m\]) that acts over a step at an endpoint.
    pub fn add_reaction(&self, endpoint: &Endpoint, force: &Vec3, h: f64, reactions: &mut [Reaction]) {
        let Some(id) = endpoint.proxy() else { return };
        let proxy = self.get(id);
        if proxy.yields() {
            let reaction = &mut reactions[id.0 as usize];
            reaction.pushed += force.norm() * h;
            let [force, moment] = proxy.wrench(endpoint, force);
            reaction.touched = true;
            reaction.impulse += force * h;
            reaction.torque_impulse += moment * h;
        }
    }
}

fn prescribed(endpoint: &Endpoint, start: &Pose64, end: &Pose64) -> Vec3 {
    match endpoint {
        Endpoint::Rigid { point, .. } => end.transform(&start.inverse_transform(point)) - point,
        Endpoint::Rotation { .. } | Endpoint::Soft { .. } => {
            rotation_vector(&(end.rotation * start.rotation.transpose()))
        }
    }
}

/// Force and moment, or their like, in one.
pub(crate) fn stacked([a, b]: &[Vec3; 2]) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}
