//! Picking and dragging of what is soft.

use foible3d::prelude::*;
use rapier_testbed3d::{Action, KeyCode, MouseButton, TestbedViewer};
use rapier3d::math::Vector;

/// What is being dragged.
#[derive(Default)]
pub struct Drag(Option<Held>);

struct Held {
    attachment: DeformableAttachmentHandle,
    /// Where it is held \[m\], and how far from the eye along its ray.
    at: Vector,
    distance: f32,
}

/// Frequency at which a body swings on the spring that drags it [1/s].
const FREQUENCY: f64 = 3.0;

/// How far beside what is thin a ray picks it, per distance.
const PICK: f32 = 0.02;

impl Drag {
    /// Picks with the middle mouse button or D, holds and moves while it is down, and lets go.
    pub fn update(&mut self, viewer: &TestbedViewer, world: &mut DeformableWorld) {
        let window = viewer.window();
        let is_down = window.get_mouse_button(MouseButton::Button3) == Action::Press
            || window.get_key(KeyCode::D) == Action::Press;
        let Some((eye, direction)) = viewer.mouse().ray else { return };
        match &mut self.0 {
            Some(held) if is_down => {
                let to = eye + direction * held.distance;
                if let Some(attachment) = world.bodies.attachment_mut(held.attachment) {
                    attachment.translate(to - held.at);
                    held.at = to;
                }
            }
            Some(held) => {
                world.bodies.detach(held.attachment);
                self.0 = None;
            }
            None if is_down => self.0 = pick(world, eye, direction.normalize()),
            None => {}
        }
    }
}

/// Holds the triangle that a ray meets, or the vertex nearest to it.
fn pick(world: &mut DeformableWorld, eye: Vector, direction: Vector) -> Option<Held> {
    let bodies = &mut world.bodies;
    let hit = bodies.cast_ray(eye, direction, f32::MAX, |_, _| true);
    let hit = hit.map(|hit| (hit.distance, hit.body, hit.vertices.to_vec()));
    let vertices = bodies.iter().flat_map(|(handle, body)| {
        body.positions().enumerate().map(move |(vertex, position)| (handle, vertex, position - eye))
    });
    let beside = vertices.filter_map(|(handle, vertex, way)| {
        let along = way.dot(direction);
        let off = (way - direction * along).length();
        (along > 0.0 && off < PICK * along).then(|| (along, handle, vec![vertex]))
    });
    let nearest = || beside.min_by(|a, b| a.0.total_cmp(&b.0));
    let (distance, body, vertices) = hit.or_else(nearest)?;
    let stiffness = bodies[body].mass() * (std::f64::consts::TAU * FREQUENCY).powi(2);
    let attachment = bodies.attach(body, &vertices, AttachTo::World).ok()?;
    bodies.attachment_mut(attachment)?.set_compliance(vertices.len() as f64 / stiffness);
    Some(Held { attachment, at: eye + direction * distance, distance })
}
