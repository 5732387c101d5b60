//! The Hessians of all bodies of a step as one, whose nodes are in one row, and after them the masses over h² of the rigid ones.

use super::tangent::Tangent;
use crate::math::{Mat3, Vec3};
use std::ops::Range;

/// Of each body its Hessian, and which of the nodes are its.
pub(super) struct Tangents<'a> {
    each: Vec<(&'a mut Tangent, Range<usize>)>,
    /// Of rigid bodies, inverse: of their linear motions and turns in turn.
    rigid: Vec<Mat3>,
}

impl<'a> Tangents<'a> {
    pub fn new(each: Vec<(&'a mut Tangent, Range<usize>)>, rigid: Vec<Mat3>) -> Self {
        Self { each, rigid }
    }

    /// As [`Tangent::solve`], of columns over all nodes.
    pub fn solve(&mut self, columns: &mut [f64]) -> bool {
        if let ([(tangent, _)], []) = (&mut self.each[..], &self.rigid[..]) {
            return tangent.solve(columns);
        }
        let deformable = self.each.last().map_or(0, |(_, nodes)| 3 * nodes.end);
        let count = deformable + 3 * self.rigid.len();
        for column in columns.chunks_exact_mut(count) {
            for (motion, inverse) in column[deformable..].chunks_exact_mut(3).zip(&self.rigid) {
                motion.copy_from_slice((inverse * Vec3::from_column_slice(motion)).as_slice());
            }
        }
        let mut own = Vec::new();
        self.each.iter_mut().all(|(tangent, nodes)| {
            let part = 3 * nodes.start..3 * nodes.end;
            // Of most columns a body has nothing.
            let acts = |column: &[f64]| column[part.clone()].iter().any(|v| *v != 0.0);
            own.clear();
            columns.chunks_exact(count).filter(|c| acts(c)).for_each(|c| own.extend(&c[part.clone()]));
            let is_solved = tangent.solve(&mut own);
            let solved = own.chunks_exact(part.len());
            let acting = columns.chunks_exact_mut(count).filter(|c| acts(c));
            acting.zip(solved).for_each(|(c, own)| c[part.clone()].copy_from_slice(own));
            is_solved
        })
    }

    /// As [`Tangent::take_off_pinned`].
    pub fn take_off_pinned(&self, z: &[Vec3], out: &mut [Vec3]) {
        for (tangent, nodes) in &self.each {
            tangent.take_off_pinned(&z[nodes.clone()], &mut out[nodes.clone()]);
        }
    }

    /// As [`Tangent::take_off_free`].
    pub fn take_off_free(&self, z: &[Vec3], is_free: &[bool], out: &mut [Vec3]) {
        for (tangent, nodes) in &self.each {
            tangent.take_off_free(&z[nodes.clone()], &is_free[nodes.clone()], &mut out[nodes.clone()]);
        }
    }
}
