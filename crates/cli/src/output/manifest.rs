//! Lists the files that a command has written into a folder. The list is kept in the folder, so that the next call
//! replaces these files and no others.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use super::whole::{remove, remove_unfinished_in, write_bytes};

/// The list of a running call.
pub(crate) struct Manifest {
    folder: PathBuf,
    path: PathBuf,
    file: File,
    names: BTreeSet<String>,
    /// Files of an earlier call, which stay until the first new one is there to replace them.
    earlier: BTreeSet<String>,
}

impl Manifest {
    /// Begins a list for `command` in `folder`, which keeps the files of an earlier call for now.
    pub(crate) fn begin(folder: &Path, command: &str) -> io::Result<Self> {
        let path = folder.join(format!(".endowire-{command}"));
        let earlier = listed(&path);
        // What a call that was killed was writing.
        remove_unfinished_in(folder, |name| name.to_str().is_some_and(|name| earlier.contains(name)))?;
        let text: String = earlier.iter().map(|name| format!("{name}\n")).collect();
        write_bytes(&path, text.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&path)?;
        Ok(Self { folder: folder.to_owned(), path, file, names: BTreeSet::new(), earlier })
    }

    /// Refuses a file that is there and that no earlier call has written, before anything is computed.
    pub(crate) fn check(&self, name: &str) -> io::Result<()> {
        let is_ours = self.names.contains(name) || self.earlier.contains(name);
        if is_ours || self.folder.join(name).symlink_metadata().is_err() {
            return Ok(());
        }
        let text = format!(
            "{name} is there already, and no earlier call of this command has written it: move it, or give another folder"
        );
        Err(io::Error::new(io::ErrorKind::AlreadyExists, text))
    }

    /// Removes the files of an earlier call, and returns their number.
    pub(crate) fn replace(&mut self) -> io::Result<usize> {
        let mut removed = 0;
        for name in &self.earlier {
            let file = self.folder.join(name);
            if file.symlink_metadata().is_ok() {
                remove(&file)?;
                removed += 1;
            }
        }
        self.file.set_len(0)?;
        self.earlier.clear();
        Ok(removed)
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
        self.check(name)?;
        if self.names.insert(name.to_owned()) {
            self.file.write_all(format!("{name}\n").as_bytes())?;
        }
        Ok(())
    }
}

/// The files of a list that lie directly in its folder.
fn listed(path: &Path) -> BTreeSet<String> {
    let Ok(text) = std::fs::read_to_string(path) else { return BTreeSet::new() };
    let is_name = |line: &&str| {
        let mut parts = Path::new(*line).components();
        matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None))
    };
    text.lines().filter(is_name).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listed_and_nothing_else_is_removed() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().join("inner");
        std::fs::create_dir(&folder).unwrap();
        let replaced = |command: &str| {
            let mut manifest = Manifest::begin(&folder, command).unwrap();
            (manifest.replace().unwrap(), manifest)
        };
        let (removed, mut manifest) = replaced("render");
        assert_eq!(removed, 0);
        for name in ["a.png", "b.png", "../outside.png", "gone.png"] {
            manifest.add(name).unwrap();
        }
        for name in ["a.png", "b.png", "../outside.png", "mine.png"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        // Each command has its own list, and a call that fails before it draws leaves what is there.
        assert_eq!(replaced("fluoro").0, 0);
        Manifest::begin(&folder, "render").unwrap();
        assert!(folder.join("a.png").exists());
        assert_eq!(replaced("render").0, 2);
        assert!(!folder.join("a.png").exists());
        assert!(folder.join("mine.png").exists() && outer.path().join("outside.png").exists());
        // Files of others are not overwritten, and the attempt does not put them on the list.
        let (_, mut manifest) = replaced("render");
        assert!(manifest.add("a.png").is_ok() && manifest.add("a.png").is_ok(), "the twin");
        assert_eq!(manifest.check("mine.png").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(manifest.add("mine.png").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        replaced("render");
        assert!(folder.join("mine.png").exists());
    }
}
