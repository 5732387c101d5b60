//! A package that falls: its bodies turned together, placed above what they fall on, with the speed of the fall.

use super::Stage;
use crate::scene::{Body, Deformable, Drop, Scene};
use rapier3d::prelude::*;

impl Stage {
    /// Turns, places and speeds up the members of a drop; names were checked with the file.
    pub(super) fn fall(&mut self, scene: &Scene, drop: &Drop) -> Result<(), String> {
        let is_member = |name: &str| drop.members.iter().any(|m| m.as_ref() == name);
        let rigid: Vec<RigidBodyHandle> = self.all_rigid().filter(|r| is_member(r.0)).map(|r| r.1).collect();
        let soft: Vec<_> = self.deformable.iter().filter(|d| is_member(&d.0)).map(|d| d.1).collect();
        let down = Vector::from(*drop.orientation.as_ref()).normalize();
        let turn = Pose::from_parts(Vector::ZERO, Rotation::from_rotation_arc(down, Vector::NEG_Y));
        let lowest_rigid =
            rigid.iter().flat_map(|body| self.physics.bodies[*body].colliders()).map(|collider| {
                let collider = &self.physics.colliders[*collider];
                collider.shape().compute_aabb(&(turn * *collider.position())).mins.y
            });
        let margins: Vec<f32> =
            scene.deformable.iter().filter(|d| is_member(d.name.as_ref())).map(half_thickness).collect();
        let lowest_soft = soft.iter().zip(margins).flat_map(|(body, margin)| {
            self.world.bodies[*body].positions().map(move |p| (turn * p).y - margin)
        });
        let lowest = lowest_rigid.chain(lowest_soft).fold(f32::INFINITY, f32::min);
        if !lowest.is_finite() {
            return Err("drop: its members have no lowest point".into());
        }
        let (height, gap) = (*drop.height.as_ref(), *drop.gap.as_ref());
        let gravity = f64::from(self.physics.gravity.length());
        let velocity = Vector::NEG_Y * (2.0 * gravity * (height - gap)).sqrt() as f32;
        let lift = Pose::from_translation(Vector::Y * (drop.onto + gap as f32 - lowest));
        let moved = lift * turn;
        for body in rigid {
            let body = &mut self.physics.bodies[body];
            body.set_position(moved * *body.position(), true);
            body.set_linvel(body.linvel() + velocity, true);
        }
        for body in soft {
            let body = &mut self.world.bodies[body];
            body.set_pose(moved * body.pose()).map_err(|e| format!("drop: {e}"))?;
            let [x, y, z] = body.linvel();
            let own = Vector::new(x as f32, y as f32, z as f32);
            body.set_linvel(own + velocity).map_err(|e| format!("drop: {e}"))?;
        }
        // Colliders follow their bodies in rapier's next step; contacts of the first one are looked for before it.
        self.physics.bodies.propagate_modified_body_positions_to_colliders(&mut self.physics.colliders);
        Ok(())
    }
}

/// How far a body reaches beyond its vertices \[m\].
fn half_thickness(body: &Deformable) -> f32 {
    match body.body.as_ref() {
        Body::Rope { radius, .. } => *radius,
        Body::Cloth { thickness, .. } => 0.5 * thickness,
        _ => 0.0,
    }
}
