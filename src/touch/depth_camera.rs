//! Depth images of bodies, as a camera behind a transparent pad sees its skin.

use crate::body::DeformableBody;
use crate::error::BodyError;
use crate::math::{Pose64, Vec3};
use rapier3d::math::Pose;

/// A pinhole camera that looks along the z axis of its pose, x to the right and y down, as in robotics.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let pad = DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.1, 0.01), [4, 4, 1]).build()?;
/// // From 5 cm behind the pad's middle, up to what is beyond its near face: the far one.
/// let camera = DepthCamera::new(Pose::from_translation(Vector::Z * -0.05), 1.0, [64, 48], [0.045, 1.0])?;
/// let depths = camera.render(&pad);
/// assert!(depths.iter().all(|depth| (depth - 0.06).abs() < 1.0e-6));
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DepthCamera {
    /// Where it is, in the world.
    pub pose: Pose,
    focal: f64,
    pixels: [usize; 2],
    range: [f64; 2],
}

/// Pixels of an image, at the most.
const MOST_PIXELS: usize = 1 << 26;

impl DepthCamera {
    /// With a vertical field of view \[rad\], so many pixels across and down, and the least and the largest depth that it
    /// sees \[m\].
    ///
    /// # Errors
    /// [`BodyError::BadPad`] for numbers that no camera has; [`BodyError::NotFinite`], [`BodyError::NoRotation`].
    pub fn new(
        pose: Pose,
        field_of_view: f64,
        pixels: [usize; 2],
        range: [f64; 2],
    ) -> Result<Self, BodyError> {
        crate::body::check_pose("pose of a camera", &pose)?;
        let check = |holds: bool, what| if holds { Ok(()) } else { Err(BodyError::BadPad { what }) };
        let count = pixels[0].checked_mul(pixels[1]);
        check(
            count.is_some_and(|count| (1..=MOST_PIXELS).contains(&count)),
            "it has no pixels, or too many",
        )?;
        check(field_of_view > 0.0 && field_of_view < 3.1, "its field of view is not between 0 and 3.1 rad")?;
        check(range[0] > 0.0 && range[1] > range[0], "its depths are not positive and ascending")?;
        let focal = 0.5 * pixels[1] as f64 / (0.5 * field_of_view).tan();
        Ok(Self { pose, focal, pixels, range })
    }

    /// Depth of the nearest surface of a body along the camera's axis \[m\], row by row; infinite where there is none within the range.
    pub fn render(&self, body: &DeformableBody) -> Vec<f64> {
        let mut depths = vec![f64::INFINITY; self.pixels[0] * self.pixels[1]];
        self.render_into(body, &mut depths);
        depths
    }

    /// The same over what is there already: the nearer counts. Does nothing with a list of another size.
    pub fn render_into(&self, body: &DeformableBody, depths: &mut [f64]) {
        if depths.len() != self.pixels[0] * self.pixels[1] {
            return;
        }
        let pose = Pose64::from_real(&self.pose);
        let position = |v: u32| body.position(v as usize).map(|p| pose.inverse_transform(&p.into()));
        for triangle in body.model().surface_triangles() {
            let [Ok(a), Ok(b), Ok(c)] = triangle.map(position) else { continue };
            self.clip_and_draw([a, b, c], depths);
        }
    }

    /// What is nearer than the range would be projected through the camera: triangles are cut there.
    fn clip_and_draw(&self, corners: [Vec3; 3], depths: &mut [f64]) {
        let near = self.range[0];
        let mut kept: Vec<Vec3> = Vec::with_capacity(4);
        for k in 0..3 {
            let (from, to) = (corners[(k + 2) % 3], corners[k]);
            if (from.z < near) != (to.z < near) {
                kept.push(from + (to - from) * ((near - from.z) / (to.z - from.z)));
            }
            if to.z >= near {
                kept.push(to);
            }
        }
        for k in 2..kept.len() {
            self.draw([kept[0], kept[k - 1], kept[k]], depths);
        }
    }

    fn draw(&self, corners: [Vec3; 3], depths: &mut [f64]) {
        let half = self.pixels.map(|n| 0.5 * n as f64);
        let flat = corners.map(|p| [half[0] + self.focal * p.x / p.z, half[1] + self.focal * p.y / p.z]);
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let whole = cross(flat[0], flat[1], flat[2]);
        if !(whole.abs() > 0.0) {
            return;
        }
        // Centres of pixels are at halves.
        let range = |axis: usize| {
            let values = flat.map(|p| p[axis]);
            let least = (values.iter().copied().fold(f64::INFINITY, f64::min) - 0.5).ceil().max(0.0);
            let most = (values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - 0.5).floor();
            least as usize..((most + 1.0).max(0.0) as usize).min(self.pixels[axis])
        };
        for row in range(1) {
            for column in range(0) {
                let at = [column as f64 + 0.5, row as f64 + 0.5];
                let parts =
                    [cross(at, flat[1], flat[2]), cross(flat[0], at, flat[2]), cross(flat[0], flat[1], at)];
                let shares = parts.map(|part| part / whole);
                // Edges belong to both of their triangles: no pixel falls between them.
                if shares.iter().any(|share| *share < -1.0e-9) {
                    continue;
                }
                // 1/z is linear on the screen.
                let depth = 1.0 / (0..3).map(|k| shares[k] / corners[k].z).sum::<f64>();
                let seen = &mut depths[row * self.pixels[0] + column];
                if depth <= self.range[1] && depth < *seen {
                    *seen = depth;
                }
            }
        }
    }
}
