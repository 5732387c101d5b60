//! One page of a sweep: every case in a table, each number over all cases, and how they go together.

use super::page::{escaped, number_cell, page};
use crate::run::number;
use crate::sweep::{Row, Table};
use std::fmt::Write as _;

/// Axes of the parallel coordinates: more do not fit beside one another.
const MOST_AXES: usize = 8;
const SIZE: [f64; 2] = [900.0, 340.0];

/// The page of a sweep; `titles` of the scene, folders of the cases in order.
pub fn page_of_sweep(title: &str, table: &Table, folders: &[String]) -> String {
    let failed = table.rows.iter().filter(|row| row.failures > 0).count();
    let mut body = format!("<h1>{}</h1>\n", escaped(title));
    let class = if failed == 0 { "ok" } else { "failed" };
    let _ = writeln!(body, "<p class=\"{class}\">{} cases, {failed} of them failed.</p>", table.rows.len());
    add_summaries(&mut body, table);
    add_coordinates(&mut body, table);
    add_map(&mut body, table);
    add_cases(&mut body, table, folders);
    page(title, &body, "")
}

fn add_summaries(body: &mut String, table: &Table) {
    body.push_str("<h2>Over all cases</h2>\n<div class=\"wide\"><table class=\"sorts\">\n<thead><tr><th>number</th><th class=\"number\">mean</th><th class=\"number\">deviation</th><th class=\"number\">least</th><th>in</th><th class=\"number\">largest</th><th>in</th></tr></thead>\n<tbody>\n");
    for s in table.summaries() {
        let _ = writeln!(
            body,
            "<tr><td>{}</td>{}{}{}<td>{}</td>{}<td>{}</td></tr>",
            escaped(&s.name),
            number_cell(s.mean, ""),
            number_cell(s.deviation, ""),
            number_cell(s.least.0, ""),
            escaped(&s.least.1),
            number_cell(s.largest.0, ""),
            escaped(&s.largest.1)
        );
    }
    body.push_str("</tbody>\n</table></div>\n");
}

fn add_cases(body: &mut String, table: &Table, folders: &[String]) {
    body.push_str("<h2>Cases</h2>\n<div class=\"wide\"><table class=\"sorts\">\n<thead><tr><th>case</th>");
    for name in table.names.iter().skip(table.set) {
        let _ = write!(body, "<th class=\"number\">{}</th>", escaped(name));
    }
    body.push_str("<th class=\"number\">failures</th><th>results</th></tr></thead>\n<tbody>\n");
    for (k, row) in table.rows.iter().enumerate() {
        let class = if row.failures > 0 { " class=\"failed\"" } else { "" };
        let _ = write!(body, "<tr><td{class}>{}</td>", escaped(&row.case));
        row.numbers.iter().for_each(|v| body.push_str(&number_cell(*v, "")));
        let folder = escaped(folders.get(k).map_or("", String::as_str));
        let failures = number_cell(row.failures as f64, "");
        let _ = writeln!(body, "{failures}<td><a href=\"{folder}/trace.csv\">{folder}</a></td></tr>");
    }
    body.push_str("</tbody>\n</table></div>\n");
}

/// An axis of the parallel coordinates: its name, its marks, and where each case is on it, from 0 at the bottom to 1.
struct Axis<'a> {
    name: &'a str,
    marks: Vec<(f64, String)>,
    places: Vec<f64>,
}

/// What is set by its values in order, a number by its size.
fn axes(table: &Table) -> Vec<Axis<'_>> {
    let mut axes = Vec::new();
    for (k, name) in table.names.iter().enumerate().take(MOST_AXES) {
        if k < table.set {
            let mut values: Vec<&str> = Vec::new();
            let texts = table.rows.iter().map(|row| row.set[k].as_str());
            texts.for_each(|v| {
                if !values.contains(&v) {
                    values.push(v)
                }
            });
            let part = |v: &str| {
                values.iter().position(|own| *own == v).unwrap_or(0) as f64 / (values.len().max(2) - 1) as f64
            };
            let every = values.len().div_ceil(14).max(1);
            let marks = values.iter().step_by(every).map(|v| (part(v), (*v).to_string())).collect();
            axes.push(Axis { name, marks, places: table.rows.iter().map(|row| part(&row.set[k])).collect() });
            continue;
        }
        let value = |row: &Row| row.numbers[k - table.set];
        let finite = || table.rows.iter().map(value).filter(|v| v.is_finite());
        let (low, high) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if high > low {
            let marks = [0.0, 0.5, 1.0].map(|t| (t, number(low + t * (high - low), ""))).to_vec();
            axes.push(Axis {
                name,
                marks,
                places: table.rows.iter().map(|row| (value(row) - low) / (high - low)).collect(),
            });
        }
    }
    axes
}

/// Cases as lines over axes.
fn add_coordinates(body: &mut String, table: &Table) {
    let axes = axes(table);
    if axes.len() < 2 {
        return;
    }
    let x = |k: usize| 90.0 + (SIZE[0] - 180.0) * k as f64 / (axes.len() - 1) as f64;
    let y = |part: f64| SIZE[1] - 30.0 - (SIZE[1] - 80.0) * part;
    let _ = write!(
        body,
        "<h2>How they go together</h2>\n<figure role=\"img\" aria-label=\"Each case a line over all numbers\"><svg viewBox=\"0 0 {} {}\" font-size=\"11\" fill=\"currentColor\">",
        SIZE[0], SIZE[1]
    );
    for (row, own) in table.rows.iter().enumerate() {
        let points = axes.iter().enumerate().filter(|(_, axis)| axis.places[row].is_finite());
        let points: Vec<String> =
            points.map(|(k, axis)| format!("{:.1},{:.1}", x(k), y(axis.places[row]))).collect();
        let (color, width) = if own.failures > 0 { ("var(--failed)", 1.4) } else { ("#4a7fb5", 0.8) };
        let _ = write!(
            body,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" opacity=\"0.7\"><title>{}</title></polyline>",
            points.join(" "),
            escaped(&own.case)
        );
    }
    for (k, axis) in axes.iter().enumerate() {
        let _ = write!(
            body,
            "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{2:.1}\" stroke=\"currentColor\"/>",
            x(k),
            y(0.0),
            y(1.0)
        );
        let short: String = axis.name.chars().take(26).collect();
        // Names in two rows, so that neighbours do not run into one another.
        let _ = write!(
            body,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>",
            x(k),
            if k % 2 == 0 { 14 } else { 30 },
            escaped(&short)
        );
        for (part, mark) in &axis.marks {
            let _ = write!(
                body,
                "<text x=\"{:.1}\" y=\"{:.1}\" stroke=\"var(--back)\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>",
                x(k) + 5.0,
                y(*part) + 4.0,
                escaped(mark)
            );
        }
    }
    body.push_str("</svg></figure>\n");
}

/// Two things that are swept: the first number over both, darker where it is larger.
fn add_map(body: &mut String, table: &Table) {
    if table.set != 2 || table.names.len() < 3 {
        return;
    }
    let mut values: [Vec<&str>; 2] = [Vec::new(), Vec::new()];
    for row in &table.rows {
        for (own, text) in values.iter_mut().zip(&row.set) {
            if !own.contains(&text.as_str()) {
                own.push(text);
            }
        }
    }
    let numbers = || table.rows.iter().map(|row| row.numbers[0]).filter(|v| v.is_finite());
    let (low, high) = (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
    let _ = write!(
        body,
        "<h2>{}</h2>\n<div class=\"wide\"><table>\n<thead><tr><th>{} \\ {}</th>",
        escaped(&table.names[2]),
        escaped(&table.names[1]),
        escaped(&table.names[0])
    );
    values[0].iter().for_each(|v| {
        let _ = write!(body, "<th>{}</th>", escaped(v));
    });
    body.push_str("</tr></thead>\n<tbody>\n");
    for second in &values[1] {
        let _ = write!(body, "<tr><th>{}</th>", escaped(second));
        for first in &values[0] {
            let found = table.rows.iter().find(|row| row.set[0] == *first && row.set[1] == *second);
            let value = found.map_or(f64::NAN, |row| row.numbers[0]);
            let part = if high > low && value.is_finite() { (value - low) / (high - low) } else { 0.0 };
            let _ = write!(
                body,
                "<td class=\"number\" style=\"background: rgb(217 72 43 / {:.2})\">{}</td>",
                0.75 * part,
                number(value, "")
            );
        }
        body.push_str("</tr>\n");
    }
    body.push_str("</tbody>\n</table></div>\n");
}
