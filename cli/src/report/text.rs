//! Reports for people at a terminal.

use crate::baseline::Drift;
use crate::run::{Costs, Outcome, Verdict, number};
use crate::sweep::{Summary, Table};
use std::fmt::Write as _;

fn verdict(text: &mut String, verdict: &Verdict) {
    let word = if verdict.met { "ok    " } else { "FAILED" };
    let value = verdict.measured.text();
    let _ = writeln!(text, "  {word} {}: {value} ({})", verdict.measured.name, verdict.wanted);
}

/// Numbers, verdicts and costs of one run.
pub fn of_run(outcome: &Outcome, costs: &Costs) -> String {
    let mut text = format!("\n{}: {} steps of {:.3} ms\n", outcome.title(), outcome.steps, outcome.dt * 1e3);
    if let Some(error) = &outcome.error {
        let _ = writeln!(text, "  FAILED {error}");
    }
    outcome.verdicts.iter().for_each(|own| verdict(&mut text, own));
    for measured in &outcome.measures {
        let _ = writeln!(text, "         {}: {}", measured.name, measured.text());
    }
    let Costs { mean, median, p99, worst, .. } = costs;
    let _ = writeln!(
        text,
        "  per step: mean {mean:.3}, median {median:.3}, 99th percentile {p99:.3}, worst {worst:.3} ms"
    );
    text
}

/// What is not as it was.
pub fn of_drifts(drifts: &[Drift]) -> String {
    let mut text = String::new();
    for drift in drifts {
        let was = drift
            .blessed
            .map_or("not there".into(), |b| format!("{} within {:e}", number(b.value, ""), b.within));
        let is = drift.found.map_or("is gone".into(), |value| format!("is {}", number(value, "")));
        let _ = writeln!(text, "  DRIFT  {} was {was}, {is}", drift.name);
    }
    text
}

/// A sweep: every number over its cases, and the worst ones by name.
pub fn of_sweep(table: &Table) -> String {
    let summaries = table.summaries();
    let longest = summaries.iter().map(|s| s.name.chars().count()).max().unwrap_or(0).min(60);
    let mut text = format!(
        "\n  {:<longest$} {:>12} {:>12}  least and largest, with their cases\n",
        "over all cases", "mean", "deviation"
    );
    for Summary { name, mean, deviation, least, largest } in &summaries {
        let at = |(value, case): &(f64, String)| format!("{} [{case}]", number(*value, ""));
        let (mean, deviation) = (number(*mean, ""), number(*deviation, ""));
        let _ =
            writeln!(text, "  {name:<longest$} {mean:>12} {deviation:>12}  {} … {}", at(least), at(largest));
    }
    for row in table.rows.iter().filter(|row| row.failures > 0) {
        let _ = writeln!(text, "  FAILED [{}]: {} expectations", row.case, row.failures);
    }
    text
}
