//! How the normals of round obstacles turn from point to point, and where the edges of boxes are: what a gradient asks.

use super::obstacle::Obstacle;
use crate::math::{Mat3, Vec3, from_real};
use parry3d::shape::TypedShape;

/// Part of a box's half extent within which a point is on its edge: contacts are there to `f32`.
const ON_EDGE: f64 = 1.0e-4;

/// Turn of the outward normal over the obstacle's surface per metre that a point near it goes along it [1/m]: symmetric, along the surface
/// only. Point and normal are in the obstacle's frame. That of balls, capsules, cylinders, cones and boxes, around the edges of these; of others none, as of
/// plane faces.
pub(crate) fn curvature(obstacle: &Obstacle, point: &Vec3, normal: &Vec3) -> Mat3 {
    let about = |centre: Vec3| {
        let distance = (point - centre).norm();
        let along = Mat3::identity() - normal * normal.transpose();
        if distance > 0.0 { along / distance } else { Mat3::zeros() }
    };
    // From which the normal leans by the same angle all around.
    let around = |axis: &Vec3, from: &Vec3| {
        let (across, distance) = (axis.cross(normal), axis.cross(&(point - from)).norm());
        match across.try_normalize(0.0) {
            Some(direction) if distance > 0.0 => {
                direction * direction.transpose() * (across.norm() / distance)
            }
            _ => Mat3::zeros(),
        }
    };
    match obstacle.shape.as_typed_shape() {
        TypedShape::Ball(_) => about(Vec3::zeros()),
        TypedShape::Capsule(capsule) => {
            let [a, b] = [capsule.segment.a, capsule.segment.b].map(from_real);
            let axis = b - a;
            let place = (point - a).dot(&axis) / axis.norm_squared();
            if !(0.0..=1.0).contains(&place) {
                return about(if place > 1.0 { b } else { a });
            }
            around(&axis.normalize(), &a)
        }
        TypedShape::Cylinder(_) | TypedShape::Cone(_) => around(&Vec3::y(), &Vec3::zeros()),
        TypedShape::Cuboid(cuboid) => {
            let half = from_real(cuboid.half_extents);
            let beyond = point.abs() - half;
            let along = (0..3).filter(|k| beyond[*k] <= 0.0).map(Vec3::ith_axis);
            let flat = along.fold(normal * normal.transpose(), |flat, axis| flat + *axis * axis.transpose());
            let distance = beyond.map(|b| b.max(0.0)).norm();
            // Over a face nothing is left of it.
            let around = Mat3::identity() - flat;
            if distance > 0.0 && beyond.iter().filter(|b| **b > 0.0).count() > 1 {
                around / distance
            } else {
                Mat3::zeros()
            }
        }
        _ => Mat3::zeros(),
    }
}

/// Whether a point, in the obstacle's frame, is a corner of a box.
pub(crate) fn is_box_corner(obstacle: &Obstacle, point: &Vec3) -> bool {
    let half = obstacle.shape.as_cuboid().map(|cuboid| from_real(cuboid.half_extents));
    half.is_some_and(|half| on_faces(&half, point) == [true; 3])
}

/// By axes, whether a point is on a face of a box that is across them.
fn on_faces(half: &Vec3, point: &Vec3) -> [bool; 3] {
    [0, 1, 2].map(|k| (point[k].abs() - half[k]).abs() <= ON_EDGE * half[k])
}

/// Two points of the edge of a box that a point is on, away from its corners, in the obstacle's frame.
pub(crate) fn box_edge_at(obstacle: &Obstacle, point: &Vec3) -> Option<[Vec3; 2]> {
    let half = from_real(obstacle.shape.as_cuboid()?.half_extents);
    let beside = on_faces(&half, point);
    let along = (0..3).find(|&k| !beside[k] && beside[(k + 1) % 3] && beside[(k + 2) % 3])?;
    let end = |sign: f64| {
        Vec3::from_fn(|k, _| if k == along { sign * half[k] } else { point[k].signum() * half[k] })
    };
    Some([end(-1.0), end(1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface_point::{Scales, surface_point};
    use parry3d::math::Vector;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    proptest! {
        /// Against differences of the normals that contacts have.
        #[test]
        fn normals_turn_as_told(which in 0..5usize, x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, along in 0..3usize) {
            let shapes = [
                SharedShape::ball(0.5),
                SharedShape::capsule(Vector::new(-0.3, 0.1, 0.2), Vector::new(0.2, -0.1, 0.4), 0.3),
                SharedShape::cylinder(0.5, 0.4),
                SharedShape::cone(0.5, 0.4),
                SharedShape::cuboid(0.5, 0.4, 0.3),
            ];
            let obstacle = Obstacle::at_origin(shapes[which].clone());
            let direction = Vec3::new(x, y, z);
            prop_assume!(direction.norm() > 0.1);
            let scales = Scales { band: 1e-6, shift: 0.01, extent: 0.0, middle: direction };
            let at = |p: &Vec3| surface_point(&obstacle, p, &-direction.normalize(), &scales);
            let far = direction.normalize() * 2.0;
            let foot = at(&far).unwrap();
            let p = foot.point + foot.normal * 0.1;
            let turn = curvature(&obstacle, &p, &foot.normal);
            let by = Vec3::ith(along, 0.01);
            let [more, less] = [by, -by].map(|by| at(&(p + by)).unwrap().normal);
            let slope = (more - less) / 0.02;
            // Sharp edges are not told of, nor the borders between what is round and what is plane.
            let [ahead, behind] = [by, -by].map(|by| curvature(&obstacle, &(p + by), &at(&(p + by)).unwrap().normal));
            let on_edge = |n: &Vec3| match which {
                2 => n.y.abs() > 1e-3 && n.y.abs() < 0.999_999,
                // Its flank leans by atan(0.4).
                3 => (n.y - 0.3714).abs() > 1e-3 && n.y > -0.999_999,
                _ => false,
            };
            prop_assume!(![more, less, foot.normal].iter().any(on_edge));
            prop_assume!((ahead - behind).amax() < 0.5);
            // parry's f32 over 2 cm: 1e-5.
            prop_assert!((turn.column(along) - slope).norm() < 2e-2 * (1.0 + turn.amax()), "{which}: {turn} {slope}");
        }
    }
}
