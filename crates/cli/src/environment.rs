//! What the surroundings of the process say to libraries below us.

/// Starts the program anew with Mesa's device-select layer off, where no desktop is there to select for.
///
/// The Vulkan loader puts that layer in front of every driver. It asks the Wayland desktop for its graphics card, and without
/// a runtime folder a library below it prints an error on stderr. Only its variable, `NODEVICE_SELECT`, keeps it out, and the
/// environment of a running process cannot be changed safely.
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
    // Comes back only where it fails; then the message stays, and all else works.
    let _ = std::process::Command::new(program)
        .arg0(name)
        .args(args_os().skip(1))
        .env("NODEVICE_SELECT", "1")
        .exec();
}

/// Nothing to do: other systems have no such layer.
#[cfg(not(target_os = "linux"))]
pub(crate) fn without_desktop() {}
