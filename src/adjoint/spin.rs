//! The adjoint of what gives a body in flight its angular momentum back: `v′ = v̄ + ω × r`, `v̄ = (x′ − xₙ)/h`, `r = x′ − c`,
//! `I ω = (L₀ + h Σ m r × a)/(1 + αh) − Σ m r × v̄`, a the acceleration by external forces and L₀ the momentum at the start.

use super::parameters::Inertia;
use super::record::BodyRecord;
use crate::math::{Vec3, centre_of_mass, inertia_about, solve_semidefinite};

/// Derivatives of a loss with respect to all that a step depends on, but for its material.
pub(super) struct Cotangents {
    pub x_end: Vec<Vec3>,
    pub v_end: Vec<Vec3>,
    pub x_start: Vec<Vec3>,
    pub v_start: Vec<Vec3>,
    pub forces: Vec<Vec3>,
    pub gravity: Vec3,
    pub masses: Vec<f64>,
    pub damping: f64,
    /// Of the coefficients of all contacts.
    pub friction: f64,
}

impl Cotangents {
    /// Those with respect to the end of a step, and none yet of others.
    pub fn new(x_end: Vec<Vec3>, v_end: Vec<Vec3>) -> Self {
        let zeros = vec![Vec3::zeros(); x_end.len()];
        Self {
            masses: vec![0.0; x_end.len()],
            x_end,
            v_end,
            x_start: zeros.clone(),
            v_start: zeros.clone(),
            forces: zeros,
            gravity: Vec3::zeros(),
            damping: 0.0,
            friction: 0.0,
        }
    }
}

/// Goes through it backward: what is with respect to `v′` becomes that with respect to `v̄`.
pub(super) fn through_spin(record: &BodyRecord, inertia: &Inertia, of: &mut Cotangents) {
    let (h, masses) = (record.h, &inertia.masses);
    let drag = 1.0 + inertia.damping * h;
    let (mass, centre) = centre_of_mass(&record.x_end, masses);
    let (_, centre_start) = centre_of_mass(&record.x_start, masses);
    let gravity = record.gravity * record.gravity_scale;
    let arm = |i: usize| record.x_end[i] - centre;
    let arm_start = |i: usize| record.x_start[i] - centre_start;
    let mean = |i: usize| (record.x_end[i] - record.x_start[i]) / h;
    let fall = |i: usize| gravity + record.forces.get(i).map_or(Vec3::zeros(), |f| f / masses[i]);
    let (mut kept, mut lost, mut of_turn) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    let mut momentum = Vec3::zeros();
    for i in 0..masses.len() {
        kept += (arm_start(i).cross(&record.v_start[i]) + arm(i).cross(&fall(i)) * h) * masses[i];
        lost += arm(i).cross(&mean(i)) * masses[i];
        momentum += record.v_start[i] * masses[i];
        of_turn += arm(i).cross(&of.v_end[i]);
    }
    let tensor = inertia_about(&centre, &record.x_end, masses);
    let turn = solve_semidefinite(&tensor, &(kept / drag - lost));
    let p = solve_semidefinite(&tensor, &of_turn);
    let kept_by = p / drag;
    of.damping -= h * p.dot(&kept) / (drag * drag);
    let (mut of_arms, mut sum) = (Vec::with_capacity(masses.len()), Vec3::zeros());
    for (i, m) in masses.iter().enumerate() {
        let (r, v, a, r0) = (arm(i), mean(i), fall(i), arm_start(i));
        let mut of_arm = of.v_end[i].cross(&turn);
        of_arm += (a.cross(&kept_by) * h - v.cross(&p)) * *m;
        of_arm -= (r * (2.0 * p.dot(&turn)) - p * r.dot(&turn) - turn * p.dot(&r)) * *m;
        sum += of_arm;
        of_arms.push(of_arm);
        of.v_end[i] -= p.cross(&r) * *m;
        let by_force = kept_by.cross(&r) * h;
        of.forces[i] += by_force;
        of.gravity += by_force * (*m * record.gravity_scale);
        of.x_start[i] += (record.v_start[i] - momentum / mass).cross(&kept_by) * *m;
        of.v_start[i] += kept_by.cross(&r0) * *m;
        of.masses[i] += kept_by
            .dot(&(r0.cross(&(record.v_start[i] - momentum / mass)) + r.cross(&gravity) * h))
            - p.dot(&r.cross(&v))
            - (r.norm_squared() * p.dot(&turn) - p.dot(&r) * r.dot(&turn));
    }
    for (i, m) in masses.iter().enumerate() {
        of.x_end[i] += of_arms[i] - sum * (*m / mass);
        of.masses[i] -= arm(i).dot(&sum) / mass;
    }
}
