//! Input files: regular ones of bounded size.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::{Error, Result};

/// The bytes of a regular file. Devices and pipes are refused, which could be endless or never answer.
///
/// # Errors
/// [`Error::File`] for what cannot be read, [`Error::Content`] for what is no regular file or has more than `limit` bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let failed = |e| Error::file(path, e);
    let kind = std::fs::metadata(path).map_err(failed)?;
    if !kind.is_file() {
        let what = if kind.is_dir() { "a folder" } else { "a device or pipe" };
        return Err(Error::content(path, format!("is {what}: give a regular file")));
    }
    let mut bytes = Vec::new();
    // A file may grow while it is read, and some that call themselves regular tell no length.
    File::open(path)
        .map_err(failed)?
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    if bytes.len() as u64 > limit {
        return Err(Error::content(path, format!("is larger than {limit} bytes, the most that is read")));
    }
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
}
