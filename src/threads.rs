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

/// Calls `f` with the place and an item; on several threads if the items are `large`.
pub(crate) fn for_each_item<T: Send>(items: &mut [T], large: bool, f: impl Fn(usize, &mut T) + Sync + Send) {
    // Companions without a size take no memory.
    let mut none = vec![(); items.len()];
    for_each_pair(items, &mut none, large, |place, item, ()| f(place, item));
}

/// Calls `f` with the place, an item and its companion; on several threads if the items are `large`.
#[cfg(feature = "parallel")]
pub(crate) fn for_each_pair<A: Send, B: Send>(
    items: &mut [A],
    companions: &mut [B],
    large: bool,
    f: impl Fn(usize, &mut A, &mut B) + Sync + Send,
) {
    use rayon::prelude::*;
    if large && items.len() > 1 {
        let pairs = items.par_iter_mut().zip(companions).enumerate();
        pairs.for_each(|(place, (item, companion))| f(place, item, companion));
    } else {
        each_pair(items, companions, f);
    }
}

/// Calls `f` with the place, an item and its companion.
#[cfg(not(feature = "parallel"))]
pub(crate) fn for_each_pair<A: Send, B: Send>(
    items: &mut [A],
    companions: &mut [B],
    _large: bool,
    f: impl Fn(usize, &mut A, &mut B) + Sync + Send,
) {
    each_pair(items, companions, f);
}

fn each_pair<A, B>(items: &mut [A], companions: &mut [B], f: impl Fn(usize, &mut A, &mut B)) {
    let pairs = items.iter_mut().zip(companions).enumerate();
    pairs.for_each(|(place, (item, companion))| f(place, item, companion));
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
