//! What fills cavities, in the Hessian of a step: `−p ∇²V`, which is sparse, and `k ∇V ∇Vᵀ` with `k = −dp/dV`, one direction a room.

use crate::energy::CavityFilling;
use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3, dot};

/// A filled room where a step has ended.
pub(super) struct FilledRoom {
    cavity: usize,
    /// \[Pa\], and `−dp/dV` [Pa/m³].
    pressure: f64,
    stiffness: f64,
    /// ∇V \[m²\].
    gradient: Vec<Vec3>,
}

/// The filled rooms where the nodes are at `x`.
pub(super) fn filled_rooms(
    model: &DeformableModel,
    fillings: &[Option<CavityFilling>],
    x: &[Vec3],
) -> Vec<FilledRoom> {
    let filled = fillings.iter().enumerate().filter_map(|(cavity, filling)| Some((cavity, (*filling)?)));
    let rooms = filled.map(|(cavity, filling)| {
        let (room, mut gradient) = (&model.cavities[cavity], vec![Vec3::zeros(); x.len()]);
        let volume = room.volume(x);
        room.add_gradient(x, 1.0, &mut gradient);
        let (pressure, stiffness) = (filling.pressure(volume), filling.stiffness(volume));
        FilledRoom { cavity, pressure, stiffness, gradient }
    });
    rooms.collect()
}

impl FilledRoom {
    /// ∇V and k.
    pub fn direction(&self) -> (Vec<Vec3>, f64) {
        (self.gradient.clone(), self.stiffness)
    }

    /// Adds `−p ∇²V`.
    pub fn add_pressed(&self, model: &DeformableModel, x: &[Vec3], add: &mut dyn FnMut(usize, usize, &Mat3)) {
        let cavity = &model.cavities[self.cavity];
        cavity.second_derivatives(x, |i, j, block| add(i, j, &(block * -self.pressure)));
    }
}

/// What z says of a pressure more in each cavity of a model.
pub(super) fn of_pressures(rooms: &[FilledRoom], cavities: usize, z: &[Vec3]) -> Vec<f64> {
    let mut of = vec![0.0; cavities];
    rooms.iter().for_each(|room| of[room.cavity] = dot(&room.gradient, z));
    of
}
