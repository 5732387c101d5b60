//! Motors of joints, and where joints are.

use crate::error::RobotError;
use crate::passive::{self, Drive};
use crate::rigid::RobotJointHandle;
use crate::robot::{Robot, RobotJoint};
use rapier3d::dynamics::{GenericJoint, JointAxesMask, JointAxis};
use rapier3d::pipeline::PhysicsWorld;

/// The axis of a joint that has one.
pub(crate) fn single_axis(joint: &GenericJoint) -> Option<JointAxis> {
    match joint.locked_axes {
        JointAxesMask::LOCKED_REVOLUTE_AXES => Some(JointAxis::AngX),
        JointAxesMask::LOCKED_PRISMATIC_AXES => Some(JointAxis::LinX),
        _ => None,
    }
}

/// The joint behind a handle.
pub(crate) fn read_joint(physics: &PhysicsWorld, handle: RobotJointHandle) -> Option<&GenericJoint> {
    match handle {
        RobotJointHandle::Impulse(handle) => physics.impulse_joints.get(handle).map(|joint| &joint.data),
        RobotJointHandle::Multibody(handle) => {
            let (multibody, link) = physics.multibody_joints.get(handle)?;
            multibody.link(link).map(|link| &link.joint.data)
        }
    }
}

/// The same, to be changed.
pub(crate) fn change_joint(
    physics: &mut PhysicsWorld,
    handle: RobotJointHandle,
) -> Option<&mut GenericJoint> {
    match handle {
        RobotJointHandle::Impulse(handle) => {
            physics.impulse_joints.get_mut(handle, true).map(|joint| &mut joint.data)
        }
        RobotJointHandle::Multibody(handle) => {
            let (multibody, link) = physics.multibody_joints.get_mut(handle)?;
            multibody.link_mut(link).map(|link| &mut link.joint.data)
        }
    }
}

impl Robot {
    /// Has the motor of a joint draw it to a position \[m\] or \[rad\], as a spring of `stiffness` [N/m] or [N m/rad] with
    /// `damping` [N s/m] or [N m s/rad]; within the joint's limits, and with no more than the file's effort or
    /// [`Robot::set_motor_max_force`]. The file's spring and damping of the joint come on top. Returns the position that it is drawn to.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`]; [`RobotError::NoAxis`] of joints with more axes or none; [`RobotError::Motor`] for numbers that are
    /// not finite, or negative gains.
    pub fn set_motor_position(
        &self,
        physics: &mut PhysicsWorld,
        joint: &str,
        target: f32,
        stiffness: f32,
        damping: f32,
    ) -> Result<f32, RobotError> {
        let joint = self.joint(joint)?;
        check(joint, "target", target, "finite", target.is_finite())?;
        let target = joint.limits.map_or(target, |[least, largest]| target.clamp(least, largest));
        self.set_motor(physics, joint, [target, 0.0], [stiffness, damping])?;
        Ok(target)
    }

    /// Has the motor of a joint keep it at a speed [m/s] or [rad/s], by a force of `damping` [N s/m] or [N m s/rad] times what is
    /// amiss.
    ///
    /// # Errors
    /// As [`Robot::set_motor_position`].
    pub fn set_motor_velocity(
        &self,
        physics: &mut PhysicsWorld,
        joint: &str,
        target: f32,
        damping: f32,
    ) -> Result<(), RobotError> {
        let joint = self.joint(joint)?;
        check(joint, "target", target, "finite", target.is_finite())?;
        self.set_motor(physics, joint, [0.0, target], [0.0, damping])
    }

    /// Sets the greatest force \[N\] or moment \[N m\] of a joint's motor.
    ///
    /// # Errors
    /// As [`Robot::set_motor_position`].
    pub fn set_motor_max_force(
        &self,
        physics: &mut PhysicsWorld,
        joint: &str,
        force: f32,
    ) -> Result<(), RobotError> {
        let joint = self.joint(joint)?;
        check(joint, "greatest force", force, "zero or positive", force >= 0.0)?;
        let axis = axis_of(joint)?;
        let data = change_joint(physics, joint.handle).ok_or_else(|| gone(joint))?;
        data.set_motor_max_force(axis, force);
        physics.wake_up(joint.child, true);
        Ok(())
    }

    /// Where a joint is \[m\] or \[rad\], between −π and π; zero is where it was put in.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`], [`RobotError::NoAxis`], [`RobotError::Gone`].
    pub fn joint_position(&self, physics: &PhysicsWorld, joint: &str) -> Result<f32, RobotError> {
        let joint = self.joint(joint)?;
        let axis = axis_of(joint)?;
        let data = read_joint(physics, joint.handle).ok_or_else(|| gone(joint))?;
        let ends = (physics.bodies.get(joint.parent), physics.bodies.get(joint.child));
        let (Some(parent), Some(child)) = ends else { return Err(gone(joint)) };
        let [first, second] = [parent.position() * data.local_frame1, child.position() * data.local_frame2];
        let between = first.inverse() * second;
        Ok(match axis {
            JointAxis::LinX => between.translation.x,
            _ => {
                let q = between.rotation;
                let half = if q.w < 0.0 { (-q.x).atan2(-q.w) } else { q.x.atan2(q.w) };
                2.0 * half
            }
        })
    }

    fn set_motor(
        &self,
        physics: &mut PhysicsWorld,
        joint: &RobotJoint,
        [position, speed]: [f32; 2],
        [stiffness, damping]: [f32; 2],
    ) -> Result<(), RobotError> {
        for (quantity, value) in [("stiffness", stiffness), ("damping", damping)] {
            check(joint, quantity, value, "zero or positive, and finite", value.is_finite() && value >= 0.0)?;
        }
        let axis = axis_of(joint)?;
        let data = change_joint(physics, joint.handle).ok_or_else(|| gone(joint))?;
        // What stood for dry friction is a drive now, bounded by the effort alone.
        if joint.passive.friction > 0.0 && data.motors[axis as usize].max_force == joint.passive.friction {
            data.set_motor_max_force(axis, joint.effort.unwrap_or(f32::MAX));
        }
        passive::set_motor(
            data,
            axis,
            &joint.passive,
            &Drive { position, speed, stiffness, damping, force: 0.0 },
        );
        physics.wake_up(joint.child, true);
        Ok(())
    }
}

fn axis_of(joint: &RobotJoint) -> Result<JointAxis, RobotError> {
    joint.axis.ok_or_else(|| RobotError::NoAxis { joint: joint.name.clone() })
}

fn gone(joint: &RobotJoint) -> RobotError {
    RobotError::Gone { joint: joint.name.clone() }
}

fn check(
    joint: &RobotJoint,
    quantity: &'static str,
    value: f32,
    range: &'static str,
    is_fine: bool,
) -> Result<(), RobotError> {
    match is_fine {
        true => Ok(()),
        false => Err(RobotError::Motor { joint: joint.name.clone(), quantity, value, range }),
    }
}
