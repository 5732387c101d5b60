//! Bodies, contacts and attachments as lines.

use crate::context::RapierContextDeformables;
use crate::plugin::DeformableSet;
use bevy::prelude::*;
use bevy_rapier3d::rapier::math::Vector;
use bevy_rapier3d::rapier::pipeline::{DebugColor, DebugRenderBackend, DebugRenderObject};
use foible3d::{DeformableDebugRenderPipeline, DeformableDebugRenderStyle};

/// Draws deformable bodies as gizmos, beside bevy_rapier's `RapierDebugRenderPlugin`: edges of surfaces, pins, arrows of contact
/// forces, attachments.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeformableDebugRenderPlugin;

/// Whether and how they are drawn.
#[derive(Resource, Clone, Copy, Debug)]
pub struct DeformableDebugRenderSettings {
    /// Whether.
    pub enabled: bool,
    /// Colours and lengths.
    pub style: DeformableDebugRenderStyle,
}

impl Default for DeformableDebugRenderSettings {
    fn default() -> Self {
        Self { enabled: true, style: DeformableDebugRenderStyle::default() }
    }
}

impl Plugin for DeformableDebugRenderPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<DeformableDebugRenderSettings>();
        app.add_systems(PostUpdate, draw.after(DeformableSet::Writeback));
    }
}

struct Lines<'a, 'w, 's>(&'a mut Gizmos<'w, 's>);

impl DebugRenderBackend for Lines<'_, '_, '_> {
    fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, [h, s, l, alpha]: DebugColor) {
        self.0.line(a, b, Color::hsla(h, s, l, alpha));
    }
}

fn draw(
    settings: Res<DeformableDebugRenderSettings>,
    contexts: Query<&RapierContextDeformables>,
    mut gizmos: Gizmos,
) {
    if settings.enabled {
        let mut pipeline = DeformableDebugRenderPipeline::new(settings.style);
        contexts.iter().for_each(|context| pipeline.render(&mut Lines(&mut gizmos), &context.world));
    }
}
