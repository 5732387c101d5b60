//! Surface vertices moved onto creases and corners, so that no facet lies across one.

use super::creases::{Creases, Pair};
use super::domain::Domain;
use super::draft::{Draft, Home};
use crate::math::Vec3;
use crate::mesh::surface::{boundary_triangles, edge_uses};
use crate::mesh::tet_mesh::signed_volume;
use std::collections::{BTreeMap, BTreeSet};

/// Least quality that a move onto a crease may leave at its vertex; `improvement` mends it then. With 0.02 a cone of five
/// cells across keeps dihedral angles of 6°, with 0.1 18°.
const LEAST: f64 = 0.1;
/// The same where an edge is split: its halves have half the quality.
const LEAST_SPLIT: f64 = 0.03;
/// A corner takes the nearest vertex within this part of a cube.
const REACH: f64 = 0.8;
/// Rounds over all edges that lie across a crease.
const ROUNDS: usize = 4;

/// Moves the nearest vertex onto each corner, then of each edge across a crease the nearer end onto it.
pub(super) fn snap_to_creases(draft: &mut Draft, domain: &Domain, cube: f64) {
    let Some((creases, _)) = domain.creases() else { return };
    snap_corners(draft, creases, cube);
    let edges = surface_edges(draft);
    for _ in 0..ROUNDS {
        if !snap_edges(draft, creases, &edges) {
            return;
        }
    }
}

/// Grows a tetrahedron to each corner that no vertex could be moved to, and parts the edges that are still across a
/// crease where they cross it.
pub(super) fn split_at_creases(draft: &mut Draft, domain: &Domain, cube: f64) {
    let Some((creases, _)) = domain.creases() else { return };
    grow_to_corners(draft, creases, cube);
    for edge in surface_edges(draft) {
        let [own, others] = edge.map(|v| patches(draft, v));
        if shares(own, others) {
            continue;
        }
        let middle = (draft.points[edge[0] as usize] + draft.points[edge[1] as usize]) / 2.0;
        let pairs = own.iter().flat_map(|&p| others.iter().map(move |&q| [p.min(q), p.max(q)]));
        let place = |pair: Pair| Some((creases.nearest_on(&pair, &middle)?, pair));
        let distance = |at: &Vec3| (at - middle).norm();
        let nearest = pairs.filter_map(place).min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)));
        if let Some((at, pair)) = nearest {
            draft.split(edge, at, Home::Surface(pair.to_vec()), LEAST_SPLIT);
        }
    }
}

fn surface_edges(draft: &Draft) -> Vec<[u32; 2]> {
    let boundary = boundary_triangles(&draft.tetrahedra).unwrap_or_default();
    edge_uses(&boundary).into_iter().map(|u| u.edge).collect()
}

fn patches(draft: &Draft, vertex: u32) -> &[u32] {
    match &draft.home[vertex as usize] {
        Home::Inside => &[],
        Home::Surface(patches) => patches,
    }
}

fn shares(a: &[u32], b: &[u32]) -> bool {
    a.iter().any(|p| b.contains(p))
}

/// Moves onto each corner that has no vertex the nearest that may be one and stays good.
fn snap_corners(draft: &mut Draft, creases: &Creases, cube: f64) {
    let bucket = |x: &Vec3| [x.x, x.y, x.z].map(|c| (c / cube).floor() as i64);
    let mut buckets: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (v, x) in draft.points.iter().enumerate().filter(|(v, _)| !patches(draft, *v as u32).is_empty()) {
        buckets.entry(bucket(x)).or_default().push(v);
    }
    for (corner, around) in &creases.corners {
        let [i, j, k] = bucket(corner);
        let cells = (0..27).map(|n| [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
        let near: Vec<usize> = cells.filter_map(|cell| buckets.get(&cell)).flatten().copied().collect();
        let distance = |v: &usize| (draft.points[*v] - corner).norm();
        if near.iter().any(|v| draft.points[*v] == *corner) {
            continue;
        }
        // On a crease only if it ends here.
        let may = |v: &usize| match patches(draft, *v as u32) {
            [_] => true,
            [p, q] => around.contains(p) && around.contains(q),
            _ => false,
        };
        let fits = |v: &usize| may(v) && distance(v) < REACH * cube && draft.worst_if(*v, *corner) > LEAST;
        let nearest = near.into_iter().filter(fits).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(vertex) = nearest {
            draft.points[vertex] = *corner;
            draft.home[vertex] = home_of(around);
        }
    }
}

/// Of a vertex on a corner. One between two patches stays where it is, too: it has more than two names.
fn home_of(around: &[u32]) -> Home {
    let mut home = around.to_vec();
    home.resize(home.len().max(3), around[0]);
    Home::Surface(home)
}

fn grow_to_corners(draft: &mut Draft, creases: &Creases, cube: f64) {
    let bits = |x: &Vec3| [x.x, x.y, x.z].map(f64::to_bits);
    let taken: BTreeSet<[u64; 3]> = draft.points.iter().map(bits).collect();
    let mut boundary = boundary_triangles(&draft.tetrahedra).unwrap_or_default();
    for (corner, around) in creases.corners.iter().filter(|(corner, _)| !taken.contains(&bits(corner))) {
        let quality = |t: &[u32; 3]| {
            let is_near = |v: &u32| (draft.points[*v as usize] - corner).norm() < 2.0 * REACH * cube;
            t.iter().all(is_near).then(|| draft.quality_to(t, corner)).filter(|quality| *quality > LEAST)
        };
        let good = boundary.iter().enumerate().filter_map(|(k, t)| Some((quality(t)?, k)));
        let best = good.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k);
        if let Some(best) = best.filter(|&k| !hits_neighbours(draft, &boundary, k, corner)) {
            draft.grow(&boundary.swap_remove(best), *corner, home_of(around));
        }
    }
}

/// Whether a triangle that shares an edge with the `of`-th one stands in the way from that to `x`.
fn hits_neighbours(draft: &Draft, boundary: &[[u32; 3]], of: usize, x: &Vec3) -> bool {
    let place = |v: u32| draft.points[v as usize];
    (0..3).any(|k| {
        let [a, b, c] = [0, 1, 2].map(|i| boundary[of][(k + i) % 3]);
        let across = boundary.iter().find(|t| (0..3).any(|i| t[i] == b && t[(i + 1) % 3] == a));
        let Some(&n) = across.and_then(|t| t.iter().find(|v| **v != a && **v != b)) else { return true };
        let above = signed_volume(&[place(a), place(b), place(c), place(n)]) > 0.0;
        let within = signed_volume(&[place(a), place(b), *x, place(n)]) < 0.0;
        above && within
    })
}

/// One round, the shortest ways first; whether anything moved.
fn snap_edges(draft: &mut Draft, creases: &Creases, edges: &[[u32; 2]]) -> bool {
    let mut neighbours: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut moves: Vec<(f64, u32, Pair)> = Vec::new();
    for &[a, b] in edges {
        for (end, other) in [(a, b), (b, a)] {
            neighbours.entry(end).or_default().push(other);
            let (&[own], others) = (patches(draft, end), patches(draft, other)) else { continue };
            for &beyond in others.iter().filter(|_| !others.contains(&own)) {
                let pair = [own.min(beyond), own.max(beyond)];
                let x = draft.points[end as usize];
                moves.extend(creases.nearest_on(&pair, &x).map(|at| ((at - x).norm(), end, pair)));
            }
        }
    }
    moves.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut any = false;
    for (_, vertex, pair) in moves {
        let own = patches(draft, vertex);
        let is_across = |&v: &u32| {
            let others = patches(draft, v);
            !shares(own, others) && shares(others, &pair)
        };
        if own.len() != 1 || !neighbours[&vertex].iter().any(is_across) {
            continue;
        }
        let at = creases.nearest_on(&pair, &draft.points[vertex as usize]);
        if let Some(at) = at.filter(|at| draft.worst_if(vertex as usize, *at) > LEAST) {
            draft.points[vertex as usize] = at;
            draft.home[vertex as usize] = Home::Surface(pair.to_vec());
            any = true;
        }
    }
    any
}
