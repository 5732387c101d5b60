//! All cases of a sweep in one table, and what stands out in it.

use super::jobs::Done;
use std::collections::BTreeSet;
use std::io::Write;

/// Cases, one per row.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Names of what is set, then of numbers.
    pub names: Vec<String>,
    /// How many of the names are set.
    pub set: usize,
    /// Per case: texts of what is set, then numbers.
    pub rows: Vec<Row>,
}

/// A case of a table.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Its name.
    pub case: String,
    /// What is set.
    pub set: Vec<String>,
    /// Numbers; NaN where there is none.
    pub numbers: Vec<f64>,
    /// Expectations that failed.
    pub failures: usize,
}

/// A number over all cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Its name.
    pub name: String,
    /// Over the cases that have it.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// The least, and its case.
    pub least: (f64, String),
    /// The largest, and its case.
    pub largest: (f64, String),
}

impl Table {
    /// Of finished cases.
    pub fn of(done: &[Done]) -> Self {
        let outcomes = || done.iter().map(|d| &d.outcome);
        let mut names: Vec<String> = Vec::new();
        let mut known = BTreeSet::new();
        let mut add = |name: &String| {
            if known.insert(name.clone()) {
                names.push(name.clone());
            }
        };
        outcomes().flat_map(|o| &o.set).for_each(|(path, _)| add(path));
        let set = outcomes().flat_map(|o| &o.set).map(|(path, _)| path).collect::<BTreeSet<_>>().len();
        outcomes().flat_map(|o| o.numbers()).for_each(|measured| add(&measured.name));
        let row = |done: &Done| {
            let of_set = |name: &String| {
                let found = done.outcome.set.iter().find(|(path, _)| path == name);
                found.map_or(String::new(), |(_, value)| value.clone())
            };
            let number = |name: &String| {
                done.outcome.numbers().find(|m| m.name == *name).map_or(f64::NAN, |m| m.value)
            };
            Row {
                case: done.outcome.case.clone(),
                set: names[..set].iter().map(of_set).collect(),
                numbers: names[set..].iter().map(number).collect(),
                failures: done.outcome.failures(),
            }
        };
        let rows = done.iter().map(row).collect();
        Self { names, set, rows }
    }

    /// As CSV: the case, what is set, the numbers, the failures.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write_csv(&self, to: impl Write) -> Result<(), csv::Error> {
        let mut writer = csv::Writer::from_writer(to);
        let head = ["case"].into_iter().chain(self.names.iter().map(String::as_str)).chain(["failures"]);
        writer.write_record(head)?;
        for row in &self.rows {
            let mut cells = vec![row.case.clone()];
            cells.extend(row.set.iter().cloned());
            cells.extend(
                row.numbers.iter().map(|v| if v.is_nan() { String::new() } else { format!("{v:.9e}") }),
            );
            cells.push(row.failures.to_string());
            writer.write_record(&cells)?;
        }
        writer.flush()?;
        Ok(())
    }

    /// Every number over all cases.
    pub fn summaries(&self) -> Vec<Summary> {
        let summary = |(k, name): (usize, &String)| {
            let with = || self.rows.iter().filter(|row| row.numbers[k].is_finite());
            let count = with().count() as f64;
            let mean = with().map(|row| row.numbers[k]).sum::<f64>() / count;
            let variance = with().map(|row| (row.numbers[k] - mean).powi(2)).sum::<f64>() / count;
            let order = |a: &&Row, b: &&Row| a.numbers[k].total_cmp(&b.numbers[k]);
            let named = |row: &Row| (row.numbers[k], row.case.clone());
            let (least, largest) = (with().min_by(order).map(named)?, with().max_by(order).map(named)?);
            Some(Summary { name: name.clone(), mean, deviation: variance.sqrt(), least, largest })
        };
        self.names[self.set..].iter().enumerate().filter_map(summary).collect()
    }
}
