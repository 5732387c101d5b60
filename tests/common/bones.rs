//! Bodies with rigid cores.

use super::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

pub const BONE: u32 = 1;

/// A bar of 20 × 4 × 4 cm with a core of 10 × 2 × 2 cm.
pub fn bar(modulus: f64) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.02, 0.02), [20, 4, 4])
        .regions(|[x, y, z]| BONE * u32::from(x.abs() < 0.05 && y.abs() < 0.01 && z.abs() < 0.01))
        .material(DeformableMaterial::new(modulus, 0.4).density(1_100.0).mass_damping(0.0))
        .can_sleep(false)
}

/// The largest change of a distance between vertices, over the longest.
pub fn distortion(body: &DeformableBody, vertices: &[usize]) -> f64 {
    if vertices.is_empty() {
        return 0.0;
    }
    let x: Vec<[f64; 3]> = vertices.iter().map(|&v| body.position(v).unwrap()).collect();
    let at_rest: Vec<[f64; 3]> = vertices.iter().map(|&v| body.model().rest_position(v)).collect();
    let length = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let (mut worst, mut longest) = (0.0f64, 0.0f64);
    for i in 0..x.len() {
        for j in 0..i {
            let l = length(&at_rest[i], &at_rest[j]);
            (worst, longest) = (worst.max((length(&x[i], &x[j]) - l).abs()), longest.max(l));
        }
    }
    worst / longest
}

/// Elastic, kinetic and of height \[J\].
pub fn energy_of_all(own: &DeformableBody, rigid: &[&RigidBody]) -> f64 {
    let weight = |body: &&RigidBody| f64::from(body.mass()) * f64::from(body.center_of_mass().y);
    let kinetic: f64 = rigid.iter().map(|body| f64::from(body.kinetic_energy())).sum();
    let height = rigid.iter().map(weight).sum::<f64>();
    total_energy(own) + kinetic + G * height
}

pub fn attached(body: &DeformableBody) -> Vec<usize> {
    let on = |c: f64, half: f64| c.abs() < half + 1e-6;
    at_rest_where(body, |[x, y, z]| on(x, 0.05) && on(y, 0.01) && on(z, 0.01))
}
