//! The adjoint of the wind: its forces are a function of where a step begins, and how fast.
//!
//! A plate of area A and normal n has the force `A (d|s|s n + f|t|t)` on its nodes, `w = n s + t` the air's velocity through it, a segment
//! of length l and diameter D `D l d|t|t`, t across it. Their virtual work along u, and what is per unit of the coefficient that bounds
//! what light nodes take, κ, are differentiated by hand.

use super::gradient::WindGradient;
use super::record::BodyRecord;
use super::spin::Cotangents;
use crate::body::{DeformableWind, Panel, Push, is_pushed, panels};
use crate::fem::DeformableModel;
use crate::math::Vec3;

/// The wind of a step.
#[derive(Clone, Debug)]
pub(super) struct WindRecord {
    pub wind: DeformableWind,
    /// At the start.
    pub push: Push,
}

/// What is asked of a plate or a segment: along its force \[N\], and per kg/s.
#[derive(Clone, Copy)]
struct Asked {
    along: Vec3,
    per_coefficient: f64,
}

/// Derivatives with respect to the air's velocity through a plate or a segment and to its edges from the first node, and per coefficient.
struct Answer {
    through: Vec3,
    edges: [Vec3; 2],
    coefficients: [f64; 2],
}

impl WindRecord {
    /// Force on a node of this mass \[N\].
    pub fn force(&self, node: usize, mass: f64, h: f64) -> Vec3 {
        self.push.forces[node] * (mass / self.push.divisor(node, mass, h))
    }

    /// Adds to the derivatives with respect to the start and the masses what those with respect to forces on nodes say by the wind.
    pub fn back(
        &self,
        model: &DeformableModel,
        record: &BodyRecord,
        masses: &[f64],
        of: &mut Cotangents,
    ) -> WindGradient {
        let asked = self.asked(record.h, masses, of);
        let [drag, friction] = self.wind.pressures();
        let (mut of_air, mut of_pressures) = (Vec3::zeros(), [0.0; 2]);
        for panel in panels(model, &record.x_start) {
            let through = self.wind.through(&panel, &record.v_start);
            let nodes = panel.nodes();
            let share = 1.0 / nodes.len() as f64;
            let all = nodes.iter().map(|&n| asked[n as usize]);
            let ask = Asked {
                along: all.clone().map(|own| own.along).sum::<Vec3>() * share,
                per_coefficient: all.map(|own| own.per_coefficient).sum::<f64>() * share,
            };
            let answer = match panel {
                Panel::Plate { edges, is_solid, .. } => {
                    plate(edges, through, [drag, friction], |s| is_pushed(is_solid, s), ask)
                }
                Panel::Segment { edge, diameter, .. } => segment(edge, through, drag, diameter, ask),
            };
            let Some(answer) = answer else { continue };
            of_air += answer.through;
            nodes.iter().for_each(|&n| of.v_start[n as usize] -= answer.through * share);
            for (&n, edge) in nodes[1..].iter().zip(answer.edges) {
                of.x_start[n as usize] += edge;
                of.x_start[nodes[0] as usize] -= edge;
            }
            of_pressures.iter_mut().zip(answer.coefficients).for_each(|(sum, own)| *sum += own);
        }
        self.gradient(of_air, of_pressures)
    }

    /// What those with respect to [`DeformableWind::pressures`] say of what these are of; what is below zero counts as zero.
    fn gradient(&self, of_air: Vec3, [of_drag, of_friction]: [f64; 2]) -> WindGradient {
        let wind = &self.wind;
        let [density, drag, friction] = [wind.density, wind.drag, wind.friction].map(|c| c.max(0.0));
        let unless_negative = |c: f64, of: f64| if c < 0.0 { 0.0 } else { 0.5 * of };
        WindGradient {
            velocity: of_air.into(),
            density: unless_negative(wind.density, drag * of_drag + friction * of_friction),
            drag: unless_negative(wind.drag, density * of_drag),
            friction: unless_negative(wind.friction, density * of_friction),
        }
    }

    /// What the forces on nodes say of the push on them: `m F/(h c)` where that is light.
    fn asked(&self, h: f64, masses: &[f64], of: &mut Cotangents) -> Vec<Asked> {
        let (forces, coefficients) = (&self.push.forces, &self.push.coefficients);
        let ask = |(n, along): (usize, &Vec3)| {
            let (mass, most) = (masses[n], h * coefficients[n]);
            if mass >= most {
                return Asked { along: *along, per_coefficient: 0.0 };
            }
            let by_mass = along.dot(&forces[n]) / most;
            of.masses[n] += by_mass;
            Asked { along: along * (mass / most), per_coefficient: -by_mass * mass / coefficients[n] }
        };
        of.forces.iter().enumerate().map(ask).collect()
    }
}

/// A triangle by its edges from the first node.
fn plate(
    [b, c]: [Vec3; 2],
    through: Vec3,
    [drag, friction]: [f64; 2],
    is_pushed: impl Fn(f64) -> bool,
    Asked { along: u, per_coefficient }: Asked,
) -> Option<Answer> {
    let across = b.cross(&c);
    let length = across.norm();
    let normal = (length > 0.0).then(|| across / length)?;
    let (area, s) = (0.5 * length, through.dot(&normal));
    let slip = through - normal * s;
    let (speed, direction) = (slip.norm(), slip.try_normalize(0.0).unwrap_or_default());
    let is_faced = f64::from(u8::from(is_pushed(s)));
    let drag = drag * is_faced;
    // The coefficient of a plate is the larger of the two.
    let by_drag = drag * s.abs() >= friction * speed;
    let [k, l] = if by_drag { [per_coefficient, 0.0] } else { [0.0, per_coefficient] };
    let per_drag = s.abs() * (s * u.dot(&normal) + k) * is_faced;
    let per_friction = speed * (slip.dot(&u) + l);
    let of_s = drag * (2.0 * s.abs() * u.dot(&normal) + k * s.signum());
    let of_slip = (u * speed + direction * (slip.dot(&u) + l)) * friction;
    let of_normal =
        (through * of_s) + u * (drag * s.abs() * s) - through * normal.dot(&of_slip) - of_slip * s;
    let flat = |v: &Vec3| v - normal * normal.dot(v);
    let of_area = drag * per_drag + friction * per_friction;
    let of_across = (normal * of_area + flat(&of_normal)) * 0.5;
    Some(Answer {
        through: (normal * of_s + flat(&of_slip)) * area,
        edges: [c.cross(&of_across), of_across.cross(&b)],
        coefficients: [per_drag * area, per_friction * area],
    })
}

/// A segment of a rod.
fn segment(
    edge: Vec3,
    through: Vec3,
    drag: f64,
    diameter: f64,
    Asked { along: u, per_coefficient: k }: Asked,
) -> Option<Answer> {
    let length = edge.norm();
    let axis = (length > 0.0).then(|| edge / length)?;
    let s = through.dot(&axis);
    let across = through - axis * s;
    let (speed, direction) = (across.norm(), across.try_normalize(0.0).unwrap_or_default());
    let flat = |v: &Vec3| v - axis * axis.dot(v);
    let per_length = diameter * speed * (across.dot(&u) + k);
    let of_across = (u * speed + direction * (across.dot(&u) + k)) * (drag * diameter);
    let of_axis = through * axis.dot(&of_across) + of_across * s;
    Some(Answer {
        through: flat(&of_across) * length,
        edges: [axis * (drag * per_length) - flat(&of_axis), Vec3::zeros()],
        coefficients: [per_length * length, 0.0],
    })
}
