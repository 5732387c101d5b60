//! Which lattice vertices a closed triangle surface encloses: winding numbers along the lattice's vertical lines.

use super::lattice::Lattice;
use crate::math::Vec3;

/// Lines are moved aside by this part of a cube, so that none meets an edge of a mesh laid out on the same grid; such
/// a line could count a face twice or not at all. Far above the rounding of f64, far below that of the f32 input.
const ASIDE: [f64; 2] = [3.7e-8, 7.3e-8];

/// What is enclosed.
pub(super) struct Scan {
    /// Of each lattice vertex.
    pub is_inside: Vec<bool>,
    /// Whether a place is enclosed more than once: parts of the surface overlap.
    pub overlaps: bool,
}

/// Crossings of one line with the surface: height, and +1 where it enters.
type Crossings = Vec<(f64, i32)>;

/// Winding numbers of all lattice vertices. A surface that crosses itself encloses what any part of it does.
pub(super) fn scan(lattice: &Lattice, vertices: &[Vec3], triangles: &[[u32; 3]]) -> Scan {
    let mut out = Scan { is_inside: vec![false; lattice.vertices()], overlaps: false };
    for (shift, more) in [(0.0, 1), (0.5, 0)] {
        let n = lattice.cubes.map(|n| n + more);
        let mut lines: Vec<Crossings> = vec![Vec::new(); n[0] * n[1]];
        // In cubes from the first line.
        let local = |v: &u32| {
            let x = (vertices[*v as usize] - lattice.origin) / lattice.a;
            Vec3::new(x[0] - shift - ASIDE[0], x[1] - shift - ASIDE[1], x[2] - shift)
        };
        for triangle in triangles {
            cross_lines(&triangle.each_ref().map(local), &n, &mut lines);
        }
        for (line, crossings) in lines.iter_mut().enumerate() {
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (i, j) = (line % n[0], line / n[0]);
            let (mut winding, mut passed) = (0, 0);
            for k in 0..n[2] {
                while passed < crossings.len() && crossings[passed].0 <= k as f64 {
                    winding += crossings[passed].1;
                    passed += 1;
                }
                let vertex = if more == 1 { lattice.corner([i, j, k]) } else { lattice.centre([i, j, k]) };
                out.is_inside[vertex as usize] = winding > 0;
                out.overlaps |= winding > 1;
            }
        }
    }
    out
}

/// Enters where a triangle crosses the lines over it.
fn cross_lines(x: &[Vec3; 3], n: &[usize; 3], lines: &mut [Crossings]) {
    let span = |axis: usize| {
        let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v[axis]), h.max(v[axis])));
        let last = n[axis] as f64 - 1.0;
        (low.ceil().clamp(0.0, last + 1.0) as usize, high.floor().clamp(-1.0, last) as isize)
    };
    let ((i0, i1), (j0, j1)) = (span(0), span(1));
    for j in j0 as isize..=j1 {
        for i in i0 as isize..=i1 {
            let at = [i as f64, j as f64];
            // Twice the signed areas of the line with each edge; the other triangle on it finds the same bits, negative.
            let area = |p: usize, q: usize| {
                (x[p][0] - at[0]) * (x[q][1] - at[1]) - (x[p][1] - at[1]) * (x[q][0] - at[0])
            };
            let w = [area(1, 2), area(2, 0), area(0, 1)];
            let sum = w[0] + w[1] + w[2];
            let all_left = w.iter().all(|w| *w > 0.0);
            if all_left || w.iter().all(|w| *w < 0.0) {
                let height = (w[0] * x[0][2] + w[1] * x[1][2] + w[2] * x[2][2]) / sum;
                lines[j as usize * n[0] + i as usize].push((height, if all_left { -1 } else { 1 }));
            }
        }
    }
}
