//! What a run leaves behind: a table, a trace, a plot.

use super::build::Stage;
use super::file::{Quantity, Scene};
use plotters::prelude::*;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// One row per step: time, then the columns of `names`.
#[derive(Default)]
pub struct Trace {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
    pub steps: Vec<StepCost>,
}

/// What a step took.
#[derive(Clone, Copy, Default)]
pub struct StepCost {
    pub detection: f64,
    pub factor: f64,
    pub solve: f64,
    pub advance: f64,
    pub iterations: f64,
    pub residual: f64,
    pub contacts: f64,
}

impl Trace {
    pub fn new(stage: &Stage) -> Self {
        let mut names = vec!["time".to_string()];
        for (name, _) in &stage.deformable {
            names.extend(["y", "speed", "volume_ratio", "penetration"].map(|q| format!("{name}.{q}")));
            names.extend(stage.rigid.iter().map(|(on, ..)| format!("{name}.force_on_{on}")));
        }
        names.extend(stage.rigid.iter().map(|(name, ..)| format!("{name}.y")));
        names.extend(stage.probes.iter().map(|(name, ..)| format!("{name}.y")));
        names.extend(["iterations", "residual", "contacts", "ms"].map(String::from));
        Self { names, rows: Vec::new(), steps: Vec::new() }
    }

    pub fn record(&mut self, time: f64, stage: &Stage) {
        let mut row = vec![time];
        for (name, handle) in &stage.deformable {
            for quantity in [Quantity::Y, Quantity::Speed, Quantity::VolumeRatio, Quantity::Penetration] {
                row.push(stage.measure(quantity, name, None));
            }
            row.extend(stage.rigid.iter().map(|(on, ..)| stage.force(*handle, on)));
        }
        row.extend(stage.rigid.iter().map(|(name, ..)| stage.measure(Quantity::Y, name, None)));
        row.extend(stage.probes.iter().map(|(name, ..)| stage.measure(Quantity::Y, name, None)));
        let cost = StepCost::of(stage);
        row.extend([cost.iterations, cost.residual, cost.contacts, cost.total()]);
        self.steps.push(cost);
        self.rows.push(row);
    }

    pub fn write_csv(&self, path: &Path) -> std::io::Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        writeln!(file, "{}", self.names.join(","))?;
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(|v| format!("{v:.9e}")).collect();
            writeln!(file, "{}", cells.join(","))?;
        }
        file.flush()
    }

    /// Heights over time.
    pub fn write_plot(&self, path: &Path, title: &str) -> Result<(), Box<dyn std::error::Error>> {
        let heights: Vec<usize> = (0..self.names.len()).filter(|&k| self.names[k].ends_with(".y")).collect();
        let values = || heights.iter().flat_map(|&k| self.rows.iter().map(move |r| r[k]));
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let margin = (0.05 * (high - low)).max(1e-3);
        let end = self.rows.last().map_or(1.0, |r| r[0]);
        let area = SVGBackend::new(path, (900, 540)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
        chart.configure_mesh().x_desc("time [s]").y_desc("height [m]").draw()?;
        for (n, &k) in heights.iter().enumerate() {
            let color = Palette99::pick(n).to_rgba();
            let line = LineSeries::new(self.rows.iter().map(|r| (r[0], r[k])), color.stroke_width(2));
            let name = self.names[k].trim_end_matches(".y").to_string();
            chart
                .draw_series(line)?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
        area.present()?;
        Ok(())
    }
}

impl StepCost {
    fn of(stage: &Stage) -> Self {
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        let c = stage.world.counters();
        let residuals = stage.deformable.iter().map(|(_, b)| stage.world.bodies[*b].last_residual());
        Self {
            detection: ms(c.detection_time),
            factor: ms(c.factor_time),
            solve: ms(c.solve_time),
            advance: ms(c.advance_time),
            iterations: c.iterations as f64 / c.islands.max(1) as f64,
            residual: residuals.fold(0.0, f64::max),
            contacts: c.contacts as f64,
        }
    }

    fn total(&self) -> f64 {
        self.detection + self.factor + self.solve + self.advance
    }
}

/// The table after a run.
pub fn print_table(scene: &Scene, stage: &Stage, trace: &Trace) {
    println!(
        "\n  {:<14} {:>10} {:>11} {:>8} {:>12}  forces [N]",
        "body", "height [m]", "speed [m/s]", "volume", "deepest [m]"
    );
    for (name, handle) in &stage.deformable {
        let m = |q| stage.measure(q, name, None);
        let forces: Vec<String> = stage
            .rigid
            .iter()
            .map(|(on, ..)| (on, stage.force(*handle, on)))
            .filter(|(_, f)| *f != 0.0)
            .map(|(on, f)| format!("{on} {f:+.3}"))
            .collect();
        println!(
            "  {name:<14} {:>10.5} {:>11.2e} {:>8.4} {:>12.2e}  {}",
            m(Quantity::Y),
            m(Quantity::Speed),
            m(Quantity::VolumeRatio),
            m(Quantity::Penetration),
            forces.join(", ")
        );
    }
    for ((name, ..), body) in stage.rigid.iter().zip(&scene.rigid) {
        if body.kind != super::file::Kind::Fixed {
            let m = |q| stage.measure(q, name, None);
            println!("  {name:<14} {:>10.5} {:>11.2e}", m(Quantity::Y), m(Quantity::Speed));
        }
    }
    for (name, ..) in &stage.probes {
        let m = |q| stage.measure(q, name, None);
        println!("  {name:<14} {:>10.5} {:>11.2e}  (probe)", m(Quantity::Y), m(Quantity::Speed));
    }
    print_costs(trace);
}

/// Milliseconds, iterations and residual per step: the median and the worst.
fn print_costs(trace: &Trace) {
    println!(
        "\n  {:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>11}",
        "per step", "detect", "factor", "solve", "advance", "total ms", "iter.", "residual N"
    );
    let columns = |pick: &dyn Fn(&mut Vec<f64>) -> f64| {
        let of = |f: &dyn Fn(&StepCost) -> f64| pick(&mut trace.steps.iter().map(f).collect());
        [
            of(&|s| s.detection),
            of(&|s| s.factor),
            of(&|s| s.solve),
            of(&|s| s.advance),
            of(&StepCost::total),
            of(&|s| s.iterations),
            of(&|s| s.residual),
        ]
    };
    let line = |name: &str, [d, f, s, a, t, i, r]: [f64; 7]| {
        println!("  {name:<10} {d:>9.3} {f:>9.3} {s:>9.3} {a:>9.3} {t:>9.3} {i:>7.1} {r:>11.2e}");
    };
    line(
        "median",
        columns(&|v| {
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).copied().unwrap_or(0.0)
        }),
    );
    line("worst", columns(&|v| v.iter().copied().fold(0.0, f64::max)));
}
