//! A body taken into a step: inertial targets, masses, pins, and the key of the matrix that serves.

use super::generalized_alpha::{SCALE, alpha_step};
use super::problem::{BodyProblem, Iterate, SECOND_ORDER, Scheme};
use crate::body::{DeformableBody, Integrator, PrescribedNode, SolverSettings, StepState};
use crate::contact::STATIC_MARGIN;
use crate::fem::StiffnessDamping;
use crate::math::{Mat3, Vec3};
use crate::solver::counters::SolveCounters;
use crate::solver::linear::{FactorId, FactorKey, Preconditioner};
use std::sync::Arc;

/// Mean edges by which pins may take their body along in a step, at the most: it looks for contacts as far, all around. A pad of 0.12 m pressed by a
/// tenth takes 0.4 of them, one on a hand that starts at 1 m/s 0.7 at 1/60 s.
const MOST_LED: f64 = 2.0;

impl BodyProblem {
    /// Of a body at the start of a step of `h` \[s\] under `gravity` [m/s²], with the nodes that attachments prescribe.
    pub fn new(body: &DeformableBody, h: f64, gravity: &Vec3, prescribed: &[PrescribedNode]) -> Self {
        let n = body.state.x.len();
        let mut problem = Self {
            key: FactorKey::new(body, h),
            factor: FactorId::default(),
            has_columns: false,
            model: body.model.clone(),
            settings: *body.settings(),
            is_touched: false,
            materials: body.materials.clone(),
            mass_damping: 0.0,
            activations: body.activations.clone(),
            cavities: Vec::new(),
            twists: Vec::new(),
            h,
            dt: h,
            reach: h,
            scale: 1.0,
            scheme: Scheme::ImplicitEuler,
            fall: Vec::new(),
            alpha: Default::default(),
            x_start: Vec::new(),
            v_start: Vec::new(),
            before: Default::default(),
            kinetic_bound: f64::INFINITY,
            start_elastic: None,
            spin: Vec3::zeros(),
            target: Vec::new(),
            lead: 0.0,
            masses: Vec::new(),
            damping: StiffnessDamping::default(),
            impacts: Vec::new(),
            current: Iterate::default(),
            trial: Iterate::default(),
            contact_force: vec![Vec3::zeros(); n],
            contact_change: Vec::new(),
            preconditioner: Preconditioner::default(),
            limiting: Default::default(),
            xpbd: Default::default(),
            step_damping: 1.0,
            guard_retries: 0,
            is_rejected: false,
            has_constant_matrix: false,
            was_redone: false,
            is_attached: false,
            held_nodes: Vec::new(),
            weight: 0.0,
            total_mass: 0.0,
            step: vec![Vec3::zeros(); n],
            force: Vec::new(),
            frame: Mat3::identity(),
            prescribed: Vec::new(),
            pinned_inertia: Vec::new(),
        };
        problem.begin(body, h, gravity, prescribed);
        problem
    }

    /// As [`BodyProblem::new`], in the memory of an earlier step.
    pub fn begin(&mut self, body: &DeformableBody, h: f64, gravity: &Vec3, prescribed: &[PrescribedNode]) {
        self.note_start_elastic(body);
        // What its user has pinned stays there.
        let is_free =
            |node: &&PrescribedNode| body.pins.binary_search_by_key(&node.node, |p| p.node).is_err();
        self.prescribed.clear();
        self.prescribed.extend(prescribed.iter().filter(is_free));
        self.prescribed.sort_unstable_by_key(|p| (p.node, p.attachment));
        self.prescribed.dedup_by_key(|p| p.node);
        let history = &body.state.history;
        let continues = history.h == h && history.x.len() == body.state.x.len();
        let is_second_order = body.settings().integrator == Integrator::Bdf2;
        self.scheme = match continues {
            true if is_second_order => Scheme::Bdf2,
            _ => Scheme::ImplicitEuler,
        };
        self.dt = h;
        self.is_touched = false;
        self.is_attached = false;
        self.held_nodes.clear();
        self.read_body(body, gravity);
    }

    /// Keeps the elastic energy that the last step has found where this one starts, if nothing that it depends on is another.
    fn note_start_elastic(&mut self, body: &DeformableBody) {
        // What limits bring back and what is balanced has moved since its evaluation.
        let is_pure = !self.is_xpbd()
            && !self.was_limited()
            && !self.key.pins.is_empty()
            && !self.damping.resists()
            && self.cavities.is_empty()
            && self.twists.is_empty()
            && Arc::ptr_eq(&self.model, &body.model);
        let is_same = is_pure
            && self.current.x == body.state.x
            && self.materials == body.materials
            && self.activations == body.activations;
        self.start_elastic = is_same.then_some(self.current.elastic);
    }

    /// Begins again where the body is held, or may be touched: by generalized-α, if it is of the second order, and where it is touched
    /// with what then solves it.
    pub fn begin_held(&mut self, body: &DeformableBody, is_touched: bool, gravity: &Vec3) {
        let before = (self.scheme, self.settings);
        if self.settings.integrator == Integrator::Bdf2 {
            let goes = self.goes_by_alpha(body, gravity);
            self.scheme = if goes { Scheme::GeneralizedAlpha } else { Scheme::ImplicitEuler };
        }
        self.is_touched = is_touched;
        if before != (self.scheme, self.settings_of(body)) {
            self.read_body(body, gravity);
        }
    }

    fn settings_of(&self, body: &DeformableBody) -> SolverSettings {
        let is_pinned = !(body.pins.is_empty() && self.prescribed.is_empty());
        body.settings().of_step(match self.is_touched {
            true => StepState::Touched,
            false if is_pinned => StepState::Hangs,
            false => StepState::Flies,
        })
    }

    fn read_body(&mut self, body: &DeformableBody, gravity: &Vec3) {
        let step = |dt: f64| match self.scheme {
            Scheme::ImplicitEuler => dt,
            Scheme::Bdf2 => SECOND_ORDER * dt,
            Scheme::GeneralizedAlpha => alpha_step(dt),
        };
        let near = step(body.matrix_step(self.dt));
        self.h = step(self.dt);
        (self.reach, self.scale) = if self.is_alpha() { (self.dt, SCALE) } else { (self.h, 1.0) };
        self.settings = self.settings_of(body);
        self.key.update(body, self.settings.solver, near, self.prescribed.iter().map(|p| p.node));
        self.materials.clone_from(&body.materials);
        self.mass_damping = body.model.mass_damping(&body.materials);
        self.activations.clone_from(&body.activations);
        self.read_cavities(&body.fillings, &body.state.x);
        self.read_twists(body);
        self.step_damping = self.scale;
        self.guard_retries = 0;
        self.is_rejected = false;
        self.has_constant_matrix = false;
        self.was_redone = false;
        self.begin_limits();
        self.kinetic_bound = f64::INFINITY;
        self.preconditioner.counters = SolveCounters::default();
        self.read_state(body);
        self.read_held_energy(&body.state.history);
        self.set_targets(body, gravity);
        let n = self.x_start.len();
        self.contact_force.clear();
        self.contact_force.resize(n, Vec3::zeros());
        self.step.resize(n, Vec3::zeros());
        let before = (self.scheme == Scheme::Bdf2).then_some(&body.state.history.x[..]);
        let elements = body.elements();
        self.damping.take_dampers(&elements, &body.state.dampers);
        self.damping.begin(&elements, self.damping_step(), &body.state.x, before);
        self.total_mass = self.masses.iter().sum();
        self.weight = self.total_mass * (gravity * body.gravity_scale()).norm() / n as f64;
    }

    fn read_state(&mut self, body: &DeformableBody) {
        self.x_start.clone_from(&body.state.x);
        self.v_start.clone_from(&body.state.v);
        self.impacts.clone_from(&body.state.impacts);
        self.spin = Vec3::from(body.angular_momentum());
        if self.scheme == Scheme::Bdf2 {
            self.before.0.clone_from(&body.state.x);
            self.before.1.clone_from(&body.state.v);
            let history = &body.state.history;
            let starts = self.x_start.iter_mut().zip(&history.x);
            starts.chain(self.v_start.iter_mut().zip(&history.v)).for_each(|(now, before)| {
                *now += (*now - before) / 3.0;
            });
        }
        self.masses.clone_from(&body.masses);
    }

    /// Sets where the nodes would go without internal and contact forces; pinned ones go where they are led.
    fn set_targets(&mut self, body: &DeformableBody, gravity: &Vec3) {
        let g = gravity * body.gravity_scale();
        let fall = |i: usize| g + body.forces.get(i).map_or(Vec3::zeros(), |f| f / self.masses[i]);
        self.fall.clear();
        self.fall.extend((0..self.masses.len()).map(fall));
        body.add_wind(self.dt, &mut self.fall);
        let h = self.h;
        let to_target = |i: usize| self.x_start[i] + self.v_start[i] * h + self.fall[i] * (h * h);
        self.target.clear();
        self.target.extend((0..self.masses.len()).map(to_target));
        if self.is_alpha() {
            self.begin_alpha(&body.state.history);
        }
        self.pinned_inertia.clear();
        self.pinned_inertia.extend(self.key.pins.iter().map(|&p| self.target[p as usize]));
        let pins = body.pin_targets(self.dt);
        for (node, target) in pins.chain(self.prescribed.iter().map(|p| (p.node, p.target))) {
            self.target[node as usize] = target;
        }
        self.measure_lead();
    }

    /// Pins that begin to go take other nodes along, within the step: pads that were led 6 mm onto a box 2 mm away found no contact, and were stopped by
    /// it as what tunnels. What is put farther away than the body is large is not led there.
    fn measure_lead(&mut self) {
        let goes_on = |i: usize| self.x_start[i] + self.v_start[i] * self.h;
        let more = |pin: &u32| (self.target[*pin as usize] - goes_on(*pin as usize)).norm();
        let most = self.key.pins.iter().map(more).fold(0.0, f64::max);
        let edge = self.model.surface.mean_edge;
        let counts = most > STATIC_MARGIN * edge && most <= self.model.size;
        self.lead = if counts { most.min(MOST_LED * edge) } else { 0.0 };
    }
}
