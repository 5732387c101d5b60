//! What single directions resist in the Hessian of a step: `k g gᵀ` each, taken off its solves all at once [Sherman & Morrison 1950].

use crate::math::{Vec3, dot};
use nalgebra::{DMatrix, DVector};

/// Directions with their stiffness.
#[derive(Default)]
pub(super) struct Directions {
    list: Vec<(Vec<Vec3>, f64)>,
    /// `H⁻¹ g` without what they resist; columns of three numbers a node.
    responses: Vec<f64>,
    /// Of `1/k + gᵀ H⁻¹ g`.
    inverse: Option<DMatrix<f64>>,
}

impl Directions {
    /// Begins anew with those that resist anything.
    pub fn set(&mut self, directions: impl Iterator<Item = (Vec<Vec3>, f64)>) {
        self.list.clear();
        self.list.extend(directions.filter(|(_, stiffness)| *stiffness > 0.0));
    }

    /// The directions as right-hand sides, zero at pinned nodes.
    pub fn pushes(&self, pins: &[u32]) -> Vec<f64> {
        let mut pushes = Vec::new();
        for (direction, _) in &self.list {
            let first = pushes.len();
            pushes.extend(direction.iter().flat_map(|g| [g.x, g.y, g.z]));
            pins.iter().for_each(|&pin| pushes[first + 3 * pin as usize..][..3].fill(0.0));
        }
        pushes
    }

    /// Sets what the solves of [`Directions::pushes`] came to.
    pub fn set_responses(&mut self, responses: Vec<f64>) {
        self.responses = responses;
        let entry = |a: usize, b: usize| {
            let own = if a == b { 1.0 / self.list[a].1 } else { 0.0 };
            own + along(&self.list[a].0, self.response(b))
        };
        let matrix = DMatrix::from_fn(self.list.len(), self.list.len(), entry);
        self.inverse = matrix.try_inverse();
    }

    fn response(&self, place: usize) -> &[f64] {
        let n = self.responses.len() / self.list.len();
        &self.responses[place * n..][..n]
    }

    /// Takes off a solution without them what they resist; false if that cannot be told.
    pub fn take_off(&self, column: &mut [f64]) -> bool {
        if self.list.is_empty() {
            return true;
        }
        let Some(inverse) = &self.inverse else { return false };
        let against = self.list.iter().map(|(direction, _)| along(direction, column));
        let by = inverse * DVector::from_iterator(self.list.len(), against);
        for (place, by) in by.iter().enumerate() {
            column.iter_mut().zip(self.response(place)).for_each(|(c, u)| *c -= u * by);
        }
        true
    }

    /// Takes `k g gᵀ z` off what acts on the nodes that are meant.
    pub fn resist(&self, z: &[Vec3], is_meant: impl Fn(usize) -> bool, out: &mut [Vec3]) {
        for (direction, stiffness) in &self.list {
            let by = stiffness * dot(direction, z);
            let meant = out.iter_mut().zip(direction).enumerate().filter(|(node, _)| is_meant(*node));
            meant.for_each(|(_, (out, g))| *out -= g * by);
        }
    }
}

fn along(direction: &[Vec3], column: &[f64]) -> f64 {
    direction.iter().zip(column.chunks_exact(3)).map(|(g, u)| g.x * u[0] + g.y * u[1] + g.z * u[2]).sum()
}
