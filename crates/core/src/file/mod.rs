//! Files. Input files are regular files of bounded size, or data in memory for programs without a file system; files are
//! written by [`whole`], completely or not at all.

pub mod whole;

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Access to the files that a scene names.
pub trait Files: Debug + Send + Sync {
    /// The bytes of a file.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read, [`Error::Content`] if it has more than `limit` bytes.
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>>;
}

/// Files of the file system.
#[derive(Debug, Clone, Copy, Default)]
pub struct FileSystem;

impl Files for FileSystem {
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>> {
        read(path, limit)
    }
}

/// Files in memory, by their paths as scenes resolve them: for example, fetched by a web page.
#[derive(Debug, Clone, Default)]
pub struct InMemory(pub BTreeMap<PathBuf, Vec<u8>>);

impl Files for InMemory {
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>> {
        let bytes = self.0.get(path).ok_or_else(|| {
            let missing = io::Error::new(io::ErrorKind::NotFound, "this file was not given");
            Error::file(path, missing)
        })?;
        check_size(path, bytes.len() as u64, limit)?;
        Ok(bytes.clone())
    }
}

/// What a file is instead of any input, if its first bytes leave no doubt: a pointer, a page or an archive that holds it.
pub fn foreign(bytes: &[u8]) -> Option<&'static str> {
    const BEGINNINGS: [(&[u8], &str); 12] = [
        (b"version https://git-lfs", "is a pointer of Git LFS, not the file itself: fetch it (git lfs pull)"),
        (b"PK\x03\x04", "is a ZIP archive: unpack it, and name the file in it"),
        (b"PK\x05\x06", "is an empty ZIP archive"),
        (b"\x1f\x8b", "is a gzip archive: unpack it, and name the file in it"),
        (b"7z\xbc\xaf\x27\x1c", "is a 7z archive: unpack it, and name the file in it"),
        (b"Rar!\x1a\x07", "is a RAR archive: unpack it, and name the file in it"),
        (b"\xfd7zXZ\0", "is an xz archive: unpack it, and name the file in it"),
        (b"\x28\xb5\x2f\xfd", "is a zstd archive: unpack it, and name the file in it"),
        (b"BZh", "is a bzip2 archive: unpack it, and name the file in it"),
        (b"\x89PNG", "is a PNG picture, not the file that is meant"),
        (b"glTF\x02", "is a binary glTF file, which is not read: export the surface as STL, OBJ or PLY"),
        (b"%PDF-", "is a PDF document, not the file that is meant"),
    ];
    let page = || {
        let mark = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        let begins = |tag: &[u8]| mark.get(..tag.len()).is_some_and(|text| text.eq_ignore_ascii_case(tag));
        begins(b"<!doctype html") || begins(b"<html")
    };
    if page() {
        return Some(
            "is a web page, not the file itself: download the file (\"raw\" or \"download\" on that page)",
        );
    }
    BEGINNINGS.iter().find(|(begin, _)| bytes.starts_with(begin)).map(|(_, text)| *text)
}

/// The text of a file in UTF-8 or UTF-16, with or without a byte order mark.
///
/// # Errors
/// [`Error::Content`] for what is no text, with what it is instead where that is plain.
pub fn text(bytes: &[u8], path: &Path) -> Result<String> {
    if let Some(kind) = foreign(bytes) {
        return Err(Error::content(path, kind));
    }
    String::from_utf8(crate::text::without_mark(bytes).into_owned()).map_err(|e| {
        Error::content(path, format!("is no text in UTF-8 or UTF-16: {}: save it as UTF-8", e.utf8_error()))
    })
}

fn check_size(path: &Path, bytes: u64, limit: u64) -> Result<()> {
    if bytes > limit {
        return Err(Error::content(path, format!("is larger than {limit} bytes, the most that is read")));
    }
    Ok(())
}

/// The bytes of a regular file. Devices and pipes are refused, because they may be endless or block.
///
/// # Errors
/// [`Error::File`] if it cannot be read, [`Error::Content`] if it is not a regular file or has more than `limit`
/// bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let failed = |e| Error::file(path, e);
    let kind = std::fs::metadata(path).map_err(failed)?;
    if !kind.is_file() {
        let what = if kind.is_dir() { "a folder" } else { "a device or pipe" };
        return Err(Error::content(path, format!("is {what}: give a regular file")));
    }
    let mut bytes = Vec::new();
    // A file may grow while it is read, and some that claim to be regular report no length.
    File::open(path)
        .map_err(failed)?
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    check_size(path, bytes.len() as u64, limit)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_up_to_the_limit_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read(&path, 10).unwrap(), [7; 10]);
        assert!(read(&path, 9).unwrap_err().to_string().contains("larger than 9 bytes"));
        assert!(read(folder.path(), 9).unwrap_err().to_string().contains("is a folder"));
        assert!(matches!(read(&folder.path().join("b"), 9), Err(Error::File { .. })));
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero"), 9).unwrap_err().to_string().contains("regular file"));
    }

    #[test]
    fn files_in_memory_are_found_by_name_up_to_the_limit() {
        let path = Path::new("vessels/a.csv");
        let files = InMemory([(path.to_owned(), vec![7; 10])].into());
        assert_eq!(files.read(path, 10).unwrap(), [7; 10]);
        assert!(files.read(path, 9).unwrap_err().to_string().contains("larger than 9 bytes"));
        let missing = files.read(Path::new("vessels/b.csv"), 10).unwrap_err();
        assert!(matches!(missing, Error::File { .. }) && missing.to_string().contains("not given"));
    }
}
