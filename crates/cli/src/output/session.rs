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

/// Scene of a session, and time of its recording, seconds since 1970-01-01 UTC, if given.
pub(crate) fn read_head(path: &Path) -> Result<(RecordedSummary, Option<u64>), Failure> {
    let SessionFile { scene_file, set, recorded_unix_s, .. } = SessionFile::read(path)?;
    let summary = RecordedSummary {
        scene_file,
        scene: None,
        script_file: None,
        scene_hash: None,
        set,
        unconverged_steps: 0,
        complete: true,
    };
    Ok((summary, recorded_unix_s))
}

/// Writes a session file.
pub(crate) fn write(session: &SessionFile, path: &Path) -> Result<(), Failure> {
    let text = serde_json::to_vec(session)
        .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
    whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
}
