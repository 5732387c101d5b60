//! Picking and dragging of what is soft, by the mouse.

use foible3d::prelude::*;
use rapier_testbed3d::{Action, KeyCode, MouseButton, TestbedViewer};

/// What is being dragged.
#[derive(Default)]
pub struct Drag(Option<DeformableDrag>);

impl Drag {
    /// Picks with the middle mouse button or D, holds and moves while it is down, and lets go.
    pub fn update(&mut self, viewer: &TestbedViewer, world: &mut DeformableWorld) {
        let window = viewer.window();
        let is_down = window.get_mouse_button(MouseButton::Button3) == Action::Press
            || window.get_key(KeyCode::D) == Action::Press;
        let Some((eye, direction)) = viewer.mouse().ray else { return };
        let bodies = &mut world.bodies;
        match self.0.take() {
            Some(mut drag) if is_down => {
                drag.lead(bodies, eye, direction);
                self.0 = Some(drag);
            }
            Some(drag) => drag.release(bodies),
            None if is_down => self.0 = DeformableDrag::pick(bodies, eye, direction, f32::MAX),
            None => {}
        }
    }
}
