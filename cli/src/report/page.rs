//! One page of a run, whole in one file: verdicts, plots, and the replay in 3D.

use super::plot::{Line, lines};
use crate::baseline::Drift;
use crate::run::number;
use crate::run::{Costs, Measured, Outcome, Trace};
use foible_replay::{PLAYER_SECTION, player_scripts};
pub(super) use foible_replay::{escaped, page};
use std::fmt::Write as _;

/// What a page of a run is made of.
#[derive(Clone, Copy, Debug)]
pub struct PageOfRun<'a> {
    /// Numbers and verdicts.
    pub outcome: &'a Outcome,
    /// What steps took.
    pub costs: &'a Costs,
    /// Rows per step.
    pub trace: &'a Trace,
    /// What differs from the baseline.
    pub drifts: &'a [Drift],
    /// The bytes of a replay.
    pub replay: Option<&'a [u8]>,
}

/// A cell that sorts by its number.
pub(super) fn number_cell(value: f64, unit: &str) -> String {
    let key = if value.is_finite() { format!("{value:e}") } else { String::new() };
    format!("<td class=\"number\" data-key=\"{key}\">{}</td>", escaped(&number(value, unit)))
}

/// The cell of a number's name, with its place.
fn name_cell(measured: &Measured) -> String {
    let place = measured.place_text().map_or(String::new(), |place| format!(" <small>{place}</small>"));
    format!("<td>{}{place}</td>", escaped(&measured.name))
}

/// The page of one run.
pub fn page_of_run(run: &PageOfRun<'_>) -> String {
    let outcome = run.outcome;
    let failures = outcome.failures() + run.drifts.len();
    let mut body = format!("<h1>{}</h1>\n", escaped(&outcome.title()));
    let verdict = match failures {
        0 => "<p class=\"ok\">All expectations are met.</p>\n".to_string(),
        1 => "<p class=\"failed\">One expectation failed.</p>\n".to_string(),
        n => format!("<p class=\"failed\">{n} expectations failed.</p>\n"),
    };
    body.push_str(&verdict);
    if let Some(error) = &outcome.error {
        let _ = writeln!(body, "<p class=\"failed\">{}</p>", escaped(error));
    }
    if run.replay.is_some() {
        body.push_str(PLAYER_SECTION);
    }
    add_verdicts(&mut body, outcome);
    add_drifts(&mut body, run.drifts);
    add_numbers(&mut body, "Measured", &outcome.measures);
    add_plots(&mut body, run.trace);
    add_numbers(&mut body, "In the end", &outcome.finals);
    let Costs { mean, median, p99, worst, .. } = run.costs;
    let _ = writeln!(
        body,
        "<h2>Cost</h2>\n<p>{} steps of {:.3} ms took {mean:.3} ms in the mean, {median:.3} in the median, {p99:.3} at the 99th \
         percentile, {worst:.3} at worst.</p>",
        outcome.steps,
        outcome.dt * 1e3
    );
    let scripts = run.replay.map_or(String::new(), player_scripts);
    page(&outcome.title(), &body, &scripts)
}

fn add_verdicts(body: &mut String, outcome: &Outcome) {
    if outcome.verdicts.is_empty() {
        return;
    }
    body.push_str("<h2>Expectations</h2>\n<table class=\"sorts\">\n<thead><tr><th>verdict</th><th>number</th><th class=\"number\">value</th><th>wanted</th></tr></thead>\n<tbody>\n");
    for verdict in &outcome.verdicts {
        let (class, word) = if verdict.met { ("ok", "met") } else { ("failed", "failed") };
        let _ = writeln!(
            body,
            "<tr><td class=\"{class}\">{word}</td>{}{}<td>{}</td></tr>",
            name_cell(&verdict.measured),
            number_cell(verdict.measured.value, &verdict.measured.unit),
            escaped(&verdict.wanted)
        );
    }
    body.push_str("</tbody>\n</table>\n");
}

fn add_drifts(body: &mut String, drifts: &[Drift]) {
    if !drifts.is_empty() {
        let text = super::text::of_drifts(drifts);
        let _ =
            writeln!(body, "<h2>Not as in the baseline</h2>\n<pre class=\"failed\">{}</pre>", escaped(&text));
    }
}

fn add_numbers(body: &mut String, title: &str, numbers: &[Measured]) {
    if numbers.is_empty() {
        return;
    }
    let _ = writeln!(
        body,
        "<h2>{title}</h2>\n<table class=\"sorts\">\n<thead><tr><th>number</th><th class=\"number\">value</th></tr></thead>\n<tbody>"
    );
    for measured in numbers {
        let _ =
            writeln!(body, "<tr>{}{}</tr>", name_cell(measured), number_cell(measured.value, &measured.unit));
    }
    body.push_str("</tbody>\n</table>\n");
}

fn add_plots(body: &mut String, trace: &Trace) {
    let columns = |ends: &str| -> Vec<Line<'_>> {
        let names =
            trace.names.iter().enumerate().filter_map(|(k, name)| Some((k, name.strip_suffix(ends)?)));
        // What never moves is no line.
        let names = names.filter(|(k, _)| trace.rows.windows(2).any(|rows| rows[0][*k] != rows[1][*k]));
        names.map(|(k, name)| (name, trace.rows.iter().map(|row| [row[0], row[k]]).collect())).collect()
    };
    let forces: Vec<Line<'_>> = trace
        .names
        .iter()
        .enumerate()
        .filter(|(k, name)| name.contains(".force_on_") && trace.rows.iter().any(|row| row[*k] != 0.0))
        .map(|(k, name)| (name.as_str(), trace.rows.iter().map(|row| [row[0], row[k]]).collect()))
        .collect();
    let plots = [
        ("Heights", columns(".y"), "height [m]"),
        ("Speeds", columns(".speed"), "speed [m/s]"),
        ("Vertical forces", forces, "force [N]"),
    ];
    for (title, own, unit) in plots {
        if let Ok(svg) = lines(&own, unit)
            && !own.is_empty()
        {
            let _ = writeln!(
                body,
                "<h2>{title}</h2>\n<figure role=\"img\" aria-label=\"{title} over time\">{svg}</figure>"
            );
        }
    }
}
