//! Histograms of dihedral angles.

use crate::Filled;
use plotters::prelude::*;
use std::error::Error;
use std::path::Path;

/// Of a bar \[°\].
const WIDTH: usize = 5;
const SIZE: (u32, u32) = (1220, 520);
const BLUE: RGBColor = RGBColor(0, 114, 178);

/// One panel for each mesh.
pub fn draw(meshes: &[Filled], path: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    for (panel, filled) in root.split_evenly((2, 4)).iter().zip(meshes) {
        let mut parts = [0.0; 180 / WIDTH];
        let each = 100.0 / (6 * filled.mesh.tetrahedra().len()) as f64;
        filled.mesh.dihedral_angles().for_each(|a| parts[(a as usize / WIDTH).min(180 / WIDTH - 1)] += each);
        let mut chart = ChartBuilder::on(panel)
            .caption(filled.name, ("sans-serif", 17))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(44)
            .build_cartesian_2d(0.0..180.0, 0.0..40.0)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(7)
            .y_labels(5)
            .x_label_formatter(&|a| format!("{a:.0}"))
            .y_label_formatter(&|p| format!("{p:.0}"))
            .x_desc("dihedral angle [°]")
            .y_desc("part [%]")
            .draw()?;
        chart.draw_series(parts.iter().enumerate().filter(|(_, part)| **part > 0.0).map(|(k, part)| {
            let (left, right) = ((k * WIDTH) as f64, ((k + 1) * WIDTH) as f64);
            Rectangle::new([(left, 0.0), (right, *part)], BLUE.filled())
        }))?;
    }
    root.present()?;
    Ok(())
}
