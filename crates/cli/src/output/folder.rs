//! The folder of a recording, and the file of a session. Only one run at a time may hold a folder, only one session a
//! file, and only files of an earlier recording are removed from a folder.

use std::ffi::OsStr;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::coils::COILS;
use super::film::FILMS;
use super::injections::INJECTIONS;
use super::instruments::INSTRUMENTS;
use super::packing::PACKING;
use super::vessel::{PLACES, VESSEL};
use super::{SUMMARY, arrays, tell, whole};
use crate::failure::Failure;

/// The table of steps.
pub(crate) const TABLE: &str = "steps.csv";
/// Start of its first line.
const TABLE_BEGINS: &[u8] = b"step,advance_mm,rotate_rad,";
/// Locked by the run that records, and by what draws a data set; by a session, with the name of its script before it. The empty file remains
/// afterwards: only the lock counts, and it is released when a program dies.
const LOCK: &str = ".endowire-lock";
/// Files of a recording, apart from frames and films.
const NAMES: [&str; 9] =
    [SUMMARY, TABLE, INSTRUMENTS, INJECTIONS, COILS, VESSEL, PLACES, PACKING, arrays::PACKED];

/// The right to record into a folder or a file, until it is dropped.
pub(crate) struct Claim {
    /// `None` on a file system without locks.
    _lock: Option<File>,
}

/// Prepares a folder for a recording: creates it if necessary, locks it, and removes an earlier recording, which is
/// reported. A folder with other files is refused unless `force` is set; even then only files with names of a
/// recording are replaced.
pub(crate) fn claim(folder: &Path, force: bool) -> Result<Claim, Failure> {
    let failed = |e: io::Error| Failure::write(folder, &e);
    // Checked before locking, because the lock would add a file to a folder that is not a recording.
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
    let claim = claim_again(folder)?;
    let removed = remove_earlier(folder, is_recording(folder)).map_err(failed)?;
    if !removed.is_empty() {
        let what = if earlier { "the earlier recording" } else { "files" };
        tell(format_args!("endowire: replaces {what} in {}: {}", folder.display(), removed.join(", ")));
    }
    Ok(claim)
}

/// Locks the folder of a recording that resumes, and removes what a run that was killed has left unfinished there.
pub(crate) fn claim_again(folder: &Path) -> Result<Claim, Failure> {
    let claim = lock(&folder.join(LOCK), || {
        let folder = folder.display();
        format!(
            "--out {folder}: another run is recording into this folder: wait until it has ended, or give another folder"
        )
    })?;
    let is_ours = |name: &OsStr| NAMES.iter().chain(&FILMS).any(|ours| name == *ours);
    let is_frame = |name: &OsStr| name.to_str().is_some_and(is_frame_name);
    whole::remove_unfinished_in(folder, is_ours)
        .and_then(|()| whole::remove_unfinished_in(&folder.join("frames"), is_frame))
        .map_err(|e| Failure::write(folder, &e))?;
    Ok(claim)
}

/// Locks the folder of a data set.
pub(crate) fn claim_dataset(folder: &Path) -> Result<Claim, Failure> {
    lock(&folder.join(LOCK), || {
        let folder = folder.display();
        format!(
            "--out {folder}: another endowire dataset is drawing into this folder: wait until it has ended, or give another folder"
        )
    })
}

/// Locks the file of a session's script, whose folder exists.
pub(crate) fn claim_file(script: &Path) -> Result<Claim, Failure> {
    let name = script.file_name().unwrap_or_default().to_string_lossy();
    lock(&script.with_file_name(format!(".{name}{LOCK}")), || {
        let script = script.display();
        format!(
            "--record {script}: another session is being recorded there: wait until it has ended, or give another file"
        )
    })
}

/// Removes the frames of a recording: those of the remaining steps are drawn again.
pub(crate) fn remove_frames(folder: &Path) -> io::Result<()> {
    frames(&folder.join("frames"))?.iter().try_for_each(std::fs::remove_file)
}

fn lock(path: &Path, taken: impl FnOnce() -> String) -> Result<Claim, Failure> {
    let file = OpenOptions::new().create(true).truncate(false).write(true).open(path);
    let file = file.map_err(|e| Failure::write(path, &e))?;
    match file.try_lock() {
        Ok(()) => Ok(Claim { _lock: Some(file) }),
        Err(TryLockError::WouldBlock) => Err(Failure::Input(taken())),
        // Some network file systems have no locks; there the recording runs without one.
        Err(TryLockError::Error(_)) => Ok(Claim { _lock: None }),
    }
}

/// Whether a folder contains a recording of `endowire run`.
pub(crate) fn is_recording(folder: &Path) -> bool {
    let begins = File::open(folder.join(TABLE)).and_then(|file| {
        let mut begins = Vec::new();
        file.take(TABLE_BEGINS.len() as u64).read_to_end(&mut begins).map(|_| begins)
    });
    // A recording that was interrupted at once has an empty table or an incomplete first line.
    begins.is_ok_and(|begins| TABLE_BEGINS.starts_with(&begins))
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

/// Numbers of the steps of a recording, with their end times, s.
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
    // A killed run may leave an incomplete row.
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let rows = csv::Reader::from_reader(text.as_slice()).into_deserialize();
    let times = rows.map(|row| row.map(|row: Row| (row.step, row.time_s)));
    times.collect::<Result<_, _>>().map_err(|e| refuse(e.to_string()))
}

/// A file that the program did not write.
fn first_file(folder: &Path) -> Option<std::ffi::OsString> {
    let names = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.file_name());
    names.filter(|name| !name.to_string_lossy().ends_with(LOCK)).min()
}

/// Removes the files of a recording and returns their names. Frames are removed only if the folder is a recording.
fn remove_earlier(folder: &Path, recording: bool) -> io::Result<Vec<String>> {
    let mut removed = vec![];
    // Films, like frames, are removed only if the folder is a recording.
    let films = FILMS.iter().copied().filter(|_| recording);
    for name in NAMES.into_iter().chain(films) {
        let path = folder.join(name);
        // For a link, this is the link itself and not its target.
        if path.symlink_metadata().is_ok() {
            whole::remove(&path)?;
            removed.push(name.to_owned());
        }
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

/// The frames of a recording, complete or not.
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

/// File name of a frame of a recording.
pub(crate) fn frame_name(step: usize, view: &str) -> String {
    format!("step_{step:06}_{view}.png")
}

/// Whether [`frame_name`] can give exactly this name.
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
