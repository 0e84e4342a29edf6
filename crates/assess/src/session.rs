//! The session file of play. It lies beside the script and holds what a script cannot: times, rests and the beam.

use std::path::{Path, PathBuf};

use endowire_core::input::plain;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::record::Record;

/// Content of a `*.session.json`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionFile {
    /// Scene file.
    pub scene_file: PathBuf,
    /// Overridden keys of the scene, `KEY=VALUE`.
    pub set: Vec<String>,
    /// Time of the recording, seconds since 1970-01-01 UTC; `None` if the session's time advances by its inputs
    /// alone, so that its file is the same at any date.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_unix_s: Option<u64>,
    /// The record.
    pub record: Record,
}

impl SessionFile {
    /// Reads a session.
    ///
    /// # Errors
    /// As [`Self::parse`], and a file that cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|error| not_a_session(path, &error))?;
        Self::parse(&bytes, path)
    }

    /// Reads a session from the bytes of its file; `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Content`] if it is not a session, or has an impossible value or an unknown key.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let session: Self = serde_json::from_slice(bytes).map_err(|error| not_a_session(path, &error))?;
        let in_record =
            |error: Error| Error::content(path, format!("record.{error}; record the session again"));
        session.record.check().map_err(in_record)?;
        Ok(session)
    }
}

fn not_a_session(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::content(
        path,
        format!("{}; give a session of endowire play or the folder of a run", plain(&error.to_string())),
    )
}
