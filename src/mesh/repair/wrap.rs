//! A closed surface around one that is not: its winding number at the vertices of a lattice says what is inside
//! [Jacobson Kavan Sorkine-Hornung 2013], and the lattice is cut where the surface is, or where the number is a half.

use super::SurfaceMesh;
use super::facing::turn_outward;
use super::marching::march;
use super::orientation::wind_alike;
use super::winding::Winding;
use crate::math::{Vec3, from_real, to_real};
use crate::mesh::MeshError;
use crate::mesh::fill::{Lattice, check_closed, lattice_over};
use crate::mesh::sorted_face;
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::TriMesh;
use std::collections::HashSet;

/// Vertices closer than this part of the extent become one.
const WELD: f32 = 1.0e-6;
/// Winding number from which on a point is inside: half-way between out and in.
const INSIDE: f64 = 0.5;
/// Winding number of a triangle's middle from which on it is within the wrap: on the outermost shell it is a half, on the next one and a half.
const WITHIN: f64 = 0.75;
/// Part of the area that a wrap may leave outside: scraps.
const LOST: f64 = 0.1;

/// What [`SurfaceMesh::wrapped`] has made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SurfaceWrapped {
    /// Cubes of the lattice.
    pub cells: usize,
    /// What the wrap encloses \[m³\].
    pub volume: f64,
    /// Greatest distance of the wrap from the given surface, over holes above all \[m\].
    pub distance: f64,
    /// Area of the wrap more than half a cell from the given surface: over holes \[m²\].
    pub bridged: f64,
    /// Triangles of the given surface that were turned round first.
    pub turned: usize,
}

impl SurfaceMesh {
    /// A closed surface around this one, which may have holes of any size, cross itself, have shells and triangles twice, and
    /// parts that are wound the wrong way. For what [`SurfaceMesh::repaired`] refuses: it keeps the triangles that it is given, a
    /// wrap has its own, of about `cell_size` \[m\], within half a cell of them where they are. Edges and corners are cut by as much; holes are
    /// closed where the winding number is a half, a flat hole by a plane.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// // A ball without its upper third.
    /// let (vertices, triangles) = Ball::new(0.5).to_trimesh(40, 40);
    /// let below = |t: &[u32; 3]| t.iter().all(|v| vertices[*v as usize].y < 0.17);
    /// let triangles = triangles.iter().filter(|t| below(t)).copied().collect();
    /// let open = SurfaceMesh { vertices, triangles };
    /// let (closed, report) = open.wrapped(0.1)?;
    /// assert!(closed.report().is_sound() && report.bridged > 0.1);
    /// let body = DeformableBodyBuilder::mesh(&closed.filled(0.1)?).build()?;
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Empty`] without a triangle; [`MeshError::BadCellSize`]; [`MeshError::NothingEnclosed`] for sheets and for cells that
    /// are too large; [`MeshError::NotWrapped`] if more than a tenth of the surface is so.
    pub fn wrapped(&self, cell_size: f32) -> Result<(Self, SurfaceWrapped), MeshError> {
        let mut given = self.welded(WELD);
        let mut known = HashSet::new();
        given.triangles.retain(|triangle| known.insert(sorted_face(*triangle)));
        let nothing = || MeshError::NothingEnclosed { triangles: self.triangles.len(), cell_size };
        if given.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        given.drop_unused();
        let before = given.triangles.clone();
        let pieces = wind_alike(&mut given);
        let shape = TriMesh::new(given.vertices.clone(), given.triangles.clone()).map_err(|_| nothing())?;
        turn_outward(&mut given, &shape, &pieces);
        let turned = before.iter().zip(&given.triangles).filter(|(a, b)| a != b).count();
        let corners = given.triangles.iter().map(|t| t.map(|v| from_real(given.vertices[v as usize])));
        let winding = Winding::new(corners.collect());
        let lattice = given.lattice(cell_size)?;
        let mesh = wrap(&lattice, &winding, &shape).ok_or_else(nothing)?;
        check_closed(&mesh.vertices, &mesh.triangles)?;
        let own = TriMesh::new(mesh.vertices.clone(), mesh.triangles.clone()).map_err(|_| nothing())?;
        let (area, lost) = given.lost(&winding, &own, cell_size);
        if lost > LOST * area {
            return Err(MeshError::NotWrapped { cell_size, area, lost });
        }
        let cells = lattice.cubes.iter().product();
        let mut report = SurfaceWrapped { cells, volume: mesh.volume(), turned, ..Default::default() };
        mesh.measure(&shape, cell_size, &mut report);
        Ok((mesh, report))
    }

    /// Over all of it.
    fn lattice(&self, cell_size: f32) -> Result<Lattice, MeshError> {
        let all = || self.vertices.iter().map(|v| from_real(*v));
        let start = all().next().unwrap_or_default();
        let (low, high) = all().fold((start, start), |(low, high), v| (low.inf(&v), high.sup(&v)));
        lattice_over(low, high, cell_size)
    }

    /// Areas of all triangles, and of those that are more than a cell from the wrap and outside of it \[m²\].
    fn lost(&self, winding: &Winding, wrap: &TriMesh, cell_size: f32) -> (f64, f64) {
        let (mut area, mut lost) = (0.0, 0.0);
        for triangle in &self.triangles {
            let (middle, own) = self.middle_and_area(triangle);
            area += own;
            if wrap.distance_to_local_point(to_real(&middle), false) > cell_size
                && winding.at(&middle) < WITHIN
            {
                lost += own;
            }
        }
        (area, lost)
    }

    fn middle_and_area(&self, triangle: &[u32; 3]) -> (Vec3, f64) {
        let [a, b, c] = triangle.map(|v| from_real(self.vertices[v as usize]));
        ((a + b + c) / 3.0, (b - a).cross(&(c - a)).norm() * 0.5)
    }

    /// How far it is from what it is around.
    fn measure(&self, given: &TriMesh, cell_size: f32, report: &mut SurfaceWrapped) {
        let away = |p| f64::from(given.distance_to_local_point(p, false));
        let mut distance = self.vertices.iter().map(|v| away(*v)).fold(0.0, f64::max);
        for triangle in &self.triangles {
            let (middle, area) = self.middle_and_area(triangle);
            let own = away(to_real(&middle));
            distance = distance.max(own);
            report.bridged += if own > 0.5 * f64::from(cell_size) { area } else { 0.0 };
        }
        report.distance = distance;
    }
}

/// Of what the lattice has inside; nothing if that is nothing.
fn wrap(lattice: &Lattice, winding: &Winding, shape: &TriMesh) -> Option<SurfaceMesh> {
    let is_inside: Vec<bool> =
        (0..lattice.vertices() as u32).map(|v| winding.at(&lattice.position(v)) > INSIDE).collect();
    let crossing = |outside: &Vec3, inside: &Vec3| {
        let way = inside - outside;
        let ray = Ray::new(to_real(outside), to_real(&way));
        let hit = shape.cast_local_ray(&ray, 1.0, false).map(f64::from);
        // In a hole between the two.
        let t = hit.unwrap_or_else(|| {
            let [out, within] = [outside, inside].map(|x| winding.at(x));
            (INSIDE - out) / (within - out)
        });
        if t.is_finite() { t } else { 0.5 }
    };
    let mesh = march(lattice, &is_inside, &crossing);
    (!mesh.triangles.is_empty()).then_some(mesh)
}
