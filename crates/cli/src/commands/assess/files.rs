//! Finds sessions: session files, folders of runs, and folders that contain sessions.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use endowire_recording::STEPS;

use crate::failure::Failure;

/// Ending of session files.
const ENDING: &str = ".session.json";

/// The sessions in the order given; those of a folder sorted by name. One that is given more than once, as by its name
/// and by its folder, is one session.
pub(super) fn of(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut all = vec![];
    for path in named {
        if !path.is_dir() || path.join(STEPS).exists() {
            // The reader reports what is wrong with it.
            all.push(path.clone());
            continue;
        }
        let within = sessions_in(path)?;
        if within.is_empty() {
            return Err(Failure::Input(format!(
                "{}: holds neither a run ({STEPS}) nor sessions (*{ENDING}): give the folder of endowire run, or a session of endowire play",
                path.display()
            )));
        }
        all.extend(within);
    }
    let mut seen = BTreeSet::new();
    all.retain(|path| seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())));
    Ok(all)
}

fn sessions_in(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let unreadable = |e: std::io::Error| Failure::Input(format!("{}: {e}: name a folder", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(unreadable)?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>().map_err(unreadable)?;
    paths.retain(|path| path.to_string_lossy().ends_with(ENDING));
    paths.sort();
    Ok(paths)
}

/// The file whose bytes identify a session.
pub(super) fn content(session: &Path) -> PathBuf {
    if session.is_dir() { session.join(STEPS) } else { session.to_path_buf() }
}
