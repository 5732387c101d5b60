//! Pictures of a replay as files: PNG and GIF.

pub use foible_replay::{Film, Look};
use std::path::Path;

/// Writes the picture nearest to a time \[s\].
///
/// # Errors
/// A file that cannot be written.
pub fn write_png(film: &Film<'_>, path: &Path, time: f64) -> Result<(), String> {
    let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let file = std::fs::File::create(path).map_err(|e| said(&e))?;
    let [width, height] = film.size().map(|side| side as u32);
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(|e| said(&e))?;
    writer.write_image_data(&film.picture(time)).map_err(|e| said(&e))
}

/// Writes all pictures as a film that repeats.
///
/// # Errors
/// A file that cannot be written.
pub fn write_gif(film: &Film<'_>, path: &Path) -> Result<(), String> {
    let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let file = std::fs::File::create(path).map_err(|e| said(&e))?;
    let [width, height] = film.size().map(|side| side as u16);
    let mut encoder =
        gif::Encoder::new(std::io::BufWriter::new(file), width, height, &[]).map_err(|e| said(&e))?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| said(&e))?;
    for frame in &film.replay().frames {
        let mut picture = gif::Frame::from_rgb_speed(width, height, &film.picture(frame.time), 10);
        picture.delay = (100.0 / film.replay().rate).round().max(2.0) as u16;
        encoder.write_frame(&picture).map_err(|e| said(&e))?;
    }
    Ok(())
}
