//! A small ray tracer: triangles in one soft light over a floor that runs into the background.

use rapier3d::parry::query::Ray;
use rapier3d::parry::shape::{CompositeShapeRef, TriMesh};
use rapier3d::prelude::*;
use rayon::prelude::*;

/// Colours are linear.
pub type Color = Vector;

/// What a triangle looks like.
#[derive(Clone, Copy)]
pub struct Paint {
    pub color: Color,
    /// Part of the light that the edges of triangles take away.
    pub edges: f32,
}

/// Triangles with their paint.
#[derive(Default)]
pub struct Soup {
    vertices: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
    paints: Vec<Paint>,
}

impl Soup {
    pub fn add(
        &mut self,
        vertices: impl IntoIterator<Item = Vector>,
        triangles: impl IntoIterator<Item = [u32; 3]>,
        paint: Paint,
    ) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.triangles.extend(triangles.into_iter().map(|t| t.map(|v| v + first)));
        self.paints.resize(self.triangles.len(), paint);
    }

    fn build(&self) -> Option<TriMesh> {
        TriMesh::new(self.vertices.clone(), self.triangles.clone()).ok()
    }
}

/// From where, to where, and how far the picture's lower half reaches there.
pub struct Camera {
    pub eye: Vector,
    pub target: Vector,
    pub half_height: f32,
}

/// Background, and the floor where no shadow falls.
const BACKGROUND: Color = Vector::new(0.80, 0.84, 0.89);
const SUN: f32 = 0.80;
const SKY: f32 = 0.42;
/// Toward the middle of the light, and how large it looks from the scene.
const TO_SUN: Vector = Vector::new(-0.42, 0.80, 0.42);
const SUN_RADIUS: f32 = 0.16;
/// Rays per pixel: this squared.
const GRID: usize = 4;
/// Rays to the light, and as many to the sky, per ray of the camera.
const LIGHTS: usize = 2;
/// How much of an arrow shows through what is before it.
const SEEN_THROUGH: f32 = 0.55;

struct Scene<'a> {
    solids: &'a Soup,
    solid: Option<TriMesh>,
    arrows: &'a Soup,
    arrow: Option<TriMesh>,
}

/// Rows of sRGB bytes; arrows shine through what hides them.
pub fn render(solids: &Soup, arrows: &Soup, camera: &Camera, [width, height]: [usize; 2]) -> Vec<u8> {
    let scene = Scene { solids, solid: solids.build(), arrows, arrow: arrows.build() };
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(Vector::Y).normalize();
    let up = right.cross(forward);
    let distance = (camera.target - camera.eye).length();
    let pixel = 2.0 * camera.half_height / height as f32;
    let row = |y: usize| {
        let mut bytes = Vec::with_capacity(3 * width);
        for x in 0..width {
            let mut sum = Vector::ZERO;
            for k in 0..GRID * GRID {
                let inside = |i: usize| (i as f32 + 0.5) / GRID as f32;
                let across = x as f32 + inside(k % GRID) - 0.5 * width as f32;
                let down = y as f32 + inside(k / GRID) - 0.5 * height as f32;
                let toward = forward * distance + right * (across * pixel) - up * (down * pixel);
                let ray = Ray::new(camera.eye, toward.normalize());
                sum += scene.color(&ray, k, pixel / distance);
            }
            bytes.extend((sum / (GRID * GRID) as f32).to_array().map(to_srgb));
        }
        bytes
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

impl Scene<'_> {
    /// What a ray of the camera sees; `spread` is the width of a pixel per distance.
    fn color(&self, ray: &Ray, sample: usize, spread: f32) -> Color {
        let hit = cast(self.solid.as_ref(), ray);
        let reach = hit.map_or(f32::INFINITY, |(_, distance, _)| distance);
        let behind = match hit {
            Some((triangle, distance, normal)) => {
                let at = ray.point_at(distance);
                let normal = if normal.dot(ray.dir) > 0.0 { -normal } else { normal };
                let paint = self.solids.paints[triangle as usize];
                let on_edge = self.edge_distance(triangle, at) < 0.55 * spread * distance;
                let line = if on_edge { 1.0 - paint.edges } else { 1.0 };
                paint.color * line * self.light(at, normal, sample)
            }
            None if ray.dir.y < 0.0 => {
                let at = ray.point_at(-ray.origin.y / ray.dir.y);
                BACKGROUND * (self.light(at, Vector::Y, sample) / (SUN * TO_SUN.normalize().y + SKY))
            }
            None => BACKGROUND,
        };
        match cast(self.arrow.as_ref(), ray) {
            Some((triangle, distance, normal)) => {
                let shade = 0.75 + 0.25 * normal.dot(TO_SUN.normalize()).abs();
                let front = self.arrows.paints[triangle as usize].color * shade;
                behind.lerp(front, if distance < reach { 1.0 } else { SEEN_THROUGH })
            }
            None => behind,
        }
    }

    /// Light of sun and sky that arrives at a point.
    fn light(&self, at: Vector, normal: Vector, sample: usize) -> f32 {
        let origin = at + normal * 1e-4;
        let is_free = |direction: Vector| {
            direction.y <= 0.0
                || !self.solid.as_ref().is_some_and(|solid| {
                    CompositeShapeRef(solid)
                        .cast_local_ray(&Ray::new(origin, direction), 4.0, false)
                        .is_some()
                })
        };
        let sun = TO_SUN.normalize();
        let mut light = 0.0;
        for k in 0..LIGHTS {
            let [u, v] = quasi_random(sample * LIGHTS + k);
            let toward = (sun + on_disk(sun, u, v) * SUN_RADIUS).normalize();
            if normal.dot(toward) > 0.0 && is_free(toward) {
                light += SUN * normal.dot(toward);
            }
            // Cosine-weighted; what points below the horizon sees the bright floor.
            let [u, v] = quasi_random(sample * LIGHTS + k + 1000);
            let spread = on_disk(normal, u, v);
            let toward = spread + normal * (1.0 - spread.length_squared()).max(0.0).sqrt();
            if is_free(toward) {
                light += if toward.y > 0.0 { SKY } else { 0.6 * SKY };
            }
        }
        light / LIGHTS as f32
    }

    fn edge_distance(&self, triangle: u32, at: Vector) -> f32 {
        let corners = self.solids.triangles[triangle as usize].map(|v| self.solids.vertices[v as usize]);
        let side = |k: usize| {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            (at - from).cross((to - from).normalize()).length()
        };
        side(0).min(side(1)).min(side(2))
    }
}

/// Triangle, distance and unit normal of the first hit.
fn cast(mesh: Option<&TriMesh>, ray: &Ray) -> Option<(u32, f32, Vector)> {
    let (triangle, hit) = CompositeShapeRef(mesh?).cast_local_ray_and_get_normal(ray, f32::MAX, false)?;
    Some((triangle, hit.time_of_impact, hit.normal))
}

/// A point on the unit disk across an axis.
fn on_disk(axis: Vector, u: f32, v: f32) -> Vector {
    let side = axis.any_orthonormal_vector();
    let (radius, angle) = (u.sqrt(), std::f32::consts::TAU * v);
    (side * angle.cos() + axis.cross(side) * angle.sin()) * radius
}

/// Evenly spread over the square [Roberts 2018]; the same in every pixel, so that surfaces have no grain.
fn quasi_random(index: usize) -> [f32; 2] {
    [0.754_877_7, 0.569_840_3].map(|step: f64| ((0.5 + step * index as f64) % 1.0) as f32)
}

fn to_srgb(linear: f32) -> u8 {
    (255.0 * linear.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8
}
