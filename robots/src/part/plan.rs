//! From the file of soft parts to bodies in their places.

use super::file::{Lines, Material, Part, PartPose, read};
use super::shape::{Fault, mesh};
use super::{PlannedPart, attach, surface_vertices};
use crate::error::{Place, RobotError};
use crate::rigid::RigidLink;
use foible3d::{DeformableBodyBuilder, DeformableMaterial};
use rapier3d::glamx::EulerRot;
use rapier3d::math::{Pose, Rotation, Vector};
use std::collections::BTreeSet;
use std::path::Path;
use toml::Spanned;

/// Farthest place of a part [m].
const FARTHEST: f64 = 1.0e6;

/// Makes the soft parts of a text. Mesh files are looked for in `folder`.
pub(crate) fn plan(
    text: &str,
    file: &Path,
    folder: &Path,
    links: &[RigidLink],
) -> Result<Vec<PlannedPart>, RobotError> {
    let lines = Lines::new(text, file);
    let mut names = BTreeSet::new();
    let mut parts = Vec::new();
    for part in read(&lines)? {
        let part = part.into_inner();
        let name = part.name.get_ref();
        if name.is_empty() || !names.insert(name.clone()) {
            let place = lines.place(part.name.span());
            return Err(value(place, name, ("name", format!("`{name}`"), "a name that no other part has")));
        }
        parts.push(plan_part(&part, &lines, folder, links)?);
    }
    Ok(parts)
}

/// The error for a key of a part.
fn value(place: Place, part: &str, fault: (&str, String, &'static str)) -> RobotError {
    let (key, value, range) = fault;
    RobotError::Value { place, element: format!("soft part `{part}`"), key: key.to_string(), value, range }
}

fn plan_part(
    part: &Part,
    lines: &Lines<'_>,
    folder: &Path,
    links: &[RigidLink],
) -> Result<PlannedPart, RobotError> {
    let name = part.name.get_ref();
    let number = |link: &Spanned<String>, key| {
        let found = links.iter().position(|l| l.name == *link.get_ref());
        found.ok_or_else(|| {
            value(
                lines.place(link.span()),
                name,
                (key, format!("`{}`", link.get_ref()), "the name of a link"),
            )
        })
    };
    let at = |span, fault| match fault {
        Fault::Value(key, is, range) => value(lines.place(span), name, (key, is, range)),
        Fault::Mesh(error) => {
            RobotError::Part { place: lines.place(span), part: name.clone(), source: error.into() }
        }
    };
    let link = number(&part.link, "link")?;
    let ignored = part.ignore.iter().map(|link| number(link, "ignore")).collect::<Result<_, _>>()?;
    let pose = match &part.pose {
        Some(pose) => to_pose(pose.get_ref()).map_err(|fault| at(pose.span(), fault))?,
        None => Pose::IDENTITY,
    };
    let material = to_material(part.material.get_ref()).map_err(|fault| at(part.material.span(), fault))?;
    let mesh = mesh(part.shape.get_ref(), folder).map_err(|fault| at(part.shape.span(), fault))?;
    let mut builder = DeformableBodyBuilder::mesh(&mesh).material(material).pose(links[link].pose * pose);
    if part.smoothed {
        builder = builder.smoothed();
    }
    let body = builder.build().map_err(|source| RobotError::Part {
        place: lines.place(part.material.span()),
        part: name.clone(),
        source,
    })?;
    let place = |vertex: usize| {
        let x = Vector::from_array(body.model().rest_position(vertex).map(|c| c as f32));
        (pose * x).to_array().map(f64::from)
    };
    let candidates = surface_vertices(&body);
    let (attached, condition) =
        attach::chosen(part.attach.get_ref(), &candidates, place, &links[link].shapes)
            .map_err(|fault| at(part.attach.span(), fault))?;
    if attached.is_empty() {
        let place = lines.place(part.attach.span());
        return Err(RobotError::NothingAttached { place, part: name.clone(), condition });
    }
    let place = lines.place(part.name.span());
    Ok(PlannedPart { name: name.clone(), place, body, link: Some(link), attached, ignored })
}

fn to_pose(pose: &PartPose) -> Result<Pose, Fault> {
    for (key, numbers) in [("xyz", pose.xyz), ("rpy", pose.rpy)] {
        if !numbers.iter().all(|x| x.abs() <= FARTHEST) {
            return Err(Fault::Value(key, format!("{numbers:?}"), "three numbers up to 1e6"));
        }
    }
    let [roll, pitch, yaw] = pose.rpy.map(|a| a as f32);
    let rotation = Rotation::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    Ok(Pose::from_parts(Vector::from_array(pose.xyz.map(|c| c as f32)), rotation))
}

fn to_material(material: &Material) -> Result<DeformableMaterial, Fault> {
    let start = match (material.preset, material.shore_a, material.young) {
        (Some(preset), None, None) => preset.material(),
        (None, Some(hardness), None) => DeformableMaterial::shore_a(hardness),
        (None, None, Some(young)) => match material.poisson {
            Some(poisson) => DeformableMaterial::new(young, poisson),
            None => return Err(Fault::Value("poisson", "missing".to_string(), "there beside young")),
        },
        _ => {
            let range = "one of preset, shore_a and young";
            return Err(Fault::Value("material", "not told, or told twice".to_string(), range));
        }
    };
    let mut made = start;
    if let Some(poisson) = material.poisson {
        made = made.poisson_ratio(poisson);
    }
    if let Some(density) = material.density {
        made = made.density(density);
    }
    if let Some(friction) = material.friction {
        made = made.friction(friction);
    }
    if let Some(damping) = material.damping {
        made = made.stiffness_damping(damping);
    }
    if let Some(damping) = material.mass_damping {
        made = made.mass_damping(damping);
    }
    Ok(made)
}
