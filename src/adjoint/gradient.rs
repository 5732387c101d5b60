//! Derivatives of a loss, as users read them.

use crate::body::DeformableCableHandle;
use crate::material::MAX_BRANCHES;
use rapier3d::dynamics::RigidBodyHandle;

/// Derivatives of a loss with respect to the material of a region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MaterialGradient {
    /// Per pascal of Young's modulus.
    pub youngs_modulus: f64,
    /// Of Poisson's ratio.
    pub poisson_ratio: f64,
    /// Per kg/m³ of density, with the user's forces as they are.
    pub density: f64,
    /// Per 1/s of mass damping α.
    pub mass_damping: f64,
    /// Per second of stiffness damping β; zero where there is none.
    pub stiffness_damping: f64,
    /// Of the ratios of the Maxwell branches, in their order, with what their dampers had given way by at first; zero of those that are not there.
    pub maxwell_ratios: [f64; MAX_BRANCHES],
    /// Per second of their times, also of those that are there in some of the steps.
    pub maxwell_times: [f64; MAX_BRANCHES],
    /// Per pascal of the fibres' modulus.
    pub fibre_modulus: f64,
    /// Of what woven cloth has in its plane; zero of other materials. Young's modulus and Poisson's ratio above are those of its bending.
    pub woven: WovenGradient,
}

/// Derivatives of a loss with respect to the elastic constants of woven cloth in its plane
/// ([`OrthotropicSheet`](crate::OrthotropicSheet)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct WovenGradient {
    /// Per pascal of Young's modulus along the warp.
    pub warp_modulus: f64,
    /// Per pascal of Young's modulus along the weft.
    pub weft_modulus: f64,
    /// Of ν₁₂.
    pub poisson_ratio: f64,
    /// Per pascal of the shear modulus.
    pub shear_modulus: f64,
}

/// Derivatives of a loss with respect to what drew a cable in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CableGradient {
    /// The cable.
    pub cable: DeformableCableHandle,
    /// Per newton of a tension that was given; zero otherwise.
    pub tension: f64,
    /// Per metre of the length without tension that was asked for, in steps at whose end the winch had come to it
    /// ([`DeformableCable::free_length`](crate::DeformableCable::free_length)); zero otherwise. Of a cable that is as long as its way was at
    /// first that is part of the derivative with respect to positions.
    pub length: f64,
}

/// Derivatives of a loss with respect to the wind around a body; zero by what is below zero and counts as zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct WindGradient {
    /// Per m/s of the air.
    pub velocity: [f64; 3],
    /// Per kg/m³ of its density.
    pub density: f64,
    /// Of the drag coefficient.
    pub drag: f64,
    /// Of the friction coefficient.
    pub friction: f64,
}

/// Derivatives of a loss with respect to what acted on a body in one step.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct StepGradient {
    /// Per newton on each vertex.
    pub forces: Vec<[f64; 3]>,
    /// Per metre of where each pinned vertex was led to; zero of others.
    pub pin_targets: Vec<[f64; 3]>,
    /// Per m/s² of the world's gravity.
    pub gravity: [f64; 3],
    /// Of the stretch that muscle fibres wanted to have.
    pub activation: f64,
    /// Per pascal more in each filled cavity, in the order of [`DeformableModel::cavities`](crate::DeformableModel::cavities); zero of empty ones.
    pub pressures: Vec<f64>,
    /// Per radian more of roll of each rod that was held against it ([`DeformableBody::hold_twist`](crate::DeformableBody::hold_twist)); zero of others.
    pub rolls: Vec<f64>,
    /// Of the cables through the body, oldest first.
    pub cables: Vec<CableGradient>,
    /// Of the wind; zero where there is none.
    pub wind: WindGradient,
    /// Per m/s that each vertex would have gained before the step.
    pub velocities: Vec<[f64; 3]>,
}

/// Derivatives of a loss with respect to what acted on a rigid body in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RigidStepGradient {
    /// Per newton at its centre of mass.
    pub force: [f64; 3],
    /// Per newton metre.
    pub torque: [f64; 3],
    /// Per m/s² of the world's gravity, as far as this body feels it.
    pub gravity: [f64; 3],
    /// Per m/s that it would have gained before the step.
    pub linvel: [f64; 3],
    /// Per rad/s that it would have gained before the step.
    pub angvel: [f64; 3],
}

/// Derivatives of a loss with respect to a rigid body ([`DeformableTape::with_rigid_bodies`](crate::DeformableTape::with_rigid_bodies)).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RigidBodyGradient {
    /// The body.
    pub body: RigidBodyHandle,
    /// Per metre of where it began.
    pub initial_position: [f64; 3],
    /// Per radian that it was turned by at first, about axes of the world through its centre of mass.
    pub initial_rotation: [f64; 3],
    /// Per m/s with which its centre of mass began.
    pub initial_linvel: [f64; 3],
    /// Per rad/s with which it began.
    pub initial_angvel: [f64; 3],
    /// Per kilogram, with the inertia in proportion.
    pub mass: f64,
    /// Step by step.
    pub steps: Vec<RigidStepGradient>,
}

impl RigidBodyGradient {
    pub(super) fn of(body: RigidBodyHandle) -> Self {
        Self {
            body,
            initial_position: [0.0; 3],
            initial_rotation: [0.0; 3],
            initial_linvel: [0.0; 3],
            initial_angvel: [0.0; 3],
            mass: 0.0,
            steps: Vec::new(),
        }
    }

    /// Per m/s² of a gravity that was the same in all steps, as far as this body feels it.
    pub fn gravity(&self) -> [f64; 3] {
        self.steps.iter().fold([0.0; 3], |sum, step| added(&sum, &step.gravity))
    }

    /// Per newton of a force at its centre of mass that was the same in all steps.
    pub fn force(&self) -> [f64; 3] {
        self.steps.iter().fold([0.0; 3], |sum, step| added(&sum, &step.force))
    }

    /// Per newton metre of a torque that was the same in all steps.
    pub fn torque(&self) -> [f64; 3] {
        self.steps.iter().fold([0.0; 3], |sum, step| added(&sum, &step.torque))
    }
}

/// Derivatives of a loss, of [`DeformableTape::backward`](crate::DeformableTape::backward).
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct DeformableGradient {
    /// Per metre of where each vertex began, with pins led to where they were.
    pub initial_positions: Vec<[f64; 3]>,
    /// Per m/s with which each vertex began.
    pub initial_velocities: Vec<[f64; 3]>,
    /// With respect to the materials of all steps, in the order of [`DeformableModel::regions`](crate::DeformableModel::regions).
    pub materials: Vec<MaterialGradient>,
    /// Of the coefficients of friction of all contacts together; of one between two bodies each has half.
    pub friction: f64,
    /// Step by step.
    pub steps: Vec<StepGradient>,
    /// Of the rigid bodies of the tape, in their order; of a tape of several deformable ones they are with the first.
    pub rigid_bodies: Vec<RigidBodyGradient>,
}

impl DeformableGradient {
    /// With respect to the one material of a body: the sum over its regions.
    pub fn material(&self) -> MaterialGradient {
        self.materials.iter().fold(MaterialGradient::default(), |sum, m| MaterialGradient {
            youngs_modulus: sum.youngs_modulus + m.youngs_modulus,
            poisson_ratio: sum.poisson_ratio + m.poisson_ratio,
            density: sum.density + m.density,
            mass_damping: sum.mass_damping + m.mass_damping,
            stiffness_damping: sum.stiffness_damping + m.stiffness_damping,
            maxwell_ratios: std::array::from_fn(|k| sum.maxwell_ratios[k] + m.maxwell_ratios[k]),
            maxwell_times: std::array::from_fn(|k| sum.maxwell_times[k] + m.maxwell_times[k]),
            fibre_modulus: sum.fibre_modulus + m.fibre_modulus,
            woven: WovenGradient {
                warp_modulus: sum.woven.warp_modulus + m.woven.warp_modulus,
                weft_modulus: sum.woven.weft_modulus + m.woven.weft_modulus,
                poisson_ratio: sum.woven.poisson_ratio + m.woven.poisson_ratio,
                shear_modulus: sum.woven.shear_modulus + m.woven.shear_modulus,
            },
        })
    }

    /// Per m/s² of a gravity that was the same in all steps.
    pub fn gravity(&self) -> [f64; 3] {
        self.steps.iter().fold([0.0; 3], |sum, step| added(&sum, &step.gravity))
    }

    /// Of an activation that was the same in all steps.
    pub fn activation(&self) -> f64 {
        self.steps.iter().map(|step| step.activation).sum()
    }

    /// Per pascal more in each cavity in all steps.
    pub fn pressures(&self) -> Vec<f64> {
        self.columns(|step| &step.pressures)
    }

    /// Per radian more of roll of each rod in all steps.
    pub fn rolls(&self) -> Vec<f64> {
        self.columns(|step| &step.rolls)
    }

    /// Of a wind that was the same in all steps.
    pub fn wind(&self) -> WindGradient {
        self.steps.iter().fold(WindGradient::default(), |sum, StepGradient { wind, .. }| WindGradient {
            velocity: added(&sum.velocity, &wind.velocity),
            density: sum.density + wind.density,
            drag: sum.drag + wind.drag,
            friction: sum.friction + wind.friction,
        })
    }

    /// Of a tension or a length of a cable that was the same in all steps.
    pub fn cable(&self, cable: DeformableCableHandle) -> CableGradient {
        let own = self.steps.iter().flat_map(|step| &step.cables).filter(|of| of.cable == cable);
        own.fold(CableGradient { cable, tension: 0.0, length: 0.0 }, |sum, of| CableGradient {
            cable,
            tension: sum.tension + of.tension,
            length: sum.length + of.length,
        })
    }

    fn columns(&self, of: impl Fn(&StepGradient) -> &Vec<f64>) -> Vec<f64> {
        let count = self.steps.first().map_or(0, |step| of(step).len());
        (0..count).map(|place| self.steps.iter().map(|step| of(step)[place]).sum()).collect()
    }

    /// Per newton on each vertex of a force that was the same in all steps.
    pub fn forces(&self) -> Vec<[f64; 3]> {
        self.summed(|step| &step.forces)
    }

    /// Per metre of where each pinned vertex was held in all steps.
    pub fn pin_targets(&self) -> Vec<[f64; 3]> {
        self.summed(|step| &step.pin_targets)
    }

    fn summed(&self, of: impl Fn(&StepGradient) -> &Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.initial_positions.len()];
        for step in &self.steps {
            sums.iter_mut().zip(of(step)).for_each(|(sum, own)| *sum = added(sum, own));
        }
        sums
    }
}

fn added(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
