//! The way through the elements of an MJCF file, and of those that it includes, in the order in which the loader numbers bodies.

use super::flexcomp::Flexcomp;
use super::{Settings, rotation};
use crate::error::{RobotError, Warning, read_text};
use crate::xml::{Element, parse};
use rapier3d::math::Pose;
use std::path::PathBuf;

/// Deepest way of files that include files.
const DEEPEST: usize = 16;
/// Attributes that are numbers wherever they stand in the elements that the loader reads.
const NUMBERS: [&str; 38] = [
    "ctrlrange",
    "forcerange",
    "gear",
    "kp",
    "kv",
    "gainprm",
    "biasprm",
    "pos",
    "quat",
    "axisangle",
    "euler",
    "xyaxes",
    "zaxis",
    "size",
    "fromto",
    "mass",
    "density",
    "friction",
    "diaginertia",
    "fullinertia",
    "axis",
    "range",
    "stiffness",
    "damping",
    "armature",
    "frictionloss",
    "ref",
    "springref",
    "springdamper",
    "margin",
    "gap",
    "gravity",
    "timestep",
    "gravcomp",
    "settotalmass",
    "inertiadensity",
    "boundmass",
    "boundinertia",
];

/// The body around an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Parent {
    /// By the loader's count of bodies.
    Number(usize),
    /// By its name: what is attached from other models is counted too.
    Name(String),
}

/// What has been found.
#[derive(Default)]
pub(super) struct Found {
    pub flexcomps: Vec<Flexcomp>,
    pub warnings: Vec<Warning>,
    bodies: usize,
    /// Bodies that have not been counted are in the loader's model.
    has_uncounted: bool,
    depth: usize,
}

/// What is around an element.
#[derive(Clone)]
struct Around {
    parent: Parent,
    /// Of frames, against the body.
    frame: Pose,
}

/// Looks at all numbers that the loader reads: it takes infinite ones, and panics on some of them.
pub(super) fn check_numbers(root: &Element<'_, '_>) -> Result<(), RobotError> {
    for node in root.node.descendants().filter(|node| node.is_element()) {
        let element = Element::new(node, root.file);
        for key in NUMBERS {
            // Keyframes and hooks of actuators use the same words for other things.
            if element.attribute(key).is_some_and(|text| text != "auto") {
                element.numbers(key)?;
            }
        }
        if let Some(order) = element.attribute("eulerseq")
            && !(order.len() == 3 && order.bytes().all(|b| b"xyzXYZ".contains(&b)))
        {
            return Err(element.bad("eulerseq", order, "three of x, y, z, X, Y and Z"));
        }
    }
    Ok(())
}

/// The element of a body, or the root where there is none of that name.
pub(super) fn body_named<'a, 'f>(root: &Element<'a, 'f>, name: Option<&str>) -> Element<'a, 'f> {
    let is_it = |node: &roxmltree::Node<'a, 'a>| {
        node.has_tag_name("body") && name.is_some() && node.attribute("name") == name
    };
    let found = root.node.descendants().find(is_it);
    found.map_or(*root, |node| Element::new(node, root.file))
}

/// Finds the flexible bodies below the root of a file.
pub(super) fn walk(
    root: &Element<'_, '_>,
    settings: &Settings<'_>,
    found: &mut Found,
) -> Result<(), RobotError> {
    // The loader takes up included files as it meets them, and bodies last.
    for element in root.children() {
        match element.tag() {
            "include" => include(&element, settings, found)?,
            "deformable" => {
                // Those of the file itself have been taken out.
                let others = element.children().filter(|e| found.depth > 0 || e.tag() != "flex");
                found.warnings.extend(others.map(|e| e.warning("is not taken up")));
            }
            "equality" => {
                let flexible = |e: &Element<'_, '_>| e.tag().starts_with("flex");
                found
                    .warnings
                    .extend(element.children().filter(flexible).map(|e| e.warning("is not taken up")));
            }
            _ => {}
        }
    }
    for world in root.children().filter(|e| e.tag() == "worldbody") {
        let around = Around { parent: Parent::Number(0), frame: Pose::IDENTITY };
        walk_body(&world, &around, settings, found)?;
    }
    Ok(())
}

fn include(element: &Element<'_, '_>, settings: &Settings<'_>, found: &mut Found) -> Result<(), RobotError> {
    let Some(name) = element.attribute("file") else {
        return Err(element.bad("file", "missing", "there"));
    };
    if found.depth >= DEEPEST {
        return Err(element.unsupported("files include one another too deep"));
    }
    let file: PathBuf = settings.folder.join(name);
    let text = read_text(&file)?;
    let document = parse(&text, &file)?;
    let folder = file.parent().unwrap_or(settings.folder);
    found.depth += 1;
    let root = Element::new(document.root_element(), &file);
    walk(&root, &Settings { model: settings.model, folder }, found)?;
    found.depth -= 1;
    let known = |tag: &str| {
        ["compiler", "option", "size", "statistic", "visual", "custom", "extension", "default", "asset"]
            .contains(&tag)
            || ["include", "worldbody", "contact", "equality", "tendon", "actuator", "sensor", "keyframe"]
                .contains(&tag)
            || tag == "deformable"
    };
    for lost in root.children().filter(|e| !known(e.tag())) {
        found.warnings.push(lost.warning("is not taken up: included files hold whole sections"));
    }
    Ok(())
}

fn walk_body(
    body: &Element<'_, '_>,
    around: &Around,
    settings: &Settings<'_>,
    found: &mut Found,
) -> Result<(), RobotError> {
    for element in body.children() {
        match element.tag() {
            "body" => {
                found.bodies += 1;
                let parent = match (element.attribute("name"), found.has_uncounted) {
                    (Some(name), true) => Parent::Name(name.to_string()),
                    // Behind bodies that were not counted an unnamed one is not found, which is an error then.
                    (None, true) => Parent::Number(usize::MAX),
                    (_, false) => Parent::Number(found.bodies),
                };
                let inside = Around { parent, frame: Pose::IDENTITY };
                walk_body(&element, &inside, settings, found)?;
            }
            "frame" => {
                let frame = around.frame * rotation::pose(&element, &settings.model.compiler)?;
                walk_body(&element, &Around { frame, ..around.clone() }, settings, found)?;
            }
            "include" => include(&element, settings, found)?,
            "attach" => {
                found.has_uncounted = true;
                found
                    .warnings
                    .push(element.warning("flexible bodies of the attached model are not taken up"));
            }
            "flexcomp" => {
                let (parent, frame) = (around.parent.clone(), around.frame);
                let flexcomp = Flexcomp::read(&element, parent, frame, settings, &mut found.warnings)?;
                found.flexcomps.push(flexcomp);
            }
            "composite" | "replicate" | "plugin" => {
                found.warnings.push(element.warning("is not taken up"));
            }
            _ => {}
        }
    }
    Ok(())
}
