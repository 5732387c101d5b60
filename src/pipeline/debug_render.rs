//! Bodies, contacts and attachments as lines.

use super::world::DeformableWorld;
use crate::body::{DeformableBody, DeformableBodyHandle};
use crate::math::to_real;
use rapier3d::dynamics::{RigidBody, RigidBodyBuilder, RigidBodyHandle};
use rapier3d::math::Vector;
use rapier3d::pipeline::{DebugColor, DebugRenderBackend, DebugRenderObject, DebugRenderStyle};

/// What is drawn, and how. Colours are rapier's: hue, saturation, lightness and alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformableDebugRenderStyle {
    /// Edges of the surface.
    pub edge_color: DebugColor,
    /// Of bodies whose last step was rejected.
    pub rejected_color: DebugColor,
    /// Of bodies in quarantine.
    pub quarantine_color: DebugColor,
    /// Pinned vertices, as crosses.
    pub pin_color: DebugColor,
    /// Contact forces, as arrows from where they act.
    pub force_color: DebugColor,
    /// Lines of attachments.
    pub attachment_color: DebugColor,
    /// Lines of cables.
    pub cable_color: DebugColor,
    /// Length of an arrow per force [m/N].
    pub force_scale: f32,
    /// Half of the length of a cross \[m\].
    pub cross_length: f32,
    /// Rapier's factors on colours of what sleeps and what is disabled.
    pub rapier: DebugRenderStyle,
}

impl Default for DeformableDebugRenderStyle {
    fn default() -> Self {
        Self {
            edge_color: [200.0, 0.6, 0.5, 1.0],
            rejected_color: [30.0, 1.0, 0.5, 1.0],
            quarantine_color: [300.0, 1.0, 0.4, 1.0],
            pin_color: [0.0, 1.0, 0.5, 1.0],
            force_color: [60.0, 1.0, 0.4, 1.0],
            attachment_color: [120.0, 1.0, 0.35, 1.0],
            cable_color: [30.0, 1.0, 0.45, 1.0],
            force_scale: 1.0e-3,
            cross_length: 0.02,
            rapier: DebugRenderStyle::default(),
        }
    }
}

/// Draws deformable bodies through rapier's backends, beside its own `DebugRenderPipeline`. Rapier's `DebugRenderObject` cannot
/// name a deformable body: backends are told of a rigid body with an invalid handle, whose `user_data` is the body's.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// struct Lines(Vec<(Vector, Vector)>);
/// impl DebugRenderBackend for Lines {
///     fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, _: DebugColor) {
///         self.0.push((a, b));
///     }
/// }
/// let mut world = DeformableWorld::new();
/// world.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1, 1, 1]))?;
/// let mut lines = Lines(Vec::new());
/// DeformableDebugRenderPipeline::default().render(&mut lines, &world);
/// assert_eq!(lines.0.len(), 18);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Debug)]
pub struct DeformableDebugRenderPipeline {
    /// How things are drawn.
    pub style: DeformableDebugRenderStyle,
    stand_in: RigidBody,
}

impl Default for DeformableDebugRenderPipeline {
    fn default() -> Self {
        Self::new(DeformableDebugRenderStyle::default())
    }
}

/// A backend, and whose lines it draws.
struct Pen<'a> {
    backend: &'a mut dyn DebugRenderBackend,
    stand_in: &'a RigidBody,
}

impl Pen<'_> {
    fn object(&self) -> DebugRenderObject<'_> {
        DebugRenderObject::RigidBody(RigidBodyHandle::invalid(), self.stand_in)
    }

    fn line(&mut self, a: Vector, b: Vector, color: DebugColor) {
        let object = DebugRenderObject::RigidBody(RigidBodyHandle::invalid(), self.stand_in);
        self.backend.draw_line(object, a, b, color);
    }
}

impl DeformableDebugRenderPipeline {
    /// Draws so.
    pub fn new(style: DeformableDebugRenderStyle) -> Self {
        Self { style, stand_in: RigidBodyBuilder::dynamic().build() }
    }

    /// Draws all bodies, their pins, the contacts of the last step and the attachments.
    pub fn render(&mut self, backend: &mut dyn DebugRenderBackend, world: &DeformableWorld) {
        let bodies: Vec<DeformableBodyHandle> = world.bodies.iter().map(|(handle, _)| handle).collect();
        for handle in bodies {
            let body = &world.bodies[handle];
            self.stand_in.user_data = body.user_data;
            let pen = &mut Pen { backend: &mut *backend, stand_in: &self.stand_in };
            if pen.backend.filter_object(pen.object()) {
                self.style.draw_body(pen, body);
                let contacts = world.contacts_of(handle).map(|c| (c.point, c.force));
                let own = world.pair_contacts().iter().filter(|c| c.body1 == handle);
                contacts.chain(own.map(|c| (c.point, c.force))).for_each(|(point, force)| {
                    self.style.draw_arrow(pen, point, force);
                });
                self.style.draw_attachments(pen, world, handle);
                self.style.draw_cables(pen, world, handle);
            }
        }
    }
}

impl DeformableDebugRenderStyle {
    fn color_of(&self, body: &DeformableBody) -> DebugColor {
        let (color, factor) = match () {
            () if body.is_quarantined() => return self.quarantine_color,
            () if !body.is_enabled() => (self.edge_color, self.rapier.disabled_color_multiplier),
            () if body.is_sleeping() => (self.edge_color, self.rapier.sleep_color_multiplier),
            () if body.last_step_rejected() => return self.rejected_color,
            () => return self.edge_color,
        };
        [0, 1, 2, 3].map(|k| color[k] * factor[k])
    }

    fn draw_body(&self, pen: &mut Pen<'_>, body: &DeformableBody) {
        let color = self.color_of(body);
        let at = |n: u32| to_real(&body.state.x[n as usize]);
        for [a, b] in body.model().surface.edges.iter().map(|edge| edge.map(at)) {
            pen.line(a, b, color);
        }
        for vertex in body.pinned() {
            let [x, y, z] = body.position(vertex).unwrap_or_default().map(|c| c as f32);
            for axis in [Vector::X, Vector::Y, Vector::Z].map(|axis| axis * self.cross_length) {
                pen.line(Vector::new(x, y, z) - axis, Vector::new(x, y, z) + axis, self.pin_color);
            }
        }
    }

    fn draw_arrow(&self, pen: &mut Pen<'_>, from: Vector, force: Vector) {
        let Some(along) = force.try_normalize() else { return };
        let way = force * self.force_scale;
        let to = from + way;
        pen.line(from, to, self.force_color);
        let side = along.any_orthonormal_vector();
        for barb in [side, -side] {
            pen.line(to, to + (barb * 0.5 - along) * (0.2 * way.length()), self.force_color);
        }
    }

    /// Those whose first deformable body it is, where they were at the start of the last step.
    fn draw_cables(&self, pen: &mut Pen<'_>, world: &DeformableWorld, handle: DeformableBodyHandle) {
        for (_, cable) in world.bodies.cables().filter(|(_, cable)| cable.bodies().next() == Some(handle)) {
            for ends in cable.points.windows(2) {
                pen.line(to_real(&ends[0]), to_real(&ends[1]), self.cable_color);
            }
        }
    }

    fn draw_attachments(&self, pen: &mut Pen<'_>, world: &DeformableWorld, handle: DeformableBodyHandle) {
        let own = world.bodies.attachments().filter(|(_, a)| a.body() == handle && !a.is_broken());
        for (_, attachment) in own {
            for (from, to) in attachment.lines(&world.bodies) {
                pen.line(to_real(&from), to_real(&to), self.attachment_color);
            }
        }
    }
}
