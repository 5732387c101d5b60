//! What joints do by themselves: springs and damping of the file.
//!
//! Rapier adds both to a multibody's mass matrix, M' = M + h D + h² K, and takes their forces from the velocity that it finds at
//! its step. Deformable bodies change that velocity by M'⁻¹ beforehand, so that of their forces M M'⁻¹ only would reach a joint
//! with a spring or damping; its dry friction does not see them at all. And rapier gives every joint that turns a damping of 0.1 N m s/rad, in which
//! a finger of 50 g falls for seconds. A motor of the same stiffness and damping is solved along with the deformable bodies: springs and
//! damping are motors here, and what rapier adds by itself is taken away.

use crate::rigid::RobotJointHandle;
use rapier3d::dynamics::{GenericJoint, JointAxis, MotorModel};
use rapier3d::pipeline::PhysicsWorld;

/// A joint's spring and damping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Passive {
    /// [N/m] or [N m/rad]
    pub stiffness: f32,
    /// [N s/m] or [N m s/rad]
    pub damping: f32,
    /// Where the spring is at rest \[m\] or \[rad\].
    pub rest: f32,
    /// Dry friction, up to which the joint does not move \[N\] or \[N m\].
    pub friction: f32,
    /// The loader makes the spring of a time and a damping ratio, when the masses are known.
    pub is_made_later: bool,
}

/// What a motor is to do beside the joint's own spring and damping.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Drive {
    pub position: f32,
    pub speed: f32,
    pub stiffness: f32,
    pub damping: f32,
    /// Beside those, the same everywhere \[N\] or \[N m\].
    pub force: f32,
}

/// How far away a spring ends that draws with a constant force \[m\] or \[rad\]: in a metre it changes by a ten-thousandth.
pub(crate) const FAR: f32 = 1.0e4;

/// Sets the motor of an axis to the sum of both.
pub(crate) fn set_motor(joint: &mut GenericJoint, axis: JointAxis, own: &Passive, drive: &Drive) {
    let mean = |a: f32, at_a: f32, b: f32, at_b: f32| match a + b > 0.0 {
        true => (a * at_a + b * at_b) / (a + b),
        false => at_b,
    };
    let position = mean(own.stiffness, own.rest, drive.stiffness, drive.position);
    let speed = mean(own.damping, 0.0, drive.damping, drive.speed);
    // Newtons and metres: the other model takes gains per mass.
    joint.set_motor_model(axis, MotorModel::ForceBased);
    let [stiffness, damping] = [own.stiffness + drive.stiffness, own.damping + drive.damping];
    if drive.force == 0.0 {
        joint.set_motor(axis, position, speed, stiffness, damping);
    } else if stiffness > 0.0 {
        joint.set_motor(axis, position + drive.force / stiffness, speed, stiffness, damping);
    } else {
        // Rapier keeps a motor's speed to what a limit of the joint leaves, not where it is drawn to.
        joint.set_motor(axis, FAR.copysign(drive.force), speed, drive.force.abs() / FAR, damping);
    }
}

/// Speed at which a motor that stands for dry friction yields all of it [m/s] or [rad/s]: a joint that is held creeps by less.
const CREEP: f32 = 1.0e-5;

/// Sets the motor of an axis to what the joint does without a drive.
pub(crate) fn set_rest(joint: &mut GenericJoint, axis: JointAxis, own: &Passive) {
    if own.has_spring_or_damping() {
        set_motor(joint, axis, own, &Drive::default());
    } else if own.friction > 0.0 {
        joint.set_motor_model(axis, MotorModel::ForceBased);
        joint.set_motor(axis, 0.0, 0.0, 0.0, own.friction / CREEP);
        joint.set_motor_max_force(axis, own.friction);
    }
}

impl Passive {
    fn has_spring_or_damping(&self) -> bool {
        self.stiffness > 0.0 || self.damping > 0.0
    }
}

/// Has a multibody's mass matrix made now, and not in rapier's first step: before it is, links carry soft parts as if nothing could
/// move them.
pub(crate) fn make_mass_matrices(
    physics: &mut PhysicsWorld,
    handles: impl Iterator<Item = RobotJointHandle>,
) {
    for handle in handles {
        let RobotJointHandle::Multibody(handle) = handle else { continue };
        if let Some((multibody, _)) = physics.multibody_joints.get_mut(handle)
            // The root is no joint of the file: what moves freely is not damped.
            && let root = multibody.root().joint().ndofs()
            && multibody.inv_augmented_mass().lu_internal().nrows() != multibody.ndofs()
        {
            multibody.damping_mut().iter_mut().take(root).for_each(|damping| *damping = 0.0);
            multibody.dof_inverse_inertia(&physics.bodies);
        }
    }
}

/// Takes springs and damping out of rapier's multibodies, and tells what the joint's own are.
pub(crate) fn take(
    physics: &mut PhysicsWorld,
    handle: RobotJointHandle,
    axis: Option<JointAxis>,
    of_file: Passive,
) -> Passive {
    let RobotJointHandle::Multibody(handle) = handle else { return of_file };
    let Some((multibody, number)) = physics.multibody_joints.get_mut(handle) else { return of_file };
    let Some(link) = multibody.link_mut(number) else { return of_file };
    let (first, count) = (link.assembly_id(), link.joint.ndofs());
    let mut own = of_file;
    if let Some(axis) = axis {
        let (stiffness, rest) = link.joint.spring(axis as usize);
        link.joint.set_spring(axis as usize, 0.0, 0.0);
        if of_file.is_made_later {
            let damping = multibody.damping().get(first).copied().unwrap_or_default();
            own = Passive { stiffness, damping, rest, friction: of_file.friction, is_made_later: false };
        }
    }
    // Beside a spring or damping, which want the motor, friction stays rapier's.
    if axis.is_some() && !own.has_spring_or_damping() {
        multibody.frictions_mut().iter_mut().skip(first).take(count).for_each(|friction| *friction = 0.0);
    }
    // Joints of several axes have no single motor: what damping the file has for them stays rapier's.
    let left = if axis.is_some() { 0.0 } else { of_file.damping };
    multibody.damping_mut().iter_mut().skip(first).take(count).for_each(|damping| *damping = left);
    own
}
