//! Which facets of two surfaces, triangles and segments of rods, may meet within a step: trees over the boxes that they sweep,
//! refitted from step to step.

use crate::fem::DeformableModel;
use crate::math::{Vec3, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

/// A tree over the facets of one surface.
#[derive(Default)]
pub(crate) struct SurfaceTree {
    tree: Bvh,
    boxes: Vec<Aabb>,
    /// Per surface node, around its way.
    ways: Vec<Aabb>,
}

/// Rounding of `f32` coordinates, relative to them.
pub(super) const ROUNDING: f32 = 2.5e-7;

impl SurfaceTree {
    /// Refits to the facets on their way from `x` to `target`, with `margin` \[m\] around them.
    pub fn update(&mut self, model: &DeformableModel, x: &[Vec3], target: &[Vec3], margin: f64) {
        let surface = &model.surface;
        let way = |&n: &u32| {
            let [from, to] = [to_real(&x[n as usize]), to_real(&target[n as usize])];
            Aabb::new(from.min(to), from.max(to))
        };
        self.ways.clear();
        self.ways.extend(surface.nodes.iter().map(way));
        self.boxes.clear();
        for facet in 0..surface.facet_count() {
            let ways = surface
                .facet_nodes(facet)
                .iter()
                .map(|&n| self.ways[surface.index_of_node[n as usize] as usize]);
            let swept = ways.reduce(|a, b| a.merged(&b)).unwrap_or_else(Aabb::new_invalid);
            let rounding = ROUNDING * swept.mins.abs().max(swept.maxs.abs()).max_element();
            self.boxes.push(swept.loosened(margin as f32 + rounding));
        }
        if self.tree.leaf_count() as usize != self.boxes.len() {
            self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &self.boxes);
            return;
        }
        for (number, aabb) in (0..).zip(&self.boxes) {
            self.tree.insert_or_update_partially(*aabb, number, 0.0);
        }
        self.tree.refit_without_opt();
    }

    /// Facets whose boxes meet `aabb`, in no order.
    pub fn near<'a>(&'a self, aabb: &'a Aabb) -> impl Iterator<Item = u32> + 'a {
        self.tree.intersect_aabb(aabb).filter(|&facet| self.boxes[facet as usize].intersects(aabb))
    }

    /// Pairs of facets, of this surface and of `other`, whose boxes meet. In no order; but which ones does not
    /// depend on how the trees have grown.
    pub fn pairs<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (u32, u32)> + 'a {
        let met = self.tree.leaf_pairs(&other.tree, |a, b| a.intersects(b));
        met.filter(|&(a, b)| self.boxes[a as usize].intersects(&other.boxes[b as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation_from_vector;
    use crate::mesh::TetMesh;
    use proptest::prelude::*;

    fn vector(size: f64) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn trees_find_what_all_pairs_find(
            shift in vector(0.5), turn in vector(3.0), way in vector(0.2), later in vector(0.4), margin in 0.0..0.05f64,
        ) {
            let model = DeformableModel::new(&TetMesh::cuboid([0.2, 0.15, 0.1], [3, 2, 2]).unwrap());
            let still = model.rest.clone();
            let placed = |shift: Vec3| -> Vec<Vec3> {
                model.rest.iter().map(|x| rotation_from_vector(&turn) * x + shift).collect()
            };
            let (mut a, mut b) = (SurfaceTree::default(), SurfaceTree::default());
            a.update(&model, &still, &still, margin);
            // Built in one place, refitted in another.
            for shift in [later, shift] {
                let x = placed(shift);
                let target: Vec<Vec3> = x.iter().map(|x| x + way).collect();
                b.update(&model, &x, &target, margin);
            }
            let mut found: Vec<(u32, u32)> = a.pairs(&b).collect();
            found.sort_unstable();
            let count = model.surface.triangles.len();
            let all = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
            let met = all.filter(|&(i, j)| a.boxes[i].intersects(&b.boxes[j]));
            let met: Vec<(u32, u32)> = met.map(|(i, j)| (i as u32, j as u32)).collect();
            prop_assert_eq!(&found, &met);
            // Whatever is as near as the margins, at either end of the way, is among them.
            let x = placed(shift);
            for (i, t) in model.surface.triangles.iter().enumerate() {
                for (j, u) in model.surface.triangles.iter().enumerate() {
                    let near = |v: &Vec3| t.iter().any(|&n| (still[n as usize] - v).norm() < 2.0 * margin);
                    let meets = u.iter().any(|&n| near(&x[n as usize]) || near(&(x[n as usize] + way)));
                    prop_assert!(!meets || found.binary_search(&(i as u32, j as u32)).is_ok());
                }
            }
        }
    }
}
