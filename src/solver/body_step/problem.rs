//! One body within a step: its objective, its start, its residual.
//!
//! The step minimises `Ψ(x) = 1/(2h²)‖x − s‖²_M + α/(2h)‖x − x_n‖²_M + E(x)`, with
//! `s = x_n + h v_n + h² M⁻¹ f_ext` [Bouaziz et al. 2014], E the elastic energy with the stiffness
//! damping of the step. The residual is `r = −∂Ψ/∂x` \[N\]; pinned nodes are not unknowns.

use super::cavities::FilledCavity;
use super::generalized_alpha::{ALPHA_F, AlphaStart};
use super::twists::TwistSpring;
use super::xpbd::XpbdState;
use crate::body::{Impact, PrescribedNode, SolverSettings};
use crate::fem::elastic_forces::Evaluation;
use crate::fem::{DeformableModel, Elements, HardLimiting, StiffnessDamping, elastic_forces};
use crate::material::DeformableMaterial;
use crate::math::{
    Mat3, Vec3, centre_of_mass, inertia_about, rotation_from_vector, skew, solve_without_small,
};
use crate::profiler::timed;
use crate::solver::linear::{FactorId, FactorKey, Preconditioner, SLENDER, SystemFactor};
use std::sync::Arc;

/// Rotation of an iteration \[rad\] beyond which it is bent to a true one: below, the stretch is 5e-9.
const BENT: f64 = 1.0e-4;

/// Residual relative to the forces that is rounding and nothing else: sums of some tens of terms.
pub(crate) const ROUNDING: f64 = 1.0e-12;

/// Elements of bodies from which on they are worth several threads: an evaluation of so many takes 0.1 ms.
const LARGE: usize = 4000;

/// Whether bodies are worth several threads.
pub(in crate::solver) fn are_large(bodies: &[BodyProblem]) -> bool {
    bodies.iter().map(|body| body.model.tetrahedron_count()).sum::<usize>() > LARGE
}

/// How a step goes forward in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scheme {
    ImplicitEuler,
    Bdf2,
    GeneralizedAlpha,
}

/// Step of the matrix over that of time, of the second order.
pub(crate) const SECOND_ORDER: f64 = 2.0 / 3.0;

/// A body's step in the making.
pub(crate) struct BodyProblem {
    pub key: FactorKey,
    /// To be set when the factor is prepared.
    pub factor: FactorId,
    /// Whether that holds the columns that the contacts want.
    pub has_columns: bool,
    pub model: Arc<DeformableModel>,
    /// What the step is solved with.
    pub settings: SolverSettings,
    /// Whether more than pins and hard attachments may hold the body.
    pub(super) is_touched: bool,
    pub(super) materials: Vec<DeformableMaterial>,
    /// α [1/s].
    pub(super) mass_damping: f64,
    pub(super) activations: Vec<f64>,
    pub(super) cavities: Vec<FilledCavity>,
    pub(super) twists: Vec<TwistSpring>,
    /// The step that the objective is of \[s\], and that by which time goes on.
    pub(super) h: f64,
    pub(super) dt: f64,
    /// Time \[s\] between `x_start` and the end of the step.
    pub(super) reach: f64,
    /// Factor on Ψ, and so c at first: where it is h²/dt², contact forces are those of the time step.
    pub scale: f64,
    pub(super) scheme: Scheme,
    /// Acceleration by external forces [m/s²].
    pub(super) fall: Vec<Vec3>,
    pub(super) alpha: AlphaStart,
    /// Positions and velocities at the start of the step; of the second order what they amount to.
    pub x_start: Vec<Vec3>,
    pub v_start: Vec<Vec3>,
    /// Positions and velocities from which a step of the second order set out.
    pub(super) before: (Vec<Vec3>, Vec<Vec3>),
    /// What kinetic energy \[J\] a step leaves that has not converged; else any.
    pub(super) kinetic_bound: f64,
    /// Elastic energy at the positions of the body \[J\], where the last step has found it.
    pub(super) start_elastic: Option<f64>,
    /// Angular momentum at the start.
    pub(super) spin: Vec3,
    /// Where the nodes would go without internal and contact forces.
    pub target: Vec<Vec3>,
    /// How much farther its pins take the body than it goes by itself \[m\].
    pub lead: f64,
    pub(super) masses: Vec<f64>,
    pub(super) damping: StiffnessDamping,
    /// Those that have not ended.
    pub impacts: Vec<Impact>,
    pub current: Iterate,
    pub trial: Iterate,
    /// Contact forces on the nodes \[N\].
    pub contact_force: Vec<Vec3>,
    /// What the last contact problem added to them \[N\].
    pub contact_change: Vec<Vec3>,
    pub preconditioner: Preconditioner,
    pub limiting: HardLimiting,
    pub(super) xpbd: XpbdState,
    /// Factor c ≥ 1 on A, raised by the guard.
    pub step_damping: f64,
    pub guard_retries: usize,
    /// The step would have made energy: the body falls back to a rigid motion.
    pub is_rejected: bool,
    /// Newton's method has the constant matrix in the place of the Hessian, and is accelerated.
    pub has_constant_matrix: bool,
    /// Generalized-α would have made energy: implicit Euler took its place.
    pub was_redone: bool,
    /// Cables hold it, or attachments that give way or lead to what does not yield or deforms.
    pub is_attached: bool,
    /// Nodes that attachments hold fast to rigid bodies that yield, ascending.
    pub held_nodes: Vec<u32>,
    /// A force that counts as large for this body \[N\].
    pub weight: f64,
    /// \[kg\]
    pub total_mass: f64,
    pub(super) step: Vec<Vec3>,
    pub(super) force: Vec<Vec3>,
    /// The body's frame at the start of the iteration.
    pub(super) frame: Mat3,
    /// Nodes that attachments prescribe, ascending; pinned for the step.
    pub prescribed: Vec<PrescribedNode>,
    /// Where the pinned nodes would go by inertia and external forces.
    pub(super) pinned_inertia: Vec<Vec3>,
}

/// A point of the iteration with what was evaluated there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Iterate {
    pub x: Vec<Vec3>,
    /// Residual \[N\]; at pinned nodes minus the force of the pin.
    pub r: Vec<Vec3>,
    /// Ψ \[J\].
    pub objective: f64,
    /// E, with the stiffness damping of the step and what twisted rods have gained, less the work of what fills cavities \[J\].
    pub elastic: f64,
    /// Least `tr(QᵀR)` of the elements against the body's frame.
    pub least_trace: f64,
    /// Largest internal force on a node \[N\].
    pub internal: f64,
}

impl BodyProblem {
    /// What is elastic in the body.
    pub fn elements(&self) -> Elements<'_> {
        Elements { model: &self.model, materials: &self.materials, activations: &self.activations }
    }

    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Mass of a node \[kg\].
    pub fn mass(&self, node: usize) -> f64 {
        self.masses[node]
    }

    /// Displacement per force over mass of a rigid body, h²/(1 + αh) [s²].
    pub fn mobility(&self) -> f64 {
        self.mobility_of(self.h)
    }

    /// As [`BodyProblem::mobility`], in a step of `h` \[s\].
    pub(super) fn mobility_of(&self, h: f64) -> f64 {
        h * h / (1.0 + self.mass_damping * h)
    }

    /// The step \[s\] that the objective is of.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// The step \[s\] over which damping acts in the objective.
    pub(super) fn damping_step(&self) -> f64 {
        if self.is_alpha() { self.dt * (1.0 - ALPHA_F) } else { self.h }
    }

    /// Mean velocity of a node in the step [m/s].
    pub fn mean_velocity(&self, node: usize) -> Vec3 {
        (self.current.x[node] - self.x_start[node]) / self.reach
    }

    /// The step \[s\] by which time goes on.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Sets the trial to `x + P(r + Jᵀλ⁰)/c`, or to where a sweep over constraints leads.
    pub fn free_step(&mut self, factor: &SystemFactor) {
        if self.is_xpbd() {
            return self.sweep_constraints();
        }
        let mut force = std::mem::take(&mut self.force);
        self.free_residual(&mut force);
        self.step_by(factor, &force);
        self.force = force;
    }

    /// Sets the trial to `x + P f/c`.
    pub(super) fn step_by(&mut self, factor: &SystemFactor, force: &[Vec3]) {
        self.trial.x.clone_from(&self.current.x);
        self.preconditioner.apply(factor, force, &mut self.step);
        self.add_step();
    }

    /// Adds `P Jᵀ(λ − λ⁰)/c` to the trial.
    pub fn contact_step(&mut self, factor: &SystemFactor) {
        self.preconditioner.apply(factor, &self.contact_change, &mut self.step);
        self.add_step();
    }

    /// What forces \[N\] move \[m\]: `P f/c`, zero at pinned nodes.
    pub fn respond(&mut self, factor: &SystemFactor, forces: &[Vec3], out: &mut [Vec3]) {
        self.preconditioner.apply(factor, forces, out);
        self.key.pins.iter().for_each(|&p| out[p as usize] = Vec3::zeros());
        if self.step_damping != 1.0 {
            let scale = 1.0 / self.step_damping;
            out.iter_mut().for_each(|o| *o *= scale);
        }
    }

    /// Sets the trial to `x + step/c`.
    pub fn set_trial(&mut self, step: &[Vec3]) {
        self.step.copy_from_slice(step);
        self.trial.x.clone_from(&self.current.x);
        self.add_step();
    }

    /// Where the step turns the body, puts the finite rotation in the place of the linear one: about
    /// the centre of mass c the trial gains `(exp ω − I − ω×)(x − c)`, ω the mean rotation of the step.
    /// A linear rotation by θ stretches everything by θ²/2, which a stiff body takes for a blow. What
    /// it takes back draws contacts apart rather than together. Gives the rotation \[rad\] where it was bent, else zero: contacts
    /// then want another iteration.
    pub fn bend_step_to_rotation(&mut self) -> f64 {
        // What a sweep turns it has turned as a whole.
        if self.preconditioner.is_per_node()
            || !self.key.pins.is_empty()
            || (self.is_xpbd() && !self.preconditioner.is_rigid())
        {
            return 0.0;
        }
        let (_, centre) = centre_of_mass(&self.current.x, &self.masses);
        let (_, moved_to) = centre_of_mass(&self.trial.x, &self.masses);
        let mut moment = Vec3::zeros();
        for ((x, y), m) in self.current.x.iter().zip(&self.trial.x).zip(&self.masses) {
            let r = x - centre;
            moment += r.cross(&(y - moved_to - r)) * *m;
        }
        let inertia = inertia_about(&centre, &self.current.x, &self.masses);
        let omega = solve_without_small(&inertia, &moment, SLENDER);
        if !(omega.norm() > BENT) {
            return 0.0;
        }
        let bend = rotation_from_vector(&omega) - Mat3::identity() - skew(&omega);
        for (y, x) in self.trial.x.iter_mut().zip(&self.current.x) {
            *y += bend * (x - centre);
        }
        omega.norm()
    }

    /// Pinned nodes are rows of the identity in A, without neighbours: what the solve says of them
    /// is no motion.
    fn add_step(&mut self) {
        self.key.pins.iter().for_each(|&p| self.step[p as usize] = Vec3::zeros());
        let scale = 1.0 / self.step_damping;
        for (x, d) in self.trial.x.iter_mut().zip(&self.step) {
            *x += d * scale;
        }
    }

    /// `r + Jᵀλ⁰`, zero at pinned nodes \[N\].
    pub fn free_residual(&self, out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.current.r.iter().zip(&self.contact_force).map(|(r, f)| r + f));
        self.key.pins.iter().for_each(|&p| out[p as usize] = Vec3::zeros());
    }

    pub fn evaluate_current(&mut self) {
        let mut iterate = std::mem::take(&mut self.current);
        self.evaluate(&mut iterate, f64::INFINITY);
        self.current = iterate;
    }

    pub fn evaluate_trial(&mut self) {
        let mut iterate = std::mem::take(&mut self.trial);
        self.evaluate(&mut iterate, f64::INFINITY);
        self.trial = iterate;
    }

    /// Stopped, with an infinite objective, where that would exceed `limit` \[J\].
    pub(super) fn evaluate(&mut self, at: &mut Iterate, limit: f64) {
        at.r.clear();
        at.r.resize(at.x.len(), Vec3::zeros());
        let (model, materials, activations) = (&*self.model, &self.materials, &self.activations);
        let elements = Elements { model, materials, activations };
        let filled = self.add_cavity_forces(at) + self.add_twist_forces(at);
        let limit = limit / self.scale - filled;
        let place = Evaluation { damping: &self.damping, x: &at.x, frame: &self.frame, limit };
        let time = &mut self.preconditioner.counters.element_time;
        let elastic = timed(time, || elastic_forces::add_forces(&elements, &place, &mut at.r));
        self.preconditioner.counters.elements += elastic.evaluated;
        at.elastic = elastic.energy + filled;
        if at.elastic == f64::INFINITY {
            at.objective = f64::INFINITY;
            return;
        }
        at.least_trace = elastic.least_trace;
        if self.scale != 1.0 {
            at.r.iter_mut().for_each(|r| *r *= self.scale);
        }
        at.internal = at.r.iter().map(|f| f.amax()).fold(0.0, f64::max);
        let (inertia, drag) = self.inertia_and_drag();
        let mut kinetic = 0.0;
        for i in 0..at.x.len() {
            let (from_target, moved) = (self.target[i] - at.x[i], at.x[i] - self.x_start[i]);
            let m = self.masses[i];
            at.r[i] += (from_target * inertia - moved * drag) * m;
            kinetic += m * (inertia * from_target.norm_squared() + drag * moved.norm_squared());
        }
        at.objective = at.elastic * self.scale + 0.5 * kinetic;
    }

    /// Factors of the masses in Ψ [1/s²], before distances to the target and from the start.
    pub(super) fn inertia_and_drag(&self) -> (f64, f64) {
        (self.scale / (self.h * self.h), self.scale * self.mass_damping / self.damping_step())
    }

    /// What Ψ \[J\] is at least at `x`: what is not elastic.
    pub(super) fn inertial_objective(&self, x: &[Vec3]) -> f64 {
        let (inertia, drag) = self.inertia_and_drag();
        let of = |i: usize| {
            let (from_target, moved) = (self.target[i] - x[i], x[i] - self.x_start[i]);
            self.masses[i] * (inertia * from_target.norm_squared() + drag * moved.norm_squared())
        };
        0.5 * (0..x.len()).map(of).sum::<f64>()
    }

    /// The guard [cf. Nocedal & Wright 2006, sufficient decrease]:
    /// `Ψ(x + d) − λᵀJd ≤ Ψ(x) − 0.1·dᵀ(r + Jᵀλ)`.
    pub fn trial_descends(&self) -> bool {
        // Sweeps ascend in the multipliers: on the way they may raise Ψ.
        if self.is_xpbd() {
            return self.trial.objective.is_finite();
        }
        let (mut by_contact, mut by_residual) = (0.0, 0.0);
        for i in 0..self.trial.x.len() {
            let d = self.trial.x[i] - self.current.x[i];
            by_contact += d.dot(&self.contact_force[i]);
            by_residual += d.dot(&self.current.r[i]);
        }
        let promised = 0.1 * (by_contact + by_residual);
        // Ψ is a sum over the elements: its rounding is below 1e-13 of its terms.
        let sums = self.trial.objective.abs() + self.current.objective.abs() + by_contact.abs();
        let rounding = 1e-12 * sums + self.twist_rounding();
        self.trial.objective - by_contact <= self.current.objective - promised + rounding
    }

    /// Makes the trial the current iterate: no step.
    pub fn reject_trial(&mut self) {
        self.reject_multipliers();
        self.trial.clone_from(&self.current);
    }

    pub fn accept_trial(&mut self) {
        self.accept_multipliers();
        std::mem::swap(&mut self.current, &mut self.trial);
    }
}
