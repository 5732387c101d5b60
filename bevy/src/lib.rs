//! [foible3d](https://docs.rs/foible3d)'s deformable bodies for bevy, beside
//! [bevy_rapier3d](https://docs.rs/bevy_rapier3d): they share its rigid bodies, colliders, gravity and time steps.
//!
//! ```
//! use bevy::prelude::*;
//! use bevy_foible3d::prelude::*;
//! use bevy_rapier3d::prelude::*;
//!
//! fn scene(mut commands: Commands) {
//!     commands.spawn((Collider::cuboid(10.0, 0.1, 10.0), Transform::from_xyz(0.0, -0.1, 0.0)));
//!     let cube = DeformableBodyBuilder::cuboid(Vec3::splat(0.5), [4, 4, 4]);
//!     let jelly = DeformableMaterial::new(2.0e4, 0.45).density(1000.0).mass_damping(1.0);
//!     commands.spawn((
//!         Deformable::new(cube.material(jelly)),
//!         DeformableMeshSync, // or a `Mesh3d` of one's own: it becomes the body's skin
//!         Transform::from_xyz(0.0, 2.0, 0.0),
//!     ));
//! }
//!
//! # let mut app = App::new();
//! # app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default())).init_asset::<Mesh>();
//! app // with bevy's own `DefaultPlugins`
//!     .add_plugins((
//!         RapierPhysicsPlugin::<NoUserData>::default(),
//!         DeformablePhysicsPlugin::<NoUserData>::default(),
//!     ))
//!     .add_systems(Startup, scene);
//! # app.finish();
//! # for _ in 0..3 {
//! #     app.update();
//! # }
//! # assert_eq!(app.world_mut().query::<(&DeformableHandle, &Mesh3d)>().iter(app.world()).count(), 1);
//! ```
//!
//! What a body can do beyond its components is foible3d's own interface, through
//! [`RapierContextDeformables::get_mut`]: forces, pins, kinds of bodies, wind, muscles.
//!
//! | module | what it holds |
//! |---|---|
//! | `context` | the deformable bodies of a rapier context |
//! | `components` | what a user puts on entities |
//! | `plugin` | the plugin and its order of systems |
//! | `insert` | from components to bodies, and their removal |
//! | `changes` | components that have changed since |
//! | `step` | all timestep modes, around rapier's own step |
//! | `messages` | foible3d's events by entity |
//! | `writeback` | transforms and velocities |
//! | `skins` | meshes that follow bodies |
//! | `gizmos` | bodies, contacts and attachments as lines |

mod changes;
mod components;
mod context;
#[cfg(feature = "gizmos")]
mod gizmos;
mod insert;
mod messages;
mod plugin;
mod skins;
mod step;
mod writeback;

pub use components::{
    Deformable, DeformableAnchor, DeformableAttachments, DeformableBodyMaterial, DeformableError,
    DeformableHandle, DeformableMeshSync, DeformableSkinOf,
};
pub use context::RapierContextDeformables;
#[cfg(feature = "gizmos")]
pub use gizmos::{DeformableDebugRenderPlugin, DeformableDebugRenderSettings};
pub use messages::{DeformableCollision, DeformableContactForce, DeformableQuarantined};
pub use plugin::{DeformablePhysicsPlugin, DeformableSet};

pub use foible3d;

/// Components, messages and plugins; of foible3d what bodies are made with. Safe beside `bevy::prelude::*` and
/// `bevy_rapier3d::prelude::*`.
pub mod prelude {
    pub use crate::*;
    pub use foible3d::{
        DeformableBodyBuilder, DeformableMaterial, Elasticity, Fidelity, Integrator, SolverSettings,
        Structure, TetMesh,
    };
}
