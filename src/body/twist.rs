//! Rods whose ends are held against roll: how far they are twisted, and the torque of that.

use super::body::{DeformableBody, in_range};
use super::builder::DeformableBodyBuilder;
use super::state::DeformableState;
use crate::error::BodyError;
use crate::fem::{DeformableModel, EndFrame, TwistedRod};
use crate::math::{Mat3, Vec3, dot};
use rapier3d::dynamics::RigidBodyHandle;

/// How far a unit vector may be from one: it is turned in every step, by rotations of single precision.
const UNIT: f64 = 1.0e-3;

/// A rod that is held at both of its ends.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct HeldTwist {
    /// Its place among the model's.
    pub rod: u32,
    /// By which the last end is rolled beyond what its frame says \[rad\].
    pub roll: f64,
    pub ends: [HeldEnd; 2],
    /// Between the frames, after the last step \[rad\]: whole turns are counted from here.
    pub angle: f64,
}

/// What holds an end of a rod.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct HeldEnd {
    /// The rigid body that the end is attached to; else it is held in the world.
    pub on: Option<RigidBodyHandle>,
    /// In the frame of that body, or in the world.
    pub frame: EndFrame,
    /// In the world, at the end of the step.
    pub placed: EndFrame,
}

impl HeldTwist {
    /// Where the frames are in the world.
    pub fn frames(&self) -> [EndFrame; 2] {
        self.ends.map(|end| end.placed)
    }
}

impl DeformableBody {
    /// Holds both ends of a rod against roll: from now on it resists twist, which a rod that is not held does not know. `roll` \[rad\]
    /// is how far the last end is rolled against the first, right-handed about the rod from its first vertex on, beyond how both are
    /// now; called again it changes that, whole turns and all. An end whose vertex is attached to a rigid body, without compliance or length, rolls
    /// with it from the next step on, and the torque acts on that body; others are held in the world, whichever way they point. A ring is
    /// held by itself.
    ///
    /// The twist is alike all along: it has no inertia [Bergou et al. 2008]. The section is round; a rod that is bent at rest keeps how
    /// much it bends there, and not which way.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// // A metre of rubber cord, clamped at both ends and twisted by two turns.
    /// let points: Vec<[f64; 3]> = (0..=20).map(|k| [0.05 * f64::from(k), 0.0, 0.0]).collect();
    /// let rubber = DeformableMaterial::new(1.0e6, 0.4);
    /// let cord = DeformableBodyBuilder::structure(&Structure::rod(&points, 0.01)?).material(rubber);
    /// let mut cord = cord.pinned(|x| x.x < 0.06 || x.x > 0.94).build()?;
    /// cord.hold_twist(0, 4.0 * std::f64::consts::PI)?;
    /// // GJ/l times the angle.
    /// let torque = 1.0e6 / 2.8 * 0.5 * std::f64::consts::PI * 1.0e-8 * 4.0 * std::f64::consts::PI;
    /// assert!((cord.twist_torque(0)? / torque - 1.0).abs() < 1.0e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::NoSuchRod`]; [`BodyError::OutOfRange`] for a roll that is not finite.
    pub fn hold_twist(&mut self, rod: usize, roll: f64) -> Result<(), BodyError> {
        self.check_rod(rod)?;
        in_range("roll", roll, "finite", roll.is_finite())?;
        self.wake_up();
        match self.state.twists.binary_search_by_key(&(rod as u32), |held| held.rod) {
            Ok(place) => self.state.twists[place].roll = roll,
            Err(place) => {
                let frames = self.model.end_frames(rod, &self.state.x);
                let ends = frames.map(|frame| HeldEnd { on: None, frame, placed: frame });
                self.state.twists.insert(place, HeldTwist { rod: rod as u32, roll, ends, angle: 0.0 });
            }
        }
        Ok(())
    }

    /// Lets the ends of a rod roll freely; its twist is gone.
    ///
    /// # Errors
    /// [`BodyError::NoSuchRod`].
    pub fn release_twist(&mut self, rod: usize) -> Result<(), BodyError> {
        self.check_rod(rod)?;
        self.wake_up();
        self.state.twists.retain(|held| held.rod as usize != rod);
        Ok(())
    }

    /// By how much a rod is twisted from end to end \[rad\], its roll and what bending and the bodies at its ends have done to it; `None` if its
    /// ends are not held.
    ///
    /// # Errors
    /// [`BodyError::NoSuchRod`].
    pub fn twist(&self, rod: usize) -> Result<Option<f64>, BodyError> {
        self.check_rod(rod)?;
        let held = self.state.twists.iter().find(|held| held.rod as usize == rod);
        Ok(held.map(|held| held.roll + held.angle))
    }

    /// Torque \[N·m\] along a rod that is twisted: it turns the last end back, about the rod; zero if its ends are not held.
    ///
    /// # Errors
    /// [`BodyError::NoSuchRod`].
    pub fn twist_torque(&self, rod: usize) -> Result<f64, BodyError> {
        let twist = self.twist(rod)?.unwrap_or(0.0);
        Ok(twist * self.model.torsional_stiffness(rod, &self.materials))
    }

    fn check_rod(&self, rod: usize) -> Result<(), BodyError> {
        let rods = self.model.rod_count();
        if rod < rods { Ok(()) } else { Err(BodyError::NoSuchRod { rod, rods }) }
    }

    /// Tells how far rods are twisted where the body is.
    pub(crate) fn note_twists(&mut self) {
        for held in &mut self.state.twists {
            let (nodes, frames) = (self.model.rod(held.rod as usize), held.frames());
            let angle = TwistedRod { nodes, frames: &frames }.angle(&self.state.x, held.angle);
            // Of nodes that are not numbers the last one stays.
            held.angle = if angle.is_finite() { angle } else { held.angle };
        }
    }

    /// How fast the motion of the nodes twists a rod [rad/s].
    pub(crate) fn twist_by_motion(&self, held: &HeldTwist) -> f64 {
        let (nodes, frames) = (self.model.rod(held.rod as usize), held.frames());
        let mut gradient = vec![Vec3::zeros(); self.state.x.len()];
        TwistedRod { nodes, frames: &frames }.add_gradient(&self.state.x, 1.0, &mut gradient);
        dot(&gradient, &self.state.v)
    }

    /// Adds what twisted rods do to the nodes \[N\]; gives their energy \[J\].
    pub(super) fn add_twist_response(&self, force: &mut [Vec3]) -> f64 {
        let mut energy = 0.0;
        for held in &self.state.twists {
            let rod = held.rod as usize;
            let (nodes, frames) = (self.model.rod(rod), held.frames());
            let twisted = TwistedRod { nodes, frames: &frames };
            let twist = held.roll + twisted.angle(&self.state.x, held.angle);
            let stiffness = self.model.torsional_stiffness(rod, &self.materials);
            twisted.add_gradient(&self.state.x, -stiffness * twist, force);
            energy += 0.5 * stiffness * twist * twist;
        }
        energy
    }

    /// Turns what is held in the world with the body.
    pub(super) fn turn_twists(&mut self, rotation: &Mat3) {
        for end in self.state.twists.iter_mut().flat_map(|held| &mut held.ends) {
            end.placed = end.placed.map(|v| rotation * v);
            if end.on.is_none() {
                end.frame = end.placed;
            }
        }
    }
}

impl DeformableBodyBuilder {
    /// Holds the ends of a rod against roll, as [`DeformableBody::hold_twist`]: `roll` \[rad\] beyond what its rest shape has. One that is not
    /// there is an error of [`DeformableBodyBuilder::build`].
    pub fn hold_twist(mut self, rod: usize, roll: f64) -> Self {
        self.twists.push((rod, roll));
        self
    }
}

impl DeformableState {
    /// Whether what holds rods can hold those of a model.
    pub(super) fn are_twists(&self, model: &DeformableModel) -> bool {
        let is_unit = |v: &Vec3| (v.norm() - 1.0).abs() < UNIT;
        let is_frame = |frame: &EndFrame| is_unit(&frame.tangent) && is_unit(&frame.director);
        let is_held = |held: &HeldTwist| {
            let frames = held.ends.iter().flat_map(|end| [&end.frame, &end.placed]);
            (held.rod as usize) < model.rod_count()
                && held.roll.is_finite()
                && held.angle.is_finite()
                && frames.into_iter().all(is_frame)
        };
        self.twists.is_sorted_by(|a, b| a.rod < b.rod) && self.twists.iter().all(is_held)
    }
}
