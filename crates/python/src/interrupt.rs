//! Work that Ctrl-C ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::ComputationError;
use crate::forked::on_own_threads;

/// How long a signal waits at most.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does `work` on a thread of its own, without the interpreter, while this one looks for signals: for what takes seconds in one piece. After a
/// signal the thread ends when its work is done, and nobody hears of it.
///
/// # Errors
/// What the signal's handler raises, `KeyboardInterrupt` for Ctrl-C.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    waited_for(py, None, work)
}

/// As [`interruptible`], for work that looks at `stop`: after a signal that is set, and the end of the work is waited for.
///
/// # Errors
/// As [`interruptible`].
pub(crate) fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    stop: &AtomicBool,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    waited_for(py, Some(stop), work)
}

fn waited_for<T: Send + 'static>(
    py: Python<'_>,
    stop: Option<&AtomicBool>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, mut receiver) = sync_channel(1);
    thread::Builder::new().name("endowire".to_owned()).spawn(move || {
        // Nobody may listen after a signal.
        let _ = sender.send(on_own_threads(work));
    })?;
    loop {
        let listening = &mut receiver;
        match py.detach(move || listening.recv_timeout(PATIENCE)) {
            Ok(made) => return made,
            Err(RecvTimeoutError::Timeout) => {
                let Err(signal) = py.check_signals() else { continue };
                if let Some(stop) = stop {
                    stop.store(true, Ordering::Relaxed);
                    let listening = &mut receiver;
                    // What it made is not wanted any more.
                    let _ = py.detach(move || listening.recv());
                }
                return Err(signal);
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(ComputationError::new_err("the computation ended without a result"));
            }
        }
    }
}
