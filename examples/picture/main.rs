//! Draws the picture at the head of the README: `cargo run --release --example picture`.
//!
//! A stack falls, is pressed by the impact, and lies at rest: three moments of one run, side by side. Arrows are the forces
//! that carry the soft bodies from below. Writes `docs/picture.png`, or the path it is given.

mod render;
mod scene;

use rapier3d::prelude::Vector;
use render::{Camera, Soup, render};
use scene::Stack;
use std::error::Error;

/// When the stack is drawn \[s\].
const MOMENTS: [f32; 3] = [0.04, 0.175, 2.5];
const APART: f32 = 0.74;
const SIZE: [usize; 2] = [1200, 460];

fn main() -> Result<(), Box<dyn Error>> {
    let (mut solids, mut arrows) = (Soup::default(), Soup::default());
    let mut stack = Stack::new()?;
    let mut now = 0.0;
    for (i, moment) in MOMENTS.into_iter().enumerate() {
        stack.run(moment - now);
        now = moment;
        println!("{now:.2} s: fastest vertex {:.1e} m/s", stack.speed());
        stack.draw(Vector::X * APART * (i as f32 - 1.0), &mut solids, &mut arrows);
    }
    let camera =
        Camera { eye: Vector::new(0.0, 1.9, 5.0), target: Vector::new(0.0, 0.345, 0.0), half_height: 0.43 };
    let pixels = render(&solids, &arrows, &camera, SIZE);
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/docs/picture.png").into());
    let file = std::io::BufWriter::new(std::fs::File::create(&path)?);
    let mut encoder = png::Encoder::new(file, SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&pixels)?;
    println!("written to {path}");
    Ok(())
}
