//! How much of what a point sees a triangle takes.

use super::Vec3;

/// Solid angle of a triangle, positive where the point sees it from behind [Van Oosterom & Strackee 1983].
pub(crate) fn solid_angle(triangle: &[Vec3; 3], point: &Vec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let [p, q, r] = [a, b, c].map(|way| way.norm());
    let below = p * q * r + a.dot(&b) * r + b.dot(&c) * p + c.dot(&a) * q;
    2.0 * a.dot(&b.cross(&c)).atan2(below)
}
