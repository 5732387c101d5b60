//! Bodies that have gone deep into one another, or into themselves: no contact can tell where they came in, so they
//! are drawn apart along the line between their middles, and parts of one body along that between the middles of
//! what is around the triangles that cut one another.

use super::constraint::{Constraint, Endpoint};
use super::soft_contact::PARALLEL;
use super::soft_surface::{SoftSurface, near_in_mesh};
use crate::body::{ConstraintKey, SoftPairContact, SoftPairKind};
use crate::math::{Vec3, to_real};
use crate::mesh::tetrahedron_holds;
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::Pose;
use parry3d::query::{PointQuery, distance as distance_between, intersection_test};
use parry3d::shape::Triangle;

/// Depth of a node in the other body from which on the two are tangled, in mean edges or in half thicknesses of the other, whichever is
/// less: in a strip of two cells nothing is half a cell's length deep.
const DEEP: f64 = 0.5;
/// Pairs of touching triangles that two bodies are drawn apart by, at the most: hundreds end unsolved.
const HANDLES: usize = 24;
/// Height, in mean edges, from which on a corner is on one side of a plane, and not in it.
const CLEARLY: f64 = 0.1;

/// Appends constraints that draw apart what is tangled, as fast as overlaps are recovered, on triangles that go through one
/// another; `pairs` are triangles whose boxes meet. Where faces of the two lie in the same planes none go through, as of boxes that were
/// put into one another along an axis: of bodies that have no other contacts, which `looks_at_touching` says, triangles that touch and
/// look the same way serve too.
pub(super) fn untangle(
    surfaces: [&SoftSurface<'_>; 2],
    pairs: &[(u32, u32)],
    looks_at_touching: bool,
    constraints: &mut Vec<Constraint>,
) {
    let [a, b] = surfaces;
    let first = constraints.len();
    let is_same_place = is_same_place(a, b);
    // Bodies in the very same place part in any direction.
    let mut apart = is_same_place.then(Vec3::y);
    for &(ta, tb) in pairs {
        if !(is_same_place && ta == tb || go_through(a, ta, b, tb)) {
            continue;
        }
        if apart.is_none() && !are_deep(surfaces) {
            return;
        }
        let apart = *apart.get_or_insert_with(|| way_apart(surfaces));
        constraints.push(constraint(a, ta, b, tb, apart));
    }
    if looks_at_touching && constraints.len() == first {
        let touching = touching_pairs(surfaces, pairs);
        if !touching.is_empty() && are_deep(surfaces) {
            let apart = way_apart(surfaces);
            constraints.extend(touching.iter().map(|&(ta, tb)| constraint(a, ta, b, tb, apart)));
        }
    }
    constraints[first..].sort_unstable_by_key(|constraint| constraint.key);
}

/// The direction in which the first of two bodies leaves the other: away from its middle, or where the two are the same the axis along
/// which their boxes overlap least.
fn way_apart([a, b]: [&SoftSurface<'_>; 2]) -> Vec3 {
    let middle = |s: &SoftSurface<'_>| s.x.iter().sum::<Vec3>() / s.x.len() as f64;
    let clearly = CLEARLY * a.model.surface.mean_edge.min(b.model.surface.mean_edge);
    let away = middle(a) - middle(b);
    if away.norm() > clearly {
        return away.normalize();
    }
    let corners = |s: &SoftSurface<'_>| {
        (s.x.iter().fold(s.x[0], |p, q| p.inf(q)), s.x.iter().fold(s.x[0], |p, q| p.sup(q)))
    };
    let ((low_a, high_a), (low_b, high_b)) = (corners(a), corners(b));
    let overlap = high_a.inf(&high_b) - low_a.sup(&low_b);
    Vec3::ith_axis(overlap.imin()).into_inner()
}

/// Some pairs of triangles that touch, no triangle twice, from all over where they do.
fn touching_pairs([a, b]: [&SoftSurface<'_>; 2], pairs: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let mut touching: Vec<_> = pairs.iter().copied().filter(|&(ta, tb)| touch(a, ta, b, tb)).collect();
    if touching.is_empty() {
        return touching;
    }
    touching.sort_unstable();
    let mut taken = vec![false; b.model.surface.triangles.len()];
    let mut last = None;
    touching.retain(|&(ta, tb)| {
        let is_free = last != Some(ta) && !taken[tb as usize];
        if is_free {
            last = Some(ta);
            taken[tb as usize] = true;
        }
        is_free
    });
    let every = touching.len().div_ceil(HANDLES).max(1);
    touching.into_iter().step_by(every).collect()
}

/// Whether two triangles look the same way and are as good as on one another.
fn touch(a: &SoftSurface<'_>, ta: u32, b: &SoftSurface<'_>, tb: u32) -> bool {
    if a.faces[ta as usize].dot(&b.faces[tb as usize]) < PARALLEL {
        return false;
    }
    let clearly = CLEARLY * a.model.surface.mean_edge.min(b.model.surface.mean_edge);
    let [p, q] = [corners(a, ta), corners(b, tb)]
        .map(|[a, b, c]| Triangle::new(to_real(&a), to_real(&b), to_real(&c)));
    distance_between(&Pose::IDENTITY, &p, &Pose::IDENTITY, &q).is_ok_and(|d| f64::from(d.distance) < clearly)
}

/// Whether two bodies of one mesh are node on node: their triangles touch all over, and none goes through another.
fn is_same_place(a: &SoftSurface<'_>, b: &SoftSurface<'_>) -> bool {
    let clearly = CLEARLY * a.model.surface.mean_edge;
    let is_near = |(p, q): (&Vec3, &Vec3)| (p - q).norm() < clearly;
    a.x.len() == b.x.len() && a.x.iter().zip(b.x).all(is_near)
}

/// As [`untangle`], of a body with itself. Other contacts between the same parts, of the constraints from `first` on, would
/// keep them where they are.
pub(super) fn untangle_itself(
    own: &SoftSurface<'_>,
    pairs: &[(u32, u32)],
    first: usize,
    constraints: &mut Vec<Constraint>,
) {
    let mut separating = Vec::new();
    let triangle = |t: u32| own.model.surface.triangles[t as usize];
    for (ta, tb) in pairs.iter().copied().filter(|(ta, tb)| ta < tb) {
        let near = |a: u32| triangle(tb).iter().any(|&b| near_in_mesh(own.model, a, b));
        if triangle(ta).into_iter().any(near) || !go_through(own, ta, own, tb) {
            continue;
        }
        let parts = [ta, tb].map(|t| Part::around(own, t));
        if parts[0].meets(&parts[1])
            || !(parts[0].is_deep_in(&parts[1], own) || parts[1].is_deep_in(&parts[0], own))
        {
            continue;
        }
        // Parts in the very same place part in any direction.
        let apart = (parts[0].middle - parts[1].middle).try_normalize(0.0).unwrap_or_else(Vec3::y);
        separating.push(constraint(own, ta, own, tb, apart));
        let mut place = 0;
        constraints.retain(|constraint| {
            place += 1;
            let within = |part: &Part, side: &Endpoint| side.soft_nodes().all(|(n, _)| part.holds(n as u32));
            let [a, b] = &constraint.endpoints;
            let between = |p: &Part, q: &Part| within(p, a) && within(q, b);
            place <= first || !(between(&parts[0], &parts[1]) || between(&parts[1], &parts[0]))
        });
    }
    separating.sort_unstable_by_key(|constraint| constraint.key);
    constraints.append(&mut separating);
}

/// What of a body is around a triangle of its surface.
struct Part {
    /// Nodes, ascending.
    nodes: Vec<u32>,
    middle: Vec3,
}

/// How far a part reaches, in edges of the mesh.
const RINGS: usize = 2;

impl Part {
    fn around(own: &SoftSurface<'_>, triangle: u32) -> Self {
        let mut nodes = own.model.surface.triangles[triangle as usize].to_vec();
        for _ in 0..RINGS {
            let next: Vec<u32> =
                nodes.iter().flat_map(|&n| &own.model.adjacency[n as usize]).copied().collect();
            nodes.extend(next);
            nodes.sort_unstable();
            nodes.dedup();
        }
        let middle = nodes.iter().map(|&n| own.x[n as usize]).sum::<Vec3>() / nodes.len() as f64;
        Self { nodes, middle }
    }

    fn holds(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    fn meets(&self, other: &Self) -> bool {
        self.nodes.iter().any(|&n| other.holds(n))
    }

    /// Whether a surface node of this part is in the other, deep under that one's surface.
    fn is_deep_in(&self, other: &Self, own: &SoftSurface<'_>) -> bool {
        let surface = &own.model.surface;
        let around = own.model.tetrahedra.iter().filter(|tet| tet.iter().all(|&n| other.holds(n)));
        let around: Vec<_> = around.map(|tet| tet.map(|n| own.x[n as usize])).collect();
        let of_surface = |n: &&u32| surface.has_node(**n as usize);
        self.nodes.iter().filter(of_surface).map(|&n| own.x[n as usize]).any(|p| {
            around.iter().any(|tet| tetrahedron_holds(tet, &p))
                && (0..surface.triangles.len() as u32)
                    .filter(|&t| !surface.triangles[t as usize].iter().any(|&n| self.holds(n)))
                    .all(|t| distance(own, t, &p) > deep(own))
        })
    }
}

/// What draws two triangles apart.
fn constraint(a: &SoftSurface<'_>, ta: u32, b: &SoftSurface<'_>, tb: u32, apart: Vec3) -> Constraint {
    let side = |s: &SoftSurface<'_>, t: u32| {
        let nodes = s.model.surface.triangles[t as usize];
        Endpoint::Soft { body: s.body, nodes, weights: [1.0 / 3.0; 3] }
    };
    let key = SoftPairContact { other: b.key, second: tb, first: ta, kind: SoftPairKind::Separation };
    let key = ConstraintKey::SoftPair(key);
    let depth = a.model.surface.mean_edge.min(b.model.surface.mean_edge);
    Constraint::new([side(a, ta), side(b, tb)], apart, -depth, key)
}

fn distance(s: &SoftSurface<'_>, t: u32, p: &Vec3) -> f64 {
    let [a, b, c] = corners(s, t).each_ref().map(to_real);
    f64::from(Triangle::new(a, b, c).distance_to_local_point(to_real(p), true))
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

/// Depth from which on a node is deep in a body \[m\].
fn deep(s: &SoftSurface<'_>) -> f64 {
    DEEP * s.model.surface.mean_edge.min(s.model.surface.half_thickness)
}

fn are_deep([a, b]: [&SoftSurface<'_>; 2]) -> bool {
    is_deep(a, b) || is_deep(b, a)
}

/// Whether a surface node of one body is deep in the other.
fn is_deep(own: &SoftSurface<'_>, other: &SoftSurface<'_>) -> bool {
    let depth = deep(other);
    let corners: Vec<Vec3> = other.model.surface.nodes.iter().map(|&n| other.x[n as usize]).collect();
    // What is that deep is as far inside of the other's box: next to nothing of bodies that rest on one another.
    let low = corners.iter().fold(corners[0], |a, b| a.inf(b)).add_scalar(depth);
    let high = corners.iter().fold(corners[0], |a, b| a.sup(b)).add_scalar(-depth);
    let middle = corners.iter().sum::<Vec3>() / corners.len() as f64;
    // And in any direction something of the other is that far beyond it. Without this bodies that lie askew, in whose boxes much is that
    // they do not fill, take a look at all elements for each such node: 5 % of a heap's step.
    let is_beyond = |p: &Vec3| {
        let away = (p - middle).try_normalize(0.0);
        away.is_some_and(|away| corners.iter().all(|corner| away.dot(&(corner - p)) < depth))
    };
    own.model.surface.nodes.iter().map(|&n| own.x[n as usize]).any(|p| {
        (0..3).all(|k| p[k] > low[k] && p[k] < high[k])
            && !is_beyond(&p)
            // Few are far from the surface: they alone are worth a look at all elements.
            && is_far_from_surface(other, &p, depth)
            && is_inside(other, &p)
    })
}

/// Whether no triangle is within `depth` \[m\] of a point.
fn is_far_from_surface(s: &SoftSurface<'_>, p: &Vec3, depth: f64) -> bool {
    // Boxes of triangles have a margin, which is more than rounding takes.
    let at = to_real(p);
    let around = Aabb::new(at, at).loosened(depth as f32);
    s.tree.near(&around).all(|t| distance(s, t, p) > depth)
}

/// Whether a point is in one of the elements.
fn is_inside(s: &SoftSurface<'_>, p: &Vec3) -> bool {
    // Beyond all corners of an element by more than rounding, a point is not in it.
    let slack = CLEARLY * s.model.surface.mean_edge;
    let is_beside = |corners: &[Vec3; 4], k: usize| {
        let least = corners.iter().fold(f64::INFINITY, |least, c| least.min(c[k]));
        let most = corners.iter().fold(f64::NEG_INFINITY, |most, c| most.max(c[k]));
        p[k] < least - slack || p[k] > most + slack
    };
    s.model.tetrahedra.iter().any(|tet| {
        let corners = tet.map(|n| s.x[n as usize]);
        !(0..3).any(|k| is_beside(&corners, k)) && tetrahedron_holds(&corners, p)
    })
}
