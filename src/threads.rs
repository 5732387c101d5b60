//! Loops over independent things, on several threads if there are several of them. What they
//! compute does not depend on how many threads there are: nothing is summed across them.

/// Calls `f` on every item.
#[cfg(feature = "parallel")]
pub(crate) fn for_each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync + Send) {
    use rayon::prelude::*;
    match items {
        // One item is not worth waking a thread.
        [] => {}
        [one] => f(one),
        many => many.par_iter_mut().with_max_len(1).for_each(f),
    }
}

/// Calls `f` on every item.
#[cfg(not(feature = "parallel"))]
pub(crate) fn for_each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync + Send) {
    items.iter_mut().for_each(f);
}

/// Calls `f` with the place and the values of every part of `values`: part k goes from `ends[k]` to `ends[k + 1]`.
#[cfg(feature = "parallel")]
pub(crate) fn for_each_part<T: Send>(
    values: &mut [T],
    ends: &[usize],
    f: &(impl Fn(usize, &mut [T]) + Sync),
) {
    split(values, ends, 0, f);
}

/// Calls `f` with the place and the values of every part of `values`: part k goes from `ends[k]` to `ends[k + 1]`.
#[cfg(not(feature = "parallel"))]
pub(crate) fn for_each_part<T: Send>(
    values: &mut [T],
    ends: &[usize],
    f: &(impl Fn(usize, &mut [T]) + Sync),
) {
    each_part(values, ends, 0, f);
}

/// Values of a part that is not worth waking a thread for.
#[cfg(feature = "parallel")]
const LITTLE: usize = 4096;

#[cfg(feature = "parallel")]
fn split<T: Send>(values: &mut [T], ends: &[usize], first: usize, f: &(impl Fn(usize, &mut [T]) + Sync)) {
    let parts = ends.len().saturating_sub(1);
    if parts < 2 || values.len() < LITTLE {
        return each_part(values, ends, first, f);
    }
    let middle = ends[..parts].partition_point(|&end| end < ends[0] + values.len() / 2).clamp(1, parts - 1);
    let (below, above) = values.split_at_mut(ends[middle] - ends[0]);
    rayon::join(
        || split(below, &ends[..=middle], first, f),
        || split(above, &ends[middle..], first + middle, f),
    );
}

fn each_part<T>(values: &mut [T], ends: &[usize], first: usize, f: &impl Fn(usize, &mut [T])) {
    let mut rest = values;
    for (k, window) in ends.windows(2).enumerate() {
        let (part, others) = rest.split_at_mut(window[1] - window[0]);
        f(first + k, part);
        rest = others;
    }
}

#[cfg(test)]
mod tests {
    use super::for_each_part;

    #[test]
    fn parts_are_what_their_ends_say() {
        // Empty parts, a large one, and many small ones.
        let mut ends = vec![0, 0, 5, 9000, 9000];
        ends.extend((9001..9050).chain([20_000]));
        let mut values = vec![usize::MAX; 20_000];
        for_each_part(&mut values, &ends, &|k, part| part.fill(k));
        for (k, window) in ends.windows(2).enumerate() {
            assert!(values[window[0]..window[1]].iter().all(|v| *v == k));
        }
    }
}
