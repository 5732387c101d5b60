//! Loops over independent things, on several threads if there are several of them. What they
//! compute does not depend on how many threads there are: nothing is summed across them.

/// Calls `f` on every item.
#[cfg(feature = "parallel")]
pub(super) fn for_each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync + Send) {
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
pub(super) fn for_each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync + Send) {
    items.iter_mut().for_each(f);
}
