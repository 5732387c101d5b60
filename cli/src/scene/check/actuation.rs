//! Whether cables and signals name what is there.

use super::{deformable_names, rigid_names};
use crate::scene::mistake::{Mistake, unknown};
use crate::scene::{ActuatorEntry, Cable, Scene};

pub(super) fn check_cable(scene: &Scene, cable: &Cable) -> Result<(), Mistake> {
    let bodies: Vec<&str> = rigid_names(scene).into_iter().chain(deformable_names(scene)).collect();
    let carriers = cable.points.iter().filter_map(|point| point.of.as_ref());
    if let Some(wrong) = carriers.clone().find(|of| !bodies.contains(&of.as_ref().as_str())) {
        return Err(unknown(wrong, "of", "a body", &bodies));
    }
    let soft = deformable_names(scene);
    if !carriers.into_iter().any(|of| soft.contains(&of.as_ref().as_str())) {
        return Err((cable.name.span(), "none of its `points` is `of` a deformable".into()));
    }
    if cable.length.is_some() && cable.tension.is_some() {
        return Err((cable.name.span(), "give `length` or `tension`, not both".into()));
    }
    Ok(())
}

pub(super) fn check_actuator(scene: &Scene, actuator: &ActuatorEntry) -> Result<(), Mistake> {
    let at = || actuator.name.span();
    if actuator.drives.is_motor() {
        let Some(pair) = &actuator.between else {
            return Err((at(), "a motor needs `between`, the two bodies of its joint".into()));
        };
        if !scene.joint.iter().any(|joint| joint.is_between(pair[0].as_ref(), pair[1].as_ref())) {
            let [a, b] = pair.each_ref().map(|name| name.as_ref());
            return Err((
                pair[0].span(),
                format!("`between`: there is no joint between \"{a}\" and \"{b}\""),
            ));
        }
    } else {
        let (known, what) = match actuator.drives.is_of_cables() {
            true => (scene.cable.iter().map(|c| c.name.as_ref().as_str()).collect(), "a cable"),
            false => (deformable_names(scene), "a deformable"),
        };
        match &actuator.of {
            Some(of) if known.contains(&of.as_ref().as_str()) => {}
            Some(of) => return Err(unknown(of, "of", what, &known)),
            None => return Err((at(), format!("it needs `of`, {what}"))),
        }
    }
    let times = actuator.then.iter().map(|command| command.at);
    if !times.clone().is_sorted() || times.into_iter().any(|t| !(t >= 0.0 && t.is_finite())) {
        return Err((at(), "the times of `then` must not be negative, and ascend".into()));
    }
    if actuator.then.iter().any(|command| !command.value.is_finite()) {
        return Err((at(), "`value` must be a number".into()));
    }
    Ok(())
}
