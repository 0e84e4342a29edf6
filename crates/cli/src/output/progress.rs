//! Progress bars, on a terminal only.

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

/// An invisible bar.
pub(crate) fn hidden() -> ProgressBar {
    ProgressBar::hidden()
}
