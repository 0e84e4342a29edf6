//! The folder of a recording. Only one program at a time may hold a folder, and only files of an earlier recording are
//! removed from it.

use std::ffi::OsStr;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use endowire_core::file::whole;
use endowire_core::{Error, Result};

use crate::arrays::{self, SHAPES};
use crate::coils::COILS;
use crate::injections::INJECTIONS;
use crate::instruments::INSTRUMENTS;
use crate::packing::PACKING;
use crate::steps::STEPS;
use crate::summary::SUMMARY;
use crate::vessel::{PLACES, VESSEL};

/// Start of the first line of the table of steps.
const TABLE_BEGINS: &[u8] = b"step,advance_mm,rotate_rad,";
/// Ends the name of the file that is locked by what records into a folder. The empty file remains afterwards: only the
/// lock counts, and it is released when a program dies.
const LOCK: &str = ".endowire-lock";
/// File names of films, one for each format.
pub const FILMS: [&str; 4] = ["film.gif", "film.png", "film.apng", "film.mp4"];
/// Folder of the frames.
pub(crate) const FRAMES: &str = "frames";
/// Files of a recording, apart from frames and films.
const NAMES: [&str; 9] = [SUMMARY, STEPS, INSTRUMENTS, INJECTIONS, COILS, VESSEL, PLACES, PACKING, SHAPES];

/// The right to record into a folder or a file, until it is dropped.
#[derive(Debug)]
pub struct Claim {
    /// `None` on a file system without locks.
    _lock: Option<File>,
}

/// What a new recording does with a folder of files that are no recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Among {
    /// It refuses such a folder.
    Nothing,
    /// It is recorded there, and replaces files with names of a recording alone.
    OtherFiles,
}

/// What a new recording has replaced.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Replaced {
    /// Whether it was a recording.
    pub recording: bool,
    /// Names of its files.
    pub names: Vec<String>,
}

/// Prepares a folder for a recording: creates it if necessary, locks it, and removes an earlier recording.
pub(crate) fn claim(folder: &Path, among: Among) -> Result<(Claim, Replaced)> {
    // No path is the folder in which the program runs.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let failed = |e: io::Error| Error::file(folder, e);
    // Checked before locking, because the lock would add a file to a folder that is not a recording.
    let recording = is_recording(folder);
    if let (false, Among::Nothing, Some(name)) = (recording, among, first_file(folder)) {
        let reason = format!(
            "the folder is no earlier recording, and a recording would mix with its files ({} …): give a new or an empty \
             folder, such as {}",
            Path::new(&name).display(),
            folder.join("recording").display()
        );
        return Err(Error::content(folder, reason));
    }
    std::fs::create_dir_all(folder).map_err(failed)?;
    let claim = claim_again(folder)?;
    let names = remove_earlier(folder, is_recording(folder)).map_err(failed)?;
    Ok((claim, Replaced { recording, names }))
}

/// Locks the folder of a recording that resumes, and removes what a run that was killed has left unfinished there.
pub(crate) fn claim_again(folder: &Path) -> Result<Claim> {
    let taken = "another run is recording into this folder: wait until it has ended, or give another folder";
    let claim = lock_folder(folder, taken)?;
    let is_ours = |name: &OsStr| NAMES.iter().chain(&FILMS).any(|ours| name == *ours);
    let is_frame = |name: &OsStr| name.to_str().is_some_and(is_frame_name);
    whole::remove_unfinished_in(folder, is_ours)
        .and_then(|()| whole::remove_unfinished_in(&folder.join(FRAMES), is_frame))
        .map_err(|e| Error::file(folder, e))?;
    Ok(claim)
}

/// Locks a folder that exists, for what writes files into it.
///
/// # Errors
/// [`Error::Content`] with `taken` where another program holds it, [`Error::File`] where no file can be written.
pub fn lock_folder(folder: &Path, taken: &str) -> Result<Claim> {
    lock(&folder.join(LOCK), || Error::content(folder, taken))
}

/// Locks a file that is to be written; its folder exists.
///
/// # Errors
/// As [`lock_folder`].
pub fn lock_file(path: &Path, taken: &str) -> Result<Claim> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    lock(&path.with_file_name(format!(".{name}{LOCK}")), || Error::content(path, taken))
}

/// Removes the frames of a recording: those of the remaining steps are drawn again.
pub(crate) fn remove_frames(folder: &Path) -> io::Result<()> {
    frames(&folder.join(FRAMES))?.iter().try_for_each(std::fs::remove_file)
}

fn lock(path: &Path, taken: impl FnOnce() -> Error) -> Result<Claim> {
    let file = OpenOptions::new().create(true).truncate(false).write(true).open(path);
    let file = file.map_err(|e| Error::file(path, e))?;
    match file.try_lock() {
        Ok(()) => Ok(Claim { _lock: Some(file) }),
        Err(TryLockError::WouldBlock) => Err(taken()),
        // Some network file systems have no locks; there the recording runs without one.
        Err(TryLockError::Error(_)) => Ok(Claim { _lock: None }),
    }
}

/// Whether a folder contains a recording of `endowire run`.
pub fn is_recording(folder: &Path) -> bool {
    let begins = File::open(folder.join(STEPS)).and_then(|file| {
        let mut begins = Vec::new();
        file.take(TABLE_BEGINS.len() as u64).read_to_end(&mut begins).map(|_| begins)
    });
    // A recording that was interrupted at once has an empty table or an incomplete first line.
    begins.is_ok_and(|begins| TABLE_BEGINS.starts_with(&begins))
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
        let frames = frames(&folder.join(FRAMES))?;
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
pub fn frame_name(step: usize, view: &str) -> String {
    format!("step_{step:06}_{view}.png")
}

/// Whether [`frame_name`] can give exactly this name.
fn is_frame_name(name: &str) -> bool {
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
        for ours in ["step_000001_3d.png", "step_1234567_fluoro.png", "step_000040_fluoro_b.png"] {
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
        let (first, _) = claim(folder.path(), Among::Nothing).unwrap();
        let refused = claim(folder.path(), Among::OtherFiles).err().unwrap().to_string();
        assert!(refused.contains("another run is recording"), "{refused}");
        drop(first);
        assert!(claim(folder.path(), Among::Nothing).is_ok());
    }

    #[test]
    fn no_path_is_the_folder_in_which_it_runs_and_its_files_stay() {
        let refused = claim(Path::new(""), Among::Nothing).err().unwrap().to_string();
        assert!(refused.contains("would mix with its files"), "{refused}");
    }
}
