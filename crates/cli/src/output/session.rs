//! Session files of play on disk.

use std::path::{Path, PathBuf};

use endowire_assess::SessionFile;
use serde::Deserialize;

use super::recording::RecordedSummary;
use super::whole;
use crate::failure::Failure;

/// Path of the session file that belongs to this script.
pub(crate) fn beside(script: &Path) -> PathBuf {
    script.with_extension("session.json")
}

/// Scene of a session, and time of its recording, seconds since 1970-01-01 UTC, if given.
pub(crate) fn read_head(path: &Path) -> Result<(RecordedSummary, Option<u64>), Failure> {
    #[derive(Deserialize)]
    struct Head {
        scene_file: PathBuf,
        set: Vec<String>,
        #[serde(default)]
        recorded_unix_s: Option<u64>,
    }
    let bad = |e: &dyn std::fmt::Display| {
        Failure::Input(format!(
            "{}: {e}; give a session of endowire play or the folder of a run",
            path.display()
        ))
    };
    let text = std::fs::read(path).map_err(|e| bad(&e))?;
    let Head { scene_file, set, recorded_unix_s } = serde_json::from_slice(&text).map_err(|e| bad(&e))?;
    let summary = RecordedSummary { scene_file, scene_hash: None, set, unconverged_steps: 0, complete: true };
    Ok((summary, recorded_unix_s))
}

/// Writes a session file.
pub(crate) fn write(session: &SessionFile, path: &Path) -> Result<(), Failure> {
    let text = serde_json::to_vec(session)
        .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
    whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
}
