//! The folder of a recording: held by one run at a time, and emptied of an earlier recording and of nothing else.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::coils::COILS;
use super::film::FILMS;
use super::injections::INJECTIONS;
use super::instruments::INSTRUMENTS;
use super::packing::PACKING;
use super::{SUMMARY, arrays, tell, whole};
use crate::failure::Failure;

/// The table of steps.
pub(crate) const TABLE: &str = "steps.csv";
/// How it begins.
const TABLE_BEGINS: &[u8] = b"step,advance_mm,rotate_rad,";
/// Held by the run that records. The file stays, empty: what counts is who holds it, and a program that dies lets go of it.
const LOCK: &str = ".endowire-lock";

/// The right to record into a folder, until it is dropped.
pub(crate) struct Claim {
    /// None on a file system that knows no locks.
    _lock: Option<File>,
}

/// Makes a folder ready for a recording: makes it if it is not there, keeps other runs out, and takes an earlier recording away, which
/// is said. A folder with other files is refused unless `force` is set; then only files of a recording's names are replaced.
pub(crate) fn claim(folder: &Path, force: bool) -> Result<Claim, Failure> {
    let failed = |e: io::Error| Failure::write(folder, &e);
    // Before the lock, which would be one more file in a folder that is none of ours.
    let earlier = is_recording(folder);
    if let (false, false, Some(name)) = (earlier, force, first_file(folder)) {
        return Err(Failure::Input(format!(
            "--out {}: the folder is no earlier recording, and a recording would mix with its files ({} …): give a new or an \
             empty folder, such as {}, or --force to record there anyway",
            folder.display(),
            Path::new(&name).display(),
            folder.join("recording").display()
        )));
    }
    std::fs::create_dir_all(folder).map_err(failed)?;
    let claim = lock(folder)?;
    let removed = remove_earlier(folder, is_recording(folder)).map_err(failed)?;
    if !removed.is_empty() {
        let what = if earlier { "the earlier recording" } else { "files" };
        tell(format_args!("endowire: replaces {what} in {}: {}", folder.display(), removed.join(", ")));
    }
    Ok(claim)
}

/// Holds the folder of a recording that goes on.
pub(crate) fn claim_again(folder: &Path) -> Result<Claim, Failure> {
    lock(folder)
}

/// Removes the frames of a recording: those of the steps that stay are drawn again.
pub(crate) fn remove_frames(folder: &Path) -> io::Result<()> {
    frames(&folder.join("frames"))?.iter().try_for_each(std::fs::remove_file)
}

fn lock(folder: &Path) -> Result<Claim, Failure> {
    let path = folder.join(LOCK);
    let file = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
    let file = file.map_err(|e| Failure::write(&path, &e))?;
    match file.try_lock() {
        Ok(()) => Ok(Claim { _lock: Some(file) }),
        Err(TryLockError::WouldBlock) => Err(Failure::Input(format!(
            "--out {}: another run is recording into this folder: wait until it has ended, or give another folder",
            folder.display()
        ))),
        // Some network file systems have no locks: better a recording without than none.
        Err(TryLockError::Error(_)) => Ok(Claim { _lock: None }),
    }
}

/// Whether `endowire run` has recorded into a folder.
pub(crate) fn is_recording(folder: &Path) -> bool {
    let begins = File::open(folder.join(TABLE)).and_then(|file| {
        let mut begins = Vec::new();
        file.take(TABLE_BEGINS.len() as u64).read_to_end(&mut begins).map(|_| begins)
    });
    // A recording that was ended at once has an empty table, or the beginning of its first line.
    begins.is_ok_and(|begins| TABLE_BEGINS.starts_with(&begins))
}

/// Numbers of the steps of a recording, and the times at which they end, s.
pub(crate) fn step_times(folder: &Path) -> Result<Vec<(usize, f64)>, Failure> {
    #[derive(serde::Deserialize)]
    struct Row {
        step: usize,
        time_s: f64,
    }
    let path = folder.join(TABLE);
    let refuse = |what: String| {
        Failure::Input(format!(
            "{}: {what}; give the folder of a recorded run (endowire run)",
            path.display()
        ))
    };
    let mut text = std::fs::read(&path).map_err(|e| refuse(e.to_string()))?;
    // A run may have been killed within a row.
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let rows = csv::Reader::from_reader(text.as_slice()).into_deserialize();
    let times = rows.map(|row| row.map(|row: Row| (row.step, row.time_s)));
    times.collect::<Result<_, _>>().map_err(|e| refuse(e.to_string()))
}

/// A file that is not ours.
fn first_file(folder: &Path) -> Option<std::ffi::OsString> {
    let names = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.file_name());
    names.filter(|name| name != LOCK).min()
}

/// Removes what a recording is made of, and tells its names. Frames are ours in a recording alone.
fn remove_earlier(folder: &Path, recording: bool) -> io::Result<Vec<String>> {
    let mut removed = vec![];
    // A film is ours in a recording alone, as frames are.
    let films = FILMS.iter().copied().filter(|_| recording);
    for name in
        [SUMMARY, TABLE, INSTRUMENTS, INJECTIONS, COILS, PACKING, arrays::PACKED].into_iter().chain(films)
    {
        let path = folder.join(name);
        // Not the end of a link: a link itself is replaced.
        if path.symlink_metadata().is_ok() {
            whole::remove(&path)?;
            removed.push(name.to_owned());
        }
        whole::remove(&whole::unfinished(&path))?;
    }
    if recording {
        let growing = folder.join(arrays::GROWING);
        if growing.is_dir() {
            arrays::remove_growing(&growing)?;
            removed.push(format!("{}/", arrays::GROWING));
        }
        let frames = frames(&folder.join("frames"))?;
        for frame in &frames {
            std::fs::remove_file(frame)?;
        }
        match frames.len() {
            0 => {}
            1 => removed.push("1 frame".to_owned()),
            n => removed.push(format!("{n} frames")),
        }
    }
    Ok(removed)
}

/// The frames of a recording, whole or not.
fn frames(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(vec![]) };
    let mut frames = vec![];
    for entry in entries {
        let entry = entry?;
        let is_frame = entry.file_name().to_str().is_some_and(is_frame_name);
        if is_frame && entry.file_type()?.is_file() {
            frames.push(entry.path());
        }
    }
    Ok(frames)
}

/// The name of a frame of a recording.
pub(crate) fn frame_name(step: usize, view: &str) -> String {
    format!("step_{step:06}_{view}.png")
}

/// Whether [`frame_name`] gives this name, and no name that only looks like it.
fn is_frame_name(name: &str) -> bool {
    let name = name.strip_suffix(".part").unwrap_or(name);
    let Some((digits, view)) = name.strip_prefix("step_").and_then(|rest| rest.split_once('_')) else {
        return false;
    };
    let view = view.strip_suffix(".png").filter(|view| ["3d", "fluoro", "fluoro_b"].contains(view));
    view.zip(digits.parse().ok()).is_some_and(|(view, step)| frame_name(step, view) == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_frames_are_names_of_frames() {
        for ours in [
            "step_000001_3d.png",
            "step_1234567_fluoro.png",
            "step_000040_fluoro.png.part",
            "step_000040_fluoro_b.png",
        ] {
            assert!(is_frame_name(ours), "{ours}");
        }
        for theirs in
            ["step_by_step.png", "step_1_3d.png", "step_000001_both.png", "step_000001_3d.png.bak", "my.png"]
        {
            assert!(!is_frame_name(theirs), "{theirs}");
        }
    }

    #[test]
    fn a_folder_is_held_by_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = claim(folder.path(), false).unwrap();
        let refused = claim(folder.path(), true).err().unwrap().to_string();
        assert!(refused.contains("another run is recording"), "{refused}");
        drop(first);
        assert!(claim(folder.path(), false).is_ok());
    }
}
