//! Scalars, small vectors and matrices, and the kernels on them.
//!
//! Everything inside the crate is `f64`; rapier's `f32` types appear only at the surface, through
//! [`to_real`] and [`from_real`].

mod vectorized;
pub(crate) use vectorized::vectorized;

pub(crate) mod dense;
#[cfg(feature = "serde-serialize")]
pub(crate) mod finite_or_none;
pub(crate) mod lanes;
pub(crate) mod polar;
mod rigid_motion;
pub(crate) use rigid_motion::RigidMotion;
mod solid_angle;
pub(crate) use solid_angle::solid_angle;

use rapier3d::math::Vector;

/// A point or vector of the solver.
pub(crate) type Vec3 = nalgebra::Vector3<f64>;
/// A 3×3 matrix of the solver.
pub(crate) type Mat3 = nalgebra::Matrix3<f64>;

/// A 2×2 matrix of the solver.
pub(crate) type Mat2 = nalgebra::Matrix2<f64>;
/// A 3×2 matrix of the solver.
pub(crate) type Mat3x2 = nalgebra::Matrix3x2<f64>;

/// Widens one of rapier's vectors.
pub(crate) fn from_real(v: Vector) -> Vec3 {
    Vec3::new(v.x as f64, v.y as f64, v.z as f64)
}

/// Rounds to one of rapier's vectors.
pub(crate) fn to_real(v: &Vec3) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

/// `S⁻¹ b` for a symmetric positive semi-definite S, without the axes about which it has next to nothing: those of an
/// inertia of points in a line.
pub(crate) fn solve_semidefinite(S: &Mat3, b: &Vec3) -> Vec3 {
    solve_without_small(S, b, 1.0e-9)
}

/// As [`solve_semidefinite`], without the axes about which S has less than a share of its most.
pub(crate) fn solve_without_small(S: &Mat3, b: &Vec3, share: f64) -> Vec3 {
    let eigen = S.symmetric_eigen();
    let least = share * eigen.eigenvalues.max();
    let mut out = Vec3::zeros();
    for k in 0..3 {
        let axis: Vec3 = eigen.eigenvectors.column(k).into();
        if eigen.eigenvalues[k] > least {
            out += axis * (axis.dot(b) / eigen.eigenvalues[k]);
        }
    }
    out
}

/// Mass and centre of mass of points.
pub(crate) fn centre_of_mass(x: &[Vec3], masses: &[f64]) -> (f64, Vec3) {
    let total: f64 = masses.iter().sum();
    (total, x.iter().zip(masses).map(|(x, m)| x * *m).sum::<Vec3>() / total)
}

/// Inertia of points about a centre [kg m²].
pub(crate) fn inertia_about(centre: &Vec3, x: &[Vec3], masses: &[f64]) -> Mat3 {
    x.iter().zip(masses).fold(Mat3::zeros(), |sum, (x, m)| {
        let arm = x - centre;
        sum + (Mat3::identity() * arm.norm_squared() - arm * arm.transpose()) * *m
    })
}

/// `Σ a_i·b_i` over nodes.
pub(crate) fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// The matrix of `v ↦ a × v`.
pub(crate) fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Two unit vectors that complete the unit vector `n` to a right-handed orthonormal frame
/// [Duff et al. 2017]. Continuous in `n` except at `n.z = 0⁻`.
pub(crate) fn tangents(n: &Vec3) -> [Vec3; 2] {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y)]
}

/// A rigid motion `x ↦ R x + t` in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Pose64 {
    pub rotation: Mat3,
    pub translation: Vec3,
}

impl Pose64 {
    /// Whether it is a place: no NaN, nothing infinite.
    pub fn is_finite(&self) -> bool {
        self.translation.iter().chain(&self.rotation).all(|v| v.is_finite())
    }

    /// Widens rapier's pose; the quaternion is normalised in `f64`, so the matrix is a rotation
    /// to 1e-16 and not to 1e-7.
    pub fn from_real(pose: &rapier3d::math::Pose) -> Self {
        let q = pose.rotation;
        let q = nalgebra::Quaternion::new(q.w as f64, q.x as f64, q.y as f64, q.z as f64);
        let rotation = nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner();
        Self { rotation, translation: from_real(pose.translation) }
    }

    /// Moves a point from the local frame to the world.
    pub fn transform(&self, p: &Vec3) -> Vec3 {
        self.rotation * p + self.translation
    }

    /// Moves a point from the world to the local frame.
    pub fn inverse_transform(&self, p: &Vec3) -> Vec3 {
        self.rotation.tr_mul(&(p - self.translation))
    }

    /// Another pose as seen from this one, as parry takes it.
    pub fn relative(&self, other: &Self) -> rapier3d::math::Pose {
        let rotation = self.rotation.tr_mul(&other.rotation);
        Self { rotation, translation: self.inverse_transform(&other.translation) }.to_real()
    }

    /// The motion back.
    pub fn inverse(&self) -> Self {
        Self { rotation: self.rotation.transpose(), translation: -self.rotation.tr_mul(&self.translation) }
    }

    /// In rapier's precision.
    pub fn to_real(self) -> rapier3d::math::Pose {
        let rotation = nalgebra::Rotation3::from_matrix_unchecked(self.rotation);
        let q = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
        let [x, y, z, w] = [q.i, q.j, q.k, q.w].map(|c| c as f32);
        let rotation = rapier3d::math::Rotation::from_xyzw(x, y, z, w);
        rapier3d::math::Pose::from_parts(to_real(&self.translation), rotation)
    }

    /// `self ∘ other`.
    pub fn compose(&self, other: &Self) -> Self {
        Self { rotation: self.rotation * other.rotation, translation: self.transform(&other.translation) }
    }
}

/// The rotation by the vector `w` \[rad\] (Rodrigues).
pub(crate) fn rotation_from_vector(w: &Vec3) -> Mat3 {
    nalgebra::Rotation3::new(*w).into_inner()
}

/// The rotation by the least angle that turns one direction to another.
pub(crate) fn shortest_turn(from: &Vec3, to: &Vec3) -> Mat3 {
    let half = || rotation_from_vector(&(tangents(from)[0] * std::f64::consts::PI));
    nalgebra::Rotation3::rotation_between(from, to).map_or_else(half, nalgebra::Rotation3::into_inner)
}

/// Rotation vector \[rad\] of a rotation. By its quaternion: the cosine of the trace knows angles to 1.5e-8 only, and is NaN
/// where rounding takes it past one.
pub(crate) fn rotation_vector(R: &Mat3) -> Vec3 {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(*R);
    nalgebra::UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis()
}

/// A rotation rounded to that many binary places of its quaternion.
pub(crate) fn rounded_rotation(rotation: &Mat3, places: i32) -> Mat3 {
    // Numbers next to this one are 2⁻ᵖˡᵃᶜᵉˢ apart.
    let coarse = 1.5 * 2.0f64.powi(52 - places);
    let R = nalgebra::Rotation3::from_matrix_unchecked(*rotation);
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&R);
    let rounded = q.coords.map(|c| (c + coarse) - coarse);
    nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(rounded))
        .to_rotation_matrix()
        .into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn tangents_complete_a_right_handed_frame(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64) {
            prop_assume!(x * x + y * y + z * z > 1e-6);
            let n = Vec3::new(x, y, z).normalize();
            let [a, b] = tangents(&n);
            // 1e-14: some tens of roundings of unit numbers.
            prop_assert!((a.cross(&b) - n).norm() < 1e-14);
            prop_assert!((a.norm() - 1.0).abs() < 1e-14 && a.dot(&n).abs() < 1e-14);
        }
    }
}
