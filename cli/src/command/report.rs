//! `foible report`.

use super::drifts;
use super::{Format, exit_code, write_junit};
use crate::report::{of_drifts, of_run, of_sweep};
use crate::sweep::{Done, Table, read};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible report target/scenes/drop --junit drop.xml")]
pub(super) struct Report {
    /// A folder with the results of a run, or of all cases of a sweep.
    results: PathBuf,
    /// How results are printed.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Also writes JUnit's XML.
    #[arg(long)]
    junit: Option<PathBuf>,
}

impl Report {
    pub fn main(&self) -> Result<u8, String> {
        let done = self.results()?;
        let drifts: Vec<_> = done.iter().map(drifts::read).collect();
        let is_sweep = done.iter().any(|d| d.folder != self.results);
        let table = Table::of(&done);
        if is_sweep {
            let name = done.first().map_or(String::new(), |d| d.outcome.scene.clone());
            super::sweep::write_table(&name, &table, &done, &self.results)?;
        } else {
            let mut all = done.iter().zip(&drifts);
            all.try_for_each(|(done, drifts)| super::run::write_page(done, drifts))?;
        }
        write_junit(self.junit.as_deref(), &done, &drifts)?;
        match self.format {
            Format::Json => say!("{}", super::run::json(&done)?),
            Format::Text if is_sweep => say!("{}", of_sweep(&table).trim_end()),
            Format::Text => done.iter().for_each(|d| say!("{}", of_run(&d.outcome, &d.costs).trim_end())),
        }
        let moved: Vec<_> = drifts.concat();
        if !moved.is_empty() && self.format == Format::Text {
            say!("{}", of_drifts(&moved).trim_end());
        }
        Ok(exit_code(moved.len() + done.iter().map(|d| d.outcome.failures()).sum::<usize>()))
    }

    /// The results in the folder, or in the folders in it, in order.
    fn results(&self) -> Result<Vec<Done>, String> {
        let done = |folder: &Path| {
            let (outcome, costs) = read(folder)?;
            Ok(Done { outcome, costs, folder: folder.to_path_buf(), is_old: true })
        };
        if self.results.join("outcome.json").exists() {
            return Ok(vec![done(&self.results)?]);
        }
        let entries =
            std::fs::read_dir(&self.results).map_err(|e| format!("{}: {e}", self.results.display()))?;
        let mut folders: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        folders.retain(|folder| folder.join("outcome.json").exists());
        folders.sort();
        if folders.is_empty() {
            return Err(format!("{}: there are no results", self.results.display()));
        }
        folders.iter().map(|folder| done(folder)).collect()
    }
}
