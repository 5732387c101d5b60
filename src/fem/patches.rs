//! Tetrahedra in disjoint patches of about five, each with one volume: as many pressures as a mesh of hexahedra has. One
//! per tetrahedron or per node is too many, and a body near incompressibility too stiff: a cantilever of 20 × 4 × 4 cells
//! and ν = 0.4999 bends by 30 and 11 % less than it should, by patches 0.2 % more.

use crate::mesh::sorted_faces;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Tetrahedra of a patch. A cell of the lattice has five. With four the beam above is 5 % too stiff, with eight one of two cells
/// across is 7 % too soft.
const SIZE: usize = 5;
/// Volumes are compared to this part of their mean: those of a lattice are equal but for rounding.
const STEP: f64 = 1.0e-6;

/// A tetrahedron that a patch may grow from: the one with the most neighbours that are free, then the largest.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Seed {
    free: usize,
    volume: u64,
    tet: Reverse<usize>,
}

/// The patch of each tetrahedron, by the nodes of its corners and its volume.
pub(super) fn patches(tetrahedra: &[[u32; 4]], volumes: &[f64]) -> Vec<u32> {
    let neighbours = face_neighbours(tetrahedra);
    let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
    let mut patch: Vec<Option<u32>> = vec![None; tetrahedra.len()];
    let seed = |tet: usize, patch: &[Option<u32>]| Seed {
        free: neighbours[tet].iter().filter(|n| patch[**n].is_none()).count(),
        volume: (volumes[tet] / (mean * STEP)).round() as u64,
        tet: Reverse(tet),
    };
    let mut heap: BinaryHeap<Seed> = (0..tetrahedra.len()).map(|tet| seed(tet, &patch)).collect();
    let mut members: Vec<Vec<usize>> = Vec::new();
    while let Some(best) = heap.pop() {
        let Reverse(tet) = best.tet;
        if patch[tet].is_some() {
            continue;
        }
        let now = seed(tet, &patch);
        if now != best {
            heap.push(now);
            continue;
        }
        let name = members.len() as u32;
        let mut own = vec![tet];
        own.extend(neighbours[tet].iter().filter(|n| patch[**n].is_none()));
        own.iter().for_each(|&t| patch[t] = Some(name));
        while own.len() < SIZE {
            let Some(next) = closest(&own, tetrahedra, &neighbours, &patch) else { break };
            patch[next] = Some(name);
            own.push(next);
        }
        members.push(own);
    }
    let mut patch: Vec<u32> = patch.into_iter().flatten().collect();
    merge_small(&mut members, &neighbours, &mut patch);
    patch
}

/// The free neighbour of a patch that shares the most nodes with it, then the most faces.
fn closest(
    own: &[usize],
    tetrahedra: &[[u32; 4]],
    neighbours: &[Vec<usize>],
    patch: &[Option<u32>],
) -> Option<usize> {
    let free = own.iter().flat_map(|t| &neighbours[*t]).copied().filter(|t| patch[*t].is_none());
    let shared = |tet: usize| {
        let is_shared = |n: &&u32| own.iter().any(|t| tetrahedra[*t].contains(n));
        let faces = neighbours[tet].iter().filter(|t| own.contains(t)).count();
        (tetrahedra[tet].iter().filter(is_shared).count(), faces, Reverse(tet))
    };
    free.max_by_key(|tet| shared(*tet))
}

/// Adds patches that are too small to the neighbour that has the fewest tetrahedra, less the faces between them.
fn merge_small(members: &mut [Vec<usize>], neighbours: &[Vec<usize>], patch: &mut [u32]) {
    let is_small = |own: &Vec<usize>| own.len() < SIZE;
    let small = (0..members.len()).filter(|p| is_small(&members[*p]));
    let mut small: BTreeSet<(usize, usize)> = small.map(|p| (members[p].len(), p)).collect();
    while let Some((_, from)) = small.pop_first() {
        let mut faces: BTreeMap<u32, usize> = BTreeMap::new();
        for other in members[from].iter().flat_map(|t| &neighbours[*t]).map(|t| patch[*t]) {
            if other as usize != from {
                *faces.entry(other).or_default() += 1;
            }
        }
        let cost = |(other, faces): &(&u32, &usize)| members[**other as usize].len() as i64 - **faces as i64;
        // A piece of its own stays what it is.
        let Some((&into, _)) = faces.iter().min_by_key(cost) else {
            continue;
        };
        let moved = std::mem::take(&mut members[from]);
        moved.iter().for_each(|t| patch[*t] = into);
        let into = into as usize;
        small.remove(&(members[into].len(), into));
        members[into].extend(moved);
        if is_small(&members[into]) {
            small.insert((members[into].len(), into));
        }
    }
}

/// Tetrahedra that share a face with each, ascending.
fn face_neighbours(tetrahedra: &[[u32; 4]]) -> Vec<Vec<usize>> {
    let mut faces: Vec<([u32; 3], usize)> = Vec::with_capacity(4 * tetrahedra.len());
    for (place, tet) in tetrahedra.iter().enumerate() {
        faces.extend(sorted_faces(tet).map(|face| (face, place)));
    }
    faces.sort_unstable();
    let mut neighbours = vec![Vec::new(); tetrahedra.len()];
    for pair in faces.windows(2) {
        if pair[0].0 == pair[1].0 {
            neighbours[pair[0].1].push(pair[1].1);
            neighbours[pair[1].1].push(pair[0].1);
        }
    }
    neighbours.iter_mut().for_each(|own| own.sort_unstable());
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetMesh;
    use parry3d::shape::{Ball, Shape};

    fn labels(mesh: &TetMesh) -> Vec<u32> {
        patches(mesh.tetrahedra(), mesh.volumes())
    }

    fn sizes(labels: &[u32]) -> Vec<usize> {
        let mut sizes = BTreeMap::new();
        labels.iter().for_each(|p| *sizes.entry(p).or_insert(0) += 1);
        sizes.into_values().collect()
    }

    #[test]
    fn patches_of_a_lattice_are_its_cells() {
        for (half, cells) in [([0.5, 0.1, 0.1], [10, 2, 2]), ([0.3, 0.2, 0.5], [5, 4, 3]), ([0.5; 3], [1; 3])]
        {
            let mesh = TetMesh::cuboid(half, cells).unwrap();
            let cell = |tet: &[u32; 4]| {
                let middle =
                    |k: usize| tet.iter().map(|&n| mesh.vertices()[n as usize][k]).sum::<f64>() / 4.0;
                [0, 1, 2].map(|k| ((middle(k) + half[k]) / (2.0 * half[k]) * cells[k] as f64) as usize)
            };
            let labels = labels(&mesh);
            let mut cell_of = BTreeMap::new();
            for (tet, patch) in mesh.tetrahedra().iter().zip(&labels) {
                assert_eq!(*cell_of.entry(*patch).or_insert_with(|| cell(tet)), cell(tet), "{cells:?}");
            }
            assert_eq!(cell_of.len(), cells.iter().product::<usize>());
        }
    }

    #[test]
    #[cfg_attr(debug_assertions, ignore = "filling checks its mesh after every change there")]
    fn patches_of_any_mesh_hang_together_and_none_is_small() {
        let shape: &dyn Shape = &Ball::new(0.5);
        let mesh = TetMesh::fill_shape(shape, 0.12).unwrap();
        let labels = labels(&mesh);
        let sizes = sizes(&labels);
        let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
        println!("{} tetrahedra, {} patches of {least} to {most}", labels.len(), sizes.len());
        assert!(*least >= SIZE && *most <= 4 * SIZE && labels.len() < 8 * sizes.len());
        // Whoever is in a patch has a neighbour there.
        let neighbours = face_neighbours(mesh.tetrahedra());
        for (tet, own) in neighbours.iter().enumerate() {
            assert!(own.iter().any(|other| labels[*other] == labels[tet]));
        }
    }

    #[test]
    fn a_tetrahedron_alone_is_a_patch() {
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(labels(&TetMesh::new(corners, vec![[0, 1, 2, 3]]).unwrap()), [0]);
    }
}
