//! Shards into one table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use endowire_core::{Error, Result};

use crate::journal::{Found, Header};
use crate::row::Row;
use crate::shard::STEM;
use crate::table;

/// Writes one table of all rows in these folders, which together hold one sweep; its number of runs. In whatever order they are given, and
/// whatever the shards, the file is to the byte that of a sweep in one piece.
///
/// # Errors
/// A folder without rows, rows of different sweeps, runs that differ from shard to shard or are missing, a file that cannot be written.
pub fn merge(folders: &[PathBuf], out: &Path) -> Result<usize> {
    let Some((header, rows)) = gathered(folders)? else {
        let mend = "no rows in these folders: give those of endowire sweep --out";
        return Err(Error::parameter("merge", listed(folders), mend));
    };
    let missing: Vec<usize> = (0..header.runs).filter(|run| !rows.contains_key(run)).collect();
    if let Some(run) = missing.first() {
        let mend = format!(
            "{} of {} runs are missing, run {run} the first: go on with the shards that have not ended, or give their folders too",
            missing.len(),
            header.runs
        );
        return Err(Error::parameter("merge", listed(folders), mend));
    }
    let rows: Vec<Row> = rows.into_values().collect();
    table::write(out, &header.columns, &rows)?;
    Ok(rows.len())
}

/// The rows of a sweep as they are read by people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Names of the columns, those of the Parquet table.
    pub columns: Vec<String>,
    /// Their values, by the numbers of the runs; what there is not is empty.
    pub rows: Vec<Vec<String>>,
    /// Runs of the sweep, those included that have no row yet.
    pub runs: usize,
}

/// What there is of a sweep in a folder, also of one that goes on; none where there are no rows.
///
/// # Errors
/// As [`merge`], but for runs that are missing.
pub fn table_of(folder: &Path) -> Result<Option<Table>> {
    let Some((header, rows)) = gathered(&[folder.to_owned()])? else { return Ok(None) };
    let rows: Vec<Row> = rows.into_values().collect();
    let (columns, rows) = table::as_texts(&header.columns, &rows);
    Ok(Some(Table { columns, rows, runs: header.runs }))
}

/// All rows in these folders, by their runs.
fn gathered(folders: &[PathBuf]) -> Result<Option<(Header, BTreeMap<usize, Row>)>> {
    let mut rows: BTreeMap<usize, Row> = BTreeMap::new();
    let mut first: Option<(PathBuf, Header)> = None;
    for path in journals(folders)? {
        let Some(found) = Found::read(&path)? else { continue };
        if let Some((other, header)) = &first
            && (&header.sweep, header.runs, &header.columns)
                != (&found.header.sweep, found.header.runs, &found.header.columns)
        {
            let reason = format!("has rows of another sweep than {}: merge shards of one", other.display());
            return Err(Error::content(&path, reason));
        }
        for row in found.rows {
            let run = row.run;
            if rows.get(&run).is_some_and(|other| *other != row) {
                let reason = format!("run {run} differs from that of another shard: leave one of them out");
                return Err(Error::content(&path, reason));
            }
            rows.insert(run, row);
        }
        first.get_or_insert((path, found.header));
    }
    Ok(first.map(|(_, header)| (header, rows)))
}

/// Files of rows in folders, in an order of their own.
fn journals(folders: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for folder in folders {
        let failed = |e| Error::file(folder, e);
        for entry in std::fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            if stem.starts_with(STEM) && path.extension().is_some_and(|ending| ending == "jsonl") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    Ok(paths)
}

fn listed(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(" ")
}
