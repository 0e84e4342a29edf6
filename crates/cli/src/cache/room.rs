//! Size limit of the cache.

use std::ffi::OsStr;
use std::fs::{File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::entry::{EXTENSION, UNFINISHED};
use crate::output::whole;

/// Largest total size of all walls in bytes: some hundreds of walls.
const MOST_BYTES: u64 = 1 << 30;
/// Age after which an unfinished file counts as left by a program that died.
const LEFT_BEHIND: Duration = Duration::from_secs(3600);

/// Marks a wall as used: those unused for the longest time are removed first.
pub(super) fn touch(path: &Path) {
    // On a read-only disk nothing can be removed either.
    let _ = File::options().append(true).open(path).and_then(|file| file.set_modified(SystemTime::now()));
}

/// Makes room for a file of `bytes` bytes. Other files in the folder are left alone.
pub(super) fn make(folder: &Path, bytes: u64) -> io::Result<()> {
    make_within(folder, MOST_BYTES.saturating_sub(bytes))
}

fn make_within(folder: &Path, most_bytes: u64) -> io::Result<()> {
    let now = SystemTime::now();
    let mut walls: Vec<(SystemTime, u64, PathBuf)> = Vec::new();
    for (path, data) in std::fs::read_dir(folder)?.flatten().filter_map(|entry| file(&entry)) {
        let used = data.modified()?;
        if path.extension() == Some(OsStr::new(EXTENSION)) {
            walls.push((used, data.len(), path));
        } else if path.as_os_str().as_encoded_bytes().ends_with(UNFINISHED.as_bytes())
            && now.duration_since(used).is_ok_and(|age| age > LEFT_BEHIND)
        {
            whole::remove(&path)?;
        }
    }
    walls.sort();
    let mut total: u64 = walls.iter().map(|(_, size, _)| size).sum();
    for (_, size, path) in walls {
        if total <= most_bytes {
            break;
        }
        // Another process may have removed it already.
        whole::remove(&path)?;
        total -= size;
    }
    Ok(())
}

fn file(entry: &std::fs::DirEntry) -> Option<(PathBuf, Metadata)> {
    entry.metadata().ok().filter(Metadata::is_file).map(|data| (entry.path(), data))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_that_were_not_used_for_the_longest_time_go_first_and_nothing_else_goes() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, age_s: u64| {
            let path = folder.path().join(name);
            std::fs::write(&path, [0; 100]).unwrap();
            let file = File::options().append(true).open(&path).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age_s)).unwrap();
            path
        };
        let old = put("a.wall", 9000);
        let [older, new] = [put("b.wall", 10_000), put("c.wall", 0)];
        let [left, under_way, foreign] = [put("d.part", 9000), put("e.part", 10), put("notes.txt", 20_000)];
        make_within(folder.path(), 300).unwrap();
        assert!(older.exists() && old.exists() && new.exists());
        assert!(!left.exists() && under_way.exists(), "of a program that died, of one that writes");
        touch(&older);
        make_within(folder.path(), 250).unwrap();
        assert!(older.exists() && !old.exists() && new.exists());
        make_within(folder.path(), 0).unwrap();
        assert!(!older.exists() && !new.exists() && foreign.exists());
    }
}
