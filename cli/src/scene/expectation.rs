//! What is watched, and what it must come to.

use super::{Vec3, When};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Spanned;

/// The vertex of a body that is nearest to a point at the start.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Unique among all names of the scene.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// A deformable.
    #[schemars(with = "String")]
    pub of: Spanned<String>,
    /// A point of the world \[m\], before a `[drop]` turns the body.
    pub near: Vec3,
}

/// A number of the scene, and, if it is expected, what it must come to.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// What it is called in reports; made of the other keys if not given.
    #[schemars(with = "Option<String>")]
    pub name: Option<Spanned<String>>,
    /// What is measured in every step.
    #[schemars(with = "Quantity")]
    pub quantity: Spanned<Quantity>,
    /// Body or probe; for energies also "all".
    #[schemars(with = "String")]
    pub of: Spanned<String>,
    /// The body that touches it, for forces.
    #[schemars(with = "Option<String>")]
    pub on: Option<Spanned<String>>,
    /// Another body or probe, whose same quantity is taken off.
    #[schemars(with = "Option<String>")]
    pub minus: Option<Spanned<String>>,
    /// Channel frequency class of a filter by SAE J211 and ISO 6487: 60, 180, 600 or 1000.
    #[schemars(with = "Option<u32>")]
    pub cfc: Option<Spanned<u32>>,
    /// What is taken of the values over time; the last if not given.
    pub take: Option<Take>,
    /// Time \[s\] of the value that is taken; the end if not given.
    #[schemars(with = "Option<f32>")]
    pub at: Option<Spanned<f32>>,
    /// From when to when \[s\]; from the start to the end if not given.
    #[schemars(with = "Option<[f32; 2]>")]
    pub during: Option<Spanned<[f32; 2]>>,
    /// Only the steps before the first one, `during` the time, in which this holds; if it never does there is no number, and
    /// nothing is met.
    #[schemars(with = "Option<When>")]
    pub until: Option<Spanned<When>>,
    /// Instead of one value, all or any of those during the time.
    pub holds: Option<Holds>,
    /// A recorded curve that it must stay `within`.
    #[schemars(with = "Option<Curve>")]
    pub curve: Option<Spanned<Curve>>,
    /// With `within`.
    pub equals: Option<f64>,
    /// Upper bound.
    pub at_most: Option<f64>,
    /// Lower bound.
    pub at_least: Option<f64>,
    /// Tolerance of `equals`, and of a curve.
    pub within: Option<f64>,
}

/// A curve in a CSV file: `time` \[s\] and a column; between rows by straight lines.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Relative to the scene file; a `trace.csv` of another run serves.
    pub path: String,
    /// Its name in the first row.
    pub column: String,
}

/// What is measured.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Position of the centre of mass, or of a probe \[m\].
    X,
    /// See `x`.
    Y,
    /// See `x`.
    Z,
    /// Speed of the fastest vertex, or of a rigid body or probe \[m/s\].
    Speed,
    /// Velocity upward of the centre of mass, or of a probe \[m/s\].
    VelocityY,
    /// Size of the acceleration that an accelerometer there would show, the centre of mass or a probe, in 9.80665 m/s²: nothing
    /// in free fall, 1 at rest.
    AccelerationG,
    /// Volume over volume at rest.
    VolumeRatio,
    /// Vertical contact force between the body and `on` \[N\].
    Force,
    /// Size of that force \[N\].
    ForceSize,
    /// Speed at which the contacts between the body and `on` slide, the mean by their forces \[m/s\]; its integral is how far it slid.
    SlipSpeed,
    /// Deepest penetration of the body's contacts \[m\].
    Penetration,
    /// Angle between the body's upright axis and where it was at the start \[degrees\].
    Tilt,
    /// Horizontal distance from where it was at the start \[m\].
    Drift,
    /// Kinetic energy of a deformable or a rigid body, or of all \[J\].
    KineticEnergy,
    /// Elastic energy of a deformable, or of all \[J\].
    ElasticEnergy,
    /// Energy in gravity, against height 0 \[J\].
    GravityEnergy,
    /// All three together \[J\].
    Energy,
    /// Energy that steps have taken so far, not forces \[J\]: of rigid bodies, and of soft ones with implicit Euler. What an
    /// impact takes is a part of it.
    StepLoss,
    /// `energy` and `step_loss` together \[J\]: only friction, damping and what moves bodies from outside change it.
    EnergyBalance,
    /// Largest von Mises stress in a solid deformable \[Pa\].
    Stress,
    /// Largest principal strain, by size, in a solid deformable.
    Strain,
    /// Largest distance of a deformable's vertex from where the shape at rest has it, that placed to fit \[m\]: without a load, the
    /// set that creep has left.
    Deformation,
    /// Largest pressure in a cavity of a deformable, above that around it \[Pa\].
    CavityPressure,
    /// Volume of all cavities of a deformable \[m³\].
    CavityVolume,
    /// Tension of a cable where it is drawn \[N\].
    CableTension,
    /// Length of a cable's way through its points \[m\].
    CableLength,
    /// Value of a signal, in the unit of what it drives.
    Signal,
}

/// What is taken of the values over time.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Take {
    /// The last value, or that `at` a time.
    #[default]
    Last,
    /// The largest.
    Max,
    /// The least.
    Min,
    /// The largest by size.
    Peak,
    /// The largest less the least.
    Range,
    /// The last less the first, over the time between them.
    Rate,
    /// The mean over time.
    Mean,
    /// The integral over time: impulse of a force, velocity change of an acceleration.
    Integral,
    /// The time \[s\] for which it stays above a tenth of its peak around the peak: the length of a pulse.
    PulseTime,
    /// The time \[s\] after which it stays `within` its last value.
    SettleTime,
    /// The largest value after the least one, less that: the height of a rebound of `y`.
    Rebound,
}

/// When the bounds hold.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Holds {
    /// At every step; the worst value is told.
    Always,
    /// At one step at least; the best value is told.
    Ever,
}

impl Quantity {
    /// As it is written.
    pub fn name(self) -> String {
        serde_json::to_value(self).ok().and_then(|v| v.as_str().map(String::from)).unwrap_or_default()
    }

    /// Whether the whole scene has it too.
    pub fn is_energy(self) -> bool {
        matches!(
            self,
            Self::KineticEnergy
                | Self::ElasticEnergy
                | Self::GravityEnergy
                | Self::Energy
                | Self::StepLoss
                | Self::EnergyBalance
        )
    }

    /// Whether it is the largest of many, which has a place.
    pub fn has_place(self) -> bool {
        matches!(self, Self::Stress | Self::Strain)
    }

    /// Whether it is summed over steps.
    pub fn is_of_steps(self) -> bool {
        matches!(self, Self::StepLoss | Self::EnergyBalance)
    }

    /// Whether it is of the contacts between two bodies.
    pub fn is_force(self) -> bool {
        matches!(self, Self::Force | Self::ForceSize | Self::SlipSpeed)
    }

    /// Whether only deformables have it.
    pub fn is_soft(self) -> bool {
        matches!(
            self,
            Self::VolumeRatio
                | Self::Penetration
                | Self::Stress
                | Self::Strain
                | Self::Deformation
                | Self::CavityPressure
                | Self::CavityVolume
        )
    }

    /// Whether cables have it, or signals, and no body.
    pub fn is_of_actuation(self) -> bool {
        matches!(self, Self::CableTension | Self::CableLength | Self::Signal)
    }

    /// Whether probes have it.
    pub fn is_of_points(self) -> bool {
        matches!(
            self,
            Self::X | Self::Y | Self::Z | Self::Speed | Self::VelocityY | Self::AccelerationG | Self::Drift
        )
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::X
            | Self::Y
            | Self::Z
            | Self::Penetration
            | Self::Drift
            | Self::Deformation
            | Self::CableLength => "m",
            Self::Speed | Self::VelocityY | Self::SlipSpeed => "m/s",
            Self::AccelerationG => "g",
            Self::Force | Self::ForceSize | Self::CableTension => "N",
            Self::Tilt => "°",
            Self::KineticEnergy
            | Self::ElasticEnergy
            | Self::GravityEnergy
            | Self::Energy
            | Self::StepLoss
            | Self::EnergyBalance => "J",
            Self::Stress | Self::CavityPressure => "Pa",
            Self::CavityVolume => "m³",
            Self::VolumeRatio | Self::Strain | Self::Signal => "",
        }
    }
}

impl Expect {
    /// What it is called in reports.
    pub fn title(&self) -> String {
        if let Some(name) = &self.name {
            return name.as_ref().clone();
        }
        let part = |word: &str, other: &Option<Spanned<String>>| {
            other.as_ref().map_or(String::new(), |other| format!(" {word} {}", other.as_ref()))
        };
        let take = match self.take {
            None | Some(Take::Last) => String::new(),
            Some(take) => format!(
                "{} of ",
                serde_json::to_value(take)
                    .ok()
                    .and_then(|v| v.as_str().map(|s| s.replace('_', " ")))
                    .unwrap_or_default()
            ),
        };
        let at = self.at.as_ref().map_or(String::new(), |at| format!(" at {} s", at.as_ref()));
        let during = self
            .during
            .as_ref()
            .map_or(String::new(), |d| format!(" from {} to {} s", d.as_ref()[0], d.as_ref()[1]));
        let until =
            self.until.as_ref().map_or(String::new(), |until| format!(" until {}", until.as_ref().text()));
        let cfc = self.cfc.as_ref().map_or(String::new(), |cfc| format!(", CFC {}", cfc.as_ref()));
        format!(
            "{take}{} of {}{}{}{at}{during}{until}{cfc}",
            self.quantity.as_ref().name(),
            self.of.as_ref(),
            part("on", &self.on),
            part("minus", &self.minus)
        )
    }
}
