//! Files of sessions of play on disk.

use std::path::{Path, PathBuf};

use endowire_assess::SessionFile;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::recording::RecordedSummary;
use super::whole;
use crate::failure::Failure;

/// Where that of a session with this script is.
pub(crate) fn beside(script: &Path) -> PathBuf {
    script.with_extension("session.json")
}

/// Of which scene one is.
pub(crate) fn read_summary(path: &Path) -> Result<RecordedSummary, Failure> {
    #[derive(Deserialize)]
    struct Head {
        scene_file: PathBuf,
        set: Vec<String>,
    }
    let Head { scene_file, set } = head(path)?;
    Ok(RecordedSummary { scene_file, scene_hash: None, set, unconverged_steps: 0, complete: true })
}

/// When one was recorded, seconds since 1970 began in UTC; none where it does not say.
pub(crate) fn recorded_unix_s(path: &Path) -> Result<Option<u64>, Failure> {
    #[derive(Deserialize)]
    struct Head {
        #[serde(default)]
        recorded_unix_s: Option<u64>,
    }
    head::<Head>(path).map(|head| head.recorded_unix_s)
}

/// What of one stands beside its record.
fn head<T: DeserializeOwned>(path: &Path) -> Result<T, Failure> {
    let bad = |e: &dyn std::fmt::Display| {
        Failure::Input(format!(
            "{}: {e}; give a session of endowire play or the folder of a run",
            path.display()
        ))
    };
    let text = std::fs::read(path).map_err(|e| bad(&e))?;
    serde_json::from_slice(&text).map_err(|e| bad(&e))
}

/// Writes it.
pub(crate) fn write(session: &SessionFile, path: &Path) -> Result<(), Failure> {
    let text = serde_json::to_vec(session)
        .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
    whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
}
