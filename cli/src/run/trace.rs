//! One row per step: heights, speeds, forces, and what the step took.

use super::outcome::Costs;
use crate::scene::Quantity;
use crate::stage::Stage;
use std::path::Path;
use std::time::Duration;

/// Rows of a run, one per step.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Of the columns; the first is `time`.
    pub names: Vec<String>,
    /// Values in the order of the names.
    pub rows: Vec<Vec<f64>>,
    /// Milliseconds per step: no column, as everything in the rows is the same at every run.
    pub milliseconds: Vec<f64>,
}

impl Trace {
    /// Of a scene before its first step.
    pub fn new(stage: &Stage) -> Self {
        let mut names = vec!["time".to_string()];
        for (name, _) in &stage.deformable {
            names.extend(["y", "speed", "volume_ratio", "penetration"].map(|q| format!("{name}.{q}")));
            names.extend(stage.rigid.iter().map(|(on, ..)| format!("{name}.force_on_{on}")));
        }
        names.extend(stage.rigid.iter().map(|(name, ..)| format!("{name}.y")));
        names.extend(stage.probes.iter().map(|(name, ..)| format!("{name}.y")));
        names.extend(["iterations", "residual", "contacts"].map(String::from));
        Self { names, ..Self::default() }
    }

    /// Adds the row of a step.
    pub fn record(&mut self, time: f64, stage: &Stage) {
        let mut row = vec![time];
        for (name, _) in &stage.deformable {
            for quantity in [Quantity::Y, Quantity::Speed, Quantity::VolumeRatio, Quantity::Penetration] {
                row.push(stage.measure(quantity, name, None));
            }
            row.extend(stage.rigid.iter().map(|(on, ..)| stage.force(name, Some(on))[1]));
        }
        row.extend(stage.rigid.iter().map(|(name, ..)| stage.measure(Quantity::Y, name, None)));
        row.extend(stage.probes.iter().map(|(name, ..)| stage.measure(Quantity::Y, name, None)));
        let counters = stage.world.counters();
        let residuals = stage.deformable.iter().map(|(_, b)| stage.world.bodies[*b].last_residual());
        row.push(counters.iterations as f64 / counters.islands.max(1) as f64);
        row.push(residuals.fold(0.0, f64::max));
        row.push(counters.contacts as f64);
        let parts =
            [counters.detection_time, counters.factor_time, counters.solve_time, counters.advance_time];
        self.milliseconds.push(parts.iter().map(Duration::as_secs_f64).sum::<f64>() * 1e3);
        self.rows.push(row);
    }

    /// What steps took.
    pub fn costs(&self) -> Costs {
        Costs::of(self.milliseconds.clone())
    }

    /// Columns of heights, with the names of what they are of.
    pub fn heights(&self) -> Vec<(&str, Vec<[f64; 2]>)> {
        let names = self.names.iter().enumerate().filter_map(|(k, name)| Some((k, name.strip_suffix(".y")?)));
        names.map(|(k, name)| (name, self.rows.iter().map(|row| [row[0], row[k]]).collect())).collect()
    }

    /// Writes it as CSV.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> std::io::Result<()> {
        let mut writer = csv::Writer::from_path(path)?;
        writer.write_record(&self.names)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(|v| format!("{v:.9e}")))?;
        }
        writer.flush()
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// A file that is not there, or is no such table.
    pub fn read_csv(path: &Path) -> Result<Self, String> {
        let said = |what: String| format!("{}: {what}", path.display());
        let mut reader = csv::Reader::from_path(path).map_err(|e| said(e.to_string()))?;
        let names: Vec<String> =
            reader.headers().map_err(|e| said(e.to_string()))?.iter().map(String::from).collect();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| said(e.to_string()))?;
            let row = record
                .iter()
                .map(|cell| cell.trim().parse::<f64>().map_err(|_| said(format!("\"{cell}\" is no number"))));
            rows.push(row.collect::<Result<Vec<f64>, String>>()?);
        }
        Ok(Self { names, rows, milliseconds: Vec::new() })
    }
}
