//! Lists the files that a command has written into a folder. The list is kept in the folder, so that the next call
//! replaces these files and no others.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use super::whole::{remove, remove_unfinished_in};

/// The list of a running call.
pub(crate) struct Manifest {
    folder: PathBuf,
    path: PathBuf,
    file: File,
    names: BTreeSet<String>,
}

impl Manifest {
    /// Begins a list for `command` in `folder`. Files from an earlier call are removed, and their number is returned.
    pub(crate) fn begin(folder: &Path, command: &str) -> io::Result<(Self, usize)> {
        let path = folder.join(format!(".endowire-{command}"));
        let mut removed = 0;
        for file in listed(&path, folder) {
            if file.symlink_metadata().is_ok() {
                remove(&file)?;
                removed += 1;
            }
        }
        // What a call that was killed was writing.
        let names: BTreeSet<OsString> =
            listed(&path, folder).iter().filter_map(|file| Some(file.file_name()?.to_owned())).collect();
        remove_unfinished_in(folder, |name| names.contains(name))?;
        remove(&path)?;
        // A new file: no link is followed.
        let file = OpenOptions::new().write(true).create_new(true).open(&path)?;
        Ok((Self { folder: folder.to_owned(), path, file, names: BTreeSet::new() }, removed))
    }

    /// Whether the list was not removed or replaced: an open file still accepts writes after it has been deleted.
    pub(crate) fn is_there(&self) -> bool {
        let own = self.file.metadata().map(|own| own.len());
        let there = self.path.metadata().map(|there| there.len());
        own.ok().zip(there.ok()).is_some_and(|(own, there)| own == there)
    }

    /// Adds a file of the folder to the list; call this before writing the file, otherwise a killed call would leave
    /// it for ever. Refuses the name of an existing file that was not written by an earlier call.
    pub(crate) fn add(&mut self, name: &str) -> io::Result<()> {
        if self.names.contains(name) {
            return Ok(());
        }
        if self.folder.join(name).symlink_metadata().is_ok() {
            let text = format!(
                "{name} is there already, and no earlier call of this command has written it: move it, or give another folder"
            );
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
        self.file.write_all(format!("{name}\n").as_bytes())?;
        self.names.insert(name.to_owned());
        Ok(())
    }
}

/// The files of a list that lie directly in the folder.
fn listed(path: &Path, folder: &Path) -> Vec<PathBuf> {
    let Ok(text) = std::fs::read_to_string(path) else { return vec![] };
    let is_name = |line: &&str| {
        let mut parts = Path::new(*line).components();
        matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None))
    };
    text.lines().filter(is_name).map(|name| folder.join(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listed_and_nothing_else_is_removed() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().join("inner");
        std::fs::create_dir(&folder).unwrap();
        let (mut manifest, removed) = Manifest::begin(&folder, "render").unwrap();
        assert_eq!(removed, 0);
        for name in ["a.png", "b.png", "../outside.png", "gone.png"] {
            manifest.add(name).unwrap();
        }
        for name in ["a.png", "b.png", "../outside.png", "mine.png"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        // Each command has its own list.
        assert_eq!(Manifest::begin(&folder, "fluoro").unwrap().1, 0);
        assert_eq!(Manifest::begin(&folder, "render").unwrap().1, 2);
        assert!(!folder.join("a.png").exists());
        assert!(folder.join("mine.png").exists() && outer.path().join("outside.png").exists());
        // Files of others are not overwritten, and the attempt does not put them on the list.
        let (mut manifest, _) = Manifest::begin(&folder, "render").unwrap();
        assert!(manifest.add("a.png").is_ok() && manifest.add("a.png").is_ok(), "the twin");
        assert_eq!(manifest.add("mine.png").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        Manifest::begin(&folder, "render").unwrap();
        assert!(folder.join("mine.png").exists());
    }
}
