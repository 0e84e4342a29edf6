//! Processes that were forked, as `multiprocessing` of Python makes them on Linux: they have the memory of the process that they come from and one of
//! its threads. What is given to threads that are not there would be waited for without end.

use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::ComputationError;

/// The process that has imported the module: its threads are rayon's own, of which there is one set.
static IMPORTED_IN: OnceLock<u32> = OnceLock::new();
/// The threads of a process that was forked from it, by its number.
static THREADS: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Notes the process.
pub(crate) fn imported() {
    IMPORTED_IN.get_or_init(process::id);
}

/// Does `work` where what it divides goes to threads of this process.
///
/// # Errors
/// ComputationError where the system gives no threads.
pub(crate) fn on_own_threads<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let own = process::id();
    if IMPORTED_IN.get().is_none_or(|imported| *imported == own) {
        return Ok(work());
    }
    Ok(threads(own)?.install(work))
}

fn threads(own: u32) -> PyResult<Arc<ThreadPool>> {
    let mut kept = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = kept.as_ref().filter(|(process, _)| *process == own) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool =
        Arc::new(pool.map_err(|e| ComputationError::new_err(format!("threads of a forked process: {e}")))?);
    // That of another process would wait for its threads to end.
    std::mem::forget(kept.replace((own, Arc::clone(&pool))));
    Ok(pool)
}
