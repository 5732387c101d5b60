//! Vertices that are held, or led along.

use super::body::{DeformableBody, Pin, finite};
use crate::error::BodyError;
use crate::math::Vec3;
use rapier3d::dynamics::RigidBodyType;
use rapier3d::math::Vector;

impl DeformableBody {
    /// Holds a vertex where it is. Up to sixteen more or less than in the steps before cost no new factor.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`].
    pub fn pin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        let pin = Pin::at(node, self.state.x[node]);
        let pins = self.own_pins();
        match place_of(pins, node) {
            Ok(place) => pins[place] = pin,
            Err(place) => pins.insert(place, pin),
        }
        Ok(())
    }

    /// Lets a pinned vertex go.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`].
    pub fn unpin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        let pins = self.own_pins();
        pins.remove(place_of(pins, node).map_err(|_| BodyError::NotPinned { vertex })?);
        Ok(())
    }

    /// Leads a pinned vertex: it reaches `target` \[m\] at the end of the next step.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`], [`BodyError::NotFinite`].
    pub fn move_pin(&mut self, vertex: usize, target: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let target = finite("pin target", target)?;
        self.pin_of(vertex)?.target = target;
        Ok(())
    }

    /// Moves a pinned vertex on with a velocity [m/s], step by step until another one is set; from where it is led.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`], [`BodyError::NotFinite`].
    pub fn set_pin_velocity(&mut self, vertex: usize, velocity: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let velocity = finite("pin velocity", velocity)?;
        self.pin_of(vertex)?.velocity = velocity;
        Ok(())
    }

    /// The vertices that its user has pinned.
    pub fn pinned(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        let pins = if self.is_led() { &self.held_pins } else { &self.pins };
        pins.iter().map(|p| self.model.vertex(p.node as usize))
    }

    /// Force \[N\] with which the pins held the body in the last step.
    pub fn pin_force(&self) -> [f64; 3] {
        self.pins.iter().map(|p| p.force).sum::<Vec3>().into()
    }

    /// The pins that its user sets; of fixed and kinematic bodies they wait.
    fn own_pins(&mut self) -> &mut Vec<Pin> {
        if self.is_led() { &mut self.held_pins } else { &mut self.pins }
    }

    /// The pin that its user may lead a vertex by: any vertex of a body that is led by positions.
    fn pin_of(&mut self, vertex: usize) -> Result<&mut Pin, BodyError> {
        let node = self.node(vertex)?;
        let leads = self.body_type() == RigidBodyType::KinematicPositionBased;
        let pins = if leads { &mut self.pins } else { self.own_pins() };
        let place = place_of(pins, node).map_err(|_| BodyError::NotPinned { vertex })?;
        Ok(&mut pins[place])
    }

    /// Leads a pinned vertex, if it is one, to where its user has put it.
    pub(super) fn move_pins_along(&mut self, node: usize) {
        let x = self.state.x[node];
        for pins in [&mut self.pins, &mut self.held_pins] {
            if let Ok(place) = place_of(pins, node) {
                pins[place].target = x;
            }
        }
    }
}

fn place_of(pins: &[Pin], node: usize) -> Result<usize, usize> {
    pins.binary_search_by_key(&(node as u32), |p| p.node)
}
