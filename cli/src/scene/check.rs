//! Whether a scene makes sense, section by section.

use super::mistake::{Mistake, unknown};
use super::{Body, Drop, Expect, Joint, JointKind, Kind, Quantity, Rigid, Scene, Shape, Take};
use toml::Spanned;

/// Steps of a scene, at the most: a day at 1/100 s.
const MOST_STEPS: f64 = 1.0e7;
/// Bodies, joints, expectations: entries of any list, at the most.
const MOST_ENTRIES: usize = 10_000;
/// Cells of a lattice, cells that a filled shape is cut into, segments of a rope, at the most. A cube of 98 415 tetrahedra is the largest
/// that has been measured.
const MOST_CELLS: f64 = 1.0e6;
/// Lengths \[m\], speeds \[m/s\] and the like, by size: rapier's numbers are single ones.
const LARGEST: f32 = 1.0e9;
/// Samples of a filter's signal per hertz of its class [SAE J211].
const SAMPLES_PER_CLASS: f64 = 10.0;

/// The first mistake of a scene.
pub fn check(scene: &Scene) -> Result<(), Mistake> {
    positive(&scene.world.dt, "dt")?;
    positive(&scene.world.duration, "duration")?;
    check_size(scene)?;
    check_names(scene)?;
    scene.rigid.iter().try_for_each(check_mass)?;
    scene.joint.iter().try_for_each(|joint| check_joint(scene, joint))?;
    check_control(scene)?;
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
    let lists =
        [scene.rigid.len(), scene.deformable.len(), scene.joint.len(), scene.attach.len(), scene.moves.len()];
    let watched = [scene.probe.len(), scene.measure.len(), scene.expect.len()];
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
    for name in scene.spanned_names() {
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
    check_measure(scene, e)?;
    if let Some(curve) = &e.curve {
        let alone = (e.equals, e.at_most, e.at_least, e.holds) == (None, None, None, None);
        return match e.within {
            Some(_) if alone => Ok(()),
            _ => Err((
                curve.span(),
                "a `curve` needs `within`, its tolerance, and nothing else to compare with".into(),
            )),
        };
    }
    match (e.equals, e.at_most, e.at_least) {
        (None, None, None) => {
            Err((e.quantity.span(), "an expectation needs `equals`, `at_most`, `at_least` or `curve`".into()))
        }
        (Some(_), ..) if e.within.is_none() => {
            Err((e.quantity.span(), "`equals` needs `within`, its tolerance".into()))
        }
        _ => Ok(()),
    }
}

/// What is measured, of what, when.
fn check_measure(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    check_what_is_measured(scene, e)?;
    let end = *scene.world.duration.as_ref();
    if let Some(at) = &e.at
        && !(0.0..=end).contains(at.as_ref())
    {
        let message = format!("`at` is {} s, but the scene lasts from 0 to {end} s", at.as_ref());
        return Err((at.span(), message));
    }
    if let Some(during) = &e.during {
        let [from, to] = *during.as_ref();
        if !(from >= 0.0 && from < to && to <= end) {
            let message = format!("`during` is from {from} to {to} s, but the scene lasts from 0 to {end} s");
            return Err((during.span(), message));
        }
    }
    if e.take == Some(Take::SettleTime) && e.within.is_none() {
        return Err((e.quantity.span(), "`settle_time` needs `within`, how near to the last value".into()));
    }
    if e.holds.is_some() && (e.take.is_some() || e.at.is_some()) {
        return Err((e.quantity.span(), "`holds` looks at every step: give no `take` and no `at`".into()));
    }
    check_filter(scene, e)
}

fn check_filter(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    let Some(cfc) = &e.cfc else { return Ok(()) };
    let (class, dt) = (*cfc.as_ref(), f64::from(*scene.world.dt.as_ref()));
    if ![60, 180, 600, 1000].contains(&class) {
        return Err((cfc.span(), format!("`cfc` is {class}, but there are: 60, 180, 600, 1000")));
    }
    if dt * SAMPLES_PER_CLASS * f64::from(class) > 1.0 + 1e-6 {
        let most = 1.0 / (SAMPLES_PER_CLASS * f64::from(class));
        return Err((
            cfc.span(),
            format!("`cfc` {class} needs a `dt` of at most {most:.6} s, and it is {dt} s"),
        ));
    }
    Ok(())
}

/// Whether the thing has the quantity, and a force the body that it is on.
fn check_what_is_measured(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    let all: Vec<&str> = scene.names().collect();
    let quantity = *e.quantity.as_ref();
    for name in [Some(&e.of), e.minus.as_ref()].into_iter().flatten() {
        let text = name.as_ref().as_str();
        if text == "all" && quantity.is_energy() {
            continue;
        }
        if !all.contains(&text) {
            let key = if std::ptr::eq(name, &e.of) { "of" } else { "minus" };
            return Err(unknown(name, key, "a body or probe", &all));
        }
        check_quantity(scene, name, quantity)?;
    }
    let bodies: Vec<&str> = rigid_names(scene).into_iter().chain(deformable_names(scene)).collect();
    match &e.on {
        Some(on) if quantity.is_force() && !bodies.contains(&on.as_ref().as_str()) => {
            Err(unknown(on, "on", "a body", &bodies))
        }
        None if quantity.is_force() => {
            Err((e.quantity.span(), "`force` needs `on`, the body that touches".into()))
        }
        Some(on) if !quantity.is_force() => Err((on.span(), "`on` is for the quantity `force` only".into())),
        _ => Ok(()),
    }
}

/// Whether it has the quantity.
fn check_quantity(scene: &Scene, name: &Spanned<String>, quantity: Quantity) -> Result<(), Mistake> {
    let text = name.as_ref().as_str();
    if (quantity.is_soft() || quantity == Quantity::ElasticEnergy) && !deformable_names(scene).contains(&text)
    {
        let message = format!("`of` must name a deformable for this quantity, and \"{text}\" is none");
        return Err((name.span(), message));
    }
    let is_probe = scene.probe.iter().any(|p| p.name.as_ref() == text);
    if is_probe && !quantity.is_of_points() {
        return Err((name.span(), format!("a probe has no `{}`; name its body", quantity.name())));
    }
    Ok(())
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
        Shape::Mesh { scale, .. } => vec![("scale", *scale)],
        Shape::Heightfield { heights, size } => {
            if let Some(problem) = heightfield_problem(heights) {
                return Some(problem);
            }
            size.iter().map(|s| ("size", *s)).collect()
        }
    };
    let wrong = lengths.into_iter().find(|(_, length)| !(*length > 0.0 && *length <= LARGEST));
    wrong.map(|(key, length)| format!("`{key}` is {length}, but must be positive, up to {LARGEST:e}"))
}

fn heightfield_problem(heights: &[Vec<f32>]) -> Option<String> {
    let columns = heights.first().map_or(0, Vec::len);
    if heights.len() < 2 || columns < 2 || heights.iter().any(|row| row.len() != columns) {
        return Some("`heights` must be at least two rows of equal length, of two numbers or more".into());
    }
    let wrong = heights.iter().flatten().find(|h| !(h.abs() <= LARGEST));
    wrong.map(|h| format!("`heights` has {h}, but must be numbers up to {LARGEST:e}"))
}

fn cells_problem(cells: &[usize]) -> Option<String> {
    if cells.contains(&0) {
        return Some(format!("`cells` is {cells:?}, but every axis needs at least one"));
    }
    let count: f64 = cells.iter().map(|c| *c as f64).product();
    (count > MOST_CELLS).then(|| format!("`cells` is {cells:?}, but {MOST_CELLS:.0} are the most"))
}

fn body_problem(body: &Body) -> Option<String> {
    match body {
        Body::Lattice { half_extents, cells } | Body::Network { half_extents, cells } => {
            cells_problem(cells).or_else(|| shape_problem(&Shape::Cuboid { half_extents: *half_extents }))
        }
        Body::Filled { shape, cell_size } => {
            if matches!(shape, Shape::Mesh { .. } | Shape::Heightfield { .. }) {
                return Some("`filled` fills simple shapes; give `mesh` as the body itself".into());
            }
            shape_problem(shape).or_else(|| filled_problem(shape, *cell_size))
        }
        Body::Cloth { half_extents: [x, z], cells, thickness } => {
            let thin = !(*thickness > 0.0 && thickness.is_finite());
            let thin = thin.then(|| format!("`thickness` is {thickness}, but must be positive"));
            let sides = || shape_problem(&Shape::Cuboid { half_extents: [*x, *thickness, *z] });
            cells_problem(cells).or(thin).or_else(sides)
        }
        Body::Rope { points, segments, radius } => {
            if points.len() < 2 || *segments == 0 {
                return Some("a rope needs at least two `points` and one of `segments`".into());
            }
            if *segments as f64 > MOST_CELLS {
                return Some(format!("`segments` is {segments}, but {MOST_CELLS:.0} are the most"));
            }
            shape_problem(&Shape::Ball { radius: *radius })
        }
        Body::Mesh { cell_size, scale, .. } => {
            let wrong = [("cell_size", cell_size.unwrap_or(1.0)), ("scale", *scale)];
            let wrong = wrong.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite()));
            wrong.map(|(key, v)| format!("`{key}` is {v}, but must be positive"))
        }
    }
}

fn filled_problem(shape: &Shape, cell_size: f32) -> Option<String> {
    if !(cell_size > 0.0 && cell_size.is_finite()) {
        return Some(format!("`cell_size` is {cell_size}, but must be positive"));
    }
    let sides = match *shape {
        Shape::Ball { radius } => [radius; 3],
        Shape::Cuboid { half_extents } => half_extents,
        Shape::Capsule { half_height, radius } => [radius, half_height + radius, radius],
        Shape::Cylinder { half_height, radius } | Shape::Cone { half_height, radius } => {
            [radius, half_height, radius]
        }
        _ => [0.0; 3],
    };
    let cells: f64 = sides.iter().map(|s| (2.0 * f64::from(*s) / f64::from(cell_size)).ceil()).product();
    (cells > MOST_CELLS).then(|| {
        format!(
            "`cell_size` of {cell_size} m cuts it into {cells:.0} cells, but {MOST_CELLS:.0} are the most"
        )
    })
}
