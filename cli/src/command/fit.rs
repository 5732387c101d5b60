//! `foible fit`.

use super::{Format, MET};
use crate::fit::fit;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible fit press.toml --set file=measured.csv")]
pub(super) struct Fit {
    /// A scene file with a [fit], and expectations with `equals` or `curve`.
    scene: PathBuf,
    /// A parameter or a dotted path, NAME=VALUE; may be given more than once.
    #[arg(long, value_parser = super::parse_set)]
    set: Vec<(String, String)>,
    /// How results are printed.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

impl Fit {
    pub fn main(&self) -> Result<u8, String> {
        let fitted = fit(&self.scene, &self.set).map_err(|e| format!("{}: {e}", self.scene.display()))?;
        match self.format {
            Format::Json => say!("{}", serde_json::to_string_pretty(&fitted).map_err(|e| e.to_string())?),
            Format::Text => {
                for parameter in &fitted.parameters {
                    say!("{} = {:.6e} ± {:.1e}", parameter.name, parameter.value, parameter.within);
                }
                say!(
                    "what is left is {:.3} of the tolerances, of {} numbers; {} runs",
                    fitted.residual,
                    fitted.count,
                    fitted.runs
                );
            }
        }
        Ok(MET)
    }
}
