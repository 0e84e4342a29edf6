//! A session of play, as those who assess it need it: beside its script, with the times, rests and the beam that a script does not tell.

use std::path::{Path, PathBuf};

use endowire_assess::Record;
use serde::{Deserialize, Serialize};

use super::recording::RecordedSummary;
use super::whole;
use crate::failure::Failure;

/// What stands in it.
#[derive(Debug, Serialize)]
pub(crate) struct SessionFile {
    /// File of the scene.
    pub(crate) scene_file: PathBuf,
    /// What of it was set on the command line.
    pub(crate) set: Vec<String>,
    /// What was done.
    pub(crate) record: Record,
}

impl SessionFile {
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
        let bad = |e: &dyn std::fmt::Display| {
            Failure::Input(format!(
                "{}: {e}; give a session of endowire play or the folder of a run",
                path.display()
            ))
        };
        let text = std::fs::read(path).map_err(|e| bad(&e))?;
        let Head { scene_file, set } = serde_json::from_slice(&text).map_err(|e| bad(&e))?;
        Ok(RecordedSummary { scene_file, scene_hash: None, set, unconverged_steps: 0, complete: true })
    }

    /// Writes it.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let text = serde_json::to_vec(self)
            .map_err(|e| Failure::Computation(format!("the session cannot be written as JSON: {e}")))?;
        whole::write_bytes(path, &text).map_err(|e| Failure::write(path, &e))
    }
}
