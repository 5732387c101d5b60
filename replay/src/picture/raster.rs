//! Triangles with a depth buffer.

use super::camera::Camera;
use rapier3d::prelude::*;

/// The colours of [`Paint::Heat`] from none to one, linear: those of the player, blue, green, yellow and red.
const HEAT: [[f32; 3]; 4] = [[0.07, 0.21, 0.46], [0.21, 0.55, 0.36], [0.89, 0.64, 0.07], [0.69, 0.06, 0.02]];

/// What a triangle is painted with.
#[derive(Clone, Copy)]
pub(super) enum Paint {
    /// One linear colour.
    Plain([f32; 3]),
    /// A share of a scale at each corner, 0 to 1.
    Heat([f32; 3]),
}

impl Paint {
    /// The colour of a point that has these parts of the corners.
    fn at(&self, parts: [f32; 3]) -> [f32; 3] {
        let shares = match self {
            Self::Plain(color) => return *color,
            Self::Heat(shares) => shares,
        };
        let share = shares.iter().zip(parts).map(|(s, part)| s * part).sum::<f32>().clamp(0.0, 1.0);
        let place = share * (HEAT.len() - 1) as f32;
        let k = (place as usize).min(HEAT.len() - 2);
        let t = place - k as f32;
        [0, 1, 2].map(|c| HEAT[k][c] * (1.0 - t) + HEAT[k + 1][c] * t)
    }
}

/// Linear colours and depths.
pub(super) struct Raster {
    width: usize,
    height: usize,
    colors: Vec<[f32; 3]>,
    /// One over the distance: linear in the picture.
    nearness: Vec<f32>,
}

impl Raster {
    pub fn new(width: usize, height: usize, background: [f32; 3]) -> Self {
        Self { width, height, colors: vec![background; width * height], nearness: vec![0.0; width * height] }
    }

    /// Draws a triangle, lit on both sides.
    pub fn triangle(&mut self, camera: &Camera, corners: [Vector; 3], paint: Paint) {
        if corners.iter().any(|corner| !corner.is_finite()) {
            return;
        }
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let toward = if normal.dot(camera.eye - corners[0]) < 0.0 { -normal } else { normal };
        let light = 0.42 + 0.58 * toward.dot(camera.to_light).max(0.0);
        let seen = camera.before_the_eye(corners.map(|corner| camera.frame(corner)));
        // What reaches behind the eye has one colour: its corners are others.
        let is_whole = corners.iter().all(|corner| camera.is_before_the_eye(*corner));
        let paint = if is_whole { paint } else { Paint::Plain(paint.at([1.0 / 3.0; 3])) };
        for k in 1..seen.len().saturating_sub(1) {
            self.fill([seen[0], seen[k], seen[k + 1]].map(Camera::projected), paint, light);
        }
    }

    fn fill(&mut self, seen: [[f32; 3]; 3], paint: Paint, light: f32) {
        let half = self.height as f32 * 0.5;
        let [a, b, c] = seen.map(|[x, y, _]| [self.width as f32 * 0.5 + x * half, half - y * half]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            return;
        }
        let range = |k: usize, most: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            (low.floor().max(0.0) as usize).min(most)..(high.ceil().max(0.0) as usize).min(most)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let p = [x as f32 + 0.5, y as f32 + 0.5];
                let part = |u: [f32; 2], v: [f32; 2]| {
                    ((u[0] - p[0]) * (v[1] - p[1]) - (u[1] - p[1]) * (v[0] - p[0])) / area
                };
                let parts = [part(b, c), part(c, a), part(a, b)];
                if parts.iter().any(|part| *part < 0.0) {
                    continue;
                }
                let nearness = parts.iter().zip(&seen).map(|(part, s)| part / s[2]).sum::<f32>();
                let at = y * self.width + x;
                if nearness > self.nearness[at] {
                    let near = [0, 1, 2].map(|k| parts[k] / seen[k][2] / nearness);
                    (self.nearness[at], self.colors[at]) = (nearness, paint.at(near).map(|c| c * light));
                }
            }
        }
    }

    /// sRGB bytes, so many samples along each side of a pixel averaged.
    pub fn bytes(&self, samples: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        for y in 0..self.height / samples {
            for x in 0..self.width / samples {
                let mut sum = [0.0; 3];
                for k in 0..samples * samples {
                    let at = (y * samples + k / samples) * self.width + x * samples + k % samples;
                    sum.iter_mut().zip(self.colors[at]).for_each(|(sum, c)| *sum += c);
                }
                bytes.extend(sum.map(|c| to_srgb(c / (samples * samples) as f32)));
            }
        }
        bytes
    }
}

fn to_srgb(linear: f32) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let c = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (c * 255.0).round() as u8
}
