//! Rows of a joint: locked axes, limits and motors.
//!
//! Coordinates are those of the second body's frame in the first's, along and about the axes of the
//! first's. Along coupled linear axes (ropes, springs) there is one coordinate, the distance; coupled
//! angular axes are rapier's alone.

use crate::body::ContactKey;
use crate::contact::{Law, PartnerId, Row, Side};
use crate::math::{Mat3, Pose64, Vec3, rotation_vector};
use crate::solver::Partners;
use rapier3d::dynamics::{GenericJoint, JointAxesMask, JointMotor, MotorModel};

/// What a joint connects.
pub(super) struct JointEnds {
    pub partners: [PartnerId; 2],
    /// Poses of the two bodies.
    pub poses: [Pose64; 2],
}

/// One coordinate of a joint: how it is measured and what moves it.
struct Coordinate {
    sides: [Side; 2],
    axis: Vec3,
    /// \[m\] or \[rad\].
    value: f64,
    key: ContactKey,
}

/// Limits and forces from here on are none.
const UNLIMITED: f32 = 1.0e30;

/// Adds the rows of a joint for a step of `dt` \[s\].
pub(super) fn joint_rows(
    joint: &GenericJoint,
    ends: &JointEnds,
    partners: &Partners,
    dt: f64,
    key: ContactKey,
    rows: &mut Vec<Row>,
) {
    if !ends.partners.iter().any(|p| partners.yields(*p)) {
        return;
    }
    let frame1 = ends.poses[0].compose(&Pose64::from_real(&joint.local_frame1));
    let frame2 = ends.poses[1].compose(&Pose64::from_real(&joint.local_frame2));
    let coupled = joint.coupled_axes & JointAxesMask::LIN_AXES;
    if !coupled.is_empty() {
        let coordinate = distance(coupled, ends, &frame1, &frame2, key);
        let first = coupled.bits().trailing_zeros() as usize;
        limit_rows(joint, first, &coordinate, rows);
        motor_row(joint, first, &coordinate, partners, dt, rows);
    }
    for axis in 0..6 {
        let bit = JointAxesMask::from_bits_truncate(1 << axis);
        if joint.coupled_axes.intersects(bit) {
            continue;
        }
        let coordinate = if axis < 3 {
            linear(axis, ends, &frame1, &frame2, key)
        } else {
            angular(axis, joint.locked_axes, ends, &frame1, &frame2, key)
        };
        if joint.locked_axes.intersects(bit) {
            let mut row = coordinate.row(coordinate.value, 0);
            row.law = Law::Held { limit: f64::INFINITY };
            rows.push(row);
            continue;
        }
        limit_rows(joint, axis, &coordinate, rows);
        motor_row(joint, axis, &coordinate, partners, dt, rows);
    }
}

/// Limits and motors of a joint whose locked axes are locked by its coordinates: that of an articulation.
pub(super) fn drive_rows(
    joint: &GenericJoint,
    ends: &JointEnds,
    partners: &Partners,
    dt: f64,
    key: ContactKey,
    rows: &mut Vec<Row>,
) {
    let mut free = *joint;
    free.locked_axes = JointAxesMask::empty();
    free.limit_axes &= !joint.locked_axes;
    free.motor_axes &= !joint.locked_axes;
    joint_rows(&free, ends, partners, dt, key, rows);
}

fn limit_rows(joint: &GenericJoint, axis: usize, coordinate: &Coordinate, rows: &mut Vec<Row>) {
    if !joint.limit_axes.intersects(JointAxesMask::from_bits_truncate(1 << axis)) {
        return;
    }
    let limits = &joint.limits[axis];
    if limits.min > -UNLIMITED {
        rows.push(coordinate.row(coordinate.value - f64::from(limits.min), 1));
    }
    if limits.max < UNLIMITED {
        rows.push(coordinate.reversed().row(f64::from(limits.max) - coordinate.value, 2));
    }
}

/// A motor's force `−k(q − q*) − d(q̇ − q̇*)` at the end of the step is a row that gives way by
/// 1/(k + d/h).
fn motor_row(
    joint: &GenericJoint,
    axis: usize,
    coordinate: &Coordinate,
    partners: &Partners,
    dt: f64,
    rows: &mut Vec<Row>,
) {
    if !joint.motor_axes.intersects(JointAxesMask::from_bits_truncate(1 << axis)) {
        return;
    }
    let motor: &JointMotor = &joint.motors[axis];
    let per_mass = match motor.model {
        MotorModel::ForceBased => 1.0,
        MotorModel::AccelerationBased => 1.0 / coordinate.mobility(partners),
    };
    let (k, d) = (f64::from(motor.stiffness) * per_mass, f64::from(motor.damping) * per_mass);
    let stiffness = k + d / dt;
    if !(stiffness > 0.0 && stiffness.is_finite() && motor.max_force > 0.0) {
        return;
    }
    let target = k * (coordinate.value - f64::from(motor.target_pos)) - d * f64::from(motor.target_vel);
    let mut row = coordinate.row(target / stiffness, 3);
    row.compliance = 1.0 / stiffness;
    let limit = if motor.max_force < UNLIMITED { f64::from(motor.max_force) } else { f64::INFINITY };
    row.law = Law::Held { limit };
    rows.push(row);
}

fn linear(axis: usize, ends: &JointEnds, frame1: &Pose64, frame2: &Pose64, key: ContactKey) -> Coordinate {
    let direction = frame1.rotation.column(axis).into_owned();
    let value = direction.dot(&(frame2.translation - frame1.translation));
    // The axes turn with the first body, so it is moved where the second body's frame is.
    Coordinate {
        sides: at_point(ends, frame2.translation),
        axis: direction,
        value,
        key: numbered(key, axis as u32),
    }
}

fn distance(
    axes: JointAxesMask,
    ends: &JointEnds,
    frame1: &Pose64,
    frame2: &Pose64,
    key: ContactKey,
) -> Coordinate {
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
        sides: at_point(ends, frame2.translation),
        axis: frame1.rotation * local,
        value,
        key: numbered(key, 6),
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
    key: ContactKey,
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
    let sides = [Side::Turn { partner: ends.partners[1] }, Side::Turn { partner: ends.partners[0] }];
    Coordinate { sides, axis: direction, value, key: numbered(key, axis as u32) }
}

fn at_point(ends: &JointEnds, point: Vec3) -> [Side; 2] {
    [Side::Partner { partner: ends.partners[1], point }, Side::Partner { partner: ends.partners[0], point }]
}

fn numbered(key: ContactKey, axis: u32) -> ContactKey {
    ContactKey { part: axis, ..key }
}

impl Coordinate {
    /// A row along the coordinate; `role` tells rows of one coordinate apart.
    fn row(&self, gap: f64, role: u32) -> Row {
        Row::new(self.sides, self.axis, gap, ContactKey { feature: role, ..self.key })
    }

    fn reversed(&self) -> Self {
        Self { axis: -self.axis, ..*self }
    }

    /// Acceleration per force [1/kg], or the like about an axis.
    fn mobility(&self, partners: &Partners) -> f64 {
        let [first, second] = &self.sides;
        let term = |at: &Side, by: &Side| partners.mobility(at, by, &self.axis).dot(&self.axis);
        term(first, first) + term(second, second) - term(first, second) - term(second, first)
    }
}
