//! Picking and dragging of deformable bodies by rays, as with a mouse.

use crate::body::{AttachTo, DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet};
use parry3d::math::Vector;
use std::f64::consts::TAU;

/// Frequency at which a body swings on the spring that drags it [1/s]: it hangs g/(2πf)², 28 mm, below where it is led to; 110 mm
/// at half of it, and at twice it is pulled four times as hard.
const FREQUENCY: f64 = 3.0;
/// How far beside a vertex a ray still picks it, per distance: springs and ropes have no surface that a ray could meet.
const BESIDE: f32 = 0.02;

/// What a ray has picked, on a spring as stiff as the body's mass asks for. Ends by [`DeformableDrag::release`].
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// let cube = deformables.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]))?;
/// // The mouse is pressed: from the eye along its ray, ten metres at the most.
/// let eye = Vector::new(0.0, 0.0, 3.0);
/// let mut drag = DeformableDrag::pick(&mut deformables.bodies, eye, -Vector::Z, 10.0).expect("there is a cube");
/// assert_eq!(drag.body(), cube);
/// for _ in 0..10 {
///     // It moves:
///     drag.lead(&mut deformables.bodies, eye, Vector::new(0.05, 0.0, -1.0));
///     deformables.step(&mut physics);
/// }
/// // It is let go.
/// drag.release(&mut deformables.bodies);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Debug)]
#[must_use = "a body that is dropped stays on its spring: release it"]
pub struct DeformableDrag {
    body: DeformableBodyHandle,
    attachment: DeformableAttachmentHandle,
    /// Where it is held \[m\], and how far from the eye along its ray.
    at: Vector,
    distance: f32,
}

impl DeformableDrag {
    /// Holds the triangle of a surface that a ray meets first, no farther than `max_distance` \[m\], or the vertex nearest to
    /// the eye of those that it passes by within 2 % of their distance. Nothing if there is neither.
    pub fn pick(
        bodies: &mut DeformableBodySet,
        eye: Vector,
        direction: Vector,
        max_distance: f32,
    ) -> Option<Self> {
        let direction = direction.try_normalize()?;
        let hit = bodies.cast_ray(eye, direction, max_distance, |_, _| true);
        let hit = hit.map(|hit| (hit.distance, hit.body, hit.vertices.to_vec()));
        let (distance, body, vertices) =
            hit.or_else(|| vertex_beside(bodies, eye, direction, max_distance))?;
        let stiffness = bodies.get(body)?.mass() * (TAU * FREQUENCY).powi(2);
        let attachment = bodies.attach(body, &vertices, AttachTo::World).ok()?;
        bodies.attachment_mut(attachment)?.set_compliance(vertices.len() as f64 / stiffness).ok()?;
        Some(Self { body, attachment, at: eye + direction * distance, distance })
    }

    /// The body that is held.
    pub fn body(&self) -> DeformableBodyHandle {
        self.body
    }

    /// Leads it to where the ray is now, as far from the eye as it was picked.
    pub fn lead(&mut self, bodies: &mut DeformableBodySet, eye: Vector, direction: Vector) {
        let Some(direction) = direction.try_normalize() else { return };
        let to = eye + direction * self.distance;
        if let Some(attachment) = bodies.attachment_mut(self.attachment).filter(|_| to.is_finite()) {
            attachment.translate(to - self.at);
            self.at = to;
        }
    }

    /// Lets go.
    pub fn release(self, bodies: &mut DeformableBodySet) {
        bodies.detach(self.attachment);
    }
}

/// Distance, body and name of the vertex nearest to the eye that a ray passes by.
fn vertex_beside(
    bodies: &DeformableBodySet,
    eye: Vector,
    direction: Vector,
    max_distance: f32,
) -> Option<(f32, DeformableBodyHandle, Vec<usize>)> {
    let enabled = bodies.iter().filter(|(_, body)| body.is_enabled());
    let vertices = enabled.flat_map(|(handle, body)| {
        body.positions().enumerate().map(move |(vertex, position)| (handle, vertex, position - eye))
    });
    let beside = vertices.filter_map(|(handle, vertex, way)| {
        let along = way.dot(direction);
        let off = (way - direction * along).length();
        let is_near = along > 0.0 && along <= max_distance && off < BESIDE * along;
        is_near.then(|| (along, handle, vec![vertex]))
    });
    beside.min_by(|a, b| a.0.total_cmp(&b.0))
}
