//! Cables and signals of a scene, and what signals are told while it runs.

use super::Stage;
use super::drive::Motored;
use crate::scene::{self, Drives, Scene};
use foible3d::prelude::*;
use rapier3d::prelude::*;

impl Stage {
    /// Lays a cable; names were checked with the file.
    pub(super) fn lay(&mut self, cable: &scene::Cable) -> Result<(), String> {
        let name = cable.name.as_ref();
        let points: Vec<CablePoint> = cable.points.iter().map(|point| self.route_point(point)).collect();
        let mut builder = DeformableCableBuilder::new(points)
            .friction(cable.friction)
            .compliance(cable.compliance)
            .speed(cable.speed.unwrap_or(f64::INFINITY))
            .max_tension(cable.max_tension.unwrap_or(f64::INFINITY));
        if let Some(length) = cable.length {
            builder = builder.length(length);
        }
        if let Some(tension) = cable.tension {
            builder = builder.tension(tension);
        }
        let handle = self.world.bodies.insert_cable(builder).map_err(|e| format!("cable \"{name}\": {e}"))?;
        self.cables.push((name.clone(), handle));
        Ok(())
    }

    fn route_point(&self, point: &scene::RoutePoint) -> CablePoint {
        let at = Vector::from(point.at);
        let of = point.of.as_ref().map(|of| of.as_ref().as_str());
        if let Some((_, body, _)) = self.rigid.iter().find(|(name, ..)| Some(name.as_str()) == of) {
            let pose = self.physics.bodies[*body].position();
            return CablePoint::RigidBody(*body, pose.inverse_transform_point(at));
        }
        let Some(&(_, handle)) = self.deformable.iter().find(|(name, _)| Some(name.as_str()) == of) else {
            return CablePoint::World(at);
        };
        let body = &self.world.bodies[handle];
        if body.model().is_solid() {
            return CablePoint::Inside(handle, at);
        }
        let off = body.positions().map(|x| (x - at).length()).enumerate();
        let nearest = off.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(vertex, _)| vertex);
        CablePoint::Vertex(handle, nearest)
    }

    /// Adds a signal; names were checked with the file.
    pub(super) fn add_actuator(&mut self, scene: &Scene, entry: &scene::ActuatorEntry) -> Result<(), String> {
        let name = entry.name.as_ref();
        let Some(actuator) = self.actuator(scene, entry) else { return Ok(()) };
        let rate = entry.rate.unwrap_or(f64::INFINITY);
        let start = entry.start.unwrap_or_else(|| 0.0f64.max(entry.range[0]).min(entry.range[1]));
        let added = self.world.actuators.insert(name, actuator, entry.range, rate, start);
        added.map_err(|e| e.to_string())
    }

    fn actuator(&self, scene: &Scene, entry: &scene::ActuatorEntry) -> Option<Actuator> {
        let of = entry.of.as_ref().map(|of| of.as_ref().as_str());
        let cable = || Some(self.cables.iter().find(|(name, _)| Some(name.as_str()) == of)?.1);
        let body = || Some(self.deformable.iter().find(|(name, _)| Some(name.as_str()) == of)?.1);
        match entry.drives {
            Drives::Tension => Some(Actuator::CableTension(cable()?)),
            Drives::Length => Some(Actuator::CableLength(cable()?)),
            Drives::Pressure => Some(Actuator::CavityPressure(body()?, entry.cavity)),
            Drives::Twist => Some(Actuator::Twist(body()?, 0)),
            Drives::Activation => Some(Actuator::Activation(body()?)),
            Drives::Position | Drives::Velocity => {
                let pair = entry.between.as_ref()?;
                let place = scene
                    .joint
                    .iter()
                    .position(|joint| joint.is_between(pair[0].as_ref(), pair[1].as_ref()))?;
                let axis = scene.joint[place].kind.free_axis()?;
                let axis = JointMotorAxis { axis, stiffness: entry.stiffness, damping: entry.damping };
                Some(match (self.joints[place], entry.drives) {
                    (Motored::Joint(joint), Drives::Position) => Actuator::JointPosition(joint, axis),
                    (Motored::Joint(joint), _) => Actuator::JointVelocity(joint, axis),
                    (Motored::Link(link), Drives::Position) => {
                        Actuator::LinkPosition(RigidBodyHandle(link.0), axis)
                    }
                    (Motored::Link(link), _) => Actuator::LinkVelocity(RigidBodyHandle(link.0), axis),
                })
            }
        }
    }

    /// Tells the signals what the scene tells them in the step that begins at `time` and takes `dt` \[s\].
    pub(super) fn tell(&mut self, scene: &Scene, time: f32, dt: f32) {
        let step = f64::from(time - 0.5 * dt)..f64::from(time + 0.5 * dt);
        for entry in &scene.actuator {
            for command in entry.then.iter().filter(|command| step.contains(&command.at)) {
                // Names and numbers were checked.
                let _ = self.world.actuators.command(entry.name.as_ref(), command.value);
            }
        }
    }
}
