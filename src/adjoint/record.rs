//! What is kept of a step so that it can be gone through backward, and which steps cannot be. Of contacts see `contact_record.rs`.

use super::cables::{CableRecord, cables_of};
use super::contact_record::{ContactRecord, TapeBody, TapeRigid, carries};
use super::held_twists::TwistRecord;
use super::rigid_record::{RigidRecord, RigidStart};
use super::wind::WindRecord;
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableWind, HeldTwist, Integrator, Solver};
use crate::energy::CavityFilling;
use crate::fem::{DampedStep, Dampers, DeformableModel, Elements, StiffnessDamping};
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use crate::pipeline::{DeformableWorld, SolvedBody, SolvedContact};
use rapier3d::dynamics::{RigidBodyHandle, RigidBodyType};
use rapier3d::pipeline::PhysicsWorld;
use std::ops::Range;
use std::sync::Arc;

/// Residual over the forces, and error of contact forces over the largest of them, up to which a step counts as solved: what is
/// left of it is an error of the gradient.
const SOLVED: f64 = 1.0e-6;
/// Distance of a contact that carries from where it is to end, over the mean edge, up to which it counts as solved: what the
/// iteration of the shifts has left.
const SETTLED: f64 = 1.0e-6;
/// Turn \[rad\] in a step of which the loss is seen, if it is given back.
const TURNS: f64 = 0.1;

/// Vectors at nodes; one may be there several times.
pub(super) type NodeVectors = Vec<(usize, Vec3)>;

/// A step of the bodies of a tape.
#[derive(Clone, Debug)]
pub(super) struct StepRecord {
    pub bodies: Vec<BodyRecord>,
    pub contacts: Vec<ContactRecord>,
    pub rigid_bodies: Vec<RigidRecord>,
}

/// A step of one body.
#[derive(Clone, Debug)]
pub(super) struct BodyRecord {
    pub h: f64,
    /// Nodes that were led along.
    pub pins: Vec<u32>,
    pub x_start: Vec<Vec3>,
    pub v_start: Vec<Vec3>,
    pub x_end: Vec<Vec3>,
    pub materials: Vec<DeformableMaterial>,
    pub activations: Vec<f64>,
    /// At the start; of materials without Maxwell branches none.
    pub dampers: Dampers,
    /// Of the cavities; empty while there are none.
    pub fillings: Vec<Option<CavityFilling>>,
    /// Rods that were held against roll.
    pub twists: Vec<TwistRecord>,
    /// Of the world [m/s²], and the body's factor on it.
    pub gravity: Vec3,
    pub gravity_scale: f64,
    /// On the nodes \[N\], those of the wind too; empty while there are none.
    pub forces: Vec<Vec3>,
    pub wind: Option<WindRecord>,
    pub cables: Vec<CableRecord>,
    /// What the step has lost of the angular momentum was given back.
    pub keeps_spin: bool,
}

impl BodyRecord {
    /// Of the last step of a body, under this gravity [m/s²], in which these cables ran through it.
    ///
    /// # Errors
    /// Why there is no gradient.
    pub fn new(
        body: &DeformableBody,
        solved: &SolvedBody<'_>,
        cables: Vec<CableRecord>,
        gravity: Vec3,
    ) -> Result<Self, &'static str> {
        check_body(body)?;
        let problem = solved.problem;
        check_step(body, solved)?;
        let turn = Vec3::from(body.angvel()).norm() * problem.h();
        let is_mean = (0..body.state.v.len()).all(|n| body.state.v[n] == problem.mean_velocity(n));
        let is_held = !problem.key.pins.is_empty() || problem.are_ends_held();
        let is_free = solved.in_flight && !is_held && problem.settings.keeps_spin;
        // Beyond half a radian in a step nothing is given back.
        let keeps_spin = is_free && !(is_mean && turn > TURNS);
        if !keeps_spin && !is_mean {
            return Err("spin was given back in contact: it has to be without `keeps_spin`");
        }
        let push = |wind: DeformableWind| wind.push(&body.model, &problem.x_start, &problem.v_start);
        let wind = body.wind().map(|wind| WindRecord { wind, push: push(wind) });
        Ok(Self {
            h: problem.h(),
            pins: problem.key.pins.clone(),
            x_start: problem.x_start.clone(),
            v_start: problem.v_start.clone(),
            x_end: body.state.x.clone(),
            materials: body.materials.clone(),
            activations: body.activations.clone(),
            dampers: problem.dampers().clone(),
            fillings: body.fillings.clone(),
            twists: body.state.twists.iter().map(twist_record).collect(),
            gravity,
            gravity_scale: body.gravity_scale(),
            forces: forces(body, wind.as_ref(), problem.h()),
            wind,
            cables,
            keeps_spin,
        })
    }
}

impl StepRecord {
    /// Of the last step of these bodies, under this gravity [m/s²], which the rigid ones began so.
    ///
    /// # Errors
    /// Why there is no gradient.
    pub fn new(
        (handles, models): (&[DeformableBodyHandle], &[Arc<DeformableModel>]),
        (physics, deformables): (&PhysicsWorld, &DeformableWorld),
        (gravity, rigid_handles, starts): (Vec3, &[RigidBodyHandle], &[RigidStart]),
    ) -> Result<Self, &'static str> {
        let mut bodies = Vec::with_capacity(handles.len());
        let mut solved = Vec::with_capacity(handles.len());
        for handle in handles {
            let own = deformables.pipeline.solved(*handle).filter(|_| !deformables.counters().skipped);
            let own = own.ok_or("the body was not stepped: it sleeps or is not enabled")?;
            let cables = cables_of(*handle, (&deformables.bodies, physics), &own)?;
            bodies.push(BodyRecord::new(&deformables.bodies[*handle], &own, cables, gravity)?);
            solved.push(own);
        }
        let mut record = Self { bodies, contacts: Vec::new(), rigid_bodies: Vec::new() };
        let places = record.nodes();
        let tape_body = |place: usize| TapeBody {
            handle: handles[place],
            model: &models[place],
            first_node: places[place].start,
            x_start: &record.bodies[place].x_start,
            targets: &solved[place].problem.target,
            x_end: &record.bodies[place].x_end,
        };
        let tape_bodies: Vec<_> = (0..handles.len()).map(tape_body).collect();
        let coms: Vec<Vec3> = starts.iter().map(RigidStart::com).collect();
        let first_node = places.last().map_or(0, |last| last.end);
        let rigid = TapeRigid { handles: rigid_handles, coms: &coms, first_node };
        let mut contacts = Vec::new();
        for (place, own) in solved.iter().enumerate() {
            for contact in own.contacts.iter().filter(carries) {
                contacts.extend(ContactRecord::new(contact, place, (&tape_bodies, &rigid))?);
            }
        }
        let mut rigid_bodies = Vec::with_capacity(starts.len());
        for (place, own) in rigid_handles.iter().copied().zip(starts).enumerate() {
            let is_own = |contact: &&ContactRecord| contact.rigid.is_some_and(|at| at.place == place);
            let on_it = contacts.iter().filter(is_own);
            rigid_bodies.push(RigidRecord::new(own, (physics, deformables), on_it)?);
        }
        (record.contacts, record.rigid_bodies) = (contacts, rigid_bodies);
        Ok(record)
    }

    /// Where it has led the bodies.
    pub fn led_to(&self) -> Vec<Vec3> {
        let nodes = self.bodies.iter().flat_map(|body| body.x_end.iter().copied());
        nodes.chain(self.rigid_bodies.iter().flat_map(RigidRecord::led_to)).collect()
    }

    /// Of each body its nodes among those of all.
    pub fn nodes(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let of_body = |body: &BodyRecord| {
            let nodes = first..first + body.x_end.len();
            first = nodes.end;
            nodes
        };
        self.bodies.iter().map(of_body).collect()
    }
}

impl BodyRecord {
    /// The elements of its model, as they were.
    pub fn elements<'a>(&'a self, model: &'a DeformableModel) -> Elements<'a> {
        Elements { model, materials: &self.materials, activations: &self.activations }
    }

    /// The step as its damping sees it.
    pub fn damped<'a>(&'a self, elements: &'a Elements<'a>, damping: &'a StiffnessDamping) -> DampedStep<'a> {
        let (x_start, x_end) = (&self.x_start[..], &self.x_end[..]);
        DampedStep { elements, damping, h: self.h, x_start, x_end }
    }

    /// What resists in the step, of its materials or others.
    pub fn damping(&self, model: &DeformableModel, materials: &[DeformableMaterial]) -> StiffnessDamping {
        let mut damping = StiffnessDamping::default();
        let elements = Elements { model, materials, activations: &self.activations };
        damping.take_dampers(&elements, &self.dampers);
        damping.begin(&elements, self.h, &self.x_start, None);
        damping
    }
}

fn twist_record(held: &HeldTwist) -> TwistRecord {
    TwistRecord { rod: held.rod as usize, frames: held.frames(), twist: held.roll + held.angle }
}

/// On the nodes, by the user and by the wind.
fn forces(body: &DeformableBody, wind: Option<&WindRecord>, h: f64) -> Vec<Vec3> {
    let mut forces = body.forces.clone();
    if let Some(wind) = wind {
        forces.resize(body.state.x.len(), Vec3::zeros());
        let nodes = forces.iter_mut().enumerate();
        nodes.for_each(|(n, force)| *force += wind.force(n, body.node_mass(n), h));
    }
    forces
}

fn check_body(body: &DeformableBody) -> Result<(), &'static str> {
    let why = [
        (body.is_sleeping(), "the body sleeps: it has to be without `can_sleep`"),
        (body.body_type() != RigidBodyType::Dynamic, "the body is not dynamic"),
        (body.settings().integrator != Integrator::ImplicitEuler, "only implicit Euler has one"),
        (body.settings().solver == Solver::Xpbd, "position-based dynamics does not end at a minimum"),
        (is_woven_damped(body), "stiffness damping and Maxwell branches of woven sheets have none"),
    ];
    why.iter().find(|(is_so, _)| *is_so).map_or(Ok(()), |(_, what)| Err(*what))
}

/// Whether woven sheets of a body have stiffness damping or Maxwell branches.
fn is_woven_damped(body: &DeformableBody) -> bool {
    body.model().triangles.iter().any(|triangle| {
        let material = &body.materials[triangle.region as usize];
        material.orthotropic.is_some() && (material.stiffness_damping != 0.0 || material.branch_count() > 0)
    })
}

fn check_step(body: &DeformableBody, solved: &SolvedBody<'_>) -> Result<(), &'static str> {
    let problem = solved.problem;
    let is_solved = problem.is_solved_to(SOLVED) && solved.contact_error <= SOLVED;
    let end = |c: &SolvedContact<'_>| c.constraint.frame[0].dot(&c.motion) + c.constraint.target_gap;
    let near = SETTLED * body.model.surface.mean_edge;
    let is_settled = solved.contacts.iter().filter(carries).all(|contact| end(contact).abs() <= near);
    let why = [
        (problem.is_rejected, "it was rejected"),
        (!is_solved, "it was not solved: `tolerance` and `max_iterations` have to be stricter"),
        (!is_settled, "its contacts have not settled: a smaller step, or less friction, may help"),
        (body.state.x != problem.current.x, "the body was stopped at an obstacle"),
        (!problem.impacts.is_empty(), "restitution has none"),
    ];
    why.iter().find(|(is_so, _)| *is_so).map_or(Ok(()), |(_, what)| Err(*what))
}

#[cfg(test)]
impl BodyRecord {
    /// Of a body of one material that nothing but its elements acts on.
    pub fn still(x: &[Vec3], elements: &crate::fem::Elements<'_>, h: f64) -> Self {
        Self {
            h,
            pins: Vec::new(),
            x_start: x.to_vec(),
            v_start: Vec::new(),
            x_end: x.to_vec(),
            materials: elements.materials.to_vec(),
            activations: elements.activations.to_vec(),
            dampers: Dampers::new(),
            fillings: Vec::new(),
            twists: Vec::new(),
            gravity: Vec3::zeros(),
            gravity_scale: 1.0,
            forces: Vec::new(),
            wind: None,
            cables: Vec::new(),
            keeps_spin: false,
        }
    }
}
