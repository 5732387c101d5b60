//! The direction of the warp in sheets of woven cloth.

use super::mesh_error::MeshError;
use super::structure::{SheetTriangle, Structure};
use super::tet_mesh::middle;
use crate::math::Vec3;

/// Sine of the angle to the normal below which a direction counts as that of the normal: what `f32` rounds of a direction is
/// then a ten-thousandth of its part in the plane.
const NORMAL: f64 = 1.0e-3;

impl Structure {
    /// The same with the direction of the warp in every triangle of its sheets: what `direction` says of the place of its middle \[m\]
    /// at rest, projected on the triangle. The weft is across it. Where `direction` is zero there is none. See
    /// [`DeformableMaterial::orthotropic_sheet`](crate::DeformableMaterial::orthotropic_sheet).
    ///
    /// # Errors
    /// [`MeshError::BadWarp`] where the direction is normal to the triangle, or not finite.
    pub fn with_warp(mut self, direction: impl Fn([f64; 3]) -> [f64; 3]) -> Result<Self, MeshError> {
        for triangle in 0..self.sheets.len() {
            let warp = direction(middle(&self.vertices, &self.sheets[triangle].corners));
            self.sheets[triangle].warp = (warp != [0.0; 3]).then_some(warp);
            self.check_warp(triangle, &self.sheets[triangle])?;
        }
        Ok(self)
    }

    /// Checks the direction of the warp in a triangle.
    pub(super) fn check_warp(&self, triangle: usize, sheet: &SheetTriangle) -> Result<(), MeshError> {
        let Some(direction) = sheet.warp else { return Ok(()) };
        let [a, b, c] = sheet.corners.map(|v| Vec3::from(self.vertices[v as usize]));
        let normal = (b - a).cross(&(c - a)).normalize();
        let along = Vec3::from(direction).try_normalize(0.0).filter(|d| d.iter().all(|c| c.is_finite()));
        let is_fine = along.is_some_and(|along| along.cross(&normal).norm() > NORMAL);
        if is_fine { Ok(()) } else { Err(MeshError::BadWarp { triangle, direction }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warp_that_is_normal_to_a_triangle_is_named() {
        let sheet = || Structure::rectangle([1.0, 1.0], [1, 1], 0.01).unwrap();
        let bad = |d: [f64; 3]| sheet().with_warp(move |[x, ..]| if x > 0.2 { d } else { [1.0, 0.5, 0.0] });
        for direction in [[0.0, 1.0, 0.0], [1e-4, -1.0, 0.0], [f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]]
        {
            let Err(MeshError::BadWarp { triangle, direction: named }) = bad(direction) else { panic!() };
            assert!(triangle == 2 && named.map(f64::to_bits) == direction.map(f64::to_bits));
        }
        assert!(bad([0.0, 1.0, 0.01]).is_ok());
        let none = bad([0.0; 3]).unwrap();
        assert_eq!(none.sheets.iter().filter(|s| s.warp.is_none()).count(), 1);
    }
}
