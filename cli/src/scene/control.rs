//! What holds bodies and what moves them.

use super::{Region, Vec3};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// Surface vertices of a deformable in a box of the world, held by a rigid body where they are at the start.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Attach {
    /// A soft body.
    #[schemars(with = "String")]
    pub deformable: Spanned<String>,
    /// A rigid body.
    #[schemars(with = "String")]
    pub to: Spanned<String>,
    /// Surface vertices in this box of the world are held where they are.
    pub region: Region,
    /// What each vertex gives way by per force \[m/N\]; none if not given.
    #[schemars(with = "Option<f64>")]
    pub compliance: Option<Spanned<f64>>,
    /// Cables of this length \[m\] instead: vertices may go so far from where they are, and are pushed nowhere.
    #[schemars(with = "Option<f64>")]
    pub length: Option<Spanned<f64>>,
    /// Force \[N\] on all of its vertices together at which it breaks.
    #[schemars(with = "Option<f64>")]
    pub break_force: Option<Spanned<f64>>,
}

/// How a kinematic body moves beside its velocities: smoothly by a vector, or to and fro by it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// A kinematic body.
    #[schemars(with = "String")]
    pub of: Spanned<String>,
    /// Begin and end \[s\].
    #[schemars(with = "[f32; 2]")]
    pub during: Spanned<[f32; 2]>,
    /// How far it goes \[m\].
    pub by: Vec3,
    /// Periods to and fro; comes back to where it was then.
    pub swings: Option<u32>,
}

impl Move {
    /// Share of `by` at a time \[s\].
    pub fn share(&self, time: f32) -> f32 {
        let [begin, end] = *self.during.as_ref();
        let smooth = |t: f32| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
        let along = ((time - begin) / (end - begin)).clamp(0.0, 1.0);
        match self.swings {
            None => smooth(along),
            // The first and the last period swell and fade.
            Some(swings) => {
                let turns = along * swings as f32;
                let swell = smooth(turns.min(swings as f32 - turns));
                swell * (std::f32::consts::TAU * turns).sin()
            }
        }
    }
}
