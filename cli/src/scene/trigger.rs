//! When this, then that.

use super::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// Something that happens once, after the first step in which its conditions hold.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// Not before this time \[s\].
    #[schemars(with = "Option<f32>")]
    pub after: Option<Spanned<f32>>,
    /// What must be.
    #[schemars(with = "Option<When>")]
    pub when: Option<Spanned<When>>,
    /// Deformables whose attachments and pins let go.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub release: Vec<Spanned<String>>,
    /// Pairs of rigid bodies whose joint is cut.
    #[serde(default)]
    #[schemars(with = "Vec<[String; 2]>")]
    pub cut: Vec<[Spanned<String>; 2]>,
    /// Motors that get another velocity.
    #[serde(default)]
    pub switch: Vec<MotorSwitch>,
}

/// A quantity that has come to a bound.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct When {
    /// What is measured.
    #[schemars(with = "Quantity")]
    pub quantity: Spanned<Quantity>,
    /// Body or probe.
    #[schemars(with = "String")]
    pub of: Spanned<String>,
    /// The body that touches it, for forces.
    #[schemars(with = "Option<String>")]
    pub on: Option<Spanned<String>>,
    /// Upper bound.
    pub at_most: Option<f64>,
    /// Lower bound.
    pub at_least: Option<f64>,
}

impl When {
    /// As a sentence says it: "force of cube on floor is at least 10".
    pub fn text(&self) -> String {
        let on = self.on.as_ref().map_or(String::new(), |on| format!(" on {}", on.as_ref()));
        let bound = |word: &str, limit: Option<f64>| limit.map(|limit| format!("at {word} {limit}"));
        let bounds: Vec<String> =
            [bound("least", self.at_least), bound("most", self.at_most)].into_iter().flatten().collect();
        format!("{} of {}{on} is {}", self.quantity.as_ref().name(), self.of.as_ref(), bounds.join(" and "))
    }

    /// Whether a value is within the bounds; NaN is not.
    pub fn holds(&self, value: f64) -> bool {
        !value.is_nan()
            && self.at_most.is_none_or(|most| value <= most)
            && self.at_least.is_none_or(|least| value >= least)
    }
}

/// The motor of the joint between two rigid bodies.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorSwitch {
    /// Names of the two.
    #[schemars(with = "[String; 2]")]
    pub between: [Spanned<String>; 2],
    /// Aim \[rad/s, m/s\].
    pub velocity: f32,
}
