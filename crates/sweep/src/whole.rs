//! The writer of files. A file is written under a temporary name of its own and then renamed, so that it is complete or
//! absent, whoever else writes it at the same time.
//!
//! Only regular files are replaced. A device of characters, such as `/dev/null`, is written to, as by any other program;
//! pipes, disks and sockets are refused: a pipe that nobody reads would be waited for without end. Temporary files are new and locked while they are written: no link is followed, and what a killed
//! program leaves can be told from what another is writing.

use std::ffi::{OsStr, OsString};
use std::fs::{File, FileType, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

/// Begin and end of the temporary name of a file: with the file's own name and random letters between them.
const HIDDEN: &str = ".";
const PART: &str = ".part";

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

/// End of a temporary name that has the file's extension, by which some writers choose a format.
fn part_with_extension(path: &Path) -> OsString {
    let mut ends = OsString::from(PART);
    if let Some(extension) = path.extension() {
        ends.push(".");
        ends.push(extension);
    }
    ends
}

/// A new temporary file beside a path, whose name ends so.
fn part_of(path: &Path, ends: &OsStr) -> io::Result<NamedTempFile> {
    let begins = begins(path);
    let mut part = tempfile::Builder::new();
    part.prefix(&begins).suffix(ends);
    #[cfg(unix)]
    {
        // As of a file that is created: the user's mask takes the rest away.
        use std::os::unix::fs::PermissionsExt as _;
        part.permissions(std::fs::Permissions::from_mode(0o666));
    }
    part.tempfile_in(folder(path))
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
    if let Some(kind) = special(path) {
        return write_through(path, kind, |part| write(part.as_file_mut()));
    }
    let mut part = part_of(path, OsStr::new(PART))?;
    // Some network file systems have no locks.
    let _ = part.as_file().try_lock();
    write(part.as_file_mut())?;
    part.as_file().sync_all()?;
    part.persist(path).map_err(|error| error.error)?;
    sync_folder(folder(path));
    Ok(())
}

/// The same for what opens its file by itself: `write` gets the path of an empty file. Nothing is synced: of a film with
/// hundreds of frames that would take most of the time.
///
/// # Errors
/// As [`write()`].
pub fn write_at(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    write_part(path, OsStr::new(PART), write)
}

/// The same for what chooses a format by the extension of its file: that of the empty file is the same.
///
/// # Errors
/// As [`write()`].
pub fn write_in_format(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    write_part(path, &part_with_extension(path), write)
}

fn write_part(path: &Path, ends: &OsStr, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    if let Some(kind) = special(path) {
        return write_through(path, kind, |part| write(part.path()));
    }
    let part = part_of(path, ends)?;
    write(part.path())?;
    part.persist(path).map_err(|error| error.error)?;
    Ok(())
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

/// Writes to a device, which takes what it is given, and is never replaced.
fn write_through(
    path: &Path,
    kind: FileType,
    write: impl FnOnce(&mut NamedTempFile) -> io::Result<()>,
) -> io::Result<()> {
    if !takes_bytes(kind) {
        let what = if kind.is_dir() { "is a folder" } else { "is no regular file" };
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{what}: give the name of a file")));
    }
    // Writers may go back in their file, which no device can.
    let mut whole = NamedTempFile::new()?;
    write(&mut whole)?;
    let mut whole = File::open(whole.path())?;
    let mut place = OpenOptions::new().write(true).open(path)?;
    io::copy(&mut whole, &mut place)?;
    place.flush()
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
    let own = |ends: &str| {
        let (own, random) = hidden.strip_suffix(ends)?.rsplit_once('.')?;
        (!random.is_empty() && random.bytes().all(|letter| letter.is_ascii_alphanumeric()))
            .then_some(OsStr::new(own))
    };
    let with_extension = || {
        let (_, extension) = hidden.rsplit_once('.')?;
        own(&format!("{PART}.{extension}"))
            .filter(|own| Path::new(own).extension() == Some(OsStr::new(extension)))
    };
    own(PART).or_else(with_extension)
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
    fn what_was_left_is_removed_and_what_is_being_written_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for name in [".a.txt.xY3.part", ".a.txt.xY4.part.txt", ".a.txt.part", ".b.txt.xY3.part", "a.txt.part"]
        {
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
