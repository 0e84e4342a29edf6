//! What can go wrong, said so that the reader knows which input to change.

use std::path::{Path, PathBuf};

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Every error of the core names the thing at fault, its value where there is one, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file was read, but its content is not usable.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong and where, with a hint to mend it.
        reason: String,
    },
    /// A value is out of its range or contradicts another.
    #[error("{name} = {value}: {mend}")]
    Parameter {
        /// The parameter, as the user writes it (`device.radius_mm`).
        name: String,
        /// The value given.
        value: String,
        /// What would be right.
        mend: String,
    },
    /// A surface mesh cannot serve as a vessel wall.
    #[error("mesh: {0}")]
    Mesh(String),
    /// A computation did not reach its result.
    #[error("{0}")]
    Computation(String),
}

impl Error {
    /// A [`Error::Parameter`] from anything printable.
    pub fn parameter(
        name: impl Into<String>,
        value: impl std::fmt::Display,
        mend: impl Into<String>,
    ) -> Self {
        Self::Parameter { name: name.into(), value: value.to_string(), mend: mend.into() }
    }

    /// A [`Error::File`] for `path`.
    pub fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File { path: path.to_path_buf(), source }
    }

    /// A [`Error::Content`] for `path`.
    pub fn content(path: &Path, reason: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Whether the input is at fault (as opposed to a computation that failed on good input).
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Computation(_))
    }
}
