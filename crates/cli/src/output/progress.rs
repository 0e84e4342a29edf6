//! Progress bars, on a terminal only.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps on stderr; invisible if stderr is not a terminal.
pub(crate) fn bar(length: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(length as u64).with_prefix(what);
    if let Ok(style) =
        ProgressStyle::with_template("{prefix} {bar:30} {pos}/{len} {msg} [{elapsed}, {eta} left]")
    {
        bar.set_style(style);
    }
    bar
}

/// A sign on stderr that something without a known number of steps goes on; invisible if stderr is not a terminal.
pub(crate) fn waiting(what: &'static str) -> ProgressBar {
    /// Time between two of its pictures.
    const TICK: Duration = Duration::from_millis(120);
    let sign = ProgressBar::new_spinner().with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]") {
        sign.set_style(style);
    }
    sign.enable_steady_tick(TICK);
    sign
}

/// An invisible bar.
pub(crate) fn hidden() -> ProgressBar {
    ProgressBar::hidden()
}
