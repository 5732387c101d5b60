//! Node order for locality.

use crate::math::Vec3;

/// Nodes along the longest axis of the body, layer by layer: elements in this order touch the nodes of
/// a few layers at a time, which stay in the first cache. Returns the old index at each new place.
pub(crate) fn sweep_order(positions: &[Vec3]) -> Vec<u32> {
    let mut low = Vec3::repeat(f64::INFINITY);
    let mut high = -low;
    for p in positions {
        (low, high) = (low.inf(p), high.sup(p));
    }
    let extent = high - low;
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extent[b].total_cmp(&extent[a]));
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let at = |i: u32, axis: usize| positions[i as usize][axis];
    order.sort_unstable_by(|&a, &b| {
        let along = axes.iter().map(|&axis| at(a, axis).total_cmp(&at(b, axis)));
        along.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then).then(a.cmp(&b))
    });
    order
}

/// Sorted neighbours of every node: nodes that share an element with it.
pub(crate) fn node_adjacency<'a>(elements: impl Iterator<Item = &'a [u32]>, nodes: usize) -> Vec<Vec<u32>> {
    let mut adjacency = vec![Vec::new(); nodes];
    for element in elements {
        for &a in element {
            adjacency[a as usize].extend(element.iter().filter(|&&b| b != a));
        }
    }
    for list in &mut adjacency {
        list.sort_unstable();
        list.dedup();
    }
    adjacency
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetMesh;

    #[test]
    fn order_is_a_permutation() {
        let mesh = TetMesh::cuboid([1.0, 0.2, 0.2], [30, 5, 5]).unwrap();
        let rest: Vec<Vec3> = mesh.vertices().iter().map(|&v| v.into()).collect();
        let order = sweep_order(&rest);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &n)| i == n as usize));
    }
}
