//! Bodies that have gone deep into one another: no contact can tell where they came in, so they are drawn apart
//! along the line between their middles.

use super::between::SoftSurface;
use super::row::{Row, Side};
use crate::body::{ContactKey, SOFT_SLOT};
use crate::math::{Vec3, to_real};
use crate::mesh::tetrahedron_holds;
use parry3d::math::Pose;
use parry3d::query::{PointQuery, intersection_test};
use parry3d::shape::Triangle;

/// Slot of the rows that draw bodies apart.
const SLOT: u32 = SOFT_SLOT + 3;
/// Depth, in mean edges, of a node in the other body from which on the two are tangled.
const DEEP: f64 = 0.5;
/// Height, in mean edges, from which on a corner is on one side of a plane, and not in it.
const CLEARLY: f64 = 0.1;

/// Appends rows that draw apart what is tangled, as fast as overlaps are recovered, on triangles that go through one
/// another; `pairs` are triangles whose boxes meet.
pub(super) fn untangle([a, b]: [&SoftSurface<'_>; 2], pairs: &[(u32, u32)], rows: &mut Vec<Row>) {
    let first = rows.len();
    let side = |s: &SoftSurface<'_>, t: u32| {
        let nodes = s.model.surface.triangles[t as usize];
        Side::Soft { body: s.body, nodes, weights: [1.0 / 3.0; 3] }
    };
    let middle = |s: &SoftSurface<'_>| s.x.iter().sum::<Vec3>() / s.x.len() as f64;
    let mut apart = None;
    for (ta, tb) in pairs.iter().copied().filter(|&(ta, tb)| go_through(a, ta, b, tb)) {
        let apart = *apart.get_or_insert_with(|| {
            let is_deep = is_deep(a, b) || is_deep(b, a);
            // Bodies in the very same place part in any direction.
            is_deep.then(|| (middle(a) - middle(b)).try_normalize(0.0).unwrap_or_else(Vec3::y))
        });
        let Some(apart) = apart else { return };
        let key = ContactKey { obstacle: b.key, part: tb, feature: ta, slot: SLOT };
        let depth = a.model.surface.mean_edge.min(b.model.surface.mean_edge);
        rows.push(Row::new([side(a, ta), side(b, tb)], apart, -depth, key));
    }
    rows[first..].sort_unstable_by_key(|row| row.key);
}

fn corners(s: &SoftSurface<'_>, t: u32) -> [Vec3; 3] {
    s.model.surface.triangles[t as usize].map(|n| s.x[n as usize])
}

/// Whether two triangles cut one another, each with corners clearly on both sides of the other's plane.
fn go_through(a: &SoftSurface<'_>, ta: u32, b: &SoftSurface<'_>, tb: u32) -> bool {
    let (p, q) = (corners(a, ta), corners(b, tb));
    let clearly = CLEARLY * a.model.surface.mean_edge.min(b.model.surface.mean_edge);
    let cut = |normal: &Vec3, at: &Vec3, corners: &[Vec3; 3]| {
        let heights = corners.each_ref().map(|p| normal.dot(&(p - at)));
        heights.iter().any(|h| *h < -clearly) && heights.iter().any(|h| *h > clearly)
    };
    if !cut(&b.faces[tb as usize], &q[0], &p) || !cut(&a.faces[ta as usize], &p[0], &q) {
        return false;
    }
    let [p, q] = [p, q].map(|[a, b, c]| Triangle::new(to_real(&a), to_real(&b), to_real(&c)));
    intersection_test(&Pose::IDENTITY, &p, &Pose::IDENTITY, &q).is_ok_and(|found| found.intersecting)
}

/// Whether a surface node of one body is deep in the other.
fn is_deep(own: &SoftSurface<'_>, other: &SoftSurface<'_>) -> bool {
    let depth = DEEP * other.model.surface.mean_edge;
    let holds = |tet: &[u32; 4], p: &Vec3| tetrahedron_holds(&tet.map(|n| other.x[n as usize]), p);
    // What is that deep is as far inside of the other's box: next to nothing of bodies that rest on one another.
    let low = other.x.iter().fold(other.x[0], |a, b| a.inf(b)).add_scalar(depth);
    let high = other.x.iter().fold(other.x[0], |a, b| a.sup(b)).add_scalar(-depth);
    let nodes = own.model.surface.nodes.iter().map(|&n| own.x[n as usize]);
    nodes.filter(|p| (0..3).all(|k| p[k] > low[k] && p[k] < high[k])).any(|p| {
        let inside = other.model.tetrahedra.iter().any(|tet| holds(tet, &p));
        inside
            && (0..other.model.surface.triangles.len() as u32).all(|t| {
                let [a, b, c] = corners(other, t).each_ref().map(to_real);
                f64::from(Triangle::new(a, b, c).distance_to_local_point(to_real(&p), true)) > depth
            })
    })
}
