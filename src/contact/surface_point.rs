//! The point of an obstacle's surface nearest to a node, with one normal that is continuous inside,
//! on, and outside the surface.
//!
//! A projection alone has no direction on the surface itself, and just inside an edge it picks the
//! wrong face. So near the surface the normal comes from the feature, or from a second projection
//! of the node shifted back into its body, where "outside" is unambiguous. parry answers in `f32`;
//! the gap is taken along the normal with the node's `f64` position.

use super::obstacle::Obstacle;
use super::shape_table::Solidity;
use crate::math::{Vec3, from_real, to_real};
use parry3d::shape::{FeatureId, TriMesh};

/// In the obstacle's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    pub point: Vec3,
    /// Outward.
    pub normal: Vec3,
    /// Signed distance along the normal \[m\].
    pub gap: f64,
    /// The normal is that of a plane face, exact.
    pub flat: bool,
}

impl SurfacePoint {
    /// The same wall from the side on which the node is, if it is not what it counts as having passed.
    pub fn seen_from_node(self) -> Self {
        if self.gap < 0.0 { Self { normal: -self.normal, gap: -self.gap, ..self } } else { self }
    }
}

/// What decides which of the normals is used, in the obstacle's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scales {
    /// Nearer than this to the surface a projection's direction is noise \[m\].
    pub band: f64,
    /// Shift back into the body for the second projection \[m\].
    pub shift: f64,
    /// Largest coordinate of what parry projects onto, beside that of the point itself \[m\]: its `f32` rounds by
    /// 6e-8 of it.
    pub extent: f64,
    /// Middle of the body's surface.
    pub middle: Vec3,
}

/// Sine below which a direction counts as a normal: f32 places of a metre, seen from a shift of millimetres, give 1e-5.
const STRAIGHT: f64 = 1.0e-4;
/// Cosine beyond which a normal counts as facing the body's surface.
const FACING: f64 = -0.1;

/// Cosine beyond which a normal leads out of the body: the node has passed a sheet's face.
const PASSED_FACE: f64 = 0.3;
/// The same of a sheet's border or a wire. One beside a node of a right-angled edge, flush with one of its faces, is at
/// 0.71; at 0.3 such nodes took turns to be inside and outside.
const PASSED_LINE: f64 = 0.75;
/// Part of the largest coordinate by which a projection straight down may be beside: `f32` keeps 6e-8, a few of those.
/// Where only the point's own coordinate counted, 1 cm from the middle of a 2 m sheet a face ended anywhere, and five of
/// 24 cubes on the sheet's border swayed.
pub(super) const PROJECTED: f64 = 3.0e-7;

/// Cosine between the back of a wall and the normal that carried a node from which on it is taken for the same wall.
const SAME_WALL: f64 = 0.9;

/// Projects `p` (in the obstacle's frame) onto the obstacle. `outward` is the unit normal of the
/// body's own surface at `p`, in that frame too. `None` where parry finds nothing, as for
/// non-finite input.
pub(crate) fn surface_point(
    obstacle: &Obstacle,
    p: &Vec3,
    outward: &Vec3,
    scales: &Scales,
) -> Option<SurfacePoint> {
    if let Some(ball) = obstacle.shape.as_ball() {
        return on_ball(ball.radius as f64, p, outward);
    }
    let hit = project(obstacle, p)?;
    let faces_body = |normal: &Vec3| normal.dot(outward) < FACING;
    let near = hit.distance <= scales.band;
    if obstacle.solidity() == Solidity::Sheet {
        // Just behind a sheet, seen from the body: the node has passed and is to come back. Not so if the whole body is
        // on that side: crushed, it looks away from what is below it, and went through.
        let is_behind = |normal: &Vec3| {
            hit.distance < scales.shift
                && (hit.face.is_none() || (scales.middle - hit.point).dot(normal) < 0.0)
        };
        return on_sheet(&hit, p, outward, near, is_behind);
    }
    if !hit.inside && !near {
        return Some(hit.with(p, face_or(hit.direction?, hit.face)));
    }
    if let Some(face) = hit.face
        && faces_body(&face)
    {
        return Some(hit.with(p, face));
    }
    let inward = hit.direction.map(|d| if hit.inside { -d } else { d });
    if !near && hit.face.is_none() && inward.is_some_and(|d| faces_body(&d)) {
        return Some(hit.with(p, inward?));
    }
    let back = project(obstacle, &(p - outward * scales.shift))?;
    match back.direction {
        Some(direction) if !back.inside && faces_body(&direction) => {
            Some(back.with(p, face_or(direction, back.face)))
        }
        _ => Some(hit.with(p, hit.face.or(inward).unwrap_or(-outward))),
    }
}

/// As [`surface_point`], of a node that a sheet carried in the last step along a normal against `outward`: it is on that side
/// of it still, however far it has passed. One of a sheet or a rod (`is_thin`) may be between two walls and near the other one now: there it
/// counts as passed only where the body's middle is beyond the wall too.
pub(crate) fn carried_point(
    obstacle: &Obstacle,
    p: &Vec3,
    outward: &Vec3,
    is_thin: bool,
    scales: &Scales,
) -> Option<SurfacePoint> {
    let hit = project(obstacle, p)?;
    let is_behind = |normal: &Vec3| {
        !is_thin || normal.dot(outward) > SAME_WALL || (scales.middle - hit.point).dot(normal) < 0.0
    };
    on_sheet(&hit, p, outward, hit.distance <= scales.band, is_behind)
}

/// On the side of a sheet where `p` is, unless it looks out of the body there and `is_behind` says so.
fn on_sheet(
    hit: &Projection,
    p: &Vec3,
    outward: &Vec3,
    near: bool,
    is_behind: impl Fn(&Vec3) -> bool,
) -> Option<SurfacePoint> {
    let normal = match (near, hit.face) {
        (true, Some(face)) => face,
        (true, None) => -outward,
        (false, face) => face_or(hit.direction?, face),
    };
    let passed = if hit.face.is_some() { PASSED_FACE } else { PASSED_LINE };
    let has_passed = normal.dot(outward) > passed && is_behind(&normal);
    let looks_away = near && normal.dot(outward) >= FACING;
    Some(hit.with(p, if has_passed || looks_away { -normal } else { normal }))
}

/// Unit direction from `p` to the nearest point of the obstacle's surface, if that is farther than `band` \[m\].
pub(crate) fn towards_surface(obstacle: &Obstacle, p: &Vec3, band: f64) -> Option<Vec3> {
    let hit = project(obstacle, p)?;
    (hit.point - p).try_normalize(band)
}

/// The point of the surface nearest to a point outside.
pub(crate) fn foot(obstacle: &Obstacle, p: &Vec3) -> Option<Vec3> {
    project(obstacle, p).filter(|hit| !hit.inside).map(|hit| hit.point)
}

/// Whether the point of the face's plane below `p` belongs to the face: whether the face of
/// `on_face` is what `p`, lifted off its plane, projects onto.
pub(crate) fn is_over_face(obstacle: &Obstacle, on_face: &SurfacePoint, p: &Vec3, scales: &Scales) -> bool {
    let height = on_face.normal.dot(&(p - on_face.point));
    let lifted = p + on_face.normal * (scales.shift - height);
    let Some(hit) = project(obstacle, &lifted) else {
        return false;
    };
    let offset = lifted - hit.point;
    let beside = offset - on_face.normal * on_face.normal.dot(&offset);
    !hit.inside && beside.norm() <= PROJECTED * lifted.norm().max(scales.extent)
}

/// In `f64` throughout.
fn on_ball(radius: f64, p: &Vec3, outward: &Vec3) -> Option<SurfacePoint> {
    let distance = p.norm();
    let normal = if distance > 0.0 { p / distance } else { -outward };
    Some(SurfacePoint { point: normal * radius, normal, gap: distance - radius, flat: false })
}

/// A projection with what can be told of it.
struct Projection {
    point: Vec3,
    inside: bool,
    distance: f64,
    /// From the surface point to `p`, unit; none at zero distance.
    direction: Option<Vec3>,
    /// Outward normal of the plane face that was hit.
    face: Option<Vec3>,
}

fn project(obstacle: &Obstacle, p: &Vec3) -> Option<Projection> {
    let radius = obstacle.kind().radius;
    let core = if radius == 0.0 { &*obstacle.shape.0 } else { obstacle.traits().core };
    let (projection, feature) = core.project_local_point_and_get_feature(to_real(p));
    let point = from_real(projection.point);
    if !point.iter().all(|c| c.is_finite()) {
        return None;
    }
    let offset = p - point;
    let distance = offset.norm();
    let plane = matches!(feature, FeatureId::Face(_));
    let normal = || core.feature_normal_at_point(projection.subshape, feature, projection.point);
    let face = if plane { normal().map(from_real) } else { None };
    let face = face.and_then(|n| n.try_normalize(0.5)).or_else(|| {
        let half_space = core.as_halfspace()?;
        Some(from_real(half_space.normal).normalize())
    });
    let direction = (distance > 0.0).then(|| offset / distance);
    let face = face.or_else(|| face_at_border(core.as_trimesh()?, projection.subshape, &direction?));
    if radius == 0.0 {
        return Some(Projection { point, inside: projection.is_inside, distance, direction, face });
    }
    // The surface is `radius` off the core, on the side where p is.
    let outward = match direction {
        Some(d) if projection.is_inside => -d,
        Some(d) => d,
        None => face?,
    };
    let depth = if projection.is_inside { distance + radius } else { radius - distance };
    Some(Projection {
        point: point + outward * radius,
        inside: depth > 0.0,
        distance: depth.abs(),
        direction: (depth != 0.0).then(|| if depth > 0.0 { -outward } else { outward }),
        face: face.filter(|n| n.dot(&outward) > 0.999),
    })
}

/// Of a foot on the border of a mesh's triangle the triangle's normal, if the foot is straight below the point: within a
/// flat floor of many triangles such a point touches a face like any other.
fn face_at_border(mesh: &TriMesh, triangle: u32, direction: &Vec3) -> Option<Vec3> {
    let normal = from_real(mesh.triangle(triangle).normal()?);
    (normal.cross(direction).norm() < STRAIGHT).then(|| normal.normalize())
}

/// The exact normal of the face if that is what the direction means, up to sign.
fn face_or(direction: Vec3, face: Option<Vec3>) -> Vec3 {
    match face {
        Some(n) if n.dot(&direction) > 0.99 => n,
        Some(n) if n.dot(&direction) < -0.99 => -n,
        _ => direction,
    }
}

impl Projection {
    fn with(&self, p: &Vec3, normal: Vec3) -> SurfacePoint {
        let gap = normal.dot(&(p - self.point));
        let flat = self.face.is_some_and(|n| n == normal || n == -normal);
        // On a plane face the point is the foot of p: what was projected may have been shifted, and forces
        // at different points would turn the two sides against each other.
        let point = if flat { p - normal * gap } else { self.point };
        SurfacePoint { point, normal, gap, flat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::math::Vector;
    use parry3d::shape::SharedShape;

    const SCALES: Scales = Scales { band: 4e-5, shift: 0.01, extent: 0.0, middle: Vec3::new(0.0, 1.0, 0.0) };

    #[test]
    fn normal_is_one_and_continuous_through_the_surface_of_every_solid_shape() {
        let cube: Vec<Vector> = (0..8)
            .map(|i| Vector::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) - Vector::splat(0.5))
            .collect();
        let shapes = [
            SharedShape::halfspace(Vector::Y),
            SharedShape::cuboid(0.5, 0.5, 0.5),
            SharedShape::convex_hull(&cube).unwrap(),
            SharedShape::cylinder(0.5, 0.5),
            SharedShape::cone(0.5, 0.5),
            SharedShape::ball(0.5),
            SharedShape::capsule_y(0.2, 0.3),
            SharedShape::round_cuboid(0.4, 0.4, 0.4, 0.1),
            SharedShape::round_cylinder(0.4, 0.4, 0.1),
            SharedShape::round_cone(0.4, 0.4, 0.1),
            SharedShape::round_convex_hull(&cube, 0.1).unwrap(),
        ];
        for shape in shapes {
            let kind = shape.shape_type();
            let obstacle = Obstacle::at_origin(shape);
            // The surface below a point a little off the axis, from far outside.
            let outward = -Vec3::y();
            // A cone is approached on its flank, away from its tip.
            let on_flank = kind == parry3d::shape::ShapeType::Cone;
            let above = if on_flank { Vec3::new(0.7, 0.4, 0.3) } else { Vec3::new(0.013, 2.0, 0.021) };
            let top = surface_point(&obstacle, &above, &outward, &SCALES).unwrap();
            for depth in [-0.03, -1e-3, -1e-4, -1e-6, -1e-8, 0.0, 1e-8, 1e-6, 1e-4, 1e-3, 0.03] {
                let p = top.point + top.normal * depth;
                let found = surface_point(&obstacle, &p, &-top.normal, &SCALES).unwrap();
                // f32 projections: 1e-7 of coordinates of 1 m, over the shift of 0.01 m and the
                // curvature of GJK's round shapes; gaps to a few ulp of f32.
                assert!(
                    (found.normal - top.normal).norm() < 2e-3,
                    "{kind:?} {depth}: {} {}",
                    found.normal,
                    top.normal
                );
                assert!(
                    (found.gap - depth).abs() < 2e-6 + 2e-3 * depth.abs(),
                    "{kind:?} {depth}: {}",
                    found.gap
                );
            }
        }
    }

    #[test]
    fn just_inside_an_edge_the_face_towards_the_body_is_taken() {
        let obstacle = Obstacle::at_origin(SharedShape::cuboid(0.5, 0.5, 0.5));
        // A body on top, its rim in line with the box: nearest is the side face.
        for x in [0.5 - 1e-7, 0.5, 0.5 + 1e-7] {
            let rim = Vec3::new(1.0, -1.0, 0.0).normalize();
            let p = Vec3::new(x, 0.5 - 1e-6, 0.1);
            let found = surface_point(&obstacle, &p, &rim, &SCALES).unwrap();
            assert!((found.normal - Vec3::y()).norm() < 1e-6, "{x}: {}", found.normal);
        }
    }

    #[test]
    fn sheets_push_back_to_the_side_the_body_is_on() {
        let vertices =
            vec![Vector::new(-1.0, 0.0, -1.0), Vector::new(1.0, 0.0, -1.0), Vector::new(0.0, 0.0, 1.0)];
        for triangle in [[0, 1, 2], [0, 2, 1]] {
            let mesh = SharedShape::trimesh(vertices.clone(), vec![triangle]).unwrap();
            let obstacle = Obstacle::at_origin(mesh);
            for (side, depth) in [(1.0, 1e-3), (1.0, 0.0), (1.0, -1e-3), (-1.0, 1e-3), (-1.0, -1e-3)] {
                let p = Vec3::new(0.05, side * depth, 0.02);
                let scales = Scales { middle: Vec3::y() * side, ..SCALES };
                let found = surface_point(&obstacle, &p, &Vec3::new(0.0, -side, 0.0), &scales).unwrap();
                assert!((found.normal - Vec3::y() * side).norm() < 1e-6);
                assert!((found.gap - depth).abs() < 1e-7);
                // Crushed, it looks up from above.
                let crushed = surface_point(&obstacle, &p, &(Vec3::y() * side), &scales).unwrap();
                assert!(depth <= 0.0 || (crushed.normal - Vec3::y() * side).norm() < 1e-6);
                // What it carried comes back from any depth.
                let (deep, against) = (Vec3::new(0.05, -0.2 * side, 0.02), Vec3::y() * -side);
                let carried = carried_point(&obstacle, &deep, &against, false, &scales).unwrap();
                assert!(
                    (carried.normal - Vec3::y() * side).norm() < 1e-6 && (carried.gap + 0.2).abs() < 1e-6
                );
            }
        }
    }
}
