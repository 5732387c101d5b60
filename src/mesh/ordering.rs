//! Node order for locality and for little fill in the factor.

use crate::math::Vec3;

/// Parts below this size are not cut further: their fill is that of a dense block anyhow.
const SMALL: usize = 32;

/// Nested dissection by coordinates [George 1973; Heath & Raghavan 1995]: cut at the median of the
/// longest axis, order both halves first and the separating nodes last, recursively. Returns the
/// old index at each new place..
pub(crate) fn nested_dissection(positions: &[Vec3], adjacency: &[Vec<u32>]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let mut side = vec![0u8; positions.len()];
    dissect(&mut order, positions, adjacency, &mut side);
    order
}

/// Sorted neighbours of every node: nodes that share a tetrahedron with it.
pub(crate) fn node_adjacency(tetrahedra: &[[u32; 4]], nodes: usize) -> Vec<Vec<u32>> {
    let mut adjacency = vec![Vec::new(); nodes];
    for tet in tetrahedra {
        for &a in tet {
            adjacency[a as usize].extend(tet.iter().filter(|&&b| b != a));
        }
    }
    for list in &mut adjacency {
        list.sort_unstable();
        list.dedup();
    }
    adjacency
}

/// Marks while one part is being cut.
const LOWER: u8 = 1;
const UPPER: u8 = 2;
const SEPARATOR: u8 = 3;

fn dissect(part: &mut [u32], positions: &[Vec3], adjacency: &[Vec<u32>], side: &mut [u8]) {
    if part.len() <= SMALL {
        return;
    }
    let axis = longest_axis(part, positions);
    let key = |&i: &u32| positions[i as usize][axis];
    part.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    // Cut between layers of equal coordinate where there are such: the separator is then a plane.
    let middle = part.len() / 2;
    let cut_at = key(&part[middle]);
    let mut cut = part.partition_point(|i| key(i) < cut_at);
    if cut < part.len() / 8 {
        cut = middle;
    }
    for (k, &i) in part.iter().enumerate() {
        side[i as usize] = if k < cut { LOWER } else { UPPER };
    }
    for &i in &part[cut..] {
        let touches = |&j: &u32| side[j as usize] == LOWER;
        if adjacency[i as usize].iter().any(touches) {
            side[i as usize] = SEPARATOR;
        }
    }
    part.sort_by_key(|&i| side[i as usize]);
    let lower = cut;
    let upper = part.partition_point(|&i| side[i as usize] < SEPARATOR);
    part.iter().for_each(|&i| side[i as usize] = 0);
    if upper <= lower {
        return;
    }
    dissect(&mut part[..lower], positions, adjacency, side);
    dissect(&mut part[lower..upper], positions, adjacency, side);
}

fn longest_axis(part: &[u32], positions: &[Vec3]) -> usize {
    let mut low = Vec3::repeat(f64::INFINITY);
    let mut high = -low;
    for &i in part {
        low = low.inf(&positions[i as usize]);
        high = high.sup(&positions[i as usize]);
    }
    (high - low).imax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetMesh;

    #[test]
    fn order_is_a_permutation() {
        let mesh = TetMesh::cuboid([1.0, 0.2, 0.2], [30, 5, 5]).unwrap();
        let rest: Vec<Vec3> = mesh.vertices().iter().map(|&v| v.into()).collect();
        let order = nested_dissection(&rest, &node_adjacency(mesh.tetrahedra(), rest.len()));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &n)| i == n as usize));
    }
}
