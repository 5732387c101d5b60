//! What holds bodies together: joints, motors, attachments.

use super::Stage;
use super::drive::Motored;
use crate::scene::{self, JointKind};
use foible3d::prelude::*;
use rapier3d::prelude::*;

impl Stage {
    /// Makes a joint; names were checked with the file.
    pub(super) fn join(&mut self, joint: &scene::Joint) -> Result<(), String> {
        let named = |name: &str| self.rigid.iter().find(|(n, ..)| n == name).map(|(_, body, _)| *body);
        let [Some(first), Some(second)] = joint.between.each_ref().map(|name| named(name.as_ref())) else {
            return Ok(());
        };
        let anchor = |body: RigidBodyHandle| {
            self.physics.bodies[body].position().inverse_transform_point(joint.anchor.into())
        };
        let mut data: GenericJoint = match joint.kind {
            JointKind::Fixed {} => FixedJointBuilder::new().into(),
            JointKind::Revolute { axis } => RevoluteJointBuilder::new(Vector::from(axis).normalize()).into(),
            JointKind::Prismatic { axis } => {
                PrismaticJointBuilder::new(Vector::from(axis).normalize()).into()
            }
        };
        data.set_local_anchor1(anchor(first));
        data.set_local_anchor2(anchor(second));
        let motor = joint.motor.as_ref();
        if let (Some(motor), Some(axis)) = (motor, joint.kind.free_axis()) {
            data.set_motor_model(axis, MotorModel::ForceBased);
            data.set_motor_velocity(axis, motor.velocity, motor.damping);
            data.set_motor_max_force(axis, motor.max_force);
        }
        let made = if joint.multibody {
            let link = self.physics.multibody_joints.insert(first, second, data, true);
            Motored::Link(link.ok_or_else(|| {
                format!("joint: \"{}\" is a link of a multibody already", joint.between[1].as_ref())
            })?)
        } else {
            Motored::Joint(self.physics.impulse_joints.insert(first, second, data, true))
        };
        self.joints.push(made);
        Ok(())
    }

    /// Attaches a deformable to a rigid body; names were checked with the file.
    pub(super) fn attach(&mut self, attach: &scene::Attach) -> Result<(), String> {
        let soft = self.deformable.iter().find(|(name, _)| name == attach.deformable.as_ref());
        let rigid = self.rigid.iter().find(|(name, ..)| name == attach.to.as_ref());
        let (Some((name, soft)), Some((_, rigid, _))) = (soft, rigid) else { return Ok(()) };
        let body = &self.world.bodies[*soft];
        let of_surface: std::collections::BTreeSet<usize> =
            body.model().surface_triangles().flatten().map(|v| v as usize).collect();
        let (min, max) = (Vector::from(attach.region.min), Vector::from(attach.region.max));
        let mut vertices = body.vertices_where(|x| x.cmpge(min).all() && x.cmple(max).all());
        // Sheets and ropes are surface all over.
        vertices.retain(|v| of_surface.is_empty() || of_surface.contains(v));
        let to = AttachTo::RigidBody(*rigid, *self.physics.bodies[*rigid].position());
        let made = self.world.bodies.attach(*soft, &vertices, to);
        let handle = made.map_err(|e| format!("attach: \"{name}\": {e}"))?;
        if let Some(made) = self.world.bodies.attachment_mut(handle) {
            let mut set = || {
                attach.compliance.iter().try_for_each(|c| made.set_compliance(*c.as_ref()))?;
                attach.length.iter().try_for_each(|length| made.set_length(*length.as_ref()))?;
                attach.break_force.iter().try_for_each(|force| made.set_break_force(*force.as_ref()))
            };
            set().map_err(|e: foible3d::BodyError| format!("attach: \"{name}\": {e}"))?;
        }
        self.attachments.push((name.clone(), handle));
        Ok(())
    }
}
