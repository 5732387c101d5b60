//! Constraints of a joint: locked axes, limits and motors.
//!
//! Coordinates are those of the second body's frame in the first's, along and about the axes of the
//! first's. Along coupled linear axes (ropes, springs) there is one coordinate, the distance; coupled
//! angular axes are rapier's alone.

use super::parts::packed;
use crate::body::{ConstraintKey, JointAxis, JointRole};
use crate::contact::{Constraint, Endpoint, Law, ProxyId};
use crate::math::{Mat3, Pose64, Vec3, rotation_vector};
use crate::solver::RigidProxies;
use rapier3d::dynamics::{
    GenericJoint, ImpulseJointHandle, JointAxesMask, JointMotor, MotorModel, RigidBodyHandle,
};
use std::f64::consts::{PI, TAU};

/// What names a joint in the keys of its constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum JointName {
    Impulse(ImpulseJointHandle),
    /// The multibody joint that leads to a link.
    Multibody(RigidBodyHandle),
}

impl JointName {
    pub fn key(self, axis: u32, role: JointRole) -> ConstraintKey {
        match self {
            Self::Impulse(handle) => {
                ConstraintKey::Joint(JointAxis { joint: packed(handle.into_raw_parts()), axis, role })
            }
            Self::Multibody(link) => {
                ConstraintKey::MultibodyJoint(JointAxis { joint: packed(link.into_raw_parts()), axis, role })
            }
        }
    }
}

/// What a joint connects.
pub(super) struct JointEnds {
    pub name: JointName,
    /// Of a multibody joint: its own coordinates, of which angles count turns.
    pub coordinates: Option<[f64; 6]>,
    pub proxies: [ProxyId; 2],
    /// Poses of the two bodies.
    pub poses: [Pose64; 2],
}

/// One coordinate of a joint: how it is measured and what moves it.
pub(super) struct Coordinate {
    pub endpoints: [Endpoint; 2],
    pub axis: Vec3,
    /// \[m\] or \[rad\].
    pub value: f64,
    pub name: JointName,
    /// An angle that is read off a relative rotation, and so does not count turns.
    is_wrapped: bool,
    /// As [`JointAxis::axis`].
    pub number: u32,
}

/// A coordinate along or about an axis, 0 to 5, of a joint without coupled axes.
pub(super) fn coordinate(joint: &GenericJoint, axis: usize, ends: &JointEnds) -> Coordinate {
    let frame1 = ends.poses[0].compose(&Pose64::from_real(&joint.local_frame1));
    let frame2 = ends.poses[1].compose(&Pose64::from_real(&joint.local_frame2));
    match axis {
        0..3 => linear(axis, ends, &frame1, &frame2),
        _ => angular(axis, joint.locked_axes, ends, &frame1, &frame2),
    }
}

/// Limits and forces from here on count as unlimited; rapier's own "unlimited" is `f32::MAX`.
const UNLIMITED: f32 = 1.0e30;

/// Adds the constraints of a joint for a step of `dt` \[s\].
pub(super) fn joint_constraints(
    joint: &GenericJoint,
    ends: &JointEnds,
    proxies: &RigidProxies,
    dt: f64,
    constraints: &mut Vec<Constraint>,
) {
    if !ends.proxies.iter().any(|p| proxies.yields(*p)) {
        return;
    }
    let frame1 = ends.poses[0].compose(&Pose64::from_real(&joint.local_frame1));
    let frame2 = ends.poses[1].compose(&Pose64::from_real(&joint.local_frame2));
    let coupled = joint.coupled_axes & JointAxesMask::LIN_AXES;
    if !coupled.is_empty() {
        let coordinate = distance(coupled, ends, &frame1, &frame2);
        let first = coupled.bits().trailing_zeros() as usize;
        // Rapier's coupled axes have no lower limit: a rope lets what it holds pass its anchor.
        let above = [-f32::MAX, joint.limits[first].max];
        limit_constraints(joint, first, above, &coordinate, constraints);
        motor_constraint(joint, first, &coordinate, proxies, dt, constraints);
    }
    for axis in 0..6 {
        let bit = JointAxesMask::from_bits_truncate(1 << axis);
        if joint.coupled_axes.intersects(bit) {
            continue;
        }
        let coordinate = if axis < 3 {
            linear(axis, ends, &frame1, &frame2)
        } else {
            angular(axis, joint.locked_axes, ends, &frame1, &frame2)
        };
        if joint.locked_axes.intersects(bit) {
            let mut constraint = coordinate.constraint(coordinate.value, JointRole::Lock);
            constraint.law = Law::BILATERAL;
            constraints.push(constraint);
            continue;
        }
        let limits = [joint.limits[axis].min, joint.limits[axis].max];
        limit_constraints(joint, axis, limits, &coordinate, constraints);
        motor_constraint(joint, axis, &coordinate, proxies, dt, constraints);
    }
}

/// Limits and motors of a joint whose locked axes are locked by its coordinates: that of an articulation.
pub(super) fn drive_constraints(
    joint: &GenericJoint,
    ends: &JointEnds,
    proxies: &RigidProxies,
    dt: f64,
    constraints: &mut Vec<Constraint>,
) {
    let mut free = *joint;
    free.locked_axes = JointAxesMask::empty();
    free.limit_axes &= !joint.locked_axes;
    free.motor_axes &= !joint.locked_axes;
    joint_constraints(&free, ends, proxies, dt, constraints);
}

fn limit_constraints(
    joint: &GenericJoint,
    axis: usize,
    [min, max]: [f32; 2],
    coordinate: &Coordinate,
    constraints: &mut Vec<Constraint>,
) {
    let half_range = 0.5 * (f64::from(max) - f64::from(min));
    // As rapier: of an angle that does not count turns, a range of a full turn or more is no limit.
    let is_limited = !coordinate.is_wrapped || half_range < PI;
    if !(is_limited && joint.limit_axes.intersects(JointAxesMask::from_bits_truncate(1 << axis))) {
        return;
    }
    // And such an angle is measured from the middle between the limits.
    let value = coordinate.value_near(0.5 * (f64::from(min) + f64::from(max)));
    if min > -UNLIMITED {
        constraints.push(coordinate.constraint(value - f64::from(min), JointRole::LowerLimit));
    }
    if max < UNLIMITED {
        let reversed = Coordinate { axis: -coordinate.axis, ..*coordinate };
        constraints.push(reversed.constraint(f64::from(max) - value, JointRole::UpperLimit));
    }
}

/// A motor's force `−k(q − q*) − d(q̇ − q̇*)` at the end of the step is a constraint that gives way by
/// 1/(k + d/h).
fn motor_constraint(
    joint: &GenericJoint,
    axis: usize,
    coordinate: &Coordinate,
    proxies: &RigidProxies,
    dt: f64,
    constraints: &mut Vec<Constraint>,
) {
    if !joint.motor_axes.intersects(JointAxesMask::from_bits_truncate(1 << axis)) {
        return;
    }
    let motor: &JointMotor = &joint.motors[axis];
    let per_mass = match motor.model {
        MotorModel::ForceBased => 1.0,
        MotorModel::AccelerationBased => 1.0 / coordinate.mobility(proxies),
    };
    let (k, d) = (f64::from(motor.stiffness) * per_mass, f64::from(motor.damping) * per_mass);
    let stiffness = k + d / dt;
    if !(stiffness > 0.0 && stiffness.is_finite() && motor.max_force > 0.0) {
        return;
    }
    let off = coordinate.value_near(motor.target_pos.into()) - f64::from(motor.target_pos);
    let target = k * off - d * f64::from(motor.target_vel);
    let mut constraint = coordinate.constraint(target / stiffness, JointRole::Motor);
    constraint.compliance = 1.0 / stiffness;
    let limit = if motor.max_force < UNLIMITED { f64::from(motor.max_force) } else { f64::INFINITY };
    constraint.law = Law::bilateral(limit);
    constraints.push(constraint);
}

fn linear(axis: usize, ends: &JointEnds, frame1: &Pose64, frame2: &Pose64) -> Coordinate {
    let direction = frame1.rotation.column(axis).into_owned();
    let value = direction.dot(&(frame2.translation - frame1.translation));
    // The axes turn with the first body, so it is moved where the second body's frame is.
    Coordinate {
        endpoints: at_point(ends, frame2.translation),
        axis: direction,
        value,
        name: ends.name,
        is_wrapped: false,
        number: axis as u32,
    }
}

fn distance(axes: JointAxesMask, ends: &JointEnds, frame1: &Pose64, frame2: &Pose64) -> Coordinate {
    let apart = frame1.rotation.tr_mul(&(frame2.translation - frame1.translation));
    let mut within = Vec3::zeros();
    for axis in 0..3 {
        if axes.intersects(JointAxesMask::from_bits_truncate(1 << axis)) {
            within[axis] = apart[axis];
        }
    }
    let value = within.norm();
    // Coincident points may be drawn apart in any direction.
    let local = if value > 0.0 { within / value } else { Vec3::x() };
    Coordinate {
        endpoints: at_point(ends, frame2.translation),
        axis: frame1.rotation * local,
        value,
        name: ends.name,
        is_wrapped: false,
        number: 6,
    }
}

/// The turn of frame 2 against frame 1 about an axis of frame 1. With one axis free, the others
/// measure how far the two free axes are apart.
fn angular(
    axis: usize,
    locked: JointAxesMask,
    ends: &JointEnds,
    frame1: &Pose64,
    frame2: &Pose64,
) -> Coordinate {
    let k = axis - 3;
    let direction = frame1.rotation.column(k).into_owned();
    let locked_turns = (locked & JointAxesMask::ANG_AXES).bits();
    let is_locked = |a: usize| locked_turns >> (a + 3) & 1 == 1;
    let free: Option<usize> = (0..3).find(|&a| !is_locked(a));
    let value = match free {
        Some(f) if locked_turns.count_ones() == 2 && is_locked(k) => {
            let (a1, a2) = (frame1.rotation.column(f), frame2.rotation.column(f));
            a1.cross(&a2).dot(&direction)
        }
        _ => {
            let turn: Mat3 = frame1.rotation.tr_mul(&frame2.rotation);
            rotation_vector(&turn)[k]
        }
    };
    let endpoints =
        [Endpoint::Rotation { proxy: ends.proxies[1] }, Endpoint::Rotation { proxy: ends.proxies[0] }];
    let (value, is_wrapped) = match ends.coordinates {
        Some(own) => (own[axis], false),
        None => (value, true),
    };
    Coordinate { endpoints, axis: direction, value, name: ends.name, is_wrapped, number: axis as u32 }
}

fn at_point(ends: &JointEnds, point: Vec3) -> [Endpoint; 2] {
    [Endpoint::Rigid { proxy: ends.proxies[1], point }, Endpoint::Rigid { proxy: ends.proxies[0], point }]
}

impl Coordinate {
    /// A constraint along the coordinate.
    fn constraint(&self, gap: f64, role: JointRole) -> Constraint {
        Constraint::new(self.endpoints, self.axis, gap, self.name.key(self.number, role))
    }

    /// The value; of an angle that does not count turns that turn which is nearest to another angle.
    fn value_near(&self, other: f64) -> f64 {
        if self.is_wrapped { self.value - TAU * ((self.value - other) / TAU).round() } else { self.value }
    }

    /// Acceleration per force [1/kg], or the like about an axis.
    fn mobility(&self, proxies: &RigidProxies) -> f64 {
        let [first, second] = &self.endpoints;
        let term = |at: &Endpoint, by: &Endpoint| proxies.mobility(at, by, &self.axis).dot(&self.axis);
        term(first, first) + term(second, second) - term(first, second) - term(second, first)
    }
}
