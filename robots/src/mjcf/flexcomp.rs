//! The element `flexcomp`, as it is read.

use super::tree::Parent;
use super::{Settings, rotation};
use crate::error::{Place, RobotError, Warning};
use crate::part::most_cells;
use crate::xml::Element;
use rapier3d::math::Pose;

/// What it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Grid,
    Box,
    Cylinder,
    Ellipsoid,
    Square,
    Disc,
    Mesh,
    Gmsh,
    Direct,
}

/// Points of it that its parent leads, by number or by their place in the grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Pins {
    pub ids: Vec<usize>,
    pub ranges: Vec<usize>,
    pub grid: Vec<usize>,
    pub grid_ranges: Vec<usize>,
}

/// `elasticity` and `edge`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stiffness {
    /// Young's modulus [Pa]; of an edge's spring, for rods without one.
    pub young: f64,
    pub poisson: f64,
    /// [s]
    pub damping: f64,
    pub thickness: Option<f64>,
    /// Of an edge [N/m].
    pub edge: f64,
}

/// `contact`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub groups: u32,
    pub friction: f64,
    pub with_itself: Option<bool>,
}

/// A flexible body.
pub(super) struct Flexcomp {
    pub place: Place,
    pub name: String,
    pub parent: Parent,
    /// Against the body around it.
    pub pose: Pose,
    pub kind: Kind,
    pub dim: usize,
    pub count: [usize; 3],
    /// \[m\]
    pub spacing: [f64; 3],
    pub scale: [f64; 3],
    /// \[kg\]
    pub mass: f64,
    /// \[m\]
    pub radius: f64,
    pub rigid: bool,
    pub file: String,
    pub points: Vec<f64>,
    pub elements: Vec<usize>,
    pub pins: Pins,
    pub stiffness: Stiffness,
    pub contact: Contact,
}

impl Flexcomp {
    pub fn read(
        element: &Element<'_, '_>,
        parent: Parent,
        frame: Pose,
        settings: &Settings<'_>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, RobotError> {
        let name = element.attribute("name").unwrap_or_default();
        if name.is_empty() {
            return Err(element.bad("name", "missing", "there"));
        }
        let kind = read_kind(element)?;
        let is_solid = matches!(kind, Kind::Box | Kind::Cylinder | Kind::Ellipsoid | Kind::Gmsh);
        let is_flat = matches!(kind, Kind::Square | Kind::Disc);
        let dim = match element.attribute("dim") {
            None if is_solid => 3,
            None => 2,
            Some(text) => text
                .parse()
                .ok()
                .filter(|d| (1..=3).contains(d))
                .ok_or_else(|| element.bad("dim", text, "1, 2 or 3"))?,
        };
        if is_solid && dim != 3 || is_flat && dim != 2 {
            return Err(element.unsupported(format!("type {kind:?} with dim {dim} is not offered")));
        }
        warn_of_rest(element, warnings);
        let (count, spacing) = read_grid(element)?;
        let plain = Ok(Vec::new());
        Ok(Self {
            place: element.place(),
            name: name.to_string(),
            parent,
            pose: frame * rotation::pose(element, &settings.model.compiler)?,
            kind,
            dim,
            count,
            spacing,
            scale: read_scale(element)?,
            mass: element.positive("mass", 1.0)?,
            radius: element.positive("radius", 0.005)?,
            rigid: element.flag("rigid", false)?,
            file: element.attribute("file").unwrap_or_default().to_string(),
            points: element.numbers("point").transpose().unwrap_or(plain)?,
            elements: element.indices("element")?,
            pins: read_pins(element)?,
            stiffness: read_stiffness(element, dim, warnings)?,
            contact: read_contact(element, warnings)?,
        })
    }
}

fn read_kind(element: &Element<'_, '_>) -> Result<Kind, RobotError> {
    Ok(match element.attribute("type").unwrap_or("grid") {
        "grid" => Kind::Grid,
        "box" => Kind::Box,
        "cylinder" => Kind::Cylinder,
        "ellipsoid" => Kind::Ellipsoid,
        "square" => Kind::Square,
        "disc" => Kind::Disc,
        "mesh" => Kind::Mesh,
        "gmsh" => Kind::Gmsh,
        "direct" => Kind::Direct,
        "circle" => return Err(element.unsupported("type circle is not offered: rods have two ends")),
        other => return Err(element.bad("type", other, "a type of flexcomp")),
    })
}

fn read_grid(element: &Element<'_, '_>) -> Result<([usize; 3], [f64; 3]), RobotError> {
    let count = match element.attribute("count") {
        None => [10; 3],
        Some(text) => <[usize; 3]>::try_from(element.indices("count")?)
            .ok()
            .filter(|count| count.iter().all(|c| *c >= 1))
            .ok_or_else(|| element.bad("count", text, "three whole numbers from one"))?,
    };
    if let Some(range) = most_cells(count.iter().map(|c| *c as f64).product()) {
        return Err(element.bad("count", format!("{count:?}"), range));
    }
    let spacing = element.array("spacing", [0.02; 3])?;
    if !spacing.iter().all(|s| (1.0e-6..=1.0e4).contains(s)) {
        return Err(element.bad("spacing", format!("{spacing:?}"), "from 1e-6 to 1e4"));
    }
    Ok((count, spacing))
}

fn read_scale(element: &Element<'_, '_>) -> Result<[f64; 3], RobotError> {
    let scale = element.array("scale", [1.0; 3])?;
    match scale.iter().all(|s| *s > 0.0) {
        true => Ok(scale),
        false => Err(element.bad("scale", format!("{scale:?}"), "positive")),
    }
}

/// Attributes and children that are not taken up.
fn warn_of_rest(element: &Element<'_, '_>, warnings: &mut Vec<Warning>) {
    let known = [
        "name",
        "type",
        "dim",
        "count",
        "spacing",
        "scale",
        "mass",
        "radius",
        "rigid",
        "file",
        "point",
        "element",
        "pos",
        "quat",
        "axisangle",
        "euler",
        "xyaxes",
        "zaxis",
        // What is drawn, and the size that points have in MuJoCo.
        "rgba",
        "material",
        "group",
        "flatskin",
        "texcoord",
        "inertiabox",
    ];
    element.warn_of_others(&known, warnings);
    for child in element.children() {
        if !["pin", "elasticity", "edge", "contact"].contains(&child.tag()) {
            warnings.push(element.warning(format!("<{}> is not taken up", child.tag())));
        }
    }
}

fn read_pins(element: &Element<'_, '_>) -> Result<Pins, RobotError> {
    let mut pins = Pins::default();
    for pin in element.children().filter(|child| child.tag() == "pin") {
        pins.ids.extend(pin.indices("id")?);
        pins.ranges.extend(pin.indices("range")?);
        pins.grid.extend(pin.indices("grid")?);
        pins.grid_ranges.extend(pin.indices("gridrange")?);
    }
    Ok(pins)
}

pub(super) fn read_stiffness(
    element: &Element<'_, '_>,
    dim: usize,
    warnings: &mut Vec<Warning>,
) -> Result<Stiffness, RobotError> {
    let mut read = Stiffness { young: 0.0, poisson: 0.0, damping: 0.0, thickness: None, edge: 0.0 };
    if let Some(elasticity) = element.child("elasticity") {
        read.young = elasticity.not_negative("young", 0.0)?;
        read.poisson = elasticity.not_negative("poisson", 0.0)?;
        read.damping = elasticity.not_negative("damping", 0.0)?;
        if elasticity.attribute("thickness").is_some() {
            read.thickness = Some(elasticity.positive("thickness", 1.0)?);
        }
        match elasticity.attribute("elastic2d") {
            None | Some("both") => {}
            Some(other) if dim == 2 => {
                let what =
                    format!("elastic2d=\"{other}\" is taken as both: sheets resist stretch and bending");
                warnings.push(element.warning(what));
            }
            Some(_) => {}
        }
        let known = ["young", "poisson", "damping", "thickness", "elastic2d"];
        elasticity.warn_of_others(&known, warnings);
    }
    if let Some(edge) = element.child("edge") {
        if dim == 1 {
            read.edge = edge.not_negative("stiffness", 0.0)?;
            edge.warn_of_others(&["stiffness", "equality"], warnings);
        } else {
            edge.warn_of_others(&["equality"], warnings);
        }
        if edge.attribute("equality").is_some_and(|kind| kind != "false") {
            warnings
                .push(element.warning("edges are not kept at their lengths: they stretch by the elasticity"));
        }
    }
    if !(read.young > 0.0 || read.edge > 0.0) {
        let what = "has no stiffness: give it an <elasticity> with young above zero";
        return Err(element.unsupported(what));
    }
    Ok(read)
}

pub(super) fn read_contact(
    element: &Element<'_, '_>,
    warnings: &mut Vec<Warning>,
) -> Result<Contact, RobotError> {
    let mut read = Contact { groups: 1, friction: 1.0, with_itself: None };
    let Some(contact) = element.child("contact") else { return Ok(read) };
    let bits = |key: &str| match contact.attribute(key) {
        None => Ok(1),
        Some(text) => text.parse::<u32>().map_err(|_| contact.bad(key, text, "a whole number of 32 bits")),
    };
    read.groups = bits("contype")? | bits("conaffinity")?;
    if let Some(friction) = contact.numbers("friction")? {
        // The others are of torsion and of rolling.
        read.friction = *friction.first().unwrap_or(&1.0);
        if !(read.friction >= 0.0) {
            return Err(contact.bad("friction", read.friction, "zero or positive"));
        }
    }
    read.with_itself = match contact.attribute("selfcollide") {
        None => None,
        Some("none" | "false") => Some(false),
        Some("auto" | "narrow" | "bvh" | "sap" | "true") => Some(true),
        Some(other) => return Err(contact.bad("selfcollide", other, "none, narrow, bvh, sap or auto")),
    };
    contact.warn_of_others(&["contype", "conaffinity", "friction", "selfcollide"], warnings);
    Ok(read)
}
