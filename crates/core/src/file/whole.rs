//! The writer of files. A file is written under a temporary name of its own and then renamed, so that it is complete or
//! absent, whoever else writes it at the same time.
//!
//! Only regular files are replaced. A device of characters, such as `/dev/null`, is written to, as by any other program;
//! pipes, disks and sockets are refused: a pipe that nobody reads would be waited for without end. Temporary files are new and locked while they are written: no link is followed, and what a killed
//! program leaves can be distinguished from what another is writing.

use std::ffi::{OsStr, OsString};
use std::fs::{File, FileType, OpenOptions, TryLockError};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, Seek as _, Write};
use std::path::{Path, PathBuf};

/// Begin and end of the temporary name of a file: with the file's own name and random letters between them.
const HIDDEN: &str = ".";
const PART: &str = ".part";
/// Random names that are tried before a folder is given up: two are the same once in four thousand million.
const TRIES: u32 = 100;

/// The folder of a path.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Begin of the temporary names of a file.
fn begins(path: &Path) -> OsString {
    let mut begins = OsString::from(HIDDEN);
    begins.push(path.file_name().unwrap_or_default());
    begins.push(".");
    begins
}

/// A new file in a folder, with random letters in its name. Nothing that is there is opened, and no link followed.
fn new_file(folder: &Path, begins: &OsStr) -> io::Result<(PathBuf, File)> {
    let mut taken = io::Error::from(io::ErrorKind::AlreadyExists);
    for _ in 0..TRIES {
        let random = RandomState::new().build_hasher().finish() as u32;
        let mut name = begins.to_owned();
        name.push(format!("{random:08x}"));
        name.push(PART);
        let path = folder.join(name);
        match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => taken = error,
            opened => return opened.map(|file| (path, file)),
        }
    }
    Err(taken)
}

/// A file that is being written under a temporary name. It gets its own name by [`Part::finish`], and vanishes without
/// that.
#[derive(Debug)]
pub struct Part {
    /// The temporary name; empty once it has its own.
    path: PathBuf,
    file: File,
    place: PathBuf,
    /// Whether the place is a device, which gets the bytes at the end.
    through: bool,
}

impl Part {
    /// Begins a file that will be at `place`.
    ///
    /// # Errors
    /// A folder, a pipe, a disk or a socket in place of the file, and a folder in which no file can be written.
    pub fn new(place: &Path) -> io::Result<Self> {
        let kind = special(place);
        if let Some(kind) = kind.filter(|kind| !takes_bytes(*kind)) {
            let what = if kind.is_dir() { "is a folder" } else { "is no regular file" };
            let text = format!("{what}: give the name of a file");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        let through = kind.is_some();
        // Writers may go back in their file, which no device can.
        let folder = if through { std::env::temp_dir() } else { folder(place).to_owned() };
        let (path, file) = new_file(&folder, &begins(place))?;
        // Some network file systems have no locks.
        let _ = file.try_lock();
        Ok(Self { path, file, place: place.to_owned(), through })
    }

    /// The file.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Gives the file its own name, where it replaces what is there.
    ///
    /// # Errors
    /// A file that cannot be replaced.
    pub fn finish(mut self) -> io::Result<()> {
        if self.through {
            let mut place = OpenOptions::new().write(true).open(&self.place)?;
            self.file.rewind()?;
            io::copy(&mut self.file, &mut place)?;
            return place.flush();
        }
        std::fs::rename(&self.path, &self.place)?;
        self.path = PathBuf::new();
        Ok(())
    }

    /// As [`Self::finish`], and lasting even if the power fails.
    fn finish_synced(self) -> io::Result<()> {
        if self.through {
            return self.finish();
        }
        self.file.sync_all()?;
        let place = self.place.clone();
        self.finish()?;
        sync_folder(folder(&place));
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The kind of what a path leads to, if it is there and no regular file. Links are followed: /dev/stdout is one.
fn special(path: &Path) -> Option<FileType> {
    std::fs::metadata(path).ok().map(|found| found.file_type()).filter(|kind| !kind.is_file())
}

/// Writes a file with `write`, which gets an empty file, and syncs it to disk before it replaces an existing one. A
/// failure leaves what was there before.
///
/// # Errors
/// Those of `write`; a folder, a disk or a socket in place of the file; and a file that cannot be replaced.
pub fn write(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let mut part = Part::new(path)?;
    write(part.file())?;
    part.finish_synced()
}

/// Makes a rename last, where the system can.
fn sync_folder(folder: &Path) {
    #[cfg(unix)]
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    #[cfg(not(unix))]
    let _ = folder;
}

/// Whether it is a device of characters, such as a terminal or /dev/null.
#[cfg(unix)]
fn takes_bytes(kind: FileType) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    kind.is_char_device()
}

#[cfg(not(unix))]
fn takes_bytes(_: FileType) -> bool {
    false
}

/// Whether a path leads to a device or a pipe.
pub fn is_special(path: &Path) -> bool {
    special(path).is_some_and(|kind| !kind.is_dir())
}

/// Removes a file if it exists, but no device and no pipe, which keeps nothing.
///
/// # Errors
/// A file that cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    if is_special(path) {
        return Ok(());
    }
    match std::fs::remove_file(path) {
        // `NotADirectory`: the path leads through something that is not a folder.
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(()),
        other => other,
    }
}

/// Removes what programs that were killed have left of a file, but nothing that is being written.
///
/// # Errors
/// As [`remove_unfinished_in`].
pub fn remove_unfinished(path: &Path) -> io::Result<()> {
    remove_unfinished_in(folder(path), |name| path.file_name() == Some(name))
}

/// The same for all files of a folder whose own names are `ours`.
///
/// # Errors
/// A folder that cannot be read, other than one that does not exist.
pub fn remove_unfinished_in(folder: &Path, ours: impl Fn(&OsStr) -> bool) -> io::Result<()> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => return Ok(()),
        Err(e) => return Err(e),
    };
    for entry in entries {
        let entry = entry?;
        if !whole_name(&entry.file_name()).is_some_and(&ours) || !entry.file_type()?.is_file() {
            continue;
        }
        let path = entry.path();
        let is_written =
            File::open(&path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)));
        if !is_written {
            remove(&path)?;
        }
    }
    Ok(())
}

/// The own name of the file of a temporary name.
fn whole_name(part: &OsStr) -> Option<&OsStr> {
    let hidden = part.to_str()?.strip_prefix(HIDDEN)?;
    let (own, random) = hidden.strip_suffix(PART)?.rsplit_once('.')?;
    let is_random = !random.is_empty() && random.bytes().all(|letter| letter.is_ascii_alphanumeric());
    is_random.then_some(OsStr::new(own))
}

/// Writes a file of these bytes.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, |file| file.write_all(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            names.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_as_a_whole_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"one").unwrap();
        write_bytes(&path, b"two").unwrap();
        let failed = write(&path, |file| {
            file.write_all(b"thr")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.is_err());
        assert_eq!(
            (std::fs::read(&path).unwrap(), names(folder.path())),
            (b"two".to_vec(), vec!["a.txt".into()])
        );
        assert!(write_bytes(folder.path(), b"").unwrap_err().to_string().contains("is a folder"));
    }

    #[test]
    fn savers_at_the_same_time_leave_one_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        let whole = [vec![1; 100_000], vec![2; 300_000]];
        write_bytes(&path, &whole[0]).unwrap();
        std::thread::scope(|scope| {
            for k in 0..4 {
                let (path, bytes) = (&path, &whole[k % 2]);
                scope.spawn(move || (0..25).for_each(|_| write_bytes(path, bytes).unwrap()));
            }
            for _ in 0..50 {
                assert!(whole.contains(&std::fs::read(&path).unwrap()));
            }
        });
        assert_eq!(names(folder.path()), ["a.state"]);
    }

    #[test]
    fn temporary_files_left_behind_are_removed_and_those_in_use_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for name in [".a.txt.xY3.part", ".a.txt.part", ".b.txt.xY3.part", "a.txt.part"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        write(&path, |_| {
            remove_unfinished(&path)?;
            assert_eq!(names(folder.path()).len(), 4, "{:?}", names(folder.path()));
            Ok(())
        })
        .unwrap();
        assert_eq!(names(folder.path()), [".a.txt.part", ".b.txt.xY3.part", "a.txt", "a.txt.part"]);
        remove_unfinished(&folder.path().join("none").join("a")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_are_not_followed_and_devices_are_written_to() {
        use std::os::unix::fs::{FileTypeExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [victim, path] = ["victim", "a.state"].map(|name| folder.path().join(name));
        std::fs::write(&victim, "mine").unwrap();
        symlink(&victim, folder.path().join("a.state.part")).unwrap();
        symlink(&victim, &path).unwrap();
        write_bytes(&path, b"state").unwrap();
        assert_eq!(
            (std::fs::read(&victim).unwrap(), std::fs::read(&path).unwrap()),
            (b"mine".to_vec(), b"state".to_vec())
        );
        // A link to a device is one, too.
        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        write_bytes(&null, b"state").unwrap();
        assert!(std::fs::metadata(&null).unwrap().file_type().is_char_device());
        assert!(is_special(&null) && !is_special(&path) && !is_special(folder.path()));
        assert_eq!(std::fs::read(&null).unwrap(), b"");
        remove(&null).unwrap();
        assert!(null.symlink_metadata().is_ok());
    }
}
