//! What a game picks and a robot senses: rays, points and shapes against the surfaces of deformable bodies.

use super::triangle_contact::barycentric;
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet};
use crate::math::{Vec3, from_real, to_real};
use crate::mesh::tetrahedron_holds;
use parry3d::bounding_volume::BoundingVolume;
use parry3d::math::{Pose, Vector};
use parry3d::query::{PointQuery, Ray, RayCast, intersection_test};
use parry3d::shape::{Shape, Triangle};

/// A point on the surface of a deformable body, and what holds it there while the body moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeformableSurfacePoint {
    /// The body.
    pub body: DeformableBodyHandle,
    /// The point \[m\].
    pub point: Vector,
    /// Outward unit normal of the surface.
    pub normal: Vector,
    /// Vertices of the triangle that the point is on; inside a body, of the nearest one.
    pub vertices: [usize; 3],
    /// Their weights in it; they sum to one.
    pub weights: [f64; 3],
    /// From where it was looked for \[m\]; zero inside the body.
    pub distance: f32,
}

impl DeformableBodySet {
    /// The first surface that a ray meets, from outside or inside, no farther than `max_distance` \[m\]. `direction`
    /// need not have unit length; bodies that are disabled or do not pass the filter are left out.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::math::Vector;
    ///
    /// let mut bodies = DeformableBodySet::new();
    /// let cube = bodies.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.2), [2, 2, 2]))?;
    /// let hit = bodies.cast_ray(Vector::Y * 2.0, -Vector::Y, 10.0, |_, _| true).unwrap();
    /// assert_eq!(hit.body, cube);
    /// assert!((hit.distance - 1.8).abs() < 1e-6 && (hit.normal - Vector::Y).length() < 1e-6);
    /// # Ok::<(), foible3d::DeformableBodyError>(())
    /// ```
    pub fn cast_ray(
        &self,
        origin: Vector,
        direction: Vector,
        max_distance: f32,
        filter: impl Fn(DeformableBodyHandle, &DeformableBody) -> bool,
    ) -> Option<DeformableSurfacePoint> {
        let ray = Ray::new(origin, direction.try_normalize()?);
        let mut best: Option<(f32, DeformableBodyHandle, [usize; 3])> = None;
        for (handle, body) in self.iter().filter(|(h, b)| b.is_enabled() && filter(*h, b)) {
            let farthest = best.map_or(max_distance, |(time, ..)| time);
            if body.aabb().cast_local_ray(&ray, farthest, true).is_none() {
                continue;
            }
            for (vertices, triangle) in triangles(body) {
                let farthest = best.map_or(max_distance, |(time, ..)| time);
                let hit = triangle.cast_local_ray(&ray, farthest, false);
                if let Some(time) = hit.filter(|time| *time < farthest || best.is_none()) {
                    best = Some((time, handle, vertices));
                }
            }
        }
        let (time, handle, vertices) = best?;
        self.on_surface(handle, vertices, ray.point_at(time), time)
    }

    /// The nearest point of a surface no farther than `max_distance` \[m\]; the point itself, at distance
    /// zero, if it is inside of a body.
    pub fn project_point(
        &self,
        point: Vector,
        max_distance: f32,
        filter: impl Fn(DeformableBodyHandle, &DeformableBody) -> bool,
    ) -> Option<DeformableSurfacePoint> {
        let mut best: Option<(f32, DeformableBodyHandle, [usize; 3], Vector)> = None;
        for (handle, body) in self.iter().filter(|(h, b)| b.is_enabled() && filter(*h, b)) {
            let farthest = best.map_or(max_distance, |(distance, ..)| distance);
            if body.aabb().distance_to_local_point(point, true) > farthest {
                continue;
            }
            let feet = triangles(body).map(|(vertices, triangle)| {
                let foot = triangle.project_local_point(point, false).point;
                (foot.distance(point), vertices, foot)
            });
            let Some((distance, vertices, foot)) = feet.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let found = match is_inside(body, point) {
                true => (0.0, handle, vertices, point),
                false => (distance, handle, vertices, foot),
            };
            if found.0 < farthest || best.is_none() && found.0 <= farthest {
                best = Some(found);
            }
        }
        let (distance, handle, vertices, at) = best?;
        self.on_surface(handle, vertices, at, distance)
    }

    /// Bodies that a shape at `pose` touches or lies in.
    pub fn intersect_shape<'a>(
        &'a self,
        pose: Pose,
        shape: &'a dyn Shape,
    ) -> impl Iterator<Item = DeformableBodyHandle> + 'a {
        let aabb = shape.compute_aabb(&pose);
        let near = self.iter().filter(move |(_, b)| b.is_enabled() && b.aabb().intersects(&aabb));
        near.filter(move |(_, body)| overlaps(body, &pose, shape)).map(|(handle, _)| handle)
    }

    fn on_surface(
        &self,
        handle: DeformableBodyHandle,
        vertices: [usize; 3],
        point: Vector,
        distance: f32,
    ) -> Option<DeformableSurfacePoint> {
        let body = self.get(handle)?;
        let [a, b, c] = vertices.map(|v| body.position(v).map(Vec3::from).unwrap_or_default());
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::y);
        let weights = barycentric(&[a, b, c], &from_real(point)).unwrap_or([1.0, 0.0, 0.0]);
        Some(DeformableSurfacePoint {
            body: handle,
            point,
            normal: to_real(&normal),
            vertices,
            weights,
            distance,
        })
    }
}

/// Whether a shape touches a body or lies in it.
pub(crate) fn overlaps(body: &DeformableBody, pose: &Pose, shape: &dyn Shape) -> bool {
    let aabb = shape.compute_aabb(pose);
    let cuts = |triangle: Triangle| {
        triangle.local_aabb().intersects(&aabb)
            && intersection_test(pose, shape, &Pose::IDENTITY, &triangle)
                .is_ok_and(|found| found.intersecting)
    };
    triangles(body).any(|(_, triangle)| cuts(triangle)) || lies_in(body, pose, shape)
}

/// The triangles of a surface with their vertices.
fn triangles(body: &DeformableBody) -> impl Iterator<Item = ([usize; 3], Triangle)> + '_ {
    let model = &body.model;
    model.surface.triangles.iter().map(|nodes| {
        let [a, b, c] = nodes.map(|n| to_real(&body.state.x[n as usize]));
        (nodes.map(|n| model.vertex(n as usize)), Triangle::new(a, b, c))
    })
}

/// Whether a shape that does not cut the body's surface is inside of it, or one of its parts is.
fn lies_in(body: &DeformableBody, pose: &Pose, shape: &dyn Shape) -> bool {
    if let Some(compound) = shape.as_compound() {
        return compound.shapes().iter().any(|(offset, part)| lies_in(body, &(*pose * *offset), &**part));
    }
    // A point of the shape: the farthest in some direction, or for what is not convex, the nearest to its middle.
    let point = match shape.as_support_map() {
        Some(convex) => convex.local_support_point(Vector::Y),
        None => shape.project_local_point(shape.compute_local_aabb().center(), true).point,
    };
    is_inside(body, pose.transform_point(point))
}

/// Whether a point is in one of the body's elements.
fn is_inside(body: &DeformableBody, point: Vector) -> bool {
    let p = from_real(point);
    body.aabb().contains_local_point(point)
        && body
            .model
            .tetrahedra
            .iter()
            .any(|tet| tetrahedron_holds(&tet.map(|n| body.state.x[n as usize]), &p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::DeformableBodyBuilder;
    use parry3d::shape::{Ball, SharedShape};
    use proptest::prelude::*;

    fn vector(size: f32) -> impl Strategy<Value = Vector> {
        [-size..size, -size..size, -size..size].prop_map(Vector::from)
    }

    #[test]
    fn shapes_lie_in_a_body_wherever_their_origin_is() {
        let mut bodies = DeformableBodySet::new();
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [2; 3]);
        let cube = bodies.insert(cube).unwrap();
        let ball = |x: f32| (Pose::from_translation(Vector::X * x), SharedShape::ball(0.05));
        let around = SharedShape::compound(vec![ball(-1.0), ball(1.0)]);
        let hull: Vec<Vector> = (0..8)
            .map(|i| {
                Vector::new(1.0 + 0.1 * (i & 1) as f32, 0.1 * (i >> 1 & 1) as f32, 0.1 * (i >> 2) as f32)
            })
            .collect();
        let hull = SharedShape::convex_hull(&hull).unwrap();
        let met = |x: f32, shape: &SharedShape| {
            let found: Vec<_> =
                bodies.intersect_shape(Pose::from_translation(Vector::X * x), &**shape).collect();
            found == [cube]
        };
        assert!(!met(0.0, &around) && met(-1.0, &around) && met(1.0, &around));
        assert!(!met(0.0, &hull) && met(-1.05, &hull));
    }

    proptest! {
        #[test]
        fn two_cubes_answer_as_their_boxes_do(origin in vector(2.0), direction in vector(1.0)) {
            prop_assume!(direction.length() > 0.1);
            let mut bodies = DeformableBodySet::new();
            let cube = |x: f32| DeformableBodyBuilder::cuboid(Vector::splat(0.3), [2; 3]).translation(Vector::X * x);
            let handles = [-0.5f32, 0.5].map(|x| bodies.insert(cube(x)).unwrap());
            let boxes = [-0.5f32, 0.5].map(|x| {
                let half = Vector::splat(0.3);
                parry3d::bounding_volume::Aabb::new(Vector::X * x - half, Vector::X * x + half)
            });
            let inside = boxes.iter().position(|b| b.contains_local_point(origin));
            let ray = Ray::new(origin, direction.normalize());
            let times = boxes.map(|b| b.cast_local_ray(&ray, 10.0, false).unwrap_or(f32::INFINITY));
            let first = times[0].min(times[1]);
            let hit = bodies.cast_ray(origin, direction, 10.0, |_, _| true);
            // Rays through edges of triangles may slip between them; f32 at 2 m keeps 2.4e-7.
            if let Some(hit) = hit {
                prop_assert!((hit.distance - first).abs() < 1e-5);
                let weighed = [0, 1, 2].map(|k| (0..3).map(|c| {
                    hit.weights[c] * bodies[hit.body].position(hit.vertices[c]).unwrap()[k]
                }).sum::<f64>());
                prop_assert!((to_real(&weighed.into()) - hit.point).length() < 1e-5);
            } else {
                prop_assert!(first > 10.0 || inside.is_none());
            }
            let near = bodies.project_point(origin, 10.0, |_, _| true).unwrap();
            let distances = boxes.map(|b| b.distance_to_local_point(origin, true));
            prop_assert!((near.distance - distances[0].min(distances[1])).abs() < 1e-5);
            if let Some(inside) = inside {
                prop_assert_eq!(near.body, handles[inside]);
            }
            let ball = Ball::new(0.1);
            let met: Vec<_> = bodies.intersect_shape(Pose::from_translation(origin), &ball).collect();
            for k in 0..2 {
                if (distances[k] - 0.1).abs() > 1e-4 {
                    prop_assert_eq!(met.contains(&handles[k]), distances[k] < 0.1);
                }
            }
            // Filters and limits.
            let only = bodies.project_point(origin, 10.0, |h, _| h == handles[1]).unwrap();
            prop_assert_eq!(only.body, handles[1]);
            prop_assert!(bodies.cast_ray(Vector::Y * 5.0, -Vector::Y, 1.0, |_, _| true).is_none());
        }
    }
}
