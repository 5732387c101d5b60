//! Many worlds, stepped side by side.

use crate::arrays::count;
use crate::errors::{bad_value, without_panic};
use crate::world::{Inner, World, in_turns};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// By process and number of threads: a child of `fork` has no threads of its parent's.
type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

/// Pools of threads that were made.
static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// The process that loaded this module.
static LOADED_BY: OnceLock<u32> = OnceLock::new();

/// Notes the process, when the module is loaded.
pub fn note_process() {
    LOADED_BY.get_or_init(std::process::id);
}

/// Whether this is a child by `fork` of the process that loaded the module: rayon's own threads are the parent's then, and
/// whoever waits for them waits for ever.
pub fn is_forked() -> bool {
    LOADED_BY.get() != Some(&std::process::id())
}

/// A pool of so many threads, or of as many as there are processors.
pub fn pool(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_default();
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Ok(pool.clone());
    }
    let made = ThreadPoolBuilder::new().num_threads(threads).build();
    let made = Arc::new(made.map_err(|error| PyRuntimeError::new_err(error.to_string()))?);
    pools.insert(key, made.clone());
    Ok(made)
}

/// Steps all worlds `n` times, on several threads: as many as there are processors unless told.
///
/// Other threads of Python run meanwhile; Ctrl-C is heard between steps. Each world ends with the bits that it would have alone.
#[pyfunction]
#[pyo3(signature = (worlds, n = 1, threads = None))]
pub fn step_all(py: Python<'_>, worlds: Vec<Bound<'_, World>>, n: i64, threads: Option<i64>) -> PyResult<()> {
    let n = count("n", n)?;
    if let Some(threads) = threads.filter(|threads| *threads < 1) {
        return Err(bad_value(format!("threads is {threads}, but must be at least 1")));
    }
    // Locked in one order, so that two calls cannot wait for one another.
    let mut all: Vec<&World> = worlds.iter().map(Bound::get).collect();
    all.sort_by_key(|world| std::ptr::from_ref::<World>(world));
    if let Some(place) = all.windows(2).position(|pair| std::ptr::eq(pair[0], pair[1])) {
        let first = worlds.iter().position(|world| std::ptr::eq(world.get(), all[place])).unwrap_or(0);
        return Err(bad_value(format!("worlds[{first}] is there twice")));
    }
    let pool = pool(threads.map(|threads| threads as usize))?;
    in_turns(py, n, |n| {
        let results: Vec<PyResult<()>> = py.detach(|| {
            let mut locked: Vec<_> = all.iter().map(|world| world.lock_detached()).collect();
            let mut inner: Vec<&mut Inner> = locked.iter_mut().map(|guard| &mut **guard).collect();
            let step = |inner: &mut &mut Inner| without_panic(|| inner.step(n));
            pool.install(|| inner.par_iter_mut().with_max_len(1).map(step).collect())
        });
        results.into_iter().collect()
    })
}
