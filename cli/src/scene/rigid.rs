//! Rigid bodies and the joints between them.

use super::Vec3;
use rapier3d::prelude::JointAxis;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A rigid body with one collider.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// Unique among all names of the scene.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// What moves it.
    pub kind: Kind,
    /// Of its collider.
    #[schemars(with = "Shape")]
    pub shape: Spanned<Shape>,
    /// \[kg\]; or give the density.
    #[schemars(with = "Option<f32>")]
    pub mass: Option<Spanned<f32>>,
    /// \[kg/m³\]; 1 if neither is given.
    #[schemars(with = "Option<f32>")]
    pub density: Option<Spanned<f32>>,
    /// Where it is \[m\].
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle \[degrees\].
    #[serde(default)]
    pub rotation: Vec3,
    /// Velocity \[m/s\].
    #[serde(default)]
    pub linvel: Vec3,
    /// Angular velocity \[rad/s\].
    #[serde(default)]
    pub angvel: Vec3,
    /// Coefficient of friction (0.5).
    #[serde(default = "friction")]
    pub friction: f32,
    /// Coefficient of restitution.
    #[serde(default)]
    pub restitution: f32,
    /// Whether it may fall asleep.
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

/// What moves a rigid body.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Nothing.
    Fixed,
    /// Forces.
    Dynamic,
    /// Its velocities, and `[[move]]`.
    Kinematic,
}

/// The shape of a collider.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A ball.
    Ball {
        /// \[m\]
        radius: f32,
    },
    /// A box.
    Cuboid {
        /// Half its sides \[m\].
        half_extents: Vec3,
    },
    /// A capsule along y.
    Capsule {
        /// Of its straight part \[m\].
        half_height: f32,
        /// \[m\]
        radius: f32,
    },
    /// A cylinder along y.
    Cylinder {
        /// \[m\]
        half_height: f32,
        /// \[m\]
        radius: f32,
    },
    /// A cone along y.
    Cone {
        /// \[m\]
        half_height: f32,
        /// \[m\]
        radius: f32,
    },
    /// Everything below a plane through where it is.
    HalfSpace {
        /// Upward.
        normal: Vec3,
    },
    /// Triangles of an OBJ, STL, PLY or glTF file, relative to the scene file.
    Mesh {
        /// Relative to the scene file.
        path: String,
        /// Metres per unit of the file.
        #[serde(default = "one")]
        scale: f32,
        /// Whether z is up in the file.
        #[serde(default)]
        z_up: bool,
    },
    /// Several of the simple shapes at once.
    Compound {
        /// Of one body.
        parts: Vec<Part>,
    },
    /// Heights on a grid over x and z, rows along x.
    Heightfield {
        /// Rows along x, one after another along z \[m\].
        heights: Vec<Vec<f32>>,
        /// Along x and z \[m\].
        size: [f32; 2],
    },
}

/// A part of a compound shape.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// A ball, box, capsule, cylinder or cone.
    pub shape: Shape,
    /// Where it is in the body \[m\].
    #[serde(default)]
    pub translation: Vec3,
    /// Axis times angle \[degrees\].
    #[serde(default)]
    pub rotation: Vec3,
}

pub(super) fn one() -> f32 {
    1.0
}

/// Two rigid bodies held together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Names of the two.
    #[schemars(with = "[String; 2]")]
    pub between: [Spanned<String>; 2],
    /// What it leaves free.
    pub kind: JointKind,
    /// Where in the world it is at the start.
    pub anchor: Vec3,
    /// Whether the second body becomes a link of a multibody.
    #[serde(default)]
    pub multibody: bool,
    /// Drives what is free.
    pub motor: Option<Motor>,
}

impl Joint {
    /// Whether it is between these two, in either order.
    pub fn is_between(&self, one: &str, other: &str) -> bool {
        let [first, second] = self.between.each_ref().map(|name| name.as_ref().as_str());
        (first, second) == (one, other) || (first, second) == (other, one)
    }
}

/// The axis is that of both bodies' frames.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum JointKind {
    /// Nothing is free.
    Fixed {},
    /// Turning about an axis.
    Revolute {
        /// Direction.
        axis: Vec3,
    },
    /// Sliding along an axis.
    Prismatic {
        /// Direction.
        axis: Vec3,
    },
}

impl JointKind {
    /// The axis that a motor drives.
    pub fn free_axis(&self) -> Option<JointAxis> {
        match self {
            Self::Fixed {} => None,
            Self::Revolute { .. } => Some(JointAxis::AngX),
            Self::Prismatic { .. } => Some(JointAxis::LinX),
        }
    }
}

/// Drives the free axis of a joint with no more than `max_force` \[N, N m\].
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Aim \[rad/s, m/s\].
    pub velocity: f32,
    /// Force per difference of speed \[N s/m, N m s\].
    pub damping: f32,
    /// The most \[N, N m\].
    pub max_force: f32,
    /// Other velocities from later times on.
    #[serde(default)]
    pub then: Vec<Switch>,
}

/// A motor's velocity from a time on.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// From when on \[s\].
    #[schemars(with = "f32")]
    pub at: Spanned<f32>,
    /// Aim \[rad/s, m/s\].
    pub velocity: f32,
}
