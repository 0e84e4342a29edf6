//! Rows on disk while a sweep goes on: a file of JSON lines to which each row is appended as soon as it is there.
//!
//! The first line says which sweep and which part of it the rows belong to. A program that is killed within a line leaves one without an end:
//! it is dropped when the sweep goes on, and its run is done again.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::row::{Columns, Row};
use crate::shard::Shard;

/// What rows belong to: the first line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Header {
    /// Names the format.
    format: String,
    /// Hash of the sweep.
    pub(crate) sweep: String,
    /// Its runs.
    pub(crate) runs: usize,
    pub(crate) shard: Shard,
    pub(crate) columns: Columns,
}

/// The format and its version.
const FORMAT: &str = "endowire sweep 2";

/// A power failure takes no more than the rows of so long.
const SYNC: Duration = Duration::from_secs(1);

impl Header {
    pub(crate) fn new(sweep: String, runs: usize, shard: Shard, columns: Columns) -> Self {
        Self { format: FORMAT.to_owned(), sweep, runs, shard, columns }
    }
}

/// The file of a sweep that goes on, held by one program at a time.
pub(crate) struct Journal {
    path: PathBuf,
    file: Mutex<(File, Instant)>,
}

/// A journal as it was found.
pub(crate) struct Found {
    pub(crate) header: Header,
    pub(crate) rows: Vec<Row>,
    /// Bytes of whole lines.
    bytes: u64,
}

impl Journal {
    /// Begins a journal, or goes on with that of the same sweep: the rows that are there.
    ///
    /// # Errors
    /// A file that cannot be written, that another program is writing, or that belongs to another sweep.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<(Self, Vec<Row>)> {
        let failed = |e| Error::file(path, e);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = file.map_err(failed)?;
        // Some network file systems have no locks: better a sweep without than none.
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

    /// Fails where the journal is not in its place any more: a file that is open takes what is written to it, also without a name.
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
    /// Reads a journal; none where its first line is not whole.
    ///
    /// # Errors
    /// A file that cannot be read, or whose lines are no rows.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>> {
        let text = endowire_core::file::read(path, u64::MAX)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        let mut lines = text[..whole].split_inclusive(|byte| *byte == b'\n').enumerate();
        let refuse = |line: usize, what: String| {
            let reason = format!("line {}: {what}: remove the line, or the file, and go on", line + 1);
            Error::content(path, reason)
        };
        let Some((_, first)) = lines.next() else { return Ok(None) };
        let header: Header = serde_json::from_slice(first).map_err(|e| refuse(0, e.to_string()))?;
        if header.format != FORMAT {
            return Err(refuse(0, format!("the format is {:?} and not {FORMAT:?}", header.format)));
        }
        let mut rows = Vec::new();
        for (index, line) in lines {
            let row: Row = serde_json::from_slice(line).map_err(|e| refuse(index, e.to_string()))?;
            if row.run >= header.runs || row.parameters.len() != header.columns.parameters.len() {
                return Err(refuse(index, format!("run {} is none of the sweep", row.run)));
            }
            rows.push(row);
        }
        Ok(Some(Self { header, rows, bytes: whole as u64 }))
    }
}
