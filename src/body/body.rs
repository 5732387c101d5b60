//! One deformable body as its user sees it.

use super::constraint_memory::ConstraintMemory;
use super::factor_base::FactorBase;
use super::kinematics::Drive;
use super::settings::{Solver, SolverSettings};
use super::sleep::{STILL_SPEED, TIME_UNTIL_SLEEP};
use super::state::{DeformableState, History, Sleep};
use super::wind::DeformableWind;
use crate::energy::CavityFilling;
use crate::error::BodyError;
use crate::fem::{DeformableModel, Elements, volume};
use crate::material::DeformableMaterial;
use crate::math::{Vec3, from_real, to_real};
use crate::mesh::point_normals;
use parry3d::bounding_volume::Aabb;
use rapier3d::dynamics::{CoefficientCombineRule, RigidBodyType};
use rapier3d::geometry::InteractionGroups;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::pipeline::{ActiveEvents, ActiveHooks};
use std::sync::Arc;

/// A vertex held in place, or led along by its user.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Pin {
    pub(crate) node: u32,
    pub(crate) target: Vec3,
    /// Velocity with which the target moves on [m/s].
    pub(crate) velocity: Vec3,
    /// Force that holds the vertex \[N\], of the last step.
    pub(crate) force: Vec3,
}

impl Pin {
    /// A node held at a place.
    pub(super) fn at(node: usize, target: Vec3) -> Self {
        Self { node: node as u32, target, velocity: Vec3::zeros(), force: Vec3::zeros() }
    }

    pub(super) fn moves(&self) -> bool {
        self.velocity != Vec3::zeros()
    }
}

/// How the last step of a body went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct StepReport {
    pub iterations: usize,
    pub residual: f64,
    pub tolerance: f64,
    pub guard_retries: usize,
    pub is_rejected: bool,
    pub quarantined: bool,
}

/// A deformable body: a shared model, a state, a material and the settings of its solver. Made by
/// [`DeformableBodyBuilder`](super::DeformableBodyBuilder).
#[derive(Clone, Debug)]
pub struct DeformableBody {
    pub(crate) model: Arc<DeformableModel>,
    pub(crate) state: DeformableState,
    /// One per region of the model, and the one of those that have none of their own.
    pub(crate) materials: Vec<DeformableMaterial>,
    pub(super) material: DeformableMaterial,
    /// Regions with materials of their own, ascending.
    pub(super) region_materials: Vec<(u32, DeformableMaterial)>,
    /// Of the nodes \[kg\].
    pub(crate) masses: Vec<f64>,
    /// Friction and restitution of the nodes; empty where they are those of the material everywhere.
    pub(crate) node_surfaces: Vec<[f64; 2]>,
    /// Where the nodes were before the last step \[m\]; empty if no one may be shown the way from there.
    pub(crate) before: Vec<Vec3>,
    /// Ascending by node.
    pub(crate) pins: Vec<Pin>,
    /// Pins of its user, while the body is fixed or kinematic and all of its nodes are pinned.
    pub(super) held_pins: Vec<Pin>,
    pub(super) body_type: RigidBodyType,
    pub(super) drive: Drive,
    pub(super) wind: Option<DeformableWind>,
    /// External force on every node \[N\]; empty while there is none.
    pub(crate) forces: Vec<Vec3>,
    pub(crate) report: StepReport,
    pub(super) settings: SolverSettings,
    /// Stretch that muscle fibres want to have: where regions have none of their own, of regions that have, and of each.
    pub(super) activation: f64,
    pub(super) region_activations: Vec<(u32, f64)>,
    pub(crate) activations: Vec<f64>,
    /// Of the model's cavities; empty while nothing was filled.
    pub(crate) fillings: Vec<Option<CavityFilling>>,
    pub(super) gravity_scale: f64,
    pub(super) enabled: bool,
    pub(super) can_sleep: bool,
    pub(super) sleep_speed: f64,
    pub(super) time_until_sleep: f64,
    pub(super) self_contact: bool,
    pub(super) collision_groups: InteractionGroups,
    pub(super) friction_combine_rule: CoefficientCombineRule,
    pub(super) restitution_combine_rule: CoefficientCombineRule,
    pub(super) active_events: ActiveEvents,
    pub(super) active_hooks: ActiveHooks,
    pub(super) contact_force_event_threshold: f32,
    /// Free for the user.
    pub user_data: u128,
}

impl DeformableBody {
    pub(super) fn new(model: Arc<DeformableModel>, material: DeformableMaterial) -> Self {
        let state = DeformableState {
            x: model.rest.clone(),
            v: vec![Vec3::zeros(); model.rest.len()],
            contacts: Vec::new(),
            shared: Vec::new(),
            impacts: Vec::new(),
            pair_data: Vec::new(),
            dampers: Vec::new(),
            history: History::default(),
            sleep: Sleep::default(),
            factor_base: FactorBase::default(),
            twists: Vec::new(),
        };
        let mut body = Self {
            model,
            state,
            materials: Vec::new(),
            material,
            region_materials: Vec::new(),
            masses: Vec::new(),
            node_surfaces: Vec::new(),
            before: Vec::new(),
            pins: Vec::new(),
            held_pins: Vec::new(),
            body_type: RigidBodyType::Dynamic,
            drive: Drive::default(),
            wind: None,
            forces: Vec::new(),
            report: StepReport::default(),
            settings: SolverSettings::default(),
            activation: 1.0,
            region_activations: Vec::new(),
            activations: Vec::new(),
            fillings: Vec::new(),
            gravity_scale: 1.0,
            enabled: true,
            can_sleep: true,
            sleep_speed: STILL_SPEED,
            time_until_sleep: TIME_UNTIL_SLEEP,
            self_contact: false,
            collision_groups: InteractionGroups::all(),
            friction_combine_rule: CoefficientCombineRule::Average,
            restitution_combine_rule: CoefficientCombineRule::Average,
            active_events: ActiveEvents::empty(),
            active_hooks: ActiveHooks::empty(),
            contact_force_event_threshold: 0.0,
            user_data: 0,
        };
        body.distribute_materials();
        body
    }

    /// The constant part of the body.
    pub fn model(&self) -> &Arc<DeformableModel> {
        &self.model
    }

    /// What a snapshot has to hold.
    pub fn state(&self) -> &DeformableState {
        &self.state
    }

    /// Goes back to a saved state of this body.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`] when the state belongs to a mesh of another size, [`BodyError::BadState`] when it was damaged.
    pub fn restore(&mut self, state: DeformableState) -> Result<(), BodyError> {
        if state.x.len() != self.state.x.len() {
            return Err(BodyError::WrongSize { vertices: state.x.len(), expected: self.state.x.len() });
        }
        state.check(&self.model).map_err(|what| BodyError::BadState { what })?;
        self.state = state;
        self.before.clear();
        // Contacts of another mesh of the same size would name nodes that are not on this surface.
        let surface = &self.model.surface.index_of_node;
        let known = |n: &u32| surface.get(*n as usize).is_some_and(|s| *s != u32::MAX);
        let on_surface = |c: &ConstraintMemory| {
            c.geometry.nodes[0].iter().zip(c.geometry.weights[0]).all(|(n, w)| w == 0.0 || known(n))
        };
        if !self.state.contacts.iter().all(on_surface) {
            self.state.contacts.clear();
        }
        Ok(())
    }

    // ── Geometry ────────────────────────────────────────────────────────

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.model.vertex_count()
    }

    /// Positions of the vertices \[m\], rounded to rapier's precision.
    pub fn positions(&self) -> impl ExactSizeIterator<Item = Vector> + '_ {
        self.model.nodes_by_vertex().map(|n| to_real(&self.state.x[n]))
    }

    /// Positions of the vertices between the last two steps \[m\]: at `t` 0 where the last one began, at 1 where it ended. For
    /// frames that are not steps; what was set elsewhere since is where it was set.
    pub fn positions_between(&self, t: f32) -> Vec<Vector> {
        let x = self.nodes_between(t);
        self.model.nodes_by_vertex().map(|n| to_real(&x[n])).collect()
    }

    pub(crate) fn nodes_between(&self, t: f32) -> Vec<Vec3> {
        let x = &self.state.x;
        if self.before.len() != x.len() || self.is_sleeping() {
            return x.clone();
        }
        let t = f64::from(t).clamp(0.0, 1.0);
        self.before.iter().zip(x).map(|(a, b)| a + (b - a) * t).collect()
    }

    /// Unit normals of the surface at the vertices, by the areas of the triangles around them; zero inside and on rods.
    pub fn normals(&self) -> Vec<Vector> {
        let normals = point_normals(&self.model.surface.triangles, &self.state.x);
        self.model.nodes_by_vertex().map(|n| to_real(&normals[n])).collect()
    }

    /// Position of a vertex \[m\] in the solver's precision.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`].
    pub fn position(&self, vertex: usize) -> Result<[f64; 3], BodyError> {
        Ok(self.state.x[self.node(vertex)?].into())
    }

    /// Velocity of a vertex [m/s] in the solver's precision.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`].
    pub fn velocity(&self, vertex: usize) -> Result<[f64; 3], BodyError> {
        Ok(self.state.v[self.node(vertex)?].into())
    }

    /// Vertices whose position \[m\] satisfies a condition, ascending.
    pub fn vertices_where(&self, mut condition: impl FnMut(Vector) -> bool) -> Vec<usize> {
        let vertices = self.positions().enumerate();
        vertices.filter(|(_, p)| condition(*p)).map(|(i, _)| i).collect()
    }

    /// Bounding box \[m\].
    pub fn aabb(&self) -> Aabb {
        Aabb::from_points(self.state.x.iter().map(to_real))
    }

    /// Volume that the tetrahedra enclose now \[m³\]; sheets and rods enclose none.
    pub fn volume(&self) -> f64 {
        volume(&self.model, &self.state.x)
    }

    // ── For the other rooms of the crate ────────────────────────────────

    /// The step \[s\] whose matrix serves one of `dt`: its own where there is nothing to factor.
    pub(crate) fn matrix_step(&self, dt: f64) -> f64 {
        let is_xpbd = self.settings().solver == Solver::Xpbd;
        if is_xpbd { dt } else { self.state.factor_base.step_near(dt) }
    }

    pub(crate) fn elements(&self) -> Elements<'_> {
        Elements { model: &self.model, materials: &self.materials, activations: &self.activations }
    }

    pub(crate) fn node_mass(&self, node: usize) -> f64 {
        self.masses[node]
    }

    pub(super) fn node(&self, vertex: usize) -> Result<usize, BodyError> {
        self.model.node(vertex).ok_or(BodyError::NoSuchVertex { vertex, vertices: self.vertex_count() })
    }

    pub(super) fn weighted_mean(&self, values: &[Vec3]) -> Vec3 {
        let sum = values.iter().zip(&self.masses).fold(Vec3::zeros(), |a, (p, m)| a + p * *m);
        sum / self.masses.iter().sum::<f64>()
    }
}

/// A pose of the user's, if it is one.
pub(crate) fn check_pose(quantity: &'static str, pose: &Pose) -> Result<(), BodyError> {
    finite(quantity, pose.translation)?;
    rotation(quantity, pose.rotation)
}

/// A rotation of the user's, if it is one.
pub(super) fn rotation(quantity: &'static str, value: Rotation) -> Result<(), BodyError> {
    match value.is_finite() && value.is_normalized() {
        true => Ok(()),
        false => Err(BodyError::NoRotation { quantity, value: value.to_array() }),
    }
}

/// A number of the user's, if it is in its range.
pub(crate) fn in_range(
    quantity: &'static str,
    value: f64,
    wanted: &'static str,
    is_in: bool,
) -> Result<(), BodyError> {
    match is_in {
        true => Ok(()),
        false => Err(BodyError::OutOfRange { quantity, value, wanted }),
    }
}

/// A vector of the user's, widened if it is one.
pub(super) fn finite(quantity: &'static str, value: Vector) -> Result<Vec3, BodyError> {
    match value.is_finite() {
        true => Ok(from_real(value)),
        false => Err(BodyError::NotFinite { quantity, value }),
    }
}
