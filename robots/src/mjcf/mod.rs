//! MJCF files: the rigid part by rapier's loader, and what it drops, flexible bodies, out of the same XML.

mod flex;
mod flex_mesh;
mod flex_part;
mod flexcomp;
mod pins;
mod rotation;
mod tree;

use crate::actuator::{self, RobotActuator};
use crate::builder::JointSolver;
use crate::error::{RobotError, Warning};
use crate::motor::single_axis;
use crate::part::PlannedPart;
use crate::passive::Passive;
use crate::rigid::{Loaded, RigidJoint, RigidLink, RigidPart, shapes_of};
use crate::xml::{Element, parse};
use rapier3d::math::Pose;
use rapier3d_mjcf::mjcf_rs::model::Model;
use rapier3d_mjcf::{MjcfLoaderOptions, MjcfRobot};
use std::path::{Path, PathBuf};

/// What the flexible bodies' elements depend on elsewhere in the file.
pub(super) struct Settings<'a> {
    model: &'a Model,
    folder: &'a Path,
}

impl Settings<'_> {
    /// Where a mesh file is.
    fn mesh_file(&self, file: &str) -> PathBuf {
        let compiler = &self.model.compiler;
        let folder = compiler.mesh_dir.as_ref().or(compiler.asset_dir.as_ref());
        folder.map_or_else(|| self.folder.join(file), |folder| self.folder.join(folder).join(file))
    }
}

/// Reads an MJCF text: the rigid part, and the flexible bodies in their places.
pub(crate) fn read(
    text: &str,
    file: &Path,
    folder: &Path,
    options: MjcfLoaderOptions,
    pose: Pose,
    solver: JointSolver,
) -> Result<(RigidPart, Vec<PlannedPart>), RobotError> {
    let mut warnings = Vec::new();
    let taken_out = take_out_flexes(text, file, folder, &options, &mut warnings)?;
    let (text, flexes) = match &taken_out {
        Some(taken_out) => (&taken_out.text[..], &taken_out.flexes[..]),
        None => (text, &[][..]),
    };
    let document = parse(text, file)?;
    let root = Element::new(document.root_element(), file);
    let fail =
        |error: &dyn std::fmt::Display| RobotError::Syntax { place: root.place(), reason: error.to_string() };
    let model = Model::from_str(text, folder).map_err(|error| fail(&error))?;
    let mut robot = MjcfRobot::from_model(&model, options, folder);
    robot.append_transform(&pose);
    check_bodies(&robot, &model, &root)?;
    if let Some(spacer) = robot.bodies.iter().find(|body| body.is_intermediate)
        && solver == JointSolver::Impulse
    {
        let body = tree::body_named(&root, model.bodies[spacer.mjcf_body_id].body.name.as_deref());
        return Err(body.unsupported("several joints of one body want multibody joints"));
    }
    let settings = Settings { model: &model, folder };
    let mut found = tree::Found::default();
    tree::walk(&root, &settings, &mut found)?;
    warnings.append(&mut found.warnings);
    let mut parts = Vec::with_capacity(found.flexcomps.len() + flexes.len());
    for flexcomp in found.flexcomps.iter().chain(flexes) {
        let link = link_of(&robot, &model, flexcomp)?;
        let carrier = if link == 0 { pose } else { *robot.bodies[link].body.position() };
        parts.push(flex_part::plan(flexcomp, (link > 0).then_some(link), carrier, &settings, &mut warnings)?);
    }
    warn_of_others(&model, &root, &mut warnings);
    let is_single = |name: &str| {
        let joint = robot.joints.iter().find(|joint| joint.name.as_deref() == Some(name));
        joint.is_some_and(|joint| single_axis(&joint.joint).is_some())
    };
    let actuators = actuator::read(&model, &root, is_single, &mut warnings);
    warn_of_lost_shapes(&robot, &model, &root, &mut warnings);
    if pose != Pose::IDENTITY && !robot.bodies[0].colliders.is_empty() {
        warnings
            .push(root.warning("shapes of the world stay where the file has them: the pose moves bodies"));
    }
    Ok((rigid_part(robot, actuators, warnings), parts))
}

/// Looks at the text, and takes out of it what MuJoCo made of flexible bodies.
fn take_out_flexes(
    text: &str,
    file: &Path,
    folder: &Path,
    options: &MjcfLoaderOptions,
    warnings: &mut Vec<Warning>,
) -> Result<Option<flex::TakenOut>, RobotError> {
    let document = parse(text, file)?;
    let root = Element::new(document.root_element(), file);
    if root.tag() != "mujoco" {
        return Err(root.unsupported("an MJCF file has a <mujoco> at its root"));
    }
    tree::check_numbers(&root)?;
    flex::take_out(&root, text, folder, options, warnings)
}

/// Links and joints in the loader's order.
fn rigid_part(robot: MjcfRobot, actuators: Vec<RobotActuator>, warnings: Vec<Warning>) -> RigidPart {
    let links = robot.bodies.iter().enumerate().map(|(number, body)| RigidLink {
        name: body.name.clone().unwrap_or_else(|| unnamed(number)),
        pose: *body.body.position(),
        shapes: shapes_of(body.colliders.iter()),
    });
    let joints = robot.joints.iter().map(|joint| {
        let passive = Passive {
            stiffness: joint.spring_stiffness_per_dof,
            damping: joint.damping_per_dof,
            rest: joint.spring_ref,
            friction: joint.frictionloss_per_dof,
            is_made_later: joint.springdamper.is_some(),
        };
        RigidJoint { name: joint.name.clone().unwrap_or_default(), effort: None, passive }
    });
    RigidPart {
        links: links.collect(),
        joints: joints.collect(),
        gravity: Some(robot.gravity),
        actuators,
        // Its couplings are taken up by the loader.
        mimics: Vec::new(),
        warnings,
        loaded: Loaded::Mjcf(Box::new(robot)),
    }
}

fn unnamed(number: usize) -> String {
    if number == 0 { "world".to_string() } else { format!("body {number}") }
}

/// The number of the body that carries a flexible one, in rapier's loader.
fn link_of(robot: &MjcfRobot, model: &Model, flexcomp: &flexcomp::Flexcomp) -> Result<usize, RobotError> {
    let parent = match &flexcomp.parent {
        tree::Parent::Number(number) => Some(*number),
        tree::Parent::Name(name) => model.body_id_by_name(name),
    };
    let is_it = |body: &rapier3d_mjcf::MjcfBody| Some(body.mjcf_body_id) == parent && !body.is_intermediate;
    robot.bodies.iter().position(is_it).ok_or_else(|| RobotError::Unsupported {
        place: flexcomp.place.clone(),
        element: format!("flexcomp `{}`", flexcomp.name),
        what: "the body around it has not been found: give that body a name".to_string(),
    })
}

/// What moves has a mass, and everything a place.
fn check_bodies(robot: &MjcfRobot, model: &Model, root: &Element<'_, '_>) -> Result<(), RobotError> {
    // A joint moves what hangs below its body too.
    let mut below: Vec<f64> = vec![0.0; model.bodies.len()];
    for body in &robot.bodies {
        below[body.mjcf_body_id] += f64::from(body.mass);
        let pose = body.body.position();
        if !(pose.translation.is_finite() && pose.rotation.is_finite() && body.mass.is_finite()) {
            return Err(tree::body_named(root, body.name.as_deref()).bad("pos", "not finite", "finite"));
        }
    }
    for number in (1..model.bodies.len()).rev() {
        let entry = &model.bodies[number];
        let name = entry.body.name.as_deref();
        if !entry.body.joints.is_empty() && !(below[number] > 0.0) {
            let mass = below[number];
            return Err(tree::body_named(root, name).bad("mass", mass, "positive, as the body moves"));
        }
        if let Some(parent) = entry.parent.filter(|parent| *parent < number) {
            below[parent] += below[number];
        }
    }
    Ok(())
}

/// The loader leaves out shapes whose meshes it cannot read, and writes that to the log only.
fn warn_of_lost_shapes(
    robot: &MjcfRobot,
    model: &Model,
    root: &Element<'_, '_>,
    warnings: &mut Vec<Warning>,
) {
    for body in robot.bodies.iter().filter(|body| !body.is_intermediate) {
        let geoms = &model.bodies[body.mjcf_body_id].body.geoms;
        let solid = geoms.iter().filter(|geom| geom.contype != 0 || geom.conaffinity != 0).count();
        let lost = solid.saturating_sub(body.colliders.len());
        if lost > 0 {
            let element = tree::body_named(root, body.name.as_deref());
            warnings
                .push(element.warning(format!("{lost} of its shapes could not be made, and do not collide")));
        }
    }
}

/// Rapier's loader reads these, and leaves them to its user.
fn warn_of_others(model: &Model, root: &Element<'_, '_>, warnings: &mut Vec<Warning>) {
    let read = [("sensor", model.sensors.len()), ("keyframe", model.keyframes.len())];
    for (tag, count) in read {
        if count > 0 {
            let element = root.child(tag).unwrap_or(*root);
            let what = format!("{count} of them are not taken up");
            warnings.push(Warning { place: element.place(), element: tag.to_string(), what });
        }
    }
}
