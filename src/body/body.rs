//! One deformable body as its user sees it.

use super::elastic;
use super::model::DeformableModel;
use super::settings::{Acceleration, SolverSettings};
use super::sleep::Sleep;
use super::state::{ContactMemory, DeformableState, History};
use crate::material::{DeformableMaterial, MaterialError};
use crate::math::{Pose64, Vec3, from_real, to_real};
use parry3d::bounding_volume::Aabb;
use rapier3d::dynamics::CoefficientCombineRule;
use rapier3d::geometry::InteractionGroups;
use rapier3d::math::{Pose, Vector};
use std::sync::Arc;
use thiserror::Error;

/// A request that a body cannot fulfil.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BodyError {
    /// No such vertex.
    #[error("vertex {vertex} does not exist: the body has {vertices}")]
    NoSuchVertex {
        /// The index asked for.
        vertex: usize,
        /// Number of vertices of the body.
        vertices: usize,
    },
    /// A state of another mesh.
    #[error("the state has {vertices} vertices, the body {expected}")]
    WrongSize {
        /// Vertices of the state.
        vertices: usize,
        /// Vertices of the body.
        expected: usize,
    },
    /// The vertex is inside of the body.
    #[error("vertex {vertex} is not on the surface")]
    NotOnSurface {
        /// The index asked for.
        vertex: usize,
    },
    /// The vertex is not pinned.
    #[error("vertex {vertex} is not pinned")]
    NotPinned {
        /// The index asked for.
        vertex: usize,
    },
    /// A value that is NaN or infinite.
    #[error("{quantity} is not finite: {value}")]
    NotFinite {
        /// What was to be set.
        quantity: &'static str,
        /// Its value.
        value: Vector,
    },
    /// No vertices to act on.
    #[error("{quantity}: the list of vertices is empty")]
    NoVertices {
        /// What was to be applied.
        quantity: &'static str,
    },
}

/// A vertex held in place, or led along by its user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    pub(crate) node: u32,
    pub(crate) target: Vec3,
    /// Force that holds the vertex \[N\], of the last step.
    pub(crate) force: Vec3,
}

/// Clusters of a body at the most.
const MAX_CLUSTERS: usize = 32;

/// How the last step of a body went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StepReport {
    pub iterations: usize,
    pub residual: f64,
    pub tolerance: f64,
    pub guard_retries: usize,
    pub quarantined: bool,
}

/// A deformable body: a shared model, a state, a material and the settings of its solver. Made by
/// [`DeformableBodyBuilder`](super::DeformableBodyBuilder).
#[derive(Clone, Debug)]
pub struct DeformableBody {
    pub(crate) model: Arc<DeformableModel>,
    pub(crate) state: DeformableState,
    pub(crate) material: DeformableMaterial,
    /// Ascending by node.
    pub(crate) pins: Vec<Pin>,
    /// External force on every node \[N\]; empty while there is none.
    pub(crate) forces: Vec<Vec3>,
    pub(crate) report: StepReport,
    settings: SolverSettings,
    pub(crate) activation: f64,
    gravity_scale: f64,
    enabled: bool,
    pub(super) can_sleep: bool,
    self_contact: bool,
    collision_groups: InteractionGroups,
    friction_combine_rule: CoefficientCombineRule,
    restitution_combine_rule: CoefficientCombineRule,
    /// Free for the user.
    pub user_data: u128,
}

impl DeformableBody {
    pub(super) fn new(model: Arc<DeformableModel>, material: DeformableMaterial) -> Self {
        let state = DeformableState {
            x: model.rest.clone(),
            v: vec![Vec3::zeros(); model.rest.len()],
            contacts: Vec::new(),
            closure: Vec::new(),
            history: History::default(),
            sleep: Sleep::default(),
        };
        Self {
            model,
            state,
            material,
            pins: Vec::new(),
            forces: Vec::new(),
            report: StepReport::default(),
            settings: SolverSettings::default(),
            activation: 1.0,
            gravity_scale: 1.0,
            enabled: true,
            can_sleep: true,
            self_contact: false,
            collision_groups: InteractionGroups::all(),
            friction_combine_rule: CoefficientCombineRule::Average,
            restitution_combine_rule: CoefficientCombineRule::Average,
            user_data: 0,
        }
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
    /// [`BodyError::WrongSize`] when the state belongs to a mesh of another size.
    pub fn restore(&mut self, state: DeformableState) -> Result<(), BodyError> {
        if state.x.len() != self.state.x.len() {
            return Err(BodyError::WrongSize { vertices: state.x.len(), expected: self.state.x.len() });
        }
        self.state = state;
        // Contacts of another mesh of the same size would name nodes that are not on this surface.
        let surface = &self.model.surface.index_of_node;
        let known = |n: &u32| surface.get(*n as usize).is_some_and(|s| *s != u32::MAX);
        let on_surface = |c: &ContactMemory| {
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
        elastic::volume(&self.model, &self.state.x)
    }

    // ── Mass and motion ─────────────────────────────────────────────────

    /// Mass \[kg\].
    pub fn mass(&self) -> f64 {
        self.material.density * self.model.volume
    }

    /// Centre of mass \[m\].
    pub fn center_of_mass(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.x).into()
    }

    /// Velocity of the centre of mass [m/s].
    pub fn linvel(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.v).into()
    }

    /// Linear momentum [kg m/s].
    pub fn linear_momentum(&self) -> [f64; 3] {
        (self.weighted_mean(&self.state.v) * self.mass()).into()
    }

    /// Angular momentum about the centre of mass [kg m²/s].
    pub fn angular_momentum(&self) -> [f64; 3] {
        let centre = self.weighted_mean(&self.state.x);
        let spin = |(n, (x, v)): (usize, (&Vec3, &Vec3))| (x - centre).cross(v) * self.node_mass(n);
        let motion = self.state.x.iter().zip(&self.state.v).enumerate();
        motion.map(spin).sum::<Vec3>().into()
    }

    /// Largest speed of a vertex [m/s].
    pub fn max_speed(&self) -> f64 {
        self.state.v.iter().map(|v| v.norm()).fold(0.0, f64::max)
    }

    /// Kinetic energy \[J\].
    pub fn kinetic_energy(&self) -> f64 {
        let energy = |(n, v): (usize, &Vec3)| 0.5 * self.node_mass(n) * v.norm_squared();
        self.state.v.iter().enumerate().map(energy).sum()
    }

    /// Elastic energy \[J\].
    pub fn elastic_energy(&self) -> f64 {
        let mut unused = vec![Vec3::zeros(); self.state.x.len()];
        let undamped = elastic::StiffnessDamping::default();
        let frame = crate::math::Mat3::identity();
        let x = &self.state.x;
        elastic::add_forces(&self.elements(), &undamped, x, &frame, f64::INFINITY, &mut unused).energy
    }

    /// Sets the velocity of all vertices [m/s].
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_linvel(&mut self, linvel: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let linvel = finite("linear velocity", linvel)?;
        self.state.v.fill(linvel);
        Ok(())
    }

    /// Sets a rigid motion: `linvel` [m/s] of the centre of mass, `angvel` [rad/s] about it.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_vels(&mut self, linvel: Vector, angvel: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let linvel = finite("linear velocity", linvel)?;
        let angvel = finite("angular velocity", angvel)?;
        let centre = self.weighted_mean(&self.state.x);
        for (v, x) in self.state.v.iter_mut().zip(&self.state.x) {
            *v = linvel + angvel.cross(&(x - centre));
        }
        Ok(())
    }

    /// Sets the velocity of one vertex [m/s].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_velocity(&mut self, vertex: usize, velocity: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        self.state.v[node] = finite("velocity", velocity)?;
        Ok(())
    }

    /// Moves one vertex \[m\] without giving it a velocity.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_position(&mut self, vertex: usize, position: [f64; 3]) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        finite("position", to_real(&position.into()))?;
        self.state.x[node] = position.into();
        Ok(())
    }

    /// Moves the body as it is, deformation and all, by a rigid motion; pins move along, velocities
    /// turn, its own contacts are forgotten.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn teleport(&mut self, by: Pose) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        finite("translation", by.translation)?;
        finite("rotation", by.rotation.to_scaled_axis())?;
        let pose = Pose64::from_real(&by);
        self.state.x.iter_mut().for_each(|x| *x = pose.transform(x));
        self.state.v.iter_mut().for_each(|v| *v = pose.rotation * *v);
        self.pins.iter_mut().for_each(|p| p.target = pose.transform(&p.target));
        self.state.contacts.clear();
        self.state.closure.clear();
        Ok(())
    }

    // ── Pins ────────────────────────────────────────────────────────────

    /// Holds a vertex where it is.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`].
    pub fn pin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        let node = self.node(vertex)?;
        let pin = Pin { node: node as u32, target: self.state.x[node], force: Vec3::zeros() };
        match self.pin_place(node) {
            Ok(place) => self.pins[place] = pin,
            Err(place) => self.pins.insert(place, pin),
        }
        Ok(())
    }

    /// Lets a pinned vertex go.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`].
    pub fn unpin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        let node = self.node(vertex)?;
        let place = self.pin_place(node);
        self.pins.remove(place.map_err(|_| BodyError::NotPinned { vertex })?);
        Ok(())
    }

    /// Leads a pinned vertex: it reaches `target` \[m\] at the end of the next step.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`], [`BodyError::NotFinite`].
    pub fn move_pin(&mut self, vertex: usize, target: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let node = self.node(vertex)?;
        let place = self.pin_place(node);
        let place = place.map_err(|_| BodyError::NotPinned { vertex })?;
        self.pins[place].target = finite("pin target", target)?;
        Ok(())
    }

    /// The pinned vertices.
    pub fn pinned(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.pins.iter().map(|p| self.model.vertex(p.node as usize))
    }

    /// Force \[N\] with which the pins held the body in the last step.
    pub fn pin_force(&self) -> [f64; 3] {
        self.pins.iter().map(|p| p.force).sum::<Vec3>().into()
    }

    // ── Forces ──────────────────────────────────────────────────────────

    /// Adds a force \[N\], shared equally by the vertices. Like rapier's, it persists until
    /// [`DeformableBody::reset_forces`].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`], [`BodyError::NoVertices`]; nothing is
    /// applied then.
    pub fn add_force(&mut self, vertices: &[usize], force: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let share = self.share("force", vertices, force)?;
        self.forces.resize(self.state.x.len(), Vec3::zeros());
        for &vertex in vertices {
            let node = self.node(vertex)?;
            self.forces[node] += share;
        }
        Ok(())
    }

    /// Removes all forces added so far.
    pub fn reset_forces(&mut self) {
        self.wake_up();
        self.forces.clear();
    }

    /// Applies an impulse [N s], shared equally by the vertices, at once.
    ///
    /// # Errors
    /// As [`DeformableBody::add_force`].
    pub fn apply_impulse(&mut self, vertices: &[usize], impulse: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let share = self.share("impulse", vertices, impulse)?;
        for &vertex in vertices {
            let node = self.node(vertex)?;
            let mass = self.node_mass(node);
            self.state.v[node] += share / mass;
        }
        Ok(())
    }

    fn share(&self, quantity: &'static str, vertices: &[usize], total: Vector) -> Result<Vec3, BodyError> {
        for &vertex in vertices {
            self.node(vertex)?;
        }
        if vertices.is_empty() {
            return Err(BodyError::NoVertices { quantity });
        }
        Ok(finite(quantity, total)? / vertices.len() as f64)
    }

    // ── Settings ────────────────────────────────────────────────────────

    /// The material.
    pub fn material(&self) -> &DeformableMaterial {
        &self.material
    }

    /// Changes the material. The next step makes a new factor.
    ///
    /// # Errors
    /// [`MaterialError`]; the material stays as it was then.
    pub fn set_material(&mut self, material: DeformableMaterial) -> Result<(), MaterialError> {
        self.wake_up();
        material.validate()?;
        self.material = material;
        Ok(())
    }

    /// The knobs of the solver.
    pub fn settings(&self) -> &SolverSettings {
        &self.settings
    }

    /// Sets the knobs of the solver; out-of-range ones are brought into range.
    pub fn set_settings(&mut self, settings: SolverSettings) {
        self.wake_up();
        let mut settings = settings;
        settings.max_iterations = settings.max_iterations.max(1);
        settings.clusters = settings.clusters.min(MAX_CLUSTERS);
        // NaN too becomes zero: iterate to the limit.
        settings.tolerance = settings.tolerance.max(0.0);
        match &mut settings.acceleration {
            Acceleration::Lbfgs { window } | Acceleration::Anderson { window } => {
                *window = (*window).clamp(1, 16);
            }
            Acceleration::Chebyshev { radius } => {
                *radius = if radius.is_nan() { 0.0 } else { radius.clamp(0.0, 0.9999) };
            }
            Acceleration::None => {}
        }
        self.settings = settings;
    }

    /// Stretch that muscle fibres want to have [–]: one at rest, less when they contract.
    pub fn activation(&self) -> f64 {
        self.activation
    }

    /// Sets the stretch that muscle fibres want to have; brought into 0 to 10, one if it is no number.
    pub fn set_activation(&mut self, stretch: f64) {
        self.wake_up();
        self.activation = if stretch.is_nan() { 1.0 } else { stretch.clamp(0.0, 10.0) };
    }

    /// Factor on gravity.
    pub fn gravity_scale(&self) -> f64 {
        self.gravity_scale
    }

    /// Sets the factor on gravity; a non-finite one is taken as zero.
    pub fn set_gravity_scale(&mut self, scale: f64) {
        self.wake_up();
        self.gravity_scale = if scale.is_finite() { scale } else { 0.0 };
    }

    /// Whether the body takes part in the simulation.
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Takes the body out of the simulation, or back in.
    pub fn set_enabled(&mut self, enabled: bool) {
        self.wake_up();
        self.enabled = enabled;
        self.report.quarantined &= !enabled;
    }

    /// Whether the last step had to be undone because the state became non-finite; the body is
    /// then disabled and stays where it was. [`DeformableBody::set_enabled`] ends it.
    pub fn is_quarantined(&self) -> bool {
        self.report.quarantined
    }

    /// Whether the body collides with itself.
    pub fn self_contact(&self) -> bool {
        self.self_contact
    }

    /// Lets the body collide with itself: for slender ones, which may fold.
    pub fn set_self_contact(&mut self, self_contact: bool) {
        self.wake_up();
        self.self_contact = self_contact;
    }

    /// Which colliders and deformable bodies the body collides with, by rapier's rules.
    pub fn collision_groups(&self) -> InteractionGroups {
        self.collision_groups
    }

    /// Sets which colliders and deformable bodies the body collides with.
    pub fn set_collision_groups(&mut self, groups: InteractionGroups) {
        self.wake_up();
        self.collision_groups = groups;
    }

    /// How friction combines with that of what it touches.
    pub fn friction_combine_rule(&self) -> CoefficientCombineRule {
        self.friction_combine_rule
    }

    /// Sets how friction combines with that of what it touches.
    pub fn set_friction_combine_rule(&mut self, rule: CoefficientCombineRule) {
        self.wake_up();
        self.friction_combine_rule = rule;
    }

    /// How restitution combines with that of what it touches.
    pub fn restitution_combine_rule(&self) -> CoefficientCombineRule {
        self.restitution_combine_rule
    }

    /// Sets how restitution combines with that of what it touches.
    pub fn set_restitution_combine_rule(&mut self, rule: CoefficientCombineRule) {
        self.wake_up();
        self.restitution_combine_rule = rule;
    }

    // ── How the last step went ──────────────────────────────────────────

    /// Global iterations of the last step.
    pub fn last_iterations(&self) -> usize {
        self.report.iterations
    }

    /// Largest residual force on a node after the last step \[N\].
    pub fn last_residual(&self) -> f64 {
        self.report.residual
    }

    /// Whether the last step ended below its tolerance.
    pub fn last_converged(&self) -> bool {
        self.report.residual <= self.report.tolerance
    }

    /// How often the last step had to be done again because it would have raised the energy: without the quasi-Newton
    /// update, or with a scaled metric.
    pub fn last_guard_retries(&self) -> usize {
        self.report.guard_retries
    }

    // ── For the other rooms of the crate ────────────────────────────────

    pub(crate) fn elements(&self) -> elastic::Elements<'_> {
        elastic::Elements { model: &self.model, material: &self.material, activation: self.activation }
    }

    pub(crate) fn node_mass(&self, node: usize) -> f64 {
        self.material.density * self.model.node_volumes[node]
    }

    pub(super) fn node(&self, vertex: usize) -> Result<usize, BodyError> {
        self.model.node(vertex).ok_or(BodyError::NoSuchVertex { vertex, vertices: self.vertex_count() })
    }

    fn pin_place(&self, node: usize) -> Result<usize, usize> {
        self.pins.binary_search_by_key(&(node as u32), |p| p.node)
    }

    fn weighted_mean(&self, values: &[Vec3]) -> Vec3 {
        let weights = &self.model.node_volumes;
        let sum = values.iter().zip(weights).fold(Vec3::zeros(), |a, (p, w)| a + p * *w);
        sum / weights.iter().sum::<f64>()
    }
}

fn finite(quantity: &'static str, value: Vector) -> Result<Vec3, BodyError> {
    match value.is_finite() {
        true => Ok(from_real(value)),
        false => Err(BodyError::NotFinite { quantity, value }),
    }
}
