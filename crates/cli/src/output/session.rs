//! Session files of play on disk.

use std::path::{Path, PathBuf};

use super::recording::RecordedSummary;
use super::whole;
use crate::failure::Failure;
use endowire_assess::SessionFile;

/// Path of the session file that belongs to this script.
pub(crate) fn beside(script: &Path) -> PathBuf {
    script.with_extension("session.json")
}

impl RecordedSummary {
    /// The scene of a session.
    pub(crate) fn of_session(session: &SessionFile) -> Self {
        Self { set: session.set.clone(), ..Self::in_scene(&session.scene_file) }
    }
}

/// Writes a session file.
pub(crate) fn write(session: &SessionFile, path: &Path) -> Result<(), Failure> {
    let text = serde_json::to_vec(session)
        .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
    whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
}
