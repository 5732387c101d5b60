//! Shares of surface vertices in the cells of a grid: integrals of their shape functions over the cells, of triangles that are
//! clipped to them [Sutherland & Hodgman 1974].

/// A corner of a clipped triangle: its place in the grid, in cells, and its shares of the triangle's corners.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at: [f64; 2],
    shares: [f64; 3],
}

/// Calls `add` with every cell `[column, row]` that a triangle has a part in, and the integrals of its corners' shape functions over
/// that part, for a triangle of unit area. `corners` are in cells.
pub(super) fn share_out(
    corners: [[f64; 2]; 3],
    cells: [usize; 2],
    mut add: impl FnMut([usize; 2], [f64; 3]),
) {
    let whole = area(&corners.map(|at| Corner { at, shares: [0.0; 3] }));
    if !(whole.abs() > 0.0) {
        return;
    }
    let range = |axis: usize| {
        let values = corners.map(|corner| corner[axis]);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min).floor().max(0.0);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max).ceil();
        least as usize..(most.max(0.0) as usize).min(cells[axis])
    };
    for row in range(1) {
        for column in range(0) {
            let mut polygon: Vec<Corner> = (0..3)
                .map(|k| Corner {
                    at: corners[k],
                    shares: std::array::from_fn(|j| f64::from(u8::from(j == k))),
                })
                .collect();
            for (axis, side) in [(0, column), (1, row)] {
                polygon = clip(&polygon, |at| at[axis] - side as f64);
                polygon = clip(&polygon, |at| side as f64 + 1.0 - at[axis]);
            }
            if let Some(shares) = integral(&polygon, whole) {
                add([column, row], shares);
            }
        }
    }
}

/// The part of a convex polygon where a linear function is not negative.
fn clip(polygon: &[Corner], inside: impl Fn(&[f64; 2]) -> f64) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, to) in polygon.iter().enumerate() {
        let from = &polygon[(k + polygon.len() - 1) % polygon.len()];
        let (a, b) = (inside(&from.at), inside(&to.at));
        if (a < 0.0) != (b < 0.0) {
            let t = a / (a - b);
            let between = |x: f64, y: f64| x + t * (y - x);
            kept.push(Corner {
                at: std::array::from_fn(|i| between(from.at[i], to.at[i])),
                shares: std::array::from_fn(|i| between(from.shares[i], to.shares[i])),
            });
        }
        if b >= 0.0 {
            kept.push(*to);
        }
    }
    kept
}

/// Integrals over a polygon, part of a triangle with the area `whole`: of each triangle of a fan its area, by the mean at its corners.
fn integral(polygon: &[Corner], whole: f64) -> Option<[f64; 3]> {
    let mut sum = [0.0; 3];
    for k in 2..polygon.len() {
        let fan = [polygon[0], polygon[k - 1], polygon[k]];
        let part = area(&fan) / whole;
        for (i, sum) in sum.iter_mut().enumerate() {
            *sum += part * fan.iter().map(|corner| corner.shares[i]).sum::<f64>() / 3.0;
        }
    }
    (sum.iter().sum::<f64>() > 0.0).then_some(sum)
}

fn area(corners: &[Corner; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.at);
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn cells_share_a_triangle_without_rest(c in proptest::array::uniform6(0.0..7.0f64)) {
            let corners = [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]]];
            prop_assume!(area(&corners.map(|at| Corner { at, shares: [0.0; 3] })).abs() > 1e-3);
            let mut sums = [0.0; 3];
            share_out(corners, [7, 7], |_, shares| (0..3).for_each(|k| sums[k] += shares[k]));
            // Each shape function integrates to a third of the area.
            prop_assert!(sums.iter().all(|sum| (sum - 1.0 / 3.0).abs() < 1e-9), "{sums:?}");
        }
    }
}
