//! Recorded curves that a run is compared with.

use super::trace::Trace;
use crate::scene::Curve;
use std::path::Path;

/// A curve over time, rising times.
#[derive(Clone, Debug)]
pub struct Recorded(Vec<[f64; 2]>);

impl Recorded {
    /// Reads a column of a CSV file.
    ///
    /// # Errors
    /// A file that is not there, a column that it has not, times that do not rise.
    pub fn read(curve: &Curve, folder: &Path) -> Result<Self, String> {
        let path = folder.join(&curve.path);
        let trace = Trace::read_csv(&path)?;
        let column = |name: &str| {
            let found = trace.names.iter().position(|own| own.trim() == name);
            found.ok_or_else(|| {
                format!(
                    "{}: there is no column \"{name}\"; there are: {}",
                    path.display(),
                    trace.names.join(", ")
                )
            })
        };
        let (time, own) = (column("time")?, column(&curve.column)?);
        let points: Vec<[f64; 2]> = trace.rows.iter().map(|row| [row[time], row[own]]).collect();
        if points.is_empty() || points.windows(2).any(|p| !(p[0][0] < p[1][0])) {
            return Err(format!("{}: `time` must rise, in one row at least", path.display()));
        }
        Ok(Self(points))
    }

    /// By straight lines between rows; nothing before the first and after the last.
    fn at(&self, time: f64) -> Option<f64> {
        let next = self.0.iter().position(|p| p[0] >= time - 1e-9)?;
        let [t1, v1] = self.0[next];
        if next == 0 {
            return ((t1 - time).abs() <= 1e-9).then_some(v1);
        }
        let [t0, v0] = self.0[next - 1];
        Some(v0 + (v1 - v0) * ((time - t0) / (t1 - t0)).clamp(0.0, 1.0))
    }

    /// What values are above it, where it is.
    pub fn distances<'a>(
        &'a self,
        series: &'a [f64],
        window: std::ops::Range<usize>,
        dt: f64,
    ) -> impl Iterator<Item = f64> + 'a {
        window.filter_map(move |k| Some(series[k] - self.at((k + 1) as f64 * dt)?))
    }

    /// The largest distance of values from it, where it is; NaN if it is nowhere.
    pub fn farthest(&self, series: &[f64], window: std::ops::Range<usize>, dt: f64) -> f64 {
        self.distances(series, window, dt)
            .map(f64::abs)
            .fold(f64::NAN, |a, d| if d.is_nan() { f64::INFINITY } else { a.max(d) })
    }
}
