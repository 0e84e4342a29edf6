//! The session file of play. It lies beside the script and holds what a script cannot: times, rests and the beam.

use std::path::PathBuf;

use serde::Serialize;

use crate::record::Record;

/// Content of a `*.session.json`, as read by [`Record::read`].
#[derive(Debug, Serialize)]
pub struct SessionFile {
    /// Scene file.
    pub scene_file: PathBuf,
    /// Overridden keys of the scene, `KEY=VALUE`.
    pub set: Vec<String>,
    /// Time of the recording, seconds since 1970-01-01 UTC; `None` if the session's time advances by its inputs
    /// alone, so that its file is the same at any date.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded_unix_s: Option<u64>,
    /// The record.
    pub record: Record,
}
