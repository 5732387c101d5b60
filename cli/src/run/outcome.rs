//! What a run comes to: numbers and verdicts, the same bits for the same scene.

use super::number::number;
use crate::scene::{Expect, Quantity};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What a run has come to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Name of the scene.
    pub scene: String,
    /// Name of the case of a sweep; empty without one.
    pub case: String,
    /// What was set.
    pub set: Vec<(String, String)>,
    /// Of the scene's text, the files that it reads and this version: runs with the same key have the same numbers.
    pub key: String,
    /// Why there is no more: the scene could not be built, or a step failed.
    pub error: Option<String>,
    /// Steps that were made.
    pub steps: u64,
    /// Their length \[s\].
    pub dt: f64,
    /// What was expected.
    pub verdicts: Vec<Verdict>,
    /// What was measured.
    pub measures: Vec<Measured>,
    /// Where every body is in the end, for a baseline.
    pub finals: Vec<Measured>,
}

/// A number with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// What it is called.
    pub name: String,
    /// In SI units, accelerations in g; NaN is `null`.
    #[serde(serialize_with = "write_number", deserialize_with = "read_number")]
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Where it was found, if it is the largest of many \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
}

/// An expectation and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The number.
    #[serde(flatten)]
    pub measured: Measured,
    /// What it was to be.
    pub wanted: String,
    /// Whether it was.
    pub met: bool,
}

fn write_number<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    // JSON has no NaN.
    value.is_finite().then_some(*value).serialize(to)
}

fn read_number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::NAN))
}

impl Outcome {
    /// Expectations that were not met, and one for a run that broke off.
    pub fn failures(&self) -> usize {
        usize::from(self.error.is_some()) + self.verdicts.iter().filter(|v| !v.met).count()
    }

    /// Its name: that of the scene, and of the case.
    pub fn title(&self) -> String {
        if self.case.is_empty() { self.scene.clone() } else { format!("{} [{}]", self.scene, self.case) }
    }

    /// Every number that has a name, expected ones first.
    pub fn numbers(&self) -> impl Iterator<Item = &Measured> {
        self.verdicts.iter().map(|v| &v.measured).chain(&self.measures)
    }
}

impl Verdict {
    /// Of an expectation, its number and where that was found. NaN meets none.
    pub fn of(e: &Expect, value: f64, place: Option<[f64; 3]>) -> Self {
        let near = |wanted: f64| (value - wanted).abs() <= e.within.unwrap_or(0.0);
        let met = match e.curve {
            Some(_) => value <= e.within.unwrap_or(0.0),
            None => {
                e.equals.is_none_or(near)
                    && e.at_most.is_none_or(|limit| value <= limit)
                    && e.at_least.is_none_or(|limit| value >= limit)
            }
        };
        let wanted =
            [("equals", e.equals), ("at most", e.at_most), ("at least", e.at_least), ("within", e.within)];
        let mut wanted: Vec<String> =
            wanted.iter().filter_map(|(name, v)| v.map(|v| format!("{name} {}", number(v, "")))).collect();
        if let Some(holds) = e.holds {
            wanted.insert(0, format!("{holds:?}").to_lowercase());
        }
        if let Some(curve) = &e.curve {
            wanted.insert(0, format!("the curve {} of {}", curve.as_ref().column, curve.as_ref().path));
        }
        Self { measured: Measured::of(e, value, place), wanted: wanted.join(", "), met }
    }
}

impl Measured {
    /// The number with its unit and place.
    pub fn text(&self) -> String {
        let value = number(self.value, &self.unit);
        self.place_text().map_or(value.clone(), |place| format!("{value} {place}"))
    }

    /// Its place, to a tenth of a millimetre: "at (0.1, 0, 0.2) m".
    pub fn place_text(&self) -> Option<String> {
        let [x, y, z] = self.place?.map(|x| number((x * 1e4).round() * 1e-4, ""));
        Some(format!("at ({x}, {y}, {z}) m"))
    }

    /// Of a measure, its number and where that was found.
    pub fn of(e: &Expect, value: f64, place: Option<[f64; 3]>) -> Self {
        use crate::scene::Take;
        let unit = match e.take {
            Some(Take::PulseTime | Take::SettleTime) => "s".into(),
            Some(Take::Integral) => match *e.quantity.as_ref() {
                Quantity::Force | Quantity::ForceSize => "N s".into(),
                Quantity::SlipSpeed | Quantity::Speed | Quantity::VelocityY => "m".into(),
                other => format!("{} s", other.unit()),
            },
            Some(Take::Rate) => format!("{}/s", e.quantity.as_ref().unit()),
            _ => e.quantity.as_ref().unit().to_string(),
        };
        Self { name: e.title(), value, unit, place }
    }
}

/// What steps took; other times give other numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Costs {
    /// Of all steps together, by the counters of the deformable world \[ms\].
    pub total: f64,
    /// Per step \[ms\].
    pub mean: f64,
    /// Per step \[ms\].
    pub median: f64,
    /// The 99th percentile \[ms\].
    pub p99: f64,
    /// The worst step \[ms\].
    pub worst: f64,
}

impl Costs {
    /// Of milliseconds per step.
    pub fn of(mut steps: Vec<f64>) -> Self {
        steps.sort_by(f64::total_cmp);
        let total = steps.iter().fold(0.0, |sum, ms| sum + ms);
        let at =
            |part: f64| steps.get(((steps.len() as f64 * part) as usize).min(steps.len().saturating_sub(1)));
        let at = |part: f64| at(part).copied().unwrap_or(0.0);
        Self {
            total,
            mean: total / steps.len().max(1) as f64,
            median: at(0.5),
            p99: at(0.99),
            worst: at(1.0),
        }
    }
}
