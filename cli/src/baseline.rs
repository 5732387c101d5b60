//! What a scene came to when someone looked at it and found it right; later runs are compared with it.

use crate::run::{Measured, Outcome};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Numbers of the cases of a scene, each with its tolerance: a file that people read and edit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// By the name of the case; "" without a sweep.
    pub case: BTreeMap<String, BTreeMap<String, Blessed>>,
}

/// A number of a baseline.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Blessed {
    /// What it was.
    pub value: f64,
    /// How far it may be off.
    pub within: f64,
}

/// A number that is not what it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Of the number.
    pub name: String,
    /// What it was; nothing if it was not there.
    pub blessed: Option<Blessed>,
    /// What it is; nothing if it is gone.
    pub found: Option<f64>,
}

/// Tolerances by unit: what is left of a scene at rest by default settings, and a part of the value. Runs on one machine have the
/// same bits; this is for other compilers and small changes of the engine.
const TOLERANCES: [(&str, f64); 9] = [
    ("m", 1e-4),
    ("m/s", 1e-3),
    ("N", 1e-2),
    ("J", 1e-4),
    ("g", 1e-2),
    ("°", 1e-2),
    ("Pa", 1.0),
    ("s", 1e-2),
    ("N s", 1e-3),
];
const RELATIVE: f64 = 1e-3;
const WITHOUT_UNIT: f64 = 1e-4;

/// The file of a scene's baseline, beside it.
pub fn path_of(scene: &Path) -> PathBuf {
    scene.with_extension("baseline.toml")
}

fn tolerance(measured: &Measured) -> f64 {
    let of_unit =
        TOLERANCES.iter().find(|(unit, _)| *unit == measured.unit).map_or(WITHOUT_UNIT, |(_, t)| *t);
    let tolerance = of_unit + RELATIVE * measured.value.abs();
    // Two digits: it is to be read.
    format!("{tolerance:.1e}").parse().unwrap_or(tolerance)
}

fn numbers(outcome: &Outcome) -> impl Iterator<Item = &Measured> {
    outcome.numbers().chain(&outcome.finals)
}

impl Baseline {
    /// Of what runs came to, with tolerances by unit. Numbers that are NaN are left out.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        let blessed = |m: &Measured| (m.name.clone(), Blessed { value: m.value, within: tolerance(m) });
        let case =
            |o: &Outcome| (o.case.clone(), numbers(o).filter(|m| m.value.is_finite()).map(blessed).collect());
        Self { case: outcomes.into_iter().map(case).collect() }
    }

    /// Takes over tolerances that were edited: those of numbers that have one in an earlier baseline.
    #[must_use]
    pub fn with_tolerances_of(mut self, earlier: &Self) -> Self {
        for (name, numbers) in &mut self.case {
            let Some(earlier) = earlier.case.get(name) else { continue };
            for (name, own) in numbers {
                own.within = earlier.get(name).map_or(own.within, |earlier| earlier.within);
            }
        }
        self
    }

    /// Reads a baseline; nothing if there is none.
    ///
    /// # Errors
    /// A file that is no baseline.
    pub fn read(path: &Path) -> Result<Option<Self>, String> {
        let text = match std::fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            other => other.map_err(|e| format!("{}: {e}", path.display()))?,
        };
        toml::from_str(&text).map(Some).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Writes it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = toml::to_string(self).map_err(|e| said(&e))?;
        let head = "# Written by `foible bless`. Tolerances that are edited here are kept when it is written again.\n\n";
        std::fs::write(path, format!("{head}{text}")).map_err(|e| said(&e))
    }

    /// What is not as it was: numbers that are off, gone, or NaN now. New ones are none; cases that were not run are none.
    pub fn drifts(&self, outcome: &Outcome) -> Vec<Drift> {
        let Some(blessed) = self.case.get(&outcome.case) else { return Vec::new() };
        let drift = |(name, blessed): (&String, &Blessed)| {
            let found = numbers(outcome).find(|m| m.name == *name).map(|m| m.value);
            let holds = found.is_some_and(|value| (value - blessed.value).abs() <= blessed.within);
            (!holds).then(|| Drift { name: name.clone(), blessed: Some(*blessed), found })
        };
        blessed.iter().filter_map(drift).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_or_gone_has_drifted() {
        let measured =
            |name: &str, value| Measured { name: name.into(), value, unit: "m".into(), place: None };
        let outcome = |a, b: Option<f64>| Outcome {
            finals: [Some(measured("a", a)), b.map(|b| measured("b", b))].into_iter().flatten().collect(),
            ..Outcome::default()
        };
        let baseline = Baseline::of([&outcome(1.0, Some(2.0))]);
        assert!(baseline.drifts(&outcome(1.0 + 1.0e-3, Some(2.0))).is_empty());
        assert_eq!(baseline.drifts(&outcome(1.0 + 1.2e-3, Some(2.0)))[0].name, "a");
        assert_eq!(baseline.drifts(&outcome(1.0, None))[0].name, "b");
        assert_eq!(baseline.drifts(&outcome(1.0, Some(f64::NAN)))[0].name, "b");
        let mut edited = baseline.clone();
        edited.case.get_mut("").unwrap().get_mut("a").unwrap().within = 0.5;
        let again = Baseline::of([&outcome(1.1, Some(2.0))]).with_tolerances_of(&edited);
        assert_eq!(again.case[""]["a"], Blessed { value: 1.1, within: 0.5 });
    }
}
