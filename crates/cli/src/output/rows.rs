//! Small tables beside steps.csv, a type for a row.

use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::whole;
use crate::failure::Failure;

/// Writes a table of a recording: whole each time, for there are few rows; without rows there is none.
pub(super) fn write(path: &Path, rows: &[impl Serialize]) -> Result<(), Failure> {
    let written = if rows.is_empty() { whole::remove(path) } else { write_some(path, rows) };
    written.map_err(|e| Failure::write(path, &e))
}

fn write_some(path: &Path, rows: &[impl Serialize]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| table.serialize(row))?;
    whole::write_bytes(path, &table.into_inner().map_err(csv::IntoInnerError::into_error)?)
}

/// The rows of a table; none where there is none.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Failure> {
    let mut text = match std::fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(vec![]),
        read => read.map_err(|e| refused(path, &e.to_string()))?,
    };
    // A run may have been killed within a row.
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let rows = csv::Reader::from_reader(text.as_slice()).into_deserialize();
    rows.collect::<Result<_, _>>().map_err(|e: csv::Error| refused(path, &e.to_string()))
}

/// A table that is none of a recording.
pub(super) fn refused(path: &Path, what: &str) -> Failure {
    Failure::Input(format!("{}: {what}; run the scene again (endowire run)", path.display()))
}
