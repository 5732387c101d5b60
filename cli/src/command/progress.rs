//! How far jobs are, on standard error; nothing where that is no terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of so many steps.
pub fn bar(steps: u64, unit: &str) -> ProgressBar {
    let bar = ProgressBar::new(steps);
    if let Ok(style) =
        ProgressStyle::with_template(&format!("  {{bar:40}} {{pos}}/{{len}} {unit}, {{eta}} left"))
    {
        bar.set_style(style);
    }
    bar
}
