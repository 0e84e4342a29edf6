//! Small tables beside steps.csv, with one type per row.

use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::whole;
use crate::failure::Failure;

/// Writes a table of a recording, each time as a whole, because it has few rows; without rows there is no file.
pub(super) fn write(path: &Path, rows: &[impl Serialize]) -> Result<(), Failure> {
    let written = if rows.is_empty() { whole::remove(path) } else { write_some(path, rows) };
    written.map_err(|e| Failure::write(path, &e))
}

fn write_some(path: &Path, rows: &[impl Serialize]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| table.serialize(row))?;
    whole::write_bytes(path, &table.into_inner().map_err(csv::IntoInnerError::into_error)?)
}

/// Reads the rows of a table; empty if there is no file.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Failure> {
    let mut text = match std::fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(vec![]),
        read => read.map_err(|e| refused(path, &e.to_string()))?,
    };
    // A killed run may leave an incomplete row.
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let rows = csv::Reader::from_reader(text.as_slice()).into_deserialize();
    rows.collect::<Result<_, _>>().map_err(|e: csv::Error| refused(path, &e.to_string()))
}

/// The error for a table that does not belong to a recording.
pub(super) fn refused(path: &Path, what: &str) -> Failure {
    Failure::Input(format!("{}: {what}; run the scene again (endowire run)", path.display()))
}
