//! Cables and signals: what pulls, and what drives.

use super::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Spanned;

/// A cable through points, tied to the first and drawn at the last.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cable {
    /// Unique among all names of the scene.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// Its points, two at least.
    pub points: Vec<RoutePoint>,
    /// Coefficient of friction at the points in between.
    #[serde(default)]
    pub friction: f64,
    /// Stretch per tension \[m/N\].
    #[serde(default)]
    pub compliance: f64,
    /// Length that a winch is to give it \[m\]; as long as it is if neither this nor `tension` is given.
    pub length: Option<f64>,
    /// Tension that it is drawn with \[N\].
    pub tension: Option<f64>,
    /// How fast a winch takes in and lets out, at the most \[m/s\].
    pub speed: Option<f64>,
    /// How hard a winch holds, at the most \[N\].
    pub max_tension: Option<f64>,
}

/// A point of a cable.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoutePoint {
    /// Where it is in the world at the start \[m\].
    pub at: Vec3,
    /// The rigid body or deformable that carries it; the world if not given. On a sheet or rope it is the nearest vertex.
    #[schemars(with = "Option<String>")]
    pub of: Option<Spanned<String>>,
}

/// What a signal drives.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Drives {
    /// Tension of a cable \[N\].
    Tension,
    /// Length of a cable \[m\].
    Length,
    /// Pressure in a cavity of a deformable, above that around it \[Pa\].
    Pressure,
    /// How far the last end of a rope is rolled against its first \[rad\].
    Twist,
    /// Stretch that the muscle fibres of a deformable want to have.
    Activation,
    /// Position of the motor of a joint \[m\] or \[rad\].
    Position,
    /// Velocity of the motor of a joint \[m/s\] or \[rad/s\].
    Velocity,
}

/// A signal with a range and a rate, and what it is told when.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorEntry {
    /// Unique among all names of the scene.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// What it drives.
    pub drives: Drives,
    /// The cable or deformable; not of motors.
    #[schemars(with = "Option<String>")]
    pub of: Option<Spanned<String>>,
    /// The two bodies of the joint whose motor it drives.
    #[schemars(with = "Option<[String; 2]>")]
    pub between: Option<[Spanned<String>; 2]>,
    /// Which cavity, the largest first.
    #[serde(default)]
    pub cavity: usize,
    /// Stiffness of a motor that is led to a position.
    #[serde(default)]
    pub stiffness: f32,
    /// Damping of a motor.
    #[serde(default)]
    pub damping: f32,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Largest change per second; at once if not given.
    pub rate: Option<f64>,
    /// Value at the start; what is nearest to zero in the range if not given.
    pub start: Option<f64>,
    /// What it is told, in the order of time.
    #[serde(default)]
    pub then: Vec<Command>,
}

/// What a signal is told.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Command {
    /// Time \[s\].
    pub at: f64,
    /// The value that it goes to.
    pub value: f64,
}

impl Drives {
    /// Whether it is the motor of a joint.
    pub fn is_motor(self) -> bool {
        matches!(self, Self::Position | Self::Velocity)
    }

    /// Whether it is a cable's.
    pub fn is_of_cables(self) -> bool {
        matches!(self, Self::Tension | Self::Length)
    }
}
