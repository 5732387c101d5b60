//! Plots as SVG, without a background of their own so that a page's is seen.

use plotters::prelude::*;

/// A name and points.
pub type Line<'a> = (&'a str, Vec<[f64; 2]>);

/// Pixels, and what is kept for the legend beside the plot.
const SIZE: (u32, u32) = (900, 420);
const LEGEND: u32 = 170;
/// Points per line: more than there are pixels.
const MOST_POINTS: usize = 1200;
/// Lines that a legend has room for.
const MOST_LINES: usize = 16;
/// Told from white as well as from black.
const GREY: RGBColor = RGBColor(128, 128, 128);

/// Lines over time, the legend beside them; the first sixteen.
///
/// # Errors
/// What the library says.
pub fn lines(lines: &[Line<'_>], unit: &str) -> Result<String, String> {
    let mut svg = String::new();
    draw(&mut svg, &lines[..lines.len().min(MOST_LINES)], unit).map_err(|e| e.to_string())?;
    Ok(svg)
}

fn draw(svg: &mut String, lines: &[Line<'_>], unit: &str) -> Result<(), Box<dyn std::error::Error>> {
    let values = || lines.iter().flat_map(|(_, points)| points).filter(|p| p[1].is_finite());
    let (low, high) =
        values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[1]), b.max(p[1])));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let margin = (0.05 * (high - low)).max(1e-6 * high.abs()).max(1e-9);
    let end = values().map(|p| p[0]).fold(0.0, f64::max).max(1e-9);
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    let (left, right) = area.split_horizontally(SIZE.0 - LEGEND);
    let mut chart = ChartBuilder::on(&left)
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
    let text = ("sans-serif", 13).into_font().color(&GREY);
    chart
        .configure_mesh()
        .axis_style(GREY)
        .bold_line_style(GREY.mix(0.3))
        .light_line_style(TRANSPARENT)
        .label_style(text.clone())
        .x_desc("time [s]")
        .y_desc(unit)
        .draw()?;
    for (k, (name, points)) in lines.iter().enumerate() {
        let color = Palette99::pick(k).to_rgba();
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        let own = points.iter().step_by(every).filter(|p| p[1].is_finite()).map(|p| (p[0], p[1]));
        chart.draw_series(LineSeries::new(own, color.stroke_width(2)))?;
        let y = 20 + 22 * k as i32;
        right.draw(&PathElement::new([(4, y), (28, y)], color.stroke_width(3)))?;
        let name: String = name.chars().take(18).collect();
        right.draw(&Text::new(name, (36, y - 7), text.clone()))?;
    }
    area.present()?;
    Ok(())
}
