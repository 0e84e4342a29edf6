//! Tables of a recording. One that grows step by step has complete rows after a kill, except for the last.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;

use endowire_core::file::whole;
use endowire_core::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

pub use crate::columns::Row;

/// The remedy for what is no recording, or not whole.
pub(crate) const GIVE: &str = "give the folder of a recorded run (endowire run)";

/// A table whose first column is the number of a step.
pub(crate) struct StepTable {
    table: csv::Writer<File>,
}

impl StepTable {
    /// A new table. What is there is replaced, and no link followed.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        whole::remove(path)?;
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        Ok(Self { table: csv::Writer::from_writer(file) })
    }

    /// The table of a recording that resumes after step `steps`; rows of later steps are dropped. It is created if
    /// missing.
    pub(crate) fn go_on(path: &Path, steps: usize) -> io::Result<Self> {
        if !path.exists() {
            return Self::new(path);
        }
        let text = std::fs::read(path)?;
        let kept = text.split_inclusive(|byte| *byte == b'\n').enumerate().take_while(|(index, line)| {
            line.ends_with(b"\n") && (*index == 0 || step_of(line).is_some_and(|step| step <= steps))
        });
        let bytes: usize = kept.map(|(_, line)| line.len()).sum();
        Self::cut(path, bytes as u64)
    }

    /// The first bytes of a table that exists, to which more rows are added.
    pub(crate) fn cut(path: &Path, bytes: u64) -> io::Result<Self> {
        let file = OpenOptions::new().append(true).open(path)?;
        file.set_len(bytes)?;
        Ok(Self { table: csv::WriterBuilder::new().has_headers(bytes == 0).from_writer(file) })
    }

    /// Adds a row.
    pub(crate) fn push(&mut self, row: impl Serialize) -> io::Result<()> {
        Ok(self.table.serialize(row)?)
    }

    /// Hands all rows so far to the system.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.table.flush()
    }

    /// Syncs all rows to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.table.get_ref().sync_data()
    }

    /// Number of bytes so far.
    pub(crate) fn bytes(&self) -> io::Result<u64> {
        Ok(self.table.get_ref().metadata()?.len())
    }
}

/// The number of the step of a row.
pub(crate) fn step_of(line: &[u8]) -> Option<usize> {
    std::str::from_utf8(line).ok()?.split(',').next()?.parse().ok()
}

/// Writes a table of a recording, each time as a whole, because it has few rows; without rows there is no file.
pub(crate) fn write(path: &Path, rows: &[impl Serialize]) -> io::Result<()> {
    if rows.is_empty() {
        return whole::remove(path);
    }
    let mut table = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| table.serialize(row))?;
    whole::write_bytes(path, &table.into_inner().map_err(csv::IntoInnerError::into_error)?)
}

/// The rows of a table of a recording. An incomplete last row, left by a run that was killed, is dropped.
///
/// # Errors
/// [`Error::Content`] for a table that is missing, or has a row that is none or a number that is not finite: its line, its
/// column and what is wrong.
pub fn read<T: DeserializeOwned + Row>(path: &Path) -> Result<Vec<T>> {
    read_cut(path).map(|(rows, _)| rows)
}

/// As [`read`]; also whether an incomplete last row was dropped.
pub(crate) fn read_cut<T: DeserializeOwned + Row>(path: &Path) -> Result<(Vec<T>, bool)> {
    let (rows, is_cut) = parse::<T>(path, GIVE)?;
    let wrong = rows.iter().zip(2..).find_map(|(row, line)| Some((line, row.not_finite()?)));
    match wrong {
        Some((line, (column, number))) => {
            let remedy = "must be a finite number: run the scene again (endowire run)";
            let error = Error::parameter(format!("line {line}: {column}"), number, remedy);
            Err(Error::content(path, error.to_string()))
        }
        None => Ok((rows, is_cut)),
    }
}

/// As [`read`]; `None` if there is no file.
///
/// # Errors
/// As [`read`].
pub fn read_if_any<T: DeserializeOwned + Row>(path: &Path) -> Result<Option<Vec<T>>> {
    if path.exists() { read(path).map(Some) } else { Ok(None) }
}

/// The rows of a table of others, with a remedy for messages; its numbers are for the caller to check.
///
/// # Errors
/// As [`read`], but for numbers that are not finite.
pub fn read_other<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<Vec<T>> {
    parse(path, remedy).map(|(rows, _)| rows)
}

/// The whole rows of a table, and whether an incomplete last row was dropped.
fn parse<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<(Vec<T>, bool)> {
    let refused = |what: String| Error::content(path, format!("{what}; {remedy}"));
    let mut text = std::fs::read(path).map_err(|error| refused(error.to_string()))?;
    let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    let is_cut = whole < text.len();
    text.truncate(whole);
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let columns = reader.headers().cloned().unwrap_or_default();
    let rows: std::result::Result<_, _> = reader.into_deserialize().collect();
    Ok((rows.map_err(|error| refused(wrong_row(&error, &columns)))?, is_cut))
}

/// What is wrong with a row: its line, its column if that is known, and the reason.
fn wrong_row(error: &csv::Error, columns: &csv::StringRecord) -> String {
    let csv::ErrorKind::Deserialize { pos, err } = error.kind() else { return error.to_string() };
    let line = pos.as_ref().map_or_else(String::new, |pos| format!("line {}: ", pos.line()));
    let column = err.field().and_then(|field| columns.get(usize::try_from(field).ok()?));
    let column = column.map_or_else(String::new, |name| format!("{name}: "));
    format!("{line}{column}{}", err.kind())
}
