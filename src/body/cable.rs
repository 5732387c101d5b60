//! Cables: routed through points of bodies, of rigid bodies and of the world, and drawn at one end.

use super::handle::DeformableBodyHandle;
use crate::error::BodyError;
use crate::math::{Pose64, Vec3, to_real};
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::math::Vector;

/// A point that a cable runs through. It is tied to its first point, and drawn at its last.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum CablePoint {
    /// A place in the world \[m\].
    World(Vector),
    /// A place on a rigid body or multibody link, in its frame \[m\].
    RigidBody(RigidBodyHandle, Vector),
    /// A vertex of a deformable body, on its surface or inside.
    Vertex(DeformableBodyHandle, usize),
    /// A place inside of a body of tetrahedra, where that is now \[m\]; it goes with the material.
    Inside(DeformableBodyHandle, Vector),
}

/// How a cable begins: its points, and what is not as usual.
#[derive(Clone, Debug)]
pub struct DeformableCableBuilder {
    pub(super) points: Vec<CablePoint>,
    pub(super) friction: f64,
    pub(super) compliance: f64,
    pub(super) length: Option<f64>,
    pub(super) tension: Option<f64>,
    pub(super) speed: f64,
    pub(super) max_tension: f64,
}

impl DeformableCableBuilder {
    /// A cable through these points, two at least, tied to the first and drawn at the last: taut as it is, hard and without friction.
    pub fn new(points: impl IntoIterator<Item = CablePoint>) -> Self {
        Self {
            points: points.into_iter().collect(),
            friction: 0.0,
            compliance: 0.0,
            length: None,
            tension: None,
            speed: f64::INFINITY,
            max_tension: f64::INFINITY,
        }
    }

    /// Coefficient of friction at the points in between: the tensions on the two sides of one are apart by no more than
    /// `e^(μθ)`, where the cable turns by the angle θ there.
    #[must_use]
    pub fn friction(mut self, friction: f64) -> Self {
        self.friction = friction;
        self
    }

    /// Stretch per tension [m/N].
    #[must_use]
    pub fn compliance(mut self, compliance: f64) -> Self {
        self.compliance = compliance;
        self
    }

    /// Length \[m\] that it is to have without tension, as by [`DeformableCable::set_length`].
    #[must_use]
    pub fn length(mut self, length: f64) -> Self {
        self.length = Some(length);
        self
    }

    /// Tension \[N\] at the end that is drawn, as by [`DeformableCable::set_tension`].
    #[must_use]
    pub fn tension(mut self, tension: f64) -> Self {
        self.tension = Some(tension);
        self
    }

    /// How fast a winch takes in and lets out, at the most [m/s].
    #[must_use]
    pub fn speed(mut self, speed: f64) -> Self {
        self.speed = speed;
        self
    }

    /// How hard a winch holds, at the most \[N\]: beyond that, cable runs off it.
    #[must_use]
    pub fn max_tension(mut self, max_tension: f64) -> Self {
        self.max_tension = max_tension;
        self
    }

    pub(super) fn check(&self) -> Result<(), BodyError> {
        let checks = [
            ("it needs two points at least", self.points.len() >= 2),
            ("its friction is not a number from 0 on", in_range(self.friction)),
            ("its compliance is not a number from 0 on", in_range(self.compliance)),
            ("its length is not a number from 0 on", self.length.is_none_or(in_range)),
            ("its tension is not a number from 0 on", self.tension.is_none_or(in_range)),
            ("its speed is negative or NaN", self.speed >= 0.0),
            ("its largest tension is negative or NaN", self.max_tension >= 0.0),
        ];
        match checks.into_iter().find(|(_, holds)| !holds) {
            Some((what, _)) => Err(BodyError::BadCable { what }),
            None => Ok(()),
        }
    }
}

pub(super) fn in_range(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

/// A cable. It pulls and never pushes.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableCable {
    pub(crate) route: Vec<Guide>,
    friction: f64,
    compliance: f64,
    /// Without tension; `None` until the first step finds how long it is.
    free_length: Option<f64>,
    target: Option<f64>,
    tension: Option<f64>,
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    speed: f64,
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    max_tension: f64,
    /// Of the last step \[N\], from the first point on.
    pub(crate) tensions: Vec<f64>,
    /// What it did to its points in the last step \[N\].
    pub(crate) forces: Vec<Vec3>,
    /// Where its points were at the start of the last step.
    pub(crate) points: Vec<Vec3>,
    changed: bool,
    rigid_poses: Vec<Option<Pose64>>,
    /// Where the length of the last step is from.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    length_from: LengthFrom,
}

/// What the length of a cable without tension at the end of a step follows from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum LengthFrom {
    /// It is the one that was asked for.
    #[default]
    Target,
    /// From that before the step.
    Before,
    /// From the way through its points at the start of the step.
    Way,
}

/// A point of a cable, on what carries it.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Guide {
    World(Vec3),
    Rigid(RigidBodyHandle, Vec3),
    /// Nodes and their weights, which add up to one.
    Soft(DeformableBodyHandle, [u32; 4], [f64; 4]),
}

/// What a winch holds in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Winch {
    /// A given tension \[N\].
    Tension(f64),
    /// Lengths without tension at the start and the end of the step \[m\], and the largest tension \[N\].
    Length { before: f64, after: f64, most: f64 },
}

impl DeformableCable {
    pub(super) fn new(route: Vec<Guide>, builder: &DeformableCableBuilder) -> Self {
        Self {
            friction: builder.friction,
            compliance: builder.compliance,
            free_length: None,
            target: builder.length,
            tension: builder.tension,
            speed: builder.speed,
            max_tension: builder.max_tension,
            tensions: vec![0.0; route.len() - 1],
            forces: vec![Vec3::zeros(); route.len()],
            points: Vec::new(),
            changed: true,
            rigid_poses: vec![None; route.len()],
            length_from: LengthFrom::default(),
            route,
        }
    }

    /// Has a winch hold it at a length without tension \[m\], and take it in or let it out until it has that, at no more than its
    /// speed and with no more than its largest tension.
    ///
    /// # Errors
    /// [`BodyError::BadCable`] for what is negative or not finite; also of the other setters.
    pub fn set_length(&mut self, length: f64) -> Result<(), BodyError> {
        self.check("its length is not a number from 0 on", in_range(length))?;
        (self.target, self.tension) = (Some(length), None);
        Ok(())
    }

    /// Has it drawn with a given tension \[N\] at its last point, whatever its length.
    ///
    /// # Errors
    /// As [`DeformableCable::set_length`].
    pub fn set_tension(&mut self, tension: f64) -> Result<(), BodyError> {
        self.check("its tension is not a number from 0 on", in_range(tension))?;
        self.tension = Some(tension);
        Ok(())
    }

    /// Changes how fast a winch takes in and lets out [m/s]; infinite is at once.
    ///
    /// # Errors
    /// As [`DeformableCable::set_length`].
    pub fn set_speed(&mut self, speed: f64) -> Result<(), BodyError> {
        self.check("its speed is negative or NaN", speed >= 0.0)?;
        self.speed = speed;
        Ok(())
    }

    /// Changes how hard a winch holds \[N\]; infinite is whatever it takes.
    ///
    /// # Errors
    /// As [`DeformableCable::set_length`].
    pub fn set_max_tension(&mut self, tension: f64) -> Result<(), BodyError> {
        self.check("its largest tension is negative or NaN", tension >= 0.0)?;
        self.max_tension = tension;
        Ok(())
    }

    /// Changes the friction at the points in between.
    ///
    /// # Errors
    /// As [`DeformableCable::set_length`].
    pub fn set_friction(&mut self, friction: f64) -> Result<(), BodyError> {
        self.check("its friction is not a number from 0 on", in_range(friction))?;
        self.friction = friction;
        Ok(())
    }

    fn check(&mut self, what: &'static str, holds: bool) -> Result<(), BodyError> {
        self.changed |= holds;
        if holds { Ok(()) } else { Err(BodyError::BadCable { what }) }
    }

    /// Friction at the points in between.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// Stretch per tension [m/N].
    pub fn compliance(&self) -> f64 {
        self.compliance
    }

    /// Length without tension that is off the winch \[m\]; `None` before the first step of a cable that is as long as it is.
    /// With a given tension it is as long as its way through its points was at the start of the last step.
    pub fn free_length(&self) -> Option<f64> {
        self.free_length
    }

    /// Tension at the end that is drawn, in the last step \[N\].
    pub fn tension(&self) -> f64 {
        self.tensions.last().copied().unwrap_or(0.0)
    }

    /// Tension that it is drawn with, if that is given \[N\].
    pub(crate) fn given_tension(&self) -> Option<f64> {
        self.tension
    }

    pub(crate) fn length_from(&self) -> LengthFrom {
        self.length_from
    }

    /// Whether it ran off a winch that holds it at a length.
    pub(crate) fn runs_off(&self) -> bool {
        self.tension() >= self.max_tension * (1.0 - 1.0e-9)
    }

    /// Tensions between the points, from the first on, in the last step \[N\].
    pub fn tensions(&self) -> &[f64] {
        &self.tensions
    }

    /// What it did to one of its points in the last step \[N\], in the world; `None` beyond the last.
    pub fn force(&self, point: usize) -> Option<Vector> {
        self.forces.get(point).map(to_real)
    }

    /// Number of its points.
    pub fn point_count(&self) -> usize {
        self.route.len()
    }

    /// The deformable bodies that it runs through; one that it does twice is named twice.
    pub fn bodies(&self) -> impl Iterator<Item = DeformableBodyHandle> + '_ {
        self.route.iter().filter_map(|guide| match guide {
            Guide::Soft(body, ..) => Some(*body),
            Guide::World(_) | Guide::Rigid(..) => None,
        })
    }

    /// Begins a step of `h` \[s\] in which it is so long; tells what the winch holds.
    pub(crate) fn wind(&mut self, path_length: f64, h: f64) -> Winch {
        if let Some(tension) = self.tension {
            self.free_length = Some(path_length);
            self.length_from = LengthFrom::Way;
            return Winch::Tension(tension);
        }
        let mut before = self.free_length.unwrap_or(path_length);
        let mut from = if self.free_length.is_some() { LengthFrom::Before } else { LengthFrom::Way };
        if self.runs_off() {
            // It has run off the winch.
            before = before.max(path_length - self.compliance * self.tension());
            from = LengthFrom::Way;
        }
        let target = self.target.unwrap_or(before);
        let most = self.speed * h;
        let after = if self.free_length.is_none() && self.speed == f64::INFINITY {
            target
        } else {
            before + (target - before).clamp(-most, most)
        };
        self.length_from = if self.target == Some(after) { LengthFrom::Target } else { from };
        self.changed |= after != before;
        self.free_length = Some(after);
        Winch::Length { before, after, most: self.max_tension }
    }

    /// Forgets what it did in the last step.
    pub(crate) fn reset(&mut self) {
        self.tensions.fill(0.0);
        self.forces.fill(Vec3::zeros());
    }

    /// Whether something was changed since this was asked last, or a rigid body that it runs through is not where it was.
    pub(crate) fn take_changed(&mut self, mut pose: impl FnMut(RigidBodyHandle) -> Option<Pose64>) -> bool {
        let mut changed = std::mem::take(&mut self.changed);
        for (guide, known) in self.route.iter().zip(&mut self.rigid_poses) {
            if let Guide::Rigid(handle, _) = guide {
                let now = pose(*handle);
                changed |= std::mem::replace(known, now) != now;
            }
        }
        changed
    }

    /// The rigid bodies that it runs through.
    pub(crate) fn rigid_bodies(&self) -> impl Iterator<Item = RigidBodyHandle> + '_ {
        self.route.iter().filter_map(|guide| match guide {
            Guide::Rigid(handle, _) => Some(*handle),
            Guide::World(_) | Guide::Soft(..) => None,
        })
    }

    /// Whether all numbers are such as its user can set.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn has_sound_numbers(&self) -> bool {
        let sound = |point: &Vec3| super::snapshot::is_finite(point);
        let are_guides = self.route.iter().all(|guide| match guide {
            Guide::World(point) | Guide::Rigid(_, point) => sound(point),
            Guide::Soft(_, _, weights) => weights.iter().all(|w| w.is_finite()),
        });
        let count = self.route.len();
        let fits = count >= 2
            && self.tensions.len() == count - 1
            && self.forces.len() == count
            && self.rigid_poses.len() == count;
        let lengths = [self.free_length, self.target, self.tension].into_iter().flatten();
        are_guides
            && fits
            && lengths.chain([self.friction, self.compliance]).all(in_range)
            && self.tensions.iter().copied().all(in_range)
            && self.speed >= 0.0
            && self.max_tension >= 0.0
    }
}
