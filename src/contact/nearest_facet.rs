//! The nearest triangle of the sheets, or segment of the rods, of a rest shape.

use crate::math::{Vec3, to_real};
use parry3d::query::PointQueryWithLocation;
use parry3d::shape::{Polyline, TriMesh, Triangle};

/// Triangles and segments to look among.
pub(crate) struct NearestFacet {
    triangles: Option<TriMesh>,
    segments: Option<Polyline>,
}

impl NearestFacet {
    /// Of triangles and segments over points.
    pub fn new(points: &[Vec3], triangles: &[[u32; 3]], segments: Vec<[u32; 2]>) -> Self {
        let points = || points.iter().map(to_real).collect::<Vec<_>>();
        let lines = (!segments.is_empty()).then(|| Polyline::new(points(), Some(segments)));
        Self { triangles: TriMesh::new(points(), triangles.to_vec()).ok(), segments: lines }
    }

    /// The place of the triangle in its list that is nearest to a point, and how far it is \[m\].
    pub fn triangle(&self, p: &Vec3) -> Option<(usize, f64)> {
        let at = to_real(p);
        let (foot, (triangle, _)) = self.triangles.as_ref()?.project_local_point_and_get_location(at, false);
        Some((triangle as usize, f64::from((foot.point - at).length())))
    }

    /// The place of the segment.
    pub fn segment(&self, p: &Vec3) -> Option<usize> {
        let (_, (segment, _)) =
            self.segments.as_ref()?.project_local_point_and_get_location(to_real(p), false);
        Some(segment as usize)
    }
}

/// Weights of the point of a triangle that is nearest to p.
pub(crate) fn nearest_weights(corners: [Vec3; 3], p: &Vec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|corner| to_real(&corner));
    let (_, location) = Triangle::new(a, b, c).project_local_point_and_get_location(to_real(p), false);
    location.barycentric_coordinates().map_or([1.0, 0.0, 0.0], |weights| weights.map(f64::from))
}
