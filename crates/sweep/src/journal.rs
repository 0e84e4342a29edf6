//! Rows on disk during a sweep: a file of JSON lines to which each row is appended as soon as it is computed.
//!
//! The first line identifies the sweep and the part of it that the rows belong to. A program that is killed while
//! writing leaves an incomplete line; it is dropped when the sweep resumes, and its run is repeated.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use endowire_core::input::plain;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::row::{Columns, Row};
use crate::shard::Shard;

/// The first line: identifies the sweep of the rows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Header {
    /// Name and version of the format.
    format: String,
    /// Hash of the sweep.
    pub(crate) sweep: String,
    /// Number of runs of the whole sweep.
    pub(crate) runs: usize,
    pub(crate) shard: Shard,
    pub(crate) columns: Columns,
}

/// The current format.
const FORMAT: &str = "endowire sweep 3";

/// Interval between syncs to disk: a power failure loses at most the rows written within it.
const SYNC: Duration = Duration::from_secs(1);

impl Header {
    pub(crate) fn new(sweep: String, runs: usize, shard: Shard, columns: Columns) -> Self {
        Self { format: FORMAT.to_owned(), sweep, runs, shard, columns }
    }
}

/// The journal of a running sweep, locked against other programs.
pub(crate) struct Journal {
    path: PathBuf,
    file: Mutex<(File, Instant)>,
}

/// Content of an existing journal.
pub(crate) struct Found {
    pub(crate) header: Header,
    pub(crate) rows: Vec<Row>,
    /// Number of bytes of complete lines.
    bytes: u64,
}

impl Journal {
    /// Creates a journal, or opens that of the same sweep and returns its rows.
    ///
    /// # Errors
    /// A file that cannot be written, that another program is writing, or that belongs to another sweep.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<(Self, Vec<Row>)> {
        let failed = |e| Error::file(path, e);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = file.map_err(failed)?;
        // Some network file systems have no locks; there the sweep runs without one.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let reason =
                "another program is carrying out this sweep: wait until it has ended, or give another folder";
            return Err(Error::content(path, reason));
        }
        let found = Found::read(path)?;
        let (rows, bytes) = match found {
            Some(found) if found.header == *header => (found.rows, found.bytes),
            Some(_) => {
                let reason = "has rows of another sweep (or the sweep, its scene or a file of it has changed since): give another \
                              folder, or remove this file";
                return Err(Error::content(path, reason));
            }
            None => (vec![], 0),
        };
        file.set_len(bytes).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let journal = Self { path: path.to_path_buf(), file: Mutex::new((file, Instant::now())) };
        if bytes == 0 {
            journal.write(header)?;
        }
        Ok((journal, rows))
    }

    /// Appends a row.
    pub(crate) fn push(&self, row: &Row) -> Result<()> {
        self.write(row)
    }

    fn write(&self, line: &impl Serialize) -> Result<()> {
        let failed = |e| Error::file(&self.path, e);
        let text = serde_json::to_string(line).map_err(|e| failed(e.into()))? + "\n";
        let mut guard = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let (file, synced) = &mut *guard;
        file.write_all(text.as_bytes()).map_err(failed)?;
        if synced.elapsed() >= SYNC {
            file.sync_data().map_err(failed)?;
            *synced = Instant::now();
        }
        self.check_there(file)
    }

    /// Fails if the journal was removed or replaced: an open file still accepts writes after it has been deleted.
    fn check_there(&self, file: &File) -> Result<()> {
        match (file.metadata(), self.path.metadata()) {
            (Ok(own), Ok(there)) if there.len() == own.len() => Ok(()),
            _ => Err(Error::Computation(format!(
                "{}: was removed or replaced while the sweep went on, and its rows with it: carry it out again",
                self.path.display()
            ))),
        }
    }
}

impl Found {
    /// Reads a journal; `None` if its first line is incomplete.
    ///
    /// # Errors
    /// A file that cannot be read, or that contains an invalid line.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>> {
        let text = endowire_core::file::read(path, u64::MAX)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        let mut lines = text[..whole].split_inclusive(|byte| *byte == b'\n').enumerate();
        let refuse = |line: usize, what: String| {
            let reason = format!("line {}: {what}: remove the line, or the file, and go on", line + 1);
            Error::content(path, reason)
        };
        let Some((_, first)) = lines.next() else { return Ok(None) };
        let header: Header = serde_json::from_slice(first).map_err(|e| refuse(0, plain(&e.to_string())))?;
        if header.format != FORMAT {
            return Err(refuse(0, format!("the format is {:?} and not {FORMAT:?}", header.format)));
        }
        let mut rows = Vec::new();
        for (index, line) in lines {
            let row: Row = serde_json::from_slice(line).map_err(|e| refuse(index, plain(&e.to_string())))?;
            if row.run >= header.runs || row.parameters.len() != header.columns.parameters.len() {
                return Err(refuse(index, format!("run {} is none of the sweep", row.run)));
            }
            rows.push(row);
        }
        Ok(Some(Self { header, rows, bytes: whole as u64 }))
    }
}
