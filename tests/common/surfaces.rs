//! Closed triangle surfaces to be filled.

#![allow(dead_code)] // Each of its users needs a part.

use rapier3d::math::Vector;
use rapier3d::parry::glamx::{EulerRot, Rot3};
use rapier3d::parry::shape::Ball;
use rapier3d::parry::transformation::convex_hull;

/// Vertices \[m\] and triangles.
pub type Triangles = (Vec<Vector>, Vec<[u32; 3]>);

/// A surface turned about its origin \[rad\].
pub fn turned((mut vertices, triangles): Triangles, angles: [f32; 3]) -> Triangles {
    let turn = Rot3::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
    vertices.iter_mut().for_each(|v| *v = turn * *v);
    (vertices, triangles)
}

/// Both surfaces in one, the second moved and perhaps turned inside out.
pub fn joined(a: Triangles, b: Triangles, shift: Vector, inside_out: bool) -> Triangles {
    let (mut vertices, mut triangles) = a;
    let first = vertices.len() as u32;
    vertices.extend(b.0.iter().map(|v| *v + shift));
    let order = |[p, q, r]: [u32; 3]| if inside_out { [p, r, q] } else { [p, q, r] };
    triangles.extend(b.1.iter().map(|t| order(t.map(|v| v + first))));
    (vertices, triangles)
}

/// Radii of 0.5 and 0.2 m.
pub fn torus() -> Triangles {
    let (around, through) = (64u32, 32u32);
    let angle = |k: u32, n: u32| k as f32 / n as f32 * std::f32::consts::TAU;
    let point = |k: u32| {
        let (a, b) = (angle(k / through, around), angle(k % through, through));
        let radius = 0.5 + 0.2 * b.cos();
        Vector::new(radius * a.cos(), 0.2 * b.sin(), -radius * a.sin())
    };
    let id = |i: u32, j: u32| i % around * through + j % through;
    let quads = (0..around).flat_map(|i| (0..through).map(move |j| (i, j)));
    let halves =
        |(i, j)| [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]];
    ((0..around * through).map(point).collect(), quads.flat_map(halves).collect())
}

/// A lump with waves and noise, as a scanner sees one.
pub fn lump() -> Triangles {
    let (mut vertices, triangles) = Ball::new(0.5).to_trimesh(64, 32);
    for (k, v) in vertices.iter_mut().enumerate() {
        let noise = ((k as f32 * 12.9898).sin() * 43758.547).fract() * 0.004;
        let waves = 0.2 * (5.0 * v.x).sin() + 0.15 * (7.0 * v.y + 1.0).cos() + 0.1 * (9.0 * v.z).sin();
        *v *= 1.0 + waves + noise;
    }
    (vertices, triangles)
}

/// The hull of twenty points on a sphere.
pub fn hull() -> Triangles {
    let golden = |k: u32| {
        let (angle, y) = (k as f32 * 2.399963, 1.0 - 2.0 * (k as f32 + 0.5) / 20.0);
        let radius = (1.0 - y * y).sqrt();
        Vector::new(radius * angle.cos(), y, radius * angle.sin()) * 0.5
    };
    convex_hull(&(0..20).map(golden).collect::<Vec<_>>())
}

/// Volume \[m³\].
pub fn enclosed((vertices, triangles): &Triangles) -> f64 {
    let volume = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        f64::from(a.dot(b.cross(c))) / 6.0
    };
    triangles.iter().map(volume).sum()
}
