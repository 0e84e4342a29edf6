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

/// A table whose first column is the number of a step. The rows of a step are collected, written together, and kept once
/// all tables of the recording have theirs; otherwise they are taken back.
pub(crate) struct StepTable<F = File> {
    file: F,
    /// Rows that are not written yet.
    rows: csv::Writer<Vec<u8>>,
    /// Length of the file up to the last step that is kept.
    kept_bytes: u64,
    /// Whether the file may be longer.
    is_longer: bool,
}

/// A file that only grows at its end, and can be cut.
pub(crate) trait Growing: io::Write {
    /// Cuts it to this length.
    fn cut(&mut self, bytes: u64) -> io::Result<()>;
}

impl Growing for File {
    fn cut(&mut self, bytes: u64) -> io::Result<()> {
        self.set_len(bytes)
    }
}

impl StepTable {
    /// A new table. What is there is replaced, and no link followed.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        whole::remove(path)?;
        Ok(Self::after(OpenOptions::new().append(true).create_new(true).open(path)?, 0))
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
        Ok(Self::after(file, bytes))
    }

    /// Syncs all rows to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Number of bytes so far.
    pub(crate) fn bytes(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }
}

impl<F: Growing> StepTable<F> {
    /// The table in a file of so many bytes.
    fn after(file: F, bytes: u64) -> Self {
        Self { file, rows: rows_after(bytes), kept_bytes: bytes, is_longer: false }
    }

    /// Adds a row to those that are written next.
    pub(crate) fn push(&mut self, row: impl Serialize + Row) -> io::Result<()> {
        match row.not_finite() {
            Some((column, number)) => {
                let text = format!("{column} = {number}: is no finite number, and is not recorded");
                Err(io::Error::new(io::ErrorKind::InvalidData, text))
            }
            None => Ok(self.rows.serialize(row)?),
        }
    }

    /// Hands the rows to the system.
    pub(crate) fn write(&mut self) -> io::Result<()> {
        if self.is_longer {
            self.file.cut(self.kept_bytes)?;
        }
        self.is_longer = true;
        self.rows.flush()?;
        self.file.write_all(self.rows.get_ref())
    }

    /// Keeps the rows that were written.
    pub(crate) fn keep(&mut self) {
        self.kept_bytes += self.rows.get_ref().len() as u64;
        (self.is_longer, self.rows) = (false, rows_after(self.kept_bytes));
    }

    /// Drops the rows that are not kept, whether they were written, in part, or not.
    pub(crate) fn take_back(&mut self) {
        self.rows = rows_after(self.kept_bytes);
        // If this fails, it is tried again before the next rows are written.
        self.is_longer = self.is_longer && self.file.cut(self.kept_bytes).is_err();
    }
}

/// Rows for a table of so many bytes; its first ones begin with the names of the columns.
fn rows_after(bytes: u64) -> csv::Writer<Vec<u8>> {
    csv::WriterBuilder::new().has_headers(bytes == 0).from_writer(Vec::new())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::UnknownRow;

    /// A disk with room for so many bytes, that takes what fits of a write and then fails.
    #[derive(Default)]
    struct Disk {
        bytes: Vec<u8>,
        room: usize,
        /// Number of times that it does not cut either.
        stuck: usize,
    }

    impl io::Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let fits = bytes.len().min(self.room - self.bytes.len());
            self.bytes.extend(&bytes[..fits]);
            if fits == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(fits) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Growing for Disk {
        fn cut(&mut self, bytes: u64) -> io::Result<()> {
            if self.stuck > 0 {
                self.stuck -= 1;
                return Err(io::ErrorKind::Other.into());
            }
            self.bytes.truncate(bytes as usize);
            Ok(())
        }
    }

    const WHOLE: &str =
        "step,unknown,x_mm,y_mm,z_mm\n1,0,0.5,0.0,0.0\n1,1,0.5,0.0,0.0\n2,0,0.5,0.0,0.0\n2,1,0.5,0.0,0.0\n";

    /// Writes the two rows of a step.
    fn write(table: &mut StepTable<Disk>, step: usize) -> io::Result<()> {
        for unknown in 0..2 {
            table.push(UnknownRow { step, unknown, x_mm: 0.5, y_mm: 0.0, z_mm: 0.0 })?;
        }
        table.write()
    }

    #[test]
    fn a_step_for_which_the_disk_has_no_room_is_taken_back_and_can_be_tried_again() {
        for room in 0..WHOLE.len() {
            for stuck in [0, 1] {
                let mut table = StepTable::after(Disk { room, stuck, ..Disk::default() }, 0);
                for step in 1..=2 {
                    if write(&mut table, step).is_err() {
                        table.take_back();
                        assert!(stuck == 1 || WHOLE.as_bytes().starts_with(&table.file.bytes));
                        assert!(stuck == 1 || table.file.bytes.is_empty() || step == 2);
                        table.file.room = WHOLE.len();
                        write(&mut table, step).unwrap();
                    }
                    table.keep();
                }
                assert_eq!(String::from_utf8(table.file.bytes).unwrap(), WHOLE, "room for {room} bytes");
            }
        }
    }

    #[test]
    fn a_step_that_another_table_could_not_write_is_taken_back() {
        let mut table = StepTable::after(Disk { room: WHOLE.len(), ..Disk::default() }, 0);
        for step in [1, 2] {
            write(&mut table, step).unwrap();
            table.take_back();
            write(&mut table, step).unwrap();
            table.keep();
        }
        assert_eq!(String::from_utf8(table.file.bytes).unwrap(), WHOLE);
    }

    #[test]
    fn a_number_that_is_not_finite_is_not_recorded() {
        let mut table = StepTable::after(Disk::default(), 0);
        let row = UnknownRow { step: 1, unknown: 0, x_mm: 0.5, y_mm: f64::NAN, z_mm: 0.0 };
        let reported = table.push(row).unwrap_err().to_string();
        assert_eq!(reported, "y_mm = NaN: is no finite number, and is not recorded");
    }
}
