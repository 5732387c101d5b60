//! Builder of deformable bodies, after rapier's own builders.

use super::body::DeformableBody;
use super::settings::{Fidelity, SolverSettings};
use crate::energy::CavityFilling;
use crate::error::DeformableBodyError;
use crate::fem::{Build, DeformableModel};
use crate::material::DeformableMaterial;
use crate::mesh::{MeshError, Structure, TetMesh};
use parry3d::shape::Shape;
use rapier3d::dynamics::{CoefficientCombineRule, RigidBodyType};
use rapier3d::geometry::InteractionGroups;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::pipeline::{ActiveEvents, ActiveHooks};
use std::fmt;
use std::sync::Arc;

/// Builds a [`DeformableBody`]. Errors of the mesh are kept until [`DeformableBodyBuilder::build`],
/// so that setters chain.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let body = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6, 6, 6])
///     .translation(Vector::Y)
///     .material(DeformableMaterial::new(1.0e6, 0.3))
///     .pinned(|x| x.y > 1.199)
///     .build()?;
/// assert_eq!(body.pinned().len(), 7 * 7);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone)]
#[must_use = "a builder does nothing until it is inserted or built"]
pub struct DeformableBodyBuilder {
    pub(super) model: Result<Arc<DeformableModel>, MeshError>,
    material: DeformableMaterial,
    pub(super) region_materials: Vec<(u32, DeformableMaterial)>,
    pub(super) fillings: Vec<(usize, CavityFilling)>,
    pub(super) twists: Vec<(usize, f64)>,
    settings: SolverSettings,
    pub(super) pose: Pose,
    body_type: RigidBodyType,
    linvel: Vector,
    angvel: Vector,
    pinned: Option<Condition>,
    gravity_scale: f64,
    enabled: bool,
    can_sleep: bool,
    self_contact: bool,
    collision_groups: InteractionGroups,
    friction_combine_rule: CoefficientCombineRule,
    restitution_combine_rule: CoefficientCombineRule,
    active_events: ActiveEvents,
    active_hooks: ActiveHooks,
    contact_force_event_threshold: f32,
    user_data: u128,
}

type Condition = Arc<dyn Fn(Vector) -> bool + Send + Sync>;

/// The mesh would fill pages, and the condition of pins cannot be printed: the number of vertices, and whether there
/// is one.
impl fmt::Debug for DeformableBodyBuilder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeformableBodyBuilder")
            .field("vertices", &self.model.as_ref().map(|model| model.vertex_count()))
            .field("material", &self.material)
            .field("settings", &self.settings)
            .field("pose", &self.pose)
            .field("pinned", &self.pinned.is_some())
            .finish_non_exhaustive()
    }
}

impl DeformableBodyBuilder {
    /// A cuboid of these half extents \[m\], cut into cells of five tetrahedra each.
    pub fn cuboid(half_extents: Vector, cells: [usize; 3]) -> Self {
        Self::from_mesh(TetMesh::cuboid(half_extents.to_array().map(f64::from), cells))
    }

    /// A sheet in the plane of x and z, of these half extents \[m\] and of `thickness` \[m\], cut into triangles as
    /// [`Structure::rectangle`] says. Its solver is given the [`Laplacian`](crate::SystemMatrix::Laplacian); see
    /// [`Solver::Newton`](super::Solver::Newton) for stiff ones.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// // A flag of cotton, half a millimetre.
    /// let cotton = DeformableMaterial::new(5.0e6, 0.3).density(400.0).mass_damping(0.5);
    /// let flag = DeformableBodyBuilder::cloth([0.6, 0.4], [24, 16], 5.0e-4).material(cotton);
    /// let flag = flag.pinned(|x| x.x < -0.599).build()?;
    /// assert!((flag.mass() - 400.0 * 1.2 * 0.8 * 5.0e-4).abs() < 1e-7);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn cloth(half_extents: [f32; 2], cells: [usize; 2], thickness: f32) -> Self {
        let half_extents = half_extents.map(f64::from);
        Self::from_structure(Structure::rectangle(half_extents, cells, thickness.into()))
    }

    /// A rope or rod along a polyline of `points` \[m\], of this `radius` \[m\]. It resists stretch and bending as
    /// a round bar of the material, and no twist. Solved by [`Solver::Newton`](super::Solver::Newton): its matrix is a narrow band.
    pub fn rope(points: &[Vector], radius: f32) -> Self {
        let points: Vec<[f64; 3]> = points.iter().map(|p| p.to_array().map(f64::from)).collect();
        Self::from_structure(Structure::rod(&points, radius.into()))
    }

    /// The edges of a mesh as a mass–spring network, see [`Structure::spring_network`].
    pub fn spring_network(mesh: &TetMesh) -> Self {
        Self::structure(&Structure::spring_network(mesh))
    }

    /// Any mix of tetrahedra, sheets, rods and springs.
    pub fn structure(structure: &Structure) -> Self {
        Self::from_structure(Ok(structure.clone()))
    }

    /// A parry shape filled with tetrahedra of about `cell_size` \[m\], see [`TetMesh::fill_shape`].
    pub fn filled(shape: &dyn Shape, cell_size: f32) -> Self {
        Self::from_mesh(TetMesh::fill_shape(shape, cell_size))
    }

    /// A Gmsh file, see [`TetMesh::read_gmsh`].
    pub fn gmsh(path: impl AsRef<std::path::Path>) -> Self {
        Self::from_mesh(TetMesh::read_gmsh(path))
    }

    /// Any mesh.
    pub fn mesh(mesh: &TetMesh) -> Self {
        Self::new(Ok(Arc::new(DeformableModel::new(mesh))))
    }

    /// A model that other bodies have already: they share their factors too.
    pub fn model(model: Arc<DeformableModel>) -> Self {
        Self::new(Ok(model))
    }

    fn from_mesh(mesh: Result<TetMesh, MeshError>) -> Self {
        Self::new(mesh.map(|mesh| Arc::new(DeformableModel::new(&mesh))))
    }

    fn from_structure(structure: Result<Structure, MeshError>) -> Self {
        Self::new(structure.and_then(|s| DeformableModel::from_structure(&s)).map(Arc::new))
    }

    fn new(model: Result<Arc<DeformableModel>, MeshError>) -> Self {
        let build = model.as_ref().map_or(Build::Solid, |m| m.build());
        Self {
            model,
            material: DeformableMaterial::new(1.0e6, 0.3),
            region_materials: Vec::new(),
            fillings: Vec::new(),
            twists: Vec::new(),
            settings: build.defaults(),
            pose: Pose::IDENTITY,
            body_type: RigidBodyType::Dynamic,
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            pinned: None,
            gravity_scale: 1.0,
            enabled: true,
            can_sleep: true,
            self_contact: false,
            collision_groups: InteractionGroups::all(),
            friction_combine_rule: CoefficientCombineRule::Average,
            restitution_combine_rule: CoefficientCombineRule::Average,
            active_events: ActiveEvents::empty(),
            active_hooks: ActiveHooks::empty(),
            contact_force_event_threshold: 0.0,
            user_data: 0,
        }
    }

    /// Smooths the tetrahedra over their edges and nodes, see [`DeformableModel::smoothed`].
    pub fn smoothed(mut self) -> Self {
        self.model = self.model.map(|model| Arc::new((*model).clone().smoothed()));
        self
    }

    /// Sets the material.
    pub fn material(mut self, material: DeformableMaterial) -> Self {
        self.material = material;
        self
    }

    /// Puts every element into the region that `region` says of the place of its middle \[m\] in the rest shape: see
    /// [`TetMesh::painted`].
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// // A finger with a stiff back.
    /// let finger = DeformableBodyBuilder::cuboid(Vector::new(0.05, 0.01, 0.01), [20, 4, 4])
    ///     .regions(|[_, y, _]| u32::from(y > 0.005))
    ///     .material(DeformableMaterial::new(1.0e5, 0.45).density(1_100.0))
    ///     .region_material(1, DeformableMaterial::new(1.0e9, 0.4).density(1_200.0))
    ///     .build()?;
    /// assert!((finger.mass() / (4.0e-5 * 1_125.0) - 1.0).abs() < 1e-6);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn regions(mut self, region: impl Fn([f64; 3]) -> u32) -> Self {
        self.model = self.model.map(|model| Arc::new(model.painted(region)));
        self
    }

    /// Adds muscle fibres to the tetrahedra, along what `direction` says of the place of their middle \[m\] in the rest shape: see
    /// [`DeformableModel::with_fibres`]. Their stiffness is the material's, by region; what they want
    /// [`DeformableBody::set_activation`] and [`DeformableBody::set_region_activation`] say.
    pub fn fibres(mut self, direction: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.model = self.model.map(|model| Arc::new((*model).clone().with_fibres(direction)));
        self
    }

    /// Sets the direction of the warp in woven sheets: what `direction` says of the place of a triangle's middle \[m\] in the rest shape,
    /// projected on the triangle. See [`DeformableMaterial::orthotropic_sheet`]. A direction that is normal to its triangle is an
    /// error of [`DeformableBodyBuilder::build`].
    pub fn warp(mut self, direction: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.model = self.model.and_then(|model| model.with_warp(direction).map(Arc::new));
        self
    }

    /// Gives a region a material of its own; all others have that of [`DeformableBodyBuilder::material`].
    pub fn region_material(mut self, region: u32, material: DeformableMaterial) -> Self {
        self.region_materials.push((region, material));
        self
    }

    /// Sets the knobs of the solver.
    pub fn settings(mut self, settings: SolverSettings) -> Self {
        self.settings = settings;
        self
    }

    /// Changes some knobs of the solver and leaves the others as they suit what the body is made of.
    pub fn tune(mut self, change: impl FnOnce(&mut SolverSettings)) -> Self {
        change(&mut self.settings);
        self
    }

    /// Sets the knobs of the solver to those of a preset, for what the body is made of. The integrator, which no preset is
    /// about, stays as it was set.
    pub fn fidelity(mut self, fidelity: Fidelity) -> Self {
        let integrator = self.settings.integrator;
        let preset = fidelity.settings(self.model.as_ref().map_or(Build::Solid, |m| m.build()));
        self.settings = preset.integrator(integrator);
        self
    }

    /// Sets the translation \[m\] of the rest mesh into the world.
    pub fn translation(mut self, translation: Vector) -> Self {
        self.pose.translation = translation;
        self
    }

    /// Sets the rotation of the rest mesh into the world, as axis times angle \[rad\].
    pub fn rotation(mut self, angle: Vector) -> Self {
        self.pose.rotation = Rotation::from_scaled_axis(angle);
        self
    }

    /// Sets the pose of the rest mesh in the world.
    pub fn pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Sets what moves the body, see [`DeformableBody::set_body_type`].
    pub fn body_type(mut self, body_type: RigidBodyType) -> Self {
        self.body_type = body_type;
        self
    }

    /// Sets the initial velocity of the centre of mass [m/s].
    pub fn linvel(mut self, linvel: Vector) -> Self {
        self.linvel = linvel;
        self
    }

    /// Sets the initial angular velocity [rad/s].
    pub fn angvel(mut self, angvel: Vector) -> Self {
        self.angvel = angvel;
        self
    }

    /// Pins the vertices whose initial position in the world satisfies a condition.
    pub fn pinned(mut self, condition: impl Fn(Vector) -> bool + Send + Sync + 'static) -> Self {
        self.pinned = Some(Arc::new(condition));
        self
    }

    /// Sets the factor on gravity.
    pub fn gravity_scale(mut self, scale: f64) -> Self {
        self.gravity_scale = scale;
        self
    }

    /// Sets whether the body takes part in the simulation.
    pub fn enabled(mut self, enabled: bool) -> Self {
        self.enabled = enabled;
        self
    }

    /// Whether the body may fall asleep when it lies still; it may if not told otherwise.
    pub fn can_sleep(mut self, can_sleep: bool) -> Self {
        self.can_sleep = can_sleep;
        self
    }

    /// Whether the body collides with itself. Off by default: compact bodies hardly can.
    pub fn self_contact(mut self, self_contact: bool) -> Self {
        self.self_contact = self_contact;
        self
    }

    /// Sets which colliders the body collides with.
    pub fn collision_groups(mut self, groups: InteractionGroups) -> Self {
        self.collision_groups = groups;
        self
    }

    /// Sets how friction combines with a collider's.
    pub fn friction_combine_rule(mut self, rule: CoefficientCombineRule) -> Self {
        self.friction_combine_rule = rule;
        self
    }

    /// Sets how restitution combines with a collider's.
    pub fn restitution_combine_rule(mut self, rule: CoefficientCombineRule) -> Self {
        self.restitution_combine_rule = rule;
        self
    }

    /// Sets which events the body gives rise to, see [`DeformableEventHandler`](crate::DeformableEventHandler).
    pub fn active_events(mut self, events: ActiveEvents) -> Self {
        self.active_events = events;
        self
    }

    /// Sets which hooks are asked about the body, see [`DeformableHooks`](crate::DeformableHooks).
    pub fn active_hooks(mut self, hooks: ActiveHooks) -> Self {
        self.active_hooks = hooks;
        self
    }

    /// Sets the force \[N\] above which the body's contacts give rise to events, see
    /// [`DeformableBody::set_contact_force_event_threshold`].
    pub fn contact_force_event_threshold(mut self, threshold: f32) -> Self {
        self.contact_force_event_threshold = threshold;
        self
    }

    /// Sets the user's data.
    pub fn user_data(mut self, data: u128) -> Self {
        self.user_data = data;
        self
    }

    /// Makes the body.
    ///
    /// # Errors
    /// What is wrong with the mesh or the material, or a pose, velocity or factor on gravity that is not finite.
    pub fn build(&self) -> Result<DeformableBody, DeformableBodyError> {
        self.material.validate()?;
        let mut body = DeformableBody::new(self.model.clone()?, self.material);
        for (region, material) in &self.region_materials {
            body.set_region_material(*region, *material)?;
        }
        body.model()
            .regions()
            .try_for_each(|region| body.check_warp(body.region_material(region), region))?;
        for (cavity, filling) in &self.fillings {
            body.fill_cavity(*cavity, Some(*filling))?;
        }
        for (rod, roll) in &self.twists {
            body.hold_twist(*rod, *roll)?;
        }
        body.teleport(self.pose)?;
        body.set_body_type(self.body_type);
        body.set_vels(self.linvel, self.angvel)?;
        body.set_settings(self.settings);
        body.set_gravity_scale(self.gravity_scale)?;
        body.set_enabled(self.enabled);
        body.set_can_sleep(self.can_sleep);
        body.set_self_contact(self.self_contact);
        body.set_collision_groups(self.collision_groups);
        body.set_friction_combine_rule(self.friction_combine_rule);
        body.set_restitution_combine_rule(self.restitution_combine_rule);
        body.set_active_events(self.active_events);
        body.set_active_hooks(self.active_hooks);
        body.set_contact_force_event_threshold(self.contact_force_event_threshold);
        body.user_data = self.user_data;
        if let Some(condition) = &self.pinned {
            for vertex in body.vertices_where(|x| condition(x)) {
                body.pin(vertex)?;
            }
        }
        Ok(body)
    }
}
