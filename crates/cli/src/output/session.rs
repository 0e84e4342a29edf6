//! Session files of play on disk.

use std::path::{Path, PathBuf};

use super::whole;
use crate::failure::Failure;
use endowire_assess::SessionFile;
use endowire_recording::About;

/// Path of the session file that belongs to this script.
pub(crate) fn beside(script: &Path) -> PathBuf {
    script.with_extension("session.json")
}

/// The scene of a session.
pub(crate) fn about(session: &SessionFile) -> About {
    About { set: session.set.clone(), ..About::in_scene(&session.scene_file) }
}

/// Writes a session file.
pub(crate) fn write(session: &SessionFile, path: &Path) -> Result<(), Failure> {
    let text = serde_json::to_vec(session)
        .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
    whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
}
