//! The rigid side of contacts: how points of it move over a step, and how they yield.

use crate::contact::{PartnerId, Side};
use crate::math::{Mat3, Pose64, Vec3, rotation_vector};
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
pub(crate) enum Partner {
    /// Fixed or kinematic: goes from pose to pose whatever touches it.
    Prescribed { start: Pose64, end: Pose64 },
    /// Dynamic: implicit Euler like the soft side, `Δ = h v + h² M⁻¹(f_ext + Jᵀλ)`.
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
    pub links: Vec<PartnerId>,
    /// `J_a M⁻¹ J_bᵀ` between slots a and b, row by row: twist per wrench.
    pub blocks: Vec<Matrix6<f64>>,
}

/// All rigid things of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Partners {
    pub list: Vec<Partner>,
    pub articulations: Vec<Articulation>,
}

/// What soft bodies do to a partner over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reaction {
    /// [N s].
    pub impulse: Vec3,
    /// About the centre of mass [N m s].
    pub torque_impulse: Vec3,
    pub touched: bool,
}

impl Partner {
    pub fn com(&self) -> Vec3 {
        match self {
            Self::Prescribed { .. } => Vec3::zeros(),
            Self::Rigid { com, .. } | Self::Link { com, .. } => *com,
        }
    }

    /// Force and moment about the centre of mass of a unit along `d` at a side.
    pub fn wrench(&self, side: &Side, d: &Vec3) -> [Vec3; 2] {
        match side {
            Side::Partner { point, .. } => [*d, (point - self.com()).cross(d)],
            Side::Turn { .. } | Side::Soft { .. } => [Vec3::zeros(), *d],
        }
    }

    /// What a motion is at a side: of its point, or its turn.
    fn at(&self, side: &Side, twist: &Twist) -> Vec3 {
        match side {
            Side::Partner { point, .. } => twist.linear + twist.angular.cross(&(point - self.com())),
            Side::Turn { .. } | Side::Soft { .. } => twist.angular,
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

impl Partners {
    pub fn clear(&mut self) {
        self.list.clear();
        self.articulations.clear();
    }

    pub fn get(&self, id: PartnerId) -> &Partner {
        &self.list[id.0 as usize]
    }

    /// Takes in a partner.
    pub fn push(&mut self, partner: Partner) -> PartnerId {
        self.list.push(partner);
        PartnerId(self.list.len() as u32 - 1)
    }

    /// Whether forces move it.
    pub fn yields(&self, id: PartnerId) -> bool {
        self.get(id).yields()
    }

    /// What yields with this partner: itself, or the first link of its articulation.
    pub fn group(&self, id: PartnerId) -> PartnerId {
        match self.get(id) {
            Partner::Link { articulation, .. } => self.articulations[*articulation].links[0],
            _ => id,
        }
    }

    /// How far a side moves over a step of `h` \[s\] under reactions \[m, rad\]; zero for a soft one.
    pub fn displacement(&self, side: &Side, reactions: &[Reaction], h: f64) -> Vec3 {
        let Some(id) = side.partner() else { return Vec3::zeros() };
        let partner = self.get(id);
        match partner {
            Partner::Prescribed { start, end } => prescribed(side, start, end),
            Partner::Rigid { inv_mass, inv_inertia, free, .. } => {
                let reaction = &reactions[id.0 as usize];
                let twist = Twist {
                    linear: free.linear + inv_mass.component_mul(&reaction.impulse),
                    angular: free.angular + inv_inertia * reaction.torque_impulse,
                };
                partner.at(side, &twist) * h
            }
            Partner::Link { articulation, slot, free, .. } => {
                let Articulation { links, blocks } = &self.articulations[*articulation];
                let mut sum = Vector6::zeros();
                for (link, block) in links.iter().zip(&blocks[slot * links.len()..]) {
                    let reaction = &reactions[link.0 as usize];
                    sum += block * stacked(&[reaction.impulse, reaction.torque_impulse]);
                }
                let twist = Twist {
                    linear: free.linear + sum.fixed_rows::<3>(0),
                    angular: free.angular + sum.fixed_rows::<3>(3),
                };
                partner.at(side, &twist) * h
            }
        }
    }

    /// Velocity of a side at the start of the step [m/s, rad/s].
    pub fn velocity(&self, side: &Side, h: f64) -> Vec3 {
        let Some(id) = side.partner() else { return Vec3::zeros() };
        let partner = self.get(id);
        match partner {
            Partner::Prescribed { start, end } => prescribed(side, start, end) / h,
            Partner::Rigid { twist, .. } | Partner::Link { twist, .. } => partner.at(side, twist),
        }
    }

    /// Velocity that an impulse at side `by` gives to side `at`, for each unit along `direction`.
    pub fn mobility(&self, at: &Side, by: &Side, direction: &Vec3) -> Vec3 {
        let (Some(i), Some(j)) = (at.partner(), by.partner()) else { return Vec3::zeros() };
        let (moved, pushed) = (self.get(i), self.get(j));
        let [force, moment] = pushed.wrench(by, direction);
        let twist = match (moved, pushed) {
            (Partner::Rigid { inv_mass, inv_inertia, .. }, Partner::Rigid { .. }) if i == j => {
                Twist { linear: inv_mass.component_mul(&force), angular: inv_inertia * moment }
            }
            (
                Partner::Link { articulation, slot, .. },
                Partner::Link { articulation: other, slot: from, .. },
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

    /// Adds a force \[N\] (or moment \[N m\]) that acts over a step at a side.
    pub fn add_reaction(&self, side: &Side, force: &Vec3, h: f64, reactions: &mut [Reaction]) {
        let Some(id) = side.partner() else { return };
        let partner = self.get(id);
        if partner.yields() {
            let reaction = &mut reactions[id.0 as usize];
            let [force, moment] = partner.wrench(side, force);
            reaction.touched = true;
            reaction.impulse += force * h;
            reaction.torque_impulse += moment * h;
        }
    }
}

fn prescribed(side: &Side, start: &Pose64, end: &Pose64) -> Vec3 {
    match side {
        Side::Partner { point, .. } => end.transform(&start.inverse_transform(point)) - point,
        Side::Turn { .. } | Side::Soft { .. } => {
            rotation_vector(&(end.rotation * start.rotation.transpose()))
        }
    }
}

/// Force and moment, or their like, in one.
pub(crate) fn stacked([a, b]: &[Vec3; 2]) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}
