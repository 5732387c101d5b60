//! From files to a robot in a world.

use crate::error::{RobotError, read_text};
use crate::hooks::RobotHooks;
use crate::motor::{change_joint, read_joint, single_axis};
use crate::part::PlannedPart;
use crate::rigid::{Inserted, RigidJoint, RigidPart, insert};
use crate::robot::{Robot, RobotJoint, RobotLink, RobotPart};
use crate::{mimic, passive};
use crate::{mjcf, part, urdf};
use foible3d::{AttachTo, DeformableWorld};
use rapier3d::prelude::*;
use rapier3d_mjcf::MjcfLoaderOptions;
use rapier3d_urdf::UrdfLoaderOptions;
use std::path::{Path, PathBuf};

/// What solves a robot's joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointSolver {
    /// Coordinates of the joints: links cannot come apart.
    #[default]
    Multibody,
    /// Forces between free bodies: links may come apart a little, and loops are allowed.
    Impulse,
}

/// A text and where it is from.
#[derive(Clone, Debug)]
enum Source {
    File(PathBuf),
    Text { text: String, folder: PathBuf },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Urdf,
    Mjcf,
}

/// Builds a [`Robot`] from a URDF or MJCF file and a file of soft parts.
///
/// ```
/// use foible_robots::RobotBuilder;
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// physics.gravity = Vector::NEG_Z * 9.81;
/// let robot = RobotBuilder::mjcf("models/hand.xml").insert(&mut physics, &mut deformables)?;
/// robot.set_motor_position(&mut physics, "palm_lift", 0.05, 2.0e3, 1.0e2)?;
/// for _ in 0..10 {
///     robot.step(&mut physics, &mut deformables);
/// }
/// # Ok::<(), foible_robots::RobotError>(())
/// ```
#[derive(Clone, Debug)]
#[must_use = "a builder does nothing until it is inserted"]
pub struct RobotBuilder {
    format: Format,
    robot: Source,
    parts: Option<Source>,
    pose: Pose,
    fixed_base: bool,
    solver: JointSolver,
    self_contacts: bool,
    collider: ColliderBuilder,
}

impl RobotBuilder {
    /// A robot from a URDF file.
    pub fn urdf(file: impl AsRef<Path>) -> Self {
        Self::new(Format::Urdf, Source::File(file.as_ref().to_path_buf()))
    }

    /// A robot from a URDF text; files that it names are in `folder`.
    pub fn urdf_text(text: impl Into<String>, folder: impl AsRef<Path>) -> Self {
        let source = Source::Text { text: text.into(), folder: folder.as_ref().to_path_buf() };
        Self::new(Format::Urdf, source)
    }

    /// A robot from an MJCF file.
    pub fn mjcf(file: impl AsRef<Path>) -> Self {
        Self::new(Format::Mjcf, Source::File(file.as_ref().to_path_buf()))
    }

    /// A robot from an MJCF text; files that it names are in `folder`.
    pub fn mjcf_text(text: impl Into<String>, folder: impl AsRef<Path>) -> Self {
        let source = Source::Text { text: text.into(), folder: folder.as_ref().to_path_buf() };
        Self::new(Format::Mjcf, source)
    }

    fn new(format: Format, robot: Source) -> Self {
        Self {
            format,
            robot,
            parts: None,
            pose: Pose::IDENTITY,
            fixed_base: false,
            solver: JointSolver::Multibody,
            self_contacts: true,
            // Masses are those of the file.
            collider: ColliderBuilder::default().density(0.0),
        }
    }

    /// Adds the soft parts of a TOML file, beside those of an MJCF file.
    pub fn soft_parts(mut self, file: impl AsRef<Path>) -> Self {
        self.parts = Some(Source::File(file.as_ref().to_path_buf()));
        self
    }

    /// The same from a text; mesh files that it names are in `folder`.
    pub fn soft_parts_text(mut self, text: impl Into<String>, folder: impl AsRef<Path>) -> Self {
        self.parts = Some(Source::Text { text: text.into(), folder: folder.as_ref().to_path_buf() });
        self
    }

    /// Sets where the file's origin is in the world.
    pub fn pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Whether links that hang on nothing are fixed in the world. Off: they move, but where the file fixes them.
    pub fn fixed_base(mut self, fixed: bool) -> Self {
        self.fixed_base = fixed;
        self
    }

    /// Sets what solves the joints.
    pub fn joint_solver(mut self, solver: JointSolver) -> Self {
        self.solver = solver;
        self
    }

    /// Whether links of a multibody collide with one another; those that share a joint never do. On by default.
    pub fn self_contacts(mut self, on: bool) -> Self {
        self.self_contacts = on;
        self
    }

    /// Sets what the links' colliders have that the file does not tell: friction and groups of URDF for instance. Give it no
    /// density where the file has masses.
    pub fn collider(mut self, blueprint: ColliderBuilder) -> Self {
        self.collider = blueprint;
        self
    }

    /// Reads the files and puts the robot into the worlds. Nothing is put in where something is wrong.
    ///
    /// # Errors
    /// What is wrong with the files, with place and value.
    pub fn insert(
        &self,
        physics: &mut PhysicsWorld,
        deformables: &mut DeformableWorld,
    ) -> Result<Robot, RobotError> {
        let (rigid, mut parts) = self.read_robot()?;
        if let Some(source) = &self.parts {
            let (text, file, folder) = open(source, "<soft parts>")?;
            parts.extend(part::plan(&text, &file, &folder, &rigid.links)?);
        }
        put_in(rigid, parts, physics, deformables, self.solver, self.self_contacts)
    }

    fn read_robot(&self) -> Result<(RigidPart, Vec<PlannedPart>), RobotError> {
        match self.format {
            Format::Urdf => {
                let (text, file, folder) = open(&self.robot, "<urdf>")?;
                let options = UrdfLoaderOptions {
                    make_roots_fixed: self.fixed_base,
                    shift: self.pose,
                    collider_blueprint: self.collider.clone(),
                    ..Default::default()
                };
                Ok((urdf::read(&text, &file, &folder, &options, self.solver)?, Vec::new()))
            }
            Format::Mjcf => {
                let (text, file, folder) = open(&self.robot, "<mjcf>")?;
                let options = MjcfLoaderOptions {
                    make_roots_fixed: self.fixed_base,
                    // A floor is part of the scene.
                    skip_plane_geoms: false,
                    collider_blueprint: self.collider.clone(),
                    ..Default::default()
                };
                mjcf::read(&text, &file, &folder, options, self.pose, self.solver)
            }
        }
    }
}

/// Text, name and folder of a source.
fn open(source: &Source, without_name: &str) -> Result<(String, PathBuf, PathBuf), RobotError> {
    match source {
        Source::File(file) => {
            let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
            Ok((read_text(file)?, file.clone(), folder))
        }
        Source::Text { text, folder } => Ok((text.clone(), PathBuf::from(without_name), folder.clone())),
    }
}

fn put_in(
    rigid: RigidPart,
    parts: Vec<PlannedPart>,
    physics: &mut PhysicsWorld,
    deformables: &mut DeformableWorld,
    solver: JointSolver,
    self_contacts: bool,
) -> Result<Robot, RobotError> {
    let inserted = insert(rigid.loaded, physics, solver, self_contacts);
    let joints = name_joints(&rigid.joints, &inserted, physics);
    let mut warnings = rigid.warnings;
    mimic::couple(rigid.mimics, &joints, physics, &mut warnings);
    let mut hooks = RobotHooks::new(inserted.hooks);
    let mut put = Vec::with_capacity(parts.len());
    for part in parts {
        put.push(put_part(part, &inserted.links, physics, deformables, &mut hooks)?);
    }
    let links = rigid.links.into_iter().zip(inserted.links).filter_map(|(link, handles)| {
        handles.map(|(body, colliders)| RobotLink { name: link.name, body, colliders })
    });
    let links = links.collect();
    let actuators = rigid.actuators;
    Ok(Robot { links, joints, actuators, parts: put, hooks, gravity: rigid.gravity, warnings })
}

fn name_joints(joints: &[RigidJoint], inserted: &Inserted, physics: &mut PhysicsWorld) -> Vec<RobotJoint> {
    let mut named = Vec::with_capacity(joints.len());
    for (joint, inserted) in joints.iter().zip(&inserted.joints) {
        let Some((handle, parent, child)) = *inserted else { continue };
        let axis = read_joint(physics, handle).and_then(single_axis);
        let passive = passive::take(physics, handle, axis, joint.passive);
        let Some(data) = change_joint(physics, handle) else { continue };
        let limits = axis.and_then(|axis| data.limits(axis)).map(|limits| [limits.min, limits.max]);
        if let (Some(axis), Some(effort)) = (axis, joint.effort) {
            data.set_motor_max_force(axis, effort);
        }
        if let Some(axis) = axis {
            passive::set_rest(data, axis, &passive);
        }
        named.push(RobotJoint {
            name: joint.name.clone(),
            handle,
            parent,
            child,
            axis,
            limits,
            effort: joint.effort,
            passive,
        });
    }
    passive::make_mass_matrices(physics, named.iter().map(|joint| joint.handle));
    named
}

fn put_part(
    part: PlannedPart,
    links: &[Option<(RigidBodyHandle, Vec<ColliderHandle>)>],
    physics: &PhysicsWorld,
    deformables: &mut DeformableWorld,
    hooks: &mut RobotHooks,
) -> Result<RobotPart, RobotError> {
    let handle_of = |number: usize| links.get(number)?.as_ref().map(|(body, _)| *body);
    let PlannedPart { name, place, mut body, link, attached, ignored } = part;
    let link = link.and_then(handle_of);
    let apart: Vec<RigidBodyHandle> =
        link.into_iter().chain(ignored.into_iter().filter_map(handle_of)).collect();
    if !apart.is_empty() {
        body.set_active_hooks(body.active_hooks() | ActiveHooks::FILTER_CONTACT_PAIRS);
    }
    let body = deformables.bodies.insert_body(body);
    apart.into_iter().for_each(|link| hooks.keep_apart(body, link));
    let carrier = link.and_then(|link| Some((link, *physics.bodies.get(link)?.position())));
    let attachment = match carrier {
        Some((link, pose)) if !attached.is_empty() => {
            let attachment = deformables.bodies.attach(body, &attached, AttachTo::RigidBody(link, pose));
            let fail = |source| RobotError::Part { place, part: name.clone(), source };
            Some(attachment.map_err(fail)?)
        }
        _ => None,
    };
    Ok(RobotPart { name, body, link, attachment })
}
