//! Whether a scene makes sense, section by section.

mod actuation;
mod measures;
mod shapes;

use super::mistake::{Mistake, unknown};
use super::{Body, Deformable, Drop, Joint, JointKind, Kind, Rigid, Scene, Trigger};
use actuation::{check_actuator, check_cable};
use measures::{check_expectation, check_measure, check_when};
use shapes::{body_problem, shape_problem};
use toml::Spanned;

/// Steps of a scene, at the most: a day at 1/100 s.
const MOST_STEPS: f64 = 1.0e7;
/// Bodies, joints, expectations: entries of any list, at the most.
const MOST_ENTRIES: usize = 10_000;
/// Lengths \[m\], speeds \[m/s\] and the like, by size: rapier's numbers are single ones.
const LARGEST: f32 = 1.0e9;

/// The first mistake of a scene.
pub fn check(scene: &Scene) -> Result<(), Mistake> {
    positive(&scene.world.dt, "dt")?;
    positive(&scene.world.duration, "duration")?;
    check_size(scene)?;
    check_names(scene)?;
    scene.rigid.iter().try_for_each(check_mass)?;
    scene.joint.iter().try_for_each(|joint| check_joint(scene, joint))?;
    check_control(scene)?;
    scene.cable.iter().try_for_each(|cable| check_cable(scene, cable))?;
    scene.actuator.iter().try_for_each(|actuator| check_actuator(scene, actuator))?;
    scene.trigger.iter().try_for_each(|trigger| check_trigger(scene, trigger))?;
    check_bodies(scene)?;
    check_probes(scene)?;
    scene.drop.as_ref().map_or(Ok(()), |drop| check_drop(scene, drop))?;
    scene.measure.iter().try_for_each(|measure| check_measure(scene, measure))?;
    scene.expect.iter().try_for_each(|expect| check_expectation(scene, expect))
}

/// Whether it ends.
fn check_size(scene: &Scene) -> Result<(), Mistake> {
    let (duration, dt) = (&scene.world.duration, *scene.world.dt.as_ref());
    let steps = f64::from(*duration.as_ref()) / f64::from(dt);
    if steps > MOST_STEPS {
        let message = format!("`duration` is {steps:.0} steps of {dt} s, but {MOST_STEPS:.0} are the most");
        return Err((duration.span(), message));
    }
    if steps < 1.0 - 1e-6 {
        let message = format!("`duration` is {} s, which is no step of {dt} s", duration.as_ref());
        return Err((duration.span(), message));
    }
    let lists =
        [scene.rigid.len(), scene.deformable.len(), scene.joint.len(), scene.attach.len(), scene.moves.len()];
    let watched = [
        scene.cable.len(),
        scene.actuator.len(),
        scene.trigger.len(),
        scene.probe.len(),
        scene.measure.len(),
        scene.expect.len(),
    ];
    if lists.into_iter().chain(watched).any(|entries| entries > MOST_ENTRIES) {
        return Err((
            duration.span(),
            format!("a scene has at most {MOST_ENTRIES} bodies, joints or expectations"),
        ));
    }
    let numbers = |values: &[f32]| values.iter().copied().find(|v| !(v.abs() <= LARGEST));
    let said =
        |at, key: &str, v: f32| Err((at, format!("`{key}` has {v}, but must be a number up to {LARGEST:e}")));
    if let Some(v) = numbers(&scene.world.gravity) {
        return said(duration.span(), "gravity", v);
    }
    let rigid = scene.rigid.iter().map(|b| (&b.name, [b.translation, b.rotation, b.linvel, b.angvel]));
    let soft = scene.deformable.iter().map(|b| (&b.name, [b.translation, b.rotation, b.linvel, b.angvel]));
    for (name, vectors) in rigid.chain(soft) {
        for (key, vector) in ["translation", "rotation", "linvel", "angvel"].into_iter().zip(vectors) {
            if let Some(v) = numbers(&vector) {
                return said(name.span(), key, v);
            }
        }
    }
    Ok(())
}

fn check_drop(scene: &Scene, drop: &Drop) -> Result<(), Mistake> {
    let bodies: Vec<&str> = rigid_names(scene).into_iter().chain(deformable_names(scene)).collect();
    if let Some(wrong) = drop.members.iter().find(|m| !bodies.contains(&m.as_ref().as_str())) {
        return Err(unknown(wrong, "members", "a body", &bodies));
    }
    let is_fixed =
        |name: &str| scene.rigid.iter().any(|b| b.name.as_ref() == name && b.kind != Kind::Dynamic);
    if let Some(wrong) = drop.members.iter().find(|m| is_fixed(m.as_ref())) {
        return Err((wrong.span(), format!("`members` names \"{}\", which does not fall", wrong.as_ref())));
    }
    let [x, y, z] = scene.world.gravity;
    if !(x == 0.0 && z == 0.0 && y < 0.0) {
        return Err((
            drop.height.span(),
            format!("a drop falls along -y, but `gravity` is {:?}", scene.world.gravity),
        ));
    }
    let (height, gap) = (*drop.height.as_ref(), *drop.gap.as_ref());
    if drop.members.is_empty() {
        return Err((drop.height.span(), "`members` of the drop are none".into()));
    }
    if !(0.0..=f64::from(LARGEST)).contains(&height) {
        return Err((drop.height.span(), format!("`height` is {height}, but must not be negative")));
    }
    if !(0.0..=f64::from(LARGEST)).contains(&gap) || gap > height {
        let message = format!("`gap` is {gap} m, but must be between 0 and the height, {height} m");
        // Where it is not given there is no place of it.
        let at = if drop.gap.span().is_empty() { drop.height.span() } else { drop.gap.span() };
        return Err((at, message));
    }
    let down = drop.orientation.as_ref();
    if down.iter().all(|a| *a == 0.0) || !down.iter().all(|a| a.abs() <= LARGEST) {
        return Err((drop.orientation.span(), "`orientation` must not be zero".into()));
    }
    Ok(())
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

fn check_names(scene: &Scene) -> Result<(), Mistake> {
    let mut names: Vec<&str> = Vec::new();
    let driven = scene.cable.iter().map(|c| &c.name).chain(scene.actuator.iter().map(|a| &a.name));
    for name in scene.spanned_names().chain(driven) {
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
        let keys = [
            ("compliance", &attach.compliance),
            ("length", &attach.length),
            ("break_force", &attach.break_force),
        ];
        for (key, value) in keys.into_iter().filter_map(|(key, value)| Some((key, value.as_ref()?))) {
            if !(*value.as_ref() > 0.0 && value.as_ref().is_finite()) {
                return Err((value.span(), format!("`{key}` is {}, but must be positive", value.as_ref())));
            }
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

fn check_trigger(scene: &Scene, trigger: &Trigger) -> Result<(), Mistake> {
    let (rigid, soft) = (rigid_names(scene), deformable_names(scene));
    if let Some(wrong) = trigger.release.iter().find(|name| !soft.contains(&name.as_ref().as_str())) {
        return Err(unknown(wrong, "release", "a deformable", &soft));
    }
    let has_joint = |pair: &[Spanned<String>; 2], with_motor: bool| {
        let joints = scene.joint.iter().filter(|joint| !with_motor || joint.motor.is_some());
        joints.into_iter().any(|joint| joint.is_between(pair[0].as_ref(), pair[1].as_ref()))
    };
    for (key, pair) in
        trigger.cut.iter().map(|p| ("cut", p)).chain(trigger.switch.iter().map(|s| ("switch", &s.between)))
    {
        if let Some(wrong) = pair.iter().find(|name| !rigid.contains(&name.as_ref().as_str())) {
            return Err(unknown(wrong, key, "a rigid body", &rigid));
        }
        if !has_joint(pair, key == "switch") {
            let what = if key == "switch" { "joint with a motor" } else { "joint" };
            let message = format!(
                "`{key}`: there is no {what} between \"{}\" and \"{}\"",
                pair[0].as_ref(),
                pair[1].as_ref()
            );
            return Err((pair[0].span(), message));
        }
    }
    if let Some(when) = &trigger.when {
        check_when(scene, when.as_ref(), when.span())?;
    }
    match trigger.after.as_ref().map(|after| (*after.as_ref(), after.span())) {
        Some((after, span)) if !(after >= 0.0) => {
            Err((span, format!("`after` is {after} s, but must not be negative")))
        }
        None if trigger.when.is_none() => {
            let place = trigger.release.first().or(trigger.cut.first().map(|pair| &pair[0]));
            let span = place.or(trigger.switch.first().map(|s| &s.between[0])).map_or(0..0, Spanned::span);
            Err((span, "a trigger needs `after`, a time, or `when`, a condition".into()))
        }
        _ => Ok(()),
    }
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
        check_regions(scene, body)?;
        // Of any room: what is wrong with one of a cubic metre is so with all.
        let wrong = body.cavities.iter().find_map(|c| Some((c.span(), c.as_ref().at_rest(1.0).fault()?)));
        wrong.map_or(Ok(()), |(at, what)| Err((at, format!("`cavities`: {what}"))))?;
    }
    Ok(())
}

/// Either boxes or groups, with materials that can be.
fn check_regions(scene: &Scene, body: &Deformable) -> Result<(), Mistake> {
    for region in &body.regions {
        let own = region.as_ref();
        let first = body.regions[0].as_ref();
        if own.within.is_some() == own.group.is_some() || own.group.is_some() != first.group.is_some() {
            let message = "`regions` have a `box` each, or a `group` each of a mesh file".into();
            return Err((region.span(), message));
        }
        if own.group.is_some() && !matches!(body.body.as_ref(), Body::Mesh { .. }) {
            return Err((region.span(), "`group`: only a mesh of a file has groups".into()));
        }
        if let Some(name) = &own.part_of {
            let rigid = rigid_names(scene);
            if !rigid.contains(&name.as_ref().as_str()) {
                return Err(unknown(name, "part_of", "a rigid body", &rigid));
            }
            if !own.rigid {
                return Err((
                    name.span(),
                    "`part_of`: only a region that is `rigid` is part of a body".into(),
                ));
            }
        }
        own.material
            .to_material()
            .validate()
            .map_err(|what| (region.span(), format!("`material`: {what}")))?;
    }
    Ok(())
}

fn check_probes(scene: &Scene) -> Result<(), Mistake> {
    let soft = deformable_names(scene);
    let wrong = scene.probe.iter().find(|p| !soft.contains(&p.of.as_ref().as_str()));
    wrong.map_or(Ok(()), |p| Err(unknown(&p.of, "of", "a deformable", &soft)))
}
