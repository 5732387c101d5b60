//! Rigid bodies and the joints between them.

use super::Vec3;
use rapier3d::prelude::JointAxis;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    pub kind: Kind,
    #[schemars(with = "Shape")]
    pub shape: Spanned<Shape>,
    #[schemars(with = "Option<f32>")]
    pub mass: Option<Spanned<f32>>,
    #[schemars(with = "Option<f32>")]
    pub density: Option<Spanned<f32>>,
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle [degrees].
    #[serde(default)]
    pub rotation: Vec3,
    #[serde(default)]
    pub linvel: Vec3,
    #[serde(default)]
    pub angvel: Vec3,
    #[serde(default = "friction")]
    pub friction: f32,
    #[serde(default)]
    pub restitution: f32,
    #[serde(default)]
    pub can_sleep: bool,
    /// Whether other rigid bodies and deformables touch it.
    #[serde(default = "yes")]
    pub collides: bool,
}

fn yes() -> bool {
    true
}

fn friction() -> f32 {
    0.5
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Fixed,
    Dynamic,
    Kinematic,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    Ball {
        radius: f32,
    },
    Cuboid {
        half_extents: Vec3,
    },
    Capsule {
        half_height: f32,
        radius: f32,
    },
    Cylinder {
        half_height: f32,
        radius: f32,
    },
    Cone {
        half_height: f32,
        radius: f32,
    },
    HalfSpace {
        normal: Vec3,
    },
    /// Triangles of an OBJ, STL, PLY or glTF file, relative to the scene file.
    Mesh {
        path: String,
        /// Metres per unit of the file.
        #[serde(default = "one")]
        scale: f32,
        /// Whether z is up in the file.
        #[serde(default)]
        z_up: bool,
    },
    /// Heights on a grid over x and z, rows along x.
    Heightfield {
        heights: Vec<Vec<f32>>,
        size: [f32; 2],
    },
}

pub(super) fn one() -> f32 {
    1.0
}

/// Two rigid bodies held together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    #[schemars(with = "[String; 2]")]
    pub between: [Spanned<String>; 2],
    pub kind: JointKind,
    /// Where in the world it is at the start.
    pub anchor: Vec3,
    /// Whether the second body becomes a link of a multibody.
    #[serde(default)]
    pub multibody: bool,
    pub motor: Option<Motor>,
}

/// The axis is that of both bodies' frames.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum JointKind {
    Fixed {},
    Revolute { axis: Vec3 },
    Prismatic { axis: Vec3 },
}

impl JointKind {
    pub fn free_axis(&self) -> Option<JointAxis> {
        match self {
            Self::Fixed {} => None,
            Self::Revolute { .. } => Some(JointAxis::AngX),
            Self::Prismatic { .. } => Some(JointAxis::LinX),
        }
    }
}

/// Drives the free axis of a joint with no more than `max_force` [N, N m].
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    pub velocity: f32,
    pub damping: f32,
    pub max_force: f32,
    /// Other velocities from later times on.
    #[serde(default)]
    pub then: Vec<Switch>,
}

/// A motor's velocity from a time on.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    #[schemars(with = "f32")]
    pub at: Spanned<f32>,
    pub velocity: f32,
}
