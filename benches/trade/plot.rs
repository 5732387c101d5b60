//! Error against time, one panel per scene.

use crate::Point;
use plotters::prelude::*;
use std::error::Error;
use std::path::Path;

const PANELS: [&str; 4] = ["sagging cantilever", "swinging cantilever", "drop and rest", "cloth at rest"];

/// Families in the order of their colours.
const FAMILIES: [(&str, RGBColor); 7] = [
    ("preset", RGBColor(0, 0, 0)),
    ("rest stiffness", RGBColor(31, 119, 180)),
    ("Laplacian", RGBColor(44, 160, 44)),
    ("Gauss–Seidel", RGBColor(148, 103, 189)),
    ("Jacobi", RGBColor(140, 86, 75)),
    ("Newton", RGBColor(255, 127, 14)),
    ("rapier", RGBColor(214, 39, 40)),
];

/// Errors below this are drawn at it.
const LEAST: f64 = 1.0e-7;

pub fn draw(path: &Path, points: &[Point]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (1100, 820)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, scene) in root.split_evenly((2, 2)).iter().zip(PANELS) {
        let own: Vec<&Point> = points.iter().filter(|p| p.scene == scene && p.error.is_finite()).collect();
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        own.iter().for_each(|p| (low, high) = (low.min(p.ms), high.max(p.ms)));
        let top = own.iter().map(|p| p.error).fold(1.0, f64::max);
        let mut chart = ChartBuilder::on(area)
            .caption(scene, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(58)
            .build_cartesian_2d((low * 0.7..high * 1.4).log_scale(), (LEAST * 0.5..top * 2.0).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("ms per step")
            .y_desc("error")
            .light_line_style(BLACK.mix(0.04))
            .y_label_formatter(&|e| format!("{e:.0e}"))
            .draw()?;
        for (family, color) in FAMILIES {
            let line: Vec<(f64, f64)> =
                own.iter().filter(|p| p.family == family).map(|p| (p.ms, p.error.max(LEAST))).collect();
            if line.is_empty() {
                continue;
            }
            if family != "preset" && family != "rapier" {
                chart.draw_series(LineSeries::new(line.iter().copied(), color.stroke_width(1)))?;
            }
            let series = chart.draw_series(line.iter().map(|&at| Circle::new(at, 4, color.filled())))?;
            series.label(family).legend(move |(x, y)| Circle::new((x + 8, y), 4, color.filled()));
            if family == "preset" || family == "rapier" {
                let named = own.iter().filter(|p| p.family == family);
                chart.draw_series(named.map(|p| {
                    let font = ("sans-serif", 12).into_font().color(&color);
                    Text::new(format!("  {}", p.method), (p.ms, p.error.max(LEAST) * 1.15), font)
                }))?;
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.2))
            .label_font(("sans-serif", 12))
            .draw()?;
    }
    root.present()?;
    Ok(())
}
