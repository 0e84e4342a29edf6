//! The program under test.

use std::process::Command;

/// `endowire`, with a cache of walls that is the tests' and not the user's.
pub(crate) fn endowire() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_endowire"));
    command.env("ENDOWIRE_CACHE", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    command
}
