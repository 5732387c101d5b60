//! Error against time, one panel per scene, drawn from the CSV: of positions, and below them of contact forces.

use crate::labels::{Area, Labels};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::error::Error;
use std::path::Path;

const PANELS: [&str; 9] = [
    "sagging cantilever",
    "swinging cantilever",
    "drop and rest",
    "cloth at rest",
    "landing",
    "resting",
    "sliding",
    "grasping",
    "piling",
];
/// From this one on the error is that of contact forces.
const FIRST_CONTACT: usize = 4;

/// Families in the order of their colours (Okabe and Ito's, told apart by the colour-blind too).
const FAMILIES: [(&str, RGBColor); 9] = [
    ("rest stiffness", RGBColor(0, 114, 178)),
    ("Laplacian", RGBColor(0, 158, 115)),
    ("Gauss–Seidel", RGBColor(204, 121, 167)),
    ("Jacobi", RGBColor(170, 130, 60)),
    ("Newton", RGBColor(230, 159, 0)),
    ("contact at Game", RGBColor(0, 114, 178)),
    ("contact at Engineering", RGBColor(230, 159, 0)),
    ("preset", RGBColor(0, 0, 0)),
    ("rapier", RGBColor(200, 30, 30)),
];

/// Errors below this are drawn at it.
const LEAST: f64 = 1.0e-7;

/// Of the whole picture, as wide as GitHub shows it, and of its frames \[px\].
const SIZE: (u32, u32) = (920, 784 + 3 * 394);
const FRAME: [f64; 2] = [312.0, 304.0];
const LEGEND_X: i32 = 782;

const GREY: RGBColor = RGBColor(90, 90, 90);

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn Error>>;

/// A line of the CSV as far as it is drawn.
struct Point {
    scene: String,
    family: usize,
    name: String,
    ms: f64,
    error: f64,
}

/// Draws `trade.csv`.
pub fn draw(csv: &Path, path: &Path) -> Drawn {
    let points = read(&std::fs::read_to_string(csv)?)?;
    let canvas = SVGBackend::new(path, SIZE).into_drawing_area();
    canvas.fill(&WHITE)?;
    for (i, scene) in PANELS.iter().enumerate() {
        let own: Vec<&Point> = points.iter().filter(|p| p.scene == *scene && p.error.is_finite()).collect();
        let low = [70.0 + 376.0 * (i % 2) as f64, 36.0 + 394.0 * (i / 2) as f64];
        let panel = Panel::new(Area { low, high: [low[0] + FRAME[0], low[1] + FRAME[1]] }, &own);
        let title = if i < FIRST_CONTACT { "error" } else { "error of contact forces" };
        panel.draw_axes(&canvas, scene, title)?;
        panel.draw_points(&canvas, &own)?;
    }
    let is_contact = |family: &str| family.starts_with("contact");
    let solvers = FAMILIES.iter().filter(|(family, _)| !is_contact(family)).collect::<Vec<_>>();
    let notes = ["Points along a line:", "more iterations.", "", "Down and to the", "left is better."];
    draw_legend(&canvas, 44.0, &solvers, &notes)?;
    let contact = FAMILIES.iter().filter(|(family, _)| is_contact(family) || is_named(family));
    let notes = ["Along a line: contact", "tolerance from 0.1", "to 1e-10."];
    draw_legend(&canvas, 44.0 + 2.0 * 394.0, &contact.collect::<Vec<_>>(), &notes)?;
    canvas.present()?;
    Ok(())
}

/// The lines of families that are drawn.
fn read(csv: &str) -> Result<Vec<Point>, Box<dyn Error>> {
    let mut points = Vec::new();
    for line in csv.lines().skip(1) {
        // scene, engine, setting, tets, dt, ms, worst, error and three more; settings may hold commas.
        let fields: Vec<&str> = line.split(',').collect();
        let [scene, _, setting @ .., _, _, ms, _, error, _, force, _] = &fields[..] else {
            return Err(format!("not a line of this bench: {line}").into());
        };
        let setting = setting.join(",");
        let named = |(i, (family, _)): (usize, &(&str, RGBColor))| Some((i, name_in(&setting, family)?));
        let Some((family, name)) = FAMILIES.iter().enumerate().find_map(named) else {
            continue;
        };
        let is_contact = PANELS[FIRST_CONTACT..].contains(scene);
        let (ms, error) = (ms.parse()?, if is_contact { force } else { error }.parse()?);
        points.push(Point { scene: scene.to_string(), family, name: name.into(), ms, error });
    }
    Ok(points)
}

/// The rest of a setting's name behind its family's.
fn name_in<'a>(setting: &'a str, family: &str) -> Option<&'a str> {
    setting.strip_prefix(family)?.strip_prefix(' ')
}

/// Axes in pixels.
struct Panel {
    frame: Area,
    /// Decimal logarithms at the lower left and the upper right corner: milliseconds, error.
    low: [f64; 2],
    high: [f64; 2],
}

impl Panel {
    fn new(frame: Area, points: &[&Point]) -> Self {
        let times = || points.iter().map(|p| p.ms.log10());
        let (first, last) =
            (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let top = points.iter().map(|p| p.error.log10()).fold(0.0, f64::max);
        Self { frame, low: [first - 0.15, LEAST.log10() - 0.35], high: [last + 0.15, top + 0.35] }
    }

    fn pixel(&self, log: [f64; 2]) -> [f64; 2] {
        let part = [0, 1].map(|k| (log[k] - self.low[k]) / (self.high[k] - self.low[k]));
        let (low, high) = (self.frame.low, self.frame.high);
        [low[0] + part[0] * (high[0] - low[0]), high[1] - part[1] * (high[1] - low[1])]
    }

    fn at(&self, point: &Point) -> [f64; 2] {
        self.pixel([point.ms.log10(), point.error.max(LEAST).log10()])
    }

    fn draw_axes(&self, canvas: &Canvas, scene: &str, error: &str) -> Drawn {
        let Area { low, high } = self.frame;
        let middle = self.frame.center();
        text(canvas, scene, [middle[0], low[1] - 14.0], (18, &BLACK), HPos::Center)?;
        text(canvas, "milliseconds per step", [middle[0], high[1] + 36.0], (15, &GREY), HPos::Center)?;
        let upright = style(15, &GREY, HPos::Center).transform(FontTransform::Rotate270);
        canvas.draw(&Text::new(error, whole([low[0] - 52.0, middle[1]]), upright))?;
        for exponent in self.low[0].floor() as i32..=self.high[0].ceil() as i32 {
            for digit in [1.0, 2.0, 5.0] {
                let value = digit * 10f64.powi(exponent);
                if value.log10() < self.low[0] || value.log10() > self.high[0] {
                    continue;
                }
                let x = self.pixel([value.log10(), 0.0])[0];
                line(canvas, [x, low[1]], [x, high[1]], BLACK.mix(if digit == 1.0 { 0.18 } else { 0.07 }))?;
                text(canvas, &format!("{value}"), [x, high[1] + 15.0], (15, &GREY), HPos::Center)?;
            }
        }
        for exponent in self.low[1].ceil() as i32..=self.high[1].floor() as i32 {
            let y = self.pixel([0.0, f64::from(exponent)])[1];
            line(canvas, [low[0], y], [high[0], y], BLACK.mix(0.1))?;
            let lowest = if 10f64.powi(exponent) <= LEAST * 1.001 { "≤ " } else { "" };
            let label = format!("{lowest}10{}", superscript(exponent));
            text(canvas, &label, [low[0] - 7.0, y], (15, &GREY), HPos::Right)?;
        }
        canvas.draw(&Rectangle::new([whole(low), whole(high)], GREY.stroke_width(1)))?;
        Ok(())
    }

    fn draw_points(&self, canvas: &Canvas, points: &[&Point]) -> Drawn {
        let markers = points.iter().map(|p| Area::around(self.at(p), [6.0; 2])).collect();
        let Area { low, high } = self.frame;
        let inner = Area { low: low.map(|c| c + 4.0), high: high.map(|c| c - 4.0) };
        let mut labels = Labels { frame: inner, markers, lines: Vec::new(), placed: Vec::new() };
        for (family, (name, color)) in FAMILIES.iter().enumerate() {
            let own: Vec<_> = points.iter().filter(|p| p.family == family).map(|p| self.at(p)).collect();
            if !is_named(name) {
                labels.lines.extend(own.windows(2).map(|w| [w[0], w[1]]));
                let path = own.iter().map(|&at| whole(at)).collect::<Vec<_>>();
                canvas.draw(&PathElement::new(path, color.stroke_width(2)))?;
            }
        }
        for (family, (name, _)) in FAMILIES.iter().enumerate() {
            for at in points.iter().filter(|p| p.family == family).map(|p| self.at(p)) {
                marker(canvas, at, name)?;
            }
        }
        for point in points.iter().filter(|p| is_named(FAMILIES[p.family].0)) {
            let (_, color) = FAMILIES[point.family];
            draw_name(canvas, &mut labels, self.at(point), &point.name, &color)?;
        }
        Ok(())
    }
}

fn draw_name(canvas: &Canvas, labels: &mut Labels, at: [f64; 2], name: &str, color: &RGBColor) -> Drawn {
    // Letters of a sans-serif are about 0.6 of the size of the font wide, here 15 / 1.24.
    let half = [0.5 * 7.3 * name.chars().count() as f64 + 2.0, 8.0];
    let area = labels.place(at, half);
    let nearest = [0, 1].map(|k| at[k].clamp(area.low[k], area.high[k]));
    if (nearest[0] - at[0]).hypot(nearest[1] - at[1]) > 14.0 {
        line(canvas, at, nearest, color.mix(0.5))?;
    }
    canvas.draw(&Rectangle::new([whole(area.low), whole(area.high)], WHITE.mix(0.75).filled()))?;
    text(canvas, name, area.center(), (15, color), HPos::Center)
}

/// Points that carry their names: no line joins them.
fn is_named(family: &str) -> bool {
    matches!(family, "preset" | "rapier")
}

fn draw_legend(canvas: &Canvas, top: f64, families: &[&(&str, RGBColor)], notes: &[&str]) -> Drawn {
    let (x, mut y) = (f64::from(LEGEND_X), top);
    for (family, color) in families {
        if is_named(family) {
            y += 6.0;
        } else {
            line(canvas, [x, y], [x + 24.0, y], color.mix(1.0))?;
        }
        marker(canvas, [x + 12.0, y], family)?;
        // The margin is narrow.
        for (k, part) in family.split_inclusive(" at ").enumerate() {
            y += 16.0 * k as f64;
            text(canvas, part.trim_end(), [x + 32.0, y], (16, &BLACK), HPos::Left)?;
        }
        y += 22.0;
    }
    for note in notes {
        y += 17.0;
        text(canvas, note, [x, y], (14, &GREY), HPos::Left)?;
    }
    Ok(())
}

/// Dots; of presets diamonds, of rapier triangles.
fn marker(canvas: &Canvas, at: [f64; 2], family: &str) -> Drawn {
    let color = FAMILIES.iter().find(|(name, _)| *name == family).map_or(BLACK, |(_, color)| *color);
    let corners: &[[f64; 2]] = match family {
        "preset" => &[[0.0, -6.5], [6.5, 0.0], [0.0, 6.5], [-6.5, 0.0]],
        "rapier" => &[[0.0, -6.5], [6.5, 5.0], [-6.5, 5.0]],
        _ => &[],
    };
    if corners.is_empty() {
        canvas.draw(&Circle::new(whole(at), 4, color.filled()))?;
    } else {
        let corners = corners.iter().map(|c| whole([at[0] + c[0], at[1] + c[1]])).collect::<Vec<_>>();
        canvas.draw(&Polygon::new(corners, color.filled()))?;
    }
    Ok(())
}

fn line(canvas: &Canvas, from: [f64; 2], to: [f64; 2], color: RGBAColor) -> Drawn {
    canvas.draw(&PathElement::new([whole(from), whole(to)], color.stroke_width(1)))?;
    Ok(())
}

fn text(canvas: &Canvas, text: &str, at: [f64; 2], (size, color): (i32, &RGBColor), side: HPos) -> Drawn {
    canvas.draw(&Text::new(text, whole(at), style(size, color, side)))?;
    Ok(())
}

fn style<'a>(size: i32, color: &'a RGBColor, side: HPos) -> TextStyle<'a> {
    ("sans-serif", size).into_font().color(color).pos(Pos::new(side, VPos::Center))
}

fn whole(at: [f64; 2]) -> (i32, i32) {
    (at[0].round() as i32, at[1].round() as i32)
}

fn superscript(exponent: i32) -> String {
    let raised = |c| {
        if c == '-' {
            '⁻'
        } else {
            "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c as usize - '0' as usize).unwrap_or(c)
        }
    };
    exponent.to_string().chars().map(raised).collect()
}
