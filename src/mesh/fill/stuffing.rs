//! Isosurface stuffing [Labelle Shewchuk 2007]: the tetrahedra of a body-centred lattice, cut at the surface.

use super::domain::Domain;
use super::lattice::Lattice;
use crate::math::Vec3;
use crate::mesh::surface::{EdgeUse, boundary_triangles, edge_uses};
use crate::mesh::tet_mesh::signed_volume;
use std::collections::BTreeMap;

/// A lattice vertex moves onto the surface if an edge is cut nearer than these parts of it, of a long edge and a short
/// one: the values with which [Labelle Shewchuk 2007] prove dihedral angles between 10.7° and 164.8°.
const NEAR: [f64; 2] = [0.24999, 0.41189];

/// Tetrahedra, and which vertices are on the surface.
pub(super) struct Stuffing {
    pub points: Vec<Vec3>,
    pub tetrahedra: Vec<[u32; 4]>,
    pub is_on_surface: Vec<bool>,
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Inside,
    On,
    Outside,
}

/// Lattice vertices with their side, and the cut on every edge between the sides.
struct Cut<'a> {
    lattice: &'a Lattice,
    points: Vec<Vec3>,
    side: Vec<Side>,
    /// By edge, its vertex inside first.
    cuts: BTreeMap<[u32; 2], Vec3>,
}

pub(super) fn stuff(domain: &Domain, lattice: &Lattice, is_inside: &[bool]) -> Stuffing {
    let mut cut = Cut::new(domain, lattice, is_inside);
    cut.warp();
    let mut points = cut.points;
    let mut is_on_surface: Vec<bool> = cut.side.iter().map(|s| *s == Side::On).collect();
    let mut ids = BTreeMap::new();
    for (edge, at) in &cut.cuts {
        ids.insert(*edge, points.len() as u32);
        points.push(*at);
        is_on_surface.push(true);
    }
    let mut tetrahedra = Vec::new();
    // Halving from the cuts of short edges last leaves dihedral angles of 21° at least in balls.
    let corner = |p, m| Corner { rank: 1 + u8::from(!lattice.is_long([p, m])), id: ids[&[p, m]] };
    lattice.for_each_tetrahedron(|corners| clip(corners, &cut.side, &corner, &mut tetrahedra));
    open_branching_edges(&mut tetrahedra);
    for tet in &mut tetrahedra {
        if signed_volume(&tet.map(|v| points[v as usize])) < 0.0 {
            tet.swap(2, 3);
        }
    }
    compact(points, tetrahedra, is_on_surface)
}

impl<'a> Cut<'a> {
    fn new(domain: &Domain, lattice: &'a Lattice, is_inside: &[bool]) -> Self {
        let points: Vec<Vec3> = (0..lattice.vertices() as u32).map(|v| lattice.position(v)).collect();
        let side = is_inside.iter().map(|&i| if i { Side::Inside } else { Side::Outside }).collect();
        let mut cuts = BTreeMap::new();
        lattice.for_each_tetrahedron(|corners| {
            let inside = corners.map(|v| is_inside[v as usize]);
            if inside == [inside[0]; 4] {
                return;
            }
            for p in (0..4).filter(|&p| inside[p]) {
                for m in (0..4).filter(|&m| !inside[m]) {
                    let edge = [corners[p], corners[m]];
                    let [within, outside] = edge.map(|v| &points[v as usize]);
                    cuts.entry(edge).or_insert_with(|| domain.crossing(outside, within));
                }
            }
        });
        Self { lattice, points, side, cuts }
    }

    /// Moves vertices onto the surface where it is near, which takes the cuts of their edges away.
    fn warp(&mut self) {
        let mut edges_of: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
        for edge in self.cuts.keys() {
            edge.iter().for_each(|v| edges_of.entry(*v).or_default().push(*edge));
        }
        for (vertex, edges) in edges_of {
            let from = self.points[vertex as usize];
            let near = |edge: &[u32; 2]| {
                let at = *self.cuts.get(edge)?;
                let is_long = self.lattice.is_long(*edge);
                let length = self.lattice.a * if is_long { 1.0 } else { 0.75f64.sqrt() };
                let distance = (at - from).norm();
                (distance < NEAR[usize::from(!is_long)] * length).then_some((distance, at))
            };
            let nearest = edges.iter().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, at)) = nearest {
                self.points[vertex as usize] = at;
                self.side[vertex as usize] = Side::On;
                for edge in edges {
                    self.cuts.remove(&edge);
                }
            }
        }
    }
}

/// The part of a lattice tetrahedron that is inside, with `cut` the corner between a vertex inside and one outside.
fn clip(corners: [u32; 4], side: &[Side], cut: &impl Fn(u32, u32) -> Corner, out: &mut Vec<[u32; 4]>) {
    let of = |wanted: Side| corners.into_iter().filter(move |v| side[*v as usize] == wanted);
    let (inside, outside): (Vec<u32>, Vec<u32>) = (of(Side::Inside).collect(), of(Side::Outside).collect());
    let own = |id: u32| Corner { rank: 0, id };
    match (&inside[..], &outside[..]) {
        ([], _) => {}
        (_, []) => out.push(corners),
        (&[p], _) => out.push(corners.map(|v| if outside.contains(&v) { cut(p, v).id } else { v })),
        (&[p, q], &[m]) => {
            let on = of(Side::On).next().unwrap_or(p);
            pyramid(on, [own(p), own(q), cut(q, m), cut(p, m)], out);
        }
        (&[p, q], &[m, n, ..]) => {
            prism([own(p), cut(p, m), cut(p, n)], [own(q), cut(q, m), cut(q, n)], out);
        }
        (&[p, q, r, ..], &[m, ..]) => {
            prism([own(p), own(q), own(r)], [cut(p, m), cut(q, m), cut(r, m)], out);
        }
    }
}

/// A corner of what is left of a tetrahedron. Quadrilaterals are halved from their least corner, so that neighbours
/// agree, and so that every prism has three tetrahedra.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Corner {
    rank: u8,
    id: u32,
}

fn pyramid(apex: u32, quad: [Corner; 4], out: &mut Vec<[u32; 4]>) {
    let least = (0..4).min_by_key(|&k| quad[k]).unwrap_or(0);
    let at = |k: usize| quad[(least + k) % 4].id;
    out.push([apex, at(0), at(1), at(2)]);
    out.push([apex, at(0), at(2), at(3)]);
}

/// Between two triangles with edges from each corner to that of the other.
fn prism(a: [Corner; 3], b: [Corner; 3], out: &mut Vec<[u32; 4]>) {
    let least = (0..3).min_by_key(|&k| a[k].min(b[k])).unwrap_or(0);
    let (a, b) = if a[least] < b[least] { (a, b) } else { (b, a) };
    let [k, l, m] = [0, 1, 2].map(|i| (least + i) % 3);
    out.push([a[k].id, b[0].id, b[1].id, b[2].id]);
    pyramid(a[k].id, [a[l], a[m], b[m], b[l]], out);
}

/// Drops vertices that no tetrahedron uses.
fn compact(points: Vec<Vec3>, mut tetrahedra: Vec<[u32; 4]>, is_on_surface: Vec<bool>) -> Stuffing {
    let mut name = vec![u32::MAX; points.len()];
    let mut out = Stuffing { points: Vec::new(), tetrahedra: Vec::new(), is_on_surface: Vec::new() };
    for v in tetrahedra.iter_mut().flatten() {
        if name[*v as usize] == u32::MAX {
            name[*v as usize] = out.points.len() as u32;
            out.points.push(points[*v as usize]);
            out.is_on_surface.push(is_on_surface[*v as usize]);
        }
        *v = name[*v as usize];
    }
    out.tetrahedra = tetrahedra;
    out
}

/// Removes tetrahedra where the boundary branches: parts that meet in nothing but an edge. The smaller of the fans around
/// such an edge goes, until there is no such edge.
fn open_branching_edges(cells: &mut Vec<[u32; 4]>) {
    loop {
        let Ok(boundary) = boundary_triangles(cells) else { return };
        let branching = edge_uses(&boundary).into_iter().find(|u| u.count != 2);
        let Some(EdgeUse { edge, .. }) = branching else { return };
        let mut fans: Vec<Vec<usize>> = Vec::new();
        for (k, cell) in cells.iter().enumerate() {
            if !edge.iter().all(|e| cell.contains(e)) {
                continue;
            }
            // Neighbours in a fan share a face: three vertices.
            let shares_face = |&j: &usize| cells[j].iter().filter(|v| cell.contains(v)).count() == 3;
            let (near, mut far): (Vec<_>, Vec<_>) =
                fans.drain(..).partition(|fan| fan.iter().any(shares_face));
            far.push(near.into_iter().flatten().chain([k]).collect());
            fans = far;
        }
        let Some(mut smallest) = fans.into_iter().min_by_key(|fan| (fan.len(), fan[0])) else {
            return;
        };
        smallest.sort_unstable();
        for k in smallest.into_iter().rev() {
            cells.swap_remove(k);
        }
    }
}
