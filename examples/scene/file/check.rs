//! Whether a scene makes sense, section by section.

use super::mistake::{Mistake, unknown};
use super::{Body, Expect, Joint, JointKind, Kind, Quantity, Rigid, Scene, Shape};
use toml::Spanned;

/// The first mistake of a scene.
pub fn check(scene: &Scene) -> Result<(), Mistake> {
    positive(&scene.world.dt, "dt")?;
    positive(&scene.world.duration, "duration")?;
    check_names(scene)?;
    scene.rigid.iter().try_for_each(check_mass)?;
    scene.joint.iter().try_for_each(|joint| check_joint(scene, joint))?;
    check_control(scene)?;
    check_bodies(scene)?;
    check_probes(scene)?;
    scene.expect.iter().try_for_each(|expect| check_expectation(scene, expect))
}

fn positive(value: &Spanned<f32>, key: &str) -> Result<(), Mistake> {
    match *value.as_ref() > 0.0 && value.as_ref().is_finite() {
        true => Ok(()),
        false => Err((value.span(), format!("`{key}` is {}, but must be positive", value.as_ref()))),
    }
}

fn rigid_names(scene: &Scene) -> Vec<&str> {
    scene.rigid.iter().map(|r| r.name.as_ref().as_str()).collect()
}

fn deformable_names(scene: &Scene) -> Vec<&str> {
    scene.deformable.iter().map(|d| d.name.as_ref().as_str()).collect()
}

/// Names of rigid bodies, deformables and probes, in that order.
fn all_names(scene: &Scene) -> impl Iterator<Item = &Spanned<String>> {
    let rigid = scene.rigid.iter().map(|r| &r.name);
    rigid.chain(scene.deformable.iter().map(|d| &d.name)).chain(scene.probe.iter().map(|p| &p.name))
}

fn check_names(scene: &Scene) -> Result<(), Mistake> {
    let mut names: Vec<&str> = Vec::new();
    for name in all_names(scene) {
        let text = name.as_ref().as_str();
        if names.contains(&text) {
            return Err((name.span(), format!("`name` \"{text}\" is taken; every name must be unique")));
        }
        names.push(text);
    }
    Ok(())
}

fn check_mass(body: &Rigid) -> Result<(), Mistake> {
    if let (Some(mass), Some(_)) = (&body.mass, &body.density) {
        return Err((mass.span(), "give `mass` or `density`, not both".into()));
    }
    body.mass.as_ref().map_or(Ok(()), |m| positive(m, "mass"))?;
    body.density.as_ref().map_or(Ok(()), |d| positive(d, "density"))
}

fn check_joint(scene: &Scene, joint: &Joint) -> Result<(), Mistake> {
    let bodies = rigid_names(scene);
    for name in &joint.between {
        if !bodies.contains(&name.as_ref().as_str()) {
            return Err(unknown(name, "between", "a rigid body", &bodies));
        }
    }
    if let JointKind::Revolute { axis } | JointKind::Prismatic { axis } = joint.kind
        && (axis.iter().all(|a| *a == 0.0) || !axis.iter().all(|a| a.is_finite()))
    {
        return Err((joint.between[0].span(), "`axis` of this joint must not be zero".into()));
    }
    Ok(())
}

/// What holds and drives: attachments, moves and motors.
fn check_control(scene: &Scene) -> Result<(), Mistake> {
    let (rigid, soft) = (rigid_names(scene), deformable_names(scene));
    for attach in &scene.attach {
        if !soft.contains(&attach.deformable.as_ref().as_str()) {
            return Err(unknown(&attach.deformable, "deformable", "a deformable", &soft));
        }
        if !rigid.contains(&attach.to.as_ref().as_str()) {
            return Err(unknown(&attach.to, "to", "a rigid body", &rigid));
        }
    }
    for motion in &scene.moves {
        let kinematic = scene.rigid.iter().filter(|r| r.kind == Kind::Kinematic);
        let kinematic: Vec<&str> = kinematic.map(|r| r.name.as_ref().as_str()).collect();
        if !kinematic.contains(&motion.of.as_ref().as_str()) {
            return Err(unknown(&motion.of, "of", "a kinematic body", &kinematic));
        }
        let [begin, end] = *motion.during.as_ref();
        if !(begin >= 0.0 && begin < end && end.is_finite()) {
            let message = format!(
                "`during` is from {begin} to {end} s, but must begin at 0 or later and before it ends"
            );
            return Err((motion.during.span(), message));
        }
    }
    for switch in scene.joint.iter().filter_map(|j| j.motor.as_ref()).flat_map(|m| &m.then) {
        if !(*switch.at.as_ref() >= 0.0) {
            return Err((
                switch.at.span(),
                format!("`at` is {} s, but must not be negative", switch.at.as_ref()),
            ));
        }
    }
    Ok(())
}

/// Shapes of rigid bodies; shapes and materials of deformable ones.
fn check_bodies(scene: &Scene) -> Result<(), Mistake> {
    for body in &scene.rigid {
        let problem = shape_problem(body.shape.as_ref());
        problem.map_or(Ok(()), |what| Err((body.shape.span(), format!("`shape`: {what}"))))?;
    }
    for body in &scene.deformable {
        let problem = body_problem(body.body.as_ref());
        problem.map_or(Ok(()), |what| Err((body.body.span(), format!("`body`: {what}"))))?;
        let material = body.material.as_ref().to_material().validate();
        material.map_err(|what| (body.material.span(), format!("`material`: {what}")))?;
    }
    Ok(())
}

fn check_probes(scene: &Scene) -> Result<(), Mistake> {
    let soft = deformable_names(scene);
    let wrong = scene.probe.iter().find(|p| !soft.contains(&p.of.as_ref().as_str()));
    wrong.map_or(Ok(()), |p| Err(unknown(&p.of, "of", "a deformable", &soft)))
}

fn check_expectation(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    check_what_is_measured(scene, e)?;
    if let Some(at) = &e.at {
        let end = *scene.world.duration.as_ref();
        if !(0.0..=end).contains(at.as_ref()) {
            let message = format!("`at` is {} s, but the scene lasts from 0 to {end} s", at.as_ref());
            return Err((at.span(), message));
        }
    }
    match (e.equals, e.at_most, e.at_least) {
        (None, None, None) => {
            Err((e.quantity.span(), "an expectation needs `equals`, `at_most` or `at_least`".into()))
        }
        (Some(_), ..) if e.within.is_none() => {
            Err((e.quantity.span(), "`equals` needs `within`, its tolerance".into()))
        }
        _ => Ok(()),
    }
}

/// Whether the thing has the quantity, and a force the body that it is on.
fn check_what_is_measured(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    let of = e.of.as_ref().as_str();
    let is_deformable = |name: &str| deformable_names(scene).contains(&name);
    let is_rigid = |name: &str| rigid_names(scene).contains(&name);
    let all: Vec<&str> = all_names(scene).map(|n| n.as_ref().as_str()).collect();
    if !all.contains(&of) {
        return Err(unknown(&e.of, "of", "a body or probe", &all));
    }
    let quantity = *e.quantity.as_ref();
    if matches!(quantity, Quantity::VolumeRatio | Quantity::Penetration) && !is_deformable(of) {
        let message = format!("`of` must name a deformable for this quantity, and \"{of}\" is none");
        return Err((e.of.span(), message));
    }
    let is_force = quantity == Quantity::Force;
    if is_force && scene.probe.iter().any(|p| p.name.as_ref() == of) {
        return Err((e.of.span(), "a probe has no `force`; name its body".into()));
    }
    match &e.on {
        Some(on) if is_force && !is_rigid(on.as_ref()) && !is_deformable(on.as_ref()) => {
            Err(unknown(on, "on", "a body", &all))
        }
        None if is_force => Err((e.quantity.span(), "`force` needs `on`, the body that touches".into())),
        Some(on) if !is_force => Err((on.span(), "`on` is for the quantity `force` only".into())),
        _ => Ok(()),
    }
}

fn shape_problem(shape: &Shape) -> Option<String> {
    let lengths: Vec<(&str, f32)> = match shape {
        Shape::Ball { radius } => vec![("radius", *radius)],
        Shape::Cuboid { half_extents } => half_extents.iter().map(|e| ("half_extents", *e)).collect(),
        Shape::Capsule { half_height, radius }
        | Shape::Cylinder { half_height, radius }
        | Shape::Cone { half_height, radius } => vec![("half_height", *half_height), ("radius", *radius)],
        Shape::HalfSpace { normal } => {
            let zero = normal.iter().all(|n| *n == 0.0) || !normal.iter().all(|n| n.is_finite());
            return zero.then(|| "`normal` must not be zero".into());
        }
    };
    let wrong = lengths.into_iter().find(|(_, length)| !(*length > 0.0 && length.is_finite()));
    wrong.map(|(key, length)| format!("`{key}` is {length}, but must be positive"))
}

fn body_problem(body: &Body) -> Option<String> {
    match body {
        Body::Lattice { half_extents, cells } => {
            if cells.contains(&0) {
                return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
            }
            shape_problem(&Shape::Cuboid { half_extents: *half_extents })
        }
        Body::Filled { shape, cell_size } => {
            let wrong = !(*cell_size > 0.0 && cell_size.is_finite());
            let size = wrong.then(|| format!("`cell_size` is {cell_size}, but must be positive"));
            size.or_else(|| shape_problem(shape))
        }
        Body::Network { half_extents, cells } => {
            let lattice = Body::Lattice { half_extents: *half_extents, cells: *cells };
            body_problem(&lattice)
        }
        Body::Cloth { half_extents: [x, z], cells, thickness } => {
            if cells.contains(&0) {
                return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
            }
            let thin = !(*thickness > 0.0 && thickness.is_finite());
            let thin = thin.then(|| format!("`thickness` is {thickness}, but must be positive"));
            thin.or_else(|| shape_problem(&Shape::Cuboid { half_extents: [*x, *thickness, *z] }))
        }
        Body::Rope { points, segments, radius } => {
            if points.len() < 2 || *segments == 0 {
                return Some("a rope needs at least two `points` and one of `segments`".into());
            }
            shape_problem(&Shape::Ball { radius: *radius })
        }
        Body::Mesh { .. } => None,
    }
}
