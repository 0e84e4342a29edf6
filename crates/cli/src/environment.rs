//! Environment of the process that affects libraries.

/// Restarts the program with Mesa's device-select layer disabled if there is no desktop.
///
/// The Vulkan loader puts that layer in front of every driver. It asks the Wayland desktop for its graphics card;
/// without a runtime folder, a library below it prints an error on stderr. Only the layer's variable
/// `NODEVICE_SELECT` disables it, and the environment of a running process cannot be changed safely.
#[cfg(target_os = "linux")]
pub(crate) fn without_desktop() {
    use std::env::{args_os, current_exe, var_os};
    use std::os::unix::process::CommandExt;

    let has_desktop =
        var_os("XDG_RUNTIME_DIR").is_some_and(|folder| std::path::Path::new(&folder).is_absolute());
    if has_desktop || var_os("NODEVICE_SELECT").is_some() {
        return;
    }
    let (Ok(program), Some(name)) = (current_exe(), args_os().next()) else { return };
    // Returns only on failure; then the message appears, and everything else works.
    let _ = std::process::Command::new(program)
        .arg0(name)
        .args(args_os().skip(1))
        .env("NODEVICE_SELECT", "1")
        .exec();
}

/// Does nothing: other systems have no such layer.
#[cfg(not(target_os = "linux"))]
pub(crate) fn without_desktop() {}
