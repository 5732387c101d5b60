//! From a flexible body of a file to a soft part.

use super::Settings;
use super::flex_mesh::{Fault, FlexMesh, mesh};
use super::flexcomp::{Flexcomp, Kind};
use super::pins::pinned;
use crate::error::{RobotError, Warning};
use crate::part::{PlannedPart, surface_vertices};
use foible3d::{DeformableBody, DeformableBodyError, DeformableMaterial};
use rapier3d::geometry::{Group, InteractionGroups};
use rapier3d::math::Pose;
use std::collections::BTreeSet;

/// A density at which the mass tells the volume [kg/m³].
const TRIAL_DENSITY: f64 = 1000.0;

/// Makes the part. `carrier` is where the body around it is in the world.
pub(super) fn plan(
    flexcomp: &Flexcomp,
    link: Option<usize>,
    carrier: Pose,
    settings: &Settings<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<PlannedPart, RobotError> {
    let element = || format!("flexcomp `{}`", flexcomp.name);
    let made = mesh(flexcomp, settings).map_err(|fault| match fault {
        Fault::Mesh(error) => wrong(flexcomp, error.into()),
        Fault::Unsupported(what) => {
            RobotError::Unsupported { place: flexcomp.place.clone(), element: element(), what }
        }
    })?;
    let mut warn = |what: String| {
        warnings.push(Warning { place: flexcomp.place.clone(), element: element(), what });
    };
    if flexcomp.dim == 2 && flexcomp.stiffness.thickness.is_none() {
        warn(format!("has no thickness: taken as twice its radius, {} m", 2.0 * flexcomp.radius));
    }
    if matches!(flexcomp.kind, Kind::Box | Kind::Cylinder | Kind::Ellipsoid) {
        warn("is filled with tetrahedra, and not hung from one point in its middle".to_string());
    }
    let points = pinned(flexcomp, made.points.len())?;
    let mut body = build(flexcomp, &made, carrier)?;
    let held = vertices_at(&body, &made, &points);
    let surface: BTreeSet<usize> = surface_vertices(&body).into_iter().collect();
    let attached = match link {
        Some(_) => {
            let inside = held.difference(&surface).count();
            if inside > 0 && !flexcomp.rigid {
                warn(format!("{inside} pinned points are inside of it, and are held by what is around them"));
            }
            held.intersection(&surface).copied().collect()
        }
        None => {
            for vertex in held {
                body.pin(vertex).map_err(|error| wrong(flexcomp, error.into()))?;
            }
            Vec::new()
        }
    };
    let (name, place) = (flexcomp.name.clone(), flexcomp.place.clone());
    // What is not pinned moves by itself, and may touch the body around it.
    let link = link.filter(|_| !attached.is_empty());
    Ok(PlannedPart { name, place, body, link, attached, ignored: Vec::new() })
}

fn wrong(flexcomp: &Flexcomp, source: DeformableBodyError) -> RobotError {
    RobotError::Part { place: flexcomp.place.clone(), part: flexcomp.name.clone(), source }
}

fn build(flexcomp: &Flexcomp, made: &FlexMesh, carrier: Pose) -> Result<DeformableBody, RobotError> {
    let stiffness = flexcomp.stiffness;
    let young = match stiffness.young > 0.0 {
        true => stiffness.young,
        // A bar of the rod's cross-section that is as stiff as the edge.
        false => stiffness.edge * flexcomp.spacing[0] / (std::f64::consts::PI * flexcomp.radius.powi(2)),
    };
    let material = DeformableMaterial::new(young, stiffness.poisson)
        .density(TRIAL_DENSITY)
        .stiffness_damping(stiffness.damping)
        .friction(flexcomp.contact.friction);
    let bits = Group::from(flexcomp.contact.groups);
    let groups = InteractionGroups::all().with_memberships(bits).with_filter(bits);
    let builder = made
        .builder
        .clone()
        .material(material)
        .pose(carrier * flexcomp.pose)
        .collision_groups(groups)
        .self_contact(flexcomp.contact.with_itself.unwrap_or(flexcomp.dim == 2));
    let mut body = builder.build().map_err(|error| wrong(flexcomp, error))?;
    let density = TRIAL_DENSITY * flexcomp.mass / body.mass();
    body.set_material(material.density(density)).map_err(|error| wrong(flexcomp, error.into()))?;
    Ok(body)
}

/// Vertices of the body at these of MuJoCo's points.
fn vertices_at(body: &DeformableBody, made: &FlexMesh, numbers: &BTreeSet<usize>) -> BTreeSet<usize> {
    let model = body.model();
    let rest: Vec<[f64; 3]> = (0..model.vertex_count()).map(|v| model.rest_position(v)).collect();
    let mut held = BTreeSet::new();
    for point in numbers.iter().map(|number| made.points[*number]) {
        let distance = |x: &[f64; 3]| (0..3).map(|i| (x[i] - point[i]).powi(2)).sum::<f64>();
        let nearest =
            rest.iter().enumerate().map(|(v, x)| (distance(x), v)).min_by(|a, b| a.0.total_cmp(&b.0));
        held.extend(nearest.filter(|(d, _)| d.sqrt() <= made.reach).map(|(_, v)| v));
    }
    held
}
