//! Closed triangle surfaces to be filled.

#![allow(dead_code)] // Each of its users needs a part.

use rapier3d::math::Vector;
use rapier3d::parry::glamx::{EulerRot, Rot3};
use rapier3d::parry::shape::Ball;
use rapier3d::parry::transformation::convex_hull;
use std::collections::HashMap;

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

/// Corners of a hole of the bracket; a multiple of four.
const ROUND: usize = 32;

/// An angle bracket as of a drawing: legs of 1 and 0.8 m, 0.2 m thick and 0.6 m wide, with a hole of 0.3 m through each.
pub fn bracket() -> Triangles {
    let profile = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.2], [0.2, 0.2], [0.2, 0.8], [0.0, 0.8]];
    let at = |k: usize, z: f32| Vector::new(profile[k % 6][0], profile[k % 6][1], z);
    let mut soup = Vec::new();
    for quad in [[0, 1, 2, 3], [0, 3, 4, 5]] {
        let [a, b, c, d] = quad.map(|k| at(k, 0.0));
        soup.extend([[a, c, b], [a, d, c]]);
        let [a, b, c, d] = quad.map(|k| at(k, 0.6));
        soup.extend([[a, b, c], [a, c, d]]);
    }
    for k in 0..6 {
        let corners = [at(k, 0.0), at(k + 1, 0.0), at(k + 1, 0.6), at(k, 0.6)];
        let [a, b, c, d] = corners;
        match k {
            0 | 2 | 3 | 5 => add_plate(&mut soup, corners, &rim(k)),
            _ => soup.extend([[a, b, c], [a, c, d]]),
        }
    }
    for (one, other) in [(0, 2), (5, 3)] {
        let (near, far) = (rim(one), rim(other));
        for i in 0..ROUND {
            // The other's goes round the other way.
            let across = |i: usize| far[(2 * ROUND + ROUND / 2 - i) % ROUND];
            let (a, b) = (near[i], near[(i + 1) % ROUND]);
            soup.extend([[a, b, across(i + 1)], [a, across(i + 1), across(i)]]);
        }
    }
    indexed(&soup)
}

/// Where a hole leaves the bracket on the face over an edge of its profile, around as seen from outside.
fn rim(edge: usize) -> [Vector; ROUND] {
    let forward = if edge == 0 || edge == 3 { 1.0 } else { -1.0 };
    std::array::from_fn(|i| {
        // By quarters, so that what is opposite has the same bits.
        let part = |i: usize| (i % (ROUND / 4)) as f32 * std::f32::consts::TAU / ROUND as f32;
        let (sin, cos) = part(i).sin_cos();
        let [u, v] = [[cos, sin], [-sin, cos], [-cos, -sin], [sin, -cos]][i / (ROUND / 4)];
        let [along, z] = [forward * u, v].map(|c| 0.15 * c + 0.0);
        match edge {
            0 => Vector::new(0.6 + along, 0.0, 0.3 + z),
            2 => Vector::new(0.6 + along, 0.2, 0.3 + z),
            3 => Vector::new(0.2, 0.5 + along, 0.3 + z),
            _ => Vector::new(0.0, 0.5 + along, 0.3 + z),
        }
    })
}

/// A rectangle with a hole in it, both around as seen from outside.
fn add_plate(soup: &mut Vec<[Vector; 3]>, corners: [Vector; 4], rim: &[Vector; ROUND]) {
    for i in 0..ROUND {
        // The first quarter looks to the third corner.
        let corner = |i: usize| corners[(i / (ROUND / 4) + 2) % 4];
        let (a, b) = (rim[i], rim[(i + 1) % ROUND]);
        soup.push([corner(i), b, a]);
        if i % (ROUND / 4) == 0 {
            soup.push([corner(i + 3 * ROUND / 4), corner(i), a]);
        }
    }
}

/// Triangles whose corners are the same where they have the same bits.
fn indexed(soup: &[[Vector; 3]]) -> Triangles {
    let (mut vertices, mut places) = (Vec::new(), HashMap::new());
    let mut place = |v: &Vector| {
        *places.entry(v.to_array().map(f32::to_bits)).or_insert_with(|| {
            vertices.push(*v);
            vertices.len() as u32 - 1
        })
    };
    let triangles = soup.iter().map(|corners| [0, 1, 2].map(|k| place(&corners[k]))).collect();
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
