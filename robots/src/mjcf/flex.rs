//! The element `deformable/flex`, as MuJoCo writes it out of a `flexcomp` when it saves a model: a body with three slides for each
//! vertex that moves, and elements between them. These bodies are no links: they are taken out of the text before the loader sees it.

use super::flexcomp::{Flexcomp, Kind, Pins, read_contact, read_stiffness};
use super::tree::Parent;
use crate::error::{RobotError, Warning};
use crate::xml::Element;
use rapier3d::math::{Pose, Vector};
use rapier3d_mjcf::mjcf_rs::model::Model;
use rapier3d_mjcf::{MjcfLoaderOptions, MjcfRobot};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A text without the bodies of vertices, and what these make up.
pub(super) struct TakenOut {
    pub text: String,
    pub flexes: Vec<Flexcomp>,
}

/// A body of the file.
struct Body {
    pose: Pose,
    mass: f64,
    /// It is there for a vertex, at this place of the text.
    vertex: Option<std::ops::Range<usize>>,
}

/// Takes the flexible bodies out of a file that has any.
pub(super) fn take_out(
    root: &Element<'_, '_>,
    text: &str,
    folder: &Path,
    options: &MjcfLoaderOptions,
    warnings: &mut Vec<Warning>,
) -> Result<Option<TakenOut>, RobotError> {
    let sections = root.children().filter(|element| element.tag() == "deformable");
    let elements: Vec<_> =
        sections.flat_map(|section| section.children()).filter(|element| element.tag() == "flex").collect();
    if elements.is_empty() {
        return Ok(None);
    }
    let mut bodies = bodies(root, text, folder, options)?;
    keep_carriers(&mut bodies, &elements);
    let flexes = elements.iter().map(|element| read(element, &bodies, warnings));
    let flexes = flexes.collect::<Result<_, _>>()?;
    let mut bytes = text.as_bytes().to_vec();
    let named: BTreeSet<&str> = elements.iter().flat_map(names).collect();
    let vertex = |name: &&str| bodies.get(name).and_then(|body| body.vertex.clone());
    for range in named.iter().filter_map(vertex) {
        // Lines keep their numbers.
        bytes[range].iter_mut().filter(|byte| **byte != b'\n').for_each(|byte| *byte = b' ');
    }
    warn_of_uses(root, |name| named.get(name).and_then(vertex).is_some(), warnings);
    Ok(Some(TakenOut { text: String::from_utf8_lossy(&bytes).into_owned(), flexes }))
}

/// A body that several vertices are on is one that carries them.
fn keep_carriers(bodies: &mut BTreeMap<&str, Body>, elements: &[Element<'_, '_>]) {
    let mut seen = BTreeSet::new();
    for element in elements {
        let is_alone = names(element).nth(1).is_none();
        for name in names(element) {
            if (is_alone || !seen.insert(name))
                && let Some(body) = bodies.get_mut(name)
            {
                body.vertex = None;
            }
        }
    }
}

/// What else names a body that is taken out, or its joints.
fn warn_of_uses(root: &Element<'_, '_>, is_out: impl Fn(&str) -> bool, warnings: &mut Vec<Warning>) {
    let names = |node: &roxmltree::Node<'_, '_>| {
        node.has_tag_name("body") && node.attribute("name").is_some_and(&is_out)
    };
    // Which vertex each lost name belongs to.
    let mut lost = BTreeMap::new();
    for body in root.node.descendants().filter(names) {
        let own = body.descendants().filter_map(|node| node.attribute("name"));
        lost.extend(own.map(|name| (name, body.attribute("name").unwrap_or_default())));
    }
    let keys = ["body", "body1", "body2", "joint", "joint1", "joint2", "objname", "target"];
    let others = root.node.descendants().filter(|node| node.is_element() && !node.has_tag_name("flex"));
    for node in others {
        let refers = |key: &&str| node.attribute(*key).and_then(|other| lost.get(other));
        if let Some(name) = keys.iter().find_map(refers) {
            let what = format!("names what is the vertex `{name}` of a flex here, and no body");
            warnings.push(Element::new(node, root.file).warning(what));
        }
    }
}

fn names<'a>(element: &Element<'a, '_>) -> impl Iterator<Item = &'a str> {
    element.attribute("body").unwrap_or_default().split_whitespace()
}

/// All bodies by their names, and the world.
fn bodies<'a>(
    root: &Element<'a, '_>,
    text: &str,
    folder: &Path,
    options: &MjcfLoaderOptions,
) -> Result<BTreeMap<&'a str, Body>, RobotError> {
    let fail = |error: String| RobotError::Syntax { place: root.place(), reason: error };
    let model = Model::from_str(text, folder).map_err(|error| fail(error.to_string()))?;
    let robot = MjcfRobot::from_model(&model, options.clone(), folder);
    let loaded: BTreeMap<&str, _> = (robot.bodies.iter())
        .filter(|body| !body.is_intermediate)
        .filter_map(|body| Some((model.bodies[body.mjcf_body_id].body.name.as_deref()?, body)))
        .collect();
    let mut bodies = BTreeMap::from([("world", Body { pose: Pose::IDENTITY, mass: 0.0, vertex: None })]);
    for node in root.node.descendants().filter(|node| node.has_tag_name("body")) {
        let element = Element::new(node, root.file);
        let Some(name) = element.attribute("name") else { continue };
        let Some(found) = loaded.get(name) else { continue };
        let is_bare = element.children().all(|child| ["joint", "inertial"].contains(&child.tag()));
        let joints: Vec<_> = element.children().filter(|child| child.tag() == "joint").collect();
        let is_led = joints.iter().all(|joint| joint.attribute("type") == Some("slide"));
        let is_vertex = is_bare && is_led && joints.len() == 3;
        let vertex = is_vertex.then(|| node.range());
        bodies.insert(name, Body { pose: *found.body.position(), mass: f64::from(found.mass), vertex });
    }
    Ok(bodies)
}

fn read(
    element: &Element<'_, '_>,
    bodies: &BTreeMap<&str, Body>,
    warnings: &mut Vec<Warning>,
) -> Result<Flexcomp, RobotError> {
    let name = element.attribute("name").unwrap_or_default();
    if name.is_empty() {
        return Err(element.bad("name", "missing", "there"));
    }
    if element.attribute("node").is_some() {
        return Err(element.unsupported("nodes are not offered: it wants a body for each vertex"));
    }
    let dim = match element.attribute("dim") {
        None => 2,
        Some("1") => 1,
        Some("2") => 2,
        Some("3") => 3,
        Some(other) => return Err(element.bad("dim", other, "1, 2 or 3")),
    };
    let vertices = Vertices::read(element, bodies)?;
    let radius = element.positive("radius", 0.005)?;
    let known = [
        "name", "dim", "radius", "body", "vertex", "element", "rgba", "material", "group", "flatskin",
        "texcoord",
    ];
    element.warn_of_others(&known, warnings);
    for child in element.children() {
        if !["elasticity", "edge", "contact"].contains(&child.tag()) {
            warnings.push(element.warning(format!("<{}> is not taken up", child.tag())));
        }
    }
    let elements = element.indices("element")?;
    Ok(Flexcomp {
        place: element.place(),
        name: name.to_string(),
        parent: vertices.parent,
        pose: Pose::IDENTITY,
        kind: Kind::Direct,
        dim,
        count: [1; 3],
        spacing: [mean_segment(&vertices.points, &elements); 3],
        scale: [1.0; 3],
        mass: vertices.mass,
        radius,
        rigid: false,
        file: String::new(),
        points: vertices.points,
        elements,
        pins: Pins { ids: vertices.pins, ..Pins::default() },
        stiffness: read_stiffness(element, dim, warnings)?,
        contact: read_contact(element, warnings)?,
    })
}

/// Mean distance of the first two points of elements \[m\], for the stiffness of edges.
fn mean_segment(points: &[f64], elements: &[usize]) -> f64 {
    let at = |index: usize| points.get(3 * index..3 * index + 3);
    let lengths: Vec<f64> = elements
        .chunks_exact(2)
        .filter_map(|ends| Some((at(ends[0])?, at(ends[1])?)))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt())
        .collect();
    lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
}

/// Where the vertices are, against the body that carries those which do not move by themselves.
struct Vertices {
    parent: Parent,
    points: Vec<f64>,
    pins: Vec<usize>,
    /// Of the whole: what the vertices that move have on the mean, for each \[kg\].
    mass: f64,
}

impl Vertices {
    fn read(element: &Element<'_, '_>, bodies: &BTreeMap<&str, Body>) -> Result<Self, RobotError> {
        let given = element.numbers("vertex")?;
        let mut names: Vec<&str> = names(element).collect();
        if let (&[only], Some(given)) = (&names[..], &given) {
            names = vec![only; given.len() / 3];
        }
        let local = given.unwrap_or_else(|| vec![0.0; 3 * names.len()]);
        if local.len() != 3 * names.len() {
            return Err(element.bad("vertex", format!("{} numbers", local.len()), "three numbers a body"));
        }
        let find = |name: &&str| {
            bodies.get(*name).ok_or_else(|| element.bad("body", *name, "the names of bodies of this file"))
        };
        let found = names.iter().map(find).collect::<Result<Vec<_>, _>>()?;
        let pins: Vec<usize> = (0..names.len()).filter(|place| found[*place].vertex.is_none()).collect();
        let carrier = pins.first().map_or("world", |place| names[*place]);
        if pins.iter().any(|place| names[*place] != carrier) {
            return Err(element.unsupported("its vertices are held by several bodies: one is offered"));
        }
        let free = names.len() - pins.len();
        let mass: f64 = found.iter().filter(|body| body.vertex.is_some()).map(|body| body.mass).sum();
        if !(mass > 0.0) {
            return Err(element
                .unsupported("none of its vertices has a body of its own with three slides and a mass"));
        }
        let frame = bodies[carrier].pose;
        let at = |(body, local): (&&Body, &[f64])| {
            let local = Vector::new(local[0] as f32, local[1] as f32, local[2] as f32);
            let point = frame.inverse() * (body.pose * local);
            point.to_array().map(f64::from)
        };
        let points = found.iter().zip(local.chunks_exact(3)).flat_map(at).collect();
        let parent = if carrier == "world" { Parent::Number(0) } else { Parent::Name(carrier.to_string()) };
        Ok(Self { parent, points, pins, mass: mass * names.len() as f64 / free as f64 })
    }
}
