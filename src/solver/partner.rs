//! The rigid side of contacts: how a point of it moves over a step, and how it yields.

use crate::math::{Mat3, Pose64, Vec3};

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
        /// Velocities at the start of the step [m/s, rad/s].
        linvel: Vec3,
        angvel: Vec3,
        /// Velocities at its end if nothing touched the body.
        free_linvel: Vec3,
        free_angvel: Vec3,
    },
}

/// What the soft bodies do to a partner over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reaction {
    /// [N s].
    pub impulse: Vec3,
    /// About the centre of mass [N m s].
    pub torque_impulse: Vec3,
    pub touched: bool,
}

impl Partner {
    /// Displacement of the point `p` \[m\] over a step of `h` without contact.
    pub fn free_displacement(&self, p: &Vec3, h: f64) -> Vec3 {
        match self {
            Self::Prescribed { start, end } => end.transform(&start.inverse_transform(p)) - p,
            Self::Rigid { com, free_linvel, free_angvel, .. } => {
                (free_linvel + free_angvel.cross(&(p - com))) * h
            }
        }
    }

    /// What a reaction adds to the displacement of the point `p` \[m\].
    pub fn displacement_by(&self, reaction: &Reaction, p: &Vec3, h: f64) -> Vec3 {
        match self {
            Self::Prescribed { .. } => Vec3::zeros(),
            Self::Rigid { com, inv_mass, inv_inertia, .. } => {
                let angvel = inv_inertia * reaction.torque_impulse;
                (inv_mass.component_mul(&reaction.impulse) + angvel.cross(&(p - com))) * h
            }
        }
    }

    /// Velocity of the point `p` at the start of the step [m/s].
    pub fn velocity(&self, p: &Vec3, h: f64) -> Vec3 {
        match self {
            Self::Prescribed { .. } => self.free_displacement(p, h) / h,
            Self::Rigid { com, linvel, angvel, .. } => linvel + angvel.cross(&(p - com)),
        }
    }

    /// `h²·d_aᵀ J M⁻¹ Jᵀ d_b`: displacement \[m\] at point `p` along `a` per force \[N\] at `q` along `b`.
    pub fn compliance(&self, p: &Vec3, a: &Vec3, q: &Vec3, b: &Vec3, h: f64) -> f64 {
        match self {
            Self::Prescribed { .. } => 0.0,
            Self::Rigid { com, inv_mass, inv_inertia, .. } => {
                let linear = a.dot(&inv_mass.component_mul(b));
                let (arm_a, arm_b) = ((p - com).cross(a), (q - com).cross(b));
                h * h * (linear + arm_a.dot(&(inv_inertia * arm_b)))
            }
        }
    }

    /// Whether forces move it.
    pub fn yields(&self) -> bool {
        match self {
            Self::Prescribed { .. } => false,
            Self::Rigid { inv_mass, inv_inertia, .. } => {
                *inv_mass != Vec3::zeros() || *inv_inertia != Mat3::zeros()
            }
        }
    }

    /// Adds a force \[N\] that acts over a step at the point `p`.
    pub fn add_reaction(&self, reaction: &mut Reaction, p: &Vec3, force: &Vec3, h: f64) {
        if let Self::Rigid { com, .. } = self {
            reaction.touched = true;
            reaction.impulse += force * h;
            reaction.torque_impulse += (p - com).cross(force) * h;
        }
    }
}
