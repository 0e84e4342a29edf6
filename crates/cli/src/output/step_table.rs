//! A table of a recording that grows step by step. A killed run leaves complete rows, except for the last.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;

use serde::Serialize;

/// A table whose first column is the number of a step.
pub(super) struct StepTable {
    table: csv::Writer<File>,
}

impl StepTable {
    /// A new table.
    pub(super) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self { table: csv::Writer::from_writer(File::create(path)?) })
    }

    /// The table of a recording that resumes after step `steps`; rows of later steps are dropped. It is created if
    /// missing.
    pub(super) fn go_on(path: &Path, steps: usize) -> io::Result<Self> {
        if !path.exists() {
            return Self::new(path);
        }
        let text = std::fs::read(path)?;
        let kept = text.split_inclusive(|byte| *byte == b'\n').enumerate().take_while(|(index, line)| {
            let number = || std::str::from_utf8(line).ok()?.split(',').next()?.parse::<usize>().ok();
            line.ends_with(b"\n") && (*index == 0 || number().is_some_and(|step| step <= steps))
        });
        let bytes: usize = kept.map(|(_, line)| line.len()).sum();
        let file = OpenOptions::new().append(true).open(path)?;
        file.set_len(bytes as u64)?;
        Ok(Self { table: csv::WriterBuilder::new().has_headers(bytes == 0).from_writer(file) })
    }

    /// Adds a row.
    pub(super) fn push(&mut self, row: impl Serialize) -> io::Result<()> {
        Ok(self.table.serialize(row)?)
    }

    /// Hands all rows so far to the system.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.table.flush()
    }

    /// Syncs all rows to disk.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.table.get_ref().sync_data()
    }
}
