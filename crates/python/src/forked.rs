//! Support for forked processes, as made by Python's `multiprocessing` on Linux. They have the memory of the parent
//! process but only one of its threads, so work given to the other threads would never finish.

use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::ComputationError;

/// The process that imported the module. It uses the global threads of rayon.
static IMPORTED_IN: OnceLock<u32> = OnceLock::new();
/// The threads of a process forked from it, with its process id.
static THREADS: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Stores the current process.
pub(crate) fn imported() {
    IMPORTED_IN.get_or_init(process::id);
}

/// Runs `work` so that its parallel parts use threads of this process.
///
/// # Errors
/// ComputationError if the system provides no threads.
pub(crate) fn on_own_threads<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let own = process::id();
    if IMPORTED_IN.get().is_none_or(|imported| *imported == own) {
        return Ok(work());
    }
    Ok(threads(own)?.install(work))
}

/// Runs `work` on the threads of this process, and meanwhile `watch` on this thread; returns what `watch` does.
///
/// # Errors
/// ComputationError if the system provides no threads.
pub(crate) fn beside_own_threads<'a, T>(
    work: impl FnOnce() + Send + 'a,
    watch: impl FnOnce() -> T,
) -> PyResult<T> {
    let own = process::id();
    let watched = move |scope: &rayon::Scope<'a>| {
        scope.spawn(move |_| work());
        watch()
    };
    if IMPORTED_IN.get().is_none_or(|imported| *imported == own) {
        return Ok(rayon::in_place_scope(watched));
    }
    Ok(threads(own)?.in_place_scope(watched))
}

fn threads(own: u32) -> PyResult<Arc<ThreadPool>> {
    let mut kept = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = kept.as_ref().filter(|(process, _)| *process == own) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool =
        Arc::new(pool.map_err(|e| ComputationError::new_err(format!("threads of a forked process: {e}")))?);
    // Dropping the pool of the parent process would wait for its threads to end.
    std::mem::forget(kept.replace((own, Arc::clone(&pool))));
    Ok(pool)
}
