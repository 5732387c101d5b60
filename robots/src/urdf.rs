//! URDF files: checked, and read by rapier's loader.
//!
//! The loader takes names and numbers as they come and panics on a joint to nowhere, so that everything it reads is looked at
//! first.

use crate::builder::JointSolver;
use crate::error::{RobotError, Warning};
use crate::mimic;
use crate::passive::Passive;
use crate::rigid::{Loaded, RigidJoint, RigidLink, RigidPart, shapes_of};
use crate::xml::{Element, parse};
use rapier3d::glamx::EulerRot;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d_urdf::urdf_rs::Geometry;
use rapier3d_urdf::{UrdfLoaderOptions, UrdfRobot, urdf_rs};
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a URDF text.
pub(crate) fn read(
    text: &str,
    file: &Path,
    folder: &Path,
    options: &UrdfLoaderOptions,
    solver: JointSolver,
) -> Result<RigidPart, RobotError> {
    let document = parse(text, file)?;
    let root = Element::new(document.root_element(), file);
    if root.tag() != "robot" {
        return Err(root.unsupported("a URDF file has a <robot> at its root"));
    }
    let mut warnings = Vec::new();
    let links = named(&root, "link")?;
    let joints = named(&root, "joint")?;
    for link in links.values() {
        check_link(link)?;
    }
    for joint in joints.values() {
        check_joint(joint, &links, &mut warnings)?;
    }
    check_tree(&joints, &links)?;
    let mimics = mimic::read(&joints, solver, &mut warnings)?;
    check_masses(&joints, &links, solver)?;
    for other in root.children().filter(|e| !["link", "joint", "material"].contains(&e.tag())) {
        warnings.push(other.warning("is not taken up"));
    }
    let fail =
        |error: urdf_rs::UrdfError| RobotError::Syntax { place: root.place(), reason: error.to_string() };
    let read = urdf_rs::read_from_string(text).map_err(fail)?;
    let mut robot = UrdfRobot::from_robot(&read, options.clone(), folder);
    place_roots(&mut robot, &read, &options.shift);
    let rigid_links: Vec<RigidLink> = robot
        .links
        .iter()
        .map(|link| {
            let name = read.links[link.urdf_link_index].name.clone();
            let shapes = shapes_of(link.colliders.iter().map(|c| &c.collider));
            RigidLink { name, pose: *link.body.position(), shapes }
        })
        .collect();
    warn_of_lost_shapes(&robot, &read, &links, &mut warnings);
    let rigid_joints = robot.joints.iter().map(|joint| {
        let source = &read.joints[joint.source_urdf_joint_index()];
        let effort = source.limit.effort as f32;
        let (damping, friction) = source.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
        let passive = Passive { damping: damping as f32, friction: friction as f32, ..Default::default() };
        RigidJoint { name: source.name.clone(), effort: (effort > 0.0).then_some(effort), passive }
    });
    Ok(RigidPart {
        joints: rigid_joints.collect(),
        links: rigid_links,
        loaded: Loaded::Urdf(robot),
        gravity: None,
        actuators: Vec::new(),
        mimics,
        warnings,
    })
}

/// Puts what hangs on an empty root by a fixed joint to where the joint has it: the loader takes root and joint out, and forgets
/// the joint's origin.
fn place_roots(robot: &mut UrdfRobot, read: &urdf_rs::Robot, shift: &Pose) {
    let is_root = |number: usize| robot.joints.iter().all(|joint| joint.link2 != number);
    let roots: Vec<usize> = (0..robot.links.len()).filter(|number| is_root(*number)).collect();
    for root in roots {
        let mut name = &read.links[robot.links[root].urdf_link_index].name;
        let mut above = Pose::IDENTITY;
        while let Some(joint) = read.joints.iter().find(|joint| joint.child.link == *name) {
            above = to_pose(&joint.origin) * above;
            name = &joint.parent.link;
        }
        let by = shift * above * shift.inverse();
        let mut moved = vec![root];
        while let Some(link) = moved.pop() {
            let body = &mut robot.links[link].body;
            body.set_position(by * body.position(), false);
            moved.extend(robot.joints.iter().filter(|joint| joint.link1 == link).map(|joint| joint.link2));
        }
    }
}

fn to_pose(origin: &urdf_rs::Pose) -> Pose {
    let [roll, pitch, yaw] = origin.rpy.0.map(|angle| angle as f32);
    let rotation = Rotation::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    Pose::from_parts(Vector::from_array(origin.xyz.0.map(|c| c as f32)), rotation)
}

/// The elements of a kind by their names.
fn named<'a, 'f>(
    root: &Element<'a, 'f>,
    tag: &str,
) -> Result<BTreeMap<&'a str, Element<'a, 'f>>, RobotError> {
    let mut all = BTreeMap::new();
    for element in root.children().filter(|e| e.tag() == tag) {
        let name = element.attribute("name").unwrap_or_default();
        if name.is_empty() {
            return Err(element.bad("name", "missing", "there"));
        }
        if all.insert(name, element).is_some() {
            return Err(element.bad("name", name, "there once"));
        }
    }
    Ok(all)
}

fn check_origin(parent: &Element<'_, '_>) -> Result<(), RobotError> {
    if let Some(origin) = parent.child("origin") {
        origin.array("xyz", [0.0; 3])?;
        origin.array("rpy", [0.0; 3])?;
    }
    Ok(())
}

fn check_link(link: &Element<'_, '_>) -> Result<(), RobotError> {
    if let Some(inertial) = link.child("inertial") {
        check_origin(&inertial)?;
        if let Some(mass) = inertial.child("mass") {
            mass.not_negative("value", 0.0)?;
        }
        if let Some(inertia) = inertial.child("inertia") {
            check_inertia(&inertia)?;
        }
    }
    for shape in link.children().filter(|e| ["collision", "visual"].contains(&e.tag())) {
        check_origin(&shape)?;
        let Some(geometry) = shape.child("geometry") else { continue };
        let Some(solid) = geometry.children().next() else {
            return Err(geometry.unsupported("is empty: leave the element around it out"));
        };
        for key in ["radius", "length"] {
            solid.positive(key, 1.0)?;
        }
        for key in ["size", "scale"] {
            let sizes = solid.array(key, [1.0; 3])?;
            if sizes.iter().any(|s| !(*s > 0.0)) {
                return Err(solid.bad(key, format!("{sizes:?}"), "positive"));
            }
        }
    }
    Ok(())
}

/// Positive semidefinite up to the rounding of six digits.
fn check_inertia(inertia: &Element<'_, '_>) -> Result<(), RobotError> {
    let mut at = [0.0; 6];
    for (value, key) in at.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
        *value = inertia.number(key, 0.0)?;
    }
    let [xx, yy, zz, xy, xz, yz] = at;
    let largest = xx.abs().max(yy.abs()).max(zz.abs());
    let minors = [(xx, yy, xy), (xx, zz, xz), (yy, zz, yz)].map(|(a, b, c)| a * b - c * c);
    let whole = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let is_fine = [xx, yy, zz].iter().all(|d| *d >= 0.0)
        && minors.iter().all(|m| *m >= -1.0e-5 * largest * largest)
        && whole >= -1.0e-5 * largest.powi(3);
    match is_fine {
        true => Ok(()),
        false => Err(inertia.bad("inertia", format!("{at:?}"), "positive semidefinite")),
    }
}

fn end_of<'a>(joint: &Element<'a, '_>, tag: &str) -> &'a str {
    joint.child(tag).and_then(|end| end.attribute("link")).unwrap_or_default()
}

fn check_joint(
    joint: &Element<'_, '_>,
    links: &BTreeMap<&str, Element<'_, '_>>,
    warnings: &mut Vec<Warning>,
) -> Result<(), RobotError> {
    check_origin(joint)?;
    for end in ["parent", "child"] {
        let name = end_of(joint, end);
        if !links.contains_key(name) {
            return Err(joint.bad(end, format!("`{name}`"), "the name of a link"));
        }
    }
    let kind = joint.attribute("type").unwrap_or_default();
    if !["fixed", "revolute", "continuous", "prismatic", "floating", "planar", "spherical"].contains(&kind) {
        return Err(joint.bad("type", format!("`{kind}`"), "a type of joint"));
    }
    if let Some(axis) = joint.child("axis") {
        let along = axis.array("xyz", [1.0, 0.0, 0.0])?;
        if !(along.iter().map(|x| x * x).sum::<f64>() > 1.0e-12) {
            return Err(axis.bad("xyz", format!("{along:?}"), "a direction"));
        }
    }
    let limit = joint.child("limit");
    if ["revolute", "prismatic"].contains(&kind) && limit.is_none() {
        return Err(joint.bad("limit", "missing", "there: a joint without limits is continuous"));
    }
    if let Some(limit) = limit {
        let [lower, upper] = [limit.number("lower", 0.0)?, limit.number("upper", 0.0)?];
        if !(lower <= upper) {
            return Err(limit.bad("lower", lower, "at most upper"));
        }
        limit.not_negative("effort", 0.0)?;
        limit.number("velocity", 0.0)?;
        if limit.attribute("velocity").is_some() {
            warnings.push(joint.warning("its greatest velocity is not kept to"));
        }
    }
    if let Some(dynamics) = joint.child("dynamics") {
        dynamics.not_negative("damping", 0.0)?;
        let friction = dynamics.not_negative("friction", 0.0)?;
        if friction > 0.0 && dynamics.number("damping", 0.0)? > 0.0 {
            warnings.push(joint.warning("its friction is not taken up beside its damping"));
        }
    }
    for tag in ["safety_controller", "calibration"] {
        if joint.child(tag).is_some() {
            warnings.push(joint.warning(format!("<{tag}> is not taken up")));
        }
    }
    Ok(())
}

/// Every link has one parent at the most, and a root above it.
fn check_tree(
    joints: &BTreeMap<&str, Element<'_, '_>>,
    links: &BTreeMap<&str, Element<'_, '_>>,
) -> Result<(), RobotError> {
    let mut above = BTreeMap::new();
    for joint in joints.values() {
        let child = end_of(joint, "child");
        if above.insert(child, joint).is_some() {
            return Err(joint.bad("child", format!("`{child}`"), "the child of one joint only"));
        }
    }
    for joint in joints.values() {
        let mut link = end_of(joint, "child");
        for _ in 0..=links.len() {
            match above.get(link) {
                Some(joint) => link = end_of(joint, "parent"),
                None => break,
            }
        }
        if above.contains_key(link) {
            return Err(joint.bad("parent", format!("`{link}`"), "no descendant of its child"));
        }
    }
    Ok(())
}

/// What moves has a mass, or the step would divide by nought.
fn check_masses(
    joints: &BTreeMap<&str, Element<'_, '_>>,
    links: &BTreeMap<&str, Element<'_, '_>>,
    solver: JointSolver,
) -> Result<(), RobotError> {
    let own = |link: &str| {
        let inertial = links.get(link).and_then(|link| link.child("inertial"));
        let mass = inertial.and_then(|inertial| inertial.child("mass"));
        mass.map_or(Ok(0.0), |mass| mass.number("value", 0.0))
    };
    let is_empty = |link: &str| {
        let has = |tag| links.get(link).is_some_and(|link| link.child(tag).is_some());
        !(has("collision") || has("visual") || has("inertial"))
    };
    for joint in joints.values() {
        let kind = joint.attribute("type").unwrap_or_default();
        let child = end_of(joint, "child");
        let mut mass = own(child)?;
        // In a multibody what hangs below counts too; impulse joints move every body by its own mass.
        let mut below = vec![child];
        while solver == JointSolver::Multibody
            && let Some(link) = below.pop()
        {
            for next in joints.values().filter(|joint| end_of(joint, "parent") == link) {
                mass += own(end_of(next, "child"))?;
                below.push(end_of(next, "child"));
            }
        }
        let is_held = kind == "fixed" && solver == JointSolver::Multibody;
        if !(mass > 0.0) && !is_held && !is_empty(child) {
            return Err(links[child].bad("mass", mass, "positive, as the link moves"));
        }
    }
    Ok(())
}

/// The loader leaves out meshes that it cannot read, and says nothing.
fn warn_of_lost_shapes(
    robot: &UrdfRobot,
    read: &urdf_rs::Robot,
    links: &BTreeMap<&str, Element<'_, '_>>,
    warnings: &mut Vec<Warning>,
) {
    for link in &robot.links {
        let source = &read.links[link.urdf_link_index];
        let meshes = source.collision.iter().filter(|c| matches!(c.geometry, Geometry::Mesh { .. })).count();
        let solids = source.collision.len() - meshes;
        if let Some(element) = links.get(&*source.name)
            && link.colliders.len() < solids + meshes
        {
            let lost = solids + meshes - link.colliders.len();
            warnings
                .push(element.warning(format!("{lost} of its meshes could not be read, and do not collide")));
        }
    }
}
