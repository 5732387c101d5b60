//! What is drawn through rapier's debug renderers.

use crate::common::world_with_floor;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Lines with their colours; `filter` hides bodies by their user data.
#[derive(Default)]
struct Lines {
    drawn: Vec<(Vector, Vector, DebugColor)>,
    hidden: u128,
}

impl DebugRenderBackend for Lines {
    fn filter_object(&self, object: DebugRenderObject) -> bool {
        matches!(object, DebugRenderObject::RigidBody(handle, stand_in)
            if handle == RigidBodyHandle::invalid() && stand_in.user_data != self.hidden)
    }

    fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, color: DebugColor) {
        assert!(a.is_finite() && b.is_finite());
        self.drawn.push((a, b, color));
    }
}

fn drawn(world: &DeformableWorld) -> Vec<(Vector, Vector, DebugColor)> {
    let mut lines = Lines { hidden: u128::MAX, ..Lines::default() };
    DeformableDebugRenderPipeline::default().render(&mut lines, world);
    lines.drawn
}

#[test]
fn edges_forces_pins_and_attachments_are_drawn_in_their_colours() {
    let style = DeformableDebugRenderStyle::default();
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let cube = |x: f32| {
        DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).translation(Vector::new(x, 0.1, 0.0))
    };
    let damped = DeformableMaterial::new(1e5, 0.3).mass_damping(3.0);
    let body = world.insert(cube(0.0).material(damped).user_data(7)).unwrap();
    let held = world.insert(cube(1.0).pinned(|p| p.y > 0.19)).unwrap();
    let (carrier, _) =
        physics.insert(RigidBodyBuilder::fixed().translation(Vector::X * 1.5), ColliderBuilder::ball(0.1));
    let to = AttachTo::RigidBody(carrier, *physics.bodies[carrier].position());
    world.bodies.attach(held, &[0, 1], to).unwrap();
    for _ in 0..10 {
        world.step(&mut physics);
    }
    let lines = drawn(&world);
    let of = |color: DebugColor| lines.iter().filter(|(_, _, c)| *c == color).collect::<Vec<_>>();
    // Twelve edges and six diagonals each; a cross of three lines a pin; a line for each attached vertex.
    assert_eq!(of(style.edge_color).len(), 36);
    assert_eq!(of(style.pin_color).len(), 12);
    assert_eq!(of(style.attachment_color).len(), 2);
    assert_eq!(of(style.cable_color).len(), 0);
    let arrows = of(style.force_color);
    let carrying = world.contacts_with(floor).filter(|c| c.body == body && c.force != Vector::ZERO).count();
    assert!(carrying > 0 && arrows.len() >= 3 * carrying && arrows.len() % 3 == 0);
    let sum: Vector = arrows.iter().step_by(3).map(|(a, b, _)| (*b - *a) / style.force_scale).sum();
    let total: Vector = world.contacts().iter().map(|c| c.force).sum();
    assert!((sum - total).length() < 1e-3 * total.length());
    // What a backend hides is not drawn.
    let mut lines = Lines { hidden: 7, ..Lines::default() };
    DeformableDebugRenderPipeline::default().render(&mut lines, &world);
    assert_eq!(lines.drawn.iter().filter(|(_, _, c)| *c == style.edge_color).count(), 18);
    // Asleep, put aside, disabled.
    world.bodies[body].sleep();
    world.bodies[held].set_enabled(false);
    world.step(&mut physics);
    let colours: Vec<_> = drawn(&world).into_iter().map(|(_, _, color)| color).collect();
    let dimmed = |by: DebugColor| [0, 1, 2, 3].map(|k| style.edge_color[k] * by[k]);
    assert!(colours.contains(&dimmed(style.rapier.sleep_color_multiplier)));
    assert!(colours.contains(&dimmed(style.rapier.disabled_color_multiplier)));
    assert!(!colours.contains(&style.edge_color));
}
