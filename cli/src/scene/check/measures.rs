//! What is measured and expected: whether it can be, and when.

use super::{deformable_names, rigid_names};
use crate::scene::mistake::{Mistake, unknown};
use crate::scene::{Expect, Quantity, Scene, Take, When};
use std::ops::Range;
use toml::Spanned;

/// Samples of a filter's signal per hertz of its class [SAE 2014].
const SAMPLES_PER_CLASS: f64 = 10.0;

pub(super) fn check_expectation(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
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
pub(super) fn check_measure(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
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
    if let Some(until) = &e.until {
        if e.at.is_some() {
            return Err((until.span(), "`until` ends the time that is looked at: give no `at`".into()));
        }
        check_condition(scene, until.as_ref(), until.span(), "until")?;
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

/// The condition of a trigger.
pub(super) fn check_when(scene: &Scene, when: &When, at: Range<usize>) -> Result<(), Mistake> {
    check_condition(scene, when, at.clone(), "when")?;
    if *when.quantity.as_ref() == Quantity::AccelerationG || when.quantity.as_ref().is_of_steps() {
        let name = when.quantity.as_ref().name();
        return Err((
            at,
            format!("`when`: `{name}` is known after the run only; take a `speed` or a `force`"),
        ));
    }
    Ok(())
}

fn check_condition(scene: &Scene, when: &When, at: Range<usize>, key: &str) -> Result<(), Mistake> {
    check_quantity_of(scene, *when.quantity.as_ref(), when.quantity.span(), &[&when.of], when.on.as_ref())?;
    if when.at_most.is_none() && when.at_least.is_none() {
        return Err((at, format!("`{key}` needs `at_most` or `at_least`")));
    }
    Ok(())
}

fn check_what_is_measured(scene: &Scene, e: &Expect) -> Result<(), Mistake> {
    let of: Vec<&Spanned<String>> = [Some(&e.of), e.minus.as_ref()].into_iter().flatten().collect();
    check_quantity_of(scene, *e.quantity.as_ref(), e.quantity.span(), &of, e.on.as_ref())
}

/// Whether things have the quantity, and a force the body that it is on. The second of the things is taken off.
fn check_quantity_of(
    scene: &Scene,
    quantity: Quantity,
    at: Range<usize>,
    of: &[&Spanned<String>],
    on: Option<&Spanned<String>>,
) -> Result<(), Mistake> {
    if quantity.is_of_actuation() {
        let known: Vec<&str> = match quantity {
            Quantity::Signal => scene.actuator.iter().map(|a| a.name.as_ref().as_str()).collect(),
            _ => scene.cable.iter().map(|c| c.name.as_ref().as_str()).collect(),
        };
        let wrong = of.iter().zip(["of", "minus"]).find(|(name, _)| !known.contains(&name.as_ref().as_str()));
        let what = if quantity == Quantity::Signal { "an actuator" } else { "a cable" };
        if let Some((name, key)) = wrong {
            return Err(unknown(name, key, what, &known));
        }
        return on.map_or(Ok(()), |on| Err((on.span(), "`on` is for forces and `slip_speed` only".into())));
    }
    let all: Vec<&str> = scene.names().collect();
    for (name, key) in of.iter().zip(["of", "minus"]) {
        let text = name.as_ref().as_str();
        if text == "all" && quantity.is_energy() {
            continue;
        }
        if !all.contains(&text) {
            return Err(unknown(name, key, "a body or probe", &all));
        }
        check_quantity(scene, name, quantity)?;
    }
    let bodies: Vec<&str> = rigid_names(scene).into_iter().chain(deformable_names(scene)).collect();
    match on {
        Some(on) if quantity.is_force() && !bodies.contains(&on.as_ref().as_str()) => {
            Err(unknown(on, "on", "a body", &bodies))
        }
        None if quantity.is_force() => {
            Err((at, format!("`{}` needs `on`, the body that touches", quantity.name())))
        }
        Some(on) if !quantity.is_force() => {
            Err((on.span(), "`on` is for forces and `slip_speed` only".into()))
        }
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
