//! A body taken into a step: inertial targets, masses, pins, and the key of the matrix that serves.

use super::problem::{BodyProblem, Iterate, SECOND_ORDER};
use crate::body::{DeformableBody, Integrator, PrescribedNode};
use crate::fem::elastic_forces::StiffnessDamping;
use crate::math::{Mat3, Vec3};
use crate::solver::counters::SolveCounters;
use crate::solver::linear::{FactorId, FactorKey, Preconditioner};

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
            material: body.material,
            activation: body.activation,
            h,
            dt: h,
            is_second_order: false,
            x_start: Vec::new(),
            v_start: Vec::new(),
            before: Default::default(),
            kinetic_bound: f64::INFINITY,
            spin: Vec3::zeros(),
            target: Vec::new(),
            masses: Vec::new(),
            damping: StiffnessDamping::default(),
            impacts: Vec::new(),
            current: Iterate::default(),
            trial: Iterate::default(),
            contact_force: vec![Vec3::zeros(); n],
            contact_change: Vec::new(),
            preconditioner: Preconditioner::default(),
            step_damping: 1.0,
            guard_retries: 0,
            is_rejected: false,
            weight: 0.0,
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
        // What its user has pinned stays there.
        let is_free =
            |node: &&PrescribedNode| body.pins.binary_search_by_key(&node.node, |p| p.node).is_err();
        self.prescribed.clear();
        self.prescribed.extend(prescribed.iter().filter(is_free));
        self.prescribed.sort_unstable_by_key(|p| (p.node, p.attachment));
        self.prescribed.dedup_by_key(|p| p.node);
        let history = &body.state.history;
        let continues = history.h == h && history.x.len() == body.state.x.len();
        self.is_second_order = continues && body.settings().integrator == Integrator::Bdf2;
        self.dt = h;
        self.read_body(body, gravity);
    }

    /// Begins again by implicit Euler, if it had not been so: the body is touched.
    pub fn begin_first_order(&mut self, body: &DeformableBody, gravity: &Vec3) {
        if self.is_second_order {
            self.is_second_order = false;
            self.read_body(body, gravity);
        }
    }

    fn read_body(&mut self, body: &DeformableBody, gravity: &Vec3) {
        let n = body.state.x.len();
        let part = if self.is_second_order { SECOND_ORDER } else { 1.0 };
        let h = part * self.dt;
        let near = part * body.state.factor_base.step_near(self.dt);
        self.key.update(body, near, self.prescribed.iter().map(|p| p.node));
        self.settings = *body.settings();
        self.material = body.material;
        self.activation = body.activation;
        self.h = h;
        self.step_damping = 1.0;
        self.guard_retries = 0;
        self.is_rejected = false;
        self.kinetic_bound = f64::INFINITY;
        self.preconditioner.counters = SolveCounters::default();
        self.x_start.clone_from(&body.state.x);
        self.v_start.clone_from(&body.state.v);
        self.impacts.clone_from(&body.state.impacts);
        self.spin = Vec3::from(body.angular_momentum());
        if self.is_second_order {
            self.before.0.clone_from(&body.state.x);
            self.before.1.clone_from(&body.state.v);
            let history = &body.state.history;
            let starts = self.x_start.iter_mut().zip(&history.x);
            starts.chain(self.v_start.iter_mut().zip(&history.v)).for_each(|(now, before)| {
                *now += (*now - before) / 3.0;
            });
        }
        self.masses.clear();
        self.masses.extend((0..n).map(|i| body.node_mass(i)));
        let g = gravity * body.gravity_scale();
        self.target.clear();
        let to_target = |i: usize| {
            let acceleration = g + body.forces.get(i).map_or(Vec3::zeros(), |f| f / self.masses[i]);
            self.x_start[i] + self.v_start[i] * h + acceleration * (h * h)
        };
        self.target.extend((0..n).map(to_target));
        self.pinned_inertia.clear();
        self.pinned_inertia.extend(self.key.pins.iter().map(|&p| self.target[p as usize]));
        let pins = body.pins.iter().map(|pin| (pin.node, pin.target));
        for (node, target) in pins.chain(self.prescribed.iter().map(|p| (p.node, p.target))) {
            self.target[node as usize] = target;
        }
        self.contact_force.clear();
        self.contact_force.resize(n, Vec3::zeros());
        self.step.resize(n, Vec3::zeros());
        let before = self.is_second_order.then_some(&body.state.history.x[..]);
        self.damping.begin(&self.model, self.material.stiffness_damping, h, &body.state.x, before);
        let mass = self.masses.iter().sum::<f64>();
        self.weight = mass * g.norm() / n as f64;
    }
}
