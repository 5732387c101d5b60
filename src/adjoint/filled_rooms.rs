//! What fills cavities, in the Hessian of a step: `−p ∇²V`, which is sparse, and `k ∇V ∇Vᵀ` with `k = −dp/dV`, one direction a room.

use crate::energy::CavityFilling;
use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3, dot};
use nalgebra::{DMatrix, DVector};

/// The filled rooms of a step.
#[derive(Default)]
pub(super) struct FilledRooms {
    rooms: Vec<FilledRoom>,
    /// `H⁻¹ ∇V` of those that resist, without what rooms resist; columns of three numbers a node.
    responses: Vec<f64>,
    /// Of `1/k + ∇Vᵀ H⁻¹ ∇V`.
    inverse: Option<DMatrix<f64>>,
}

struct FilledRoom {
    cavity: usize,
    /// \[Pa\], and `−dp/dV` [Pa/m³].
    pressure: f64,
    stiffness: f64,
    /// ∇V \[m²\].
    gradient: Vec<Vec3>,
}

impl FilledRooms {
    /// Takes them over where the nodes are at `x`.
    pub fn read(&mut self, model: &DeformableModel, fillings: &[Option<CavityFilling>], x: &[Vec3]) {
        self.rooms.clear();
        for (cavity, filling) in fillings.iter().enumerate() {
            let Some(filling) = filling else { continue };
            let room = &model.cavities[cavity];
            let (volume, mut gradient) = (room.volume(x), vec![Vec3::zeros(); x.len()]);
            room.add_gradient(x, 1.0, &mut gradient);
            let (pressure, stiffness) = (filling.pressure(volume), filling.stiffness(volume));
            self.rooms.push(FilledRoom { cavity, pressure, stiffness, gradient });
        }
    }

    fn resisting(&self) -> impl Iterator<Item = &FilledRoom> {
        self.rooms.iter().filter(|room| room.stiffness > 0.0)
    }

    /// Adds `−p ∇²V`.
    pub fn add_pressed(&self, model: &DeformableModel, x: &[Vec3], add: &mut dyn FnMut(usize, usize, &Mat3)) {
        for room in &self.rooms {
            model.cavities[room.cavity]
                .second_derivatives(x, |i, j, block| add(i, j, &(block * -room.pressure)));
        }
    }

    /// ∇V of those that resist as right-hand sides, zero at pinned nodes.
    pub fn pushes(&self, pins: &[u32]) -> Vec<f64> {
        let mut pushes = Vec::new();
        for room in self.resisting() {
            let first = pushes.len();
            pushes.extend(room.gradient.iter().flat_map(|g| [g.x, g.y, g.z]));
            pins.iter().for_each(|&pin| pushes[first + 3 * pin as usize..][..3].fill(0.0));
        }
        pushes
    }

    /// Sets what the solves of [`FilledRooms::pushes`] came to.
    pub fn set_responses(&mut self, responses: Vec<f64>) {
        self.responses = responses;
        let rooms: Vec<&FilledRoom> = self.resisting().collect();
        let entry = |a: usize, b: usize| {
            let own = if a == b { 1.0 / rooms[a].stiffness } else { 0.0 };
            own + along(&rooms[a].gradient, self.response(b, rooms.len()))
        };
        let matrix = DMatrix::from_fn(rooms.len(), rooms.len(), entry);
        self.inverse = matrix.try_inverse();
    }

    fn response(&self, room: usize, rooms: usize) -> &[f64] {
        let n = self.responses.len() / rooms;
        &self.responses[room * n..][..n]
    }

    /// Takes off a solution without the rooms what they resist; false if that cannot be told.
    pub fn take_off(&self, column: &mut [f64]) -> bool {
        if self.responses.is_empty() {
            return true;
        }
        let Some(inverse) = &self.inverse else { return false };
        let against = self.resisting().map(|room| along(&room.gradient, column));
        let by = inverse * DVector::from_iterator(inverse.nrows(), against);
        for (room, by) in by.iter().enumerate() {
            let response = self.response(room, inverse.nrows());
            column.iter_mut().zip(response).for_each(|(c, u)| *c -= u * by);
        }
        true
    }

    /// Takes `k ∇V ∇Vᵀ z` off what acts on the nodes that are meant.
    pub fn resist(&self, z: &[Vec3], is_meant: impl Fn(usize) -> bool, out: &mut [Vec3]) {
        for room in self.resisting() {
            let by = room.stiffness * dot(&room.gradient, z);
            let meant = out.iter_mut().zip(&room.gradient).enumerate().filter(|(node, _)| is_meant(*node));
            meant.for_each(|(_, (out, g))| *out -= g * by);
        }
    }

    /// What z says of a pressure more in each cavity of a model.
    pub fn of_pressures(&self, cavities: usize, z: &[Vec3]) -> Vec<f64> {
        let mut of = vec![0.0; cavities];
        self.rooms.iter().for_each(|room| of[room.cavity] = dot(&room.gradient, z));
        of
    }
}

fn along(gradient: &[Vec3], column: &[f64]) -> f64 {
    gradient.iter().zip(column.chunks_exact(3)).map(|(g, u)| g.x * u[0] + g.y * u[1] + g.z * u[2]).sum()
}
