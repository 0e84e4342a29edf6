//! Failures of commands and their exit codes.

use std::fmt;
use std::path::Path;
use std::process::ExitCode;

/// A failure that ends a command.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Bad input or usage: exit code 2.
    Input(String),
    /// The computation failed on valid input: exit code 1.
    Computation(String),
}

impl Failure {
    /// 2 for bad input, 1 for a failed computation (0 is success, by `main`).
    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Input(_) => 2,
            Self::Computation(_) => 1,
        })
    }

    /// The same failure, prefixed with its place.
    pub(crate) fn at(self, place: impl fmt::Display) -> Self {
        match self {
            Self::Input(text) => Self::Input(format!("{place}: {text}")),
            Self::Computation(text) => Self::Computation(format!("{place}: {text}")),
        }
    }

    /// The same failure as a computation error: no other input would have avoided it.
    pub(crate) fn into_computation(self) -> Self {
        Self::Computation(self.to_string())
    }

    /// An output file or folder that cannot be written.
    pub(crate) fn write(path: &Path, error: &std::io::Error) -> Self {
        Self::Input(format!("cannot write {}: {error}", path.display()))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Computation(text) => f.write_str(text),
        }
    }
}

impl From<endowire_core::Error> for Failure {
    fn from(error: endowire_core::Error) -> Self {
        if error.is_input() { Self::Input(error.to_string()) } else { Self::Computation(error.to_string()) }
    }
}
