//! Recordings in folders that were named on the command line.

use std::path::Path;

use endowire_core::Error;
use endowire_core::insertion::Simulation;
use endowire_recording::{Among, Recorder, Replaced, is_recording};

use super::tell;
use crate::failure::Failure;

/// A failure of what is written into the folder of `--out`.
pub(crate) fn in_folder(error: Error) -> Failure {
    match error {
        Error::File { path, source } => Failure::write(&path, &source),
        Error::Content { .. } => Failure::Input(format!("--out {error}")),
        other => other.into(),
    }
}

/// Starts a recording in a folder, and tells what it replaces; `force` records among other files, too.
pub(crate) fn record_anew(folder: &Path, force: bool, at: &Simulation) -> Result<Recorder, Failure> {
    let among = if force { Among::OtherFiles } else { Among::Nothing };
    let (recorder, Replaced { recording, names }) =
        Recorder::among(folder, among, at).map_err(|error| or_force(in_folder(error)))?;
    if !names.is_empty() {
        let what = if recording { "the earlier recording" } else { "files" };
        tell(format_args!("endowire: replaces {what} in {}: {}", folder.display(), names.join(", ")));
    }
    Ok(recorder)
}

/// Adds the other remedy for a folder with files.
fn or_force(failure: Failure) -> Failure {
    match failure {
        Failure::Input(text) if text.contains("would mix with its files") => {
            Failure::Input(text + ", or --force to record there anyway")
        }
        other => other,
    }
}

/// Refuses a folder that contains a recording: other files would mix with those of the run.
pub(crate) fn refuse_recording(folder: &Path) -> Result<(), Failure> {
    if !is_recording(folder) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "--out {}: holds a recording of endowire run, and these files would mix with its own: give a new folder, such as {}",
        folder.display(),
        folder.join("pictures").display()
    )))
}
