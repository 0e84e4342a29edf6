//! The file of a session of play: beside its script, with the times, rests and the beam that a script does not tell.

use std::path::PathBuf;

use serde::Serialize;

use crate::record::Record;

/// What stands in a `*.session.json`, which [`Record::read`] reads.
#[derive(Debug, Serialize)]
pub struct SessionFile {
    /// File of the scene.
    pub scene_file: PathBuf,
    /// What of it was set, `KEY=VALUE`.
    pub set: Vec<String>,
    /// When it was recorded, seconds since 1970 began in UTC; none of one in which time goes by as inputs say: it is the same at any time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded_unix_s: Option<u64>,
    /// What was done.
    pub record: Record,
}
