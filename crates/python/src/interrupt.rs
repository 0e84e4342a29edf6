//! Work that Ctrl-C can end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::ComputationError;
use crate::forked::{beside_own_threads, on_own_threads};

/// Interval at which signals are checked.
const PATIENCE: Duration = Duration::from_millis(50);

/// Runs `work` on another thread, with the interpreter released, while this thread checks for signals: for work that
/// takes seconds without a break. After a signal, the thread continues until its work is done, and its result is
/// dropped.
///
/// # Errors
/// The exception raised by the signal handler, `KeyboardInterrupt` for Ctrl-C.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    waited_for(py, None, work)
}

/// As [`interruptible`], for work that checks `stop`: a signal sets it, and the end of the work is awaited.
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

/// Whether a signal handler has raised, on the thread that receives signals. Its exception is kept for the caller,
/// who learns that the step has ended.
pub(crate) fn signalled() -> bool {
    Python::attach(|py| py.check_signals().map_err(|raised| raised.restore(py)).is_err())
}

/// Runs `work` on the threads of parallel work, while this thread checks for signals: a signal sets `stop`, which `work`
/// checks, and the end of the work is awaited. Never call it with the interpreter held.
///
/// # Errors
/// As [`interruptible`].
pub(crate) fn stoppable_beside<T: Send>(stop: &AtomicBool, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let (sender, receiver) = sync_channel(1);
    let watch = move || {
        let mut raised = None;
        loop {
            match receiver.recv_timeout(PATIENCE) {
                Ok(made) => return raised.map_or(Ok(made), Err),
                Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                    raised = Python::attach(|py| py.check_signals()).err();
                    stop.store(raised.is_some(), Ordering::Relaxed);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(ended()),
            }
        }
    };
    // Sending fails only if the watch has ended, which waits for it.
    beside_own_threads(move || drop(sender.send(work())), watch)?
}

fn ended() -> PyErr {
    ComputationError::new_err("the computation ended without a result")
}

fn waited_for<T: Send + 'static>(
    py: Python<'_>,
    stop: Option<&AtomicBool>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, mut receiver) = sync_channel(1);
    thread::Builder::new().name("endowire".to_owned()).spawn(move || {
        // Fails if the receiver is gone after a signal, which does not matter.
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
                    // The result is no longer needed.
                    let _ = py.detach(move || listening.recv());
                }
                return Err(signal);
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(ended());
            }
        }
    }
}
